//! A single slice: a flat image.

use super::super::affine::{self, Affine, World};
use super::super::any_image::AnyImage;
use super::super::note::{LoadedImage, ReadNote};
use super::super::options::GivenFrame;
use super::header::Plane;
use super::series::unit_axes;
use super::{FORMAT, MILLIMETRE, WORLD};

/// A single slice without its samples: where it is if it lies across z, else its spacing alone.
pub(super) struct Flat {
    pub affine: Affine,
    world: World,
    /// What is said of the spacing.
    note: Option<ReadNote>,
}

impl Flat {
    pub fn of(plane: &Plane, shape: [usize; 2], given: GivenFrame) -> Self {
        let spacing = plane.spacing.or(plane.imager_spacing);
        let note = match (plane.spacing, plane.imager_spacing) {
            (Some(_), _) => None,
            (None, Some(spacing)) => Some(ReadNote::AtDetector { spacing }),
            (None, None) => Some(ReadNote::NoSpacing),
        };
        let [sx, sy] = spacing.unwrap_or([1.0; 2]);
        let axes = plane.axes.map_or(Some([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), unit_axes);
        if let Some([x, y]) = axes {
            let step = [0.0, 0.0, 1.0];
            let matrix = std::array::from_fn(|r| [x[r] * sx, y[r] * sy, step[r]]);
            let affine = Affine { matrix, origin: plane.position.unwrap_or_default() };
            let affine = affine.turned_from(WORLD).with_given(given);
            if affine::flat_frame(FORMAT, shape, affine).is_ok() {
                return Self { affine, world: WORLD, note };
            }
        }
        let affine = Affine::scaling([sx, sy, 1.0]).with_given(given);
        Self { affine, world: World::Ours, note }
    }

    /// The image with what is known of it.
    pub fn loaded(&self, image: AnyImage) -> LoadedImage {
        let units = match self.note {
            Some(ReadNote::NoSpacing) => Vec::new(),
            _ => vec![MILLIMETRE.into(); 2],
        };
        LoadedImage { units, ..image.into() }.noting(self.world.note()).noting(self.note.clone())
    }
}
