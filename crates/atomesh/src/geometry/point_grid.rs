//! Points that do not change, for asking which are near: in rows along the first axis, and by their place within each.

use super::{Bounds, Point};

/// The most rows for each point.
const MOST_ROWS: usize = 16;

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
    /// The points with their numbers.
    points: Vec<(Point<D>, u32)>,
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
        for row in grid.starts.windows(2) {
            let row = &mut points[row[0] as usize..row[1] as usize];
            row.sort_by(|a, b| a.0[0].total_cmp(&b.0[0])); // stable
        }
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
        let rows: usize = (1..D).map(|k| high[k] - low[k] + 1).product();
        for at in 0..rows {
            let mut row = low;
            let mut rest = at;
            for k in 1..D {
                let count = high[k] - low[k] + 1;
                row[k] = low[k] + rest % count;
                rest /= count;
            }
            let first = self.index(&row);
            let row = &self.points[self.starts[first] as usize..self.starts[first + 1] as usize];
            let begin = row.partition_point(|(position, _)| position[0] < p[0] - reach);
            for (position, number) in &row[begin..] {
                if position[0] > p[0] + reach {
                    break;
                }
                visit(position, *number as usize);
            }
        }
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
    use super::super::distance_squared;
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

    proptest! {
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
