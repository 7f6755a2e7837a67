//! Wells: the logarithm, its mirror image, and wells run by pressure.

use std::f64::consts::PI;

use atomesh::geometry::{Bounds, Point, distance_squared};
use atomesh::mesh::Delaunay;
use atomesh::watch::Silent;

use super::super::*;
use super::SCHEMES;
use crate::grid::FlowGrid;
use crate::problem::{Barrier, Boundary, Condition, Control, Problem, Value, Well};
use crate::test_meshes::{connect, jittered_points, name_inner_facets, unit_box};

const STEPS: usize = 24;

/// A well in the middle of the cell that holds a place.
fn well(grid: &FlowGrid<2>, near: Point<2>, control: Control) -> Well<2> {
    let cell = grid.cells_at(&near)[0] as usize;
    Well { name: "well".to_string(), place: grid.centroids()[cell], control, radius: Some(1e-4) }
}

/// A source of rate 1 in permeability 1.
fn logarithm(x: &Point<2>, well: &Point<2>) -> f64 {
    -distance_squared(x, well).ln() / (4.0 * PI)
}

fn fixed<'a>(
    sides: &[&str],
    pressure: &'a (dyn Fn(&Point<2>) -> f64 + Sync),
) -> Vec<Boundary<'a, 2>> {
    let boundary = |side: &&str| Boundary {
        group: side.to_string(),
        condition: Condition::Pressure(Value::Field(pressure)),
    };
    sides.iter().map(boundary).collect()
}

/// The relative error beyond three cells' size of the well.
fn error_away(
    grid: &FlowGrid<2>,
    answer: &DgSolution<2>,
    well: &Point<2>,
    exact: impl Fn(&Point<2>) -> f64,
) -> f64 {
    let far = |cell: usize| {
        distance_squared(&grid.centroids()[cell], well) > (3.0 / STEPS as f64).powi(2)
    };
    let (error, norm) = answer.l2_distance(grid, far, exact);
    error / norm
}

#[test]
fn pressure_around_a_well_is_logarithmic() {
    let grid = unit_box(Delaunay::<2>::new(), STEPS, 0.2, 4);
    let source = well(&grid, [0.5, 0.5], Control::Rate(1.0));
    let place = source.place;
    let exact = |x: &Point<2>| logarithm(x, &place);
    let problem = Problem {
        boundaries: fixed(&["xmin", "xmax", "ymin", "ymax"], &exact),
        wells: vec![source.clone()],
        ..Problem::default()
    };
    let setting = Setting::new(&problem, &grid).unwrap();
    for (form, order) in SCHEMES {
        let options = DgOptions { form, order, ..DgOptions::default() };
        let answer = solve(&grid, &setting, &options, &mut Silent).unwrap();
        let error = error_away(&grid, &answer, &place, exact);
        println!("{form:?} {order}: {error:e}");
        // spread over a triangle around its own centroid, a well differs from a point by moments of second order
        // only, (1/3)²/18 at three sizes away; linear pressures add their own error, (1/3)²/8 of curvature
        assert!(error < 2e-3 * if order == 1 { 3.0 } else { 1.0 }, "{form:?} {order}: {error:e}");
        assert!(answer.solution.balance(&grid).relative_error() <= 1e-10);
        // at the wall: the logarithm, but for what a triangle differs from the disk of its area
        let wall = answer.solution.wells[0].wall_pressure.unwrap();
        let expected = -(1e-4_f64).ln() / (2.0 * PI);
        println!("  wall {wall} {expected}");
        let away = (wall / expected - 1.0).abs();
        assert!(away < if order == 1 { 0.03 } else { 0.015 }, "{form:?} {order}: {wall}");
    }
}

#[test]
fn a_sealing_fault_mirrors_a_well() {
    let bounds = Bounds { min: [0.0; 2], max: [1.0; 2] };
    let mut points = jittered_points(&bounds, [STEPS; 2], 0.2, 4);
    for point in points.iter_mut().filter(|x| (x[0] - 0.5).abs() < 0.4 / STEPS as f64) {
        point[0] = 0.5;
    }
    let mut grid = connect(Delaunay::<2>::new(), &points);
    name_inner_facets(&mut grid, "fault", |x| x[0] == 0.5);
    let source = well(&grid, [0.3, 0.45], Control::Rate(1.0));
    let place = source.place;
    let image = [1.0 - place[0], place[1]];
    let exact = |x: &Point<2>| match x[0] <= 0.5 {
        true => logarithm(x, &place) + logarithm(x, &image),
        false => 0.0,
    };
    let problem = Problem {
        boundaries: fixed(&["xmin", "ymin", "ymax"], &exact),
        barriers: vec![Barrier { group: "fault".to_string(), multiplier: 0.0 }],
        wells: vec![source],
        ..Problem::default()
    };
    let setting = Setting::new(&problem, &grid).unwrap();
    for (form, order) in SCHEMES {
        let options = DgOptions { form, order, ..DgOptions::default() };
        let answer = solve(&grid, &setting, &options, &mut Silent).unwrap();
        let error = error_away(&grid, &answer, &place, exact);
        println!("{form:?} {order}: {error:e}");
        assert!(error < 2e-3 * if order == 1 { 3.0 } else { 1.0 }, "{form:?} {order}: {error:e}");
        assert!(answer.solution.balance(&grid).relative_error() <= 1e-10);
        assert_eq!(answer.solution.leak(&grid, &setting), 0.0);
        let beyond = grid.cells_at(&[0.8, 0.5])[0] as usize;
        assert_eq!(answer.solution.pressures[beyond], 0.0, "nothing happens beyond");
    }
}

/// A well run by its rate, then by the pressure that was found at its wall, with a sink run by pressure.
fn pressure_gives_back_the_rate<const D: usize>(delaunay: Delaunay<D>, steps: usize) {
    let grid = unit_box(delaunay, steps, 0.2, 8);
    let make = |name: &str, x: f64, control: Control| Well {
        name: name.to_string(),
        place: [x; D],
        control,
        radius: Some(1e-3),
    };
    let sink = make("sink", 0.75, Control::Pressure(-2.0));
    let run = |control: Control| {
        let wells = vec![make("source", 0.25, control), sink.clone()];
        let problem = Problem { wells, ..Problem::default() };
        let setting = Setting::new(&problem, &grid).unwrap();
        let answer = solve(&grid, &setting, &DgOptions::default(), &mut Silent).unwrap();
        let solution = answer.solution;
        assert!(solution.balance(&grid).relative_error() <= 1e-10);
        assert!(solution.pinned.is_empty());
        solution
    };
    let by_rate = run(Control::Rate(1.7));
    assert!((by_rate.wells[1].rate + 1.7).abs() < 1e-10, "{:?}", by_rate.wells);
    let by_pressure = run(Control::Pressure(by_rate.wells[0].wall_pressure.unwrap()));
    assert!((by_pressure.wells[0].rate - 1.7).abs() < 1e-9, "{:?}", by_pressure.wells);
    assert_eq!(by_pressure.wells[1].wall_pressure, Some(-2.0));
}

#[test]
fn a_well_run_by_pressure_gives_back_the_rate() {
    // at a point of the mesh, which many cells share, and in the midst of one
    pressure_gives_back_the_rate(Delaunay::<2>::new(), 8);
    pressure_gives_back_the_rate(Delaunay::<3>::new(), 4);
}

#[test]
fn a_closed_box_balances_and_its_pressure_is_nought_in_the_mean_of_a_cell() {
    let grid = unit_box(Delaunay::<2>::new(), 8, 0.2, 8);
    let make = |name: &str, x: f64, rate: f64| Well {
        name: name.to_string(),
        place: [x, 0.5],
        control: Control::Rate(rate),
        radius: None,
    };
    let wells = vec![make("source", 0.21, 3.0), make("sink", 0.77, -3.0)];
    let problem = Problem { wells, ..Problem::default() };
    let setting = Setting::new(&problem, &grid).unwrap();
    for (form, order) in SCHEMES {
        let options = DgOptions { form, order, ..DgOptions::default() };
        let solution = solve(&grid, &setting, &options, &mut Silent).unwrap().solution;
        let balance = solution.balance(&grid);
        assert!(balance.relative_error() <= 1e-10, "{balance:?}");
        assert_eq!(solution.pinned, [1]);
        assert!(solution.pressures[0].abs() <= 1e-12, "{}", solution.pressures[0]);
        assert_eq!(solution.wells[0].wall_pressure, None);
        assert!(solution.wells[0].cell_pressure > solution.wells[1].cell_pressure);
    }
}

#[test]
fn a_well_without_a_radius_cannot_be_run_by_pressure() {
    let grid = unit_box(Delaunay::<2>::new(), 4, 0.2, 8);
    let wells = vec![Well { radius: None, ..well(&grid, [0.5, 0.5], Control::Pressure(1.0)) }];
    let problem = Problem { wells, ..Problem::default() };
    let setting = Setting::new(&problem, &grid).unwrap();
    let error = solve(&grid, &setting, &DgOptions::default(), &mut Silent).unwrap_err();
    assert!(matches!(error, FlowError::WellRadius { .. }), "{error}");
}
