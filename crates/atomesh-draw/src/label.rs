//! The few letters that name slices, as strokes: no font is needed, and PNG and SVG agree.

use crate::picture::{Place, Rect, Shape};

/// The height of a letter in pixels; its width is 0.7 of it.
const HEIGHT: f64 = 13.0;
const WIDTH: f64 = 0.7 * HEIGHT;

/// From one letter to the next, and from the letters to the border of their box.
const ADVANCE: f64 = WIDTH + 4.0;
const MARGIN: f64 = 6.0;

/// The strokes of a letter in a unit square, y down.
fn strokes(letter: char) -> &'static [[Place; 2]] {
    match letter {
        'X' => &[[[0.0, 0.0], [1.0, 1.0]], [[1.0, 0.0], [0.0, 1.0]]],
        'Y' => &[[[0.0, 0.0], [0.5, 0.5]], [[0.5, 0.5], [1.0, 0.0]], [[0.5, 0.5], [0.5, 1.0]]],
        'Z' => &[[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [1.0, 1.0]]],
        '-' => &[[[0.2, 0.5], [0.8, 0.5]]],
        _ => &[],
    }
}

/// A white box with black letters (X, Y, Z, -) in the upper right corner of `panel`.
pub(crate) fn label(text: &str, panel: &Rect) -> [Shape; 2] {
    let size = [text.len() as f64 * ADVANCE - 4.0 + 2.0 * MARGIN, HEIGHT + 2.0 * MARGIN];
    let corner = [panel.corner[0] + panel.size[0] - size[0], panel.corner[1]];
    let mut lines = Vec::new();
    for (i, letter) in text.chars().enumerate() {
        let [x, y] = [corner[0] + MARGIN + i as f64 * ADVANCE, corner[1] + MARGIN];
        let place = |p: Place| [x + p[0] * WIDTH, y + p[1] * HEIGHT];
        lines.extend(strokes(letter).iter().map(|s| s.map(place)));
    }
    [
        Shape::Fill { rect: Rect { corner, size }, color: [255; 3] },
        Shape::Lines { lines, width: 1.8, color: [0; 3] },
    ]
}
