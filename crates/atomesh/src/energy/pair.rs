//! The pair potential φ(u) and the force f(u) between two atoms.
//!
//! `u = r/d` is the distance of two atoms over their nominal distance. The force, Shimada's (1993),
//! repels below `u = 1`, attracts above, is bounded at 0 and vanishes from [`CUTOFF`] on.

/// The normalized distance from which on two atoms do not feel each other.
pub const CUTOFF: f64 = 1.5;

/// The potential of an atom with itself, φ(0): the constant that the printed double sum includes for
/// i = j and that both engines leave out. It moves no atom.
pub const SELF_ENERGY: f64 = 153.0 / 256.0;

/// The pair potential φ(u), without unit, for `u ≥ 0`.
///
/// ```text
/// φ(u) = 153/256 − 9/8 u + 19/24 u³ − 5/16 u⁴    for u < 3/2, else 0
/// ```
///
/// Source: Hale (2001), section 2.1.1. Its least value, at u = 1, is −37/768.
///
/// ```
/// assert!((atomesh::energy::pair::energy(1.0) + 37.0 / 768.0).abs() < 1e-15);
/// assert_eq!(atomesh::energy::pair::energy(1.5), 0.0);
/// ```
#[inline]
pub fn energy(u: f64) -> f64 {
    if u < CUTOFF { energy_inside(u) } else { 0.0 }
}

/// The pair force f(u) = −φ′(u), without unit, for `u ≥ 0`: positive where atoms repel.
///
/// ```text
/// f(u) = 9/8 − 19/8 u² + 5/4 u³    for u < 3/2, else 0
/// ```
///
/// Source: Hale (2001), section 2.1.1, after Shimada (1993).
#[inline]
pub fn force(u: f64) -> f64 {
    if u < CUTOFF { force_inside(u) } else { 0.0 }
}

/// φ(u) without the test for the cut-off: the polynomial alone.
fn energy_inside(u: f64) -> f64 {
    SELF_ENERGY + u * (-9.0 / 8.0 + u * u * (19.0 / 24.0 - 5.0 / 16.0 * u))
}

/// f(u) without the test for the cut-off.
fn force_inside(u: f64) -> f64 {
    9.0 / 8.0 + u * u * (-19.0 / 8.0 + 5.0 / 4.0 * u)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_is_minus_the_slope_of_the_energy() {
        // Half steps keep the stencil off the knot u = 3/2, where φ″ jumps.
        let h = 1e-6;
        for u in (0..200).map(|k| 0.005 + 0.01 * f64::from(k)) {
            let slope = (energy(u + h) - energy(u - h)) / (2.0 * h);
            assert!((force(u) + slope).abs() < 1e-8, "u = {u}");
        }
    }

    #[test]
    fn energy_and_force_reach_the_cutoff_without_a_jump() {
        // One rounding of terms of size 1 is 2e-16; the sum of five may lose a few.
        assert!(energy_inside(CUTOFF).abs() < 1e-15);
        assert!(force_inside(CUTOFF).abs() < 1e-15);
        assert_eq!(energy(CUTOFF), 0.0);
        assert_eq!(force(2.0), 0.0);
    }

    #[test]
    fn the_force_changes_sign_at_the_nominal_distance_only() {
        assert!(force(1.0).abs() < 1e-15);
        for k in 0..150 {
            let u = 0.01 * f64::from(k);
            if u < 0.999 {
                assert!(force(u) > 0.0, "u = {u}");
            } else if u > 1.001 {
                assert!(force(u) < 0.0, "u = {u}");
            }
        }
    }

    #[test]
    fn crystals_have_the_known_energies_per_atom() {
        // Half the sum over shells: FCC at nearest distance d, BCC at the same density.
        let fcc = 0.5 * (12.0 * energy(1.0) + 6.0 * energy(2f64.sqrt()));
        let r = (0.75 * 3f64.sqrt() / 2f64.sqrt()).cbrt(); // BCC density 3√3/4 r⁻³, FCC √2
        let bcc = 0.5 * (8.0 * energy(r) + 6.0 * energy(r * 2.0 / 3f64.sqrt()));
        // the known figures have four digits
        assert!((fcc + 0.3015).abs() < 1e-4, "{fcc}");
        assert!((bcc + 0.3159).abs() < 1e-4, "{bcc}");
    }
}
