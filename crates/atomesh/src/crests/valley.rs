//! Valleys of a potential, found with sub-sample accuracy: the lines (2-D) and surfaces (3-D) that facets
//! should follow.
//!
//! In this order:
//!
//! 1. b is smoothed by a Gaussian; samples where it is not deep enough are left out;
//! 2. the eigenvector n of the largest eigenvalue λ of the Hessian points across a valley, whose
//!    bottom is off by −(∇b · n)/λ along n (a Newton step); it must be within the sample, 0.6 to
//!    each side with some overlap, and λ above 10⁻³;
//! 3. on request, only what hangs together, corner to corner, in large groups of samples is kept.
//!
//! Cost: O(σ) per sample; derivatives are made one at a time and kept at deep samples only.

use crate::geometry::Sets;
use crate::geometry::linear::{Matrix, largest_eigenpair};
use crate::geometry::{Point, dot};
use crate::image::{coordinates, gaussian_derivative_into, neighbour};
use crate::watch::{Cancelled, Phase, Watch, check};
use rayon::prelude::*;

/// A valley must be curved more than this across, per sample squared.
const LEAST_CURVATURE: f64 = 1e-3;
/// How far along any axis the bottom may be from a sample, in samples.
const REACH: f64 = 0.6;
/// No sample has this slot.
const NONE: u32 = u32::MAX;

/// The bottom of a valley near a sample, in sample coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bottom<const D: usize> {
    /// The sample's index, x fastest.
    pub index: usize,
    /// Where the bottom is.
    pub position: Point<D>,
    /// The unit normal of the valley there; its sign means nothing.
    pub normal: Point<D>,
    /// −b at the sample, smoothed.
    pub depth: f32,
}

/// How valleys are looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search<const D: usize> {
    /// The deviation of the Gaussian along each axis, in samples.
    pub sigma: [f64; D],
    /// What −b must be above once smoothed.
    pub least_depth: f32,
    /// What the work is part of, for the watch.
    pub phase: Phase,
}

/// The bottoms of all valleys of `potential`, x fastest, in the order of their samples.
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
    search: &Search<D>,
    watch: &mut dyn Watch,
) -> Result<Vec<Bottom<D>>, Cancelled> {
    let Search { sigma, least_depth, phase } = *search;
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

/// The bottoms whose group, connected corner to corner, has at least `least` of them.
///
/// `bottoms` are in the order of their samples, and stay so.
pub fn in_large_groups<const D: usize>(
    bottoms: Vec<Bottom<D>>,
    shape: [usize; D],
    least: f64,
) -> Vec<Bottom<D>> {
    let large = are_in_large_groups(&bottoms, shape, least);
    bottoms.into_iter().zip(large).filter_map(|(bottom, large)| large.then_some(bottom)).collect()
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
    fn bottom(&self, index: usize, depth: f32, shape: [usize; D]) -> Option<Bottom<D>> {
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
        Some(Bottom { index, position, normal, depth })
    }
}

/// For each bottom whether its group has at least `least`.
fn are_in_large_groups<const D: usize>(
    bottoms: &[Bottom<D>],
    shape: [usize; D],
    least: f64,
) -> Vec<bool> {
    let mut slots = vec![NONE; shape.iter().product()];
    let mut groups = Sets::with_capacity(bottoms.len());
    for (slot, bottom) in bottoms.iter().enumerate() {
        let slot = slot as u32;
        groups.push();
        slots[bottom.index] = slot;
        let sample = coordinates(bottom.index, shape);
        // neighbours that come later are met from their own side
        for code in 0..3usize.pow(D as u32) / 2 {
            if let Some(index) = neighbour(sample, shape, code)
                && slots[index] != NONE
            {
                groups.join(slots[index], slot);
            }
        }
    }
    let mut sizes = vec![0u32; bottoms.len()];
    let roots = groups.roots();
    roots.iter().for_each(|&root| sizes[root as usize] += 1);
    roots.iter().map(|&root| f64::from(sizes[root as usize]) >= least).collect()
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
        assert_eq!(valley.depth, 0.5);
        let far = Slopes::<2> { gradient: [-0.3, 0.0], ..slopes };
        assert!(far.bottom(0, 0.5, [10, 10]).is_none());
        let flat = Slopes::<2> { gradient: [0.0; 2], hessian: [[9e-4, 0.0], [0.0, -1.0]] };
        assert!(flat.bottom(0, 0.5, [10, 10]).is_none());
    }

    #[test]
    fn groups_hang_together_by_corners_and_not_across_the_border() {
        let shape = [4, 4];
        let at = |x: usize, y: usize| Bottom {
            index: x + 4 * y,
            position: [x as f64, y as f64],
            normal: [1.0, 0.0],
            depth: 1.0,
        };
        // a diagonal of three, and two alone: (3, 0) follows (0, 1) in memory only
        let bottoms = [at(0, 0), at(3, 0), at(0, 1), at(1, 2), at(3, 3)];
        let large = are_in_large_groups(&bottoms, shape, 3.0);
        assert_eq!(large, [true, false, true, true, false]);
        assert_eq!(in_large_groups(bottoms.to_vec(), shape, 3.0).len(), 3);
        // a V, whose arms are two groups until its tip joins them
        let bottoms = [at(0, 0), at(2, 0), at(1, 1)];
        assert_eq!(are_in_large_groups(&bottoms, shape, 3.0), [true; 3]);
    }
}
