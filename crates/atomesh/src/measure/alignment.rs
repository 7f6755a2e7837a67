//! How well the facets of a mesh follow the features of a potential.

use super::MeasureError;
use super::features::check_size;
use super::nearest::{FacetTree, Near};
use super::precision::PrecisionReport;
use super::statistics::{percentile, sum};
use crate::crests::FeaturePoint;
use crate::mesh::{Mesh, PolyMesh};
use crate::parallel::prelude::*;
use crate::watch::{Phase, Watch, check};
use rand::{Rng, SeedableRng};

/// Feature points between two looks at the watch: a few hundredths of a second.
const POINTS_PER_STEP: usize = 1 << 13;

/// How alignment is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignmentOptions {
    /// The nominal distance d in samples; sets τ = max(1, d/10).
    pub size: f64,
    /// The greatest angle between a facet and a feature's tangent, in degrees. Default 20.
    pub tangent: f64,
    /// The most feature points to measure; of more, as many are picked at random. Default 20,000.
    pub limit: usize,
    /// Fixes the pick. Default 0.
    pub seed: u64,
}

impl AlignmentOptions {
    /// The defaults for a nominal distance of `size` samples.
    pub fn new(size: f64) -> Self {
        Self { size, tangent: 20.0, limit: 20_000, seed: 0 }
    }
}

/// How well a mesh follows features. Distances are in samples.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct AlignmentReport {
    /// Feature points measured, at most the limit.
    pub features: usize,
    /// Feature points found.
    pub features_found: usize,
    /// How near a facet must pass: max(1, d/10).
    pub tau: f64,
    /// The share of feature points that a facet passes within τ and within 20° (or the angle asked
    /// for) of the feature's tangent; `None` without features.
    pub recall: Option<f64>,
    /// Mean distance from feature points to the nearest facet.
    pub dist_mean: Option<f64>,
    /// 95th percentile of that distance.
    pub dist_p95: Option<f64>,
    /// The mean distance as a share of d.
    pub dist_mean_relative: Option<f64>,
    /// The 95th percentile as a share of d.
    pub dist_p95_relative: Option<f64>,
    /// The share of selected facets that lies on features; `None` if it was not measured.
    #[serde(flatten)]
    pub selected: Option<PrecisionReport>,
}

/// Measures how well the facets of `mesh`, in sample coordinates, follow `features`.
///
/// Distances are exact: every facet counts, wherever its centre is. Deterministic: the same at any
/// thread count. Cost: O(m log m) in facets and about O(log m) for each feature point.
///
/// # Errors
/// [`MeasureError`] if the mesh has no cells, the size is not a finite number above 0, or the watch ends the work.
pub fn alignment<const D: usize>(
    mesh: &Mesh<D>,
    features: &[FeaturePoint<D>],
    options: &AlignmentOptions,
    watch: &mut dyn Watch,
) -> Result<AlignmentReport, MeasureError> {
    check_size(options.size)?;
    if mesh.cell_count() == 0 {
        return Err(MeasureError::NoCells { points: mesh.points().len() });
    }
    check(watch, Phase::Measure, 0.0, None)?;
    alignment_by(&FacetTree::new(mesh), features, options, watch)
}

/// Measures how well the faces of polygons or polyhedra, in sample coordinates, follow `features`; otherwise
/// as [`alignment`].
///
/// # Errors
/// [`MeasureError`] if the size is not a finite number above 0, or the watch ends the work.
pub fn alignment_of_faces<const D: usize>(
    mesh: &PolyMesh<D>,
    features: &[FeaturePoint<D>],
    options: &AlignmentOptions,
    watch: &mut dyn Watch,
) -> Result<AlignmentReport, MeasureError> {
    check_size(options.size)?;
    check(watch, Phase::Measure, 0.0, None)?;
    let facets = (0..mesh.face_count()).flat_map(|face| mesh.face_parts(face)).collect();
    alignment_by(&FacetTree::of(mesh.points(), facets), features, options, watch)
}

fn alignment_by<const D: usize>(
    tree: &FacetTree<'_, D>,
    features: &[FeaturePoint<D>],
    options: &AlignmentOptions,
    watch: &mut dyn Watch,
) -> Result<AlignmentReport, MeasureError> {
    let tau = (0.1 * options.size).max(1.0);
    let near = Near { distance: tau, sine_squared: options.tangent.to_radians().sin().powi(2) };
    let picked = pick(features.len(), options.limit, options.seed);
    let mut found = Vec::with_capacity(picked.len());
    for block in picked.chunks(POINTS_PER_STEP) {
        check(watch, Phase::Measure, found.len() as f64 / picked.len() as f64, None)?;
        found.par_extend(
            block.par_iter().map(|&i| tree.query(&features[i].position, &features[i].normal, near)),
        );
    }

    let count = found.len();
    let share = |value: f64| (count > 0).then(|| value / count as f64);
    let mut distances: Vec<f64> = found.iter().map(|f| f.0).collect();
    let dist_mean = share(sum(0..count, &|i| distances[i]));
    let dist_p95 = (count > 0).then(|| percentile(&mut distances, 95.0));
    Ok(AlignmentReport {
        features: count,
        features_found: features.len(),
        tau,
        recall: share(found.iter().filter(|f| f.1).count() as f64),
        dist_mean,
        dist_p95,
        dist_mean_relative: dist_mean.map(|d| d / options.size),
        dist_p95_relative: dist_p95.map(|d| d / options.size),
        selected: None,
    })
}

/// At most `limit` of the numbers below `count`, ascending, every choice equally likely (Knuth,
/// *The Art of Computer Programming*, 3.4.2, algorithm S).
fn pick(count: usize, limit: usize, seed: u64) -> Vec<usize> {
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut wanted = limit.min(count);
    let mut picked = Vec::with_capacity(wanted);
    for i in 0..count {
        let unit = (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        if unit * ((count - i) as f64) < wanted as f64 {
            picked.push(i);
            wanted -= 1;
        }
    }
    picked
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::watch::Silent;

    /// A square of n × n samples in n − 1 columns and rows of squares, each cut in two triangles,
    /// sheared in x by `shear` a row.
    fn ruled(n: usize, shear: f64) -> Mesh<2> {
        let points = (0..n * n)
            .map(|i| [(i % n) as f64 * 8.0 + shear * (i / n) as f64, (i / n) as f64 * 8.0])
            .collect();
        let mut corners = Vec::new();
        for y in 0..n as u32 - 1 {
            for x in 0..n as u32 - 1 {
                let a = x + y * n as u32;
                let b = a + n as u32;
                corners.extend([a, a + 1, b, a + 1, b + 1, b]);
            }
        }
        Mesh::new(points, corners).unwrap()
    }

    /// Points on the line x = `x`, whose normal is along x.
    fn upright(x: f64) -> Vec<FeaturePoint<2>> {
        let at =
            |y| FeaturePoint { index: 0, position: [x, y], normal: [-1.0, 0.0], strength: 1.0 };
        (0..40).map(|i| at(f64::from(i) + 0.5)).collect()
    }

    #[test]
    fn a_feature_along_edges_is_recalled_and_its_distance_is_known() {
        let options = AlignmentOptions::new(8.0);
        let on = alignment(&ruled(8, 0.0), &upright(16.25), &options, &mut Silent).unwrap();
        assert_eq!((on.features, on.features_found, on.tau), (40, 40, 1.0));
        assert_eq!(on.recall, Some(1.0));
        // rows of the mesh cross the feature, so some points are nearer than 0.25
        assert!(on.dist_mean.unwrap() <= 0.25 && on.dist_p95 == Some(0.25));
        assert_eq!(on.dist_p95_relative, Some(0.25 / 8.0));

        // between columns only rows and diagonals pass within 1, and they point elsewhere
        let between = alignment(&ruled(8, 0.0), &upright(20.0), &options, &mut Silent).unwrap();
        assert_eq!(between.recall, Some(0.0));
    }

    #[test]
    fn the_angle_decides() {
        // columns lean by atan(shear / 8): 18.4° and 21.0°; points where they cross the feature
        for (shear, recalled) in
            [(8.0 * 18.4f64.to_radians().tan(), true), (8.0 * 21f64.to_radians().tan(), false)]
        {
            let position = [16.0 + shear * 2.5, 20.0];
            let crossing = FeaturePoint { index: 0, position, normal: [1.0, 0.0], strength: 1.0 };
            let mesh = ruled(8, shear);
            let report =
                alignment(&mesh, &[crossing], &AlignmentOptions::new(8.0), &mut Silent).unwrap();
            assert_eq!(report.recall, Some(if recalled { 1.0 } else { 0.0 }));
            assert!(report.dist_mean.unwrap() < 1e-14);
        }
    }

    #[test]
    fn tau_grows_with_the_size() {
        let report = alignment(
            &ruled(8, 0.0),
            &upright(17.5),
            &AlignmentOptions { size: 16.0, ..AlignmentOptions::new(8.0) },
            &mut Silent,
        );
        assert_eq!(report.unwrap().tau, 1.6);
    }

    #[test]
    fn no_features_give_no_shares() {
        let none: Vec<FeaturePoint<2>> = Vec::new();
        let report =
            alignment(&ruled(3, 0.0), &none, &AlignmentOptions::new(8.0), &mut Silent).unwrap();
        assert_eq!((report.features, report.recall, report.dist_mean), (0, None, None));
        let empty = Mesh::<2>::new(vec![], vec![]).unwrap();
        let error = alignment(&empty, &none, &AlignmentOptions::new(8.0), &mut Silent);
        assert_eq!(error, Err(MeasureError::NoCells { points: 0 }));
        let error = alignment(&ruled(3, 0.0), &none, &AlignmentOptions::new(-1.0), &mut Silent);
        assert_eq!(error, Err(MeasureError::Size { value: -1.0 }));
    }

    #[test]
    fn a_pick_is_ascending_fair_and_seeded() {
        assert_eq!(pick(5, 9, 0), [0, 1, 2, 3, 4]);
        let mut chosen = [0u32; 50];
        for seed in 0..2000 {
            let picked = pick(50, 10, seed);
            assert!(picked.len() == 10 && picked.is_sorted());
            picked.iter().for_each(|&i| chosen[i] += 1);
        }
        // binomial with mean 400 and deviation 18
        assert!(chosen.iter().all(|&n| n.abs_diff(400) < 100), "{chosen:?}");
        assert_eq!(pick(50, 10, 3), pick(50, 10, 3));
    }
}
