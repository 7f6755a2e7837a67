//! Crests: the lines (2-D) and sheets (3-D) that features of any kind are thinned to.
//!
//! Whatever finds features gives their crests, sample by sample but with places between the samples.
//! Here they are cleaned ([`connected`]) and turned into a potential whose valleys have one depth and
//! width, whatever the features' own strength, width and slant are ([`widen`]).
//! Source: Hale (2002) thins to whole samples and smooths these; that leaves valleys deeper along the axes
//! than aslant. Distances to crests between samples do not.

use crate::geometry::Sets;
use crate::image::{Grid, coordinates, neighbour};
use rayon::prelude::*;
use std::ops::Range;

/// A point on the crest of a feature: the line in 2-D, or sheet in 3-D, that the feature is thinned to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crest<const D: usize> {
    /// The sample it belongs to, x fastest.
    pub index: usize,
    /// Where it is, in samples, within half a sample of it along each axis, or a little more.
    pub point: [f32; D],
    /// The unit normal of the line or sheet, in lattice units; its sign means nothing.
    pub normal: [f32; D],
    /// How strong the feature is there, 0…1.
    pub strength: f32,
}

/// How far from its point a crest is taken to go on, straight on, in samples along its steepest axis: at least half of what
/// lies between neighbours, which on a line just off the diagonal is a whole diagonal, √2, and a little.
const PATCH: f64 = 1.01;

/// Where valleys end, in standard deviations, as kernels do: b is −3·10⁻⁴ there.
const TRUNCATE: f64 = 4.0;

/// A valley is not made narrower than this many samples across it: along a coarser axis a narrower one
/// would fall between samples. As of Gaussian operators.
const NARROWEST: f64 = 0.7;

/// Planes whose distances are worked out together.
const SLAB: usize = 8;

/// Keeps connected groups that reach `high` somewhere, are at least `low` throughout, and have `least` members.
///
/// Connected are crests of samples that touch, at corners too. Returned in the order of their samples.
/// Cost: O(n) for n crests in order; memory: some bytes a crest, none a sample.
pub(crate) fn connected<const D: usize>(
    mut crests: Vec<Crest<D>>,
    shape: [usize; D],
    low: f32,
    high: f32,
    least: usize,
) -> Vec<Crest<D>> {
    crests.retain(|crest| crest.strength >= low);
    crests.sort_by_key(|crest| crest.index); // stable, and quick where they are in order
    let roots = groups(&crests, shape);
    let mut sizes = vec![(0usize, 0.0f32); crests.len()];
    for (crest, &root) in crests.iter().zip(&roots) {
        let (count, strongest) = &mut sizes[root as usize];
        *count += 1;
        *strongest = strongest.max(crest.strength);
    }
    let mut roots = roots.iter();
    crests.retain(|_| {
        let Some(&root) = roots.next() else { return false };
        let (count, strongest) = sizes[root as usize];
        count >= least && strongest >= high
    });
    crests
}

/// For each crest, in the order of their samples, the first of its group.
fn groups<const D: usize>(crests: &[Crest<D>], shape: [usize; D]) -> Vec<u32> {
    let mut groups = Sets::new(crests.len());
    // each neighbour's place in the list advances as the crest's own does
    let mut places = vec![0; 3usize.pow(D as u32) / 2];
    for (i, crest) in crests.iter().enumerate() {
        if i > 0 && crests[i - 1].index == crest.index {
            groups.join(i as u32 - 1, i as u32);
        }
        let sample = coordinates(crest.index, shape);
        for (code, place) in places.iter_mut().enumerate() {
            let Some(index) = neighbour(sample, shape, code) else { continue };
            while crests[*place].index < index {
                *place += 1; // ends at the crest itself at the latest
            }
            if crests[*place].index == index {
                groups.join(*place as u32, i as u32);
            }
        }
    }
    groups.roots()
}

/// b(x): −1 on crests, of one depth and width: −exp(−s²/2σ²), s the distance to the nearest crest's line or sheet.
///
/// `sigma` is in lattice units, but no less than 0.7 samples across the crest. Each crest stands for
/// the piece of the line or sheet about its point, straight and flat, so that s is exact on planes and off by
/// 0.4 of the curvature (per sample) where they bend; beyond the ends of features s is the distance to the end.
///
/// Cost: O(σᴰ) a crest. The same at any number of threads: the least of distances does not depend on
/// their order.
///
/// # Panics
/// If σ is not finite and above 0.
pub(crate) fn widen<const D: usize>(crests: &[Crest<D>], grid: &Grid<D>, sigma: f64) -> Vec<f32> {
    assert!(sigma.is_finite() && sigma > 0.0, "σ is {sigma}");
    let mut ordered: Vec<&Crest<D>> = crests.iter().collect();
    ordered.sort_by_key(|crest| crest.index);
    let mut values = vec![f32::INFINITY; grid.sample_count()];
    let plane: usize = grid.shape[..D - 1].iter().product();
    let reach = 2 + (TRUNCATE * sigma / grid.step[D - 1] + TRUNCATE * NARROWEST + PATCH) as usize;
    values.par_chunks_mut(SLAB * plane).enumerate().for_each(|(slab, part)| {
        let first = slab * SLAB;
        let last = first + part.len() / plane;
        let at_least = |p: usize| ordered.partition_point(|crest| crest.index < p * plane);
        let near = at_least(first.saturating_sub(reach))..at_least(last + reach);
        for crest in &ordered[near] {
            Patch::new(crest, grid, sigma).lower(part, first..last, grid);
        }
        for value in part {
            // no −0 where nothing is near
            *value =
                if *value < (TRUNCATE * TRUNCATE) as f32 { -(-0.5 * *value).exp() } else { 0.0 };
        }
    });
    values
}

/// A flat piece of a crest's line or sheet.
struct Patch<const D: usize> {
    /// Its middle, in samples.
    point: [f32; D],
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

impl<const D: usize> Patch<D> {
    fn new(crest: &Crest<D>, grid: &Grid<D>, sigma: f64) -> Self {
        let (mut across, mut radius) = (0.0, 0.0f64);
        for k in 0..D {
            let normal = f64::from(crest.normal[k]);
            across += (normal * grid.step[k]).powi(2);
            radius = radius.max(grid.step[k] * (1.0 - normal * normal).max(0.0).sqrt());
        }
        let sigma = sigma.max(NARROWEST * across.sqrt());
        let radius = PATCH * radius;
        let reach = TRUNCATE * sigma + radius;
        Self {
            point: crest.point,
            normal: crest.normal,
            radius: radius as f32,
            inverse: (1.0 / sigma) as f32,
            reach_squared: (reach * reach) as f32,
            reach: grid.step.map(|step| (reach / step) as f32),
        }
    }

    /// Lowers (s/σ)² in a slab of planes to this patch's.
    fn lower(&self, slab: &mut [f32], planes: Range<usize>, grid: &Grid<D>) {
        let plane: usize = grid.shape[..D - 1].iter().product();
        let range = |k: usize, within: Range<usize>| {
            let from = (self.point[k] - self.reach[k]).ceil().max(0.0) as usize;
            let to = (self.point[k] + self.reach[k]).floor().max(-1.0) + 1.0;
            from.max(within.start)..(to as usize).min(within.end)
        };
        let offset = |k: usize, i: usize| (i as f32 - self.point[k]) * grid.step[k] as f32;
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
    use proptest::prelude::*;

    fn at<const D: usize>(sample: [usize; D], shape: [usize; D], strength: f32) -> Crest<D> {
        let index = (0..D).rev().fold(0, |index, k| index * shape[k] + sample[k]);
        Crest {
            index,
            point: sample.map(|i| i as f32),
            normal: std::array::from_fn(|k| if k == 0 { 1.0 } else { 0.0 }),
            strength,
        }
    }

    fn kept<const D: usize>(
        crests: &[([usize; D], f32)],
        shape: [usize; D],
        (low, high, least): (f32, f32, usize),
    ) -> Vec<usize> {
        let crests = crests.iter().map(|&(sample, s)| at(sample, shape, s)).collect();
        connected(crests, shape, low, high, least).iter().map(|crest| crest.index).collect()
    }

    #[test]
    fn groups_hang_together_by_corners_and_not_across_the_border() {
        let shape = [4, 4];
        // a diagonal of three, and two alone: (3, 0) follows (0, 1) in memory only
        let crests = [([3, 3], 1.0), ([0, 0], 1.0), ([3, 0], 1.0), ([1, 2], 1.0), ([0, 1], 1.0)];
        assert_eq!(kept(&crests, shape, (0.0, 0.0, 3)), [0, 4, 9]);
        assert_eq!(kept(&crests, shape, (0.0, 0.0, 4)), [0usize; 0]);
        // a V, whose arms are two groups until its tip joins them
        let crests = [([0, 0], 1.0), ([2, 0], 1.0), ([1, 1], 1.0)];
        assert_eq!(kept(&crests, shape, (0.0, 0.0, 3)), [0, 2, 5]);
    }

    #[test]
    fn groups_in_space_meet_at_corners() {
        let shape = [3, 3, 3];
        let crests = [([0, 0, 0], 1.0), ([1, 1, 1], 1.0), ([2, 0, 2], 1.0), ([0, 0, 2], 1.0)];
        assert_eq!(kept(&crests, shape, (0.0, 0.0, 4)).len(), 4);
        let apart = [([0, 0, 0], 1.0), ([2, 0, 0], 1.0), ([0, 1, 0], 1.0), ([2, 2, 2], 1.0)];
        assert_eq!(kept(&apart, shape, (0.0, 0.0, 2)), [0, 3]);
    }

    #[test]
    fn weak_members_stay_where_a_strong_one_is_in_the_group() {
        let shape = [9, 1];
        let strengths = [0.3, 0.9, 0.3, 0.1, 0.3, 0.5, 0.0, 0.95, 0.0];
        let crests: Vec<_> = strengths.iter().enumerate().map(|(x, &s)| ([x, 0], s)).collect();
        assert_eq!(kept(&crests, shape, (0.3, 0.9, 1)), [0, 1, 2, 7]);
        assert_eq!(kept(&crests, shape, (0.3, 0.9, 2)), [0, 1, 2]);
        assert_eq!(kept(&crests, shape, (0.3, 0.96, 1)), [0usize; 0]);
    }

    #[test]
    fn crests_of_one_sample_are_one_group() {
        let crests = vec![at([1, 1], [3, 3], 0.5), at([1, 1], [3, 3], 1.0)];
        assert_eq!(connected(crests, [3, 3], 0.0, 1.0, 2).len(), 2);
    }

    /// The crests of a plane: feet of samples on it that are within half a sample along each axis.
    fn plane<const D: usize>(grid: &Grid<D>, normal: [f64; D], offset: f64) -> Vec<Crest<D>> {
        let mut crests = Vec::new();
        for index in 0..grid.sample_count() {
            let sample = coordinates(index, grid.shape);
            let s = distance(grid, normal, offset, sample);
            let foot: [f64; D] = std::array::from_fn(|k| -s * normal[k] / grid.step[k]);
            if foot.iter().all(|f| f.abs() <= 0.5) {
                crests.push(Crest {
                    index,
                    point: std::array::from_fn(|k| (sample[k] as f64 + foot[k]) as f32),
                    normal: normal.map(|n| n as f32),
                    strength: 1.0,
                });
            }
        }
        crests
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
            // where the plane leaves the box its crests end, and beyond there is none
            if (0..D).any(|k| !(8..grid.shape[k] - 8).contains(&sample[k])) {
                continue;
            }
            let s = distance(&grid, normal, offset, sample);
            let expected =
                if s.abs() < 4.0 * sigma { -(-0.5 * (s / sigma).powi(2)).exp() } else { 0.0 };
            // rounding of coordinates; the patches leave no gaps
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
        let crest = Crest { normal: [0.0, 1.0], ..at([2, 4], grid.shape, 1.0) };
        let b = widen(&[crest], &grid, 1.0);
        // the next sample is 4 lattice units away, which are 1/0.7 of the narrowest σ
        let expected = -(-0.5f32 / 0.49).exp();
        assert!((b[2 + 5 * 5] - expected).abs() < 1e-6 && b[2 + 5 * 4] == -1.0, "{b:?}");
    }

    #[test]
    fn features_end_round() {
        let grid = Grid { shape: [40, 21], step: [1.0; 2] };
        let line = (5..20).map(|x| Crest { normal: [0.0, 1.0], ..at([x, 10], grid.shape, 1.0) });
        let b = widen(&line.collect::<Vec<_>>(), &grid, 2.0);
        let end = 19.0 + PATCH as f32;
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
    fn bits_depend_neither_on_threads_nor_on_the_order_of_crests() {
        let grid = Grid { shape: [20, 21, 40], step: [1.0; 3] };
        let mut crests = plane(&grid, [0.6, 0.0, 0.8], 0.0);
        let run = |threads, crests: &[Crest<3>]| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| widen(crests, &grid, 1.0))
        };
        let one = run(1, &crests);
        assert_eq!(one, run(3, &crests));
        crests.reverse();
        assert_eq!(one, run(2, &crests));
    }
}
