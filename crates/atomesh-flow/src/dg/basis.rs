//! Polynomials on a simplex, orthonormal in the mean.
//!
//! The functions are of ascending degree, and the first is 1. So the first coefficient of a pressure is its mean over the
//! cell, and the equation tested by the first function is the cell's mass balance. Since `mean(φ_i φ_j) = δ_ij` on a
//! cell of any size and shape, the size of a mesh only scales the equations.
//!
//! Made from monomials in barycentric coordinates relative to the centroid, by Gram–Schmidt, applied twice against
//! loss of digits.

use atomesh::geometry::Point;

use super::quadrature::Rule;

/// The largest number of functions: cubic in space.
pub(super) const MOST: usize = 20;

/// An orthonormal basis of the polynomials up to an order, in coordinates ξ: the barycentric coordinates of all corners
/// but the first, less 1/(D + 1).
#[derive(Clone, Debug)]
pub(super) struct Basis<const D: usize> {
    order: usize,
    powers: Vec<[usize; D]>,
    /// Function by function, its coefficients on the monomials.
    coefficients: Vec<f64>,
}

impl<const D: usize> Basis<D> {
    /// The basis of an order from 0 to 3.
    pub fn new(order: usize) -> Self {
        assert!(order <= 3, "there is room for {MOST} functions");
        let powers = powers(order);
        let count = powers.len();
        let coefficients = vec![0.0; count * count];
        let mut basis = Self { order, powers, coefficients };
        let rule = Rule::new(D + 1, 2 * order);
        let samples: Vec<[f64; MOST]> =
            rule.places().map(|place| basis.monomials(&centred(place))).collect();
        // the values of each function at the nodes of the rule
        let mut functions: Vec<Vec<f64>> = Vec::new();
        for number in 0..count {
            let mut own = vec![0.0; count];
            own[number] = 1.0;
            let mut values: Vec<f64> = samples.iter().map(|sample| sample[number]).collect();
            for _ in 0..2 {
                for (other, at) in functions.iter().enumerate() {
                    let part = mean(&rule, &values, at);
                    values.iter_mut().zip(at).for_each(|(value, x)| *value -= part * x);
                    let from = &basis.coefficients[other * count..(other + 1) * count];
                    own.iter_mut().zip(from).for_each(|(value, x)| *value -= part * x);
                }
            }
            let scale = 1.0 / mean(&rule, &values, &values).sqrt();
            values.iter_mut().for_each(|value| *value *= scale);
            own.iter_mut().for_each(|value| *value *= scale);
            basis.coefficients[number * count..(number + 1) * count].copy_from_slice(&own);
            functions.push(values);
        }
        basis
    }

    /// The order.
    pub fn order(&self) -> usize {
        self.order
    }

    /// The number of functions.
    pub fn count(&self) -> usize {
        self.powers.len()
    }

    /// The values of all functions at ξ.
    pub fn values(&self, place: &Point<D>) -> [f64; MOST] {
        self.combine(&self.monomials(place))
    }

    /// The slopes along ξ of all functions, axis by axis.
    pub fn slopes(&self, place: &Point<D>) -> [[f64; MOST]; D] {
        std::array::from_fn(|axis| {
            let mut slopes = [0.0; MOST];
            for (slope, powers) in slopes.iter_mut().zip(&self.powers) {
                if powers[axis] > 0 {
                    let mut lower = *powers;
                    lower[axis] -= 1;
                    *slope = powers[axis] as f64 * monomial(&lower, place);
                }
            }
            self.combine(&slopes)
        })
    }

    fn monomials(&self, place: &Point<D>) -> [f64; MOST] {
        let mut values = [0.0; MOST];
        for (value, powers) in values.iter_mut().zip(&self.powers) {
            *value = monomial(powers, place);
        }
        values
    }

    fn combine(&self, monomials: &[f64; MOST]) -> [f64; MOST] {
        let count = self.count();
        let mut values = [0.0; MOST];
        for (number, row) in self.coefficients.chunks_exact(count).enumerate() {
            // a function is made of monomials up to its own
            values[number] = (0..=number).map(|k| row[k] * monomials[k]).sum();
        }
        values
    }
}

/// ξ of barycentric coordinates.
pub(super) fn centred<const D: usize>(barycentric: &[f64]) -> Point<D> {
    std::array::from_fn(|axis| barycentric[axis + 1] - 1.0 / (D + 1) as f64)
}

fn monomial<const D: usize>(powers: &[usize; D], place: &Point<D>) -> f64 {
    powers.iter().zip(place).map(|(&power, x)| x.powi(power as i32)).product()
}

fn mean(rule: &Rule, a: &[f64], b: &[f64]) -> f64 {
    rule.weights.iter().zip(a).zip(b).map(|((w, a), b)| w * a * b).sum()
}

/// The powers of all monomials up to an order, by ascending degree.
fn powers<const D: usize>(order: usize) -> Vec<[usize; D]> {
    let count = (order + 1).pow(D as u32);
    let power = |number: usize| {
        std::array::from_fn(|axis| number / (order + 1).pow(axis as u32) % (order + 1))
    };
    let mut all: Vec<[usize; D]> = (0..count).map(power).collect();
    let degree = |powers: &[usize; D]| powers.iter().sum::<usize>();
    all.retain(|powers| degree(powers) <= order);
    all.sort_by_key(degree);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_orthonormal_and_has_its_slopes<const D: usize>(order: usize, count: usize) {
        let basis = Basis::<D>::new(order);
        assert_eq!(basis.count(), count);
        let rule = Rule::new(D + 1, 2 * order);
        let samples: Vec<_> = rule.places().map(|place| basis.values(&centred(place))).collect();
        for i in 0..count {
            for j in 0..count {
                let product: f64 =
                    samples.iter().zip(&rule.weights).map(|(s, w)| w * s[i] * s[j]).sum();
                let expected = f64::from(u8::from(i == j));
                // a hundred rounding errors of terms up to about 50
                assert!((product - expected).abs() < 1e-12, "{i} {j}: {product}");
            }
        }
        let place: Point<D> = std::array::from_fn(|axis| 0.1 - 0.07 * axis as f64);
        assert!((basis.values(&place)[0] - 1.0).abs() < 1e-15);
        let slopes = basis.slopes(&place);
        for axis in 0..D {
            let moved = |step: f64| {
                let mut to = place;
                to[axis] += step;
                basis.values(&to)
            };
            let (high, low) = (moved(1e-3), moved(-1e-3));
            for i in 0..count {
                // central differences of cubics are off by h²/6 of a third derivative of some thousands
                let slope = (high[i] - low[i]) / 2e-3;
                assert!((slopes[axis][i] - slope).abs() < 1e-2, "{i}: {slope}");
            }
        }
    }

    #[test]
    fn functions_are_orthonormal_and_slopes_are_theirs() {
        for (order, plane, space) in [(0, 1, 1), (1, 3, 4), (2, 6, 10), (3, 10, 20)] {
            is_orthonormal_and_has_its_slopes::<2>(order, plane);
            is_orthonormal_and_has_its_slopes::<3>(order, space);
        }
    }
}
