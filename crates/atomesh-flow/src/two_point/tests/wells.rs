//! Wells: equivalent radii, the quarter five-spot, image wells.

use std::f64::consts::{PI, TAU};

use super::*;

const EULER: f64 = 0.577_215_664_901_532_9;

/// −ln r/2π or 1/4πr.
fn free<const D: usize>(place: &Point<D>, well: &Point<D>) -> f64 {
    let r = atomesh::geometry::distance_squared(place, well).sqrt();
    if D == 2 { -r.ln() / TAU } else { 1.0 / (2.0 * TAU * r) }
}

/// The radius at which the pressure around the well is that of its cell, from a solution: the well has rate 1,
/// the sides the exact pressure.
fn radius_from_solution<const D: usize>(
    sites: &[Point<D>],
    bounds: Bounds<D>,
    place: Point<D>,
) -> f64
where
    Axes: Dimension<D>,
{
    let cells = cells_of(sites, bounds);
    let grid = FlowGrid::of_cells(&cells, None);
    let exact = |p: &Point<D>| free(p, &place);
    let problem = Problem {
        wells: vec![well(place, Control::Rate(1.0), None)],
        boundaries: all_sides(&exact),
        ..Problem::default()
    };
    let pressure = answer(&cells, &grid, &problem).wells[0].cell_pressure;
    if D == 2 { (-TAU * pressure).exp() } else { 1.0 / (2.0 * TAU * pressure) }
}

/// Sites on a lattice of squares or cubes of side 1, the outermost on the sides; the middle and the box.
fn squares<const D: usize>(half: usize) -> (Vec<Point<D>>, Bounds<D>, Point<D>) {
    let sites = lattice([0.0; D], 1.0, [2 * half + 1; D]);
    (sites, cube(2.0 * half as f64), [half as f64; D])
}

/// Sites of a lattice of hexagons, 1 from each other, in a box around one of them.
fn hexagons(half: i32) -> (Vec<Point<2>>, Bounds<2>, Point<2>) {
    let row = 0.75_f64.sqrt();
    let max = [f64::from(half), row * f64::from(half)];
    let bounds = Bounds { min: max.map(|x| -x), max };
    let rows = -half..=half;
    let place =
        |i: i32, j: i32| [f64::from(i) + 0.5 * f64::from(j.rem_euclid(2)), row * f64::from(j)];
    let sites = rows.clone().flat_map(|j| rows.clone().map(move |i| place(i, j)));
    (sites.filter(|site| bounds.contains(site)).collect(), bounds, [0.0; 2])
}

#[test]
fn with_exact_neighbours_squares_and_hexagons_have_peacemans_radii() {
    // boxes so small that all neighbours lie on their sides and have the exact pressure: Peaceman's assumption
    let check = |sites: &[Point<2>], bounds: Bounds<2>, place: Point<2>, expected: f64| {
        let found = radius_from_solution(sites, bounds, place);
        assert!((found - expected).abs() < 1e-12, "{found}, expected {expected}");
    };
    let (squares, hexagons) = (squares::<2>, hexagons);
    let (square, hexagon) = ((-PI / 2.0).exp(), (-PI / 3.0_f64.sqrt()).exp());
    assert!((square - 0.2079).abs() < 1e-4 && (hexagon - 0.1630).abs() < 1e-4);
    let (sites, bounds, place) = squares(1);
    check(&sites, bounds, place, square);
    let (sites, bounds, place) = hexagons(1);
    check(&sites, bounds, place, hexagon);
    // and the same by one ring of a large mesh
    let (sites, bounds, place) = squares(6);
    assert!((radius(&sites, bounds, place, 1) - square).abs() < 1e-12);
    let (sites, bounds, place) = hexagons(6);
    assert!((radius(&sites, bounds, place, 1) - hexagon).abs() < 1e-12);
}

/// [`equivalent_radius`] in the cell that holds a place.
fn radius<const D: usize>(
    sites: &[Point<D>],
    bounds: Bounds<D>,
    place: Point<D>,
    rings: usize,
) -> f64
where
    Axes: Dimension<D>,
{
    let cells = cells_of(sites, bounds);
    let cell = FlowGrid::of_cells(&cells, None).cells_at(&place)[0];
    equivalent_radius(&cells, cell as usize, rings).unwrap()
}

#[test]
fn far_from_sides_radii_are_those_of_the_infinite_lattice() {
    // lattice Green's functions: R(r) → (ln r + γ + ln √8)/2π on squares (McCrea & Whipple 1940), ln √12 on
    // hexagons. Sides 12 away leave 1/12 of (1/12)².
    let (sites, bounds, place) = squares::<2>(12);
    let exact = (-EULER).exp() / 8.0_f64.sqrt();
    let found = radius_from_solution(&sites, bounds, place);
    assert!((found / exact - 1.0).abs() < 1e-3, "squares: {found}, expected {exact}");
    assert!((radius(&sites, bounds, place, RINGS) / exact - 1.0).abs() < 2e-3);
    let (sites, bounds, place) = hexagons(12);
    let exact = (-EULER).exp() / 12.0_f64.sqrt();
    let found = radius_from_solution(&sites, bounds, place);
    assert!((found / exact - 1.0).abs() < 1e-4, "hexagons: {found}, expected {exact}");
    assert!((radius(&sites, bounds, place, RINGS) / exact - 1.0).abs() < 1e-4);
}

#[test]
fn a_point_well_among_cubes_has_watsons_radius() {
    // with exact neighbours 6/(6 + 4π); on the infinite lattice 1/4πG, where G = 0.252731… is Watson's (1939)
    // integral over 2, the pressure of a cell of rate 1
    let (sites, bounds, place) = squares::<3>(1);
    let found = radius_from_solution(&sites, bounds, place);
    assert!((found - 6.0 / (6.0 + 2.0 * TAU)).abs() < 1e-12, "{found}");
    let exact = 1.0 / (2.0 * TAU * 0.252_731_009_858);
    let (sites, bounds, place) = squares::<3>(6);
    let found = radius_from_solution(&sites, bounds, place);
    assert!((found / exact - 1.0).abs() < 2e-3, "{found}, expected {exact}");
    assert!((radius(&sites, bounds, place, RINGS) / exact - 1.0).abs() < 2e-3);
}

#[test]
fn on_a_side_or_in_a_corner_a_well_has_the_radius_that_it_has_inside() {
    let (sites, bounds, place) = squares::<2>(4);
    let inside = radius(&sites, bounds, place, 1);
    for at in [[4.0, 0.0], [0.0, 4.0], [8.0, 8.0]] {
        let found = radius(&sites, bounds, at, 1);
        assert!((found / inside - 1.0).abs() < 1e-12, "{at:?}: {found}, inside {inside}");
    }
    let (sites, bounds, place) = squares::<3>(2);
    let inside = radius(&sites, bounds, place, 1);
    for at in [[2.0, 2.0, 0.0], [0.0, 2.0, 4.0], [4.0; 3]] {
        let found = radius(&sites, bounds, at, 1);
        assert!((found / inside - 1.0).abs() < 1e-12, "{at:?}: {found}, inside {inside}");
    }
}

/// Muskat's constant from wall pressures: Δp πk/Q = ln(d/r_w) − C, d the distance of the wells of opposite sign.
fn five_spot(sites: &[Point<2>]) -> f64 {
    let cells = cells_of(sites, cube(1.0));
    let grid = FlowGrid::of_cells(&cells, None);
    let wall = Some(1e-4);
    let wells = [([0.0; 2], 0.25), ([1.0; 2], -0.25)];
    let wells = wells.map(|(place, rate)| well(place, Control::Rate(rate), wall)).to_vec();
    let found = answer(&cells, &grid, &Problem { wells, ..Problem::default() });
    let drop = found.wells[0].wall_pressure.unwrap() - found.wells[1].wall_pressure.unwrap();
    (2.0_f64.sqrt() / 1e-4).ln() - PI * drop
}

/// C = ln(ϖ/√2) = 0.617386…, ϖ the lemniscate constant. The lemniscatic sine has simple zeros on a lattice of squares of
/// side ϖ, simple poles in their middles, slope 1 at its zeros, and `sl(z + ϖ(1 + i)/2) = −i/sl(z)`: so with
/// p = −(Q/2πk) ln|sl z| the walls of the two wells differ by −(Q/πk) ln r_w, and they are ϖ/√2 apart.
const FIVE_SPOT: f64 = 0.617_385_8;

#[test]
fn the_quarter_five_spot_has_its_constant() {
    let lemniscate: f64 = 2.622_057_554_292_119;
    assert!(((lemniscate / 2.0_f64.sqrt()).ln() - FIVE_SPOT).abs() < 1e-6);
    let errors = [8, 16, 32].map(|n| {
        let sites = lattice([0.0; 2], 1.0 / f64::from(n), [n as usize + 1; 2]);
        (five_spot(&sites) - FIVE_SPOT).abs()
    });
    assert!(errors[2] < 0.005 * FIVE_SPOT, "{errors:?}");
    for seed in 0..3 {
        let mut sites = scattered::<2>(1500, seed);
        let away = |p: &Point<2>, c: f64| p.iter().map(|x| (x - c).powi(2)).sum::<f64>() > 1e-4;
        sites.retain(|p| away(p, 0.0) && away(p, 1.0));
        sites.extend([[0.0; 2], [1.0; 2]]);
        let found = five_spot(&sites);
        // cells of random sites are as uneven as can be: 1 %, of which some comes from every well's surroundings
        assert!((found / FIVE_SPOT - 1.0).abs() < 0.01, "random cells, seed {seed}: {found}");
    }
}

#[test]
fn a_well_of_given_pressure_brings_what_its_radius_lets_through() {
    // the well's own field: between wall and sides 2π/ln(r/r_w) for each unit of pressure
    let (sites, bounds, place) = squares::<2>(10);
    let cells = cells_of(&sites, bounds);
    let grid = FlowGrid::of_cells(&cells, None);
    let exact = |p: &Point<2>| free(p, &place);
    let wall = free(&[place[0] + 1e-3, place[1]], &place);
    let problem = Problem {
        wells: vec![well(place, Control::Pressure(wall), Some(1e-3))],
        boundaries: all_sides(&exact),
        ..Problem::default()
    };
    let found = answer(&cells, &grid, &problem);
    assert!((found.wells[0].rate - 1.0).abs() < 5e-4, "{}", found.wells[0].rate);
    assert_eq!(found.wells[0].wall_pressure, Some(wall));
    let none =
        Problem { wells: vec![Well { radius: None, ..problem.wells[0].clone() }], ..problem };
    let setting = Setting::new(&none, &grid).unwrap();
    let error = solve(&cells, &grid, &setting, &SolveOptions::default(), &mut Silent).unwrap_err();
    assert!(matches!(error, FlowError::WellRadius { found: 0.0, .. }), "{error}");
}
