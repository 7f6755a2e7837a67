//! Promises of improved meshes, and swaps against all that there are.

use super::*;
use crate::fields::NominalDistance;
use crate::fields::{ImageWeight, Interpolation, ScalarField};
use crate::image::Grid;
use crate::mesh::Delaunay;
use crate::watch::Silent;
use edge_ring::{EdgeRing, MOST};
use proptest::prelude::*;
use std::collections::HashSet;
use tetrahedra::Tetrahedra;

/// The box of all tests but those of one cell.
const SIDE: f64 = 12.0;

/// A dark sheet across the box, two samples wide, through its middle.
fn sheet(p: &Point<3>) -> f64 {
    let height = (p[0] + 0.4 * p[1] - 0.3 * p[2] - 0.55 * SIDE) / 1.25_f64.sqrt();
    -(-0.5 * (height / 1.2).powi(2)).exp()
}

fn potential(b: impl Fn(&Point<3>) -> f64) -> ScalarField<3> {
    let grid = Grid { shape: [13; 3], step: [1.0; 3] };
    let at = |i: usize| [i % 13, i / 13 % 13, i / 169].map(|k| k as f64);
    let samples = (0..grid.sample_count()).map(|i| b(&at(i)) as f32).collect();
    ScalarField::new(grid, samples, Interpolation::Linear).unwrap()
}

/// A Delaunay mesh of the box's corners and of points within it, some of them drawn to its sides.
fn mesh(inside: &[Point<3>]) -> Mesh<3> {
    let mut points: Vec<Point<3>> =
        (0..8).map(|c| std::array::from_fn(|k| if c >> k & 1 == 1 { SIDE } else { 0.0 })).collect();
    for p in inside {
        points.push(p.map(|x| if x < 1.0 { 0.0 } else { x.min(SIDE + 1.0) }.min(SIDE)));
    }
    points.sort_by(crate::geometry::lexicographic);
    points.dedup();
    Delaunay::<3>::new().connect(&points, &mut Silent).unwrap()
}

fn improve(
    mesh: Mesh<3>,
    potential: &ScalarField<3>,
    beta: f64,
    options: &ImproveOptions,
) -> Result<(Mesh<3>, ImproveReport), ImproveError> {
    let weight = ImageWeight::constant(beta).unwrap();
    let distance = NominalDistance::constant(potential.grid(), 3.0).unwrap();
    let fields = FieldsView { potential, weight: &weight, distance: &distance };
    let freedom = vec![7; mesh.points().len()];
    SpaceImprover.improve(
        mesh,
        Held { freedom: &freedom, facets: &[], near: None },
        fields,
        options,
        &mut Silent,
    )
}

/// A crystal whose points are moved at random: what a lattice is like.
fn crystal(shifts: &[f64]) -> Vec<Point<3>> {
    let place = |n: usize| {
        let (site, odd) = (n / 2, (n % 2) as f64);
        [site % 5, site / 5 % 5, site / 25].map(|k| 2.9 * k as f64 + 1.45 * odd)
    };
    (0..shifts.len() / 3)
        .map(|n| std::array::from_fn(|k| (place(n)[k] + shifts[3 * n + k]).max(0.0)))
        .collect()
}

fn sides(p: &Point<3>) -> u8 {
    Bounds { min: [0.0; 3], max: [SIDE; 3] }.sides(p, 0.0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn improved_meshes_keep_their_promises(
        shifts in prop::collection::vec(-0.6..0.6f64, 3 * 180),
        align in prop::sample::select(vec![Align::Off, Align::Swaps, Align::Full]),
        min_angle in 0.0..40.0f64,
    ) {
        let mesh = mesh(&crystal(&shifts));
        let options = ImproveOptions { align, min_angle };
        let (better, report) = improve(mesh.clone(), &potential(sheet), 0.4, &options).unwrap();
        prop_assert_eq!(better.validate(), Ok(()));
        // strays may be merged, but not those on a side
        let on_sides = |mesh: &Mesh<3>| mesh.points().iter().filter(|p| sides(p) != 0).count();
        prop_assert_eq!(on_sides(&better), on_sides(&mesh));
        let is_whole = better.points().len() == mesh.points().len();
        prop_assert!(is_whole || align == Align::Full && better.points().len() < mesh.points().len());
        // some thousand roundings of volumes that sum to the box's
        prop_assert!((better.measure() - SIDE.powi(3)).abs() < 1e-12 * SIDE.powi(3));
        for (p, q) in mesh.points().iter().zip(better.points()).filter(|_| is_whole) {
            prop_assert_eq!(sides(p) & !sides(q), 0, "{:?} left a side for {:?}", p, q);
            prop_assert!(align == Align::Full || p == q);
        }
        // the floor may cost what is above it, but nothing falls below what was worse
        let kept = report.angle_before.min(min_angle);
        prop_assert!(report.angle_after > kept - 1e-6, "{:?}", report);
        prop_assert_eq!(report.floor_held, report.below == 0);
        prop_assert!(align != Align::Off || better == mesh);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn facets_that_are_held_stay(
        shifts in prop::collection::vec(-0.6..0.6f64, 3 * 180),
        align in prop::sample::select(vec![Align::Swaps, Align::Full, Align::Conform]),
    ) {
        let mesh = mesh(&crystal(&shifts));
        // the border of the cells on one side of a plane
        let is_low = |cell: u32| {
            let corners = &mesh.corners()[4 * cell as usize..][..4];
            corners.iter().map(|&c| mesh.points()[c as usize][2]).sum::<f64>() < 2.0 * SIDE
        };
        let held: Vec<[u32; 3]> = (mesh.facets().iter())
            .filter(|facet| facet.neighbour.is_some_and(|n| is_low(n) != is_low(facet.cell)))
            .map(|facet| facet.corners)
            .collect();
        let places = |mesh: &Mesh<3>, facet: &[u32; 3]| -> [Point<3>; 3] {
            let mut places = facet.map(|c| mesh.points()[c as usize]);
            places.sort_by(crate::geometry::lexicographic);
            places
        };
        let mut freedom = vec![7; mesh.points().len()];
        held.iter().flatten().for_each(|&c| freedom[c as usize] = 0);
        let potential = potential(sheet);
        let weight = ImageWeight::constant(0.4).unwrap();
        let distance = NominalDistance::constant(potential.grid(), 3.0).unwrap();
        let fields = FieldsView { potential: &potential, weight: &weight, distance: &distance };
        let options = ImproveOptions { align, ..ImproveOptions::for_dimension(3) };
        let given = Held { freedom: &freedom, facets: &held, near: None };
        let better = SpaceImprover.improve(mesh.clone(), given, fields, &options, &mut Silent);
        let (better, _) = better.unwrap();
        prop_assert_eq!(better.validate(), Ok(()));
        let facets = better.facets();
        let after: Vec<[Point<3>; 3]> =
            facets.iter().map(|facet| places(&better, &facet.corners)).collect();
        for facet in &held {
            prop_assert!(after.contains(&places(&mesh, facet)), "{:?} has gone", facet);
        }
    }
}

/// All ways to fill a polygon with triangles: the greatest least worth, and the greatest sum.
fn best_of_all(i: usize, j: usize, worth: &impl Fn(usize, usize, usize) -> f64) -> (f64, f64) {
    if j < i + 2 {
        return (f64::INFINITY, 0.0);
    }
    (i + 1..j).fold((f64::NEG_INFINITY, f64::NEG_INFINITY), |best, k| {
        let (low, high) = (best_of_all(i, k, worth), best_of_all(k, j, worth));
        let here = worth(i, k, j);
        (best.0.max(low.0.min(high.0).min(here)), best.1.max(low.1 + high.1 + here))
    })
}

/// `count` cells around the edge from point 0 to point 1.
fn wheel(count: usize, shifts: &[f64]) -> Tetrahedra {
    let mut points = vec![[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]];
    for n in 0..count {
        let (sine, cosine) = (std::f64::consts::TAU * n as f64 / count as f64).sin_cos();
        let r = 1.5 + shifts[2 * n];
        points.push([r * cosine, r * sine, shifts[2 * n + 1]]);
    }
    let at = |n: usize| 2 + (n % count) as u32;
    let cells = (0..count).map(|n| [0, 1, at(n), at(n + 1)]).collect();
    let all = points.len();
    Tetrahedra::new(points, vec![7; all], vec![0; all], cells, &HashSet::new())
}

proptest! {
    #[test]
    fn the_best_filling_is_the_best_of_all(
        count in 3..=MOST,
        shifts in prop::collection::vec(-0.5..0.5f64, 2 * MOST),
    ) {
        let tetrahedra = wheel(count, &shifts);
        let ring = EdgeRing::around(&tetrahedra, 1, 0, 1).unwrap();
        prop_assert_eq!((ring.count, ring.cell_count), (count, count));
        let worth = |ring: &EdgeRing, i, k, j| {
            let cosines = ring.pair(i, k, j).map(|c| tetrahedra.shape_of(&c).cosine);
            -cosines[0].max(cosines[1])
        };
        let all = |i, k, j| worth(&ring, i, k, j);
        let (least, sum) = best_of_all(0, count - 1, &all);
        let found = ring.fill(f64::NEG_INFINITY, worth, f64::min, f64::INFINITY).unwrap();
        prop_assert_eq!(found.worth, least);
        let found = ring.fill(f64::NEG_INFINITY, worth, |a, b| a + b, 0.0).unwrap();
        prop_assert!((found.worth - sum).abs() < 1e-12); // sums of at most six, in another order
        let mut cells = Vec::new();
        ring.filled(&found, &mut cells);
        prop_assert_eq!(cells.len(), 2 * (count - 2));
    }
}

#[test]
fn a_swap_leaves_neighbours_as_cells_put_together_have_them() {
    let mut tetrahedra = wheel(5, &[0.0; 10]);
    let ring = EdgeRing::around(&tetrahedra, 0, 0, 1).unwrap();
    let worth = |ring: &EdgeRing, i, k, j| {
        let cosines = ring.pair(i, k, j).map(|c| tetrahedra.shape_of(&c).cosine);
        -cosines[0].max(cosines[1])
    };
    let filling = ring.fill(-1.0, worth, f64::min, f64::INFINITY).unwrap();
    slivers::remove_edge(&mut tetrahedra, &ring, &filling);
    let cells: Vec<[u32; 4]> = tetrahedra.cells().copied().collect();
    assert_eq!(cells.len(), 6);
    let fresh =
        Tetrahedra::new(tetrahedra.points.clone(), vec![7; 7], vec![0; 7], cells, &HashSet::new());
    let beyond =
        |tetrahedra: &Tetrahedra, cell: usize, k: usize| match tetrahedra.neighbours[cell][k] {
            tetrahedra::NONE => None,
            other => Some(tetrahedra.corners[other as usize]),
        };
    for (cell, corners) in fresh.corners.iter().enumerate() {
        let same = tetrahedra.corners.iter().position(|c| c == corners).unwrap();
        (0..4).for_each(|k| assert_eq!(beyond(&tetrahedra, same, k), beyond(&fresh, cell, k)));
    }
}

/// Shifts that repeat but look random.
fn shifts(count: usize) -> Vec<f64> {
    (0..count).map(|n| 0.5 * ((n * n) as f64 * 0.618).sin()).collect()
}

#[test]
fn the_result_is_the_same_at_any_thread_count() {
    let run = || {
        let mesh = mesh(&crystal(&shifts(3 * 250)));
        improve(mesh, &potential(sheet), 0.4, &ImproveOptions::for_dimension(3)).unwrap()
    };
    let with = |threads| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(run)
    };
    let (one, three) = (with(1), with(3));
    assert!(one.1.swaps > 10 && one.1.moves > 10, "{:?}", one.1);
    assert_eq!(one, three);
}

#[test]
fn facets_are_left_alone_where_the_image_has_no_weight() {
    let start = mesh(&crystal(&shifts(3 * 250)));
    let options = ImproveOptions::for_dimension(3);
    let (aligned, _) = improve(start.clone(), &potential(sheet), 0.4, &options).unwrap();
    let (unaligned, _) = improve(start.clone(), &potential(sheet), 0.0, &options).unwrap();
    let (elsewhere, _) =
        improve(start, &potential(|p| sheet(&[p[2], p[0], p[1]])), 0.0, &options).unwrap();
    assert!(aligned != unaligned && unaligned == elsewhere);
}

#[test]
fn one_cell_and_a_flat_image_are_left_alone() {
    let points = vec![[0.0; 3], [5.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 5.0]];
    let cell = Mesh::new(points, vec![0, 1, 2, 3]).unwrap();
    let options = ImproveOptions::for_dimension(3);
    let (same, report) = improve(cell.clone(), &potential(|_| 0.0), 0.5, &options).unwrap();
    assert_eq!(same, cell);
    assert!(report.floor_held && report.swaps + report.moves == 0);
}

#[test]
fn a_floor_out_of_range_is_refused_and_a_watch_ends_the_work() {
    let mesh = mesh(&crystal(&shifts(3 * 100)));
    let wrong = ImproveOptions { min_angle: f64::NAN, ..ImproveOptions::for_dimension(3) };
    let error = improve(mesh.clone(), &potential(sheet), 0.4, &wrong).unwrap_err();
    assert!(matches!(error, ImproveError::MinAngle { .. }));
    struct Never;
    impl Watch for Never {
        fn step(&mut self, _: Phase, _: f64, _: Option<f64>) -> std::ops::ControlFlow<()> {
            std::ops::ControlFlow::Break(())
        }
    }
    let potential = potential(sheet);
    let weight = ImageWeight::constant(0.4).unwrap();
    let distance = NominalDistance::constant(potential.grid(), 3.0).unwrap();
    let fields = FieldsView { potential: &potential, weight: &weight, distance: &distance };
    let freedom = vec![7; mesh.points().len()];
    let options = ImproveOptions::for_dimension(3);
    let ended = SpaceImprover.improve(
        mesh,
        Held { freedom: &freedom, facets: &[], near: None },
        fields,
        &options,
        &mut Never,
    );
    assert!(matches!(ended, Err(ImproveError::Cancelled(_))));
}
