//! Images on the samples of another frame.

use crate::parallel::prelude::*;

use super::place::coordinates;
use super::{Frame, Image, Samples, Units};
use crate::geometry::{Bounds, Point};

/// Samples this near to each other are at one place, in samples: headers are rounded.
const SAME: f64 = 0.02;

/// How far outside of the outermost samples an image still reaches, in samples: each stands for the box around it.
const MARGIN: f64 = 0.5 + 1e-6;

/// How the samples of one frame run through those of another that are at the same places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleOrder<const D: usize> {
    /// The other frame's axis along which each axis runs.
    pub axes: [usize; D],
    /// Whether it runs against that.
    pub is_flipped: [bool; D],
}

impl<const D: usize> SampleOrder<D> {
    /// Whether both frames have their samples in one order.
    pub fn is_same(&self) -> bool {
        (0..D).all(|k| self.axes[k] == k && !self.is_flipped[k])
    }
}

/// How values are found between samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Between {
    /// The nearest sample's, for labels; 0 outside of the image.
    Nearest,
    /// Linear between the samples around; outside of the image this value, or else that of the nearest sample.
    Linear {
        /// The value outside.
        outside: Option<f64>,
    },
}

impl<const D: usize> Frame<D> {
    /// How this frame's samples run through those of `other`, if all of them lie at the places of all of the other's, to
    /// 0.02 samples.
    pub fn order_in(&self, other: &Self) -> Option<SampleOrder<D>> {
        let map = IndexMap::between(self, other);
        let mut order = SampleOrder { axes: [0; D], is_flipped: [false; D] };
        for k in 0..D {
            let along = |j: usize| map.columns[k][j];
            let axis = (0..D).fold(0, |a, j| if along(j).abs() > along(a).abs() { j } else { a });
            (order.axes[k], order.is_flipped[k]) = (axis, along(axis) < 0.0);
            if order.axes[..k].contains(&axis) || self.shape()[k] != other.shape()[axis] {
                return None;
            }
        }
        let bounds = self.grid(Units::Samples).bounds();
        let is_there = |corner: Point<D>| {
            let found = map.of(&corner);
            (0..D).all(|k| {
                let end = bounds.max[k];
                let expected = if order.is_flipped[k] { end - corner[k] } else { corner[k] };
                (found[order.axes[k]] - expected).abs() <= SAME
            })
        };
        bounds.corners().all(is_there).then_some(order)
    }

    /// The box of the samples in the world, as `x0..x1,y0..y1[,z0..z1]`.
    pub fn world_box(&self) -> String {
        let corners = self.grid(Units::Samples).bounds().corners();
        let places: Vec<Point<D>> =
            corners.map(|corner| self.lattice_to_world(Units::Samples, &corner)).collect();
        let bounds = Bounds::of(&places).expect("a box has corners");
        let side = |k: usize| format!("{}..{}", bounds.min[k], bounds.max[k]);
        (0..D).map(side).collect::<Vec<_>>().join(",")
    }
}

impl<const D: usize> Image<D> {
    /// The image with its samples in the order of `frame`, at the same places; `order` is that of the frame in the image's.
    pub fn reordered(self, frame: &Frame<D>, order: SampleOrder<D>) -> Self {
        if order.is_same() {
            let samples = self.into_parts().1;
            return Self { frame: *frame, samples, absent: None };
        }
        let (strides, shape) = (self.frame.grid(Units::Samples).strides(), frame.shape());
        let from = |index: usize| {
            let at = coordinates(index, shape);
            let along = |k: usize| {
                let place = if order.is_flipped[k] { shape[k] - 1 - at[k] } else { at[k] };
                place * strides[order.axes[k]]
            };
            Some((0..D).map(along).sum())
        };
        let samples = self.samples.picked(frame.sample_count(), from);
        Self { frame: *frame, samples, absent: None }
    }

    /// The image's values at the samples of `frame`, and how many of these lie outside of the image.
    pub fn resampled(&self, frame: &Frame<D>, between: Between) -> (Self, usize) {
        let (own, map) = (self.frame.shape(), IndexMap::between(frame, &self.frame));
        let count = frame.sample_count();
        let at = |index: usize| map.of(&coordinates(index, frame.shape()).map(|i| i as f64));
        let is_inside =
            |p: &Point<D>| (0..D).all(|k| p[k] >= -MARGIN && p[k] <= (own[k] - 1) as f64 + MARGIN);
        let outside = (0..count).into_par_iter().filter(|&i| !is_inside(&at(i))).count();
        let samples = match between {
            Between::Nearest => self.samples.picked(count, |index| {
                let p = at(index);
                let nearest = |k: usize| (p[k].round().max(0.0) as usize).min(own[k] - 1);
                let index = || (0..D).rev().fold(0, |index, k| index * own[k] + nearest(k));
                is_inside(&p).then(index)
            }),
            Between::Linear { outside } => {
                let value = |index: usize| match (at(index), outside) {
                    (p, Some(value)) if !is_inside(&p) => value,
                    (p, _) => self.linear(&p),
                };
                let values = (0..count).into_par_iter();
                match &self.samples {
                    Samples::F64(_) => Samples::F64(values.map(value).collect()),
                    _ => Samples::F32(values.map(|index| value(index) as f32).collect()),
                }
            }
        };
        (Self { frame: *frame, samples, absent: None }, outside)
    }

    /// The value at a place in sample coordinates; beyond the outermost samples that of the nearest place between them.
    fn linear(&self, p: &Point<D>) -> f64 {
        let shape = self.frame.shape();
        let (mut low, mut share) = ([0; D], [0.0; D]);
        for k in 0..D {
            let at = p[k].clamp(0.0, (shape[k] - 1) as f64);
            low[k] = (at as usize).min(shape[k].saturating_sub(2));
            share[k] = at - low[k] as f64;
        }
        let mut sum = 0.0;
        for corner in 0..1usize << D {
            let (mut weight, mut index) = (1.0, 0);
            for k in (0..D).rev() {
                let is_high = corner >> k & 1 == 1;
                weight *= if is_high { share[k] } else { 1.0 - share[k] };
                index = index * shape[k] + low[k] + usize::from(is_high);
            }
            if weight > 0.0 {
                sum += weight * self.samples.get(index);
            }
        }
        sum
    }
}

/// Sample coordinates of one frame to those of another.
struct IndexMap<const D: usize> {
    start: Point<D>,
    /// The step in the other's coordinates along each axis.
    columns: [Point<D>; D],
}

impl<const D: usize> IndexMap<D> {
    fn between<'a>(from: &'a Frame<D>, to: &'a Frame<D>) -> Self {
        let of = |p: Point<D>| {
            to.world_to_lattice(Units::Samples, &from.lattice_to_world(Units::Samples, &p))
        };
        let start = of([0.0; D]);
        let column = |k: usize| {
            let unit = of(std::array::from_fn(|j| if j == k { 1.0 } else { 0.0 }));
            std::array::from_fn(|j| unit[j] - start[j])
        };
        Self { start, columns: std::array::from_fn(column) }
    }

    fn of(&self, p: &Point<D>) -> Point<D> {
        std::array::from_fn(|j| {
            self.start[j] + (0..D).map(|k| p[k] * self.columns[k][j]).sum::<f64>()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sample values that name their places in the world.
    fn named<const D: usize>(frame: Frame<D>) -> Image<D> {
        let value = |index: usize| {
            let at = coordinates(index, frame.shape()).map(|i| i as f64);
            let place = frame.lattice_to_world(Units::Samples, &at);
            (0..D).map(|k| place[k] * 100f64.powi(k as i32)).sum()
        };
        let samples = (0..frame.sample_count()).map(value).collect();
        Image::new(frame, Samples::F64(samples)).unwrap()
    }

    fn frame(shape: [usize; 3], direction: [[f64; 3]; 3], origin: Point<3>) -> Frame<3> {
        let frame = Frame::new(shape).unwrap().with_direction(direction).unwrap();
        frame.with_origin(origin).unwrap()
    }

    const STRAIGHT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn the_same_samples_in_another_order_keep_their_places() {
        let own = frame([4, 5, 6], STRAIGHT, [-7.0, 2.0, 3.0]);
        // x runs along −z, y along x, z along −y
        let turned = [[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]];
        let other = frame([6, 4, 5], turned, [-7.0, 6.0, 8.0]);
        let order = own.order_in(&other).unwrap();
        assert_eq!(order, SampleOrder { axes: [1, 2, 0], is_flipped: [false, true, true] });
        let is_named = |image: Image<3>, frame: Frame<3>| {
            *image.frame() == frame && image.samples() == named(frame).samples()
        };
        assert!(is_named(named(other).reordered(&own, order), own));
        let back = other.order_in(&own).unwrap();
        assert!(is_named(named(own).reordered(&other, back), other));
        assert!(own.order_in(&own).unwrap().is_same());
        // a rounding of the header is none; a tenth of a sample is another place
        let near = own.with_origin([-6.995, 2.0, 3.0]).unwrap();
        assert!(near.order_in(&own).unwrap().is_same());
        for other in [
            own.with_origin([-6.9, 2.0, 3.0]).unwrap(),
            own.with_spacing([1.0, 1.0, 1.01]).unwrap(),
            frame([4, 5, 7], STRAIGHT, [-7.0, 2.0, 3.0]),
        ] {
            assert_eq!(other.order_in(&own), None);
        }
    }

    #[test]
    fn values_between_samples_are_linear_or_the_nearests() {
        let own = Frame::<2>::new([9, 8]).unwrap().with_origin([10.0, 20.0]).unwrap();
        let image = named(own);
        let fine = Frame::new([5, 4]).unwrap().with_spacing([0.5, 0.25]).unwrap();
        let fine = fine.with_origin([12.1, 21.2]).unwrap();
        let (found, outside) = image.resampled(&fine, Between::Linear { outside: None });
        assert_eq!(outside, 0);
        // the values are linear in the world
        let expected = named(fine);
        for i in 0..20 {
            assert!((found.samples().get(i) - expected.samples().get(i)).abs() < 1e-9);
        }
        let (found, _) = image.resampled(&fine, Between::Nearest);
        assert_eq!(found.samples().get(0), 12.0 + 2100.0);
        assert_eq!(found.samples().get(1), 13.0 + 2100.0); // of 12.6
    }

    #[test]
    fn outside_of_the_image_there_is_what_was_asked_for() {
        let image =
            Image::new(Frame::new([3, 3]).unwrap(), Samples::U8(vec![7; 9].into())).unwrap();
        let wide = Frame::new([6, 3]).unwrap().with_origin([-1.0, 0.0]).unwrap();
        let (found, outside) = image.resampled(&wide, Between::Nearest);
        assert_eq!(outside, 9); // at x = −1, 3 and 4
        let row = |samples: &Samples| (0..6).map(|i| samples.get(i)).collect::<Vec<_>>();
        assert_eq!(row(found.samples()), [0.0, 7.0, 7.0, 7.0, 0.0, 0.0]);
        assert_eq!(found.samples().type_name(), "uint8");
        let (found, _) = image.resampled(&wide, Between::Linear { outside: Some(-1.0) });
        assert_eq!(row(found.samples()), [-1.0, 7.0, 7.0, 7.0, -1.0, -1.0]);
        let (found, _) = image.resampled(&wide, Between::Linear { outside: None });
        assert_eq!(row(found.samples()), [7.0; 6]);
    }

    #[test]
    fn boxes_are_named_by_their_ends() {
        let flipped = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(frame([4, 2, 3], flipped, [3.0, 0.5, -1.0]).world_box(), "0..3,0.5..1.5,-1..1");
    }
}
