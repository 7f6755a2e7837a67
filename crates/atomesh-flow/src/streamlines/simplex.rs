//! The exact path through a simplex.

/// Barycentric coordinates, or other values at corners, of a triangle (three are used) or a tetrahedron.
pub type Corners = [f64; 4];

/// Exponents below which exponentials are replaced by the first terms of their series.
const SMALL: f64 = 1e-8;

/// Where a line leaves a simplex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exit {
    /// The corner opposite to the facet.
    pub opposite: usize,
    /// The barycentric coordinates there.
    pub weights: Corners,
    /// The time, in units of D |K| φ over the unit of flux.
    pub time: f64,
}

/// Follows the velocity `Σ F_i (x − x_i) / (D |K|)` from a place to the exit; `None` if there is none.
///
/// The barycentric coordinates obey `λ_i' = S λ_i − F_i`, S = Σ F_i, in the unit of time named in [`Exit`]: a facet
/// i with F_i > 0 is reached after `−ln(1 − S λ_i / F_i) / S`.
pub fn exit(fluxes: &Corners, weights: &Corners, corners: usize) -> Option<Exit> {
    let sum: f64 = fluxes[..corners].iter().sum();
    let mut first: Option<(usize, f64)> = None;
    for corner in 0..corners {
        if fluxes[corner] <= 0.0 {
            continue;
        }
        let way = weights[corner] / fluxes[corner];
        let growth = sum * way;
        let time = if growth.abs() < SMALL {
            way * (1.0 + 0.5 * growth)
        } else if growth < 1.0 {
            -(-growth).ln_1p() / sum
        } else {
            continue;
        };
        if time.is_finite() && first.is_none_or(|(_, earliest)| time < earliest) {
            first = Some((corner, time));
        }
    }
    let (opposite, time) = first?;
    // (exp(S t) − 1) / S
    let growth = sum * time;
    let factor =
        if growth.abs() < SMALL { time * (1.0 + 0.5 * growth) } else { growth.exp_m1() / sum };
    let mut at = [0.0; 4];
    for corner in (0..corners).filter(|&corner| corner != opposite) {
        let change = (sum * weights[corner] - fluxes[corner]) * factor;
        at[corner] = (weights[corner] + change).max(0.0);
    }
    let whole: f64 = at.iter().sum();
    (whole > 0.0 && whole.is_finite()).then(|| Exit {
        opposite,
        weights: at.map(|weight| weight / whole),
        time,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Small steps by the rule of midpoints, until a coordinate is below 0.
    fn walked(fluxes: &Corners, start: &Corners, step: f64) -> Option<(usize, f64)> {
        let sum: f64 = fluxes.iter().sum();
        let mut at = *start;
        for count in 1..2_000_000 {
            let half: Corners =
                std::array::from_fn(|i| at[i] + 0.5 * step * (sum * at[i] - fluxes[i]));
            at = std::array::from_fn(|i| at[i] + step * (sum * half[i] - fluxes[i]));
            if let Some(out) = (0..4).find(|&i| at[i] < 0.0) {
                return Some((out, step * f64::from(count)));
            }
        }
        None
    }

    #[test]
    fn a_line_leaves_where_small_steps_lead() {
        let start = [0.2, 0.3, 0.15, 0.35];
        for fluxes in [
            [1.0, -2.0, 0.5, 0.5],
            [1.0, -2.0, 0.5, 0.9],
            [1.0, -2.0, 0.5, -0.9],
            [-1.0, -1.0, -1.0, 0.5],
        ] {
            let (out, time) = walked(&fluxes, &start, 1e-5).unwrap();
            let found = exit(&fluxes, &start, 4).unwrap();
            assert_eq!(found.opposite, out);
            // the last step overshoots by up to one
            assert!((found.time - time).abs() < 2e-5, "{found:?} {time}");
            assert!((found.weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn the_series_and_the_logarithm_meet() {
        let start = [0.2, 0.3, 0.5, 0.0];
        let time = |source: f64| exit(&[1.0, -1.0 + source, 0.0, 0.0], &start, 3).unwrap().time;
        // growth 0.2 · source on both sides of the bound; the derivative is 0.02
        let (below, above) = (time(4.99e-8), time(5.01e-8));
        assert!((above - below - 0.02 * 2e-10).abs() < 1e-16, "{below} {above}");
    }

    #[test]
    fn no_line_leaves_a_sink_or_a_simplex_without_flow() {
        assert_eq!(exit(&[-1.0, -1.0, -0.5, 0.0], &[0.3, 0.3, 0.4, 0.0], 3), None);
        assert_eq!(exit(&[0.0; 4], &[0.3, 0.3, 0.4, 0.0], 3), None);
    }
}
