//! Weights between cells from the facets that they share.

use super::{CellGraph, ClusterError, Link};
use crate::features::{FacetField, FeatureFaces};
use crate::geometry::dot;
use crate::mesh::{Facet, FacetGroup, Mesh, PolyMesh};

/// How weights follow from what lies between cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightOptions {
    /// The mean of |b| along a facet by which its weight falls to 1/e; above 0. Default 0.2: facets off features have
    /// means up to 0.1, and keep most of their weight; along faint features it is 0.3, along clear ones 0.5 and more.
    pub contrast: f64,
    /// The multiplier of the weights of facets that are known as a feature's, 0…1. Default 0: they are walls.
    pub multiplier: f64,
}

impl Default for WeightOptions {
    fn default() -> Self {
        Self { contrast: 0.2, multiplier: 0.0 }
    }
}

/// A facet between two cells, as weights depend on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SharedFacet {
    /// The cells.
    pub cells: [u32; 2],
    /// The facet's length (2-D) or area (3-D).
    pub measure: f64,
    /// The mean of b or |b| along it, within −1…1; 0 where b is not known.
    pub mean: f64,
    /// What the weight is multiplied by, 0…1: less than 1 for facets known as those of a feature, 0 for a wall.
    pub multiplier: f64,
}

impl CellGraph {
    /// The graph of so many cells, neighbours if they share a facet. The weight of a facet is
    ///
    /// multiplier · exp(−(mean / contrast)²) · measure / the greatest measure,
    ///
    /// so that a facet along which |b| is the contrast holds its cells together by 1/e of what one off all features does.
    ///
    /// # Errors
    /// [`ClusterError`] if the contrast is not above 0, a measure, mean or multiplier is out of range, or cells are wrong.
    pub fn of_facets(
        cell_count: usize,
        facets: &[SharedFacet],
        contrast: f64,
    ) -> Result<Self, ClusterError> {
        if !(contrast > 0.0 && contrast.is_finite()) {
            return Err(ClusterError::Contrast { value: contrast });
        }
        let greatest = facets.iter().map(|facet| facet.measure).fold(0.0, f64::max);
        let link = |facet: &SharedFacet| {
            let SharedFacet { cells, measure, mean, multiplier } = *facet;
            if !(0.0..=1.0).contains(&multiplier) {
                return Err(ClusterError::Multiplier { value: multiplier });
            }
            let size = if greatest > 0.0 { measure / greatest } else { 1.0 };
            Ok(Link { cells, weight: multiplier * (-(mean / contrast).powi(2)).exp() * size })
        };
        Self::new(cell_count, &facets.iter().map(link).collect::<Result<Vec<Link>, _>>()?)
    }
}

/// The facets between two cells of a mesh of triangles or tetrahedra, in lexicographic order of their corners, with b
/// along them where it is known. Facets of a group have the group's multiplier, the least of several.
///
/// # Panics
/// If the field is that of another mesh.
pub fn shared_facets<const D: usize>(
    mesh: &Mesh<D>,
    field: Option<&FacetField<D>>,
    groups: &[(&FacetGroup<D>, f64)],
) -> Vec<SharedFacet> {
    let mut tagged: Vec<([u32; D], f64)> = Vec::new();
    for (group, multiplier) in groups {
        tagged.extend(group.facets.iter().map(|facet| {
            let mut corners = *facet;
            corners.sort_unstable();
            (corners, *multiplier)
        }));
    }
    tagged.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    tagged.dedup_by_key(|(corners, _)| *corners); // keeps the first
    let shared = |facet: &Facet<D>, mean: f64| {
        let normal = mesh.facet_normal(&facet.corners);
        let at = tagged.binary_search_by(|(corners, _)| corners.cmp(&facet.corners));
        Some(SharedFacet {
            cells: [facet.cell, facet.neighbour?],
            measure: dot(&normal, &normal).sqrt(),
            mean,
            multiplier: at.map_or(1.0, |at| tagged[at].1),
        })
    };
    match field {
        Some(field) => {
            let known = field.facets().iter().zip(field.mean());
            known.filter_map(|(facet, mean)| shared(facet, *mean)).collect()
        }
        None => mesh.facets().iter().filter_map(|facet| shared(facet, 0.0)).collect(),
    }
}

/// The faces between two Voronoi cells, in their order, with |b| along them where it is known. `multiplier` is that of a
/// feature by its number, from 1 on.
///
/// # Panics
/// If the features are those of another mesh.
pub fn shared_faces<const D: usize>(
    mesh: &PolyMesh<D>,
    features: &FeatureFaces,
    multiplier: impl Fn(u32) -> f64,
) -> Vec<SharedFacet> {
    let shared = |face: usize| {
        let vector = mesh.area_vector(face);
        let feature = features.of_faces.get(face).copied().unwrap_or(0);
        SharedFacet {
            cells: [mesh.owners()[face], mesh.neighbours()[face]],
            measure: dot(&vector, &vector).sqrt(),
            mean: features.strengths.get(face).map_or(0.0, |mean| f64::from(*mean)),
            multiplier: if feature > 0 { multiplier(feature) } else { 1.0 },
        }
    };
    (0..mesh.inner_face_count()).map(shared).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cluster::{ClusterOptions, ClusterTree};
    use crate::fields::{Interpolation, ScalarField};
    use crate::geometry::{Bounds, Point};
    use crate::image::Grid;
    use crate::mesh::{Delaunay, Mesh};
    use crate::voronoi::voronoi;
    use crate::watch::Silent;

    /// Triangles of squares of one unit, eight by four.
    fn squares() -> Mesh<2> {
        let points = (0..45).map(|i| [f64::from(i % 9), f64::from(i / 9)]).collect();
        let corners = (0..4_u32)
            .flat_map(|j| (0..8_u32).map(move |i| i + 9 * j))
            .flat_map(|a| [a, a + 1, a + 10, a, a + 10, a + 9])
            .collect();
        Mesh::new(points, corners).unwrap()
    }

    #[test]
    fn weights_are_the_formula_s() {
        let facet =
            |cells, measure, mean, multiplier| SharedFacet { cells, measure, mean, multiplier };
        let facets = [
            facet([0, 1], 2.0, 0.0, 1.0),
            facet([1, 2], 1.0, -0.3, 1.0),
            facet([2, 3], 2.0, 0.6, 0.5),
            facet([3, 0], 2.0, 0.0, 0.0),
        ];
        let graph = CellGraph::of_facets(4, &facets, 0.3).unwrap();
        let weights: Vec<f64> =
            graph.neighbours(0).chain(graph.neighbours(2)).map(|n| n.1).collect();
        let e = std::f64::consts::E;
        assert_eq!(graph.neighbours(0).map(|n| n.0).collect::<Vec<_>>(), [1, 3]);
        for (found, expected) in weights.iter().zip([1.0, 0.0, 0.5 / e, 0.5 * e.powi(-4)]) {
            assert!((found - expected).abs() < 1e-15, "{weights:?}");
        }
        let refused = |facet, contrast| CellGraph::of_facets(4, &[facet], contrast).unwrap_err();
        assert_eq!(refused(facets[0], 0.0), ClusterError::Contrast { value: 0.0 });
        let many = facet([0, 1], 1.0, 0.0, 2.0);
        assert_eq!(refused(many, 0.3), ClusterError::Multiplier { value: 2.0 });
        assert!(matches!(
            refused(facet([0, 1], 1.0, f64::NAN, 1.0), 0.3),
            ClusterError::Weight { .. }
        ));
    }

    #[test]
    fn cells_part_along_a_valley_and_along_a_group_of_facets() {
        let mesh = squares();
        // a valley along x = 3; along the facets there b is −1, and 0 along others but those that touch it
        let grid = Grid { shape: [9, 5], step: [1.0; 2] };
        let b = (0..45).map(|i| if i % 9 == 3 { -1.0 } else { 0.0 }).collect();
        let b = ScalarField::potential(grid, b, Interpolation::Linear).unwrap();
        let field = FacetField::along(&mesh, &b, &mut Silent).unwrap();
        let group = FacetGroup {
            id: 1,
            name: "feature-1".into(),
            facets: (0..4).map(|j| [3 + 9 * j + 9, 3 + 9 * j]).collect(),
        };
        let by_image = shared_facets(&mesh, Some(&field), &[]);
        let by_tags = shared_facets(&mesh, None, &[(&group, 0.5), (&group, 0.0)]);
        for (facets, cut) in [(by_image, 1e-9), (by_tags, 0.0)] {
            let graph = CellGraph::of_facets(mesh.cell_count(), &facets, 0.2).unwrap();
            let options = ClusterOptions { most_parts: 2, ..ClusterOptions::default() };
            let tree = ClusterTree::grow(&graph, &options, &mut Silent).unwrap();
            let middle =
                |cell: &[u32]| cell.iter().map(|&c| mesh.points()[c as usize][0]).sum::<f64>();
            let expected = mesh.cells().map(|cell| if middle(cell) < 9.0 { 2 } else { 1 });
            assert_eq!(tree.parts(2), expected.collect::<Vec<_>>());
            assert!(tree.splits().all(|split| split.cut <= cut));
        }
    }

    #[test]
    fn polygons_part_along_faces_of_a_feature() {
        let sites: Vec<Point<2>> =
            (0..32).map(|i| [0.5 + f64::from(i % 8), 0.5 + f64::from(i / 8)]).collect();
        let bounds = Bounds { min: [0.0; 2], max: [8.0, 4.0] };
        let mesh = voronoi(&Delaunay::<2>::new(), &sites, bounds, &mut Silent).unwrap();
        let is_on =
            |face: usize| mesh.face(face).iter().all(|&p| mesh.points()[p as usize][0] == 5.0);
        let features = FeatureFaces {
            of_faces: (0..mesh.face_count()).map(|face| u32::from(is_on(face))).collect(),
            strengths: vec![0.0; mesh.inner_face_count()],
            areas: vec![4.0],
        };
        let faces = shared_faces(&mesh, &features, |_| 0.1);
        let graph = CellGraph::of_facets(32, &faces, 0.2).unwrap();
        let tree = ClusterTree::grow(&graph, &ClusterOptions::default(), &mut Silent).unwrap();
        let expected: Vec<i32> = (0..32).map(|i| if i % 8 < 5 { 1 } else { 2 }).collect();
        assert_eq!(tree.parts(2), expected);
    }
}
