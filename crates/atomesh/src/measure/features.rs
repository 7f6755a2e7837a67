//! Features of a potential that a mesh is measured against: its valleys.
//!
//! Only what a mesh with edges of length d can be asked to follow counts: valleys of b smoothed by
//! σ = max(1, d/6) samples, deeper than 1/4, in large groups ([`crate::crests`] finds them).

use super::MeasureError;
use crate::crests::{FeaturePoint, ValleySearch, bottoms, in_large_groups};
use crate::watch::{Phase, Watch};

/// The least depth of a valley, of 1.
const LEAST_DEPTH: f32 = 0.25;

/// The samples of a potential b(x).
#[derive(Clone, Copy, Debug)]
pub struct SampledPotential<'a, const D: usize> {
    /// b at the samples, x fastest.
    pub values: &'a [f32],
    /// Samples along x, y (and z).
    pub shape: [usize; D],
}

impl<const D: usize> SampledPotential<'_, D> {
    /// Refuses a number of samples that is not the shape's.
    pub(super) fn check(&self) -> Result<(), MeasureError> {
        let (shape, found) = (self.shape, self.values.len());
        match shape.iter().try_fold(1usize, |n, &s| n.checked_mul(s)) {
            Some(count) if count == found => Ok(()),
            _ => Err(MeasureError::SampleCount { shape: shape.to_vec(), found }),
        }
    }
}

/// The features of a potential that edges of `size` samples should follow: points at the bottom of valleys, about one a
/// sample, in sample coordinates and in the order of their samples.
///
/// Deterministic: the same at any thread count. Memory: two volumes of `f32` at a time, and 48 bytes (3-D) for each
/// sample deeper than 1/4.
///
/// # Errors
/// [`MeasureError`] if there are not as many values as the shape says, the size is not a finite
/// number above 0, or the watch ends the work.
pub fn features<const D: usize>(
    potential: SampledPotential<'_, D>,
    size: f64,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, MeasureError> {
    potential.check()?;
    check_size(size)?;
    let SampledPotential { values, shape } = potential;
    let sigma = [(size / 6.0).max(1.0); D];
    let search = ValleySearch { sigma, least_depth: LEAST_DEPTH, phase: Phase::Measure };
    Ok(in_large_groups(bottoms(values, shape, &search, watch)?, shape, size))
}

/// Refuses a nominal distance that is not a finite number above 0.
pub(super) fn check_size(size: f64) -> Result<(), MeasureError> {
    if size.is_finite() && size > 0.0 { Ok(()) } else { Err(MeasureError::Size { value: size }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, dot};
    use crate::watch::{Cancelled, Silent};
    use std::ops::ControlFlow;

    /// A potential with a Gaussian valley of deviation 1.5 along the plane through `through`.
    fn valley<const D: usize>(shape: [usize; D], through: Point<D>, normal: Point<D>) -> Vec<f32> {
        (0..shape.iter().product())
            .map(|index| {
                let mut rest = index;
                let sample: [usize; D] = std::array::from_fn(|k| {
                    let i = rest % shape[k];
                    rest /= shape[k];
                    i
                });
                let h: f64 = (0..D).map(|k| (sample[k] as f64 - through[k]) * normal[k]).sum();
                -(-0.5 * (h / 1.5).powi(2)).exp() as f32
            })
            .collect()
    }

    fn valleys_are_found_between_samples<const D: usize>(shape: [usize; D], normal: Point<D>) {
        let length = dot(&normal, &normal).sqrt();
        let normal = normal.map(|x| x / length);
        let through = std::array::from_fn(|k| 0.5 * shape[k] as f64 + 0.3);
        let values = valley(shape, through, normal);
        let b = SampledPotential { values: &values, shape };
        let found = features(b, 4.0, &mut Silent).unwrap();
        assert!(found.len() >= shape[1..].iter().product::<usize>() / 2);
        let inside = |p: &Point<D>| (0..D).all(|k| p[k] > 5.0 && p[k] < shape[k] as f64 - 6.0);
        for FeaturePoint { position: p, normal: n, .. } in &found {
            // mirrored samples bend the valley within a kernel's reach of the border
            if inside(p) {
                let h: f64 = (0..D).map(|k| (p[k] - through[k]) * normal[k]).sum();
                // a Newton step from 0.6 on a Gaussian of variance 3.25 is off by 0.6³/3.25
                assert!(h.abs() < 0.08, "{p:?} is off by {h}");
                assert!(dot(n, &normal).abs() > 0.9999, "{n:?}");
            }
        }
    }

    #[test]
    fn straight_valleys_are_found_with_their_normals() {
        valleys_are_found_between_samples([40, 50], [1.0, 0.0]);
        valleys_are_found_between_samples([40, 50], [2.0, 1.0]);
        valleys_are_found_between_samples([24, 26, 28], [3.0, 1.0, -1.0]);
    }

    #[test]
    fn small_and_shallow_features_do_not_count() {
        let shape = [64, 64];
        // a valley along y that fades out: deeper than 1/4 for about 22 samples, enough for size 4
        // (16) and not for size 8 (32)
        let mut b = valley(shape, [30.3, 0.0], [1.0, 0.0]);
        for (index, v) in b.iter_mut().enumerate() {
            let along = (index / 64) as f32 - 30.0;
            *v *= (-(along / 10.0).powi(2)).exp();
        }
        let count = |values: &[f32], size| {
            features(SampledPotential { values, shape }, size, &mut Silent).unwrap().len()
        };
        assert!((20..25).contains(&count(&b, 4.0)), "{}", count(&b, 4.0));
        assert_eq!(count(&b, 8.0), 0);
        b.iter_mut().for_each(|v| *v *= 0.25);
        assert_eq!(count(&b, 4.0), 0);
    }

    #[test]
    fn wrong_inputs_are_refused() {
        let zeros = [0.0; 16];
        let of = |count| SampledPotential { values: &zeros[..count], shape: [4, 4] };
        let error = |count, size| features(of(count), size, &mut Silent).err();
        assert_eq!(
            error(15, 2.0),
            Some(MeasureError::SampleCount { shape: vec![4, 4], found: 15 })
        );
        assert_eq!(error(16, 0.0), Some(MeasureError::Size { value: 0.0 }));
        assert!(matches!(error(16, f64::NAN), Some(MeasureError::Size { .. })));
        assert_eq!(error(16, 2.0), None);
        struct Stop(usize);
        impl Watch for Stop {
            fn step(&mut self, _: Phase, done: f64, _: Option<f64>) -> ControlFlow<()> {
                assert!((0.0..=1.0).contains(&done));
                self.0 -= 1;
                if self.0 == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            }
        }
        let stopped = features(of(16), 2.0, &mut Stop(4));
        assert_eq!(stopped, Err(MeasureError::Cancelled(Cancelled)));
    }
}
