//! Meshes: of triangles or tetrahedra ([`Mesh`]), of their second order ([`Quadratic`]), of polygons or polyhedra
//! ([`PolyMesh`]), with named groups of facets and cells ([`Tags`]). [`Delaunay`] connects points to make them.

mod cell_changes;
mod cells;
mod delaunay;
mod facets;
mod poly_mesh;
mod quadratic;
mod tags;
mod validate;

use crate::geometry::{Point, Simplex};
use crate::parallel::prelude::*;
#[cfg(test)]
pub(crate) use cell_changes::sort_by_swaps;
pub(crate) use cell_changes::{CellChanges, in_order};
pub(crate) use cells::{AtomEdit, Cells};
pub(crate) use delaunay::MOST_POINTS;
pub use delaunay::{ConnectError, Delaunay, merge_duplicates};
pub(crate) use facets::area_vector;
pub use facets::{CellsOfPoints, Facet};
pub(crate) use poly_mesh::mean_distance;
pub use poly_mesh::{
    BoundaryConnection, Connection, PolyFault, PolyMesh, PolyParts, PolyReport,
    boundary_connections, connections,
};
pub use quadratic::Quadratic;
pub use tags::{
    FacetGroup, MASK_NAME, PointGroup, Regions, Tags, TagsError, feature_name, interface_name,
    is_feature_name, region_name, side_name, well_name,
};
pub use validate::MeshFault;

/// Why points and corners do not make a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The corner list does not divide into cells.
    #[error("{count} corners do not make cells of {each}")]
    CornerCount {
        /// The length of the list.
        count: usize,
        /// The corners of one cell, D + 1.
        each: usize,
    },
    /// A cell names a point that does not exist.
    #[error("cell {cell} names point {point}; there are {count} points")]
    Corner {
        /// The cell's index.
        cell: usize,
        /// The point it names.
        point: u32,
        /// How many points there are.
        count: usize,
    },
    /// A coordinate is not finite.
    #[error("point {point} has the coordinate {value} along axis {axis}; expected a finite number")]
    Coordinate {
        /// The point's index.
        point: usize,
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
        /// The coordinate found.
        value: f64,
    },
}

/// Points and the triangles (2-D) or tetrahedra (3-D) between them.
///
/// A well-made mesh has cells of positive orientation: see [`crate::geometry`].
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh<const D: usize> {
    points: Vec<[f64; D]>,
    corners: Vec<u32>,
}

impl<const D: usize> Mesh<D> {
    /// The corners of one cell: 3 in 2-D, 4 in 3-D.
    pub const CORNERS: usize = D + 1;

    /// A mesh of `points` and cells of `D + 1` corners each, one cell after another.
    ///
    /// # Errors
    /// [`MeshError`] if the corners do not divide into cells, name a missing point, or a
    /// coordinate is not finite.
    pub fn new(points: Vec<[f64; D]>, corners: Vec<u32>) -> Result<Self, MeshError> {
        if !corners.len().is_multiple_of(Self::CORNERS) {
            return Err(MeshError::CornerCount { count: corners.len(), each: Self::CORNERS });
        }
        let odd = |p: &[f64; D]| p.iter().position(|x| !x.is_finite());
        if let Some(point) = points.par_iter().position_first(|p| odd(p).is_some()) {
            let axis = odd(&points[point]).unwrap_or(0);
            return Err(MeshError::Coordinate { point, axis, value: points[point][axis] });
        }
        if let Some(at) = corners.par_iter().position_first(|&c| c as usize >= points.len()) {
            return Err(MeshError::Corner {
                cell: at / Self::CORNERS,
                point: corners[at],
                count: points.len(),
            });
        }
        Ok(Self { points, corners })
    }

    /// The points.
    pub fn points(&self) -> &[[f64; D]] {
        &self.points
    }

    /// The corners of all cells, `D + 1` a cell.
    pub fn corners(&self) -> &[u32] {
        &self.corners
    }

    /// The cells, each as its `D + 1` corners.
    pub fn cells(&self) -> impl ExactSizeIterator<Item = &[u32]> + Clone {
        self.corners.chunks_exact(Self::CORNERS)
    }

    /// The number of cells.
    pub fn cell_count(&self) -> usize {
        self.corners.len() / Self::CORNERS
    }

    /// A cell, given as its corners, with the coordinates of its points.
    ///
    /// # Panics
    /// If `cell` has other than `D + 1` corners, or names a point that does not exist.
    pub fn simplex(&self, cell: &[u32]) -> Simplex<D> {
        assert_eq!(cell.len(), Self::CORNERS, "a cell has D + 1 corners");
        let at = |k: usize| self.points[cell[k] as usize];
        Simplex { first: at(0), others: std::array::from_fn(|k| at(k + 1)) }
    }

    /// The cells with the coordinates of their points.
    pub fn simplices(&self) -> impl ExactSizeIterator<Item = Simplex<D>> + '_ {
        self.cells().map(|cell| self.simplex(cell))
    }

    /// The sum of the cells' areas (2-D) or volumes (3-D), added with compensation (Neumaier 1974):
    /// the rounding error does not grow with the number of cells.
    pub fn measure(&self) -> f64 {
        compensated_sum(self.simplices().map(|simplex| simplex.measure()))
    }

    /// The mesh with its points moved by an affine map, its cells turned over if the map mirrors.
    ///
    /// # Panics
    /// If a point is moved to where a coordinate is not finite.
    pub fn moved(&self, mirrored: bool, to: impl Fn(&Point<D>) -> Point<D> + Sync) -> Self {
        let points = self.points.par_iter().with_min_len(1 << 10).map(&to).collect();
        let mut corners = self.corners.clone();
        if mirrored {
            corners.chunks_exact_mut(Self::CORNERS).for_each(|cell| cell.swap(D - 1, D));
        }
        Self::new(points, corners).expect("the map keeps points finite")
    }

    /// The points and the corners.
    pub fn into_parts(self) -> (Vec<[f64; D]>, Vec<u32>) {
        (self.points, self.corners)
    }
}

/// The sum of numbers, added with compensation (Neumaier 1974): the rounding error does not grow with their count.
fn compensated_sum(terms: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut lost) = (0.0_f64, 0.0);
    for term in terms {
        let total = sum + term;
        let (large, small) = if sum.abs() >= term.abs() { (sum, term) } else { (term, sum) };
        lost += (large - total) + small;
        sum = total;
    }
    sum + lost
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_of_a_mirrored_mesh_stay_positive() {
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mesh = Mesh::new(points, vec![0, 1, 2, 3]).unwrap();
        let mirrored = mesh.moved(true, |p| [-2.0 * p[0], p[1], p[2] + 5.0]);
        assert_eq!(mirrored.validate(), Ok(()));
        assert_eq!((mirrored.measure(), mirrored.points()[1]), (2.0 / 6.0, [-2.0, 0.0, 5.0]));
        assert_eq!(mirrored.moved(true, |p| [-0.5 * p[0], p[1], p[2] - 5.0]), mesh);
    }

    #[test]
    fn compensated_sums_keep_small_terms() {
        assert_eq!(compensated_sum([1e17, 1.0, -1e17].into_iter()), 1.0);
    }
}
