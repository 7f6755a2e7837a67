//! Dividing points into parts by planes: by lines in the plane.

use crate::geometry::{Bounds, Point};
use crate::parallel::prelude::*;

/// A plane is put at the median of about this many points.
const SAMPLE: usize = 1 << 14;

/// The ranks of the points in `part_count` parts of about equal counts; fewer if no plane divides the
/// points.
///
/// The boxes of the parts do not meet. Each part keeps the order of the ranks.
pub(super) fn split<const D: usize>(
    points: &[Point<D>],
    ranks: Vec<u32>,
    part_count: usize,
) -> Vec<Vec<u32>> {
    if part_count < 2 {
        return vec![ranks];
    }
    let low_count = part_count / 2;
    match divide(points, &ranks, low_count as f64 / part_count as f64) {
        None => vec![ranks],
        Some((low, high)) => {
            drop(ranks);
            let (mut low, high) = rayon::join(
                || split(points, low, low_count),
                || split(points, high, part_count - low_count),
            );
            low.extend(high);
            low
        }
    }
}

/// Divides points by a plane across the longest side of their box, the given share below it; `None` if no
/// such plane leaves points on both sides.
fn divide<const D: usize>(
    points: &[Point<D>],
    ranks: &[u32],
    share: f64,
) -> Option<(Vec<u32>, Vec<u32>)> {
    let at = |rank: &u32| &points[*rank as usize];
    let extent = bounds(points, ranks)?.extent();
    let axis = (0..D).max_by(|&i, &j| extent[i].total_cmp(&extent[j]))?;
    let stride = ranks.len().div_ceil(SAMPLE);
    let mut sample: Vec<f64> = ranks.iter().step_by(stride).map(|rank| at(rank)[axis]).collect();
    let place = ((share * sample.len() as f64) as usize).min(sample.len() - 1);
    let plane = *sample.select_nth_unstable_by(place, f64::total_cmp).1;
    // A layer of a crystal may lie on the plane: it goes to the side that makes the counts more equal.
    let count = |is_low: fn(f64, f64) -> bool| {
        ranks.iter().filter(|rank| is_low(at(rank)[axis], plane)).count()
    };
    let (below, up_to) =
        rayon::join(|| count(|x, plane| x < plane), || count(|x, plane| x <= plane));
    let wanted = share * ranks.len() as f64;
    let off = |count: usize| {
        if count == 0 || count == ranks.len() {
            f64::INFINITY
        } else {
            (count as f64 - wanted).abs()
        }
    };
    if off(below).min(off(up_to)).is_infinite() {
        return None;
    }
    let with_plane = off(up_to) < off(below);
    let is_low = |rank: &u32| {
        let x = at(rank)[axis];
        x < plane || with_plane && x == plane
    };
    let those = |low: bool| ranks.iter().copied().filter(|rank| is_low(rank) == low).collect();
    Some(rayon::join(|| those(true), || those(false)))
}

/// The box of the points with these ranks; `None` if there are none.
fn bounds<const D: usize>(points: &[Point<D>], ranks: &[u32]) -> Option<Bounds<D>> {
    let of = |ranks: &[u32]| {
        let first = &points[*ranks.first()? as usize];
        let mut bounds = Bounds { min: *first, max: *first };
        ranks.iter().for_each(|rank| bounds.include(&points[*rank as usize]));
        Some(bounds)
    };
    let both = |mut a: Bounds<D>, b: Bounds<D>| {
        a.include(&b.min);
        a.include(&b.max);
        a
    };
    ranks.par_chunks(SAMPLE).filter_map(of).reduce_with(both)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::delaunay::tests::{cubic, scatter};

    fn boxes(points: &[Point<3>], parts: &[Vec<u32>]) -> Vec<Bounds<3>> {
        let of = |part: &Vec<u32>| {
            let points: Vec<Point<3>> = part.iter().map(|&rank| points[rank as usize]).collect();
            Bounds::of(&points).unwrap()
        };
        parts.iter().map(of).collect()
    }

    #[test]
    fn parts_hold_all_points_about_evenly_in_boxes_apart() {
        for points in [scatter::<3>(5000, 1), cubic(16)] {
            for count in 1..=9 {
                let parts = split(&points, (0..points.len() as u32).collect(), count);
                assert_eq!(parts.len(), count);
                for (i, one) in boxes(&points, &parts).iter().enumerate() {
                    assert!(parts[i].is_sorted());
                    for other in &boxes(&points, &parts)[i + 1..] {
                        let apart =
                            |k: usize| one.max[k] < other.min[k] || other.max[k] < one.min[k];
                        assert!((0..3).any(apart), "{one:?} {other:?}");
                    }
                    // A plane of the crystal has 1/17 of its points.
                    let share = parts[i].len() * count;
                    assert!(share.abs_diff(points.len()) < points.len() / 2, "{share}");
                }
                let mut all = parts.concat();
                all.sort_unstable();
                assert!(all.iter().copied().eq(0..points.len() as u32));
            }
        }
    }

    #[test]
    fn points_on_one_plane_across_their_longest_side_stay_together() {
        let points = [[0.0, 0.0, 1.0]; 3];
        assert_eq!(split(&points, vec![0, 1, 2], 4), [vec![0, 1, 2]]);
        assert!(split::<3>(&[], vec![], 4).concat().is_empty());
    }
}
