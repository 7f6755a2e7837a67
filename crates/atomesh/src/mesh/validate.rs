//! What a mesh promises, checked by exact arithmetic.

use crate::parallel::prelude::*;

use super::Mesh;
use super::facets::HalfFacet;

/// The first promise that a mesh breaks.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshFault {
    /// A cell is flat or inverted.
    #[error(
        "cell {cell} with corners {corners:?} has the measure {measure:e}; expected it positive"
    )]
    Orientation {
        /// The cell's index.
        cell: usize,
        /// Its corners.
        corners: Vec<u32>,
        /// Its area or volume, rounded.
        measure: f64,
    },
    /// More than two cells meet in one facet.
    #[error("facet {facet:?} has {count} cells; expected one or two")]
    Crowded {
        /// The facet's corners, ascending.
        facet: Vec<u32>,
        /// How many cells have it.
        count: usize,
    },
    /// Two cells lie on the same side of the facet that they share.
    #[error("cells {} and {} lie on the same side of facet {facet:?}", .cells[0], .cells[1])]
    Overlap {
        /// The facet's corners, ascending.
        facet: Vec<u32>,
        /// The cells.
        cells: [usize; 2],
    },
    /// A point is not a corner of any cell.
    #[error("point {point} is not a corner of any cell")]
    Unused {
        /// The point's index.
        point: usize,
    },
    /// A point lies inside the circumsphere of a cell next to it: the mesh is not Delaunay's.
    #[error("point {point} lies inside the circumsphere of cell {cell}")]
    NotDelaunay {
        /// The cell's index.
        cell: usize,
        /// The corner of its neighbour.
        point: usize,
    },
}

impl<const D: usize> Mesh<D> {
    /// Checks by exact arithmetic that every cell has positive orientation, that no facet has more
    /// than two cells, that two cells lie on different sides of the facet they share, and that every
    /// point is a corner of some cell. Cost: O(cells).
    ///
    /// # Errors
    /// The first fault, in this order.
    pub fn validate(&self) -> Result<(), MeshFault> {
        let is_bad = |corners: &[u32]| {
            // Not `<= 0`: points too far apart for exact arithmetic could give NaN.
            let orientation = self.simplex(corners).orientation().partial_cmp(&0.0);
            !matches!(orientation, Some(std::cmp::Ordering::Greater))
        };
        let cells = self.corners.par_chunks_exact(Self::CORNERS).with_min_len(1 << 10);
        if let Some(cell) = cells.position_first(is_bad) {
            let corners = &self.corners[cell * Self::CORNERS..(cell + 1) * Self::CORNERS];
            let measure = self.simplex(corners).measure();
            return Err(MeshFault::Orientation { cell, corners: corners.to_vec(), measure });
        }
        if let Some(fault) = self.first_of_facets(|halves| self.fault_of(halves)) {
            return Err(fault);
        }
        let mut used = vec![false; self.points.len()];
        for &corner in &self.corners {
            used[corner as usize] = true;
        }
        match used.iter().position(|used| !used) {
            Some(point) => Err(MeshFault::Unused { point }),
            None => Ok(()),
        }
    }

    /// What is wrong with the cells beside a facet, all of positive orientation.
    fn fault_of(&self, halves: &[HalfFacet<D>]) -> Option<MeshFault> {
        let facet = halves[0].corners.to_vec();
        match halves {
            [_] => None,
            [a, b] if self.is_above(a) == self.is_above(b) => {
                Some(MeshFault::Overlap { facet, cells: [a.cell as usize, b.cell as usize] })
            }
            [_, _] => None,
            _ => Some(MeshFault::Crowded { facet, count: halves.len() }),
        }
    }

    /// Whether the facet's corners followed by the apex have the orientation of the cell: they are an even permutation of
    /// its corners.
    fn is_above(&self, half: &HalfFacet<D>) -> bool {
        let at = half.cell as usize * Self::CORNERS;
        let corners = &self.corners[at..at + Self::CORNERS];
        let rank = |corner: &u32| half.corners.iter().position(|c| c == corner).unwrap_or(D);
        let swaps: usize = (0..corners.len())
            .map(|k| corners[..k].iter().filter(|c| rank(c) > rank(&corners[k])).count())
            .sum();
        swaps.is_multiple_of(2)
    }

    /// Checks by exact arithmetic that across every facet the neighbour's corner is not inside the
    /// circumsphere. For a valid mesh of a convex region this makes it a Delaunay mesh (Delaunay
    /// 1934). Cost: O(cells).
    ///
    /// # Errors
    /// [`MeshFault::NotDelaunay`] for the first facet that fails.
    pub fn check_delaunay(&self) -> Result<(), MeshFault> {
        let fault = self.first_of_facets(|halves| {
            let [one, other] = halves else { return None };
            let (cell, point) = (one.cell as usize, other.apex as usize);
            let at = cell * Self::CORNERS;
            let simplex = self.simplex(&self.corners[at..at + Self::CORNERS]);
            let is_inside = simplex.in_sphere(&self.points[point]) > 0.0;
            is_inside.then_some(MeshFault::NotDelaunay { cell, point })
        });
        fault.map_or(Ok(()), Err)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    fn fault(points: &[[f64; 2]], corners: &[u32]) -> MeshFault {
        Mesh::new(points.to_vec(), corners.to_vec()).unwrap().validate().unwrap_err()
    }

    #[test]
    fn a_sound_mesh_has_no_fault() {
        let mesh = Mesh::new(SQUARE.to_vec(), vec![0, 1, 2, 0, 2, 3]).unwrap();
        assert_eq!(mesh.validate(), Ok(()));
        assert_eq!(mesh.check_delaunay(), Ok(()));
    }

    #[test]
    fn every_fault_is_named() {
        let wrong = fault(&SQUARE, &[0, 1, 2, 0, 3, 2]);
        assert!(matches!(wrong, MeshFault::Orientation { cell: 1, .. }), "{wrong}");
        let flat = fault(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]], &[0, 1, 2]);
        assert!(matches!(flat, MeshFault::Orientation { cell: 0, .. }), "{flat}");
        let overlap = fault(&SQUARE, &[0, 1, 2, 0, 1, 3]);
        assert_eq!(overlap, MeshFault::Overlap { facet: vec![0, 1], cells: [0, 1] });
        let crowded = fault(&SQUARE, &[0, 1, 2, 0, 1, 3, 0, 1, 2]);
        assert_eq!(crowded, MeshFault::Crowded { facet: vec![0, 1], count: 3 });
        assert_eq!(fault(&SQUARE, &[0, 1, 2]), MeshFault::Unused { point: 3 });
    }

    #[test]
    fn a_wrong_diagonal_is_not_delaunay() {
        let points = vec![[0.0, 0.0], [4.0, 0.0], [2.0, 1.0], [2.0, -1.0]];
        let mesh = Mesh::new(points, vec![0, 1, 2, 0, 3, 1]).unwrap();
        assert_eq!(mesh.validate(), Ok(()));
        let fault = mesh.check_delaunay().unwrap_err();
        assert_eq!(fault, MeshFault::NotDelaunay { cell: 0, point: 3 });
    }
}
