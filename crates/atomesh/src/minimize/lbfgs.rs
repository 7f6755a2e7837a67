//! L-BFGS by the two-loop recursion, on coefficients.
//!
//! The recursion's vectors are all sums of the past steps, the past changes of the gradient, and the
//! gradient, so it can be run on their coefficients alone, given all inner products. Those are taken in one
//! pass over memory and the direction is put together in another, where the recursion on vectors takes
//! four passes for every past step.

use std::collections::VecDeque;

use super::Objective;
use super::blocks::{combine, dots};
use super::search::{State, Step};

/// How [`Lbfgs`] works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LbfgsOptions {
    /// How many past steps shape the direction, 1 or more. Default 8.
    pub memory: usize,
    /// Evaluations one line search may take, 1 or more. Default 20.
    pub search_limit: usize,
    /// The length of the first step, and of the first after a [`Lbfgs::restart`]: the greatest change
    /// of a variable. Default 1.
    pub first_move: f64,
}

impl Default for LbfgsOptions {
    fn default() -> Self {
        Self { memory: 8, search_limit: 20, first_move: 1.0 }
    }
}

/// One past step: the move and the change of the gradient, in single precision to halve the memory.
#[derive(Clone, Debug, Default)]
struct Pair {
    step: Vec<f32>,
    change: Vec<f32>,
    /// With every pair up to this one, oldest first. Of the vectors as stored, so that the recursion stays
    /// positive definite.
    products: Vec<Products>,
    /// The gradient's inner products with step and change.
    slopes: [f64; 2],
}

/// Inner products of a pair's vectors with those of another.
#[derive(Clone, Copy, Debug)]
struct Products {
    step_step: f64,
    /// This one's step with the other's change, and the reverse.
    step_change: f64,
    change_step: f64,
    change_change: f64,
}

impl Pair {
    /// sᵀy, the curvature along the step.
    fn curvature(&self) -> f64 {
        self.products[self.products.len() - 1].step_change
    }
}

/// A direction as a sum of the history's steps and changes, and of the gradient.
#[derive(Clone, Debug, Default)]
struct Coefficients {
    steps: Vec<f64>,
    changes: Vec<f64>,
    gradient: f64,
}

impl Coefficients {
    /// The inner products of the sum with the step and the change of pair i.
    fn along(&self, history: &VecDeque<Pair>, i: usize) -> [f64; 2] {
        let mut sum = history[i].slopes.map(|slope| self.gradient * slope);
        for j in 0..history.len() {
            let (s, y) = (self.steps[j], self.changes[j]);
            if j <= i {
                let p = history[i].products[j];
                sum[0] += s * p.step_step + y * p.step_change;
                sum[1] += s * p.change_step + y * p.change_change;
            } else {
                let p = history[j].products[i];
                sum[0] += s * p.step_step + y * p.change_step;
                sum[1] += s * p.step_change + y * p.change_change;
            }
        }
        sum
    }
}

/// The limited-memory BFGS method, one iteration at a time.
///
/// Source: Byrd, Nocedal & Schnabel (1996), the two-loop recursion of page 17; the line search meets
/// the weak Wolfe conditions. Allocates no vector once its memory is full.
///
/// ```
/// use atomesh::minimize::{Lbfgs, LbfgsOptions, Objective, Step};
/// struct Bowl;
/// impl Objective for Bowl {
///     fn evaluate(&mut self, x: &[f64], gradient: &mut [f64]) -> f64 {
///         for (g, x) in gradient.iter_mut().zip(x) {
///             *g = 2.0 * (x - 3.0);
///         }
///         x.iter().map(|x| (x - 3.0).powi(2)).sum()
///     }
/// }
/// let mut minimizer = Lbfgs::new(vec![0.0; 4], LbfgsOptions::default());
/// minimizer.restart(&mut Bowl);
/// while minimizer.iterate(&mut Bowl) == Step::Lower {}
/// assert!(minimizer.x().iter().all(|x| (x - 3.0).abs() < 1e-9));
/// ```
#[derive(Clone, Debug)]
pub struct Lbfgs {
    options: LbfgsOptions,
    state: State,
    direction: Vec<f64>,
    history: VecDeque<Pair>,
    coefficients: Coefficients,
    spare: Vec<Pair>,
}

impl Lbfgs {
    /// A minimizer that stands at `x`. Call [`Lbfgs::restart`] before the first iteration.
    pub fn new(x: Vec<f64>, options: LbfgsOptions) -> Self {
        let direction = vec![0.0; x.len()];
        Self {
            options,
            state: State::new(x),
            direction,
            history: VecDeque::with_capacity(options.memory),
            coefficients: Coefficients::default(),
            spare: Vec::new(),
        }
    }

    /// Forgets past steps and evaluates the function: due when it has changed.
    pub fn restart(&mut self, objective: &mut impl Objective) {
        self.spare.extend(self.history.drain(..));
        self.state.evaluate(objective);
    }

    /// Where the minimizer stands.
    pub fn x(&self) -> &[f64] {
        &self.state.x
    }

    /// Puts the minimizer elsewhere; [`Lbfgs::restart`] must follow.
    pub fn x_mut(&mut self) -> &mut [f64] {
        &mut self.state.x
    }

    /// The value where it stands.
    pub fn value(&self) -> f64 {
        self.state.value
    }

    /// The gradient where it stands.
    pub fn gradient(&self) -> &[f64] {
        &self.state.gradient
    }

    /// How many times the function has been evaluated so far.
    pub fn evaluations(&self) -> usize {
        self.state.evaluations
    }

    /// The last step, as a multiple of the direction that it went along.
    pub fn last_step(&self) -> f64 {
        self.state.last_step
    }

    /// One iteration: a direction, a line search, a step if the value falls.
    pub fn iterate(&mut self, objective: &mut impl Objective) -> Step {
        if !self.state.value.is_finite() {
            return Step::NotFinite;
        }
        let step = self.advance(objective);
        if step == Step::Stuck && !self.history.is_empty() {
            // A direction shaped by stale curvature may lead nowhere; the gradient has the last word.
            self.spare.extend(self.history.drain(..));
            return self.advance(objective);
        }
        step
    }

    fn advance(&mut self, objective: &mut impl Objective) -> Step {
        self.point_downhill();
        objective.shorten(&mut self.direction);
        let first = if self.history.is_empty() {
            let steepest = self.direction.iter().fold(0.0f64, |m, p| m.max(p.abs()));
            if steepest == 0.0 {
                return Step::Stuck;
            }
            self.options.first_move / steepest
        } else {
            1.0
        };
        let limit = self.options.search_limit;
        let (step, value) = self.state.search(objective, &self.direction, first, limit);
        if step == Step::Lower {
            self.remember();
            self.state.accept(value);
        }
        step
    }

    /// Writes −H·gradient into `direction`, H being the inverse Hessian that the history implies.
    fn point_downhill(&mut self) {
        let Self { history, coefficients: c, .. } = self;
        let count = history.len();
        c.steps.clear();
        c.steps.resize(count, 0.0);
        c.changes.clear();
        c.changes.resize(count, 0.0);
        c.gradient = -1.0;
        for i in (0..count).rev() {
            // the first loop's coefficient is −(the direction's) of the change
            c.changes[i] = -c.along(history, i)[0] / history[i].curvature();
        }
        let firsts = c.changes.clone();
        if let Some(last) = history.back() {
            let scale = last.curvature() / last.products[count - 1].change_change;
            c.changes.iter_mut().for_each(|y| *y *= scale);
            c.gradient *= scale;
        }
        for i in 0..count {
            let b = c.along(history, i)[1] / history[i].curvature();
            c.steps[i] = -firsts[i] - b;
        }
        let pairs = history.iter().zip(c.steps.iter().zip(&c.changes));
        let terms: Vec<(&[f32], f64)> =
            pairs.flat_map(|(p, (&s, &y))| [(&p.step[..], s), (&p.change[..], y)]).collect();
        combine(&mut self.direction, &self.state.gradient, c.gradient, &terms);
    }

    /// Keeps the step from the current point to the trial, unless its curvature is not positive.
    fn remember(&mut self) {
        let n = self.state.x.len();
        let full = self.history.len() >= self.options.memory.max(1);
        let recycled = if full { self.forget_oldest() } else { self.spare.pop() };
        let mut pair = recycled.unwrap_or_default();
        pair.step.resize(n, 0.0);
        pair.change.resize(n, 0.0);
        let State { x, gradient, trial_x, trial_gradient, .. } = &self.state;
        store_difference(&mut pair.step, trial_x, x);
        store_difference(&mut pair.change, trial_gradient, gradient);
        self.take_products(&mut pair);
        let newest = pair.products[pair.products.len() - 1];
        if newest.step_change > 1e-10 * (newest.change_change * newest.step_step).sqrt() {
            self.history.push_back(pair);
        } else {
            self.spare.push(pair);
        }
    }

    fn forget_oldest(&mut self) -> Option<Pair> {
        let oldest = self.history.pop_front();
        for pair in &mut self.history {
            pair.products.remove(0);
        }
        oldest
    }

    /// The inner products of a new pair with the history and itself, and of the trial's gradient with all.
    fn take_products(&mut self, pair: &mut Pair) {
        let Pair { step, change, products, slopes } = pair;
        let all = self.history.iter().map(|p| (&p.step, &p.change));
        let vectors: Vec<&[f32]> =
            all.chain([(&*step, &*change)]).flat_map(|(s, y)| [&s[..], &y[..]]).collect();
        let dots = dots(&vectors, step, change, &self.state.trial_gradient);
        products.clear();
        products.extend(dots.as_chunks().0.iter().map(|[s, y]| Products {
            step_step: s[0],
            change_step: s[1],
            step_change: y[0],
            change_change: y[1],
        }));
        let along = |pair: usize| [dots[2 * pair][2], dots[2 * pair + 1][2]];
        for (k, pair) in self.history.iter_mut().enumerate() {
            pair.slopes = along(k);
        }
        *slopes = along(self.history.len());
    }
}

/// `out = a − b`, taken in double precision and then rounded.
fn store_difference(out: &mut [f32], a: &[f64], b: &[f64]) {
    use crate::parallel::prelude::*;
    out.par_chunks_mut(8192).zip(a.par_chunks(8192).zip(b.par_chunks(8192))).for_each(
        |(out, (a, b))| {
            for (o, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
                *o = (a - b) as f32;
            }
        },
    );
}

#[cfg(test)]
#[path = "lbfgs_tests.rs"]
mod tests;
