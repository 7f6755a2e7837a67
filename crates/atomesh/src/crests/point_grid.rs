//! Points that do not change, by the cube of the box that they are in: near ones lie together in memory.

use crate::geometry::{Bounds, Point};

/// The most cubes for each point.
const MOST_CUBES: usize = 16;

/// Points in the order of their cubes, x fastest, so that a row of cubes is one slice.
#[derive(Clone, Debug)]
pub(crate) struct PointGrid<const D: usize> {
    min: Point<D>,
    width: f64,
    shape: [usize; D],
    /// Where the points of each cube begin, and where the last ones end.
    starts: Vec<u32>,
    /// The points with their numbers, cube by cube.
    points: Vec<(Point<D>, u32)>,
}

impl<const D: usize> PointGrid<D> {
    /// Cubes of at least `width`.
    pub fn new(
        bounds: &Bounds<D>,
        width: f64,
        positions: impl ExactSizeIterator<Item = Point<D>> + Clone,
    ) -> Self {
        let most = MOST_CUBES * positions.len().max(1);
        let each = bounds.measure() / most as f64;
        let width = width.max(each.powf(1.0 / D as f64));
        let shape = bounds.extent().map(|extent| (extent / width) as usize + 1);
        let mut grid = Self {
            min: bounds.min,
            width,
            shape,
            starts: vec![0; shape.iter().product::<usize>() + 1],
            points: Vec::new(),
        };
        let cubes: Vec<usize> = positions.clone().map(|p| grid.index(&grid.cube(&p))).collect();
        cubes.iter().for_each(|&cube| grid.starts[cube + 1] += 1);
        for cube in 1..grid.starts.len() {
            grid.starts[cube] += grid.starts[cube - 1];
        }
        let mut next = grid.starts.clone();
        let mut points = vec![([0.0; D], 0); cubes.len()];
        for ((position, &cube), number) in positions.zip(&cubes).zip(0..) {
            points[next[cube] as usize] = (position, number);
            next[cube] += 1;
        }
        grid.points = points;
        grid
    }

    /// Visits all points within `reach` along every axis, and some more, with their numbers.
    #[inline]
    pub fn near(&self, p: &Point<D>, reach: f64, mut visit: impl FnMut(&Point<D>, usize)) {
        let (low, high) = (self.cube(&p.map(|x| x - reach)), self.cube(&p.map(|x| x + reach)));
        let rows: usize = (1..D).map(|k| high[k] - low[k] + 1).product();
        for row in 0..rows {
            let mut cube = low;
            let mut rest = row;
            for k in 1..D {
                let count = high[k] - low[k] + 1;
                cube[k] = low[k] + rest % count;
                rest /= count;
            }
            let first = self.index(&cube);
            let slice =
                self.starts[first] as usize..self.starts[first + high[0] - low[0] + 1] as usize;
            for (position, number) in &self.points[slice] {
                visit(position, *number as usize);
            }
        }
    }

    fn cube(&self, p: &Point<D>) -> [usize; D] {
        std::array::from_fn(|k| {
            let at = ((p[k] - self.min[k]) / self.width).max(0.0) as usize;
            at.min(self.shape[k] - 1)
        })
    }

    fn index(&self, cube: &[usize; D]) -> usize {
        (0..D).rev().fold(0, |index, k| index * self.shape[k] + cube[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::distance_squared;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn all_near_points_are_visited_once(
            points in prop::collection::vec([0.0..9.0f64, 0.0..4.0, 0.0..6.0], 1..60),
            p in [-1.0..10.0f64, -1.0..5.0, -1.0..7.0],
            (width, reach) in (0.3..3.0f64, 0.1..4.0f64),
        ) {
            let bounds = Bounds { min: [0.0; 3], max: [9.0, 4.0, 6.0] };
            let grid = PointGrid::new(&bounds, width, points.iter().copied());
            let mut seen = vec![0; points.len()];
            grid.near(&p, reach, |position, number| {
                assert_eq!(*position, points[number]);
                seen[number] += 1;
            });
            prop_assert!(seen.iter().all(|&times| times <= 1));
            for (point, times) in points.iter().zip(seen) {
                prop_assert!(times == 1 || distance_squared(point, &p) > reach * reach);
            }
        }
    }
}
