//! Preconditioned conjugate gradients (Hestenes & Stiefel 1952) and BiCGSTAB (van der Vorst 1992).
//!
//! Both update the residual by a recursion that rounding makes drift from the true one. So they end only when the true
//! residual is small enough, and otherwise restart from it, as long as each restart halves it. Where it does not, the
//! residual is rounding, and no iteration makes it smaller.

use atomesh::watch::{Cancelled, Phase, Watch, check};

use super::sparse::Sparse;
use super::vector::{dot, norm, update};

/// An approximate inverse: linear, the same each time, and symmetric for conjugate gradients.
pub trait Preconditioner {
    /// `z = M⁻¹ r`.
    fn apply(&mut self, r: &[f64], z: &mut [f64]);
}

/// When to end.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// The residual asked for, ‖b − Ax‖ / ‖b‖.
    pub tolerance: f64,
    /// The largest number of iterations.
    pub limit: usize,
}

/// The equations `A x = b`.
#[derive(Clone, Copy, Debug)]
pub struct Equations<'a> {
    /// A.
    pub matrix: &'a Sparse,
    /// b.
    pub rhs: &'a [f64],
}

/// The result of iteration.
#[derive(Clone, Debug)]
pub struct Found {
    /// The solution.
    pub x: Vec<f64>,
    /// The number of iterations.
    pub iterations: usize,
}

/// [`conjugate_gradients`] or [`bicgstab`].
pub type Solver =
    fn(Equations<'_>, &mut dyn Preconditioner, Goal, &mut dyn Watch) -> Result<Found, Cancelled>;

/// One run from a residual: improves `x` until ‖r‖ reaches its target, the limit, or a breakdown.
type Run =
    fn(&mut Iteration<'_>, &mut dyn Preconditioner, &mut Progress<'_>) -> Result<(), Cancelled>;

struct Iteration<'a> {
    matrix: &'a Sparse,
    x: Vec<f64>,
    r: Vec<f64>,
}

/// How far the iteration is, and the watch that hears of it.
struct Progress<'a> {
    watch: &'a mut dyn Watch,
    scale: f64,
    target: f64,
    first: f64,
    done: f64,
    iterations: usize,
    limit: usize,
}

impl Progress<'_> {
    /// Whether to go on from a residual of that norm.
    fn goes_on(&mut self, residual: f64) -> Result<bool, Cancelled> {
        let way = (residual / self.first).ln() / (self.target / self.first).ln();
        if way.is_finite() {
            self.done = self.done.max(way.clamp(0.0, 1.0));
        }
        check(self.watch, Phase::Solve, self.done, None)?;
        let more = residual > self.target && residual.is_finite() && self.iterations < self.limit;
        self.iterations += usize::from(more);
        Ok(more)
    }
}

/// Solves `A x = b`, A symmetric and positive definite, from x = 0.
///
/// # Errors
/// [`Cancelled`].
pub fn conjugate_gradients(
    equations: Equations<'_>,
    inverse: &mut dyn Preconditioner,
    goal: Goal,
    watch: &mut dyn Watch,
) -> Result<Found, Cancelled> {
    iterate(equations, inverse, goal, run_conjugate_gradients, watch)
}

/// Solves `A x = b` from x = 0.
///
/// # Errors
/// [`Cancelled`].
pub fn bicgstab(
    equations: Equations<'_>,
    inverse: &mut dyn Preconditioner,
    goal: Goal,
    watch: &mut dyn Watch,
) -> Result<Found, Cancelled> {
    iterate(equations, inverse, goal, run_bicgstab, watch)
}

fn iterate(
    equations: Equations<'_>,
    inverse: &mut dyn Preconditioner,
    goal: Goal,
    run: Run,
    watch: &mut dyn Watch,
) -> Result<Found, Cancelled> {
    let Equations { matrix, rhs } = equations;
    let scale = norm(rhs);
    let target = goal.tolerance * scale;
    let (limit, first) = (goal.limit, scale);
    let mut progress = Progress { watch, scale, target, first, done: 0.0, iterations: 0, limit };
    let mut iteration = Iteration { matrix, x: vec![0.0; rhs.len()], r: rhs.to_vec() };
    let mut best = (iteration.x.clone(), scale);
    let mut failures = 0;
    while best.1 > target && progress.iterations < limit && failures < 2 {
        run(&mut iteration, inverse, &mut progress)?;
        matrix.residual(rhs, &iteration.x, &mut iteration.r);
        let residual = norm(&iteration.r);
        failures = if residual <= 0.5 * best.1 { 0 } else { failures + 1 };
        if residual < best.1 {
            best = (iteration.x.clone(), residual);
        } else {
            iteration.x.clone_from(&best.0);
            matrix.residual(rhs, &iteration.x, &mut iteration.r);
        }
    }
    Ok(Found { x: best.0, iterations: progress.iterations })
}

fn run_conjugate_gradients(
    own: &mut Iteration<'_>,
    inverse: &mut dyn Preconditioner,
    progress: &mut Progress<'_>,
) -> Result<(), Cancelled> {
    let count = own.x.len();
    let (mut z, mut product) = (vec![0.0; count], vec![0.0; count]);
    inverse.apply(&own.r, &mut z);
    let mut direction = z.clone();
    let mut slope = dot(&own.r, &z);
    while progress.goes_on(norm(&own.r))? {
        own.matrix.multiply(&direction, &mut product);
        let step = slope / dot(&direction, &product);
        if !(step.is_finite() && step > 0.0) {
            return Ok(());
        }
        update(&mut own.x, &direction, |x, p| x + step * p);
        update(&mut own.r, &product, |r, q| r - step * q);
        inverse.apply(&own.r, &mut z);
        let next = dot(&own.r, &z);
        let turn = next / slope;
        slope = next;
        update(&mut direction, &z, |p, z| z + turn * p);
    }
    Ok(())
}

fn run_bicgstab(
    own: &mut Iteration<'_>,
    inverse: &mut dyn Preconditioner,
    progress: &mut Progress<'_>,
) -> Result<(), Cancelled> {
    let count = own.x.len();
    let shadow = own.r.clone();
    let zeros = || vec![0.0; count];
    let (mut direction, mut product, mut better, mut image) = (zeros(), zeros(), zeros(), zeros());
    let (mut rho, mut alpha, mut omega) = (1.0, 1.0, 1.0);
    while progress.goes_on(norm(&own.r))? {
        let next = dot(&shadow, &own.r);
        let beta = next / rho * (alpha / omega);
        rho = next;
        if !beta.is_finite() || rho.abs() <= 1e-30 * progress.scale * progress.scale {
            return Ok(());
        }
        update(&mut direction, &product, |p, v| p - omega * v);
        update(&mut direction, &own.r, |p, r| r + beta * p);
        inverse.apply(&direction, &mut better);
        own.matrix.multiply(&better, &mut product);
        alpha = rho / dot(&shadow, &product);
        if !alpha.is_finite() {
            return Ok(());
        }
        update(&mut own.x, &better, |x, p| x + alpha * p);
        update(&mut own.r, &product, |s, v| s - alpha * v);
        inverse.apply(&own.r, &mut better);
        own.matrix.multiply(&better, &mut image);
        omega = dot(&image, &own.r) / dot(&image, &image);
        if !omega.is_finite() {
            return Ok(());
        }
        update(&mut own.x, &better, |x, s| x + omega * s);
        update(&mut own.r, &image, |s, t| s - omega * t);
    }
    Ok(())
}
