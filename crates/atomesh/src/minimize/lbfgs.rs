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

    /// Forgets past steps and evaluates the function anew, as is due when the function has changed.
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
        objective.temper(&mut self.direction);
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
        combine(&mut self.direction, (&self.state.gradient, c.gradient), &terms);
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
        let dots = dots(&vectors, (step, change, &self.state.trial_gradient));
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
    use rayon::prelude::*;
    out.par_chunks_mut(8192).zip(a.par_chunks(8192).zip(b.par_chunks(8192))).for_each(
        |(out, (a, b))| {
            for (o, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
                *o = (a - b) as f32;
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::super::descend;
    use super::*;

    /// Σ 100 (x₂ₖ − x₂ₖ₋₁²)² + (1 − x₂ₖ₋₁)², whose minimum is 0 at all ones.
    struct Rosenbrock;

    impl Objective for Rosenbrock {
        fn evaluate(&mut self, x: &[f64], gradient: &mut [f64]) -> f64 {
            let mut value = 0.0;
            for (x, g) in x.chunks_exact(2).zip(gradient.chunks_exact_mut(2)) {
                let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
                value += a * a + 100.0 * b * b;
                g[0] = -2.0 * a - 400.0 * x[0] * b;
                g[1] = 200.0 * b;
            }
            value
        }
    }

    /// A bowl around 3 with walls: variables stay in 0…2, steps within 0.25.
    struct Walled;

    impl Objective for Walled {
        fn evaluate(&mut self, x: &[f64], gradient: &mut [f64]) -> f64 {
            let mut value = 0.0;
            for (k, (x, g)) in x.iter().zip(gradient).enumerate() {
                assert!((0.0..=2.0).contains(x), "asked for a value outside the walls: {x}");
                let target = if k % 2 == 0 { 3.0 } else { 1.0 };
                value += (x - target).powi(2);
                *g = if *x >= 2.0 && target > 2.0 { 0.0 } else { 2.0 * (x - target) };
            }
            value
        }
        fn longest_step(&mut self, direction: &[f64]) -> f64 {
            0.25 / direction.iter().fold(1e-300f64, |m, p| m.max(p.abs()))
        }
        fn confine(&self, x: &mut [f64]) {
            x.iter_mut().for_each(|x| *x = x.clamp(0.0, 2.0));
        }
    }

    /// The recursion on vectors: −H·gradient.
    fn two_loops(minimizer: &Lbfgs) -> Vec<f64> {
        let product =
            |a: &[f32], p: &[f64]| -> f64 { a.iter().zip(p).map(|(&a, p)| f64::from(a) * p).sum() };
        let wide = |v: &[f32]| v.iter().map(|&x| f64::from(x)).collect::<Vec<f64>>();
        let mut p: Vec<f64> = minimizer.gradient().iter().map(|g| -g).collect();
        let mut firsts = Vec::new();
        for pair in minimizer.history.iter().rev() {
            let a = product(&pair.step, &p) / product(&pair.step, &wide(&pair.change));
            p.iter_mut().zip(&pair.change).for_each(|(p, &y)| *p -= a * f64::from(y));
            firsts.push(a);
        }
        if let Some(last) = minimizer.history.back() {
            let y = wide(&last.change);
            let scale = product(&last.step, &y) / product(&last.change, &y);
            p.iter_mut().for_each(|p| *p *= scale);
        }
        for (pair, a) in minimizer.history.iter().zip(firsts.iter().rev()) {
            let b = product(&pair.change, &p) / product(&pair.step, &wide(&pair.change));
            p.iter_mut().zip(&pair.step).for_each(|(p, &s)| *p += (a - b) * f64::from(s));
        }
        p
    }

    #[test]
    fn the_direction_is_that_of_the_recursion_on_vectors() {
        // more variables than a block
        let start: Vec<f64> = (0..20_000).map(|k| if k % 2 == 0 { -1.2 } else { 1.0 }).collect();
        let mut minimizer = Lbfgs::new(start, LbfgsOptions { memory: 5, ..Default::default() });
        minimizer.restart(&mut Rosenbrock);
        for iteration in 0..12 {
            minimizer.point_downhill();
            let expected = two_loops(&minimizer);
            let longest = expected.iter().fold(0.0f64, |m, p| m.max(p.abs()));
            for (a, b) in minimizer.direction.iter().zip(&expected) {
                // sums of 20000 products, in another order and of terms that cancel some thousandfold
                assert!((a - b).abs() <= 1e-9 * longest, "iteration {iteration}: {a}, not {b}");
            }
            assert_eq!(minimizer.iterate(&mut Rosenbrock), Step::Lower);
            assert_eq!(minimizer.history.len(), (iteration + 1).min(5));
        }
    }

    fn run(objective: &mut impl Objective, x: Vec<f64>, limit: usize) -> Lbfgs {
        let mut minimizer = Lbfgs::new(x, LbfgsOptions::default());
        minimizer.restart(objective);
        for _ in 0..limit {
            if minimizer.iterate(objective) != Step::Lower {
                break;
            }
        }
        minimizer
    }

    #[test]
    fn finds_the_bottom_of_a_curved_valley() {
        let start: Vec<f64> = (0..2000).map(|k| if k % 2 == 0 { -1.2 } else { 1.0 }).collect();
        let minimizer = run(&mut Rosenbrock, start, 200);
        // A second-order method ends where rounding of the value, about 1e-16 of 1, hides the slope.
        assert!(minimizer.x().iter().all(|x| (x - 1.0).abs() < 1e-5), "{}", minimizer.value());
        assert!(minimizer.evaluations() < 150, "{} evaluations", minimizer.evaluations());
    }

    #[test]
    fn beats_plain_descent_to_the_same_answer() {
        let start: Vec<f64> = (0..40).map(|k| f64::from(k % 7)).collect();
        let mut slow = start.clone();
        for _ in 0..200 {
            descend(&mut Walled, &mut slow, 0.1);
        }
        let fast = run(&mut Walled, start, 50);
        for (a, b) in fast.x().iter().zip(&slow) {
            // a step of 0.1 gradients contracts by 0.8: 0.8²⁰⁰ = 4e-20 of the start is left
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
    }

    #[test]
    fn steps_stay_within_the_longest() {
        let mut objective = Walled;
        let mut minimizer = Lbfgs::new(vec![0.5; 10], LbfgsOptions::default());
        minimizer.restart(&mut objective);
        let before = minimizer.x().to_vec();
        assert_eq!(minimizer.iterate(&mut objective), Step::Lower);
        let moved = minimizer.x().iter().zip(&before).map(|(a, b)| (a - b).abs());
        assert!(moved.fold(0.0, f64::max) <= 0.25 + 1e-15);
    }

    #[test]
    fn a_value_that_is_not_finite_ends_the_work() {
        struct Broken;
        impl Objective for Broken {
            fn evaluate(&mut self, x: &[f64], gradient: &mut [f64]) -> f64 {
                gradient.fill(1.0);
                if x[0] < 0.0 { f64::NAN } else { x[0] }
            }
        }
        let mut minimizer = Lbfgs::new(vec![0.5; 3], LbfgsOptions::default());
        minimizer.restart(&mut Broken);
        assert_eq!(minimizer.iterate(&mut Broken), Step::NotFinite);
    }
}
