//! Dividing points into parts by planes.

use crate::geometry::{Bounds, Point};

/// A plane's place is the median of about so many points.
const SAMPLE: usize = 1 << 14;

/// The ranks of the points in so many parts of about equal counts; fewer where no plane divides the
/// points.
///
/// The boxes of the parts do not meet. Each part keeps the order of the ranks.
pub(super) fn split(points: &[Point<3>], ranks: Vec<u32>, part_count: usize) -> Vec<Vec<u32>> {
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

/// Divides by a plane across the longest side of their box, a share below; `None` if no plane across
/// this side leaves points on both sides.
fn divide(points: &[Point<3>], ranks: &[u32], share: f64) -> Option<(Vec<u32>, Vec<u32>)> {
    let at = |rank: &u32| &points[*rank as usize];
    let mut bounds = Bounds { min: *at(ranks.first()?), max: *at(ranks.first()?) };
    ranks.iter().for_each(|rank| bounds.include(at(rank)));
    let extent = bounds.extent();
    let axis = (0..3).max_by(|&i, &j| extent[i].total_cmp(&extent[j]))?;
    let stride = ranks.len().div_ceil(SAMPLE);
    let mut sample: Vec<f64> = ranks.iter().step_by(stride).map(|rank| at(rank)[axis]).collect();
    let place = ((share * sample.len() as f64) as usize).min(sample.len() - 1);
    let plane = *sample.select_nth_unstable_by(place, f64::total_cmp).1;
    // A layer of a crystal may lie on the plane: it goes where it leaves the parts more alike.
    let count =
        |is_low: &dyn Fn(f64) -> bool| ranks.iter().filter(|rank| is_low(at(rank)[axis])).count();
    let below = count(&|x| x < plane);
    let up_to = count(&|x| x <= plane);
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
    Some(ranks.iter().partition(|rank| {
        let x = at(rank)[axis];
        x < plane || with_plane && x == plane
    }))
}
