//! The slit through which nothing flows, in uniform flow across it.

use atomesh::geometry::{Bounds, Point};
use atomesh::mesh::Delaunay;
use atomesh::watch::Silent;

use super::super::*;
use crate::problem::{Barrier, Boundary, Condition, Problem, Value};
use crate::test_meshes::{connect, jittered_points, name_inner_facets};

/// Pressure around the slit −1…1 on the x axis, in flow of rate 1 along y: p = −Im √(z² − 1), cut along the slit.
fn exact(x: &Point<2>) -> f64 {
    // √(z − 1) √(z + 1), each with the cut along −x: together cut along the slit alone
    let root = |re: f64, im: f64| {
        let (radius, angle) = (re.hypot(im).sqrt(), 0.5 * im.atan2(re));
        (radius * angle.cos(), radius * angle.sin())
    };
    let ((a, b), (c, d)) = (root(x[0] - 1.0, x[1]), root(x[0] + 1.0, x[1]));
    -(a * d + b * c)
}

/// The relative error in L² of the jump across the slit, which is 2√(1 − x²), with cells of size `size`.
fn jump_error(size: f64, options: &DgOptions) -> f64 {
    let half = 2.0;
    let steps = (2.0 * half / size).round() as usize;
    let bounds = Bounds { min: [-half; 2], max: [half; 2] };
    let mut points = jittered_points(&bounds, [steps; 2], 0.2, 21);
    // the row of points nearest to the slit becomes it
    for point in points.iter_mut().filter(|x| x[1].abs() < 0.3 * size && x[0].abs() < half) {
        point[1] = 0.0;
        if point[0].abs() > 1.0 - 0.5 * size && point[0].abs() < 1.0 + 0.5 * size {
            point[0] = point[0].signum();
        }
    }
    let mut grid = connect(Delaunay::<2>::new(), &points);
    name_inner_facets(&mut grid, "slit", |x| x[1] == 0.0 && x[0].abs() <= 1.0);
    let slit = grid.sets().last().unwrap().facets.clone();
    let length: f64 = slit.iter().map(|&f| grid.facets()[f as usize].measure()).sum();
    assert!((length - 2.0).abs() < 1e-12, "edges follow the slit: {length}");
    let boundary = |side: &str| Boundary {
        group: side.to_string(),
        condition: Condition::Pressure(Value::Field(&exact)),
    };
    let problem = Problem {
        boundaries: ["xmin", "xmax", "ymin", "ymax"].map(boundary).to_vec(),
        barriers: vec![Barrier { group: "slit".to_string(), multiplier: 0.0 }],
        ..Problem::default()
    };
    let setting = Setting::new(&problem, &grid).unwrap();
    let answer = solve(&grid, &setting, options, &mut Silent).unwrap();
    assert_eq!(answer.solution.leak(&grid, &setting), 0.0);
    assert!(answer.solution.balance(&grid).relative_error() <= 1e-10);
    let (mut error, mut norm) = (0.0, 0.0);
    for &number in &slit {
        let facet = &grid.facets()[number as usize];
        let corners = grid.facet_corners(number as usize).unwrap();
        let [a, b] = corners.map(|c| grid.mesh().unwrap().points()[c as usize][0]);
        for node in 0..20 {
            let place = [a + (b - a) * (f64::from(node) + 0.5) / 20.0, 0.0];
            let at = |cell: u32| answer.pressure(cell as usize, &place);
            let jump = (at(facet.cell) - at(facet.neighbour.unwrap())).abs();
            let expected = 2.0 * (1.0 - place[0] * place[0]).sqrt();
            error += facet.measure() * (jump - expected).powi(2);
            norm += facet.measure() * expected * expected;
        }
    }
    (error / norm).sqrt()
}

#[test]
fn the_jump_across_a_slit_is_within_two_percent() {
    let default = DgOptions::default();
    for (form, order) in super::SCHEMES.into_iter().filter(|scheme| scheme.1 <= 2) {
        let error = jump_error(0.05, &DgOptions { form, order, ..default });
        assert!(error < 0.02, "{form:?} {order}: {error}");
        if (form, order) == (default.form, default.order) {
            assert!(error < 0.003, "by default: {error}");
        }
    }
}

#[test]
fn the_default_order_does_more_with_fewer_unknowns() {
    let linear = DgOptions { order: 1, ..DgOptions::default() };
    assert!(jump_error(0.1, &DgOptions::default()) < jump_error(0.05, &linear));
}

#[test]
fn the_jump_across_a_slit_is_best_with_the_default_penalty() {
    for order in [1, 2] {
        let error =
            |penalty: f64| jump_error(0.1, &DgOptions { order, penalty, ..DgOptions::default() });
        let default = error(DgOptions::default().penalty);
        assert!(default < error(1.0) && default < 1.01 * error(2.0) && default < error(4.0));
    }
}
