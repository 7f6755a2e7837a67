//! Features of a potential: its valleys, found with sub-sample accuracy.
//!
//! Only what a mesh with edges of length d can be asked to follow counts. In this order:
//!
//! 1. b is smoothed by σ = max(1, d/6) samples; samples where −b ≤ 1/4 are not deep enough;
//! 2. the eigenvector n of the largest eigenvalue λ of the Hessian points across a valley, whose
//!    bottom is off by −(∇b · n)/λ along n (a Newton step); it must be within the sample, 0.6 to
//!    each side with some overlap, and λ above 10⁻³;
//! 3. what remains must hang together, corner to corner, in groups of at least 4d (2-D) or 6d²
//!    (3-D) samples.
//!
//! Cost: O(σ) per sample; derivatives are made one at a time and kept at deep samples only.

use super::MeasureError;
use crate::geometry::linear::{Matrix, largest_eigenpair};
use crate::geometry::{Point, dot};
use crate::image::gaussian_derivative_into;
use crate::watch::{Phase, Watch, check};
use rayon::prelude::*;

/// A valley must be deeper than this, of 1.
const LEAST_DEPTH: f32 = 0.25;
/// A valley must be curved more than this across, per sample squared.
const LEAST_CURVATURE: f64 = 1e-3;
/// How far along any axis the bottom may be from a sample, in samples.
const REACH: f64 = 0.6;
/// No sample has this slot.
const NONE: u32 = u32::MAX;

/// Points on the features of a potential, in sample coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features<const D: usize> {
    /// Points at the bottom of valleys, about one a sample.
    pub positions: Vec<Point<D>>,
    /// The unit normal of the feature at each point; its sign means nothing.
    pub normals: Vec<Point<D>>,
}

/// The features of `potential`, x fastest, that edges of `size` samples should follow.
///
/// Deterministic: the same at any thread count; points are in the order of their samples.
/// Memory: two volumes of `f32` at a time, and 48 bytes (3-D) for each sample deeper than 1/4.
///
/// # Errors
/// [`MeasureError`] if there are not as many values as `shape` says, the size is not a finite
/// number above 0, or the watch ends the work.
pub fn features<const D: usize>(
    potential: &[f32],
    shape: [usize; D],
    size: f64,
    watch: &mut dyn Watch,
) -> Result<Features<D>, MeasureError> {
    let count = shape.iter().try_fold(1usize, |n, &s| n.checked_mul(s));
    if count != Some(potential.len()) {
        return Err(MeasureError::SampleCount { shape: shape.to_vec(), found: potential.len() });
    }
    check_size(size)?;
    let sigma = [(size / 6.0).max(1.0); D];
    let derivative_count = (D + D * (D + 1) / 2) as f64;
    check(watch, Phase::Measure, 0.0, None)?;

    let mut volume = vec![0.0; potential.len()]; // one derivative after another
    let deep = deep_samples(potential, shape, sigma, &mut volume);
    let mut slopes = vec![Slopes::default(); deep.len()];
    let mut done = 0.0;
    let mut differentiate = |order: [u8; D], store: &(dyn Fn(&mut Slopes<D>, f32) + Sync)| {
        done += 1.0;
        check(watch, Phase::Measure, done / (derivative_count + 1.0), None)?;
        gaussian_derivative_into(&mut volume, potential, shape, sigma, order);
        slopes.par_iter_mut().zip(&deep).for_each(|(s, &index)| store(s, volume[index]));
        Ok::<(), MeasureError>(())
    };
    for a in 0..D {
        let mut order = [0; D];
        order[a] = 1;
        differentiate(order, &|s, value| s.gradient[a] = value)?;
        for b in a..D {
            let mut order = [0; D];
            order[a] += 1;
            order[b] += 1;
            differentiate(order, &|s, value| {
                s.hessian[a][b] = value;
                s.hessian[b][a] = value;
            })?;
        }
    }

    drop(volume);
    let valleys: Vec<Valley<D>> = slopes
        .par_iter()
        .zip(&deep)
        .filter_map(|(slopes, &index)| slopes.bottom(index, shape))
        .collect();
    drop((slopes, deep));
    let least = if D == 2 { 4.0 * size } else { 6.0 * size * size };
    let large = in_large_groups(&valleys, shape, least);
    let kept = || valleys.iter().zip(&large).filter(|(_, large)| **large).map(|(v, _)| v);
    Ok(Features {
        positions: kept().map(|v| v.position).collect(),
        normals: kept().map(|v| v.normal).collect(),
    })
}

/// Refuses a nominal distance that is no length.
pub(super) fn check_size(size: f64) -> Result<(), MeasureError> {
    if size.is_finite() && size > 0.0 { Ok(()) } else { Err(MeasureError::Size { value: size }) }
}

/// The indices of samples where the smoothed potential is deep enough.
fn deep_samples<const D: usize>(
    potential: &[f32],
    shape: [usize; D],
    sigma: [f64; D],
    smooth: &mut [f32],
) -> Vec<usize> {
    gaussian_derivative_into(smooth, potential, shape, sigma, [0; D]);
    (0..smooth.len()).into_par_iter().filter(|&i| -smooth[i] > LEAST_DEPTH).collect()
}

/// First and second derivatives at a sample.
#[derive(Clone, Copy)]
struct Slopes<const D: usize> {
    gradient: [f32; D],
    hessian: [[f32; D]; D],
}

impl<const D: usize> Default for Slopes<D> {
    fn default() -> Self {
        Self { gradient: [0.0; D], hessian: [[0.0; D]; D] }
    }
}

/// The bottom of a valley near a sample.
struct Valley<const D: usize> {
    index: usize,
    position: Point<D>,
    normal: Point<D>,
}

impl<const D: usize> Slopes<D> {
    /// The bottom of the valley across this sample, if it is one and near enough.
    fn bottom(&self, index: usize, shape: [usize; D]) -> Option<Valley<D>> {
        let hessian: Matrix<D> = self.hessian.map(|row| row.map(f64::from));
        let (curvature, normal) = largest_eigenpair(hessian);
        if curvature <= LEAST_CURVATURE {
            return None;
        }
        let step = -dot(&self.gradient.map(f64::from), &normal) / curvature;
        let offset = normal.map(|n| step * n);
        if offset.iter().any(|x| x.abs() > REACH) {
            return None;
        }
        let sample = coordinates(index, shape);
        let position = std::array::from_fn(|k| sample[k] as f64 + offset[k]);
        Some(Valley { index, position, normal })
    }
}

/// The sample at an index, axis by axis.
fn coordinates<const D: usize>(mut index: usize, shape: [usize; D]) -> [usize; D] {
    std::array::from_fn(|k| {
        let i = index % shape[k];
        index /= shape[k];
        i
    })
}

/// For each valley sample whether its group, connected corner to corner, has at least `least`.
///
/// `valleys` are in the order of their samples.
fn in_large_groups<const D: usize>(
    valleys: &[Valley<D>],
    shape: [usize; D],
    least: f64,
) -> Vec<bool> {
    let mut slots = vec![NONE; shape.iter().product()];
    let mut groups = Groups { parents: Vec::with_capacity(valleys.len()) };
    for (slot, valley) in valleys.iter().enumerate() {
        let slot = slot as u32;
        groups.parents.push(slot);
        slots[valley.index] = slot;
        let sample = coordinates(valley.index, shape);
        // neighbours that come later are met from their own side
        for code in 0..3usize.pow(D as u32) / 2 {
            if let Some(index) = neighbour(sample, shape, code)
                && slots[index] != NONE
            {
                groups.join(slots[index], slot);
            }
        }
    }
    let mut sizes = vec![0u32; valleys.len()];
    let roots: Vec<usize> =
        (0..valleys.len()).map(|slot| groups.root(slot as u32) as usize).collect();
    roots.iter().for_each(|&root| sizes[root] += 1);
    roots.iter().map(|&root| f64::from(sizes[root]) >= least).collect()
}

/// The index of the neighbour `code`, whose digits to base 3 are the steps along the axes plus 1;
/// `None` outside the image.
fn neighbour<const D: usize>(
    sample: [usize; D],
    shape: [usize; D],
    mut code: usize,
) -> Option<usize> {
    let (mut index, mut stride) = (0, 1);
    for k in 0..D {
        let i = (sample[k] + code % 3).checked_sub(1).filter(|&i| i < shape[k])?;
        index += i * stride;
        stride *= shape[k];
        code /= 3;
    }
    Some(index)
}

/// Disjoint groups of slots: each points to a member of its group with a lower slot, or to itself.
struct Groups {
    parents: Vec<u32>,
}

impl Groups {
    /// The first member of the slot's group; shortens the way there.
    fn root(&mut self, mut slot: u32) -> u32 {
        while self.parents[slot as usize] != slot {
            let above = self.parents[self.parents[slot as usize] as usize];
            self.parents[slot as usize] = above;
            slot = above;
        }
        slot
    }

    /// Makes the groups of two slots one.
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::watch::{Cancelled, Silent};
    use std::ops::ControlFlow;

    /// A potential with a Gaussian valley of deviation 1.5 along the plane through `through`.
    fn valley<const D: usize>(shape: [usize; D], through: Point<D>, normal: Point<D>) -> Vec<f32> {
        (0..shape.iter().product())
            .map(|index| {
                let sample = coordinates(index, shape);
                let h: f64 = (0..D).map(|k| (sample[k] as f64 - through[k]) * normal[k]).sum();
                -(-0.5 * (h / 1.5).powi(2)).exp() as f32
            })
            .collect()
    }

    fn valleys_are_found_between_samples<const D: usize>(shape: [usize; D], normal: Point<D>) {
        let length = dot(&normal, &normal).sqrt();
        let normal = normal.map(|x| x / length);
        let through = std::array::from_fn(|k| 0.5 * shape[k] as f64 + 0.3);
        let b = valley(shape, through, normal);
        let found = features(&b, shape, 4.0, &mut Silent).unwrap();
        assert!(found.positions.len() >= shape[1..].iter().product::<usize>() / 2);
        let inside = |p: &Point<D>| (0..D).all(|k| p[k] > 5.0 && p[k] < shape[k] as f64 - 6.0);
        for (p, n) in found.positions.iter().zip(&found.normals) {
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
    fn the_offset_is_the_newton_step() {
        // b = ½ κ (x − x₀)², so the bottom is found exactly
        let slopes = Slopes::<2> { gradient: [-0.1, 0.0], hessian: [[0.4, 0.0], [0.0, 0.1]] };
        let valley = slopes.bottom(2 + 10 * 3, [10, 10]).unwrap();
        assert!((valley.position[0] - 2.25).abs() < 1e-7 && valley.position[1] == 3.0);
        let far = Slopes::<2> { gradient: [-0.3, 0.0], ..slopes };
        assert!(far.bottom(0, [10, 10]).is_none());
        let flat = Slopes::<2> { gradient: [0.0; 2], hessian: [[9e-4, 0.0], [0.0, -1.0]] };
        assert!(flat.bottom(0, [10, 10]).is_none());
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
        let found = features(&b, shape, 4.0, &mut Silent).unwrap();
        assert!((20..25).contains(&found.positions.len()), "{}", found.positions.len());
        assert!(features(&b, shape, 8.0, &mut Silent).unwrap().positions.is_empty());
        b.iter_mut().for_each(|v| *v *= 0.25);
        assert!(features(&b, shape, 4.0, &mut Silent).unwrap().positions.is_empty());
    }

    #[test]
    fn groups_hang_together_by_corners_and_not_across_the_border() {
        let shape = [4, 4];
        let at = |x: usize, y: usize| Valley {
            index: x + 4 * y,
            position: [x as f64, y as f64],
            normal: [1.0, 0.0],
        };
        // a diagonal of three, and two alone: (3, 0) follows (0, 1) in memory only
        let valleys = [at(0, 0), at(3, 0), at(0, 1), at(1, 2), at(3, 3)];
        assert_eq!(in_large_groups(&valleys, shape, 3.0), [true, false, true, true, false]);
        // a V, whose arms are two groups until its tip joins them
        let valleys = [at(0, 0), at(2, 0), at(1, 1)];
        assert_eq!(in_large_groups(&valleys, shape, 3.0), [true; 3]);
    }

    #[test]
    fn wrong_inputs_are_refused() {
        let error = |count, size| features(&vec![0.0; count], [4, 4], size, &mut Silent).err();
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
        let stopped = features(&[0.0; 16], [4, 4], 2.0, &mut Stop(4));
        assert_eq!(stopped, Err(MeasureError::Cancelled(Cancelled)));
    }
}
