//! How equations are solved.

/// How to solve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum SolveMethod {
    /// Direct if the factors are estimated to be small, else iterative.
    #[default]
    Auto,
    /// Sparse Cholesky or LU factors.
    Direct,
    /// Preconditioned conjugate gradients, or BiCGSTAB if the matrix is not symmetric.
    Iterative,
}

/// Options of [`solve`](super::solve).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SolveOptions {
    /// The method. Default auto.
    pub method: SolveMethod,
    /// Iteration ends when ‖b − Ax‖ ≤ tolerance ‖b‖. Default 10⁻¹², so that mass balances to 10⁻¹⁰.
    pub tolerance: f64,
    /// The largest number of iterations. Default 2000.
    pub limit: usize,
    /// The memory that factors may take, in bytes. Default 8 GiB.
    pub memory: u64,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self { method: SolveMethod::Auto, tolerance: 1e-12, limit: 2000, memory: 8 << 30 }
    }
}
