//! Sparse linear equations: solved directly where that is fast, else by preconditioned iteration.
//!
//! The unknowns come in blocks of one size, those of a cell, and each block has a place, by which the direct solver
//! orders them (nested dissection, George 1973). Symmetric equations are solved by a Cholesky factor or conjugate
//! gradients, others by LU or BiCGSTAB. Iteration is preconditioned by algebraic multigrid if a block is one
//! unknown, else by sweeps over blocks and a correction in the coarse space. The residual is always computed from the
//! solution, and a large one is an error.

mod aggregate;
mod blocks;
mod direct;
mod error;
mod krylov;
mod multigrid;
mod options;
mod order;
mod sparse;
mod system;
#[cfg(test)]
mod tests;
mod two_level;
mod vector;

pub use error::SolveError;
pub use options::{SolveMethod, SolveOptions};
pub use order::Elimination;
pub use sparse::Sparse;
pub use system::{SolveReport, System};

use std::borrow::Cow;

use atomesh::watch::{Phase, Watch, check};

use direct::Factors;
use krylov::{Equations, Goal, Preconditioner, bicgstab, conjugate_gradients};
use multigrid::Multigrid;
use two_level::TwoLevel;

/// The largest residual that is accepted as a solution.
const ACCEPTED: f64 = 1e-8;
/// Multiplications for the factors of equations in space, beyond which iteration is tried first.
const WORK: f64 = 2e10;
/// Steps of refinement after a direct solution.
const REFINEMENTS: usize = 3;

/// Solves the equations; the same bits at any number of threads.
///
/// [`SolveMethod::Auto`] uses factors in the plane, in space if they take little work, and wherever blocks of several
/// unknowns are not symmetric, as long as they fit into memory. Else it iterates, and falls back on factors if that fails.
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
        Elimination::new(system.matrix, system.block, system.places, !system.is_symmetric, limit)
    };
    match options.method {
        SolveMethod::Direct => direct(system, &order(), options, watch),
        SolveMethod::Iterative => iterate(system, options, watch),
        SolveMethod::Auto => {
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
    let equations = Equations { matrix: system.matrix, rhs: system.rhs };
    let found = run(equations, &mut *inverse, goal, watch)?;
    let (residual, _) = system.residual(&found.x);
    if residual <= options.tolerance.max(ACCEPTED) {
        return Ok((found.x, system.report(method, found.iterations, residual)));
    }
    let (iterations, tolerance) = (found.iterations, options.tolerance);
    Err(SolveError::NotConverged { method, iterations, residual, tolerance })
}
