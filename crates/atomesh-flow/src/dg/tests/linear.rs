//! Linear pressures are exact.

use atomesh::geometry::{Point, dot};
use atomesh::mesh::Delaunay;
use atomesh::watch::Silent;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::super::interface::product;
use super::super::*;
use crate::permeability::{Permeability, Tensor};
use crate::problem::{Boundary, Condition, Problem, Value};
use crate::test_meshes::unit_box;

/// A symmetric tensor with principal values of some 0.01 to 100: A Aᵀ + 0.01.
pub(super) fn random_tensor<const D: usize>(seed: u64) -> Tensor<D> {
    let mut random = Pcg64::seed_from_u64(seed);
    let a: Tensor<D> =
        std::array::from_fn(|_| std::array::from_fn(|_| 5.0 * random.random_range(-1.0..1.0)));
    std::array::from_fn(|i| {
        std::array::from_fn(|j| dot(&a[i], &a[j]) + if i == j { 0.01 } else { 0.0 })
    })
}

/// p = 3 + g·x, pressure given on all sides, or on the first with the flux on the others.
fn linear_is_exact<const D: usize>(delaunay: Delaunay<D>, steps: usize, orders: &[(Form, usize)]) {
    for (seed, mixed) in [(1, false), (2, true)] {
        let grid = unit_box(delaunay, steps, 0.3, seed);
        let tensor = random_tensor::<D>(seed + 10);
        let slope: Point<D> = std::array::from_fn(|axis| 1.0 - 0.7 * axis as f64);
        let exact = |x: &Point<D>| 3.0 + dot(&slope, x);
        let flow = product(&tensor, &slope);
        let sides = ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"].iter().take(2 * D);
        let boundary = |(side, name): (usize, &&str)| {
            let outward = if side % 2 == 0 { -1.0 } else { 1.0 };
            let condition = match mixed && side > 0 {
                true => Condition::Flux(Value::Constant(outward * flow[side / 2])),
                false => Condition::Pressure(Value::Field(&exact)),
            };
            Boundary { group: name.to_string(), condition }
        };
        let problem = Problem {
            permeability: Permeability::UniformTensor(tensor),
            boundaries: sides.enumerate().map(boundary).collect(),
            ..Problem::default()
        };
        let setting = Setting::new(&problem, &grid).unwrap();
        let through: f64 = flow.iter().map(|x| x.abs()).sum();
        for &(form, order) in orders {
            let options = DgOptions { form, order, ..DgOptions::default() };
            let answer = solve(&grid, &setting, &options, &mut Silent).unwrap();
            let what = format!("{D}-D {form:?} {order} mixed {mixed}");
            let (error, norm) = answer.l2_distance(&grid, |_| true, exact);
            assert!(error <= 1e-11 * norm, "{what}: {:e}", error / norm);
            let solution = &answer.solution;
            for (facet, flux) in grid.facets().iter().zip(&solution.fluxes) {
                let expected = -dot(&facet.area, &flow);
                assert!((flux - expected).abs() <= 1e-11 * through, "{what}: {flux} {expected}");
            }
            let gradient = answer.gradient(0, &grid.centroids()[0]);
            let away = (0..D).map(|k| (gradient[k] - slope[k]).abs()).fold(0.0, f64::max);
            assert!(away <= 1e-10, "{what}: {gradient:?}");
            assert!(solution.balance(&grid).relative_error() <= 1e-11, "{what}");
        }
    }
}

#[test]
fn a_linear_pressure_is_exact_for_any_tensor() {
    use Form::{InteriorPenalty as Sipg, OdenBabuskaBaumann as Obb};
    let all = [(Sipg, 1), (Sipg, 2), (Sipg, 3), (Obb, 2), (Obb, 3)];
    linear_is_exact(Delaunay::<2>::new(), 6, &all);
    linear_is_exact(Delaunay::<3>::new(), 2, &all);
}
