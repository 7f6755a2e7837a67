//! Oblique layers that the mesh follows: tests 6 and 7 of Herbin & Hubert (2008), and a wall across a strip.

use atomesh::geometry::{Bounds, Point};
use atomesh::mesh::Delaunay;
use atomesh::watch::Silent;

use super::super::*;
use super::SCHEMES;
use crate::grid::FlowGrid;
use crate::permeability::{Permeability, Tensor};
use crate::problem::{Barrier, Boundary, Condition, Problem, Value};
use crate::test_meshes::{connect, jittered_points, name_inner_facets};

/// The slope of the layer.
const SLOPE: f64 = 0.2;

/// Above 0 above the layer's lower line; the upper line is 0.05 higher.
fn height(x: &Point<2>) -> f64 {
    x[1] - SLOPE * (x[0] - 0.5) - 0.475
}

/// A mesh of the unit square with edges along both lines: points between them would not be Delaunay's if they were
/// nearer to a line than those along it are to each other, so the layer has none of its own.
fn aligned() -> FlowGrid<2> {
    let bounds = Bounds { min: [0.0; 2], max: [1.0; 2] };
    let mut points = jittered_points(&bounds, [12, 12], 0.25, 3);
    let lines = [0.0, 0.05];
    points.retain(|x| lines.iter().all(|line| (height(x) - line).abs() > 0.04));
    for line in lines {
        points.extend((0..=40).map(|i| {
            let x = f64::from(i) / 40.0;
            [x, SLOPE * (x - 0.5) + 0.475 + line]
        }));
    }
    let grid = connect(Delaunay::<2>::new(), &points);
    // no cell has corners below and above a line
    for cell in grid.mesh().unwrap().cells() {
        let at = |&c: &u32| height(&grid.mesh().unwrap().points()[c as usize]);
        for line in lines {
            let below = cell.iter().any(|c| at(c) < line - 1e-9);
            assert!(!(below && cell.iter().any(|c| at(c) > line + 1e-9)), "the mesh is aligned");
        }
    }
    grid
}

fn is_exact(grid: &FlowGrid<2>, k: Vec<Tensor<2>>, exact: &(dyn Fn(&Point<2>) -> f64 + Sync)) {
    let sides = ["xmin", "xmax", "ymin", "ymax"];
    let boundary = |side: &str| Boundary {
        group: side.to_string(),
        condition: Condition::Pressure(Value::Field(exact)),
    };
    let problem = Problem {
        permeability: Permeability::CellTensors(k),
        boundaries: sides.map(boundary).to_vec(),
        ..Problem::default()
    };
    let setting = Setting::new(&problem, grid).unwrap();
    for (form, order) in SCHEMES {
        let options = DgOptions { form, order, ..DgOptions::default() };
        let answer = solve(grid, &setting, &options, &mut Silent).unwrap();
        let (error, norm) = answer.l2_distance(grid, |_| true, exact);
        // rounding times the contrast of 100
        assert!(error <= 1e-11 * norm, "{form:?} {order}: {:e}", error / norm);
        assert!(answer.solution.balance(grid).relative_error() <= 1e-10);
    }
}

#[test]
fn the_oblique_drain_is_exact() {
    let grid = aligned();
    let length = (1.0 + SLOPE * SLOPE).sqrt();
    let (cos, sin) = (1.0 / length, SLOPE / length);
    let tensor = |centroid: &Point<2>| {
        let inside = (0.0..0.05).contains(&height(centroid));
        let (along, across) = if inside { (100.0, 10.0) } else { (1.0, 0.1) };
        let mixed = (along - across) * cos * sin;
        let (c2, s2) = (cos * cos, sin * sin);
        [[along * c2 + across * s2, mixed], [mixed, along * s2 + across * c2]]
    };
    let k = grid.centroids().iter().map(tensor).collect();
    is_exact(&grid, k, &|x| -x[0] - SLOPE * x[1]);
}

#[test]
fn the_oblique_barrier_is_exact() {
    let grid = aligned();
    let scalar = |centroid: &Point<2>| {
        let k = if (0.0..0.05).contains(&height(centroid)) { 0.01 } else { 1.0 };
        [[k, 0.0], [0.0, k]]
    };
    let k = grid.centroids().iter().map(scalar).collect();
    is_exact(&grid, k, &|x| match height(x) {
        below if below <= 0.0 => -below,
        within if within <= 0.05 => -within / 0.01,
        above => -(above - 0.05) - 0.05 / 0.01,
    });
}

/// A strip of length 2 and height 1, the wall at x = 1 along edges.
fn strip() -> FlowGrid<2> {
    let bounds = Bounds { min: [0.0; 2], max: [2.0, 1.0] };
    let mut points = jittered_points(&bounds, [12, 6], 0.25, 9);
    for point in points.iter_mut().filter(|x| (x[0] - 1.0).abs() < 0.05) {
        point[0] = 1.0;
    }
    let mut grid = connect(Delaunay::<2>::new(), &points);
    name_inner_facets(&mut grid, "wall", |x| x[0] == 1.0);
    assert_eq!(grid.sets().last().unwrap().facets.len(), 6);
    grid
}

fn across(grid: &FlowGrid<2>, multiplier: f64, scheme: (Form, usize)) -> DgSolution<2> {
    let fixed = |group: &str, pressure: f64| Boundary {
        group: group.to_string(),
        condition: Condition::Pressure(Value::Constant(pressure)),
    };
    let problem = Problem {
        permeability: Permeability::Cells(
            grid.centroids().iter().map(|x| if x[0] < 1.0 { 1.0 } else { 3.0 }).collect(),
        ),
        boundaries: vec![fixed("xmin", 1.0), fixed("xmax", 0.0)],
        barriers: vec![Barrier { group: "wall".to_string(), multiplier }],
        ..Problem::default()
    };
    let setting = Setting::new(&problem, grid).unwrap();
    let options = DgOptions { form: scheme.0, order: scheme.1, ..DgOptions::default() };
    let answer = solve(grid, &setting, &options, &mut Silent).unwrap();
    let leak = answer.solution.leak(grid, &setting);
    assert_eq!(leak, 0.0);
    answer
}

/// What flows through the strip.
fn through(grid: &FlowGrid<2>, answer: &DgSolution<2>) -> f64 {
    let inlet = &grid.sets()[0].facets;
    -inlet.iter().map(|&facet| answer.solution.fluxes[facet as usize]).sum::<f64>()
}

#[test]
fn a_wall_of_equal_resistance_makes_the_exact_jump() {
    // triangles of equal height on either side make the wall's resistance the same everywhere
    let points: Vec<Point<2>> =
        (0..10).map(|i| [0.5 * f64::from(i / 2), f64::from(i % 2)]).collect();
    let mut grid = connect(Delaunay::<2>::new(), &points);
    name_inner_facets(&mut grid, "wall", |x| x[0] == 1.0);
    for scheme in SCHEMES {
        for multiplier in [1e-6, 0.01, 0.5, 0.9] {
            let answer = across(&grid, multiplier, scheme);
            // the centroid beside the wall is a third of the cell's width of 1/2 away
            let wall = (1.0 / multiplier - 1.0) * (0.5 / 3.0) * (1.0 + 1.0 / 3.0);
            let expected = 1.0 / (1.0 + 1.0 / 3.0 + wall);
            let found = through(&grid, &answer);
            let what = format!("{scheme:?} {multiplier}");
            // rounding of what would flow without the wall
            assert!((found - expected).abs() < 1e-13, "{what}: {found} {expected}");
            let wall = grid.sets().last().unwrap().facets[0] as usize;
            let facet = &grid.facets()[wall];
            let at = |cell: u32| answer.pressure(cell as usize, &facet.centroid);
            let jump = (at(facet.cell) - at(facet.neighbour.unwrap())).abs();
            let expected = 1.0 - expected * (1.0 + 1.0 / 3.0);
            assert!((jump - expected).abs() < 1e-11, "{what}: {jump} {expected}");
        }
    }
}

#[test]
fn a_wall_goes_from_no_barrier_to_a_sealed_one() {
    let grid = strip();
    for scheme in SCHEMES {
        let open = across(&grid, 1.0, scheme);
        assert!((through(&grid, &open) - 0.75).abs() < 1e-11, "{scheme:?}");
        let sealed = across(&grid, 0.0, scheme);
        assert!(through(&grid, &sealed).abs() < 1e-12, "{scheme:?}");
        // pressures change by less than the resistance that is added, and flow by less than what is left
        let nearly_open = across(&grid, 1.0 - 1e-9, scheme);
        let nearly_sealed = across(&grid, 1e-9, scheme);
        for (limit, near) in [(&open, &nearly_open), (&sealed, &nearly_sealed)] {
            let pairs = limit.solution.pressures.iter().zip(&near.solution.pressures);
            let most = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(most < 1e-6, "{scheme:?}: {most:e}");
        }
    }
}
