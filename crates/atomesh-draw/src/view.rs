//! The three slices of an image in space, as in the upper left of the paper's figure 9.
//!
//! A parallel projection from above. The slices cut each other into quarters, which are painted from
//! the farthest to the nearest: first those beyond the horizontal slice, and on each side of it first those beyond the
//! slice normal to x.

use atomesh::geometry::{Point, cross, difference, dot};
use atomesh::image::Image;

use crate::raster::Ramp;
use crate::shape::{Place, Rect, Shape};
use crate::style::Style;

/// How far the box is turned about the vertical, and how far the eye is above it, in radians.
const TURN: f64 = 0.6;
const ELEVATION: f64 = 0.45;

/// The part of the panel that stays empty on each side.
const MARGIN: f64 = 0.04;

/// The grey of the brightest sample; brighter than elsewhere, since there are no edges.
pub(crate) const BRIGHTNESS: f64 = 0.85;

/// The colours behind the slices and of their outlines.
pub(crate) const BACKGROUND: [u8; 3] = [58, 62, 72];
pub(crate) const OUTLINE: [u8; 3] = [150, 150, 150];

/// The slices through sample `at`, fitted into `rect`.
pub(crate) fn view(image: &Image<3>, at: [usize; 3], style: &Style, rect: Rect) -> Vec<Shape> {
    let grid = image.frame().grid(style.units);
    let camera = Camera::new(style.z_up);
    let fit = camera.fit(&std::array::from_fn(|k| grid.shape[k] as f64 * grid.step[k]), &rect);
    let step = grid.step;
    let scene =
        View { image, at, step, ramp: Ramp::robust(image.samples(), BRIGHTNESS), camera, fit };
    let mut shapes = vec![Shape::Fill { rect, color: BACKGROUND }];
    let [far_x, near_x] = camera.far_to_near(0);
    let [far_y, near_y] = camera.far_to_near(1);
    for (i, z) in camera.far_to_near(2).into_iter().enumerate() {
        if i == 1 {
            for x in [far_x, near_x] {
                shapes
                    .extend([far_y, near_y].into_iter().flat_map(|y| scene.quarter(2, [x, y, z])));
            }
        }
        shapes.extend(scene.quarter(1, [far_x, far_y, z]));
        shapes.extend([far_y, near_y].into_iter().flat_map(|y| scene.quarter(0, [far_x, y, z])));
        shapes.extend(scene.quarter(1, [near_x, far_y, z]));
    }
    shapes
}

/// Before or after the sample at which the slices meet, along an axis.
#[derive(Clone, Copy, PartialEq)]
enum Half {
    Low,
    High,
}

/// The direction of each axis in the picture (right, down), and the direction away from the eye.
#[derive(Clone, Copy)]
pub(crate) struct Camera {
    axes: [Place; 3],
    pub away: Point<3>,
}

impl Camera {
    /// If z points down, y points toward the eye; if z points up, away from it. So nothing is mirrored.
    pub fn new(z_up: bool) -> Self {
        let sign = if z_up { 1.0 } else { -1.0 };
        let ((sin, cos), (rise, run)) = (TURN.sin_cos(), ELEVATION.sin_cos());
        Self {
            axes: [[cos, -sin * rise], [-sign * sin, -sign * cos * rise], [0.0, -sign * run]],
            away: [sin * run, sign * cos * run, -sign * rise],
        }
    }

    fn far_to_near(&self, axis: usize) -> [Half; 2] {
        if self.away[axis] > 0.0 { [Half::High, Half::Low] } else { [Half::Low, Half::High] }
    }

    pub fn project(&self, p: &Point<3>) -> Place {
        std::array::from_fn(|k| (0..3).map(|axis| p[axis] * self.axes[axis][k]).sum())
    }

    /// How far a facet faces the eye: 0 seen edge-on, or without an area, to 1 from the front.
    pub fn facing(&self, [a, b, c]: &[Point<3>; 3]) -> f64 {
        let normal = cross(&difference(b, a), &difference(c, a));
        let size = dot(&normal, &normal).sqrt();
        if size > 0.0 { dot(&normal, &self.away).abs() / size } else { 0.0 }
    }

    /// How large a box of these sides is as it is seen, with its margins.
    pub fn seen(&self, sides: &Point<3>) -> Place {
        let (min, max) = self.outline(sides);
        std::array::from_fn(|k| (max[k] - min[k]) / (1.0 - 2.0 * MARGIN))
    }

    /// The least and the greatest places of a box of these sides.
    fn outline(&self, sides: &Point<3>) -> (Place, Place) {
        let corners = (0..8).map(|i| {
            let corner = std::array::from_fn(|k| if i >> k & 1 == 1 { sides[k] } else { 0.0 });
            self.project(&corner)
        });
        let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for c in corners {
            for k in 0..2 {
                (min[k], max[k]) = (min[k].min(c[k]), max[k].max(c[k]));
            }
        }
        (min, max)
    }

    /// What puts a box of these sides into the middle of the rectangle.
    pub fn fit(&self, sides: &Point<3>, rect: &Rect) -> Fit {
        let (min, max) = self.outline(sides);
        let scale = |k: usize| rect.size[k] * (1.0 - 2.0 * MARGIN) / (max[k] - min[k]);
        let scale = scale(0).min(scale(1));
        let middle = |k: usize| rect.corner[k] + rect.size[k] / 2.0;
        let shift = std::array::from_fn(|k| middle(k) - scale * (min[k] + max[k]) / 2.0);
        Fit { scale, shift }
    }
}

/// The scale and then the shift that fit what a camera sees into its panel.
#[derive(Clone, Copy)]
pub(crate) struct Fit {
    scale: f64,
    shift: Place,
}

impl Fit {
    pub fn place(&self, seen: Place) -> Place {
        std::array::from_fn(|k| self.shift[k] + self.scale * seen[k])
    }
}

/// The edges of a box, four along each axis: the numbers of their ends, of which bit k says on which side of axis k a corner
/// lies, and where these are.
pub(crate) fn box_edges(
    first: &Point<3>,
    extent: &Point<3>,
) -> impl Iterator<Item = ([usize; 2], [Point<3>; 2])> {
    let (first, extent) = (*first, *extent);
    let corner = move |at: usize| -> Point<3> {
        std::array::from_fn(|k| first[k] + extent[k] * (at >> k & 1) as f64)
    };
    let along =
        |k: usize| (0..8_usize).filter(move |at| at >> k & 1 == 0).map(move |at| [at, at | 1 << k]);
    (0..3).flat_map(along).map(move |ends| (ends, ends.map(corner)))
}

struct View<'a> {
    image: &'a Image<3>,
    at: [usize; 3],
    /// The sides of a sample.
    step: [f64; 3],
    ramp: Ramp,
    camera: Camera,
    fit: Fit,
}

impl View<'_> {
    /// The quarter of the slice normal to an axis that lies in the given halves of the other axes;
    /// nothing if it has no samples.
    fn quarter(&self, normal: usize, halves: [Half; 3]) -> Vec<Shape> {
        let shape = self.image.frame().shape();
        let strides = [1, shape[0], shape[0] * shape[1]];
        let (right, down) = ((normal + 1) % 3, (normal + 2) % 3);
        let span = |axis: usize| match halves[axis] {
            Half::Low => 0..self.at[axis],
            Half::High => self.at[axis]..shape[axis],
        };
        let (columns, rows) = (span(right), span(down));
        if columns.is_empty() || rows.is_empty() {
            return vec![];
        }
        let mut start = self.at;
        (start[right], start[down]) = (columns.start, rows.start);
        let first: usize = (0..3).map(|k| start[k] * strides[k]).sum();
        let raster = self.ramp.raster(self.image.samples(), columns.len(), rows.len(), |i, j| {
            first + i * strides[right] + j * strides[down]
        });
        let side = |axis: usize, count: usize| -> Place {
            self.camera.axes[axis].map(|v| v * self.fit.scale * self.step[axis] * count as f64)
        };
        let first = std::array::from_fn(|k| start[k] as f64 * self.step[k]);
        let corner = self.fit.place(self.camera.project(&first));
        let (right, down) = (side(right, columns.len()), side(down, rows.len()));
        let add = |a: Place, b: Place| [a[0] + b[0], a[1] + b[1]];
        let others = [add(corner, right), add(add(corner, right), down), add(corner, down)];
        let lines = [corner, others[0], others[1], others[2], corner];
        let lines = lines.windows(2).map(|l| [l[0], l[1]]).collect();
        let outline = Shape::Lines { lines, width: 1.0, color: OUTLINE };
        vec![Shape::Image { raster, corner, right, down }, outline]
    }
}
