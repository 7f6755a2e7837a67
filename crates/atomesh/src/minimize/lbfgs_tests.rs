//! L-BFGS against the recursion on vectors, plain descent, and known minima.

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
