//! The coarse space for solving: continuous piecewise linear functions, cut at barriers (Dobrev et al. 2006).

use atomesh::geometry::Sets;

use super::basis::centred;
use super::element::Element;
use super::scheme::Scheme;
use crate::solve::Sparse;

/// The matrix from values at points to coefficients. A point on barriers has a value for each set of cells around it
/// that facets without a barrier connect. Cost: O(cells).
pub(super) fn coarse<const D: usize>(scheme: &Scheme<'_, D>) -> Sparse {
    let (numbers, column_count) = values_at_corners(scheme);
    let parts = linear_parts(&scheme.element);
    let count = scheme.element.count();
    let (mut starts, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for own in numbers.chunks_exact(D + 1) {
        let mut order: [usize; 4] = [0, 1, 2, 3];
        order[..D + 1].sort_unstable_by_key(|&corner| own[corner]);
        for function in 0..count {
            if function <= D {
                for &corner in &order[..D + 1] {
                    columns.push(own[corner]);
                    values.push(parts[function * (D + 1) + corner]);
                }
            }
            starts.push(columns.len());
        }
    }
    Sparse::new(column_count, starts, columns, values)
}

/// The coefficient of each function of degree 1 or less in each corner's barycentric coordinate.
fn linear_parts<const D: usize>(element: &Element<D>) -> Vec<f64> {
    let mut parts = vec![0.0; (D + 1) * (D + 1)];
    let rule = &element.cell_rule;
    for (place, weight) in rule.places().zip(&rule.weights) {
        let values = element.basis.values(&centred(place));
        for (at, part) in parts.iter_mut().enumerate() {
            *part += weight * values[at / (D + 1)] * place[at % (D + 1)];
        }
    }
    parts
}

/// The number of the value at each corner of each cell, and the number of values.
fn values_at_corners<const D: usize>(scheme: &Scheme<'_, D>) -> (Vec<u32>, usize) {
    let mesh = scheme.grid.mesh().expect("checked before");
    let corners = mesh.corners();
    let mut sets = Sets::new(corners.len());
    for (number, facet) in scheme.grid.facets().iter().enumerate() {
        let Some(other) = facet.neighbour.filter(|_| scheme.setting.multipliers()[number] == 1.0)
        else {
            continue;
        };
        for point in scheme.grid.facet_corners(number).expect("facets of a mesh have corners") {
            let [a, b] = [facet.cell, other].map(|cell| {
                let first = cell as usize * (D + 1);
                let at = corners[first..first + D + 1].iter().position(|c| c == point);
                (first + at.expect("the cell has the facet")) as u32
            });
            sets.join(a, b);
        }
    }
    let numbers = sets.numbers();
    let count = numbers.iter().max().map_or(0, |&most| most as usize + 1);
    (numbers, count)
}
