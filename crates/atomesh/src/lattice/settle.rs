//! Letting atoms settle between their neighbours, without an energy.
//!
//! An atom goes to the mean of the centroids of its cells, each weighted by its measure over d^(D + 1):
//! centroidal patches (Chen & Holst 2011), graded. Cells where d is large weigh no more than those where
//! it is small, so that a graded lattice stays graded. Atoms that the box or a temperature holds stay. A
//! few sweeps over one mesh do most of what there is to gain. Cost: O(atoms) a sweep, and one mesh.

use crate::parallel::prelude::*;

use super::{Lattice, LatticeError, Scatterer};
use crate::fields::NominalDistance;
use crate::geometry::{Point, Simplex};
use crate::watch::{Phase, Watch, check};

/// Moves atoms to where their cells are more alike; `sweeps` times.
///
/// # Errors
/// [`LatticeError`] if atoms coincide or the work was cancelled.
pub fn settle<const D: usize>(
    scatterer: &Scatterer<D>,
    lattice: Lattice<D>,
    distance: &NominalDistance<D>,
    sweeps: usize,
    watch: &mut dyn Watch,
) -> Result<Lattice<D>, LatticeError> {
    let (mut atoms, corners) = scatterer.connect(lattice.atoms(), watch)?.into_parts();
    let moves = |i: usize| (0..D).all(|k| lattice.mobility(i, k) == 1.0);
    for sweep in 0..sweeps {
        check(watch, Phase::Grow, sweep as f64 / sweeps as f64, None)?;
        let pulls: Vec<(Point<D>, f64)> =
            corners.par_chunks_exact(D + 1).map(|cell| pull(cell, &atoms, distance)).collect();
        // added in the order of cells, whatever threads made them
        let mut sums = vec![([0.0; D], 0.0); atoms.len()];
        for (cell, (centroid, weight)) in corners.chunks_exact(D + 1).zip(&pulls) {
            for &corner in cell {
                let (sum, weights) = &mut sums[corner as usize];
                for k in 0..D {
                    sum[k] += weight * centroid[k];
                }
                *weights += weight;
            }
        }
        for (i, (sum, weights)) in sums.iter().enumerate() {
            if *weights > 0.0 && moves(i) {
                atoms[i] = sum.map(|x| x / weights);
            }
        }
    }
    Ok(lattice.moved_to(atoms))
}

/// The centroid of a cell, and its weight.
fn pull<const D: usize>(
    cell: &[u32],
    atoms: &[Point<D>],
    distance: &NominalDistance<D>,
) -> (Point<D>, f64) {
    let at = |k: usize| atoms[cell[k] as usize];
    let simplex = Simplex { first: at(0), others: std::array::from_fn(|k| at(k + 1)) };
    let centroid: Point<D> =
        std::array::from_fn(|k| (0..=D).map(|corner| at(corner)[k]).sum::<f64>() / (D + 1) as f64);
    let d = distance.at(&centroid);
    // over the least d, since a power may overflow; an inverted cell has weight 0
    let weight = simplex.measure().max(0.0) / (d / distance.least()).powi(D as i32 + 1);
    (centroid, weight)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{difference, distance_squared};
    use crate::image::Grid;
    use crate::lattice::{Crystal, GrowOptions, fill_holes, grow};
    use crate::watch::Silent;

    const GRID: Grid<2> = Grid { shape: [121, 91], step: [1.0; 2] };

    fn grown(distance: &NominalDistance<2>) -> Lattice<2> {
        let (crystal, options) = (Crystal::hexagonal(), GrowOptions::default());
        grow(&crystal, GRID.bounds(), distance, &options, &mut Silent).unwrap()
    }

    /// d from 2 to 8 with slopes of up to 0.2.
    fn graded() -> NominalDistance<2> {
        let field: Vec<f32> = (0..GRID.sample_count())
            .map(|i| {
                let [x, y] = [(i % 121) as f32 / 20.0, (i / 121) as f32 / 20.0];
                5.0 + 3.0 * x.sin() * y.cos()
            })
            .collect();
        NominalDistance::from_field(&GRID, &field, 0.2).unwrap()
    }

    /// The mean of 4√3 area / Σ edge², 1 for equilateral triangles.
    fn shape(lattice: &Lattice<2>) -> f64 {
        let mesh = Scatterer::<2>::new().connect(lattice.atoms(), &mut Silent).unwrap();
        let squares = |s: &Simplex<2>| {
            let [a, b] = s.others;
            distance_squared(&a, &s.first)
                + distance_squared(&b, &s.first)
                + distance_squared(&a, &b)
        };
        let sum: f64 = mesh.simplices().map(|s| 48f64.sqrt() * s.measure() / squares(&s)).sum();
        sum / mesh.cell_count() as f64
    }

    #[test]
    fn filled_and_settled_a_graded_lattice_has_its_atoms_and_better_cells() {
        let (distance, scatterer) = (graded(), Scatterer::<2>::new());
        let expected = distance.estimated_atoms(Crystal::hexagonal().density());
        let lattice = grown(&distance);
        let (few, before) = (lattice.len() as f64 / expected, shape(&lattice));
        let filled = fill_holes(&scatterer, lattice, &distance, 20, &mut Silent).unwrap();
        let again = fill_holes(&scatterer, filled.clone(), &distance, 1, &mut Silent).unwrap();
        assert_eq!(filled.len(), again.len(), "a hole was left");
        // the boundary's atoms count half in the integral: 300 / 2.5 of some 700 are on it, two by two
        let many = filled.len() as f64 / expected;
        assert!(few < 0.97 * many && (0.97..1.15).contains(&many), "{few} {many}");
        let settled = settle(&scatterer, filled.clone(), &distance, 3, &mut Silent).unwrap();
        let (between, after) = (shape(&filled), shape(&settled));
        assert!(before < between && between < after && after > 0.965, "{before} {between} {after}");
        for (i, (p, q)) in filled.atoms().iter().zip(settled.atoms()).enumerate() {
            let held = (0..2).any(|k| filled.mobility(i, k) == 0.0);
            assert!(!held || p == q, "{p:?} is held, and went to {q:?}");
        }
    }

    #[test]
    fn a_perfect_crystal_stays() {
        let distance = NominalDistance::constant(&GRID, 6.0).unwrap();
        let (lattice, scatterer) = (grown(&distance), Scatterer::<2>::new());
        let settled = settle(&scatterer, lattice.clone(), &distance, 1, &mut Silent).unwrap();
        let max = GRID.bounds().max;
        for (p, q) in lattice.atoms().iter().zip(settled.atoms()) {
            if (0..2).all(|k| p[k] > 9.0 && p[k] < max[k] - 9.0) {
                let v = difference(p, q);
                // coordinates are multiples of 2⁻¹⁴: half of that for each neighbour
                assert!(v[0].abs() < 1e-4 && v[1].abs() < 1e-4, "{p:?} went to {q:?}");
            }
        }
    }

    #[test]
    fn bits_do_not_depend_on_the_number_of_threads() {
        let (distance, scatterer) = (graded(), Scatterer::<2>::new());
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let filled = fill_holes(&scatterer, grown(&distance), &distance, 2, &mut Silent);
                settle(&scatterer, filled.unwrap(), &distance, 3, &mut Silent).unwrap()
            })
        };
        assert_eq!(run(1).atoms(), run(3).atoms());
    }
}
