//! One step of a descent: how far to go along a direction.

use super::Objective;
use super::blocks::{dot, update};

/// How an iteration ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Step {
    /// The value fell.
    Lower,
    /// No lower value was found along the direction: a minimum to rounding, or a gradient that does
    /// not belong to the values.
    Stuck,
    /// The value or a gradient entry was not finite.
    NotFinite,
}

/// Sufficient decrease: the value must fall by this share of what the slope promises.
const ARMIJO: f64 = 1e-4;
/// Enough flattening (weak Wolfe): the slope must rise to this share of the first slope.
const WOLFE: f64 = 0.9;

/// The state of a descent: a point, its value and gradient, and room for a trial.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    pub x: Vec<f64>,
    pub gradient: Vec<f64>,
    pub value: f64,
    pub trial_x: Vec<f64>,
    pub trial_gradient: Vec<f64>,
    pub evaluations: usize,
    /// The last trial's multiple of its direction.
    pub last_step: f64,
}

impl State {
    pub(super) fn new(x: Vec<f64>) -> Self {
        let zeros = vec![0.0; x.len()];
        Self {
            gradient: zeros.clone(),
            trial_x: zeros.clone(),
            trial_gradient: zeros,
            value: f64::INFINITY,
            evaluations: 0,
            last_step: 0.0,
            x,
        }
    }

    pub(super) fn evaluate(&mut self, objective: &mut impl Objective) {
        objective.confine(&mut self.x);
        self.value = objective.evaluate(&self.x, &mut self.gradient);
        self.evaluations += 1;
    }

    /// Searches along `direction` from a first guess for a step that meets the weak Wolfe
    /// conditions (bisection and doubling, at most `limit` evaluations), and leaves the best trial
    /// in `trial_*` with its value. Among trials that meet only the first condition the lowest counts.
    pub(super) fn search(
        &mut self,
        objective: &mut impl Objective,
        direction: &[f64],
        first: f64,
        limit: usize,
    ) -> (Step, f64) {
        let slope = dot(&self.gradient, direction);
        if !slope.is_finite() {
            return (Step::NotFinite, self.value);
        }
        let longest = objective.longest_step(direction);
        if slope >= 0.0 || longest <= 0.0 {
            return (Step::Stuck, self.value);
        }
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut alpha = first.min(longest);
        for _ in 0..limit {
            let value = self.try_step(objective, direction, alpha);
            if value.is_nan() {
                return (Step::NotFinite, value);
            }
            if value > self.value + ARMIJO * alpha * slope {
                high = alpha;
                alpha = interpolate(low, high, self.value, slope, value);
                continue;
            }
            let is_flat = dot(&self.trial_gradient, direction) >= WOLFE * slope;
            if is_flat || alpha >= longest || high.is_finite() {
                return (Step::Lower, value);
            }
            low = alpha;
            alpha = (2.0 * alpha).min(longest);
        }
        if low > 0.0 {
            let value = self.try_step(objective, direction, low);
            return (Step::Lower, value);
        }
        (Step::Stuck, self.value)
    }

    fn try_step(&mut self, objective: &mut impl Objective, direction: &[f64], alpha: f64) -> f64 {
        self.trial_x.copy_from_slice(&self.x);
        update(&mut self.trial_x, direction, |x, p| *x += alpha * p);
        objective.confine(&mut self.trial_x);
        self.evaluations += 1;
        self.last_step = alpha;
        objective.evaluate(&self.trial_x, &mut self.trial_gradient)
    }

    /// Makes the last trial the current point.
    pub(super) fn accept(&mut self, value: f64) {
        std::mem::swap(&mut self.x, &mut self.trial_x);
        std::mem::swap(&mut self.gradient, &mut self.trial_gradient);
        self.value = value;
    }
}

/// The minimum of the parabola through the value and slope at 0 and the value at `high`, kept within
/// the middle of `low..high`.
fn interpolate(low: f64, high: f64, value_0: f64, slope_0: f64, value_high: f64) -> f64 {
    let curvature = 2.0 * (value_high - value_0 - slope_0 * high) / (high * high);
    let guess = -slope_0 / curvature;
    let width = high - low;
    if guess.is_finite() {
        guess.clamp(low + 0.1 * width, high - 0.4 * width)
    } else {
        0.5 * (low + high)
    }
}

/// One iteration of steepest descent from `x`, which it moves; returns how it ended and the value.
///
/// `first` is the step tried first, as a multiple of the gradient. The reference for [`super::Lbfgs`]:
/// slow and plainly right.
pub fn descend(objective: &mut impl Objective, x: &mut Vec<f64>, first: f64) -> (Step, f64) {
    let mut state = State::new(std::mem::take(x));
    state.evaluate(objective);
    let direction: Vec<f64> = state.gradient.iter().map(|g| -g).collect();
    let (step, value) = state.search(objective, &direction, first, 60);
    if step == Step::Lower {
        state.accept(value);
    }
    *x = state.x;
    (step, state.value)
}
