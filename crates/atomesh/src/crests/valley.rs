//! Valleys of a potential, found with sub-sample accuracy: the lines (2-D) and surfaces (3-D) that facets
//! should follow.
//!
//! b is smoothed by a Gaussian, and samples where it is not deep enough are left out. At the others the eigenvector n
//! of the largest eigenvalue λ of the Hessian points across the valley, and the bottom is −(∇b · n)/λ away along n (a
//! Newton step). It counts if λ is above 10⁻³ and it lies within 0.6 samples along every axis: half a sample, and some
//! overlap.
//!
//! Cost: O(σ) per sample; derivatives are made one at a time and kept at deep samples only.

use super::FeaturePoint;
use crate::geometry::dot;
use crate::geometry::linear::{Matrix, largest_eigenpair};
use crate::image::{coordinates, gaussian_derivative_into};
use crate::parallel::prelude::*;
use crate::watch::{Cancelled, Phase, Watch, check};

/// The least curvature across a valley, per sample squared.
const LEAST_CURVATURE: f64 = 1e-3;
/// The greatest distance of a bottom from its sample along any axis, in samples.
const REACH: f64 = 0.6;

/// How valleys are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValleySearch<const D: usize> {
    /// The deviation of the Gaussian along each axis, in samples.
    pub sigma: [f64; D],
    /// −b, smoothed, must be above this.
    pub least_depth: f32,
    /// What the work is part of, for the watch.
    pub phase: Phase,
}

/// The bottoms of all valleys of `potential`, x fastest, in the order of their samples and in sample coordinates;
/// their strength is −b at the sample, smoothed.
///
/// Deterministic: the same at any thread count. Memory: two volumes of `f32` at a time, and 48 bytes
/// (3-D) for each sample that is deep enough.
///
/// # Errors
/// [`Cancelled`] if the watch ends the work.
///
/// # Panics
/// If there are not as many values as `shape` says.
pub fn bottoms<const D: usize>(
    potential: &[f32],
    shape: [usize; D],
    search: &ValleySearch<D>,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, Cancelled> {
    let ValleySearch { sigma, least_depth, phase } = *search;
    let derivative_count = (D + D * (D + 1) / 2) as f64;
    check(watch, phase, 0.0, None)?;
    let mut volume = vec![0.0; potential.len()]; // one derivative after another
    gaussian_derivative_into(&mut volume, potential, shape, sigma, [0; D]);
    let is_deep = |&i: &usize| -volume[i] > least_depth;
    let deep: Vec<usize> = (0..volume.len()).into_par_iter().filter(is_deep).collect();
    let depths: Vec<f32> = deep.iter().map(|&i| -volume[i]).collect();
    let mut slopes = vec![Slopes::default(); deep.len()];
    let mut done = 0.0;
    let mut differentiate = |order: [u8; D], store: &(dyn Fn(&mut Slopes<D>, f32) + Sync)| {
        done += 1.0;
        check(watch, phase, done / (derivative_count + 1.0), None)?;
        gaussian_derivative_into(&mut volume, potential, shape, sigma, order);
        slopes.par_iter_mut().zip(&deep).for_each(|(s, &index)| store(s, volume[index]));
        Ok::<(), Cancelled>(())
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
    let found = slopes.par_iter().zip(&deep).zip(&depths);
    Ok(found.filter_map(|((s, &index), &depth)| s.bottom(index, depth, shape)).collect())
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

impl<const D: usize> Slopes<D> {
    /// The bottom of the valley across this sample, if it is one and near enough.
    fn bottom(&self, index: usize, depth: f32, shape: [usize; D]) -> Option<FeaturePoint<D>> {
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
        Some(FeaturePoint { index, position, normal, strength: depth.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_offset_is_the_newton_step() {
        // b = ½ κ (x − x₀)², so the bottom is found exactly
        let slopes = Slopes::<2> { gradient: [-0.1, 0.0], hessian: [[0.4, 0.0], [0.0, 0.1]] };
        let valley = slopes.bottom(2 + 10 * 3, 0.5, [10, 10]).unwrap();
        assert!((valley.position[0] - 2.25).abs() < 1e-7 && valley.position[1] == 3.0);
        assert_eq!(valley.strength, 0.5);
        let far = Slopes::<2> { gradient: [-0.3, 0.0], ..slopes };
        assert!(far.bottom(0, 0.5, [10, 10]).is_none());
        let flat = Slopes::<2> { gradient: [0.0; 2], hessian: [[9e-4, 0.0], [0.0, -1.0]] };
        assert!(flat.bottom(0, 0.5, [10, 10]).is_none());
    }
}
