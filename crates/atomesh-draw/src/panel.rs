//! The panels of a picture of space: three slices in their places, the fourth left to a view.

use atomesh::geometry::Point;
use atomesh::image::{Image, Units};

use crate::raster::Ramp;
use crate::shape::{Place, Rect, Shape};

/// Pixels between panels.
pub(crate) const GAP: f64 = 4.0;

/// The colour of the lines that show the other slices.
const CROSS_HAIR: [u8; 3] = [230, 0, 0];

/// A slice: its name, the axis it is normal to, and the axes drawn to the right and down.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slice {
    pub name: &'static str,
    pub normal: usize,
    pub right: usize,
    pub down: usize,
}

/// The slices in the paper's places: X-Y upper right, Y-Z lower left, X-Z lower right, so that x is
/// shared by the right panels and z by the lower ones.
const SLICES: [(Slice, [usize; 2]); 3] = [
    (Slice { name: "X-Y", normal: 2, right: 0, down: 1 }, [1, 0]),
    (Slice { name: "Y-Z", normal: 0, right: 1, down: 2 }, [0, 1]),
    (Slice { name: "X-Z", normal: 1, right: 0, down: 2 }, [1, 1]),
];

/// A slice in its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Panel {
    pub slice: Slice,
    pub rect: Rect,
    /// The least sample coordinates of the box.
    first: Point<3>,
    /// Pixels per sample along each axis.
    pixels: Point<3>,
    /// Whether the axis drawn downward is reversed.
    pub is_flipped: bool,
}

impl Panel {
    /// The panels of a box of `sides` pixels, from sample coordinates `first` on, with `pixels` per sample.
    pub fn all(first: Point<3>, sides: Point<3>, pixels: Point<3>, z_up: bool) -> [Self; 3] {
        SLICES.map(|(slice, steps)| {
            let corner = steps.map(|step| step as f64 * (sides[1] + GAP));
            let size = [slice.right, slice.down].map(|k| sides[k]);
            let is_flipped = z_up && slice.down == 2;
            Self { slice, rect: Rect { corner, size }, first, pixels, is_flipped }
        })
    }

    /// The place of a point in the picture, projected along the normal.
    pub fn place(&self, p: &Point<3>) -> Place {
        let axes = [self.slice.right, self.slice.down];
        let [x, y] = axes.map(|k| (p[k] - self.first[k]) * self.pixels[k]);
        let y = if self.is_flipped { self.rect.size[1] - y } else { y };
        [self.rect.corner[0] + x, self.rect.corner[1] + y]
    }

    /// The slice of the image through sample `at`.
    pub fn image(&self, image: &Image<3>, at: [usize; 3], units: Units, ramp: &Ramp) -> Shape {
        let Slice { normal, right, down, .. } = self.slice;
        let grid = image.frame().grid(units);
        let (shape, strides) = (grid.shape, grid.strides());
        let start = at[normal] * strides[normal];
        let raster = ramp.raster(image.samples(), shape[right], shape[down], |i, j| {
            let j = if self.is_flipped { shape[down] - 1 - j } else { j };
            start + i * strides[right] + j * strides[down]
        });
        Shape::upright(raster, self.rect)
    }

    /// The lines that show the other slices, which pass through `at`.
    pub fn cross_hair(&self, at: &Point<3>) -> Shape {
        let Rect { corner, size } = self.rect;
        let [x, y] = self.place(at);
        let end = [corner[0] + size[0], corner[1] + size[1]];
        let lines = vec![[[corner[0], y], [end[0], y]], [[x, corner[1]], [x, end[1]]]];
        Shape::Lines { lines, width: 1.0, color: CROSS_HAIR }
    }
}
