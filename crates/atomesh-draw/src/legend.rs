//! The legend: beside a picture, a bar of colours with its name and the numbers at its ends and middle.

use crate::color_map::{ColorMap, LEVELS, Range};
use crate::label::lettering;
use crate::picture::Picture;
use crate::shape::{Place, Rect, Shape};

/// The width in pixels that bars add to a picture, and the blank around them.
const STRIP: u32 = 104;
const MARGIN: f64 = 10.0;

/// The width of a bar, its greatest height, and the least height of a picture per bar.
const WIDTH: f64 = 14.0;
const TALLEST: f64 = 180.0;
const LEAST: u32 = 120;

/// The height of letters and the width of their strokes.
const LETTER: f64 = 9.0;
const STROKE: f64 = 1.3;

/// A bar of the colours of a range.
pub(crate) struct Bar {
    /// Its name, in capitals that [`lettering`] knows.
    pub name: &'static str,
    pub map: ColorMap,
    pub range: Range,
}

/// Puts bars to the right of a picture, which becomes wider, and as high as they need. Without bars it stays as it is.
pub(crate) fn put_beside(picture: &mut Picture, bars: &[Bar]) {
    if bars.is_empty() {
        return;
    }
    let left = f64::from(picture.width) + MARGIN;
    picture.width += STRIP;
    picture.height = picture.height.max(LEAST * bars.len() as u32);
    let each = f64::from(picture.height) / bars.len() as f64;
    for (i, bar) in bars.iter().enumerate() {
        let corner = [left, each * i as f64 + MARGIN + 2.0 * LETTER];
        let height = TALLEST.min(each - 2.0 * (MARGIN + LETTER) - LETTER);
        picture.shapes.extend(shapes(bar, Rect { corner, size: [WIDTH, height] }));
    }
}

fn shapes(bar: &Bar, rect: Rect) -> Vec<Shape> {
    let [x, y] = rect.corner;
    let level = rect.size[1] / LEVELS as f64;
    let slab = |i: usize| {
        let corner = [x, y + rect.size[1] - (i + 1) as f64 * level];
        let color = bar.map.at((i as f64 + 0.5) / LEVELS as f64);
        // overlaps half of the one below, so that no seam shows; the lowest stays within the bar
        let height = if i == 0 { level } else { 1.5 * level };
        Shape::Fill { rect: Rect { corner, size: [WIDTH, height] }, color }
    };
    let mut shapes: Vec<Shape> = (0..LEVELS).rev().map(slab).collect();
    let mut lines: Vec<[Place; 2]> = lettering(bar.name, [x, y - 2.0 * LETTER], LETTER);
    for share in [0.0, 0.5, 1.0] {
        let at = y + rect.size[1] * (1.0 - share);
        let number = bar.range.low + share * (bar.range.high - bar.range.low);
        lines.push([[x + WIDTH, at], [x + WIDTH + 4.0, at]]);
        lines.extend(lettering(&short(number), [x + WIDTH + 8.0, at - 0.5 * LETTER], LETTER));
    }
    shapes.push(Shape::Lines { lines, width: STROKE, color: [0; 3] });
    shapes
}

/// A number with three significant digits.
fn short(number: f64) -> String {
    let digits = format!("{number:.2e}");
    let exponent: i32 =
        digits.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0);
    match exponent {
        _ if number == 0.0 => "0".to_owned(),
        -3..=3 => format!("{number:.*}", (2 - exponent).max(0) as usize),
        _ => digits.to_uppercase(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits_that_count() {
        for (number, text) in [
            (0.0, "0"),
            (0.617_4, "0.617"),
            (-1.0, "-1.00"),
            (12.345, "12.3"),
            (9_994.0, "9994"),
            (9_999.4, "1.00E4"),
            (1.5e6, "1.50E6"),
            (-2e-9, "-2.00E-9"),
        ] {
            assert_eq!(short(number), text);
        }
    }

    #[test]
    fn all_letters_of_names_and_numbers_are_known_and_stay_within_the_strip() {
        for text in ["ABCDEFGHIJKLMNOPQRSTUVWXYZ", "0123456789", "-._"] {
            for letter in text.chars() {
                let strokes = lettering(&letter.to_string(), [0.0; 2], LETTER);
                assert!(!strokes.is_empty(), "{letter}");
            }
        }
        let mut picture = Picture::new([50.0, 30.0]);
        let range = Range { low: -1.25e-100, high: 1.0 };
        let bar = |name| Bar { name, map: crate::color_map::VIRIDIS, range };
        put_beside(&mut picture, &[bar("PRESSURE"), bar("TIME")]);
        assert_eq!((picture.width, picture.height), (154, 240));
        let within = |p: &Place| p[0] <= 154.0 && (0.0..=240.0).contains(&p[1]) && p[0] >= 50.0;
        for shape in &picture.shapes {
            match shape {
                Shape::Lines { lines, .. } => assert!(lines.iter().flatten().all(within)),
                Shape::Fill { rect, .. } => assert!(within(&rect.corner)),
                _ => panic!("{shape:?}"),
            }
        }
        let fills = picture.shapes.iter().filter(|shape| matches!(shape, Shape::Fill { .. }));
        assert_eq!(fills.count(), 2 * LEVELS);
    }
}
