//! Capital letters and digits as strokes: no font is needed, and PNG and SVG agree.

use crate::shape::{Place, Rect, Shape};

/// The height of a letter in pixels; its width is 0.7 of it.
const HEIGHT: f64 = 13.0;
const WIDTH: f64 = 0.7 * HEIGHT;

/// From one letter to the next, and from the letters to the border of their box.
const ADVANCE: f64 = WIDTH + 4.0;
const MARGIN: f64 = 6.0;

/// The strokes that most letters share.
const TOP: [Place; 2] = [[0.0, 0.0], [1.0, 0.0]];
const MIDDLE: [Place; 2] = [[0.0, 0.5], [1.0, 0.5]];
const BOTTOM: [Place; 2] = [[0.0, 1.0], [1.0, 1.0]];
const LEFT_UP: [Place; 2] = [[0.0, 0.0], [0.0, 0.5]];
const LEFT_DOWN: [Place; 2] = [[0.0, 0.5], [0.0, 1.0]];
const RIGHT_UP: [Place; 2] = [[1.0, 0.0], [1.0, 0.5]];
const RIGHT_DOWN: [Place; 2] = [[1.0, 0.5], [1.0, 1.0]];
const SLOPES: [[Place; 2]; 2] = [[[0.0, 0.0], [0.5, 0.5]], [[0.5, 0.5], [1.0, 0.0]]];

/// A ring with its corners cut.
const RING: [[Place; 2]; 8] = [
    [[0.3, 0.0], [0.7, 0.0]],
    [[0.7, 0.0], [1.0, 0.3]],
    [[1.0, 0.3], [1.0, 0.7]],
    [[1.0, 0.7], [0.7, 1.0]],
    [[0.7, 1.0], [0.3, 1.0]],
    [[0.3, 1.0], [0.0, 0.7]],
    [[0.0, 0.7], [0.0, 0.3]],
    [[0.0, 0.3], [0.3, 0.0]],
];

/// The strokes of a letter in a unit square, y down; none of what is not known.
fn strokes(letter: char) -> &'static [[Place; 2]] {
    match letter {
        'X' => &[[[0.0, 0.0], [1.0, 1.0]], [[1.0, 0.0], [0.0, 1.0]]],
        'Y' => &[[[0.0, 0.0], [0.5, 0.5]], [[0.5, 0.5], [1.0, 0.0]], [[0.5, 0.5], [0.5, 1.0]]],
        'Z' => &[[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [1.0, 1.0]]],
        '-' => &[[[0.2, 0.5], [0.8, 0.5]]],
        '.' => &[[[0.4, 1.0], [0.5, 1.0]]],
        '0' => &[TOP, BOTTOM, LEFT_UP, LEFT_DOWN, RIGHT_UP, RIGHT_DOWN],
        '1' => &[[[0.2, 0.2], [0.5, 0.0]], [[0.5, 0.0], [0.5, 1.0]]],
        '2' => &[TOP, RIGHT_UP, MIDDLE, LEFT_DOWN, BOTTOM],
        '3' => &[TOP, RIGHT_UP, MIDDLE, RIGHT_DOWN, BOTTOM],
        '4' => &[LEFT_UP, MIDDLE, RIGHT_UP, RIGHT_DOWN],
        '5' | 'S' => &[TOP, LEFT_UP, MIDDLE, RIGHT_DOWN, BOTTOM],
        '6' => &[TOP, LEFT_UP, LEFT_DOWN, BOTTOM, RIGHT_DOWN, MIDDLE],
        '7' => &[TOP, [[1.0, 0.0], [0.4, 1.0]]],
        '8' => &[TOP, MIDDLE, BOTTOM, LEFT_UP, LEFT_DOWN, RIGHT_UP, RIGHT_DOWN],
        '9' => &[MIDDLE, LEFT_UP, TOP, RIGHT_UP, RIGHT_DOWN, BOTTOM],
        'A' => &[
            [[0.0, 1.0], [0.0, 0.3]],
            [[0.0, 0.3], [0.5, 0.0]],
            [[0.5, 0.0], [1.0, 0.3]],
            [[1.0, 0.3], [1.0, 1.0]],
            [[0.0, 0.6], [1.0, 0.6]],
        ],
        'B' => &[
            LEFT_UP,
            LEFT_DOWN,
            [[0.0, 0.0], [0.7, 0.0]],
            [[0.7, 0.0], [0.9, 0.25]],
            [[0.9, 0.25], [0.7, 0.5]],
            [[0.7, 0.5], [0.0, 0.5]],
            [[0.7, 0.5], [1.0, 0.75]],
            [[1.0, 0.75], [0.7, 1.0]],
            [[0.7, 1.0], [0.0, 1.0]],
        ],
        'C' => &[TOP, BOTTOM, LEFT_UP, LEFT_DOWN],
        'D' => &[
            LEFT_UP,
            LEFT_DOWN,
            [[0.0, 0.0], [0.6, 0.0]],
            [[0.6, 0.0], [1.0, 0.35]],
            [[1.0, 0.35], [1.0, 0.65]],
            [[1.0, 0.65], [0.6, 1.0]],
            [[0.6, 1.0], [0.0, 1.0]],
        ],
        'E' => &[TOP, MIDDLE, BOTTOM, LEFT_UP, LEFT_DOWN],
        'F' => &[TOP, MIDDLE, LEFT_UP, LEFT_DOWN],
        'G' => &[TOP, BOTTOM, LEFT_UP, LEFT_DOWN, RIGHT_DOWN, [[0.5, 0.5], [1.0, 0.5]]],
        'H' => &[LEFT_UP, LEFT_DOWN, RIGHT_UP, RIGHT_DOWN, MIDDLE],
        'I' => &[[[0.5, 0.0], [0.5, 1.0]]],
        'J' => &[RIGHT_UP, RIGHT_DOWN, BOTTOM, [[0.0, 0.7], [0.0, 1.0]]],
        'K' => &[LEFT_UP, LEFT_DOWN, [[0.0, 0.5], [1.0, 0.0]], [[0.0, 0.5], [1.0, 1.0]]],
        'L' => &[LEFT_UP, LEFT_DOWN, BOTTOM],
        'M' => &[LEFT_UP, LEFT_DOWN, RIGHT_UP, RIGHT_DOWN, SLOPES[0], SLOPES[1]],
        'N' => &[LEFT_UP, LEFT_DOWN, RIGHT_UP, RIGHT_DOWN, [[0.0, 0.0], [1.0, 1.0]]],
        'O' => &RING,
        'P' => &[TOP, MIDDLE, LEFT_UP, LEFT_DOWN, RIGHT_UP],
        'Q' => &[
            RING[0],
            RING[1],
            RING[2],
            RING[3],
            RING[4],
            RING[5],
            RING[6],
            RING[7],
            [[0.6, 0.7], [1.0, 1.0]],
        ],
        'R' => &[TOP, MIDDLE, LEFT_UP, LEFT_DOWN, RIGHT_UP, [[0.5, 0.5], [1.0, 1.0]]],
        'T' => &[TOP, [[0.5, 0.0], [0.5, 1.0]]],
        'U' => &[LEFT_UP, LEFT_DOWN, BOTTOM, RIGHT_UP, RIGHT_DOWN],
        'V' => &[[[0.0, 0.0], [0.5, 1.0]], [[0.5, 1.0], [1.0, 0.0]]],
        'W' => &[
            [[0.0, 0.0], [0.2, 1.0]],
            [[0.2, 1.0], [0.5, 0.4]],
            [[0.5, 0.4], [0.8, 1.0]],
            [[0.8, 1.0], [1.0, 0.0]],
        ],
        '_' => &[BOTTOM],
        _ => &[],
    }
}

/// The strokes of a text of a height, narrower than in labels, from its upper left corner on.
pub(crate) fn lettering(text: &str, corner: Place, height: f64) -> Vec<[Place; 2]> {
    let (width, advance) = (0.5 * height, 0.82 * height);
    let of = |(i, letter): (usize, char)| {
        let place = move |p: Place| {
            [corner[0] + i as f64 * advance + p[0] * width, corner[1] + p[1] * height]
        };
        strokes(letter).iter().map(move |stroke| stroke.map(place))
    };
    text.chars().enumerate().flat_map(of).collect()
}

/// A white box with a text in black in the upper right corner of `panel`.
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
