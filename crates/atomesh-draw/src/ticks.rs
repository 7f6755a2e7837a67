//! Round numbers along an axis.

/// Steps of an axis: 1, 2 or 5 times a power of ten.
const STEPS: [f64; 3] = [1.0, 2.0, 5.0];

/// Numbers from `from` to `to`, about `count` of them.
pub(crate) fn ticks([from, to]: [f64; 2], count: f64) -> impl Iterator<Item = f64> {
    let rough = (to - from) / count;
    let power = 10f64.powf(rough.log10().floor());
    let step = STEPS.into_iter().map(|s| s * power).find(|s| *s >= rough);
    let step = step.unwrap_or(10.0 * power);
    // the ends may be off by a rounding
    let slack = 1e-9 * (to - from);
    let (first, last) = ((from - slack) / step, (to + slack) / step);
    (first.ceil() as i64..=last.floor() as i64).map(move |i| i as f64 * step)
}

/// A number of a few digits.
pub(crate) fn number(x: f64) -> String {
    let text = format!("{x:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within_the_axis() {
        let of = |ends, count| ticks(ends, count).map(number).collect::<Vec<_>>();
        assert_eq!(of([0.0, 1.5], 3.0), ["0", "0.5", "1", "1.5"]);
        assert_eq!(of([-0.37, 1.2], 4.0), ["0", "0.5", "1"]);
        assert_eq!(of([0.0, 600.0], 6.0), ["0", "100", "200", "300", "400", "500", "600"]);
        assert_eq!(of([-2.0, 2.0], 4.0), ["-2", "-1", "0", "1", "2"]);
    }
}
