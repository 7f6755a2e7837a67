//! Polygons and lines clipped to a rectangle.

use crate::shape::{Place, Rect};

/// The part of a polygon within a rectangle, by clipping with one side after another (Sutherland & Hodgman 1974). Parts of
/// a non-convex polygon stay joined by lines without area along the sides.
pub(super) fn polygon(corners: &[Place], rect: &Rect) -> Vec<Place> {
    let mut kept = corners.to_vec();
    for side in 0..4 {
        let inside = |p: &Place| depth(p, rect, side) >= 0.0;
        let before = std::mem::take(&mut kept);
        for (i, q) in before.iter().enumerate() {
            let p = &before[(i + before.len() - 1) % before.len()];
            if inside(p) != inside(q) {
                kept.push(crossing(p, q, rect, side));
            }
            if inside(q) {
                kept.push(*q);
            }
        }
    }
    kept
}

/// The part of a line within a rectangle, if there is any.
pub(super) fn line([mut a, mut b]: [Place; 2], rect: &Rect) -> Option<[Place; 2]> {
    for side in 0..4 {
        match [&a, &b].map(|p| depth(p, rect, side) >= 0.0) {
            [true, true] => {}
            [false, false] => return None,
            [false, true] => a = crossing(&a, &b, rect, side),
            [true, false] => b = crossing(&a, &b, rect, side),
        }
    }
    Some([a, b])
}

/// The distance of a place inward from a side: left, top, right, bottom.
fn depth(p: &Place, rect: &Rect, side: usize) -> f64 {
    let k = side % 2;
    if side < 2 { p[k] - rect.corner[k] } else { rect.corner[k] + rect.size[k] - p[k] }
}

fn crossing(p: &Place, q: &Place, rect: &Rect, side: usize) -> Place {
    let (from, to) = (depth(p, rect, side), depth(q, rect, side));
    let share = from / (from - to);
    let k = side % 2;
    let mut place: Place = std::array::from_fn(|k| p[k] + share * (q[k] - p[k]));
    place[k] = rect.corner[k] + if side < 2 { 0.0 } else { rect.size[k] };
    place
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const RECT: Rect = Rect { corner: [1.0, 2.0], size: [4.0, 3.0] };

    fn area(polygon: &[Place]) -> f64 {
        let next = |i: usize| &polygon[(i + 1) % polygon.len()];
        let cross = |(i, p): (usize, &Place)| p[0] * next(i)[1] - p[1] * next(i)[0];
        polygon.iter().enumerate().map(cross).sum::<f64>() / 2.0
    }

    #[test]
    fn a_square_over_a_corner_leaves_a_quarter() {
        let square = [[0.0, 1.0], [2.0, 1.0], [2.0, 3.0], [0.0, 3.0]];
        assert_eq!(area(&polygon(&square, &RECT)), 1.0);
        assert_eq!(polygon(&square.map(|p| p.map(|x| x - 5.0)), &RECT), Vec::<Place>::new());
        assert_eq!(polygon(&[], &RECT), Vec::<Place>::new());
    }

    proptest! {
        #[test]
        fn what_is_kept_lies_within_and_what_lies_within_is_kept(
            corners in prop::collection::vec(prop::array::uniform2(-1.0..8.0), 3..8),
        ) {
            let kept = polygon(&corners, &RECT);
            let within = |p: &Place| (0..4).all(|side| depth(p, &RECT, side) >= 0.0);
            prop_assert!(kept.iter().all(within));
            prop_assert!(corners.iter().filter(|p| within(p)).all(|p| kept.contains(p)));
            // cut along a line, the parts add up: 1e-12 of areas up to 81 is rounding
            let [left, right] = [(1.0, 2.0), (3.0, 2.0)].map(|(x, width)| {
                let half = Rect { corner: [x, 2.0], size: [width, 3.0] };
                area(&polygon(&corners, &half))
            });
            prop_assert!((left + right - area(&kept)).abs() < 1e-10);
            let cut = line([corners[0], corners[1]], &RECT);
            prop_assert!(cut.is_none_or(|ends| ends.iter().all(within)));
            prop_assert!(cut.is_some() || !(within(&corners[0]) || within(&corners[1])));
        }
    }
}
