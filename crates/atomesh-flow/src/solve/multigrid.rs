//! Algebraic multigrid by smoothed aggregation (Vaněk, Mandel & Brezina 1996), a V-cycle as preconditioner.
//!
//! Strongly coupled unknowns form aggregates, each one unknown of the next level. The piecewise constant interpolation is
//! smoothed by a Jacobi step to P, and the next level's matrix is `PᵀAP`. A cycle is a forward
//! Gauss–Seidel sweep, the correction by the next level, and a backward sweep: symmetric if A is. The
//! last level is solved by factors. Assumes that constants are nearly in the matrix's null space, as they are for
//! flow. Cost of a cycle: O(entries), about four products with A.

use std::borrow::Cow;

use atomesh::geometry::Point;

use super::aggregate::{aggregates, smoothed};
use super::direct::Factors;
use super::krylov::Preconditioner;
use super::order::Elimination;
use super::sparse::Sparse;

/// The most unknowns of a level that is solved by factors.
const COARSEST: usize = 1000;
/// The most levels. A level that cannot be reduced to this share of its unknowns is the last.
const LEVELS: usize = 25;
const SHRINKS: f64 = 0.8;
/// The most bytes that factors of the last level may take.
const MEMORY: u64 = 1 << 30;

/// The levels.
pub struct Multigrid<'a> {
    levels: Vec<Level<'a>>,
    last: Last<'a>,
}

struct Level<'a> {
    smoother: Sweeps<'a>,
    prolong: Sparse,
    restrict: Sparse,
    /// Residual, and the next level's right-hand side and answer.
    residual: Vec<f64>,
    below: (Vec<f64>, Vec<f64>),
}

/// How the last level is solved: by factors, or by sweeps where there are none.
enum Last<'a> {
    Factors(Box<Factors>),
    Sweeps(Sweeps<'a>),
}

impl<'a> Multigrid<'a> {
    /// Makes the levels of a square matrix. There is a place for each unknown, by which the last level is ordered.
    pub fn new<const D: usize>(
        matrix: Cow<'a, Sparse>,
        places: &[Point<D>],
        is_symmetric: bool,
    ) -> Self {
        let mut levels = Vec::new();
        let mut matrix = matrix;
        let mut places = Cow::Borrowed(places);
        while matrix.row_count() > COARSEST && levels.len() < LEVELS {
            let joined = aggregates(&matrix, levels.len());
            if joined.count as f64 > SHRINKS * matrix.row_count() as f64 {
                break;
            }
            let prolong = smoothed(&matrix, &joined, levels.len());
            let restrict = prolong.transpose();
            let next = restrict.product(&matrix.product(&prolong));
            places = Cow::Owned(means(&restrict, &places));
            let zeros = |count: usize| vec![0.0; count];
            let below = (zeros(next.row_count()), zeros(next.row_count()));
            let residual = zeros(matrix.row_count());
            let smoother = Sweeps::new(matrix);
            levels.push(Level { smoother, prolong, restrict, residual, below });
            matrix = Cow::Owned(next);
        }
        let last = Last::new(matrix, &places, is_symmetric);
        Self { levels, last }
    }
}

/// The place of each unknown of the next level: the mean over the unknowns that it is made of.
pub fn means<const D: usize>(restrict: &Sparse, places: &[Point<D>]) -> Vec<Point<D>> {
    let mean = |row: usize| {
        let (columns, values) = restrict.row(row);
        let whole: f64 = values.iter().map(|value| value.abs()).sum();
        let mut sum = [0.0; D];
        for (&column, value) in columns.iter().zip(values) {
            for axis in 0..D {
                sum[axis] += value.abs() * places[column as usize][axis];
            }
        }
        sum.map(|x| if whole > 0.0 { x / whole } else { 0.0 })
    };
    (0..restrict.row_count()).map(mean).collect()
}

impl<'a> Last<'a> {
    fn new<const D: usize>(
        matrix: Cow<'a, Sparse>,
        places: &[Point<D>],
        is_symmetric: bool,
    ) -> Self {
        let elimination = Elimination::new(&matrix, 1, places, !is_symmetric, MEMORY as f64);
        match Factors::new(&matrix, &elimination, is_symmetric, MEMORY) {
            Ok(factors) => Self::Factors(Box::new(factors)),
            Err(_) => Self::Sweeps(Sweeps::new(matrix)),
        }
    }

    fn solve(&mut self, b: &[f64], x: &mut [f64]) {
        match self {
            Self::Factors(factors) => {
                x.copy_from_slice(b);
                factors.solve(x);
            }
            Self::Sweeps(sweeps) => {
                sweeps.forward(b, x);
                sweeps.backward(b, x);
            }
        }
    }
}

impl Preconditioner for Multigrid<'_> {
    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        cycle(&mut self.levels, &mut self.last, r, z);
    }
}

fn cycle(levels: &mut [Level<'_>], last: &mut Last<'_>, b: &[f64], x: &mut [f64]) {
    let Some((level, coarser)) = levels.split_first_mut() else {
        return last.solve(b, x);
    };
    level.smoother.forward(b, x);
    level.smoother.matrix.residual(b, x, &mut level.residual);
    level.restrict.multiply(&level.residual, &mut level.below.0);
    cycle(coarser, last, &level.below.0, &mut level.below.1);
    level.prolong.multiply(&level.below.1, &mut level.residual);
    for (x, correction) in x.iter_mut().zip(&level.residual) {
        *x += correction;
    }
    level.smoother.backward(b, x);
}

/// Sweeps of Gauss and Seidel over the unknowns.
struct Sweeps<'a> {
    matrix: Cow<'a, Sparse>,
    /// 1 / a_ii, 0 where a_ii is 0.
    inverse: Vec<f64>,
}

impl<'a> Sweeps<'a> {
    fn new(matrix: Cow<'a, Sparse>) -> Self {
        let diagonal = matrix.diagonal();
        let inverse = diagonal.iter().map(|&a| if a == 0.0 { 0.0 } else { 1.0 / a }).collect();
        Self { matrix, inverse }
    }

    /// From x = 0, in ascending order.
    fn forward(&self, b: &[f64], x: &mut [f64]) {
        for row in 0..x.len() {
            let (columns, values) = self.matrix.row(row);
            let mut rest = b[row];
            for (&column, value) in columns.iter().zip(values) {
                if column as usize >= row {
                    break;
                }
                rest -= value * x[column as usize];
            }
            x[row] = rest * self.inverse[row];
        }
    }

    /// In descending order.
    fn backward(&self, b: &[f64], x: &mut [f64]) {
        for row in (0..x.len()).rev() {
            let (columns, values) = self.matrix.row(row);
            let mut rest = b[row];
            for (&column, value) in columns.iter().zip(values) {
                rest -= value * x[column as usize];
            }
            // `rest` includes the diagonal's term, so x is corrected
            x[row] += rest * self.inverse[row];
        }
    }
}
