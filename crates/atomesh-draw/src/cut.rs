//! How a slice cuts cells.

use atomesh::geometry::Point;

use crate::shape::Place;

/// Lines rounded to a hundredth of a pixel, each once and none without length, in order: faces around an edge in the
/// plane of a slice share their cut.
pub(crate) fn unique(lines: impl Iterator<Item = [Place; 2]>) -> Vec<[Place; 2]> {
    let rounded = lines.map(|ends| {
        let [a, b] = ends.map(|p| p.map(|v| (v * 100.0).round() as i64));
        [a.min(b), a.max(b)]
    });
    let mut lines: Vec<[[i64; 2]; 2]> = rounded.filter(|[a, b]| a != b).collect();
    lines.sort_unstable();
    lines.dedup();
    lines.into_iter().map(|l| l.map(|p| p.map(|v| v as f64 / 100.0))).collect()
}

/// A plane at a constant coordinate. Points exactly on it count as above it, so that no face is cut in a corner; on the
/// first plane, below which there is nothing, they count as below.
#[derive(Clone, Copy)]
pub(crate) struct Level {
    pub value: f64,
    pub own_is_above: bool,
}

impl Level {
    pub fn is_below(&self, x: f64) -> bool {
        if self.own_is_above { x < self.value } else { x <= self.value }
    }

    /// The line in which the plane across axis `normal` cuts a convex polygon, if it does.
    pub fn cut(self, normal: usize, corners: &[Point<3>]) -> Option<[Point<3>; 2]> {
        let mut ends = (0..corners.len()).filter_map(|at| {
            let (p, q) = (corners[at], corners[(at + 1) % corners.len()]);
            if self.is_below(p[normal]) == self.is_below(q[normal]) {
                return None;
            }
            let share = (self.value - p[normal]) / (q[normal] - p[normal]);
            Some(std::array::from_fn(|k| p[k] + share * (q[k] - p[k])))
        });
        Some([ends.next()?, ends.next()?])
    }
}
