//! How regular a cell is.

use crate::geometry::{Simplex, distance_squared};

/// The measure of a cell over that of the equilateral cell of the same root mean square edge: 1 at best, 0 if
/// flat, negative if inverted (Parthasarathy, Graichen & Hathaway 1994).
pub(super) fn regularity<const D: usize>(simplex: &Simplex<D>) -> f64 {
    let mut squares = 0.0;
    for (k, a) in simplex.others.iter().enumerate() {
        squares += distance_squared(a, &simplex.first);
        squares += simplex.others[k + 1..].iter().map(|b| distance_squared(a, b)).sum::<f64>();
    }
    let edges = (D * (D + 1) / 2) as f64;
    // the measure of the equilateral cell of edge 1: √3/4, 1/(6√2)
    let unit = if D == 2 { 0.75f64.sqrt() / 2.0 } else { 0.5f64.sqrt() / 6.0 };
    simplex.measure() / (unit * (squares / edges).powf(0.5 * D as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regularity_is_one_for_equilateral_cells() {
        let h = 0.75f64.sqrt();
        let plane = Simplex { first: [0.0, 0.0], others: [[1.0, 0.0], [0.5, h]] };
        assert!((regularity(&plane) - 1.0).abs() < 1e-14);
        let a = 0.5f64.sqrt();
        let space = Simplex { first: [0.0; 3], others: [[0.0, a, a], [a, 0.0, a], [a, a, 0.0]] };
        assert!((regularity(&space).abs() - 1.0).abs() < 1e-14);
    }
}
