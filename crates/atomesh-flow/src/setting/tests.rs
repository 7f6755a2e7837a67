use atomesh::geometry::Bounds;
use atomesh::mesh::{FacetGroup, Mesh, Tags};

use super::*;
use crate::problem::{Barrier, Boundary, Value, Well};

/// A unit square of 2 × n triangles, cut at x = 1/2 by the group `wall`.
fn strip() -> FlowGrid<2> {
    let points = (0..6).map(|i| [0.5 * f64::from(i / 2), f64::from(i % 2)]).collect();
    let mesh = Mesh::new(points, vec![0, 2, 1, 2, 3, 1, 2, 4, 3, 4, 5, 3]).unwrap();
    let wall = FacetGroup { id: 9, name: "wall".to_string(), facets: vec![[2, 3]] };
    let bounds = Bounds::of(mesh.points()).unwrap();
    let tags = Tags::sides(&mesh, &bounds, 1e-9)
        .merge(Tags::new(&mesh, vec![wall], None).unwrap())
        .unwrap();
    FlowGrid::of_mesh(&mesh, &tags)
}

fn well(name: &str, x: f64, rate: f64) -> Well<2> {
    let control = Control::Rate(rate);
    Well { name: name.to_string(), place: [x, 0.4], control, radius: None }
}

fn sealed() -> Vec<Barrier> {
    vec![Barrier { group: "wall".to_string(), multiplier: 0.0 }]
}

#[test]
fn sealed_barriers_part_the_grid() {
    let problem = Problem { barriers: sealed(), ..Problem::default() };
    let grid = strip();
    let setting = Setting::new(&problem, &grid).unwrap();
    assert_eq!(setting.compartment_of(), [0, 0, 1, 1]);
    assert_eq!(setting.pinned().collect::<Vec<_>>(), [(0, 0), (1, 2)]);
    assert!((setting.compartments()[1].measure - 0.5).abs() < 1e-15);
}

#[test]
fn nothing_is_driven_where_barriers_part_pressures_that_differ() {
    let fixed = |group: &str, pressure| Boundary {
        group: group.to_string(),
        condition: Condition::Pressure(Value::Constant(pressure)),
    };
    let is_driven = |right: f64, barriers, wells| {
        let boundaries = vec![fixed("xmin", 1.0), fixed("xmax", right)];
        let problem = Problem { boundaries, barriers, wells, ..Problem::default() };
        Setting::new(&problem, &strip()).unwrap().is_driven()
    };
    assert!(is_driven(0.0, Vec::new(), Vec::new()));
    assert!(!is_driven(1.0, Vec::new(), Vec::new()));
    assert!(!is_driven(0.0, sealed(), Vec::new()));
    assert!(is_driven(0.0, sealed(), vec![well("source", 0.1, 1.0)]));
}

#[test]
fn a_compartment_whose_rates_do_not_balance_is_named() {
    let wells = vec![well("source", 0.1, 1.0), well("sink", 0.9, -1.0)];
    let open = Problem { wells: wells.clone(), ..Problem::default() };
    assert!(Setting::new(&open, &strip()).is_ok());
    let parted = Problem { wells, barriers: sealed(), ..Problem::default() };
    let error = Setting::new(&parted, &strip()).unwrap_err();
    assert!(matches!(error, FlowError::Unbalanced { compartment: 1, cells: 2, .. }));
    let text = error.to_string();
    assert!(text.contains("source") && !text.contains("sink"), "{text}");
}

#[test]
fn a_pressure_on_a_side_frees_the_rates_of_its_compartment_alone() {
    let fixed = |group: &str| Boundary {
        group: group.to_string(),
        condition: Condition::Pressure(Value::Constant(1.0)),
    };
    let problem = |group: &str| Problem {
        wells: vec![well("source", 0.1, 1.0)],
        barriers: sealed(),
        boundaries: vec![fixed(group)],
        ..Problem::default()
    };
    assert!(Setting::new(&problem("xmin"), &strip()).is_ok());
    assert!(Setting::new(&problem("xmax"), &strip()).is_err(), "beyond the wall");
}

#[test]
fn a_well_on_a_barrier_flows_to_one_side() {
    let problem = Problem {
        wells: vec![Well { place: [0.5, 0.5], ..well("source", 0.5, 0.0) }],
        barriers: sealed(),
        ..Problem::default()
    };
    let setting = Setting::new(&problem, &strip()).unwrap();
    assert_eq!(setting.wells()[0].cells, [1]);
    let open = Problem { barriers: vec![], ..problem };
    assert_eq!(Setting::new(&open, &strip()).unwrap().wells()[0].cells, [1, 2]);
}

#[test]
fn what_is_not_there_is_named() {
    let grid = strip();
    let fails = |problem: Problem<'_, 2>| Setting::new(&problem, &grid).unwrap_err().to_string();
    let barrier = |group: &str, multiplier: f64| Problem {
        barriers: vec![Barrier { group: group.to_string(), multiplier }],
        ..Problem::default()
    };
    assert!(fails(barrier("fault", 0.0)).contains("xmin, xmax, ymin, ymax, wall"));
    assert!(fails(barrier("wall", 1.5)).contains("1.5"));
    assert!(fails(barrier("xmin", 0.5)).contains("boundary"));
    let outside = Problem { wells: vec![well("far", 3.0, 0.0)], ..Problem::default() };
    assert!(fails(outside).contains("far"));
    let odd = Problem { wells: vec![well("odd", 0.1, f64::NAN)], ..Problem::default() };
    assert!(fails(odd).contains("NaN"));
    let inner = Boundary {
        group: "wall".to_string(),
        condition: Condition::Pressure(Value::Constant(0.0)),
    };
    let inside = Problem { boundaries: vec![inner], ..Problem::default() };
    assert!(fails(inside).contains("inside"));
}
