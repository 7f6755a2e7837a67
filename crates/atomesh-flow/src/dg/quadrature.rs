//! Quadrature on simplices by conical products of Gauss's rule (Stroud 1971, chapter 2).
//!
//! The cube is folded onto the simplex, `λ_k = t_1 ⋯ t_k (1 − t_{k+1})`. The fold's Jacobian is a polynomial in t, which
//! Gauss's rule integrates exactly with a few more nodes. All weights are above 0. There are rules with fewer nodes, but
//! this one is of any degree and needs no tables.

/// Nodes in a simplex, and weights that sum to 1: the rule gives the mean over the simplex.
#[derive(Clone, Debug)]
pub(super) struct Rule {
    corners: usize,
    barycentric: Vec<f64>,
    /// The weights.
    pub weights: Vec<f64>,
}

impl Rule {
    /// A rule that is exact for polynomials up to `degree` on a simplex of `corners` corners.
    pub fn new(corners: usize, degree: usize) -> Self {
        let dimension = corners - 1;
        let (nodes, weights) = gauss((degree + dimension).div_ceil(2).max(1));
        let mut rule = Self { corners, barycentric: Vec::new(), weights: Vec::new() };
        for number in 0..nodes.len().pow(dimension as u32) {
            rule.add(number, &nodes, &weights);
        }
        rule
    }

    /// Adds the node of a number, whose digits number the nodes along each axis of the cube.
    fn add(&mut self, number: usize, nodes: &[f64], weights: &[f64]) {
        let dimension = self.corners - 1;
        let (mut weight, mut rest, mut number) = (1.0, 1.0, number);
        for axis in 0..dimension {
            let at = number % nodes.len();
            number /= nodes.len();
            self.barycentric.push(rest * (1.0 - nodes[at]));
            rest *= nodes[at];
            let power = dimension - 1 - axis;
            weight *= weights[at] * nodes[at].powi(power as i32) * (power + 1) as f64;
        }
        self.barycentric.push(rest);
        self.weights.push(weight);
    }

    /// The barycentric coordinates of a node.
    #[inline]
    pub fn place(&self, node: usize) -> &[f64] {
        &self.barycentric[node * self.corners..(node + 1) * self.corners]
    }

    /// The barycentric coordinates of each node.
    pub fn places(&self) -> impl Iterator<Item = &[f64]> {
        self.barycentric.chunks_exact(self.corners)
    }
}

/// Gauss's nodes and weights on 0…1, exact up to degree 2 `count` − 1: the zeros of Legendre's polynomial by Newton's
/// method from the usual guess (Abramowitz & Stegun 1964, 22.16.6). Ten steps are more than enough.
fn gauss(count: usize) -> (Vec<f64>, Vec<f64>) {
    let node = |number: usize| {
        let mut x = (std::f64::consts::PI * (number as f64 + 0.75) / (count as f64 + 0.5)).cos();
        let mut slope = 0.0;
        for _ in 0..10 {
            let (mut before, mut value) = (1.0, x);
            for n in 2..=count {
                let n = n as f64;
                (before, value) = (value, ((2.0 * n - 1.0) * x * value - (n - 1.0) * before) / n);
            }
            slope = count as f64 * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..count).map(node).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of `Π λ_k^a_k` over a simplex of dimension n: `n! Π a_k! / (n + Σ a_k)!`.
    fn monomial_mean(powers: &[usize]) -> f64 {
        let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
        let dimension = powers.len() - 1;
        let top: f64 = powers.iter().map(|&a| factorial(a)).product();
        factorial(dimension) * top / factorial(dimension + powers.iter().sum::<usize>())
    }

    #[test]
    fn monomials_up_to_the_degree_are_exact() {
        for (corners, degree) in [(1, 3), (2, 0), (2, 7), (3, 1), (3, 6), (3, 10), (4, 2), (4, 8)] {
            let rule = Rule::new(corners, degree);
            let count = (degree + 1).pow(corners as u32);
            let powers = (0..count).map(|number| {
                let digit = |k: usize| number / (degree + 1).pow(k as u32) % (degree + 1);
                (0..corners).map(digit).collect::<Vec<_>>()
            });
            for powers in powers.filter(|powers| powers.iter().sum::<usize>() <= degree) {
                let value = |place: &[f64]| -> f64 {
                    place.iter().zip(&powers).map(|(x, &a)| x.powi(a as i32)).product()
                };
                let found: f64 =
                    rule.places().zip(&rule.weights).map(|(place, w)| w * value(place)).sum();
                let expected = monomial_mean(&powers);
                // rounding of some hundred terms
                assert!((found - expected).abs() <= 1e-14, "{powers:?}: {found} {expected}");
            }
        }
    }

    #[test]
    fn a_rule_is_not_exact_far_beyond_its_degree() {
        let rule = Rule::new(3, 1);
        let found: f64 = rule.places().zip(&rule.weights).map(|(x, w)| w * x[0].powi(8)).sum();
        assert!((found / monomial_mean(&[8, 0, 0]) - 1.0).abs() > 1e-3);
    }
}
