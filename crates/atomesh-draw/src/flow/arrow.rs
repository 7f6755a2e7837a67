//! Vectors as arrows: their choice, their length and their outline.

use crate::shape::Place;

/// A vector on a canvas: where its middle is, where it points, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Vector {
    pub middle: Place,
    pub along: Place,
    /// The size of its cell: of vectors too near to each other that of the largest is drawn.
    pub weight: f64,
}

impl Vector {
    fn length(&self) -> f64 {
        self.along[0].hypot(self.along[1])
    }
}

/// The share of flowing cells that are at most as fast as a brisk flow.
const BRISK: f64 = 0.9;

/// Speeds up to this share of the fastest are rounding, as in a sealed compartment.
const STILL: f64 = 1e-9;

/// The speed of a brisk flow, the 90th percentile of the cells that flow; 0 if none does.
pub(super) fn brisk(speeds: impl Iterator<Item = f64>) -> f64 {
    let mut speeds: Vec<f64> = speeds.filter(|speed| speed.is_finite()).collect();
    let most = speeds.iter().copied().fold(0.0, f64::max);
    speeds.retain(|speed| *speed > STILL * most);
    if speeds.is_empty() {
        return 0.0;
    }
    let at = (BRISK * (speeds.len() - 1) as f64).round() as usize;
    *speeds.select_nth_unstable_by(at, f64::total_cmp).1
}

/// Vectors at least `spacing` apart: the heaviest first, of equals the earlier. Cost: O(n log n).
pub(super) fn thinned(mut vectors: Vec<Vector>, spacing: f64) -> Vec<Vector> {
    vectors.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    let bin = |p: &Place| p.map(|x| (x / spacing).floor() as i64);
    let mut kept: std::collections::BTreeMap<[i64; 2], Vec<Place>> =
        std::collections::BTreeMap::new();
    vectors.retain(|vector| {
        let [column, row] = bin(&vector.middle);
        let near = |p: &Place| (p[0] - vector.middle[0]).hypot(p[1] - vector.middle[1]) < spacing;
        let bins = (-1..=1).flat_map(|i| (-1..=1).map(move |j| [column + i, row + j]));
        let is_free = !bins.filter_map(|bin| kept.get(&bin)).flatten().any(near);
        if is_free {
            kept.entry([column, row]).or_default().push(vector.middle);
        }
        is_free
    });
    vectors
}

/// The width of a shaft, and of a head at its widest, in pixels; heads are as long as they are wide.
const SHAFT: f64 = 2.0;
const HEAD: f64 = 6.0;

/// The largest share of an arrow's length that its head takes.
const HEAD_SHARE: f64 = 0.55;

/// The arrow's outline, wider by `halo` on all sides: a shaft and a head, smaller if the arrow is short.
pub(super) fn outline(vector: &Vector, halo: f64) -> Vec<Place> {
    let length = vector.length();
    let along = vector.along.map(|x| x / length);
    let head = HEAD.min(HEAD_SHARE * length);
    let scale = head / HEAD;
    // a short arrow is thin, but never so thin that it vanishes
    let (shaft, wide) = (0.5 * SHAFT * scale.max(0.6) + halo, 0.5 * HEAD * scale.max(0.4) + halo);
    let (tail, neck, tip) =
        (-0.5 * length - halo, 0.5 * length - head - halo, 0.5 * length + 1.6 * halo);
    let place = |[ahead, aside]: [f64; 2]| -> Place {
        let [x, y] = vector.middle;
        [x + ahead * along[0] - aside * along[1], y + ahead * along[1] + aside * along[0]]
    };
    [
        [tail, -shaft],
        [neck, -shaft],
        [neck, -wide],
        [tip, 0.0],
        [neck, wide],
        [neck, shaft],
        [tail, shaft],
    ]
    .map(place)
    .to_vec()
}
