//! The three slices of a picture of something in space: where they are, and how they cut cells.

use atomesh::geometry::Point;

use crate::shape::Place;

/// Pixels between panels.
pub(crate) const GAP: f64 = 4.0;

/// The colour of the lines where the other slices pass.
pub(crate) const CROSS_HAIR: [u8; 3] = [230, 0, 0];

/// A slice: its name, the axis it is normal to, and the axes drawn to the right and down.
pub(crate) struct Slice {
    pub name: &'static str,
    pub normal: usize,
    pub right: usize,
    pub down: usize,
}

/// The slices in the paper's places: X-Y upper right, Y-Z lower left, X-Z lower right, so that x is
/// shared by the right panels and z by the lower ones.
pub(crate) const SLICES: [(Slice, [usize; 2]); 3] = [
    (Slice { name: "X-Y", normal: 2, right: 0, down: 1 }, [1, 0]),
    (Slice { name: "Y-Z", normal: 0, right: 1, down: 2 }, [0, 1]),
    (Slice { name: "X-Z", normal: 1, right: 0, down: 2 }, [1, 1]),
];

/// Lines to a hundredth of a pixel, each once and none without length, in order: faces around an edge that lies
/// in a plane share their cut.
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

/// A plane at a constant coordinate. Points exactly on it count as one side, so that no face is cut in
/// a corner: as above, except on the first plane, below which there is nothing.
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
