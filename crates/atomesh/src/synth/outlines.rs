//! A bright disc or sphere.

use super::random::Random;
use super::truth::{Geometry, Role, TrueFeature};
use super::{Canvas, Sketch, grey};
use crate::geometry::distance_squared;

/// A ball near the middle of the box, of a radius of 0.28 to 0.36 of its least extent.
pub(super) fn sketch<const D: usize>(canvas: &Canvas<D>, random: &mut Random) -> Sketch<D> {
    let center = canvas.at(&std::array::from_fn(|_| random.between(0.47, 0.53)));
    let radius = random.between(0.28, 0.36) * canvas.least_extent();
    let step = canvas.step;
    Sketch {
        features: vec![TrueFeature {
            role: Role::Outline,
            geometry: Geometry::Sphere { center, radius },
        }],
        layers: None,
        shade: Box::new(move |p| {
            // the share of a sample inside, as if the surface were flat
            let depth = radius - distance_squared(p, &center).sqrt();
            let share = (0.5 + depth / step).clamp(0.0, 1.0);
            grey::OUTSIDE + (grey::INSIDE - grey::OUTSIDE) * share
        }),
    }
}
