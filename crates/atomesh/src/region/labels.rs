//! Cells by the labels of an image.
//!
//! `sample` says which label a cell has; here is what follows from labels: islands and interfaces.

use rayon::prelude::*;

use crate::geometry::Sets;
use crate::image::Samples;
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

/// Gives the cells of islands, groups of fewer than `least` cells of one label connected by facets, the label with
/// which the island shares most facets (of equal ones the least). Returns how many cells have another label now.
/// Groups are found once: what an island joins may be an island itself.
pub fn join_islands<const D: usize>(mesh: &Mesh<D>, labels: &mut [i32], least: usize) -> usize {
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
    // an island and a label beside it, once for each facet between them
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

/// The facets between the cells of two labels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interface<const D: usize> {
    /// The labels, the lower first.
    pub labels: [i32; 2],
    /// The facets, their normals from the lower label to the higher, in the order of their ascending corners.
    pub facets: Vec<[u32; D]>,
}

/// The interfaces between cells of different labels, by ascending labels.
///
/// # Panics
/// If there are not as many labels as cells.
pub fn interfaces<const D: usize>(mesh: &Mesh<D>, labels: &[i32]) -> Vec<Interface<D>> {
    assert_eq!(labels.len(), mesh.cell_count(), "one label a cell");
    let mut found: Vec<([i32; 2], [u32; D])> = (mesh.facets().iter())
        .filter_map(|facet| {
            let (a, b) = (labels[facet.cell as usize], labels[facet.neighbour? as usize]);
            if a == b {
                return None;
            }
            let mut at = (0..=D).map(|opposite| mesh.facet_of(facet.cell as usize, opposite));
            let mut outward = at.find(|found| is_facet(found, &facet.corners))?;
            if a > b {
                outward.swap(D - 2, D - 1);
            }
            Some(([a.min(b), a.max(b)], outward))
        })
        .collect();
    found.sort_by_key(|(labels, facet)| (*labels, ascending(facet)));
    found
        .chunk_by(|a, b| a.0 == b.0)
        .map(|group| Interface {
            labels: group[0].0,
            facets: group.iter().map(|(_, facet)| *facet).collect(),
        })
        .collect()
}

fn ascending<const D: usize>(facet: &[u32; D]) -> [u32; D] {
    let mut sorted = *facet;
    sorted.sort_unstable();
    sorted
}

/// Whether the corners of a facet are these, which ascend.
fn is_facet<const D: usize>(facet: &[u32; D], corners: &[u32; D]) -> bool {
    ascending(facet) == *corners
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of a grid of squares of one sample.
    fn squares() -> Mesh<2> {
        let points = (0..45).map(|i| [f64::from(i % 9), f64::from(i / 9)]).collect();
        let corners = (0..4_u32)
            .flat_map(|j| (0..8_u32).map(move |i| i + 9 * j))
            .flat_map(|a| [a, a + 1, a + 10, a, a + 10, a + 9])
            .collect();
        Mesh::new(points, corners).unwrap()
    }

    /// Label 7 on the cells left of x = 4, −2 on those right of x = 5; of the two in each square between them, on
    /// the side of the upright edge.
    fn halves(mesh: &Mesh<2>) -> Vec<i32> {
        let middle =
            |cell: &[u32]| cell.iter().map(|&c| mesh.points()[c as usize][0]).sum::<f64>() / 3.0;
        mesh.cells().map(|cell| if middle(cell) < 4.5 { 7 } else { -2 }).collect()
    }

    #[test]
    fn interfaces_are_the_facets_between_labels() {
        let mesh = squares();
        let mut labels = halves(&mesh);
        // the cells between x = 4 and 5 are one of each: their diagonals are the interface
        let found = interfaces(&mesh, &labels);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].labels, [-2, 7]);
        let diagonals = found[0].facets.iter().filter(|[a, b]| a.abs_diff(*b) == 10).count();
        assert_eq!((found[0].facets.len(), diagonals), (7, 4));
        // label −2 is on the right of upright edges and diagonals, and above the three level edges
        for facet in &found[0].facets {
            let normal = mesh.facet_normal(facet);
            assert!(normal[0] < 0.0 || normal[0] == 0.0 && normal[1] < 0.0, "{normal:?}");
        }
        labels.fill(3);
        assert_eq!(interfaces(&mesh, &labels), []);
    }

    #[test]
    fn small_islands_join_the_neighbour_with_most_facets() {
        let mesh = squares();
        let mut labels = halves(&mesh);
        let calm = labels.clone();
        labels[0] = 5;
        labels[10] = 5;
        assert_eq!(join_islands(&mesh, &mut labels, 1), 0);
        assert_eq!(join_islands(&mesh, &mut labels, 2), 2);
        assert_eq!(labels, calm);
        // no neighbour to join
        let mut alone = vec![4; mesh.cell_count()];
        assert_eq!(join_islands(&mesh, &mut alone, 1000), 0);
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
