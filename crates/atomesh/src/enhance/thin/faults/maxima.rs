//! From the best plane of every sample to crests: non-maximum suppression across the planes.

use super::background::Background;
use super::between::Found;
use super::facing::volume;
use super::scan::Orientation;
use crate::crests::FeaturePoint;
use crate::image::Grid;
use crate::parallel::prelude::*;

/// The power of semblance in the likelihood, Hale's.
const POWER: i32 = 8;

/// The samples whose likelihood is a maximum across their plane, along the axis that it faces, and not below `low`.
///
/// The likelihood is 1 − s⁸, s being 1 less the missing semblance beyond `background` times that of the surroundings. A
/// crest is at the vertex of the parabola through three samples; its normal is the plane's, in lattice units.
pub(super) fn maxima<const D: usize>(
    mut found: Found,
    grid: &Grid<D>,
    background: f32,
    low: f32,
) -> Vec<FeaturePoint<D>> {
    let [nx, ny, _] = volume(grid.shape);
    to_likelihood(&mut found.missing, grid.shape, background);
    let likelihood = found.missing;
    let crests = likelihood.par_chunks(nx).enumerate().flat_map_iter(|(row, chunk)| {
        let (likelihood, best, orientations) = (&likelihood, &found.best, &found.orientations);
        chunk.iter().enumerate().filter_map(move |(x, &here)| {
            let index = row * nx + x;
            let orientation = &orientations[best[index] as usize];
            let sample = [x, row % ny, row / ny];
            let axis = orientation.facing.axis;
            let inside = sample[axis] > 0 && sample[axis] + 1 < orientation.facing.across;
            if here < low || here == 0.0 || !inside {
                return None;
            }
            let stride = orientation.facing.stride();
            let (before, after) = (likelihood[index - stride], likelihood[index + stride]);
            if before > here || after >= here {
                return None;
            }
            let mut place = sample.map(|i| i as f32);
            place[axis] += vertex(before, here, after);
            let mut position = [0.0; D];
            position[..D - 1].copy_from_slice(&place[..D - 1]);
            position[D - 1] = place[2];
            Some(FeaturePoint {
                index,
                position: position.map(f64::from),
                normal: normal(orientation, grid).map(f64::from),
                strength: here.into(),
            })
        })
    });
    crests.collect()
}

/// Turns missing semblances into likelihoods.
fn to_likelihood<const D: usize>(missing: &mut [f32], shape: [usize; D], background: f32) {
    let [nx, ny, _] = volume(shape);
    let medians = Background::new(missing, shape);
    missing.par_chunks_mut(nx).enumerate().for_each(|(row, missing)| {
        for (x, missing) in missing.iter_mut().enumerate() {
            let usual = background * medians.at([x, row % ny, row / ny]);
            let semblance = 1.0 - (*missing - usual).clamp(0.0, 1.0);
            *missing = 1.0 - semblance.powi(POWER);
        }
    });
}

/// Where the parabola through three samples, the middle one the greatest, has its vertex, from the middle one.
fn vertex(before: f32, here: f32, after: f32) -> f32 {
    let bend = before - 2.0 * here + after;
    if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
}

/// The unit normal of a plane in lattice units: of the gradient of u − strike · v − dip · z.
fn normal<const D: usize>(orientation: &Orientation, grid: &Grid<D>) -> [f32; D] {
    let mut gradient: [f64; D] = std::array::from_fn(|k| {
        let per_sample = match k {
            _ if k == orientation.facing.axis => 1.0,
            _ if k == D - 1 => -orientation.dip,
            _ => -orientation.strike,
        };
        f64::from(per_sample) / grid.step[k]
    });
    let norm = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
    gradient.iter_mut().for_each(|g| *g /= norm);
    gradient.map(|g| g as f32)
}
