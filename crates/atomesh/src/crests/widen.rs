//! From points on features back to a potential: valleys of one depth and width along them.
//!
//! However strong, wide and slanted features are, b has one profile across them, since it is made from the distance to
//! points between samples. Hale (2002) thins features to whole samples and smooths these; that leaves valleys deeper
//! along the axes than aslant.

use super::FeaturePoint;
use crate::image::Grid;
use crate::parallel::prelude::*;
use std::ops::Range;

/// The radius of the disc of feature about a point, in samples along the disc's steepest axis: at least half the
/// distance between neighbours, which on a line just off the diagonal is a whole diagonal, √2, and a little.
const DISC: f64 = 1.01;

/// Where valleys end, in standard deviations, as kernels do: b is −3·10⁻⁴ there.
const TRUNCATE: f64 = 4.0;

/// The least deviation of a valley, in samples across it: along a coarse axis a narrower one would fall between samples.
/// The same as of Gaussian operators.
const NARROWEST: f64 = 0.7;

/// Planes whose distances are worked out together.
const SLAB: usize = 8;

/// b(x) = −exp(−s²/2σ²), s the distance to the nearest feature: −1 on features, and as wide along all of them.
///
/// Positions of `points` are in samples, normals per lattice unit; `sigma` is in lattice units, but no less than 0.7
/// samples across the feature. Each point stands for a flat disc of the feature about it (a straight piece in the plane).
/// So s is exact on planes, and off by 0.4 of the curvature (per sample) where they bend; beyond the end of a feature s
/// is the distance to the end.
///
/// Cost: O(σᴰ) a point. The same at any number of threads: the least distance does not depend on their order.
///
/// # Panics
/// If σ is not finite and above 0.
pub(crate) fn widen<const D: usize>(
    points: &[FeaturePoint<D>],
    grid: &Grid<D>,
    sigma: f64,
) -> Vec<f32> {
    assert!(sigma.is_finite() && sigma > 0.0, "σ is {sigma}");
    let mut ordered: Vec<&FeaturePoint<D>> = points.iter().collect();
    ordered.sort_by_key(|point| point.index);
    let mut values = vec![f32::INFINITY; grid.sample_count()];
    let plane: usize = grid.shape[..D - 1].iter().product();
    let reach = 2 + (TRUNCATE * sigma / grid.step[D - 1] + TRUNCATE * NARROWEST + DISC) as usize;
    values.par_chunks_mut(SLAB * plane).enumerate().for_each(|(slab, part)| {
        let first = slab * SLAB;
        let last = first + part.len() / plane;
        let at_least = |p: usize| ordered.partition_point(|point| point.index < p * plane);
        let near = at_least(first.saturating_sub(reach))..at_least(last + reach);
        for point in &ordered[near] {
            Disc::new(point, grid, sigma).lower(part, first..last, grid);
        }
        for value in part {
            // no −0 where nothing is near
            *value =
                if *value < (TRUNCATE * TRUNCATE) as f32 { -(-0.5 * *value).exp() } else { 0.0 };
        }
    });
    values
}

/// A flat piece of a feature about a point.
struct Disc<const D: usize> {
    /// Its middle, in samples.
    middle: [f32; D],
    normal: [f32; D],
    /// Its radius, in lattice units.
    radius: f32,
    /// 1/σ, per lattice unit.
    inverse: f32,
    /// How far its valley reaches, in squared lattice units.
    reach_squared: f32,
    /// The same along each axis, in samples.
    reach: [f32; D],
}

impl<const D: usize> Disc<D> {
    fn new(point: &FeaturePoint<D>, grid: &Grid<D>, sigma: f64) -> Self {
        let (mut across, mut radius) = (0.0, 0.0f64);
        for k in 0..D {
            let normal = point.normal[k];
            across += (normal * grid.step[k]).powi(2);
            radius = radius.max(grid.step[k] * (1.0 - normal * normal).max(0.0).sqrt());
        }
        let sigma = sigma.max(NARROWEST * across.sqrt());
        let radius = DISC * radius;
        let reach = TRUNCATE * sigma + radius;
        Self {
            middle: point.position.map(|x| x as f32),
            normal: point.normal.map(|n| n as f32),
            radius: radius as f32,
            inverse: (1.0 / sigma) as f32,
            reach_squared: (reach * reach) as f32,
            reach: grid.step.map(|step| (reach / step) as f32),
        }
    }

    /// Lowers (s/σ)² in a slab of planes to this disc's.
    fn lower(&self, slab: &mut [f32], planes: Range<usize>, grid: &Grid<D>) {
        let plane: usize = grid.shape[..D - 1].iter().product();
        let range = |k: usize, within: Range<usize>| {
            let from = (self.middle[k] - self.reach[k]).ceil().max(0.0) as usize;
            let to = (self.middle[k] + self.reach[k]).floor().max(-1.0) + 1.0;
            from.max(within.start)..(to as usize).min(within.end)
        };
        let offset = |k: usize, i: usize| (i as f32 - self.middle[k]) * grid.step[k] as f32;
        let columns = range(0, 0..grid.shape[0]);
        let rows = if D > 2 { range(1, 0..grid.shape[1]) } else { 0..1 };
        for p in range(D - 1, planes.clone()) {
            let last = offset(D - 1, p);
            for r in rows.clone() {
                let middle = if D > 2 { offset(1, r) } else { 0.0 };
                let beside = middle * middle + last * last;
                if beside > self.reach_squared {
                    continue;
                }
                let turned = if D > 2 { middle * self.normal[1] } else { 0.0 };
                let across = turned + last * self.normal[D - 1];
                let start = (p - planes.start) * plane + r * grid.shape[0];
                let row = &mut slab[start..][columns.clone()];
                for (value, i) in row.iter_mut().zip(columns.clone()) {
                    let first = offset(0, i);
                    let across = first * self.normal[0] + across;
                    let along = (first * first + beside - across * across).max(0.0).sqrt();
                    let beyond = (along - self.radius).max(0.0);
                    let squared = (across * across + beyond * beyond) * self.inverse * self.inverse;
                    *value = value.min(squared);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::coordinates;
    use proptest::prelude::*;

    fn at<const D: usize>(sample: [usize; D], shape: [usize; D]) -> FeaturePoint<D> {
        FeaturePoint {
            index: (0..D).rev().fold(0, |index, k| index * shape[k] + sample[k]),
            position: sample.map(|i| i as f64),
            normal: std::array::from_fn(|k| if k == 0 { 1.0 } else { 0.0 }),
            strength: 1.0,
        }
    }

    /// Points on a plane: feet of samples on it that are within half a sample along each axis.
    fn plane<const D: usize>(
        grid: &Grid<D>,
        normal: [f64; D],
        offset: f64,
    ) -> Vec<FeaturePoint<D>> {
        let mut points = Vec::new();
        for index in 0..grid.sample_count() {
            let sample = coordinates(index, grid.shape);
            let s = distance(grid, normal, offset, sample);
            let foot: [f64; D] = std::array::from_fn(|k| -s * normal[k] / grid.step[k]);
            if foot.iter().all(|f| f.abs() <= 0.5) {
                points.push(FeaturePoint {
                    index,
                    position: std::array::from_fn(|k| sample[k] as f64 + foot[k]),
                    normal,
                    strength: 1.0,
                });
            }
        }
        points
    }

    /// How far a sample is from a plane through the box's middle, moved by `offset`, in lattice units.
    fn distance<const D: usize>(
        grid: &Grid<D>,
        normal: [f64; D],
        offset: f64,
        sample: [usize; D],
    ) -> f64 {
        let from_middle =
            |k: usize| (sample[k] as f64 - 0.5 * (grid.shape[k] - 1) as f64) * grid.step[k];
        (0..D).map(|k| normal[k] * from_middle(k)).sum::<f64>() - offset
    }

    /// Valleys on a plane have one depth and width.
    fn is_gaussian_of_distance<const D: usize>(grid: Grid<D>, normal: [f64; D], offset: f64) {
        let norm = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
        let normal = normal.map(|n| n / norm);
        let sigma = 1.3;
        let b = widen(&plane(&grid, normal, offset), &grid, sigma);
        for (index, &b) in b.iter().enumerate() {
            let sample = coordinates(index, grid.shape);
            // where the plane leaves the box its points end, and beyond there is none
            if (0..D).any(|k| !(8..grid.shape[k] - 8).contains(&sample[k])) {
                continue;
            }
            let s = distance(&grid, normal, offset, sample);
            let expected =
                if s.abs() < 4.0 * sigma { -(-0.5 * (s / sigma).powi(2)).exp() } else { 0.0 };
            // rounding of coordinates; the discs leave no gaps
            assert!(
                (f64::from(b) - expected).abs() < 1e-3,
                "{b} {expected} at {sample:?} {normal:?}"
            );
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn valleys_have_one_depth_and_width_at_any_slant(
            normal in prop::array::uniform3(-1.0..1.0f64),
            offset in -1.0..1.0f64,
        ) {
            prop_assume!(normal.iter().map(|n| n * n).sum::<f64>() > 0.01);
            prop_assume!(normal[..2].iter().map(|n| n * n).sum::<f64>() > 0.01);
            is_gaussian_of_distance(Grid { shape: [23, 22, 21], step: [1.0; 3] }, normal, offset);
            is_gaussian_of_distance(Grid { shape: [31, 30], step: [1.0; 2] }, [normal[0], normal[1]], offset);
        }
    }

    #[test]
    fn diagonal_sheets_have_no_gaps() {
        for offset in [0.0, 0.2, 0.5] {
            is_gaussian_of_distance(Grid { shape: [23; 3], step: [1.0; 3] }, [1.0; 3], offset);
            is_gaussian_of_distance(
                Grid { shape: [23; 3], step: [1.0; 3] },
                [1.0, 1.0, 0.0],
                offset,
            );
            is_gaussian_of_distance(Grid { shape: [23; 2], step: [1.0; 2] }, [1.0, -1.0], offset);
        }
    }

    #[test]
    fn distances_are_in_lattice_units() {
        // σ is 1.3 lattice units, also along an axis whose samples are closer or farther
        is_gaussian_of_distance(Grid { shape: [40, 23], step: [0.5, 1.0] }, [1.0, 0.0], 0.1);
        is_gaussian_of_distance(Grid { shape: [23, 30], step: [1.0, 1.5] }, [0.6, 0.8], 0.0);
    }

    #[test]
    fn a_valley_across_a_coarse_axis_is_as_wide_as_it_must_be() {
        let grid = Grid { shape: [5, 9], step: [1.0, 4.0] };
        let point = FeaturePoint { normal: [0.0, 1.0], ..at([2, 4], grid.shape) };
        let b = widen(&[point], &grid, 1.0);
        // the next sample is 4 lattice units away, which are 1/0.7 of the narrowest σ
        let expected = -(-0.5f32 / 0.49).exp();
        assert!((b[2 + 5 * 5] - expected).abs() < 1e-6 && b[2 + 5 * 4] == -1.0, "{b:?}");
    }

    #[test]
    fn features_end_round() {
        let grid = Grid { shape: [40, 21], step: [1.0; 2] };
        let point = |x| FeaturePoint { normal: [0.0, 1.0], ..at([x, 10], grid.shape) };
        let line = (5..20).map(point);
        let b = widen(&line.collect::<Vec<_>>(), &grid, 2.0);
        let end = 19.0 + DISC as f32;
        for (x, y) in [(22, 10), (24, 10), (22, 13), (20, 8)] {
            let squared = (x as f32 - end).powi(2) + (y as f32 - 10.0).powi(2);
            assert!((b[x + 40 * y] + (-squared / 8.0).exp()).abs() < 1e-5);
        }
        assert_eq!(b[39 + 40 * 20].to_bits(), 0.0f32.to_bits());
    }

    #[test]
    fn nothing_gives_zeros() {
        let grid = Grid { shape: [3, 2], step: [1.0; 2] };
        assert_eq!(widen(&[], &grid, 1.0), [0.0; 6]);
    }

    #[test]
    fn bits_depend_neither_on_threads_nor_on_the_order_of_points() {
        let grid = Grid { shape: [20, 21, 40], step: [1.0; 3] };
        let mut points = plane(&grid, [0.6, 0.0, 0.8], 0.0);
        let run = |threads, points: &[FeaturePoint<3>]| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| widen(points, &grid, 1.0))
        };
        let one = run(1, &points);
        assert_eq!(one, run(3, &points));
        points.reverse();
        assert_eq!(one, run(2, &points));
    }
}
