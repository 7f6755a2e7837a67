//! Parts connected in parallel give the cells of one insertion of all points.

use super::*;
use crate::geometry::Point;
use crate::mesh::delaunay::tests::*;
use crate::mesh::{Delaunay, merge_duplicates};
use crate::watch::Silent;
use proptest::prelude::*;

fn assert_parts_change_nothing<const D: usize, const N: usize>(points: &[Point<D>], what: &str)
where
    Simplices: Dimension<D, N>,
{
    let prepared = Prepared::new(points).unwrap();
    let connected = |parts| connect_in_parts(&prepared, parts, &mut Silent).unwrap();
    let expected = connected(1);
    for parts in [2, 3, 4, 7] {
        assert_eq!(connected(parts), expected, "{what} in {parts} parts");
    }
}

/// The cavity and the facets around it, in no order.
fn found<const D: usize, const N: usize>(triangulation: &Triangulation<D, N>) -> [Vec<u32>; 2] {
    let mut found = [triangulation.cavity.clone(), triangulation.boundary.clone()];
    found.iter_mut().for_each(|list| list.sort_unstable());
    found
}

fn digging_finds_what_a_plain_search_finds<const D: usize, const N: usize>(sets: [Vec<Point<D>>; 3])
where
    Simplices: Dimension<D, N>,
{
    for points in sets {
        let points = scaled(&points, 1.0 / 8.0);
        let ranks: Vec<u32> = (0..points.len() as u32).collect();
        let mut order = ranks.clone();
        shuffle(&mut order, 1);
        let (first, last) = order.split_at(points.len() / 2);
        let first = Part::new(&points, &ranks, first.to_vec(), Predicates::of(&points));
        let mut part = first.unwrap();
        part.insert(points.len());
        let triangulation = &mut part.triangulation;
        for vertex in last.iter().map(|rank| rank + 1) {
            let p = triangulation.vertices[vertex as usize].at;
            let holder = triangulation.locate(&p);
            triangulation.spread([holder], |triangulation, cell| triangulation.conflicts(cell, &p));
            let expected = found(triangulation);
            triangulation.cells.marks.iter_mut().for_each(|mark| {
                *mark = if *mark == Mark::Free { Mark::Free } else { Mark::Unseen };
            });
            triangulation.dig(&p, holder);
            assert_eq!(found(triangulation), expected, "vertex {vertex}");
            triangulation.fill(vertex);
        }
    }
}

#[test]
fn digging_finds_what_a_plain_search_finds_in_2_d_and_3_d() {
    digging_finds_what_a_plain_search_finds([
        square(15),
        jittered(&square(15), 0.1),
        scatter::<2>(400, 20),
    ]);
    digging_finds_what_a_plain_search_finds([
        face_centered(4),
        jittered(&face_centered(4), 0.1),
        scatter::<3>(400, 20),
    ]);
}

fn crystal_connects_alike_in_parts<const D: usize, const N: usize>(
    points: Vec<Point<D>>,
    what: &str,
) where
    Simplices: Dimension<D, N>,
{
    for scale in [1.0, 0.1, 1e9, 1e-9] {
        let points = scaled(&points, scale);
        assert_parts_change_nothing(&points, &format!("{what} times {scale}"));
    }
    let turn = |p: &Point<D>| {
        let mut turned = *p;
        (turned[0], turned[1]) = (0.8 * p[0] - 0.6 * p[1], 0.6 * p[0] + 0.8 * p[1]);
        turned
    };
    let turned: Vec<Point<D>> = points.iter().map(turn).collect();
    assert_parts_change_nothing(&turned, &format!("{what}, turned"));
    for amount in [0.1, 1e-9, 1e-15] {
        let jittered = jittered(&points, amount);
        assert_parts_change_nothing(&jittered, &format!("{what}, jittered by {amount}"));
    }
}

#[test]
fn crystals_connect_alike_in_parts() {
    crystal_connects_alike_in_parts(square(20), "square");
    crystal_connects_alike_in_parts(hexagonal(12), "hexagonal");
    crystal_connects_alike_in_parts(cubic(7), "cubic");
    crystal_connects_alike_in_parts(body_centered(5), "body-centred");
    crystal_connects_alike_in_parts(face_centered(4), "face-centred");
}

fn clouds_connect_alike_in_parts<const D: usize, const N: usize>()
where
    Simplices: Dimension<D, N>,
{
    let cloud = scatter::<D>(3000, 21);
    assert_parts_change_nothing(&cloud, "scattered");
    let changed = |change: &dyn Fn(&Point<D>) -> Point<D>| cloud.iter().map(change).collect();
    let stretched = |p: &Point<D>| std::array::from_fn(|k| p[k] * [1e4, 1.0, 1e-3][k]);
    let long: Vec<_> = changed(&stretched);
    assert_parts_change_nothing(&long, "long");
    let graded: Vec<_> = changed(&|p| p.map(|x| x.powi(8)));
    assert_parts_change_nothing(&graded, "graded");
    let clusters: Vec<_> = changed(&|p| p.map(|x| (4.0 * x).floor() + 1e-3 * x));
    assert_parts_change_nothing(&clusters, "clustered");
    let layer = |p: &Point<D>| {
        let mut layer = *p;
        layer[D - 1] = (3.0 * layer[D - 1]).floor();
        layer
    };
    let plates: Vec<_> = changed(&layer);
    assert_parts_change_nothing(&plates, "on three planes");
    let coarse: Vec<_> = changed(&|p| p.map(|x| (20.0 * x).floor()));
    assert_parts_change_nothing(&merge_duplicates(&coarse).0, "small integers");
}

#[test]
fn clouds_connect_alike_in_parts_in_2_d_and_3_d() {
    clouds_connect_alike_in_parts::<2, 3>();
    clouds_connect_alike_in_parts::<3, 4>();
}

#[test]
fn surfaces_connect_alike_in_parts() {
    // Every circumsphere of an even ball holds points of all parts but for ties: all is seam.
    let disc = scatter::<1>(800, 22).into_iter().map(|[x]| (6.3 * x).sin_cos());
    assert_parts_change_nothing(&disc.map(<[f64; 2]>::from).collect::<Vec<_>>(), "a disc");
    assert_parts_change_nothing(&on_the_unit_sphere(800, 22), "a ball");
    assert_parts_change_nothing(&cospherical_integers(), "exactly cospherical");
    let hull: Vec<_> =
        cubic(8).into_iter().filter(|p| p.iter().any(|&x| x == 0.0 || x == 8.0)).collect();
    assert_parts_change_nothing(&hull, "a cube's surface");
    let inside = scatter::<3>(300, 23).into_iter().map(|p| p.map(|x| 1.0 + 6.0 * x));
    assert_parts_change_nothing(&hull.into_iter().chain(inside).collect::<Vec<_>>(), "a shell");
}

#[test]
fn parts_on_one_plane_are_connected_whole() {
    // A plane divides these into flat parts, and then into nothing.
    let square: Vec<Point<3>> = scatter::<2>(60, 24).iter().map(|p| [0.0, p[0], p[1]]).collect();
    let mut two = square.clone();
    two.extend(square.iter().map(|p| [2.0, p[2], p[1]]));
    assert_parts_change_nothing(&two, "two squares");
    let mut pyramid = square.clone();
    pyramid.push([5.0, 0.5, 0.5]);
    assert_parts_change_nothing(&pyramid, "a pyramid");
    assert_parts_change_nothing(&cubic(1), "a cube");
    let prepared = Prepared::new(&square).unwrap();
    assert_eq!(connect_in_parts(&prepared, 2, &mut Silent), Ok(None));
    // a line divides these into points on one line each
    let two: Vec<Point<2>> = (0..60).map(|k| [f64::from(k % 2), 0.01 * f64::from(k)]).collect();
    assert_parts_change_nothing(&two, "two lines");
}

fn connects_alike_in_parts<const D: usize, const N: usize>(points: &[Point<D>], parts: usize)
where
    Simplices: Dimension<D, N>,
{
    if let Ok(prepared) = Prepared::new(points) {
        let connected = |parts| connect_in_parts(&prepared, parts, &mut Silent);
        assert_eq!(connected(parts), connected(1));
    }
}

proptest! {
    #[test]
    fn small_integers_in_the_plane_connect_alike_in_parts(
        points in small_integers::<2>(), parts in 2_usize..6
    ) {
        connects_alike_in_parts(&points, parts);
    }

    #[test]
    fn small_integers_in_space_connect_alike_in_parts(
        points in small_integers::<3>(), parts in 2_usize..6
    ) {
        connects_alike_in_parts(&points, parts);
    }
}

fn cells_are_the_same_at_any_thread_count<const D: usize>(
    delaunay: Delaunay<D>,
    sets: &[Vec<Point<D>>],
) {
    for points in sets {
        let connected = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| delaunay.connect(points, &mut Silent)).unwrap()
        };
        let expected = connected(1);
        expected.validate().unwrap();
        expected.check_delaunay().unwrap();
        for threads in [2, 3, 4] {
            assert_eq!(connected(threads), expected, "{threads} threads");
        }
    }
}

#[test]
fn cells_are_the_same_at_any_thread_count_in_2_d_and_3_d() {
    // Enough points for a part to each of four threads.
    let many = 5 * LEAST_PART;
    let side = (many as f64).sqrt() as usize;
    let sets = [scatter::<2>(many, 25), square(side), jittered(&square(side), 0.1)];
    cells_are_the_same_at_any_thread_count(Delaunay::<2>::new(), &sets);
    let side = (many as f64 / 4.0).cbrt() as usize;
    let sets = [scatter::<3>(many, 25), face_centered(side), jittered(&face_centered(side), 0.1)];
    cells_are_the_same_at_any_thread_count(Delaunay::<3>::new(), &sets);
}

#[test]
fn a_watch_ends_parts_at_any_step() {
    let prepared = Prepared::<3>::new(&scatter(12_000, 26)).unwrap();
    // One step while the parts grow, one as they are joined.
    for steps in 1..=2 {
        let found = connect_in_parts(&prepared, 3, &mut Stop(steps));
        assert_eq!(found, Err(Cancelled), "{steps}");
    }
    assert!(connect_in_parts(&prepared, 3, &mut Stop(3)).is_ok());
}
