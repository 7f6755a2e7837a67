//! Pressures that two-point flux reproduces exactly.

use super::*;
use crate::permeability::Permeability;

/// Rounding: of some hundred cells, with sites a tenth of the mean distance apart at least.
const EXACT: f64 = 1e-11;

fn linear<const D: usize>(place: &Point<D>) -> f64 {
    0.3 + (0..D).map(|k| [1.0, -0.7, 0.4][k] * place[k]).sum::<f64>()
}

/// Whether what flows through a face is known: all but the faces on sides of cells whose site lies on two sides or more,
/// if they have too few other faces to tell how what flows out of them is shared.
fn is_told<const D: usize>(cells: &PolyMesh<D>, face: usize) -> bool {
    let site = &cells.centers()[cells.owners()[face] as usize];
    face < cells.inner_face_count() || site.iter().filter(|x| **x == 0.0 || **x == 1.0).count() < 2
}

fn a_linear_pressure_is_exact<const D: usize>(count: usize)
where
    Axes: Dimension<D>,
{
    for seed in 0..8 {
        let cells = cells_of(&scattered::<D>(count, seed), cube(1.0));
        a_linear_pressure_is_exact_on(&cells, |face| is_told(&cells, face));
    }
    // all faces of a lattice, those in the corners of the box too
    let cells = cells_of(&lattice([0.0; D], 0.25, [5; D]), cube(1.0));
    a_linear_pressure_is_exact_on(&cells, |_| true);
}

fn a_linear_pressure_is_exact_on<const D: usize>(
    cells: &PolyMesh<D>,
    is_told: impl Fn(usize) -> bool,
) {
    let grid = FlowGrid::of_cells(cells, None);
    let problem = Problem {
        permeability: Permeability::Uniform(2.5),
        boundaries: all_sides(&linear),
        ..Problem::default()
    };
    let found = answer(cells, &grid, &problem);
    for (pressure, site) in found.pressures.iter().zip(cells.centers()) {
        assert!((pressure - linear(site)).abs() < EXACT, "{site:?}: {pressure}");
    }
    for (face, &flux) in found.fluxes.iter().enumerate().filter(|(face, _)| is_told(*face)) {
        let area = cells.area_vector(face);
        let exact = -2.5 * (0..D).map(|k| [1.0, -0.7, 0.4][k] * area[k]).sum::<f64>();
        assert!((flux - exact).abs() < 10.0 * EXACT, "face {face}: {flux}, expected {exact}");
    }
}

#[test]
fn a_linear_pressure_is_exact_on_random_polygons() {
    a_linear_pressure_is_exact::<2>(300);
}

#[test]
fn a_linear_pressure_is_exact_on_random_polyhedra() {
    a_linear_pressure_is_exact::<3>(300);
}

#[test]
fn layers_normal_to_the_flow_are_exact() {
    // ten columns of cubes, each with its own k; the resistances of the columns add
    let sites = lattice([0.05; 3], 0.1, [10, 3, 2]);
    let cells = cells_of(&sites, Bounds { min: [0.0; 3], max: [1.0, 0.3, 0.2] });
    let grid = FlowGrid::of_cells(&cells, None);
    let k: Vec<f64> = (0..10).map(|n| 10.0_f64.powi(n % 5 - 2)).collect();
    let column = |site: &Point<3>| (site[0] / 0.1) as usize;
    let problem = Problem {
        permeability: Permeability::Cells(sites.iter().map(|s| k[column(s)]).collect()),
        boundaries: vec![pressure_on("xmin", 1.0), pressure_on("xmax", 0.0)],
        ..Problem::default()
    };
    let found = answer(&cells, &grid, &problem);
    let resistance: f64 = k.iter().map(|k| 0.1 / k).sum();
    for (site, &pressure) in sites.iter().zip(&found.pressures) {
        let at = column(site);
        let before: f64 = k[..at].iter().map(|k| 0.1 / k).sum::<f64>() + 0.05 / k[at];
        assert!((pressure - (1.0 - before / resistance)).abs() < EXACT, "{site:?}");
    }
    let rate = found.balance(&grid).boundary_in;
    assert!((rate - 0.06 / resistance).abs() < EXACT * rate);
}

#[test]
fn a_multiplier_jumps_by_its_resistance() {
    // k 2 left of x = 0.5, k 1 to the right; the face's own resistance is m⁻¹ times that between the two sites
    let sites = lattice([0.05, 0.05], 0.1, [10, 4]);
    let cells = cells_of(&sites, Bounds { min: [0.0; 2], max: [1.0, 0.4] });
    let mut grid = FlowGrid::of_cells(&cells, None);
    assert_eq!(name_faces(&mut grid, "fault", |f| (f.centroid[0] - 0.5).abs() < 1e-9), 4);
    let number = |x: f64| if x < 0.5 { 2.0 } else { 1.0 };
    for multiplier in [0.0, 0.01, 0.5, 1.0] {
        let problem = Problem {
            permeability: Permeability::Cells(sites.iter().map(|s| number(s[0])).collect()),
            boundaries: vec![pressure_on("xmin", 1.0), pressure_on("xmax", 0.0)],
            barriers: vec![Barrier { group: "fault".to_string(), multiplier }],
            ..Problem::default()
        };
        let found = answer(&cells, &grid, &problem);
        let extra = (1.0 / multiplier - 1.0) * (0.05 / 2.0 + 0.05);
        let velocity = 1.0 / (0.5 / 2.0 + 0.5 + extra); // 0 if sealed
        for (site, &pressure) in sites.iter().zip(&found.pressures) {
            let exact = match site[0] < 0.5 {
                true => 1.0 - velocity * site[0] / 2.0,
                false => velocity * (1.0 - site[0]),
            };
            assert!((pressure - exact).abs() < EXACT, "multiplier {multiplier}, {site:?}");
        }
    }
}

#[test]
fn a_flux_on_a_side_and_a_source_are_exact_in_one_dimension() {
    // −p″ = 2 with p(0) = 0 and p′(1) = 3: p = 5x − x², which second differences reproduce inside. Half cells
    // at the ends, since sites lie on the sides.
    let sites = lattice([0.0, 0.0], 0.125, [9, 2]);
    let cells = cells_of(&sites, Bounds { min: [0.0; 2], max: [1.0, 0.125] });
    let grid = FlowGrid::of_cells(&cells, None);
    let inflow = Condition::Flux(Value::Constant(3.0));
    let problem = Problem {
        source: Some(Value::Constant(2.0)),
        boundaries: vec![
            pressure_on("xmin", 0.0),
            Boundary { group: "xmax".to_string(), condition: inflow },
        ],
        ..Problem::default()
    };
    let found = answer(&cells, &grid, &problem);
    for (site, &pressure) in sites.iter().zip(&found.pressures) {
        assert!((pressure - (5.0 - site[0]) * site[0]).abs() < EXACT, "{site:?}");
    }
    let out = found.balance(&grid).boundary_out;
    assert!((out - 5.0 * 0.125).abs() < EXACT, "the slope at 0 is 5, also where the cell is half");
}

/// Herbin & Hubert (2008), test 7: k 1, 1/100, 1 below, between and above two oblique lines; the flux of the exact
/// pressure is the same everywhere.
#[test]
fn an_oblique_barrier_is_exact_where_faces_follow_it() {
    let slope = 0.2_f64;
    let line = move |p: &Point<2>| p[1] - slope * (p[0] - 0.5) - 0.475;
    let layer = move |p: &Point<2>| match line(p) {
        above if above < 0.0 => 0,
        above if above < 0.05 => 1,
        _ => 2,
    };
    let exact = move |p: &Point<2>| match layer(p) {
        0 => -line(p),
        1 => -line(p) / 0.01,
        _ => -(line(p) - 0.05) - 0.05 / 0.01,
    };
    let sites = beside_lines(slope, 0.05);
    let cells = cells_of(&sites, cube(1.0));
    let grid = FlowGrid::of_cells(&cells, None);
    let mut crossings = 0;
    for facet in &grid.facets()[..cells.inner_face_count()] {
        let (a, b) = (facet.cell, facet.neighbour.unwrap());
        if layer(&sites[a as usize]) != layer(&sites[b as usize]) {
            let above = line(&facet.centroid);
            assert!(above.abs().min((above - 0.05).abs()) < 1e-9, "faces follow the lines");
            crossings += 1;
        }
    }
    assert!(crossings > 40);
    let k = sites.iter().map(|site| [1.0, 0.01, 1.0][layer(site)]).collect();
    let problem = Problem {
        permeability: Permeability::Cells(k),
        boundaries: all_sides(&exact),
        ..Problem::default()
    };
    let found = answer(&cells, &grid, &problem);
    for (pressure, site) in found.pressures.iter().zip(&sites) {
        assert!((pressure - exact(site)).abs() < 10.0 * EXACT, "{site:?}: pressures to 5.5");
    }
}

/// Sites in rows along two lines, mirrored across both, with gaps along the rows that vary.
fn beside_lines(slope: f64, height: f64) -> Vec<Point<2>> {
    let length = (1.0 + slope * slope).sqrt();
    let thickness = height / length;
    let heights = (-24..26).map(|row| (f64::from(row) + 0.5) * 0.5 * thickness);
    let mut random = Pcg64::seed_from_u64(7);
    let along: Vec<f64> =
        (-30..30).map(|n| 0.03 * (f64::from(n) + 0.3 * random.random::<f64>())).collect();
    let place = |s: f64, t: f64| [0.5 + (s - slope * t) / length, 0.475 + (slope * s + t) / length];
    let sites = heights.flat_map(|t| along.iter().map(move |&s| place(s, t)));
    sites.filter(|p| cube::<2>(1.0).contains(p)).collect()
}

#[test]
fn a_tensor_is_refused_with_a_way_out() {
    let cells = cells_of(&lattice([0.25; 2], 0.5, [2, 2]), cube(1.0));
    let grid = FlowGrid::of_cells(&cells, None);
    let permeability = Permeability::UniformTensor([[1.0, 0.0], [0.0, 1.0]]);
    let problem = Problem { permeability, ..Problem::default() };
    let setting = Setting::new(&problem, &grid).unwrap();
    let error = solve(&cells, &grid, &setting, &SolveOptions::default(), &mut Silent).unwrap_err();
    assert_eq!(error, FlowError::Tensor);
    assert!(error.to_string().contains("a mesh of triangles or tetrahedra"), "{error}");
}

#[test]
fn cells_that_a_frame_has_sheared_are_refused() {
    let cells = cells_of(&scattered::<2>(40, 1), cube(1.0));
    let problem = Problem::default();
    let fails = |cells: &PolyMesh<2>| {
        let grid = FlowGrid::of_cells(cells, None);
        let setting = Setting::new(&problem, &grid).unwrap();
        solve(cells, &grid, &setting, &SolveOptions::default(), &mut Silent).is_err()
    };
    let turned = cells.moved(false, |p| [0.6 * p[0] - 0.8 * p[1], 0.8 * p[0] + 0.6 * p[1]]);
    assert!(!fails(&cells) && !fails(&turned));
    assert!(fails(&cells.moved(false, |p| [p[0], 1.1 * p[1]])), "stretched");
}

#[test]
fn cells_without_a_pressure_are_pinned() {
    // sealed at x = 1/2: a well that feeds a side on the left, nothing on the right
    let cells = cells_of(&lattice([0.125; 2], 0.25, [4, 4]), cube(1.0));
    let mut grid = FlowGrid::of_cells(&cells, None);
    name_faces(&mut grid, "fault", |f| (f.centroid[0] - 0.5).abs() < 1e-9);
    let problem = Problem {
        wells: vec![well([0.4, 0.4], Control::Rate(1.0), None)],
        boundaries: vec![pressure_on("xmin", 0.0)],
        barriers: vec![Barrier { group: "fault".to_string(), multiplier: 0.0 }],
        ..Problem::default()
    };
    let found = answer(&cells, &grid, &problem);
    assert_eq!(found.pinned, [2]);
    let right = (0..16).filter(|cell| cell % 4 >= 2);
    assert!(right.clone().all(|cell| found.pressures[cell].abs() < EXACT));
    assert!((found.balance(&grid).boundary_out - 1.0).abs() < EXACT);
}

#[test]
fn rates_that_balance_need_no_pressure() {
    let cells = cells_of(&scattered::<2>(60, 3), cube(1.0));
    let grid = FlowGrid::of_cells(&cells, None);
    let wells = [([0.2, 0.2], 1.5), ([0.8, 0.3], -0.5), ([0.7, 0.9], -1.0)];
    let wells = wells.map(|(place, rate)| well(place, Control::Rate(rate), None)).to_vec();
    let found = answer(&cells, &grid, &Problem { wells, ..Problem::default() });
    assert_eq!(found.pinned, [1]);
    assert!(found.pressures[0].abs() < EXACT, "pressure 0 in the first cell");
    assert!(found.wells[0].cell_pressure > found.wells[1].cell_pressure);
}

#[test]
fn a_site_on_two_sides_obeys_the_one_named_last() {
    let cells = cells_of(&lattice([0.0; 2], 0.5, [3, 3]), cube(1.0));
    let grid = FlowGrid::of_cells(&cells, None);
    let (left, low) = (pressure_on("xmin", 1.0), pressure_on("ymin", 2.0));
    let corner = |boundaries| {
        let problem = Problem { boundaries, ..Problem::default() };
        answer(&cells, &grid, &problem).pressures[0]
    };
    assert_eq!(corner(vec![left.clone(), low.clone()]), 2.0);
    assert_eq!(corner(vec![low, left]), 1.0);
}
