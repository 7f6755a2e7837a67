//! Why equations were not solved.

use atomesh::watch::Cancelled;

/// Why equations were not solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// The factors do not exist, or hold values that are not finite.
    #[error("the {unknowns} equations have no unique answer (pivot {at})")]
    Singular {
        /// The number of unknowns.
        unknowns: usize,
        /// The unknown at which that was found.
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
    /// Iteration reached its limit, or stalled.
    #[error(
        "{method} left a residual of {residual:.1e} after {iterations} iterations; expected {tolerance:.1e}"
    )]
    NotConverged {
        /// The method.
        method: &'static str,
        /// The number of iterations.
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
