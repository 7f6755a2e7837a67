//! Lattices: crystals inside, the box outside, nothing too near, nothing missing.

use std::ops::ControlFlow;

use super::*;
use crate::fields::NominalDistance;
use crate::geometry::{difference, distance_squared, dot};
use crate::image::Grid;
use crate::mesh::{Delaunay, Mesh, merge_duplicates};
use crate::watch::{Phase, Silent, Watch};

fn grid<const D: usize>(shape: [usize; D]) -> Grid<D> {
    Grid { shape, step: [1.0; D] }
}

fn constant<const D: usize>(grid: &Grid<D>, d: f64) -> NominalDistance<D> {
    NominalDistance::constant(grid, d).unwrap()
}

/// d as a function of the place, its slope limited to 0.25.
fn graded<const D: usize>(grid: &Grid<D>, d: impl Fn(&Point<D>) -> f64) -> NominalDistance<D> {
    let field: Vec<f32> = (0..grid.sample_count()).map(|i| d(&grid.position(i)) as f32).collect();
    NominalDistance::from_field(grid, &field, 0.25).unwrap()
}

fn grown<const D: usize>(
    crystal: &Crystal<D>,
    grid: &Grid<D>,
    distance: &NominalDistance<D>,
) -> Lattice<D> {
    grow(crystal, grid.bounds(), distance, &GrowOptions::default(), &mut Silent).unwrap()
}

fn scattered<const D: usize>(
    scatterer: &Scatterer<D>,
    grid: &Grid<D>,
    distance: &NominalDistance<D>,
    seed: u64,
) -> Lattice<D> {
    let options = ScatterOptions { seed, ..Default::default() };
    scatter(scatterer, grid.bounds(), distance, &options, &mut Silent).unwrap()
}

/// What every lattice promises, however it was made: atoms in the box, its corners among them, each
/// free along the axes on whose sides of the box it does not lie, none at another's place; and a
/// Delaunay mesh that fills the box.
fn assert_sound<const D: usize>(
    lattice: &Lattice<D>,
    delaunay: &Delaunay<D>,
    frozen: &[Point<D>],
    what: &str,
) -> Mesh<D> {
    let bounds = lattice.bounds();
    for (i, p) in lattice.atoms().iter().enumerate() {
        assert!(bounds.contains(p), "{what}: atom {i} at {p:?} is outside");
        let held = frozen.contains(p);
        for k in 0..D {
            let free = p[k] != bounds.min[k] && p[k] != bounds.max[k] && !held;
            assert_eq!(lattice.mobility(i, k), f64::from(u8::from(free)), "{what}: {p:?} axis {k}");
        }
    }
    for corner in bounds.corners() {
        let count = lattice.atoms().iter().filter(|p| **p == corner).count();
        assert_eq!(count, 1, "{what}: atoms in corner {corner:?}");
    }
    let mesh = delaunay.connect(lattice.atoms(), &mut Silent).unwrap();
    assert_eq!(mesh.validate(), Ok(()), "{what}");
    assert_eq!(mesh.points().len(), lattice.len(), "{what}: an atom is no point of the mesh");
    // the sum of n rounded volumes, compensated: roundings of the terms only
    assert!((mesh.measure() / bounds.measure() - 1.0).abs() < 1e-12, "{what}");
    mesh
}

/// Pairs of atoms nearer than `reach`, by the double loop.
fn near_pairs<const D: usize>(
    lattice: &Lattice<D>,
    reach: f64,
) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
    let atoms = lattice.atoms();
    (0..atoms.len()).flat_map(move |i| {
        (i + 1..atoms.len()).filter_map(move |j| {
            let squared = distance_squared(&atoms[i], &atoms[j]);
            (squared < reach * reach).then(|| (i, j, squared.sqrt()))
        })
    })
}

fn sides<const D: usize>(lattice: &Lattice<D>, i: usize) -> usize {
    let (p, bounds) = (&lattice.atoms()[i], lattice.bounds());
    bounds.held(p).count_ones() as usize
}

/// No two atoms nearer than γ times the mean of their d; atoms on edges of the box may be nearer to
/// the fixed ones, since edges are divided evenly and d may not go into them.
fn assert_apart<const D: usize>(lattice: &Lattice<D>, distance: &NominalDistance<D>, what: &str) {
    for (i, j, apart) in near_pairs(lattice, 0.8 * distance.greatest()) {
        let (p, q) = (&lattice.atoms()[i], &lattice.atoms()[j]);
        let least = 0.4 * (distance.at(p) + distance.at(q));
        let on_edges = sides(lattice, i) + 1 >= D && sides(lattice, j) + 1 >= D;
        // two pieces where d goes 1.5 times make 0.75 d each; a box thinner than d is as it is
        let least = if on_edges { least * 0.75 / 0.8 } else { least };
        assert!(
            apart >= least * (1.0 - 1e-4),
            "{what}: {p:?} and {q:?} are {apart}, least {least}"
        );
    }
}

fn the_inside_is_a_perfect_crystal<const D: usize>(
    crystal: &Crystal<D>,
    box_size: usize,
    delaunay: &Delaunay<D>,
) {
    let d = 3.0;
    let grid = grid([box_size; D]);
    let distance = constant(&grid, d);
    let lattice = grown(crystal, &grid, &distance);
    let what = format!("{:?}", crystal.kind());
    assert_sound(&lattice, delaunay, &[], &what);
    assert_apart(&lattice, &distance, &what);
    let bounds = lattice.bounds();
    let mut inside = 0;
    for p in lattice.atoms() {
        // neighbours are within d, and sites nearer than γ d to a side may be taken by the side's atoms
        if (0..D).any(|k| p[k] - bounds.min[k] < 1.9 * d || bounds.max[k] - p[k] < 1.9 * d) {
            continue;
        }
        inside += 1;
        for v in crystal.neighbors() {
            let site: Point<D> = std::array::from_fn(|k| p[k] + d * v[k]);
            // coordinates are multiples of 2⁻¹⁵, all from one seed: half of one rounding
            let taken = lattice
                .atoms()
                .iter()
                .any(|q| distance_squared(q, &site) < 2e-5f64.powi(2) * D as f64);
            assert!(taken, "{what}: {p:?} lacks its neighbour at {site:?}");
        }
    }
    let expected = crystal.density() * ((box_size as f64 - 1.0 - 3.8 * d) / d).powi(D as i32);
    // the count of lattice points in a region errs by about its surface over its volume
    assert!((inside as f64 / expected - 1.0).abs() < 0.3, "{what}: {inside}, expected {expected}");
}

#[test]
fn a_constant_distance_gives_a_perfect_crystal_inside() {
    the_inside_is_a_perfect_crystal(&Crystal::hexagonal(), 60, &Delaunay::<2>::new());
    the_inside_is_a_perfect_crystal(&Crystal::body_centered_cubic(), 31, &Delaunay::<3>::new());
    the_inside_is_a_perfect_crystal(&Crystal::face_centered_cubic(), 31, &Delaunay::<3>::new());
}

/// The farthest that a place of the box is from its nearest atom, over d there, by trying many.
fn emptiest<const D: usize>(
    lattice: &Lattice<D>,
    distance: &NominalDistance<D>,
    tries: usize,
) -> (f64, Point<D>) {
    let bounds = lattice.bounds();
    let extent = bounds.extent();
    // a low-discrepancy sequence: multiples of powers of the inverse of the plastic number
    let mut worst = (0.0, bounds.min);
    for t in 1..=tries {
        let p: Point<D> = std::array::from_fn(|k| {
            let step =
                [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3][k];
            bounds.min[k] + extent[k] * (0.5 + t as f64 * step).fract()
        });
        let nearest =
            lattice.atoms().iter().map(|q| distance_squared(q, &p)).fold(f64::INFINITY, f64::min);
        let ratio = nearest.sqrt() / distance.at(&p);
        if ratio > worst.0 {
            worst = (ratio, p);
        }
    }
    worst
}

/// The deepest hole of BCC is 0.65 d, of FCC 0.71 d; beside the box's sides, whose atoms do not fit
/// the crystal's, there is room for one that is not quite free: 1.1 d is more than any of them.
const EMPTIEST: f64 = 1.1;

/// A name, an image's shape, and d(x).
type Case<'a, const D: usize> = (&'a str, [usize; D], &'a dyn Fn(&Point<D>) -> f64);

fn every_place_has_an_atom_near<const D: usize>(
    crystal: &Crystal<D>,
    delaunay: &Delaunay<D>,
    cases: &[Case<'_, D>],
) {
    for (name, shape, d) in cases {
        let grid = grid(*shape);
        let distance = graded(&grid, d);
        let lattice = grown(crystal, &grid, &distance);
        assert_sound(&lattice, delaunay, &[], name);
        let (ratio, place) = emptiest(&lattice, &distance, 4000);
        assert!(ratio < EMPTIEST, "{name}: the nearest atom of {place:?} is {ratio} d away");
    }
}

#[test]
fn growth_reaches_every_part_of_the_box() {
    let cases: [Case<'_, 2>; 5] = [
        ("constant", [80, 60], &|_| 4.0),
        ("fine to the left", [80, 60], &|p| 2.0 + 0.1 * p[0]),
        ("fine in the middle", [80, 60], &|p| 2.0 + 0.2 * (p[0] - 40.0).abs()),
        // the middle has no room for an atom, the ends have room for many
        ("a strip, fine at its ends", [161, 13], &|p| 2.0 + 0.2 * (80.0 - (p[0] - 80.0).abs())),
        ("a strip, fine in three places", [241, 13], &|p| {
            let near = [0.0, 120.0, 240.0].map(|x: f64| (p[0] - x).abs());
            2.0 + 0.2 * near.into_iter().fold(f64::INFINITY, f64::min)
        }),
    ];
    every_place_has_an_atom_near(&Crystal::hexagonal(), &Delaunay::<2>::new(), &cases);
    let cases: [Case<'_, 3>; 6] = [
        ("constant", [24, 20, 22], &|_| 4.0),
        ("a slab as thick as d", [40, 40, 5], &|_| 4.0),
        ("a slab thinner than d", [40, 40, 4], &|_| 5.0),
        ("a slab of 1.5 d", [40, 40, 7], &|_| 4.0),
        ("fine to the left", [40, 20, 20], &|p| 2.0 + 0.1 * p[0]),
        ("a bar, fine at its ends", [121, 9, 9], &|p| 2.0 + 0.2 * (60.0 - (p[0] - 60.0).abs())),
    ];
    for crystal in [Crystal::body_centered_cubic(), Crystal::face_centered_cubic()] {
        every_place_has_an_atom_near(&crystal, &Delaunay::<3>::new(), &cases);
    }
}

#[test]
fn both_sides_of_a_slab_get_the_same_atoms() {
    for thickness in [3, 4, 6] {
        let grid = grid([40, 40, thickness]);
        let lattice = grown(&Crystal::body_centered_cubic(), &grid, &constant(&grid, 5.0));
        let on = |z: f64| {
            let mut found: Vec<[u64; 2]> = (lattice.atoms().iter().filter(|p| p[2] == z))
                .map(|p| [p[0].to_bits(), p[1].to_bits()])
                .collect();
            found.sort_unstable();
            found
        };
        let (low, high) = (on(0.0), on(thickness as f64 - 1.0));
        assert!(low.len() > 50, "{thickness}: {}", low.len()); // 39² · 1.15 / 25 = 70
        assert_eq!(low, high, "{thickness}");
    }
}

fn grading_is_followed<const D: usize>(crystal: &Crystal<D>, shape: [usize; D]) {
    let grid = grid(shape);
    let distance = graded(&grid, |p| 2.0 + 0.12 * p[0]);
    let lattice = grown(crystal, &grid, &distance);
    assert_apart(&lattice, &distance, "graded");
    let (mut inside, mut sum) = (0, 0.0);
    for i in (0..lattice.len()).filter(|&i| sides(&lattice, i) == 0) {
        let p = &lattice.atoms()[i];
        let nearest = (lattice.atoms().iter().enumerate())
            .filter(|(j, _)| *j != i)
            .map(|(_, q)| distance_squared(p, q))
            .fold(f64::INFINITY, f64::min);
        let ratio = nearest.sqrt() / distance.at(p);
        // γ to either side, d being the mean of two that differ by a slope of 0.12; an atom has some
        // neighbour at less than the 1.4 d to a second shell
        assert!((0.75..1.4).contains(&ratio), "{p:?}: {ratio}");
        (inside, sum) = (inside + 1, sum + ratio);
    }
    // most neighbours are ideal sites of one of the two
    let mean = sum / f64::from(inside);
    assert!((0.82..1.05).contains(&mean), "{mean}");
}

#[test]
fn atoms_follow_a_varying_distance() {
    grading_is_followed(&Crystal::hexagonal(), [81, 41]);
    grading_is_followed(&Crystal::body_centered_cubic(), [41, 17, 17]);
    grading_is_followed(&Crystal::face_centered_cubic(), [41, 17, 17]);
}

#[test]
fn seed_points_stay_and_are_grown_around() {
    let grid = grid([50, 40, 30]);
    let distance = constant(&grid, 5.0);
    // inside, on a face (its centre), on an edge, in a corner, twice the same
    let seeds = vec![
        [20.3, 11.7, 9.1],
        [24.5, 19.5, 0.0],
        [0.0, 13.0, 29.0],
        [49.0, 39.0, 29.0],
        [20.3, 11.7, 9.1],
    ];
    for scatter_it in [false, true] {
        let lattice = if scatter_it {
            let options = ScatterOptions { seed: 1, seed_points: seeds.clone() };
            scatter(&Scatterer::<3>::new(), grid.bounds(), &distance, &options, &mut Silent)
        } else {
            let options = GrowOptions { seed_points: seeds.clone(), ..Default::default() };
            grow(&Crystal::body_centered_cubic(), grid.bounds(), &distance, &options, &mut Silent)
        }
        .unwrap();
        let what = format!("scattered: {scatter_it}");
        assert_sound(&lattice, &Delaunay::<3>::new(), &seeds, &what);
        for seed in &seeds {
            assert!(lattice.atoms().contains(seed), "{what}: {seed:?}");
        }
        let (ratio, place) = emptiest(&lattice, &distance, 4000);
        assert!(ratio < EMPTIEST, "{what}: the nearest atom of {place:?} is {ratio} d away");
    }
    // the crystal has its origin at the first seed
    let options = GrowOptions { seed_points: seeds[..1].to_vec(), ..Default::default() };
    let crystal = Crystal::body_centered_cubic();
    let lattice = grow(&crystal, grid.bounds(), &distance, &options, &mut Silent).unwrap();
    for v in crystal.neighbors() {
        let site: Point<3> = std::array::from_fn(|k| seeds[0][k] + 5.0 * v[k]);
        // steps are snapped to 2⁻¹⁴
        assert!(
            lattice.atoms().iter().any(|q| distance_squared(q, &site).sqrt() < 1e-4),
            "{site:?}"
        );
    }
}

#[test]
fn a_seed_below_a_face_does_not_keep_the_face_empty() {
    let grid = grid([41, 41, 41]);
    let distance = constant(&grid, 6.0);
    let options = GrowOptions { seed_points: vec![[20.0, 20.0, 3.0]], ..Default::default() };
    let crystal = Crystal::body_centered_cubic();
    let lattice = grow(&crystal, grid.bounds(), &distance, &options, &mut Silent).unwrap();
    let on_face = lattice.atoms().iter().filter(|p| p[2] == 0.0).count();
    assert!(on_face > 40, "{on_face}"); // 40² · 1.15 / 36 = 51
    let (ratio, place) = emptiest(&lattice, &distance, 4000);
    assert!(ratio < EMPTIEST, "the nearest atom of {place:?} is {ratio} d away");
}

#[test]
fn seeds_outside_and_odd_factors_are_refused() {
    let grid = grid([20, 20]);
    let distance = constant(&grid, 4.0);
    let crystal = Crystal::hexagonal();
    let seed_points = vec![[3.0, 3.0], [3.0, 19.5]];
    let options = GrowOptions { seed_points: seed_points.clone(), ..Default::default() };
    let error = grow(&crystal, grid.bounds(), &distance, &options, &mut Silent).unwrap_err();
    assert!(matches!(error, LatticeError::SeedOutside { index: 1, .. }), "{error}");
    assert!(error.to_string().contains("[3.0, 19.5]"), "{error}");
    let options = ScatterOptions { seed: 0, seed_points };
    let error = scatter(&Scatterer::<2>::new(), grid.bounds(), &distance, &options, &mut Silent);
    assert!(matches!(error.unwrap_err(), LatticeError::SeedOutside { index: 1, .. }));
    let twice = vec![[3.0, 3.0], [9.0, 3.0], [3.0, 3.0], [9.0 + 1e-7, 3.0]];
    let options = GrowOptions { seed_points: twice, ..Default::default() };
    let error = grow(&crystal, grid.bounds(), &distance, &options, &mut Silent).unwrap_err();
    assert!(matches!(error, LatticeError::SeedsNear { first: 1, second: 3, .. }), "{error}");
    let options = GrowOptions { seed_points: vec![[f64::NAN, 1.0]], ..Default::default() };
    let error = grow(&crystal, grid.bounds(), &distance, &options, &mut Silent).unwrap_err();
    assert!(matches!(error, LatticeError::SeedOutside { index: 0, .. }), "{error}");
    for value in [0.0, 0.05, 1.01, f64::NAN] {
        let options = GrowOptions { spacing_factor: value, ..Default::default() };
        let error = grow(&crystal, grid.bounds(), &distance, &options, &mut Silent).unwrap_err();
        assert!(matches!(error, LatticeError::SpacingFactor { .. }), "{error}");
    }
    let thin = Grid { shape: [5, 1], step: [1.0; 2] };
    let error =
        grow(&crystal, thin.bounds(), &constant(&thin, 4.0), &GrowOptions::default(), &mut Silent);
    assert_eq!(error.unwrap_err(), LatticeError::Thin { axis: 1 });
}

#[test]
fn boxes_of_every_proportion_are_filled() {
    for nx in [2, 3, 5, 9, 40] {
        for ny in [2, 4, 7] {
            for d in [1.0, 2.0, 3.7, 9.0, 1e3] {
                let what = format!("{nx} × {ny}, d = {d}");
                let flat = grid([nx, ny]);
                let distance = constant(&flat, d);
                let lattice = grown(&Crystal::hexagonal(), &flat, &distance);
                assert_sound(&lattice, &Delaunay::<2>::new(), &[], &what);
                if d == 1e3 {
                    assert_eq!(lattice.len(), 4, "{what}");
                }
                let lattice = scattered(&Scatterer::<2>::new(), &flat, &distance, 3);
                assert_sound(&lattice, &Delaunay::<2>::new(), &[], &what);
            }
        }
    }
    for shape in [[2, 2, 2], [2, 9, 3], [9, 2, 2], [4, 4, 5], [3, 3, 30]] {
        for d in [1.0, 2.3, 5.0, 1e3] {
            let what = format!("{shape:?}, d = {d}");
            let solid = grid(shape);
            let distance = constant(&solid, d);
            for crystal in [Crystal::body_centered_cubic(), Crystal::face_centered_cubic()] {
                let lattice = grown(&crystal, &solid, &distance);
                assert_sound(&lattice, &Delaunay::<3>::new(), &[], &what);
                if d == 1e3 {
                    assert_eq!(lattice.len(), 8, "{what}");
                }
            }
            let lattice = scattered(&Scatterer::<3>::new(), &solid, &distance, 3);
            assert_sound(&lattice, &Delaunay::<3>::new(), &[], &what);
        }
    }
}

/// Boxes of millimetres to light years: lengths are relative to d only.
#[test]
fn scale_changes_nothing() {
    let lattice_at = |scale: f64| {
        let grid = Grid { shape: [40, 30], step: [scale; 2] };
        grown(&Crystal::hexagonal(), &grid, &constant(&grid, 3.0 * scale))
    };
    let unit = lattice_at(1.0);
    for power in [-30, 30] {
        let scale = 2f64.powi(power); // exact, so that nothing may differ
        let other = lattice_at(scale);
        let scaled: Vec<Point<2>> = unit.atoms().iter().map(|p| p.map(|x| x * scale)).collect();
        assert_eq!(other.atoms(), scaled);
    }
}

/// The centre and radius of the circle or sphere through a cell's points, by Cramer's rule.
fn circumsphere<const D: usize>(mesh: &Mesh<D>, cell: &[u32]) -> (Point<D>, f64) {
    let simplex = mesh.simplex(cell);
    let rows = simplex.others.map(|q| difference(&q, &simplex.first));
    let right = rows.map(|v| 0.5 * dot(&v, &v));
    let determinant =
        |rows: [Point<D>; D]| crate::geometry::Simplex { first: [0.0; D], others: rows }.measure();
    let whole = determinant(rows);
    let offset: Point<D> = std::array::from_fn(|k| {
        let mut replaced = rows;
        (0..D).for_each(|r| replaced[r][k] = right[r]);
        determinant(replaced) / whole
    });
    (std::array::from_fn(|k| simplex.first[k] + offset[k]), dot(&offset, &offset).sqrt())
}

fn every_hole_is_small<const D: usize>(
    scatterer: &Scatterer<D>,
    delaunay: &Delaunay<D>,
    grid: &Grid<D>,
    distance: &NominalDistance<D>,
    limit: f64,
) {
    for seed in 0..3 {
        let lattice = scattered(scatterer, grid, distance, seed);
        let mesh = assert_sound(&lattice, delaunay, &[], &format!("seed {seed}"));
        let bounds = lattice.bounds();
        let mut checked = 0;
        for cell in mesh.cells() {
            let (centre, radius) = circumsphere(&mesh, cell);
            let d = distance.at(&centre);
            // nearer to a side than this no atom is put
            let inside = |k: usize| {
                centre[k] > bounds.min[k] + 0.41 * d && centre[k] < bounds.max[k] - 0.41 * d
            };
            if (0..D).all(inside) {
                checked += 1;
                assert!(radius <= limit * d * (1.0 + 1e-9), "{centre:?}: {}", radius / d);
            }
        }
        assert!(2 * checked > mesh.cell_count(), "{checked} of {}", mesh.cell_count());
        // an atom was put where no other was within the limit, of d there
        for (i, j, apart) in near_pairs(&lattice, distance.greatest()) {
            if sides(&lattice, i) > 0 && sides(&lattice, j) > 0 {
                continue;
            }
            let least = distance.at(&lattice.atoms()[i]).min(distance.at(&lattice.atoms()[j]));
            // the first atom is put at random, at least d from the others, and sides are approached to 0.4 d
            assert!(apart > 0.39 * least, "{apart} {least}");
        }
    }
}

#[test]
fn scattering_leaves_no_hole() {
    let flat = grid([70, 50]);
    let solid = grid([22, 20, 18]);
    let (circle, sphere) = (Scatterer::<2>::new(), Scatterer::<3>::new());
    let (plane, space) = (Delaunay::<2>::new(), Delaunay::<3>::new());
    every_hole_is_small(&circle, &plane, &flat, &constant(&flat, 3.0), 0.760);
    every_hole_is_small(&circle, &plane, &flat, &graded(&flat, |p| 1.5 + 0.1 * p[0]), 0.760);
    every_hole_is_small(&sphere, &space, &solid, &constant(&solid, 3.0), 0.803);
    every_hole_is_small(&sphere, &space, &solid, &graded(&solid, |p| 2.0 + 0.15 * p[2]), 0.803);
}

/// Edges inside the box, by their angle in sixths of a half turn, from −15°: 0 and 3, 30° apart, are
/// where a hexagonal lattice has all and none.
fn angles(lattice: &Lattice<2>) -> [f64; 6] {
    let mesh = Delaunay::<2>::new().connect(lattice.atoms(), &mut Silent).unwrap();
    let mut counts = [0.0; 6];
    for cell in mesh.cells() {
        for k in 0..3 {
            let (a, b) = (cell[k] as usize, cell[(k + 1) % 3] as usize);
            // an edge has two cells: count it in one
            if a < b && sides(lattice, a) == 0 && sides(lattice, b) == 0 {
                let v = difference(&lattice.atoms()[b], &lattice.atoms()[a]);
                let turn = (v[1].atan2(v[0]) / std::f64::consts::PI + 1.0 / 12.0).rem_euclid(1.0);
                counts[((turn * 6.0) as usize).min(5)] += 1.0;
            }
        }
    }
    counts
}

#[test]
fn scattered_edges_have_no_direction_and_hexagonal_ones_have_three() {
    let grid = grid([120, 120]);
    let distance = constant(&grid, 3.0);
    let random = angles(&scattered(&Scatterer::<2>::new(), &grid, &distance, 5));
    let total: f64 = random.iter().sum();
    assert!(total > 3000.0);
    for count in random {
        // of n independent edges a bin would have n/6 ± √(5 n/36), 2.4 % here; neighbouring edges are
        // not independent: six times that much
        assert!((count / (total / 6.0) - 1.0).abs() < 0.15, "{random:?}");
    }
    let hexagonal = angles(&grown(&Crystal::hexagonal(), &grid, &distance));
    let along = hexagonal[0] + hexagonal[2] + hexagonal[4];
    assert!(along > 0.95 * hexagonal.iter().sum::<f64>(), "{hexagonal:?}");
}

#[test]
fn a_seed_fixes_a_scattered_lattice() {
    let grid = grid([20, 18, 16]);
    let distance = constant(&grid, 4.0);
    let make = |seed| scattered(&Scatterer::<3>::new(), &grid, &distance, seed).atoms().to_vec();
    assert_eq!(make(7), make(7));
    assert_ne!(make(7), make(8));
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    assert_eq!(pool(1).install(|| make(7)), pool(3).install(|| make(7)));
}

/// Ends the work at a given call.
struct EndAt(usize);

impl Watch for EndAt {
    fn step(&mut self, _: Phase, done: f64, _: Option<f64>) -> ControlFlow<()> {
        assert!((0.0..=1.0).contains(&done), "{done}");
        if self.0 == 0 {
            return ControlFlow::Break(());
        }
        self.0 -= 1;
        ControlFlow::Continue(())
    }
}

#[test]
fn a_watch_ends_growing_and_scattering() {
    // 40,000 atoms, and a call every 4096
    let grid = grid([190, 190]);
    let distance = constant(&grid, 1.0);
    let options = GrowOptions::default();
    for calls in 0..3 {
        let end =
            grow(&Crystal::hexagonal(), grid.bounds(), &distance, &options, &mut EndAt(calls));
        assert!(matches!(end, Err(LatticeError::Cancelled(_))), "after {calls} calls");
        let options = ScatterOptions::default();
        let end =
            scatter(&Scatterer::<2>::new(), grid.bounds(), &distance, &options, &mut EndAt(calls));
        assert!(matches!(end, Err(LatticeError::Cancelled(_))), "after {calls} calls");
    }
}

#[test]
fn a_lattice_too_large_to_count_is_refused_at_once() {
    let grid = Grid { shape: [1 << 16, 1 << 16], step: [1.0; 2] };
    let distance = constant(&grid, 1.0);
    let end =
        grow(&Crystal::hexagonal(), grid.bounds(), &distance, &GrowOptions::default(), &mut Silent);
    assert!(matches!(end, Err(LatticeError::TooMany { .. })));
}

#[test]
fn atoms_of_ones_own_are_held_on_the_sides_of_the_box() {
    let grid = grid([8, 7, 6]);
    let given = grown(&Crystal::body_centered_cubic(), &grid, &constant(&grid, 2.0));
    let lattice = Lattice::from_atoms(grid.bounds(), given.atoms().to_vec()).unwrap();
    assert_sound(&lattice, &Delaunay::<3>::new(), &[], "own atoms");
    assert!((0..lattice.len()).all(|i| lattice.temperature[i] == 1.0));
}

#[test]
fn atoms_that_make_no_lattice_are_named() {
    let bounds = Bounds { min: [0.0, 0.0], max: [8.0, 6.0] };
    let corners: Vec<Point<2>> = bounds.corners().collect();
    let with = |p: Point<2>| {
        let atoms = corners.iter().copied().chain([p]).collect();
        Lattice::from_atoms(bounds, atoms).map(|_| ()).map_err(|error| error.to_string())
    };
    assert_eq!(with([3.0, 2.0]), Ok(()));
    let cases = [
        ([3.0, f64::NAN], "coordinate y of atom 4 is NaN; expected a finite number"),
        (
            [9.0, 1.0],
            "atom 4 at [9.0, 1.0] lies outside the box [0.0, 0.0] to [8.0, 6.0] (lattice coordinates)",
        ),
        ([8.0, -0.0], "atoms 1 and 4 are both at [8.0, 0.0]; expected one"),
    ];
    for (p, message) in cases {
        assert_eq!(with(p), Err(message.to_string()));
    }
    let end = Lattice::from_atoms(bounds, corners[1..].to_vec());
    assert_eq!(end.unwrap_err(), LatticeError::NoCorner { corner: vec![0.0, 0.0] });
    let flat = Bounds { min: [0.0, 0.0], max: [8.0, 0.0] };
    assert_eq!(Lattice::from_atoms(flat, corners).unwrap_err(), LatticeError::Thin { axis: 1 });
}

#[test]
fn centres_of_nearly_flat_cells_are_no_atoms() {
    // round after round, rounding put the centre of a flat cell onto an atom
    let grid = Grid { shape: [21, 20, 23], step: [1.0; 3] };
    let distance = NominalDistance::constant(&grid, 6.973).unwrap();
    let options = ScatterOptions { seed: 636, ..Default::default() };
    let lattice =
        scatter(&Scatterer::<3>::new(), grid.bounds(), &distance, &options, &mut Silent).unwrap();
    assert_eq!(merge_duplicates(lattice.atoms()).0.len(), lattice.len());
}
