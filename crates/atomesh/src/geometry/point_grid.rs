//! Points that do not change, for asking which are near: in rows along the first axis, and by their place within each.

use std::ops::Range;

use crate::parallel::prelude::*;

use super::{Bounds, Point, distance_squared};

/// The most rows for each point.
const MOST_ROWS: usize = 16;
/// Blocks that one task works on.
const TASK: usize = 64;

/// Points row by row, ascending along the first axis within each: near ones lie together in memory, and where points lie on
/// few lines or sheets no memory goes to the space between them.
#[derive(Clone, Debug)]
pub(crate) struct PointGrid<const D: usize> {
    min: Point<D>,
    width: f64,
    /// How many rows there are along each axis but the first.
    shape: [usize; D],
    /// Where the points of each row begin, and where the last ones end.
    starts: Vec<u32>,
    points: Vec<Numbered<D>>,
}

/// A point and its number.
pub(crate) type Numbered<const D: usize> = (Point<D>, u32);

/// Some points near each other, of a row, and all points near these.
pub(crate) struct Block<'a, const D: usize> {
    /// Where the block's own points are among `near`.
    pub own: Range<usize>,
    /// All points within reach of one of its own, and some more, in the order in which [`PointGrid::near`] visits them.
    pub near: &'a [Numbered<D>],
}

impl<const D: usize> Block<'_, D> {
    /// The block's own points.
    pub fn own(&self) -> &[Numbered<D>] {
        &self.near[self.own.clone()]
    }
}

impl<const D: usize> PointGrid<D> {
    /// Rows of at least `width`.
    pub fn new(
        bounds: &Bounds<D>,
        width: f64,
        positions: impl ExactSizeIterator<Item = Point<D>> + Clone,
    ) -> Self {
        let extent = bounds.extent();
        let most = MOST_ROWS * positions.len().max(1);
        let each = extent[1..].iter().product::<f64>() / most as f64;
        let width = width.max(each.powf(1.0 / (D - 1) as f64));
        let rows = |k: usize| if k == 0 { 1 } else { (extent[k] / width) as usize + 1 };
        let shape: [usize; D] = std::array::from_fn(rows);
        let mut grid = Self {
            min: bounds.min,
            width,
            shape,
            starts: vec![0; shape.iter().product::<usize>() + 1],
            points: Vec::new(),
        };
        let rows: Vec<u32> = positions.clone().map(|p| grid.index(&grid.row(&p)) as u32).collect();
        rows.iter().for_each(|&row| grid.starts[row as usize + 1] += 1);
        for row in 1..grid.starts.len() {
            grid.starts[row] += grid.starts[row - 1];
        }
        let mut next = grid.starts.clone();
        let mut points = vec![([0.0; D], 0); rows.len()];
        for ((position, &row), number) in positions.zip(&rows).zip(0..) {
            let next = &mut next[row as usize];
            points[*next as usize] = (position, number);
            *next += 1;
        }
        let mut rest = points.as_mut_slice();
        let mut rows = Vec::new();
        for row in grid.starts.windows(2).filter(|row| row[0] < row[1]) {
            let (row, others) = rest.split_at_mut((row[1] - row[0]) as usize);
            rows.push(row);
            rest = others;
        }
        // stable
        let sort = |row: &mut &mut [Numbered<D>]| row.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        rows.par_iter_mut().with_min_len(1 << 6).for_each(sort);
        grid.points = points;
        grid
    }

    /// All points, row by row.
    pub fn positions(&self) -> impl ExactSizeIterator<Item = Point<D>> {
        self.points.iter().map(|(position, _)| *position)
    }

    /// Visits all points within `reach` along every axis, and some more, with their numbers.
    #[inline]
    pub fn near(&self, p: &Point<D>, reach: f64, mut visit: impl FnMut(&Point<D>, usize)) {
        let (low, high) = (self.row(&p.map(|x| x - reach)), self.row(&p.map(|x| x + reach)));
        for row in self.rows(low, high) {
            let row = &self.points[row];
            let begin = row.partition_point(|(position, _)| position[0] < p[0] - reach);
            for (position, number) in &row[begin..] {
                if position[0] > p[0] + reach {
                    break;
                }
                visit(position, *number as usize);
            }
        }
    }

    /// The number of the point nearest to `p` of those wanted that are nearer than `reach`, and the squared distance; the
    /// lowest number of equals. Rows are looked at in rings around the point's own, as far as what was found leaves any.
    pub fn nearest(
        &self,
        p: &Point<D>,
        reach: f64,
        wanted: impl Fn(usize) -> bool,
    ) -> Option<(usize, f64)> {
        let mut best = (reach * reach, usize::MAX);
        let own = self.row(p);
        let (low, high) = (self.row(&p.map(|x| x - reach)), self.row(&p.map(|x| x + reach)));
        let rings = (1..D).map(|k| (own[k] - low[k]).max(high[k] - own[k])).max().unwrap_or(0);
        for ring in 0..=rings {
            // a ring is at least so far from the point's own row
            let from_row = ring.saturating_sub(1) as f64 * self.width;
            if from_row * from_row > best.0 {
                break;
            }
            self.for_ring(&own, ring, &low, &high, |row| {
                let beside = self.beside(&row, p);
                if beside <= best.0 {
                    self.nearest_in_row(&row, p, beside, &wanted, &mut best);
                }
            });
        }
        (best.1 < usize::MAX).then_some((best.1, best.0))
    }

    /// Visits the rows that are so many rows away from one, within limits.
    fn for_ring(
        &self,
        own: &[usize; D],
        ring: usize,
        low: &[usize; D],
        high: &[usize; D],
        mut visit: impl FnMut([usize; D]),
    ) {
        let side = 2 * ring + 1;
        for mut rest in 0..side.pow(D as u32 - 1) {
            let (mut row, mut farthest, mut is_in) = (*own, 0, true);
            for k in 1..D {
                let to = own[k] + rest % side;
                rest /= side;
                farthest = farthest.max(to.abs_diff(own[k] + ring));
                is_in &= to >= low[k] + ring && to <= high[k] + ring;
                row[k] = to.saturating_sub(ring);
            }
            if is_in && farthest == ring {
                visit(row);
            }
        }
    }

    /// The least squared distance across rows that any point of a row may have from `p`.
    fn beside(&self, row: &[usize; D], p: &Point<D>) -> f64 {
        /// For rounding, over the width of a row.
        const SLACK: f64 = 1e-6;
        let mut squared = 0.0;
        for k in 1..D {
            let at = (p[k] - self.min[k]) / self.width;
            // rows at the rim hold what is beyond them
            let below = if row[k] == 0 { f64::NEG_INFINITY } else { row[k] as f64 };
            let above =
                if row[k] + 1 == self.shape[k] { f64::INFINITY } else { row[k] as f64 + 1.0 };
            let off = self.width * ((below - at).max(at - above) - SLACK).max(0.0);
            squared += off * off;
        }
        squared
    }

    /// Looks at the points of a row from the place of `p` in it outwards.
    fn nearest_in_row(
        &self,
        row: &[usize; D],
        p: &Point<D>,
        beside: f64,
        wanted: &impl Fn(usize) -> bool,
        best: &mut (f64, usize),
    ) {
        let first = self.index(row);
        let row = &self.points[self.starts[first] as usize..self.starts[first + 1] as usize];
        let middle = row.partition_point(|(q, _)| q[0] < p[0]);
        let mut look = |(q, number): &Numbered<D>| {
            let along = (q[0] - p[0]) * (q[0] - p[0]);
            if along + beside > best.0 * (1.0 + 1e-12) {
                return false;
            }
            let found = (distance_squared(q, p), *number as usize);
            let is_better =
                found.0 < best.0 || found.0 == best.0 && found.1 < best.1 && best.1 < usize::MAX;
            if is_better && wanted(found.1) {
                *best = found;
            }
            true
        };
        let _ = row[..middle].iter().rev().all(&mut look);
        let _ = row[middle..].iter().all(&mut look);
    }

    /// What `of` makes of all points, by their numbers: to each of a block's own points, in their order, it adds one
    /// value. See [`Self::visit_blocks`].
    pub fn map_blocks<T: Copy + Default + Send>(
        &self,
        reach: f64,
        of: impl Fn(&Block<'_, D>, &mut Vec<T>) + Sync,
    ) -> Vec<T> {
        let values = self.visit_blocks(reach, of);
        let mut by_number = vec![T::default(); self.points.len()];
        for ((_, number), value) in self.points.iter().zip(values.into_iter().flatten()) {
            by_number[*number as usize] = value;
        }
        by_number
    }

    /// Visits all points in blocks of some near each other, on all threads: what these have in common is found once, and
    /// what is near them lies together in memory. Gives what `of` adds to lists, some blocks a list, in their order.
    pub fn visit_blocks<T: Send>(
        &self,
        reach: f64,
        of: impl Fn(&Block<'_, D>, &mut Vec<T>) + Sync,
    ) -> Vec<Vec<T>> {
        let task = |blocks: &[Range<usize>]| {
            let (mut near, mut values) = (Vec::new(), Vec::new());
            for block in blocks {
                let own = self.gather(block, reach, &mut near);
                of(&Block { own, near: &near }, &mut values);
            }
            values
        };
        self.blocks().par_chunks(TASK).map(task).collect()
    }

    /// Parts of rows no longer than rows are wide.
    fn blocks(&self) -> Vec<Range<usize>> {
        let mut blocks = Vec::new();
        for row in self.starts.windows(2) {
            let (mut start, end) = (row[0] as usize, row[1] as usize);
            while start < end {
                let last = self.points[start].0[0] + self.width;
                let count = self.points[start..end].partition_point(|(p, _)| p[0] <= last);
                blocks.push(start..start + count.max(1));
                start += count.max(1);
            }
        }
        blocks
    }

    /// Lists all points within `reach` of the least box around some, and says where these are in the list.
    fn gather(
        &self,
        block: &Range<usize>,
        reach: f64,
        near: &mut Vec<Numbered<D>>,
    ) -> Range<usize> {
        near.clear();
        let own = &self.points[block.clone()];
        let (mut min, mut max) = (own[0].0, own[0].0);
        for (p, _) in own {
            for k in 0..D {
                min[k] = min[k].min(p[k]);
                max[k] = max[k].max(p[k]);
            }
        }
        let off = |p: &Point<D>| {
            let mut squared = 0.0;
            for k in 0..D {
                let off = (min[k] - p[k]).max(p[k] - max[k]).max(0.0);
                squared += off * off;
            }
            squared
        };
        let (low, high) = (self.row(&min.map(|x| x - reach)), self.row(&max.map(|x| x + reach)));
        let mut first = 0;
        for row in self.rows(low, high) {
            let begin = row.start
                + self.points[row.clone()].partition_point(|(p, _)| p[0] < min[0] - reach);
            for (i, point) in (begin..row.end).zip(&self.points[begin..row.end]) {
                if point.0[0] > max[0] + reach {
                    break;
                }
                if i == block.start {
                    first = near.len();
                }
                if off(&point.0) <= reach * reach {
                    near.push(*point);
                }
            }
        }
        first..first + own.len()
    }

    /// The rows from one to another along every axis.
    #[inline]
    fn rows(&self, low: [usize; D], high: [usize; D]) -> impl Iterator<Item = Range<usize>> {
        let count: usize = (1..D).map(|k| high[k] - low[k] + 1).product();
        (0..count).map(move |mut rest| {
            let mut row = low;
            for k in 1..D {
                let count = high[k] - low[k] + 1;
                row[k] = low[k] + rest % count;
                rest /= count;
            }
            let first = self.index(&row);
            self.starts[first] as usize..self.starts[first + 1] as usize
        })
    }

    /// The place of a point's row along each axis, 0 along the first.
    fn row(&self, p: &Point<D>) -> [usize; D] {
        std::array::from_fn(|k| {
            let at = ((p[k] - self.min[k]) / self.width).max(0.0) as usize;
            at.min(self.shape[k] - 1)
        })
    }

    fn index(&self, row: &[usize; D]) -> usize {
        (1..D).rev().fold(0, |index, k| index * self.shape[k] + row[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn near_points_are_visited_once<const D: usize>(
        points: &[Point<D>],
        p: &Point<D>,
        width: f64,
        reach: f64,
    ) {
        let bounds = Bounds { min: [0.0; D], max: [9.0, 4.0, 6.0][..D].try_into().unwrap() };
        let grid = PointGrid::new(&bounds, width, points.iter().copied());
        let mut seen = vec![0; points.len()];
        grid.near(p, reach, |position, number| {
            assert_eq!(*position, points[number]);
            seen[number] += 1;
        });
        for (point, times) in points.iter().zip(seen) {
            assert!(times <= 1);
            assert!(times == 1 || distance_squared(point, p) > reach * reach);
        }
    }

    /// Blocks list what is near one of their points in the order in which it is visited there.
    fn blocks_hold_what_is_near<const D: usize>(points: &[Point<D>], width: f64, reach: f64) {
        let bounds = Bounds { min: [0.0; D], max: [9.0, 4.0, 6.0][..D].try_into().unwrap() };
        let grid = PointGrid::new(&bounds, width, points.iter().copied());
        let within = |p: &Point<D>, q: &Point<D>| distance_squared(p, q) <= reach * reach;
        let found = grid.map_blocks(reach, |block, values: &mut Vec<(u32, u64)>| {
            for (p, number) in block.own() {
                let numbers =
                    block.near.iter().filter(|(q, _)| within(p, q)).map(|(_, number)| *number);
                values.push((*number, hash(numbers)));
            }
        });
        for (i, (number, found)) in found.into_iter().enumerate() {
            let mut visited = Vec::new();
            grid.near(&points[i], reach, |q, number| {
                if within(&points[i], q) {
                    visited.push(number as u32);
                }
            });
            assert_eq!((number, found), (i as u32, hash(visited.into_iter())));
        }
    }

    /// A number that tells lists apart.
    fn hash(numbers: impl Iterator<Item = u32>) -> u64 {
        numbers.fold(7, |hash: u64, n| (hash ^ u64::from(n)).wrapping_mul(0x100_0000_01b3))
    }

    fn the_nearest_is_nearest<const D: usize>(
        points: &[Point<D>],
        p: &Point<D>,
        width: f64,
        reach: f64,
    ) {
        let bounds = Bounds { min: [0.0; D], max: [9.0, 4.0, 6.0][..D].try_into().unwrap() };
        let grid = PointGrid::new(&bounds, width, points.iter().copied());
        let all = points.iter().enumerate().filter(|(i, _)| i % 3 > 0);
        let all = all.map(|(i, q)| (distance_squared(q, p), i));
        let expected = all
            .filter(|(squared, _)| *squared < reach * reach)
            .min_by(|a, b| a.partial_cmp(b).unwrap());
        let found = grid.nearest(p, reach, |i| i % 3 > 0);
        assert_eq!(found.map(|(i, squared)| (squared, i)), expected);
    }

    proptest! {
        #[test]
        fn the_nearest_is_found_from_anywhere(
            // on a grid, for equal distances
            points in prop::collection::vec([0..10i32, 0..5, 0..7], 0..90),
            p in [-10..110i32, -10..50, -10..70],
            (width, reach) in (0.3..3.0f64, 0.1..12.0f64),
        ) {
            let points: Vec<Point<3>> = points.iter().map(|p| p.map(|x| f64::from(x).min(6.0))).collect();
            let p = p.map(|x| 0.1 * f64::from(x));
            the_nearest_is_nearest(&points, &p, width, reach);
            let plane: Vec<Point<2>> = points.iter().map(|p| [p[0], p[1]]).collect();
            the_nearest_is_nearest(&plane, &[p[0], p[1]], width, reach);
        }

        #[test]
        fn blocks_hold_all_that_is_near_their_points(
            points in prop::collection::vec([0.0..9.0f64, 0.0..4.0, 0.0..6.0], 0..60),
            (width, reach) in (0.3..3.0f64, 0.1..4.0f64),
        ) {
            blocks_hold_what_is_near(&points, width, reach);
            let plane: Vec<Point<2>> = points.iter().map(|p| [p[0], p[1]]).collect();
            blocks_hold_what_is_near(&plane, width, reach);
        }

        #[test]
        fn all_near_points_are_visited_once(
            points in prop::collection::vec([0.0..9.0f64, 0.0..4.0, 0.0..6.0], 0..60),
            p in [-1.0..10.0f64, -1.0..5.0, -1.0..7.0],
            (width, reach) in (0.3..3.0f64, 0.1..4.0f64),
        ) {
            near_points_are_visited_once(&points, &p, width, reach);
            let plane: Vec<Point<2>> = points.iter().map(|p| [p[0], p[1]]).collect();
            near_points_are_visited_once(&plane, &[p[0], p[1]], width, reach);
        }
    }
}
