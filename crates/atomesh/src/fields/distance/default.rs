//! The nominal distance where the user gives none.

use crate::image::Grid;

/// A constant distance for an image of which nothing else is known, a round number of lattice units.
///
/// It gives about 1,500 hexagonal atoms in the plane and 50,000 BCC atoms in space, give or take a half, and
/// is 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6 or 8 times a power of ten. At least twice the least step, also where
/// that gives fewer atoms. For Hale's 256 × 256 samples it is his 8.
///
/// ```
/// let grid = atomesh::image::Grid { shape: [256, 256], step: [1.0, 1.0] };
/// assert_eq!(atomesh::fields::default_distance(&grid), 8.0);
/// ```
pub fn default_distance<const D: usize>(grid: &Grid<D>) -> f64 {
    let per_atom = if D <= 2 { 2.0 / 3f64.sqrt() / 1_500.0 } else { 0.75 * 3f64.sqrt() / 50_000.0 };
    // by logarithms, since the product may overflow; an axis of one sample is a step thick
    let extent = grid.bounds().extent();
    let log_measure: f64 = (0..D).map(|k| extent[k].max(grid.step[k]).ln()).sum();
    let distance = ((log_measure + f64::ln(per_atom)) / D as f64).exp();
    round(distance).max(2.0 * grid.least_step())
}

/// The nearest round number, by ratio.
fn round(value: f64) -> f64 {
    const ROUND: [f64; 11] = [1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    let exponent = value.log10().floor() as i32;
    // powers of ten below 1 are not exact: divide by those above
    let power = 10f64.powi(exponent.abs());
    let scaled = |digit: f64| if exponent < 0 { digit / power } else { digit * power };
    let unlike = |digit: f64| (scaled(digit) / value).ln().abs();
    let nearest = ROUND.into_iter().min_by(|&a, &b| unlike(a).total_cmp(&unlike(b)));
    scaled(nearest.unwrap_or(1.0))
}

#[cfg(test)]
mod tests {
    use super::round;

    #[test]
    fn round_numbers_have_few_digits() {
        for (value, expected) in [(7.07, 8.0), (0.0013, 0.0012), (95.0, 100.0), (1.0, 1.0)] {
            assert_eq!(round(value), expected);
        }
    }
}
