//! Sparse linear equations: direct where that is fast, preconditioned iteration beyond.
//!
//! The unknowns come in blocks of one size, those of a cell, and each block has a place, by which the direct solver
//! orders them (nested dissection, George 1973). Symmetric equations are solved by a Cholesky factor or conjugate
//! gradients, others by LU or BiCGSTAB. Iteration is preconditioned by algebraic multigrid where a block is one
//! unknown, by sweeps over blocks and a correction in the coarse space where it is more. Whatever the way, the
//! residual is computed from the answer, and one that is large is an error.

mod aggregate;
mod blocks;
mod direct;
mod krylov;
mod multigrid;
mod order;
mod sparse;
mod two_level;
#[cfg(test)]
mod tests;
mod vector;

pub use order::Elimination;
pub use sparse::Sparse;

use std::borrow::Cow;

use atomesh::geometry::Point;
use atomesh::watch::{Cancelled, Phase, Watch, check};

use direct::Factors;
use krylov::{Goal, Preconditioner, bicgstab, conjugate_gradients};
use multigrid::Multigrid;
use two_level::TwoLevel;
use vector::norm;

/// A larger residual is no answer, whatever the reason.
const ACCEPTED: f64 = 1e-8;
/// Multiplications that factors of equations in space may take before iteration is tried first.
const WORK: f64 = 2e10;
/// Equations in space beyond which factors are not even counted.
const MOST_IN_SPACE: usize = 100_000;
/// Steps of refinement after a direct solution.
const REFINEMENTS: usize = 3;

/// Equations to solve.
#[derive(Clone, Copy, Debug)]
pub struct System<'a, const D: usize> {
    /// The matrix.
    pub matrix: &'a Sparse,
    /// The right-hand side.
    pub rhs: &'a [f64],
    /// Whether the matrix is symmetric and positive definite.
    pub is_symmetric: bool,
    /// How many unknowns a block has.
    pub block: usize,
    /// The place of each block.
    pub places: &'a [Point<D>],
    /// A space of fewer unknowns that holds the smooth part of the answer: the columns interpolate from it to all
    /// unknowns. For discontinuous Galerkin the continuous piecewise linear functions (Dobrev et al. 2006).
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

/// Which way to solve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Method {
    /// Direct if the factors are expected to be small, else iterative.
    #[default]
    Auto,
    /// Sparse Cholesky or LU factors.
    Direct,
    /// Conjugate gradients, or BiCGSTAB where the matrix is not symmetric, preconditioned.
    Iterative,
}

/// Options of [`solve`].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SolveOptions {
    /// Which way.
    pub method: Method,
    /// Iteration ends when ‖b − Ax‖ ≤ tolerance ‖b‖. Default 10⁻¹², so that mass balances to 10⁻¹⁰.
    pub tolerance: f64,
    /// Iteration fails after so many. Default 2000.
    pub limit: usize,
    /// The most bytes that factors may take. Default 8 GiB.
    pub memory: u64,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self { method: Method::Auto, tolerance: 1e-12, limit: 2000, memory: 8 << 30 }
    }
}

/// Why equations were not solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// The factors do not exist, or hold values that are not finite.
    #[error("the {unknowns} equations have no unique answer (pivot {at})")]
    Singular {
        /// The number of unknowns.
        unknowns: usize,
        /// The unknown at which that was seen.
        at: usize,
    },
    /// The factors would take too much memory.
    #[error(
        "the factors of {unknowns} equations do not fit into memory; expected fewer, or the iterative method"
    )]
    Memory {
        /// The number of unknowns.
        unknowns: usize,
    },
    /// Iteration came to its limit.
    #[error(
        "{method} left a residual of {residual:.1e} after {iterations} iterations; expected {tolerance:.1e}"
    )]
    NotConverged {
        /// The method.
        method: &'static str,
        /// How many iterations.
        iterations: usize,
        /// ‖b − Ax‖ / ‖b‖.
        residual: f64,
        /// The residual asked for.
        tolerance: f64,
    },
    /// An equation holds a value that is not finite.
    #[error("equation {equation} holds {value}; expected finite numbers")]
    NotFinite {
        /// The row.
        equation: usize,
        /// The value.
        value: f64,
    },
    /// The watch ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Solves the equations; the same bits at any number of threads.
///
/// [`Method::Auto`] takes factors in the plane, in space while they take little work, and wherever blocks of several unknowns
/// are not symmetric, as long as they fit into memory; else iteration, and factors after all where that fails.
///
/// # Errors
/// [`SolveError`].
///
/// # Panics
/// If the matrix is not square, or right-hand side, places or coarse space do not fit it.
pub fn solve<const D: usize>(
    system: &System<'_, D>,
    options: &SolveOptions,
    watch: &mut dyn Watch,
) -> Result<(Vec<f64>, SolveReport), SolveError> {
    system.check()?;
    check(watch, Phase::Solve, 0.0, None)?;
    if system.rhs.iter().all(|&b| b == 0.0) {
        let x = vec![0.0; system.rhs.len()];
        return Ok((x, system.report("none: nothing flows", 0, 0.0)));
    }
    let order = || {
        let limit = options.memory as f64 / 8.0;
        Elimination::new(system.matrix, system.block, system.places, (!system.is_symmetric, limit))
    };
    match options.method {
        Method::Direct => direct(system, &order(), options, watch),
        Method::Iterative => iterate(system, options, watch),
        Method::Auto => {
            let fits = |order: &Elimination| {
                Factors::bytes(order, system.is_symmetric) <= options.memory as f64
            };
            let is_cheap =
                |order: &Elimination| D == 2 || system.sweeps_may_fail() || order.work <= WORK;
            let planned = system.may_be_direct().then(order);
            if let Some(order) = planned.filter(|order| fits(order) && is_cheap(order)) {
                return direct(system, &order, options, watch);
            }
            let error = match iterate(system, options, watch) {
                Err(error @ SolveError::NotConverged { .. }) => error,
                other => return other,
            };
            let order = order();
            if fits(&order) { direct(system, &order, options, watch) } else { Err(error) }
        }
    }
}

impl<const D: usize> System<'_, D> {
    fn check(&self) -> Result<(), SolveError> {
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

    fn may_be_direct(&self) -> bool {
        let most = if self.sweeps_may_fail() { 10 * MOST_IN_SPACE } else { MOST_IN_SPACE };
        D == 2 || self.rhs.len() <= most
    }

    /// Sweeps over blocks need the blocks on the diagonal to be positive definite. Those of Oden, Babuška and Baumann's form
    /// are nearly skew, and iteration was seen to stall.
    fn sweeps_may_fail(&self) -> bool {
        !self.is_symmetric && self.block > 1
    }

    fn report(&self, method: &'static str, iterations: usize, residual: f64) -> SolveReport {
        let (unknowns, nonzeros) = (self.rhs.len(), self.matrix.entry_count());
        SolveReport { method, unknowns, nonzeros, iterations, residual }
    }

    /// ‖b − Ax‖ / ‖b‖, with b − Ax.
    fn residual(&self, x: &[f64]) -> (f64, Vec<f64>) {
        let mut residual = vec![0.0; x.len()];
        self.matrix.residual(self.rhs, x, &mut residual);
        (norm(&residual) / norm(self.rhs), residual)
    }
}

fn direct<const D: usize>(
    system: &System<'_, D>,
    order: &Elimination,
    options: &SolveOptions,
    watch: &mut dyn Watch,
) -> Result<(Vec<f64>, SolveReport), SolveError> {
    check(watch, Phase::Solve, 0.1, None)?;
    let mut factors = Factors::new(system.matrix, order, system.is_symmetric, options.memory)?;
    check(watch, Phase::Solve, 0.9, None)?;
    let mut x = system.rhs.to_vec();
    factors.solve(&mut x);
    let (mut residual, mut rest) = system.residual(&x);
    for _ in 0..REFINEMENTS {
        if residual <= options.tolerance || !residual.is_finite() {
            break;
        }
        factors.solve(&mut rest);
        let better: Vec<f64> = x.iter().zip(&rest).map(|(x, change)| x + change).collect();
        let (next, left) = system.residual(&better);
        if next >= residual || next.is_nan() {
            break;
        }
        (x, residual, rest) = (better, next, left);
    }
    if residual <= ACCEPTED {
        return Ok((x, system.report(factors.name(), 0, residual)));
    }
    let worst = |a: &usize, b: &usize| rest[*a].abs().total_cmp(&rest[*b].abs());
    let at = (0..rest.len()).max_by(worst).unwrap_or(0);
    Err(SolveError::Singular { unknowns: rest.len(), at })
}

fn iterate<const D: usize>(
    system: &System<'_, D>,
    options: &SolveOptions,
    watch: &mut dyn Watch,
) -> Result<(Vec<f64>, SolveReport), SolveError> {
    let scalar = system.block == 1 && system.coarse.is_none();
    let mut inverse: Box<dyn Preconditioner + '_> = if scalar {
        let matrix = Cow::Borrowed(system.matrix);
        Box::new(Multigrid::new(matrix, system.places, system.is_symmetric))
    } else {
        Box::new(TwoLevel::new(system)?)
    };
    let goal = Goal { tolerance: options.tolerance, limit: options.limit };
    let (run, method) = match (system.is_symmetric, scalar) {
        (true, true) => (conjugate_gradients as krylov::Solver, "conjugate gradients, multigrid"),
        (true, false) => (conjugate_gradients as krylov::Solver, "conjugate gradients, two levels"),
        (false, true) => (bicgstab as krylov::Solver, "BiCGSTAB, multigrid"),
        (false, false) => (bicgstab as krylov::Solver, "BiCGSTAB, two levels"),
    };
    let found = run(system.matrix, system.rhs, &mut *inverse, goal, watch)?;
    let (residual, _) = system.residual(&found.x);
    if residual <= options.tolerance.max(ACCEPTED) {
        return Ok((found.x, system.report(method, found.iterations, residual)));
    }
    let (iterations, tolerance) = (found.iterations, options.tolerance);
    Err(SolveError::NotConverged { method, iterations, residual, tolerance })
}
