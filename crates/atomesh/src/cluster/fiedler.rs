//! The Fiedler vector of a connected graph: how its cells fall into two.
//!
//! x solves L x = λ D x for the least λ above 0: the relaxed normalised cut of Shi & Malik (2000). With y = D^(1/2) x it is
//! an eigenvector of the normalised Laplacian, found by LOBPCG (Knyazev 2001) with one vector: each iteration takes the
//! best of the span of y, its preconditioned residual and the last step. It begins with the vector of a coarser graph; the
//! preconditioner is a cycle over all coarser ones (Notay 2010). Cost: some ten cycles, each of a few products with the
//! matrix. One thread: the same at any thread count.

use super::CellGraph;
use super::levels::{Coarsening, Level};
use crate::geometry::linear::largest_eigenpair;

/// Nodes of the coarsest level at most.
const COARSEST: usize = 24;

/// Sweeps that solve the equations of the coarsest level well enough.
const COARSEST_SWEEPS: usize = 12;

/// How exactly vectors are found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Accuracy {
    /// The greatest norm of the residual, over λ.
    pub tolerance: f64,
    /// The most iterations at a level.
    pub most: usize,
}

/// A residual this small is rounding alone.
const ROUNDING: f64 = 1e-14;

/// The Fiedler vector x, one number a cell, of a graph in which all cells are connected by weights above 0. Its sign is
/// arbitrary, but always the same.
pub(super) fn fiedler(graph: &CellGraph, accuracy: Accuracy) -> Vec<f64> {
    let hierarchy = Hierarchy::new(graph);
    let coarsest = hierarchy.levels.len() - 1;
    let mut y = start(hierarchy.levels[coarsest].node_count());
    for level in (0..=coarsest).rev() {
        if level < coarsest {
            y = hierarchy.ways[level].refined(&y);
        }
        y = Search::new(&hierarchy, level, y).run(accuracy);
    }
    y.iter().zip(hierarchy.levels[0].roots()).map(|(y, root)| y / root).collect()
}

/// A graph and coarser ones, the finest first.
struct Hierarchy {
    levels: Vec<Level>,
    /// From each level to the next.
    ways: Vec<Coarsening>,
}

impl Hierarchy {
    fn new(graph: &CellGraph) -> Self {
        let (mut levels, mut ways) = (vec![Level::of(graph)], Vec::new());
        while levels[ways.len()].node_count() > COARSEST
            && let Some((level, way)) = levels[ways.len()].coarser()
        {
            levels.push(level);
            ways.push(way);
        }
        Self { levels, ways }
    }

    /// About the vector of which the product with a level's Laplacian is `right`: a symmetric cycle, one sweep before and
    /// one after what coarser levels add.
    fn cycle(&self, level: usize, right: &[f64]) -> Vec<f64> {
        let own = &self.levels[level];
        let mut y = vec![0.0; right.len()];
        own.sweep(right, &mut y, false);
        match self.ways.get(level) {
            Some(way) => {
                let rest = minus(right, &own.apply(&y));
                let rest = way.gathered(&rest, self.levels[level + 1].node_count());
                let found = way.refined(&self.solve(level + 1, rest));
                y.iter_mut().zip(found).for_each(|(y, found)| *y += found);
            }
            None => {
                for at in 0..2 * COARSEST_SWEEPS {
                    own.sweep(right, &mut y, at % 2 == 0);
                }
            }
        }
        own.sweep(right, &mut y, true);
        y
    }

    /// The same by two iterations of conjugate gradients with cycles: one cycle over pieces of nodes corrects too little.
    fn solve(&self, level: usize, right: Vec<f64>) -> Vec<f64> {
        let own = &self.levels[level];
        let first = self.cycle(level, &right);
        if self.ways.get(level).is_none() {
            return first;
        }
        let first_product = own.apply(&first);
        let (energy, along) = (inner(&first, &first_product), inner(&first, &right));
        if energy <= 0.0 {
            return first;
        }
        let far = along / energy;
        let rest: Vec<f64> = right.iter().zip(&first_product).map(|(r, p)| r - far * p).collect();
        let mut second = self.cycle(level, &rest);
        let mut second_product = own.apply(&second);
        let shared = inner(&second, &first_product) / energy;
        add(&mut second, -shared, &first);
        add(&mut second_product, -shared, &first_product);
        let energy = inner(&second, &second_product);
        let mut found: Vec<f64> = first.iter().map(|y| far * y).collect();
        if energy > 0.0 {
            add(&mut found, inner(&second, &rest) / energy, &second);
        }
        found
    }
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Adds so many times another vector to one.
fn add(to: &mut [f64], times: f64, other: &[f64]) {
    to.iter_mut().zip(other).for_each(|(to, other)| *to += times * other);
}

/// Numbers without a pattern, from −1 to 1.
fn start(count: usize) -> Vec<f64> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let next = |_| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    (0..count).map(next).collect()
}

/// A vector and its product by the matrix.
struct Column {
    own: Vec<f64>,
    product: Vec<f64>,
}

impl Column {
    fn scale(&mut self, by: f64) {
        self.own.iter_mut().chain(&mut self.product).for_each(|value| *value *= by);
    }
}

/// The state of LOBPCG at a level: y, and the direction of the last step, orthonormal.
struct Search<'a> {
    hierarchy: &'a Hierarchy,
    level: usize,
    /// The eigenvector of 0, of length 1.
    constant: Vec<f64>,
    y: Column,
    step: Option<Column>,
}

impl<'a> Search<'a> {
    fn new(hierarchy: &'a Hierarchy, level: usize, y: Vec<f64>) -> Self {
        let mut constant = hierarchy.levels[level].roots();
        normalize(&mut constant);
        let y = Column { own: y, product: Vec::new() };
        Self { hierarchy, level, constant, y, step: None }
    }

    fn apply(&self, y: &[f64]) -> Vec<f64> {
        self.hierarchy.levels[self.level].apply(y)
    }

    fn run(mut self, accuracy: Accuracy) -> Vec<f64> {
        remove(&mut self.y.own, &self.constant);
        if !normalize(&mut self.y.own) {
            return self.y.own; // a single node
        }
        self.y.product = self.apply(&self.y.own);
        for _ in 0..accuracy.most {
            let lambda = inner(&self.y.own, &self.y.product);
            let Some(way) = self.way(lambda, accuracy.tolerance) else { break };
            self.advance(lambda, way);
        }
        self.y.own
    }

    /// The preconditioned residual, orthonormal to y and the last step, unless the residual is small.
    fn way(&self, lambda: f64, tolerance: f64) -> Option<Column> {
        let mut residual = self.y.product.clone();
        add(&mut residual, -lambda, &self.y.own);
        remove(&mut residual, &self.constant);
        let length = inner(&residual, &residual).sqrt();
        if length <= tolerance * lambda || length <= ROUNDING {
            return None;
        }
        let mut own = self.hierarchy.cycle(self.level, &residual);
        normalize(&mut own);
        // twice is enough (Parlett 1998): the second time removes what rounding left
        for _ in 0..2 {
            remove(&mut own, &self.constant);
            remove(&mut own, &self.y.own);
            if let Some(step) = &self.step {
                remove(&mut own, &step.own);
            }
            if !normalize(&mut own) {
                return None;
            }
        }
        let product = self.apply(&own);
        Some(Column { own, product })
    }

    /// Takes the vector of the least quotient in the span of y, the way found and the last step.
    fn advance(&mut self, lambda: f64, way: Column) {
        let mut small = [[0.0; 3]; 3];
        small[0][0] = lambda;
        small[1][1] = inner(&way.own, &way.product);
        small[0][1] = inner(&self.y.own, &way.product);
        small[2][2] = f64::INFINITY;
        if let Some(step) = &self.step {
            small[2][2] = inner(&step.own, &step.product);
            small[0][2] = inner(&self.y.own, &step.product);
            small[1][2] = inner(&way.own, &step.product);
        }
        let best = least_eigenvector(small);
        let Column { own: ry, product: rp } = way;
        let mut step = self.step.take().unwrap_or_else(|| {
            let zeros = vec![0.0; ry.len()];
            Column { own: zeros.clone(), product: zeros }
        });
        // the part of the new vector that is not y, less what of it lies along the new vector: of orthonormal parts that is
        // a rotation of coefficients
        let [c0, c1, c2] = best;
        let moved = c1 * c1 + c2 * c2;
        for i in 0..ry.len() {
            let (own, product) = (c1 * ry[i] + c2 * step.own[i], c1 * rp[i] + c2 * step.product[i]);
            let new = (c0 * self.y.own[i] + own, c0 * self.y.product[i] + product);
            (step.own[i], step.product[i]) = (own - moved * new.0, product - moved * new.1);
            (self.y.own[i], self.y.product[i]) = new;
        }
        self.y.scale(1.0 / inner(&self.y.own, &self.y.own).sqrt());
        let length = inner(&step.own, &step.own).sqrt();
        if length > ROUNDING {
            step.scale(1.0 / length);
            self.step = Some(step);
        }
    }
}

/// The unit eigenvector of the least eigenvalue of a symmetric matrix, given by its upper half. A last row that is
/// infinite is left out.
fn least_eigenvector(upper: [[f64; 3]; 3]) -> [f64; 3] {
    let at = |r: usize, c: usize| upper[r.min(c)][r.max(c)];
    if upper[2][2].is_infinite() {
        let [a, b] =
            largest_eigenpair(std::array::from_fn(|r| std::array::from_fn(|c| -at(r, c)))).1;
        return [a, b, 0.0];
    }
    largest_eigenpair(std::array::from_fn(|r| std::array::from_fn(|c| -at(r, c)))).1
}

fn inner(a: &[f64], b: &[f64]) -> f64 {
    // four sums at a time, in a fixed order, so that the processor need not wait for each addition
    let mut sums = [0.0; 4];
    let (heads, tails) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = heads.remainder().iter().zip(tails.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in heads.zip(tails) {
        (0..4).for_each(|k| sums[k] += a[k] * b[k]);
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// Makes a vector one of length 1, unless it is nothing but rounding; returns whether it is.
fn normalize(vector: &mut [f64]) -> bool {
    let length = inner(vector, vector).sqrt();
    vector.iter_mut().for_each(|value| *value /= length);
    length > ROUNDING
}

/// Removes the part of a vector that lies along another of length 1.
fn remove(vector: &mut [f64], unit: &[f64]) {
    let along = inner(vector, unit);
    vector.iter_mut().zip(unit).for_each(|(value, unit)| *value -= along * unit);
}
