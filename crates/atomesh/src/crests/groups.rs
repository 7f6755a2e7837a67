//! Which points on features count: those of groups that are strong and large enough.
//!
//! Points are linked if their samples touch, at corners too. Cost: O(n) for n points in the order of their samples;
//! memory: some bytes a point, none a sample.

use super::FeaturePoint;
use crate::geometry::Sets;
use crate::image::{coordinates, neighbour};

/// Which linked points are kept (Canny 1986): weak ones only where they are linked to a strong one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hysteresis {
    /// The least strength of a point.
    pub low: f64,
    /// The least strength of the strongest point of a group.
    pub high: f64,
    /// The fewest points of a group.
    pub least_count: usize,
}

/// The points of groups that are at least `low` throughout, reach `high` somewhere and have `least_count` members.
///
/// Returned in the order of their samples.
pub fn linked<const D: usize>(
    mut points: Vec<FeaturePoint<D>>,
    shape: [usize; D],
    limits: Hysteresis,
) -> Vec<FeaturePoint<D>> {
    points.retain(|point| point.strength >= limits.low);
    points.sort_by_key(|point| point.index); // stable, and quick where they are in order
    let roots = group_roots(&points, shape);
    let mut groups = vec![Group { count: 0, strongest: 0.0 }; points.len()];
    for (point, &root) in points.iter().zip(&roots) {
        let group = &mut groups[root as usize];
        group.count += 1;
        group.strongest = group.strongest.max(point.strength);
    }
    let mut roots = roots.iter();
    points.retain(|_| {
        let Some(&root) = roots.next() else { return false };
        let group = groups[root as usize];
        group.count >= limits.least_count && group.strongest >= limits.high
    });
    points
}

/// The points of groups large enough for edges of `size` samples to follow them: of 4 d points or more in the plane,
/// 6 d² in space, d being `size`.
pub fn in_large_groups<const D: usize>(
    points: Vec<FeaturePoint<D>>,
    shape: [usize; D],
    size: f64,
) -> Vec<FeaturePoint<D>> {
    let least = if D == 2 { 4.0 * size } else { 6.0 * size * size };
    linked(points, shape, Hysteresis { low: 0.0, high: 0.0, least_count: least.ceil() as usize })
}

/// The points stronger than `share` of the strongest tenth's least strength.
///
/// Smoothing takes much of the depth of thin features, so that no fixed strength tells features from background.
pub fn strongest<const D: usize>(
    mut points: Vec<FeaturePoint<D>>,
    share: f32,
) -> Vec<FeaturePoint<D>> {
    let least = f64::from(share * strongest_tenth(&points));
    points.retain(|point| point.strength > least);
    points
}

/// The least strength of the strongest tenth of points; 0 of none.
pub(crate) fn strongest_tenth<const D: usize>(points: &[FeaturePoint<D>]) -> f32 {
    if points.is_empty() {
        return 0.0;
    }
    let mut strengths: Vec<f32> = points.iter().map(|point| point.strength as f32).collect();
    let place = strengths.len() * 9 / 10;
    *strengths.select_nth_unstable_by(place, f32::total_cmp).1
}

/// A group of linked points.
#[derive(Clone, Copy)]
struct Group {
    count: usize,
    /// The strength of its strongest point.
    strongest: f64,
}

/// For each point, in the order of their samples, the first of its group.
fn group_roots<const D: usize>(points: &[FeaturePoint<D>], shape: [usize; D]) -> Vec<u32> {
    let mut groups = Sets::new(points.len());
    // each neighbour's place in the list advances as the point's own does
    let mut places = vec![0; 3usize.pow(D as u32) / 2];
    for (i, point) in points.iter().enumerate() {
        if i > 0 && points[i - 1].index == point.index {
            groups.join(i as u32 - 1, i as u32);
        }
        let sample = coordinates(point.index, shape);
        for (code, place) in places.iter_mut().enumerate() {
            let Some(index) = neighbour(sample, shape, code) else { continue };
            while points[*place].index < index {
                *place += 1; // ends at the point itself at the latest
            }
            if points[*place].index == index {
                groups.join(*place as u32, i as u32);
            }
        }
    }
    groups.roots()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at<const D: usize>(sample: [usize; D], shape: [usize; D], strength: f64) -> FeaturePoint<D> {
        FeaturePoint {
            index: (0..D).rev().fold(0, |index, k| index * shape[k] + sample[k]),
            position: sample.map(|i| i as f64),
            normal: std::array::from_fn(|k| if k == 0 { 1.0 } else { 0.0 }),
            strength,
        }
    }

    fn limits(low: f64, high: f64, least_count: usize) -> Hysteresis {
        Hysteresis { low, high, least_count }
    }

    fn kept<const D: usize>(
        points: &[([usize; D], f64)],
        shape: [usize; D],
        limits: Hysteresis,
    ) -> Vec<usize> {
        let points = points.iter().map(|&(sample, s)| at(sample, shape, s)).collect();
        linked(points, shape, limits).iter().map(|point| point.index).collect()
    }

    #[test]
    fn groups_are_linked_by_corners_and_not_across_the_border() {
        let shape = [4, 4];
        // a diagonal of three, and two alone: (3, 0) follows (0, 1) in memory only
        let points = [([3, 3], 1.0), ([0, 0], 1.0), ([3, 0], 1.0), ([1, 2], 1.0), ([0, 1], 1.0)];
        assert_eq!(kept(&points, shape, limits(0.0, 0.0, 3)), [0, 4, 9]);
        assert_eq!(kept(&points, shape, limits(0.0, 0.0, 4)), [0usize; 0]);
        // a V, whose arms are two groups until its tip joins them
        let points = [([0, 0], 1.0), ([2, 0], 1.0), ([1, 1], 1.0)];
        assert_eq!(kept(&points, shape, limits(0.0, 0.0, 3)), [0, 2, 5]);
    }

    #[test]
    fn groups_in_space_meet_at_corners() {
        let shape = [3, 3, 3];
        let points = [([0, 0, 0], 1.0), ([1, 1, 1], 1.0), ([2, 0, 2], 1.0), ([0, 0, 2], 1.0)];
        assert_eq!(kept(&points, shape, limits(0.0, 0.0, 4)).len(), 4);
        let apart = [([0, 0, 0], 1.0), ([2, 0, 0], 1.0), ([0, 1, 0], 1.0), ([2, 2, 2], 1.0)];
        assert_eq!(kept(&apart, shape, limits(0.0, 0.0, 2)), [0, 3]);
    }

    #[test]
    fn weak_members_stay_where_a_strong_one_is_in_the_group() {
        let shape = [9, 1];
        let strengths = [0.3, 0.9, 0.3, 0.1, 0.3, 0.5, 0.0, 0.95, 0.0];
        let points: Vec<_> = strengths.iter().enumerate().map(|(x, &s)| ([x, 0], s)).collect();
        assert_eq!(kept(&points, shape, limits(0.3, 0.9, 1)), [0, 1, 2, 7]);
        assert_eq!(kept(&points, shape, limits(0.3, 0.9, 2)), [0, 1, 2]);
        assert_eq!(kept(&points, shape, limits(0.3, 0.96, 1)), [0usize; 0]);
    }

    #[test]
    fn points_of_one_sample_are_one_group() {
        let points = vec![at([1, 1], [3, 3], 0.5), at([1, 1], [3, 3], 1.0)];
        assert_eq!(linked(points, [3, 3], limits(0.0, 1.0, 2)).len(), 2);
    }

    #[test]
    fn large_groups_have_four_points_an_edge_in_the_plane_and_six_a_square_in_space() {
        let row: Vec<_> = (0..9).map(|x| at([x, 0], [9, 1], 0.1)).collect();
        assert_eq!(in_large_groups(row.clone(), [9, 1], 2.25).len(), 9);
        assert_eq!(in_large_groups(row, [9, 1], 2.26).len(), 0);
        let sheet: Vec<_> = (0..24).map(|i| at([i % 6, i / 6, 0], [6, 4, 1], 0.1)).collect();
        assert_eq!(in_large_groups(sheet.clone(), [6, 4, 1], 2.0).len(), 24);
        assert_eq!(in_large_groups(sheet, [6, 4, 1], 2.01).len(), 0);
    }

    #[test]
    fn strength_is_measured_against_the_strongest_tenth() {
        let points: Vec<_> = (1..=20).map(|i| at([i, 0], [21, 1], i as f64)).collect();
        // the strongest tenth are 19 and 20
        let kept = strongest(points, 0.5);
        assert!(kept.iter().all(|point| point.strength > 9.5) && kept.len() == 11);
        assert!(strongest::<2>(Vec::new(), 0.5).is_empty());
    }
}
