//! Orders of convergence on a smooth pressure.

use atomesh::geometry::{Point, dot};
use atomesh::mesh::Delaunay;
use atomesh::watch::Silent;

use super::super::interface::product;
use super::super::*;
use crate::permeability::{Permeability, Tensor};
use crate::problem::{Boundary, Condition, Problem, Value};
use crate::test_meshes::unit_box;

/// A full tensor with principal values of 1 to 4.
fn tensor<const D: usize>() -> Tensor<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 2.0 } else { 0.7 }))
}

/// The relative error in L² of two waves, `sin(w·x) + cos(v·x)`; pressure given on all sides but the first, where the
/// flux is.
fn error<const D: usize>(delaunay: Delaunay<D>, steps: usize, options: &DgOptions) -> f64 {
    let grid = unit_box(delaunay, steps, 0.2, 5);
    let w: Point<D> = std::array::from_fn(|axis| (4.0 + 2.0 * axis as f64) / D as f64);
    let v: Point<D> = std::array::from_fn(|axis| (6.0 - 4.0 * axis as f64) / D as f64);
    let k = tensor::<D>();
    let pressure = |x: &Point<D>| dot(&w, x).sin() + dot(&v, x).cos();
    let (kw, kv) = (product(&k, &w), product(&k, &v));
    let source = |x: &Point<D>| dot(&w, &kw) * dot(&w, x).sin() + dot(&v, &kv) * dot(&v, x).cos();
    // at xmin the outward normal is −x
    let flux = |x: &Point<D>| -kw[0] * dot(&w, x).cos() + kv[0] * dot(&v, x).sin();
    let sides = ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"].iter().take(2 * D);
    let boundaries = sides.map(|&side| Boundary {
        group: side.to_string(),
        condition: match side {
            "xmin" => Condition::Flux(Value::Field(&flux)),
            _ => Condition::Pressure(Value::Field(&pressure)),
        },
    });
    let problem = Problem {
        permeability: Permeability::UniformTensor(k),
        source: Some(Value::Field(&source)),
        boundaries: boundaries.collect(),
        ..Problem::default()
    };
    let setting = Setting::new(&problem, &grid).unwrap();
    let answer = solve(&grid, &setting, options, &mut Silent).unwrap();
    let balance = answer.solution.balance(&grid);
    assert!(balance.relative_error() <= 1e-10, "{balance:?}");
    let (error, norm) = answer.l2_distance(&grid, |_| true, pressure);
    error / norm
}

/// Halving the cells divides the error by 2 to the order, within what random cells make of it: 0.2 in the exponent.
fn converges<const D: usize>(
    delaunay: Delaunay<D>,
    steps: usize,
    form: Form,
    degree: usize,
    expected: f64,
) {
    let options = DgOptions { form, order: degree, ..DgOptions::default() };
    let (coarse, fine) = (error(delaunay, steps, &options), error(delaunay, 2 * steps, &options));
    let order = (coarse / fine).log2();
    let what = format!("{D}-D {form:?} {degree}: {coarse:e} {fine:e}, order {order}");
    println!("{what}");
    assert!(order > expected - 0.2, "{what}");
}

#[test]
fn interior_penalty_gains_one_order_on_its_degree() {
    for order in 1..=3 {
        let expected = order as f64 + 1.0;
        converges(Delaunay::<2>::new(), 8, Form::InteriorPenalty, order, expected);
    }
    for order in 1..=2 {
        let expected = order as f64 + 1.0;
        converges(Delaunay::<3>::new(), 3, Form::InteriorPenalty, order, expected);
    }
}

#[test]
fn oden_babuska_and_baumann_gain_one_order_on_odd_degrees_only() {
    converges(Delaunay::<2>::new(), 8, Form::OdenBabuskaBaumann, 2, 2.0);
    converges(Delaunay::<2>::new(), 8, Form::OdenBabuskaBaumann, 3, 4.0);
    converges(Delaunay::<3>::new(), 3, Form::OdenBabuskaBaumann, 2, 2.0);
}
