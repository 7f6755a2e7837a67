//! Functions of one variable as curves, side by side, as in figure 3 of Hale (2001).

use crate::label::lettering;
use crate::picture::Picture;
use crate::shape::{Place, Rect, Shape};
use crate::ticks::{number, ticks};

/// The size of one panel, and the room around its frame: left, right, above, below.
const SIZE: Place = [460.0, 360.0];
const ROOM: [f64; 4] = [64.0, 20.0, 16.0, 40.0];

/// Straight pieces of a curve.
const PIECES: usize = 400;

/// The part of the range of values that stays free below and above a curve.
const FREE: f64 = 0.06;

/// The height of numbers, the widths of strokes and curves, and the length of ticks, in pixels.
const LETTER: f64 = 11.0;
const STROKE: f64 = 1.3;
const WIDTH: f64 = 2.2;
const TICK: f64 = 5.0;

/// About how many numbers there are along an axis.
const TICKS: f64 = 4.0;

/// A function over a range.
pub struct Curve<'a> {
    /// Gives the value at a place; values that are not finite leave a gap.
    pub function: &'a dyn Fn(f64) -> f64,
    /// The first and the last place, the first below the last.
    pub range: [f64; 2],
}

/// Draws functions, a panel for each from left to right. The axis of values reaches as far as the values and zero; a thin
/// line marks zero.
pub fn draw_curves(curves: &[Curve<'_>]) -> Picture {
    let mut picture = Picture::new([SIZE[0] * curves.len().max(1) as f64, SIZE[1]]);
    for (i, curve) in curves.iter().enumerate() {
        let corner = [i as f64 * SIZE[0] + ROOM[0], ROOM[2]];
        let size = [SIZE[0] - ROOM[0] - ROOM[1], SIZE[1] - ROOM[2] - ROOM[3]];
        picture.shapes.extend(panel(curve, Rect { corner, size }));
    }
    picture
}

fn panel(curve: &Curve<'_>, rect: Rect) -> [Shape; 3] {
    let [from, to] = curve.range;
    let at = |i: usize| from + (to - from) * i as f64 / PIECES as f64;
    let values: Vec<f64> = (0..=PIECES).map(|i| (curve.function)(at(i))).collect();
    let finite = values.iter().copied().filter(|v| v.is_finite());
    let [low, high] = finite.fold([0.0_f64; 2], |[low, high], v| [low.min(v), high.max(v)]);
    let free = if high > low { FREE * (high - low) } else { 1.0 };
    let [low, high] = [low - free, high + free];
    let place = |x: f64, y: f64| -> Place {
        let shares = [(x - from) / (to - from), (high - y) / (high - low)];
        std::array::from_fn(|k| rect.corner[k] + rect.size[k] * shares[k])
    };

    let corners = [place(from, low), place(to, low), place(to, high), place(from, high)];
    let mut frame: Vec<[Place; 2]> = (0..4).map(|k| [corners[k], corners[(k + 1) % 4]]).collect();
    for x in ticks([from, to], TICKS) {
        let foot = place(x, low);
        frame.push([foot, [foot[0], foot[1] + TICK]]);
        let text = number(x);
        let corner = [foot[0] - 0.5 * width(&text), foot[1] + 2.0 * TICK];
        frame.extend(lettering(&text, corner, LETTER));
    }
    for y in ticks([low, high], TICKS) {
        let foot = place(from, y);
        frame.push([[foot[0] - TICK, foot[1]], foot]);
        let text = number(y);
        let corner = [foot[0] - 2.0 * TICK - width(&text), foot[1] - 0.5 * LETTER];
        frame.extend(lettering(&text, corner, LETTER));
    }
    let steps = values.windows(2).enumerate().filter(|(_, v)| v.iter().all(|v| v.is_finite()));
    let lines = steps.map(|(i, v)| [place(at(i), v[0]), place(at(i + 1), v[1])]).collect();
    let zero = vec![[place(from, 0.0), place(to, 0.0)]];
    [
        Shape::Lines { lines: zero, width: 1.0, color: [190; 3] },
        Shape::Lines { lines: frame, width: STROKE, color: [0; 3] },
        Shape::Lines { lines, width: WIDTH, color: [0; 3] },
    ]
}

/// The width of a text as [`lettering`] writes it.
fn width(text: &str) -> f64 {
    (text.len() as f64 - 1.0) * 0.82 * LETTER + 0.5 * LETTER
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_passes_through_its_values_and_leaves_gaps() {
        let line =
            Curve { function: &|x| if x < 0.5 { 2.0 * x } else { f64::NAN }, range: [0.0, 1.0] };
        let picture = draw_curves(&[line]);
        assert_eq!((picture.width(), picture.height()), (460, 360));
        let Shape::Lines { lines, .. } = &picture.shapes[2] else { panic!("a curve") };
        assert_eq!(lines.len(), PIECES / 2 - 1);
        // values from 0 to nearly 1 with 6 % free on both sides: 0 stands 6/112 above the bottom of 304 pixels
        let [start, end] = [lines[0][0], lines[lines.len() - 1][1]];
        assert!(
            (start[0] - 64.0).abs() < 1e-9
                && (start[1] - (320.0 - 304.0 * 6.0 / 112.0)).abs() < 0.1
        );
        assert!(
            end[1] < start[1] && (end[1] - (16.0 + 304.0 * 6.0 / 112.0)).abs() < 0.1,
            "{end:?}"
        );
    }

    #[test]
    fn nothing_leaves_the_picture() {
        let wave = Curve { function: &f64::sin, range: [-10.0, 10.0] };
        let flat = Curve { function: &|_| 0.0, range: [0.0, 1e-3] };
        let picture = draw_curves(&[wave, flat]);
        let (width, height) = (f64::from(picture.width()), f64::from(picture.height()));
        for shape in &picture.shapes {
            let Shape::Lines { lines, .. } = shape else { panic!("{shape:?}") };
            let within =
                |p: &Place| (0.0..=width).contains(&p[0]) && (0.0..=height).contains(&p[1]);
            assert!(lines.iter().flatten().all(within));
        }
    }
}
