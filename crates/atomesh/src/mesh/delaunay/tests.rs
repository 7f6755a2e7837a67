//! What every connected mesh must satisfy, in both dimensions, on inputs of all kinds.

use super::*;
use crate::watch::Silent;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::ops::ControlFlow;

pub(super) fn scatter<const D: usize>(count: usize, seed: u64) -> Vec<Point<D>> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    (0..count).map(|_| std::array::from_fn(|_| random.random::<f64>())).collect()
}

/// All points of a crystal with the given sites in its unit cell, in a box of `cells` unit cells a
/// side, corners of the box included.
fn crystal<const D: usize>(sites: &[Point<D>], side: Point<D>, cells: usize) -> Vec<Point<D>> {
    let mut points = Vec::new();
    for index in 0..(cells + 1).pow(D as u32) {
        for site in sites {
            let at: Point<D> = std::array::from_fn(|k| {
                (index / (cells + 1).pow(k as u32) % (cells + 1)) as f64 + site[k]
            });
            if at.iter().all(|&x| x <= cells as f64) {
                points.push(std::array::from_fn(|k| at[k] * side[k]));
            }
        }
    }
    points
}

const HALF: f64 = 0.5;

pub(super) fn square(cells: usize) -> Vec<Point<2>> {
    crystal(&[[0.0, 0.0]], [1.0; 2], cells)
}

pub(super) fn hexagonal(cells: usize) -> Vec<Point<2>> {
    crystal(&[[0.0, 0.0], [HALF, HALF]], [1.0, 3.0_f64.sqrt()], cells)
}

pub(super) fn cubic(cells: usize) -> Vec<Point<3>> {
    crystal(&[[0.0; 3]], [1.0; 3], cells)
}

pub(super) fn body_centered(cells: usize) -> Vec<Point<3>> {
    crystal(&[[0.0; 3], [HALF; 3]], [1.0; 3], cells)
}

pub(super) fn face_centered(cells: usize) -> Vec<Point<3>> {
    let sites = [[0.0; 3], [HALF, HALF, 0.0], [HALF, 0.0, HALF], [0.0, HALF, HALF]];
    crystal(&sites, [1.0; 3], cells)
}

pub(super) fn scaled<const D: usize>(points: &[Point<D>], factor: f64) -> Vec<Point<D>> {
    points.iter().map(|p| p.map(|x| x * factor)).collect()
}

/// Each point moved by up to half the amount along each axis.
pub(super) fn jittered<const D: usize>(points: &[Point<D>], amount: f64) -> Vec<Point<D>> {
    let shifts = scatter::<D>(points.len(), 3);
    let moved = |(p, shift): (&Point<D>, &Point<D>)| {
        std::array::from_fn(|k| p[k] + amount * (shift[k] - 0.5))
    };
    points.iter().zip(&shifts).map(moved).collect()
}

/// Connects and checks all promises; the hull is checked against `volume`, if known.
fn connect_soundly<const D: usize>(
    delaunay: Delaunay<D>,
    points: &[Point<D>],
    volume: Option<f64>,
) -> Mesh<D> {
    let mesh = delaunay.connect(points, &mut Silent).unwrap();
    assert_eq!(mesh.points(), points);
    mesh.validate().unwrap();
    mesh.check_delaunay().unwrap();
    check_hull(&mesh);
    if let Some(volume) = volume {
        // Sums of positive terms, each rounded a few times, added with compensation.
        assert!((mesh.measure() - volume).abs() <= 1e-12 * volume, "{}", mesh.measure());
    }
    mesh
}

/// The cells fill a convex region that holds all points: no point lies beyond a hull facet.
fn check_hull<const D: usize>(mesh: &Mesh<D>) {
    let hull: Vec<_> = mesh.facets().into_iter().filter(|f| f.neighbour.is_none()).collect();
    let stride = 1 + hull.len() * mesh.points().len() / 200_000;
    for facet in &hull {
        let cell = mesh.cells().nth(facet.cell as usize).unwrap();
        let apex = cell.iter().position(|corner| !facet.corners.contains(corner)).unwrap();
        for point in mesh.points().iter().step_by(stride) {
            let mut moved = mesh.simplex(cell);
            match apex {
                0 => moved.first = *point,
                _ => moved.others[apex - 1] = *point,
            }
            assert!(moved.orientation() >= 0.0, "{point:?} is beyond the hull facet {facet:?}");
        }
    }
}

#[test]
fn plane_crystals_connect_soundly_at_every_scale() {
    for points in [square(20), hexagonal(12)] {
        for scale in [1.0, 0.1, 1e9, 1e-9] {
            connect_soundly(Delaunay::<2>::new(), &scaled(&points, scale), None);
        }
    }
    connect_soundly(Delaunay::<2>::new(), &square(20), Some(400.0));
    connect_soundly(Delaunay::<2>::new(), &hexagonal(12), Some(144.0 * 3.0_f64.sqrt()));
}

#[test]
fn solid_crystals_connect_soundly_at_every_scale() {
    for (points, cells) in [(cubic(7), 7), (body_centered(5), 5), (face_centered(4), 4)] {
        let volume = f64::from(cells).powi(3);
        for scale in [1.0, 1e9, 1e-9] {
            let side: f64 = f64::from(cells) * scale;
            let mesh = connect_soundly(
                Delaunay::<3>::new(),
                &scaled(&points, scale),
                (scale == 1.0).then_some(volume),
            );
            assert!((mesh.measure() / side.powi(3) - 1.0).abs() < 1e-12);
        }
        // Rounded coordinates still lie in the box's faces, so the hull is the box.
        let side: f64 = f64::from(cells) * 0.1;
        connect_soundly(Delaunay::<3>::new(), &scaled(&points, 0.1), Some(side.powi(3)));
    }
}

#[test]
fn body_centered_crystal_has_twelve_tetrahedra_a_cell_inside() {
    // 12 a unit cell of which those across a face of the box are cut off: 4 a face of a cube pair,
    // 3 · 4 n² (n − 1) inside, and 2 for each of the 6 n² squares of the surface.
    let n = 5;
    let mesh = connect_soundly(Delaunay::<3>::new(), &body_centered(n), None);
    assert_eq!(mesh.cell_count(), 3 * 4 * n * n * (n - 1) + 2 * 6 * n * n);
}

#[test]
fn scattered_and_jittered_points_connect_soundly() {
    connect_soundly(Delaunay::<2>::new(), &scatter(2000, 1), None);
    connect_soundly(Delaunay::<3>::new(), &scatter(2000, 2), None);
    for amount in [0.1, 1e-3, 1e-9, 1e-15] {
        connect_soundly(Delaunay::<3>::new(), &jittered(&face_centered(4), amount), None);
    }
}

pub(super) fn on_the_unit_sphere(count: usize, seed: u64) -> Vec<Point<3>> {
    let normalized = |p: &Point<3>| {
        let v = p.map(|x| x - 0.5);
        let length = crate::geometry::dot(&v, &v).sqrt();
        v.map(|x| x / length)
    };
    scatter::<3>(count, seed).iter().map(normalized).collect()
}

#[test]
fn points_on_spheres_and_cubes_connect_soundly() {
    let directions = on_the_unit_sphere(600, 4);
    connect_soundly(Delaunay::<3>::new(), &directions, None);
    let with_centre: Vec<_> = directions.iter().copied().chain([[0.01, 0.02, 0.0]]).collect();
    connect_soundly(Delaunay::<3>::new(), &with_centre, None);
    let surface: Vec<Point<3>> =
        cubic(6).into_iter().filter(|p| p.iter().any(|&x| x == 0.0 || x == 6.0)).collect();
    connect_soundly(Delaunay::<3>::new(), &surface, Some(216.0));
    let inside = scatter::<3>(300, 5).into_iter().map(|p| p.map(|x| 0.5 + 5.0 * x));
    let both: Vec<_> = surface.into_iter().chain(inside).collect();
    connect_soundly(Delaunay::<3>::new(), &both, Some(216.0));
}

#[test]
fn a_rim_of_hundreds_of_vertices_closes() {
    // Even points on a ball first, its centre last: every cell is in its cavity.
    let mut points = on_the_unit_sphere(600, 9);
    points.push([0.01, 0.02, 0.0]);
    let order = (0..points.len() as u32).collect();
    let cells = insertion::connect_in_order(&points, order, &mut Silent).unwrap().unwrap();
    let mesh = Mesh::new(points, cells).unwrap();
    mesh.validate().unwrap();
    mesh.check_delaunay().unwrap();
    // By Euler's formula a surface of n vertices has 2n − 4 triangles, each a cell with the centre.
    assert_eq!(mesh.cell_count(), 2 * 600 - 4);
}

#[test]
fn extreme_powers_of_two_change_no_cell() {
    let points = face_centered(2);
    let expected = Delaunay::<3>::new().connect(&points, &mut Silent).unwrap();
    for exponent in [1020, 300, -300, -1000, -1072] {
        let factor = 2.0_f64.powi(exponent / 2);
        let scaled: Vec<Point<3>> = points.iter().map(|p| p.map(|x| x * factor * factor)).collect();
        let mesh = Delaunay::<3>::new().connect(&scaled, &mut Silent).unwrap();
        assert_eq!(mesh.corners(), expected.corners(), "2^{exponent}");
    }
}

#[test]
fn long_thin_and_graded_clouds_connect_soundly() {
    let cloud = scatter::<3>(1500, 10);
    let long: Vec<Point<3>> = cloud.iter().map(|p| [1e4 * p[0], p[1], 1e-3 * p[2]]).collect();
    connect_soundly(Delaunay::<3>::new(), &long, None);
    let graded: Vec<Point<3>> = cloud.iter().map(|p| p.map(|x| x.powi(8))).collect();
    connect_soundly(Delaunay::<3>::new(), &graded, None);
    let far: Vec<Point<3>> = face_centered(3).iter().map(|p| p.map(|x| x + 1e6)).collect();
    connect_soundly(Delaunay::<3>::new(), &far, Some(27.0));
}

/// Integer points at distance 15 from the origin, by x² + y² + z² = 225.
pub(super) fn cospherical_integers() -> Vec<Point<3>> {
    let mut points = Vec::new();
    for x in -15_i32..=15 {
        for y in -15_i32..=15 {
            for z in -15_i32..=15 {
                if x * x + y * y + z * z == 225 {
                    points.push([f64::from(x), f64::from(y), f64::from(z)]);
                }
            }
        }
    }
    points
}

#[test]
fn exactly_cospherical_points_connect_soundly() {
    let mut points = cospherical_integers();
    connect_soundly(Delaunay::<3>::new(), &points, None);
    points.push([0.0; 3]);
    connect_soundly(Delaunay::<3>::new(), &points, None);
    let flat: Vec<Point<2>> = points.iter().filter(|p| p[2] == 0.0).map(|p| [p[0], p[1]]).collect();
    connect_soundly(Delaunay::<2>::new(), &flat, None);
}

fn as_few_points_as_possible_make_one_cell<const D: usize>(delaunay: Delaunay<D>) {
    let points: Vec<Point<D>> = (0..=D)
        .map(|i| std::array::from_fn(|k| if k + 1 == i { 2.0 } else { 0.0 }))
        .rev()
        .collect();
    let mesh = connect_soundly(delaunay, &points, None);
    assert_eq!(mesh.cell_count(), 1);
    let few = delaunay.connect(&points[1..], &mut Silent).unwrap_err();
    assert_eq!(few, ConnectError::TooFew { count: D, least: D + 1 });
}

#[test]
fn as_few_points_as_possible_make_one_cell_in_2_d_and_3_d() {
    as_few_points_as_possible_make_one_cell(Delaunay::<2>::new());
    as_few_points_as_possible_make_one_cell(Delaunay::<3>::new());
}

fn refuses<const D: usize>(delaunay: Delaunay<D>) {
    let mut points = scatter::<D>(50, 6);
    let connect = |points: &[Point<D>]| delaunay.connect(points, &mut Silent).unwrap_err();

    points[7] = points[31];
    assert_eq!(connect(&points), ConnectError::Duplicate { first: 7, second: 31 });
    points[7] = [0.25; D];
    points[9][1] = f64::NAN;
    let found = connect(&points);
    assert!(matches!(found, ConnectError::Coordinate { point: 9, axis: 1, .. }), "{found}");
    points[9][1] = 1e-60;
    let found = connect(&points);
    assert!(matches!(found, ConnectError::TooSmall { point: 9, axis: 1, .. }), "{found}");

    let line: Vec<Point<D>> = (0..40).map(|i| [0.1 * f64::from(i); D]).collect();
    assert_eq!(connect(&line), ConnectError::Flat { count: 40, dimension: D });
    let along_x: Vec<Point<D>> =
        (0..40).map(|i| std::array::from_fn(|k| if k == 0 { f64::from(i) } else { 0.3 })).collect();
    assert_eq!(connect(&along_x), ConnectError::Flat { count: 40, dimension: D });
}

#[test]
fn bad_points_are_refused_by_name_in_2_d_and_3_d() {
    refuses(Delaunay::<2>::new());
    refuses(Delaunay::<3>::new());
    let plane: Vec<Point<3>> = scatter::<2>(60, 7).iter().map(|p| [p[0], p[1], 0.5]).collect();
    let found = Delaunay::<3>::new().connect(&plane, &mut Silent).unwrap_err();
    assert_eq!(found.to_string(), "all 60 points lie on one plane; they have no cells");
}

#[test]
fn signed_zeros_are_equal() {
    let points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-0.0, 1.0]];
    let found = Delaunay::<2>::new().connect(&points, &mut Silent).unwrap_err();
    assert_eq!(found, ConnectError::Duplicate { first: 2, second: 3 });
    let (unique, map) = merge_duplicates(&points);
    assert_eq!((unique.len(), map), (3, vec![0, 1, 2, 2]));
}

/// Breaks at the call of this number.
pub(super) struct Stop(pub usize);

impl Watch for Stop {
    fn step(&mut self, phase: Phase, done: f64, _: Option<f64>) -> ControlFlow<()> {
        assert_eq!(phase, Phase::Connect);
        assert!((0.0..=1.0).contains(&done));
        self.0 -= 1;
        if self.0 == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

fn a_watch_ends_the_work<const D: usize>(delaunay: Delaunay<D>) {
    let points = scatter::<D>(6000, 8);
    for steps in 1..=4 {
        let found = delaunay.connect(&points, &mut Stop(steps)).unwrap_err();
        assert_eq!(found, ConnectError::Cancelled(Cancelled));
    }
    assert!(delaunay.connect(&points, &mut Stop(5)).is_ok());
}

#[test]
fn a_watch_ends_the_work_in_2_d_and_3_d() {
    a_watch_ends_the_work(Delaunay::<2>::new());
    a_watch_ends_the_work(Delaunay::<3>::new());
}

/// Calls `visit` with all ways to take `D + 1` of `count`.
fn each_subset<const D: usize>(count: u32, mut visit: impl FnMut(&[u32])) {
    let mut chosen: Vec<u32> = (0..=D as u32).collect();
    loop {
        visit(&chosen);
        let last = D as u32;
        let Some(k) = (0..=D).rev().find(|&k| chosen[k] < count - 1 - (last - k as u32)) else {
            return;
        };
        chosen[k] += 1;
        for j in k + 1..=D {
            chosen[j] = chosen[j - 1] + 1;
        }
    }
}

/// The cells by definition: all simplices whose circumsphere holds no point.
fn cells_by_definition<const D: usize>(points: &[Point<D>]) -> Vec<u32> {
    let mesh = Mesh::new(points.to_vec(), Vec::new()).unwrap();
    let mut corners = Vec::new();
    each_subset::<D>(points.len() as u32, |chosen| {
        let mut cell = chosen.to_vec();
        if mesh.simplex(&cell).orientation() < 0.0 {
            cell.swap(D - 1, D);
        }
        let simplex = mesh.simplex(&cell);
        let empty = points.iter().all(|p| simplex.in_sphere(p) <= 0.0);
        if empty {
            corners.extend(cell);
        }
    });
    corners
}

fn cells_equal_their_definition<const D: usize>(delaunay: Delaunay<D>, count: usize) {
    for seed in 0..8 {
        let points = scatter::<D>(count, seed);
        let mesh = connect_soundly(delaunay, &points, None);
        let slow = Mesh::new(points.clone(), cells_by_definition(&points)).unwrap();
        slow.validate().unwrap();
        assert_eq!(cells_as_points(&mesh), cells_as_points(&slow), "seed {seed}");
    }
}

#[test]
fn cells_are_all_simplices_with_an_empty_circumsphere() {
    cells_equal_their_definition(Delaunay::<2>::new(), 25);
    cells_equal_their_definition(Delaunay::<3>::new(), 16);
}

/// The cells as coordinates, for comparison under another numbering.
fn cells_as_points<const D: usize>(mesh: &Mesh<D>) -> Vec<Vec<Point<D>>> {
    let mut cells: Vec<Vec<Point<D>>> = mesh
        .cells()
        .map(|cell| {
            let mut points: Vec<Point<D>> =
                cell.iter().map(|&c| mesh.points()[c as usize]).collect();
            points.sort_by(crate::geometry::lexicographic);
            points
        })
        .collect();
    cells.sort_by(|a, b| a.partial_cmp(b).unwrap());
    cells
}

pub(super) fn shuffle<T>(items: &mut [T], seed: u64) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    for k in (1..items.len()).rev() {
        items.swap(k, random.random_range(0..=k));
    }
}

fn order_of_points_does_not_matter<const D: usize>(delaunay: Delaunay<D>, points: &[Point<D>]) {
    let expected = cells_as_points(&delaunay.connect(points, &mut Silent).unwrap());
    for seed in 0..3 {
        let mut shuffled = points.to_vec();
        shuffle(&mut shuffled, seed);
        let mesh = delaunay.connect(&shuffled, &mut Silent).unwrap();
        assert_eq!(cells_as_points(&mesh), expected);
    }
}

#[test]
fn cells_do_not_depend_on_the_order_of_the_points() {
    order_of_points_does_not_matter(Delaunay::<2>::new(), &square(9));
    order_of_points_does_not_matter(Delaunay::<3>::new(), &cubic(4));
    order_of_points_does_not_matter(Delaunay::<3>::new(), &face_centered(2));
}

/// Below [`Delaunay::connect`], which sorts: here the insertion itself is shuffled.
fn order_of_insertion_does_not_matter<const D: usize, const N: usize>(points: &[Point<D>])
where
    insertion::Simplices: insertion::Dimension<D, N>,
{
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let cells = |order: &[u32]| {
        insertion::connect_in_order(points, order.to_vec(), &mut Silent).unwrap().unwrap()
    };
    let expected = cells(&order);
    for seed in 0..5 {
        shuffle(&mut order, seed);
        assert_eq!(cells(&order), expected, "seed {seed}");
    }
}

#[test]
fn perturbation_makes_cells_independent_of_the_order_of_insertion() {
    order_of_insertion_does_not_matter(&square(9));
    order_of_insertion_does_not_matter(&hexagonal(5));
    let circle = cospherical_integers().into_iter().filter(|p| p[2] == 0.0);
    order_of_insertion_does_not_matter(&circle.map(|p| [p[0], p[1]]).collect::<Vec<_>>());
    for points in [cubic(4), face_centered(3), body_centered(3)] {
        order_of_insertion_does_not_matter(&points);
    }
}

/// Cells by the crate `spade`.
fn cells_by_spade(points: &[Point<2>]) -> Mesh<2> {
    use spade::{DelaunayTriangulation, Point2, Triangulation};
    let vertices = points.iter().map(|&[x, y]| Point2::new(x, y)).collect();
    let triangulation = DelaunayTriangulation::<_>::bulk_load_stable(vertices).unwrap();
    let faces = triangulation.inner_faces();
    let corners = faces.flat_map(|face| face.vertices().map(|v| v.fix().index() as u32)).collect();
    Mesh::new(points.to_vec(), corners).unwrap()
}

#[test]
fn cells_in_the_plane_are_those_of_another_program() {
    let cloud = scatter::<2>(20_000, 30);
    let graded = cloud.iter().map(|p| p.map(|x| x.powi(6))).collect();
    // no four points are on one circle but by rounding: the triangulation is unique
    for points in [cloud, graded, jittered(&square(100), 0.1), jittered(&hexagonal(60), 1e-6)] {
        let mesh = Delaunay::<2>::new().connect(&points, &mut Silent).unwrap();
        assert_eq!(cells_as_points(&mesh), cells_as_points(&cells_by_spade(&points)));
    }
}

pub(super) fn small_integers<const D: usize>() -> impl Strategy<Value = Vec<Point<D>>> {
    let point =
        prop::collection::vec(0_u8..4, D).prop_map(|p| std::array::from_fn(|k| f64::from(p[k])));
    prop::collection::vec(point, 0..40).prop_map(|points| merge_duplicates(&points).0)
}

fn connects_or_says_why<const D: usize>(delaunay: Delaunay<D>, points: &[Point<D>]) {
    match delaunay.connect(points, &mut Silent) {
        Ok(mesh) => {
            mesh.validate().unwrap();
            mesh.check_delaunay().unwrap();
            check_hull(&mesh);
        }
        Err(ConnectError::TooFew { .. }) => assert!(points.len() <= D),
        Err(ConnectError::Flat { .. }) => {
            let mesh = Mesh::new(points.to_vec(), Vec::new()).unwrap();
            each_subset::<D>(points.len() as u32, |cell| {
                assert_eq!(mesh.simplex(cell).orientation(), 0.0);
            });
        }
        Err(other) => panic!("{other}"),
    }
}

proptest! {
    #[test]
    fn small_integers_connect_or_are_flat_in_2_d(points in small_integers::<2>()) {
        connects_or_says_why(Delaunay::<2>::new(), &points);
    }

    #[test]
    fn small_integers_connect_or_are_flat_in_3_d(points in small_integers::<3>()) {
        connects_or_says_why(Delaunay::<3>::new(), &points);
    }
}
