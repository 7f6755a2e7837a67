//! One triangulation where circles pass through four points or more.
//!
//! Cells that share a circumcircle make up a convex polygon. It is triangulated again, from its lexicographically least
//! point to all others: the same cells whatever made the polygon, and whatever points are elsewhere.

use std::collections::{HashMap, HashSet};

use crate::geometry::{Point, lexicographic};

/// Triangulates the polygons of cells that are linked by `pairs` again. Cells are positive, by their corners.
pub(super) fn settle(cells: &mut [[u32; 3]], pairs: &[[u32; 2]], points: &[Point<2>]) {
    let mut links: Vec<[u32; 2]> = pairs.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
    links.sort_unstable();
    let mut seen = vec![false; if links.is_empty() { 0 } else { cells.len() }];
    for &[start, _] in &links {
        if std::mem::replace(&mut seen[start as usize], true) {
            continue;
        }
        let mut polygon = vec![start];
        let mut next = 0;
        while let Some(&cell) = polygon.get(next) {
            next += 1;
            let from = links.partition_point(|link| link[0] < cell);
            for &[_, other] in links[from..].iter().take_while(|link| link[0] == cell) {
                if !std::mem::replace(&mut seen[other as usize], true) {
                    polygon.push(other);
                }
            }
        }
        cut(cells, &polygon, points);
    }
}

/// Cuts the polygon of some cells from its least point.
fn cut(cells: &mut [[u32; 3]], polygon: &[u32], points: &[Point<2>]) {
    // along the rim: an edge within the polygon is met once in either direction
    let edges = |&cell: &u32| {
        let [a, b, c] = cells[cell as usize];
        [[a, b], [b, c], [c, a]]
    };
    let edges: HashSet<[u32; 2]> = polygon.iter().flat_map(edges).collect();
    let is_rim = |[a, b]: &&[u32; 2]| !edges.contains(&[*b, *a]);
    let rim: HashMap<u32, u32> = edges.iter().filter(is_rim).map(|&[a, b]| (a, b)).collect();
    let before = |a: &&u32, b: &&u32| lexicographic(&points[**a as usize], &points[**b as usize]);
    let Some(&least) = rim.keys().min_by(before) else { return };
    let mut corner = rim[&least];
    for &cell in polygon {
        let next = rim[&corner];
        cells[cell as usize] = [least, corner, next];
        corner = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_is_cut_from_its_least_point_whatever_cut_it_before() {
        // a hexagon on a circle of radius 5, and a triangle beside it
        let points = [
            [3.0, 4.0],
            [-3.0, 4.0],
            [-5.0, 0.0],
            [-3.0, -4.0],
            [3.0, -4.0],
            [5.0, 0.0],
            [9.0, 9.0],
        ];
        let expected = [[2, 3, 4], [2, 4, 5], [2, 5, 0], [2, 0, 1]];
        for fan in 0..6 {
            let mut cells: Vec<[u32; 3]> =
                (1..5).map(|k| [fan, (fan + k) % 6, (fan + k + 1) % 6]).collect();
            cells.push([0, 5, 6]);
            settle(&mut cells, &[[0, 1], [1, 2], [2, 3]], &points);
            assert_eq!(cells.pop(), Some([0, 5, 6]));
            cells.sort_unstable_by_key(|cell| expected.iter().position(|e| e == cell));
            assert_eq!(cells, expected, "{fan}");
        }
    }
}
