//! Cells by the labels of an image.
//!
//! A cell has the label that most of it is covered by; samples reach half a step around their centres.

use rayon::prelude::*;

use crate::geometry::{Point, Sets};
use crate::image::{Grid, Samples};
use crate::mesh::Mesh;

use super::RegionError;

/// The labels of an image's samples.
///
/// # Errors
/// [`RegionError::Label`] for the first sample that is no integer of 32 bits.
pub fn label_samples(samples: &Samples) -> Result<Vec<i32>, RegionError> {
    let label = |index: usize| {
        let value = samples.get(index);
        let label = value as i32; // saturates, and then differs
        if f64::from(label) == value { Ok(label) } else { Err(RegionError::Label { index, value }) }
    };
    let labels: Vec<Result<i32, RegionError>> =
        (0..samples.len()).into_par_iter().with_min_len(1 << 14).map(label).collect();
    labels.into_iter().collect()
}

/// Points along the longest edge of a cell, for a sample each.
const POINTS_PER_SAMPLE: f64 = 2.0;
/// The most divisions of a cell's edges.
const MOST_DIVISIONS: usize = 16;

/// The label of each cell of a mesh in lattice coordinates: the one that most of the cell is covered by, the
/// least of those that cover as much. Measured at the centroids of the parts of an even division of the
/// cell, two for each sample along its longest edge.
///
/// # Panics
/// If there are not as many labels as the grid has samples.
pub fn majority<const D: usize>(mesh: &Mesh<D>, grid: &Grid<D>, labels: &[i32]) -> Vec<i32> {
    assert_eq!(labels.len(), grid.sample_count(), "one label a sample");
    let strides = grid.strides();
    let label_at = |p: &Point<D>| {
        let index = (0..D).map(|k| {
            let i = (p[k] / grid.step[k] + 0.5) as usize; // a cast takes what is negative to 0
            i.min(grid.shape[k] - 1) * strides[k]
        });
        labels[index.sum::<usize>()]
    };
    let of_cell = |cell: &[u32]| {
        let corner = |k: usize| &mesh.points()[cell[k] as usize];
        let mut samples = 1.0_f64;
        for i in 0..=D {
            for j in 0..i {
                for k in 0..D {
                    samples = samples.max((corner(i)[k] - corner(j)[k]).abs() / grid.step[k]);
                }
            }
        }
        let divisions = ((POINTS_PER_SAMPLE * samples).ceil() as usize).clamp(2, MOST_DIVISIONS);
        let mut counts: Vec<(i32, usize)> = Vec::new();
        each_weight(D + 1, divisions, &mut |weights| {
            // weights of the division's inner points: none is on the cell's boundary
            let whole = (divisions * (D + 1)) as f64;
            let p = std::array::from_fn(|k| {
                let sum = |c: usize| (weights[c] * (D + 1) + 1) as f64 * corner(c)[k];
                (0..=D).map(sum).sum::<f64>() / (whole + (D + 1) as f64)
            });
            let label = label_at(&p);
            match counts.iter_mut().find(|(l, _)| *l == label) {
                Some((_, count)) => *count += 1,
                None => counts.push((label, 1)),
            }
        });
        let best = counts.iter().max_by(|a, b| a.1.cmp(&b.1).then(b.0.cmp(&a.0)));
        best.map_or(0, |&(label, _)| label)
    };
    mesh.corners().par_chunks_exact(D + 1).with_min_len(256).map(of_cell).collect()
}

/// Calls `visit` with all lists of `count` natural numbers that sum to `sum`; `count` is at most 4.
fn each_weight(count: usize, sum: usize, visit: &mut dyn FnMut(&[usize; 4])) {
    fn next(at: usize, rest: usize, weights: &mut [usize; 4], visit: &mut dyn FnMut(&[usize; 4])) {
        if at == 0 {
            weights[0] = rest;
            visit(weights);
            return;
        }
        for w in 0..=rest {
            weights[at] = w;
            next(at - 1, rest - w, weights, visit);
        }
    }
    next(count - 1, sum, &mut [0; 4], visit);
}

/// Gives cells of islands, groups of fewer than `least` cells of one label that hang together by facets, the
/// label of the neighbour with which they share most facets (the least label of those that share as many).
/// Returns how many cells have another label now. Groups are found once: what an island joins may still be
/// one.
pub fn islands<const D: usize>(mesh: &Mesh<D>, labels: &mut [i32], least: usize) -> usize {
    let facets = mesh.facets();
    let pairs: Vec<(u32, u32)> =
        facets.iter().filter_map(|f| f.neighbour.map(|other| (f.cell, other))).collect();
    let mut groups = Sets::new(labels.len());
    for &(a, b) in &pairs {
        if labels[a as usize] == labels[b as usize] {
            groups.join(a, b);
        }
    }
    let roots = groups.roots();
    let mut sizes = vec![0_usize; labels.len()];
    roots.iter().for_each(|&r| sizes[r as usize] += 1);
    // the island, a label beside it: once for each facet
    let mut shores: Vec<(u32, i32)> = Vec::new();
    for &(a, b) in &pairs {
        for (cell, other) in [(a, b), (b, a)] {
            let r = roots[cell as usize];
            if sizes[r as usize] < least && roots[other as usize] != r {
                shores.push((r, labels[other as usize]));
            }
        }
    }
    shores.sort_unstable();
    let mut becomes = vec![None; labels.len()];
    for island in shores.chunk_by(|a, b| a.0 == b.0) {
        let best = island.chunk_by(|a, b| a.1 == b.1).map(|g| (g.len(), std::cmp::Reverse(g[0].1)));
        becomes[island[0].0 as usize] = best.max().map(|(_, label)| label.0);
    }
    let mut changed = 0;
    for (cell, label) in labels.iter_mut().enumerate() {
        if let Some(new) = becomes[roots[cell] as usize] {
            *label = new;
            changed += 1;
        }
    }
    changed
}

/// Facets between cells of one label and another: the labels, the lesser first, and the facets, corners
/// ascending, in lexicographic order; pairs ascending.
pub type Interface<const D: usize> = ([i32; 2], Vec<[u32; D]>);

/// The interfaces between cells of different labels.
///
/// # Panics
/// If there are not as many labels as cells.
pub fn interfaces<const D: usize>(mesh: &Mesh<D>, labels: &[i32]) -> Vec<Interface<D>> {
    assert_eq!(labels.len(), mesh.cell_count(), "one label a cell");
    let mut found: Vec<([i32; 2], [u32; D])> = (mesh.facets().iter())
        .filter_map(|facet| {
            let (a, b) = (labels[facet.cell as usize], labels[facet.neighbour? as usize]);
            (a != b).then(|| ([a.min(b), a.max(b)], facet.corners))
        })
        .collect();
    found.sort_unstable();
    found
        .chunk_by(|a, b| a.0 == b.0)
        .map(|group| (group[0].0, group.iter().map(|f| f.1).collect()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid<2> = Grid { shape: [9, 5], step: [1.0, 1.0] };

    /// Triangles of a grid of squares of one sample.
    fn squares() -> Mesh<2> {
        let points = (0..45).map(|i| [f64::from(i % 9), f64::from(i / 9)]).collect();
        let corners = (0..4_u32)
            .flat_map(|j| (0..8_u32).map(move |i| i + 9 * j))
            .flat_map(|a| [a, a + 1, a + 10, a, a + 10, a + 9])
            .collect();
        Mesh::new(points, corners).unwrap()
    }

    /// Label 7 where x < 4.5, else −2.
    fn halves() -> Vec<i32> {
        (0..45).map(|i| if i % 9 < 5 { 7 } else { -2 }).collect()
    }

    #[test]
    fn cells_have_the_label_that_covers_most_of_them() {
        let mesh = squares();
        let labels = majority(&mesh, &GRID, &halves());
        for (cell, label) in mesh.cells().zip(&labels) {
            let x = cell.iter().map(|&c| mesh.points()[c as usize][0]).sum::<f64>() / 3.0;
            // both triangles of the square cut at 4.5 lie more on the side of their upright edge
            assert_eq!(*label, if x < 4.5 { 7 } else { -2 }, "centroid at {x}");
        }
    }

    #[test]
    fn a_tetrahedron_counts_volume_and_not_corners() {
        let points = vec![[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0], [0.0, 0.0, 8.0]];
        let mesh = Mesh::new(points, vec![0, 1, 2, 3]).unwrap();
        let grid = Grid { shape: [9; 3], step: [1.0; 3] };
        let below =
            |height: usize| -> Vec<i32> { (0..729).map(|i| i32::from(i / 81 < height)).collect() };
        // the plane z = h parts volumes of 1 − (1 − h/8)³: half at h = 1.65
        assert_eq!(majority(&mesh, &grid, &below(2)), [0]); // up to 1.5: 0.46
        assert_eq!(majority(&mesh, &grid, &below(3)), [1]); // up to 2.5: 0.67
    }

    #[test]
    fn interfaces_are_the_facets_between_labels() {
        let mesh = squares();
        let mut labels = majority(&mesh, &GRID, &halves());
        // the cells between x = 4 and 5 are one of each: their diagonals are the interface
        let found = interfaces(&mesh, &labels);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].0, [-2, 7]);
        let diagonals = found[0].1.iter().filter(|[a, b]| b - a == 10).count();
        assert_eq!((found[0].1.len(), diagonals), (7, 4));
        labels.fill(3);
        assert_eq!(interfaces(&mesh, &labels), []);
    }

    #[test]
    fn small_islands_join_the_neighbour_with_most_facets() {
        let mesh = squares();
        let mut labels = majority(&mesh, &GRID, &halves());
        let calm = labels.clone();
        labels[0] = 5;
        labels[10] = 5;
        assert_eq!(islands(&mesh, &mut labels, 1), 0);
        assert_eq!(islands(&mesh, &mut labels, 2), 2);
        assert_eq!(labels, calm);
        // no neighbour to join
        let mut alone = vec![4; mesh.cell_count()];
        assert_eq!(islands(&mesh, &mut alone, 1000), 0);
    }

    #[test]
    fn labels_are_integers() {
        let good = Samples::F32(vec![0.0, -3.0, 12.0]);
        assert_eq!(label_samples(&good), Ok(vec![0, -3, 12]));
        let bad = label_samples(&Samples::F64(vec![1.0, 2.5]));
        assert_eq!(bad, Err(RegionError::Label { index: 1, value: 2.5 }));
        assert!(label_samples(&Samples::U32(vec![u32::MAX])).is_err());
        assert!(label_samples(&Samples::F32(vec![f32::NAN])).is_err());
    }
}
