//! Cells by the labels of an image.
//!
//! `sample` says which label a cell has; here is what follows from labels: the interfaces between two of them, and the
//! closed surface of one.

use crate::parallel::prelude::*;

use crate::image::Samples;
use crate::mesh::{Facet, Mesh};

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
            let (cell, other) = (facet.cell, facet.neighbour?);
            let (a, b) = (labels[cell as usize], labels[other as usize]);
            let lower = if a < b { cell } else { other };
            (a != b).then_some(())?;
            Some(([a.min(b), a.max(b)], mesh.facet_out_of(lower, &facet.corners)?))
        })
        .collect();
    found.sort_by_key(|(labels, _)| *labels); // stable: facets stay in their order
    found
        .chunk_by(|a, b| a.0 == b.0)
        .map(|group| Interface {
            labels: group[0].0,
            facets: group.iter().map(|(_, facet)| *facet).collect(),
        })
        .collect()
}

/// The closed surface of the cells of one label: the facets between a cell of that label and a cell of another or none,
/// their normals out of the label, in the order of their ascending corners. Each ridge, a point in 2-D and an edge in 3-D,
/// is shared by an even number of them. None if no cell has the label. Cost: O(cells).
///
/// ```
/// use atomesh::{mesh::Mesh, region::closed_surface};
///
/// let square = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
/// let mesh = Mesh::new(square, vec![0, 1, 2, 0, 2, 3])?;
/// assert_eq!(closed_surface(&mesh, &[7, 8], 7), [[0, 1], [2, 0], [1, 2]]);
/// # Ok::<(), atomesh::mesh::MeshError>(())
/// ```
///
/// # Panics
/// If there are not as many labels as cells.
pub fn closed_surface<const D: usize>(mesh: &Mesh<D>, labels: &[i32], label: i32) -> Vec<[u32; D]> {
    assert_eq!(labels.len(), mesh.cell_count(), "one label a cell");
    let is_in = |cell: &u32| labels[*cell as usize] == label;
    let outward = |facet: &Facet<D>| {
        let other = facet.neighbour.filter(is_in);
        let inner = match (Some(facet.cell).filter(is_in), other) {
            (Some(cell), None) | (None, Some(cell)) => cell,
            _ => return None,
        };
        mesh.facet_out_of(inner, &facet.corners)
    };
    mesh.facets().iter().filter_map(outward).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::geometry::dot;

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

    /// Cubes of six tetrahedra, `n` along every axis, their labels drawn by a hash of the cell's number.
    fn cubes(n: u32) -> (Mesh<3>, Vec<i32>) {
        let each = n + 1;
        let points = (0..each.pow(3))
            .map(|i| [i % each, i / each % each, i / each / each].map(f64::from))
            .collect();
        let steps = [1, each, each * each];
        let paths = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]];
        let mut corners = Vec::new();
        for cube in 0..n.pow(3) {
            let first = cube % n + each * (cube / n % n) + each * each * (cube / n / n);
            for (at, [a, b, c]) in paths.into_iter().enumerate() {
                let ends = [first, first + steps[a], first + steps[a] + steps[b]];
                let last = ends[2] + steps[c];
                // the paths of an odd order of axes are left-handed
                let mirrored = [ends[0], ends[2], ends[1], last];
                corners.extend(if at < 3 { [ends[0], ends[1], ends[2], last] } else { mirrored });
            }
        }
        let mesh = Mesh::new(points, corners).unwrap();
        let labels = (0..mesh.cell_count() as u32)
            .map(|cell| (cell.wrapping_mul(2_654_435_761) >> 16) as i32 % 3)
            .collect();
        (mesh, labels)
    }

    /// A closed surface bounds the cells of its label: ridges are even, area vectors cancel, and by the divergence
    /// theorem it holds as much as the cells.
    fn check_closed<const D: usize>(mesh: &Mesh<D>, labels: &[i32]) {
        assert_eq!(mesh.validate(), Ok(()));
        for label in [0, 1, 2] {
            let surface = closed_surface(mesh, labels, label);
            let mut ridges: BTreeMap<Vec<u32>, usize> = BTreeMap::new();
            let (mut sum, mut held) = ([0.0; D], 0.0);
            for facet in &surface {
                for skip in 0..D {
                    let mut ridge = facet.to_vec();
                    ridge.remove(skip);
                    ridge.sort_unstable();
                    *ridges.entry(ridge).or_default() += 1;
                }
                let normal = mesh.facet_normal(facet);
                sum = std::array::from_fn(|k| sum[k] + normal[k]);
                held += dot(&normal, &mesh.points()[facet[0] as usize]) / D as f64;
            }
            assert!(ridges.values().all(|count| count.is_multiple_of(2)), "label {label}");
            // coordinates are whole, so that sums of halves are exact
            assert_eq!(sum, [0.0; D], "label {label}");
            let cells = mesh.simplices().zip(labels).filter(|(_, own)| **own == label);
            let cells: f64 = cells.map(|(cell, _)| cell.measure()).sum();
            // thirds and sixths are not: some rounding
            assert!((held - cells).abs() < 1e-9, "label {label}: {held}, {cells}");
            assert!(!surface.is_empty());
        }
        assert!(closed_surface(mesh, labels, 9).is_empty());
    }

    #[test]
    fn the_surface_of_a_label_is_closed_and_holds_its_cells() {
        let (mesh, labels) = cubes(4);
        check_closed(&mesh, &labels);
        let mesh = squares();
        let labels: Vec<i32> = (0..mesh.cell_count() as i32).map(|i| i * i % 7 % 3).collect();
        check_closed(&mesh, &labels);
    }

    #[test]
    fn an_interface_is_what_two_surfaces_share() {
        let (mesh, labels) = cubes(3);
        let sorted = |facet: &[u32; 3]| {
            let mut facet = *facet;
            facet.sort_unstable();
            facet
        };
        let of = |label| closed_surface(&mesh, &labels, label);
        let (lower, higher): (Vec<_>, Vec<_>) =
            (of(0), of(1).iter().map(sorted).collect::<Vec<_>>());
        let shared: Vec<_> =
            lower.into_iter().filter(|facet| higher.contains(&sorted(facet))).collect();
        let found = interfaces(&mesh, &labels);
        // the normals of both leave label 0
        assert_eq!(found[0], Interface { labels: [0, 1], facets: shared });
    }

    #[test]
    fn labels_are_integers() {
        let good = Samples::F32(vec![0.0, -3.0, 12.0].into());
        assert_eq!(label_samples(&good), Ok(vec![0, -3, 12]));
        let bad = label_samples(&Samples::F64(vec![1.0, 2.5].into()));
        assert_eq!(bad, Err(RegionError::Label { index: 1, value: 2.5 }));
        assert!(label_samples(&Samples::U32(vec![u32::MAX].into())).is_err());
        assert!(label_samples(&Samples::F32(vec![f32::NAN].into())).is_err());
    }
}
