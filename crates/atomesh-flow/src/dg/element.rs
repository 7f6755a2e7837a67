//! Tables that all cells share, on the reference simplex: values, slopes and their integrals; and the map of a cell to it.

use atomesh::geometry::{Point, Simplex, difference};

use super::basis::{Basis, MOST, centred};
use super::quadrature::Rule;

/// The map between a cell's places and ξ (see [`Basis`]).
#[derive(Clone, Debug)]
pub(super) struct Affine<const D: usize> {
    /// The cell's centroid, where ξ = 0.
    pub centroid: Point<D>,
    /// The gradient of each ξ.
    pub gradients: [Point<D>; D],
}

impl<const D: usize> Affine<D> {
    /// Of a cell of positive measure.
    pub fn of(simplex: &Simplex<D>, centroid: &Point<D>) -> Self {
        let edges = simplex.others.map(|corner| difference(&corner, &simplex.first));
        Self { centroid: *centroid, gradients: inverse(&edges) }
    }

    /// ξ of a place.
    pub fn coordinates(&self, place: &Point<D>) -> Point<D> {
        let way = difference(place, &self.centroid);
        self.gradients.map(|gradient| atomesh::geometry::dot(&gradient, &way))
    }
}

/// The columns of the inverse of the matrix with these rows, by cofactors.
fn inverse<const D: usize>(rows: &[Point<D>; D]) -> [Point<D>; D] {
    const { assert!(D == 2 || D == 3) };
    let cofactor = |i: usize, j: usize| {
        if D == 2 {
            let sign = if i == j { 1.0 } else { -1.0 };
            return sign * rows[1 - i][1 - j];
        }
        let [(i1, i2), (j1, j2)] = [i, j].map(|k| ((k + 1) % 3, (k + 2) % 3));
        rows[i1][j1] * rows[i2][j2] - rows[i1][j2] * rows[i2][j1]
    };
    let cofactors: [Point<D>; D] = std::array::from_fn(|i| std::array::from_fn(|j| cofactor(i, j)));
    let determinant = atomesh::geometry::dot(&rows[0], &cofactors[0]);
    cofactors.map(|row| row.map(|x| x / determinant))
}

/// The functions of a cell at the nodes of one of its facets.
#[derive(Clone, Debug)]
pub(super) struct Trace {
    count: usize,
    values: Vec<f64>,
    /// Node by node, axis by axis, function by function.
    slopes: Vec<f64>,
}

impl Trace {
    /// The values of all functions at a node.
    #[inline]
    pub fn values(&self, node: usize) -> &[f64] {
        &self.values[node * self.count..(node + 1) * self.count]
    }

    /// Writes the slopes of all functions along a direction, given in ξ, at a node.
    #[inline]
    pub fn slopes_along<const D: usize>(
        &self,
        direction: &Point<D>,
        node: usize,
        into: &mut [f64; MOST],
    ) {
        let own = &self.slopes[node * D * self.count..(node + 1) * D * self.count];
        let into = &mut into[..self.count];
        into.fill(0.0);
        for (axis, slopes) in own.chunks_exact(self.count).enumerate() {
            into.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += direction[axis] * slope);
        }
    }
}

/// Tables of the reference simplex.
#[derive(Clone, Debug)]
pub(super) struct Element<const D: usize> {
    /// The functions.
    pub basis: Basis<D>,
    /// Quadrature on facets, exact for products of two functions.
    pub facet_rule: Rule,
    /// Quadrature on cells, exact for products of a function and a polynomial of degree `order + 2`.
    pub cell_rule: Rule,
    /// The functions at the nodes of `cell_rule`.
    pub samples: Vec<[f64; MOST]>,
    /// The means of `∂_a φ_i ∂_b φ_j`: a, b, i, j from the slowest.
    stiffness: Vec<f64>,
    /// By [`Element::trace_number`]; empty for numbers that name a corner twice.
    traces: Vec<Trace>,
}

impl<const D: usize> Element<D> {
    /// The tables of an order from 1 to 3.
    pub fn new(order: usize) -> Self {
        let basis = Basis::new(order);
        let facet_rule = Rule::new(D, 2 * order);
        let cell_rule = Rule::new(D + 1, 2 * order + 2);
        let samples = cell_rule.places().map(|place| basis.values(&centred(place))).collect();
        let stiffness = stiffness(&basis, &cell_rule);
        let number = (D + 1).pow(D as u32);
        let traces = (0..number).map(|number| trace(&basis, &facet_rule, number)).collect();
        Self { basis, facet_rule, cell_rule, samples, stiffness, traces }
    }

    /// The number of functions.
    pub fn count(&self) -> usize {
        self.basis.count()
    }

    /// The number of the trace for a facet's corners, each as the number of the cell's corner.
    pub fn trace_number(corners: &[usize; D]) -> usize {
        corners.iter().rev().fold(0, |number, corner| number * (D + 1) + corner)
    }

    /// The functions at the nodes of a facet.
    #[inline]
    pub fn trace(&self, number: u32) -> &Trace {
        &self.traces[number as usize]
    }

    /// Adds `Σ_ab metric_ab mean(∂_a φ_i ∂_b φ_j)` to a block of a matrix of rows of `width` entries.
    pub fn add_stiffness(&self, metric: &[Point<D>; D], rows: &mut [f64], width: usize) {
        let count = self.count();
        for (number, table) in self.stiffness.chunks_exact(count * count).enumerate() {
            let factor = metric[number / D][number % D];
            for (row, values) in rows.chunks_mut(width).zip(table.chunks_exact(count)) {
                row.iter_mut().zip(values).for_each(|(sum, value)| *sum += factor * value);
            }
        }
    }
}

fn stiffness<const D: usize>(basis: &Basis<D>, rule: &Rule) -> Vec<f64> {
    let count = basis.count();
    let mut table = vec![0.0; D * D * count * count];
    for (place, weight) in rule.places().zip(&rule.weights) {
        let slopes = basis.slopes(&centred(place));
        for (at, sum) in table.iter_mut().enumerate() {
            let (axes, functions) = (at / (count * count), at % (count * count));
            let (i, j) = (functions / count, functions % count);
            *sum += weight * slopes[axes / D][i] * slopes[axes % D][j];
        }
    }
    table
}

fn trace<const D: usize>(basis: &Basis<D>, rule: &Rule, number: usize) -> Trace {
    let corners: [usize; D] =
        std::array::from_fn(|axis| number / (D + 1).pow(axis as u32) % (D + 1));
    let count = basis.count();
    let mut trace = Trace { count, values: Vec::new(), slopes: Vec::new() };
    if (0..D).any(|k| corners[..k].contains(&corners[k])) {
        return trace;
    }
    for place in rule.places() {
        let mut barycentric = [0.0; 4];
        corners.iter().zip(place).for_each(|(&corner, x)| barycentric[corner] = *x);
        let place = centred(&barycentric[..D + 1]);
        trace.values.extend(&basis.values(&place)[..count]);
        for slopes in basis.slopes(&place) {
            trace.slopes.extend(&slopes[..count]);
        }
    }
    trace
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_barycentric() {
        let simplex = Simplex {
            first: [0.3, 0.1, -0.2],
            others: [[1.0, 0.2, 0.1], [0.1, 2.0, 0.4], [-0.3, 0.2, 1.5]],
        };
        let corners = [simplex.first, simplex.others[0], simplex.others[1], simplex.others[2]];
        let centroid = std::array::from_fn(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 4.0);
        let affine = Affine::of(&simplex, &centroid);
        for (number, corner) in corners.iter().enumerate() {
            for (axis, x) in affine.coordinates(corner).into_iter().enumerate() {
                let expected = f64::from(u8::from(number == axis + 1)) - 0.25;
                assert!((x - expected).abs() < 1e-15, "{number} {axis}: {x}");
            }
        }
    }
}
