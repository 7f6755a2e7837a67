//! An image as writers see it, whatever its dimension.

use atomesh::image::{Image, Samples};

use super::affine::Affine;

/// Frame and samples of an image. Axes that it does not have are those of the world, with spacing 1 and
/// origin 0.
pub(super) struct ImageView<'a> {
    /// Samples along x, y (and z).
    pub shape: Vec<usize>,
    pub spacing: [f64; 3],
    pub origin: [f64; 3],
    pub direction: [[f64; 3]; 3],
    pub is_mirrored: bool,
    pub samples: &'a Samples,
}

impl<'a> ImageView<'a> {
    pub fn of<const D: usize>(image: &'a Image<D>) -> Self {
        let frame = image.frame();
        let (mut origin, mut spacing) = ([0.0; 3], [1.0; 3]);
        let mut direction = Affine::scaling([1.0; 3]).matrix;
        origin[..D].copy_from_slice(&frame.origin());
        spacing[..D].copy_from_slice(&frame.spacing());
        for (row, of_frame) in direction.iter_mut().zip(frame.direction()) {
            row[..D].copy_from_slice(&of_frame);
        }
        let (shape, is_mirrored) = (frame.shape().to_vec(), frame.is_mirrored());
        Self { shape, spacing, origin, direction, is_mirrored, samples: image.samples() }
    }

    /// The number of axes, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.shape.len()
    }

    /// Sample indices to world coordinates; a flat image lies in the plane z = 0.
    pub fn affine(&self) -> Affine {
        let scaled = |r: usize, c: usize| self.direction[r][c] * self.spacing[c];
        Affine {
            matrix: std::array::from_fn(|r| std::array::from_fn(|c| scaled(r, c))),
            origin: self.origin,
        }
    }
}
