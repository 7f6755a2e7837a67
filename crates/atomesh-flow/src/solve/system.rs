//! The equations, and the report of their solution.

use atomesh::geometry::Point;

use super::error::SolveError;
use super::sparse::Sparse;
use super::vector::norm;

/// Unknowns in space beyond which the cost of factors is not even estimated.
const MOST_IN_SPACE: usize = 100_000;

/// Equations to solve.
#[derive(Clone, Copy, Debug)]
pub struct System<'a, const D: usize> {
    /// The matrix.
    pub matrix: &'a Sparse,
    /// The right-hand side.
    pub rhs: &'a [f64],
    /// Whether the matrix is symmetric and positive definite.
    pub is_symmetric: bool,
    /// The number of unknowns of a block.
    pub block: usize,
    /// The place of each block.
    pub places: &'a [Point<D>],
    /// The interpolation from a coarse space, which holds the smooth part of the solution, to all unknowns. For
    /// discontinuous Galerkin the space of continuous piecewise linear functions (Dobrev et al. 2006).
    pub coarse: Option<&'a Sparse>,
}

/// How equations were solved.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct SolveReport {
    /// The method, in words.
    pub method: &'static str,
    /// The number of unknowns.
    pub unknowns: usize,
    /// The number of entries of the matrix.
    pub nonzeros: usize,
    /// Iterations; 0 if direct.
    pub iterations: usize,
    /// ‖b − Ax‖ / ‖b‖.
    pub residual: f64,
}

impl<const D: usize> System<'_, D> {
    pub(super) fn check(&self) -> Result<(), SolveError> {
        let count = self.rhs.len();
        assert_eq!(self.matrix.row_count(), count, "a right-hand side for each row");
        assert_eq!(self.matrix.column_count(), count, "a square matrix");
        assert_eq!(self.places.len() * self.block, count, "a place for each block");
        let fits = self.coarse.is_none_or(|coarse| coarse.row_count() == count);
        assert!(fits, "a row of the coarse space for each unknown");
        for equation in 0..count {
            let values = self.matrix.row(equation).1.iter().chain(&self.rhs[equation..=equation]);
            if let Some(&value) = values.clone().find(|value| !value.is_finite()) {
                return Err(SolveError::NotFinite { equation, value });
            }
        }
        Ok(())
    }

    pub(super) fn may_be_direct(&self) -> bool {
        let most = if self.sweeps_may_fail() { 10 * MOST_IN_SPACE } else { MOST_IN_SPACE };
        D == 2 || self.rhs.len() <= most
    }

    /// Sweeps over blocks need positive definite blocks on the diagonal. Those of Oden, Babuška and Baumann's form are
    /// nearly skew, and iteration was seen to stall.
    pub(super) fn sweeps_may_fail(&self) -> bool {
        !self.is_symmetric && self.block > 1
    }

    pub(super) fn report(
        &self,
        method: &'static str,
        iterations: usize,
        residual: f64,
    ) -> SolveReport {
        let (unknowns, nonzeros) = (self.rhs.len(), self.matrix.entry_count());
        SolveReport { method, unknowns, nonzeros, iterations, residual }
    }

    /// ‖b − Ax‖ / ‖b‖, with b − Ax.
    pub(super) fn residual(&self, x: &[f64]) -> (f64, Vec<f64>) {
        let mut residual = vec![0.0; x.len()];
        self.matrix.residual(self.rhs, x, &mut residual);
        (norm(&residual) / norm(self.rhs), residual)
    }
}
