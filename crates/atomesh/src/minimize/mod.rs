//! Minimizing a smooth function of many variables, without knowing what it is.
//!
//! [`Lbfgs`] is the limited-memory BFGS method by its two-loop recursion (Byrd, Nocedal & Schnabel 1996);
//! [`descend`] is plain steepest descent, the slow reference. Both work one iteration at a time, so that a
//! caller can watch, cancel, or change the function in between.

mod blocks;
mod lbfgs;
mod search;

pub use lbfgs::{Lbfgs, LbfgsOptions};
pub use search::{Step, descend};

/// A function to minimize.
pub trait Objective {
    /// Returns the value at `x` and writes its gradient.
    ///
    /// Where the objective confines its variables (see [`Objective::confine`]) it is only asked for
    /// values at confined points.
    fn evaluate(&mut self, x: &[f64], gradient: &mut [f64]) -> f64;

    /// The largest multiple of `direction` that one step may move the variables by. Default: no limit.
    fn longest_step(&mut self, direction: &[f64]) -> f64 {
        let _ = direction;
        f64::INFINITY
    }

    /// Shortens parts of a direction that are out of proportion, so that they do not hold back the rest.
    /// Default: none.
    fn shorten(&mut self, direction: &mut [f64]) {
        let _ = direction;
    }

    /// Moves `x` to the nearest point that is allowed. Default: everything is.
    fn confine(&self, x: &mut [f64]) {
        let _ = x;
    }
}
