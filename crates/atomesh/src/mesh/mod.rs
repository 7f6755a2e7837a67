//! Triangle and tetrahedral meshes, and how points are connected to make them.

/// What is wrong with a mesh's parts.
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
        if corners.len() % Self::CORNERS != 0 {
            return Err(MeshError::CornerCount { count: corners.len(), each: Self::CORNERS });
        }
        for (point, p) in points.iter().enumerate() {
            if let Some(axis) = p.iter().position(|x| !x.is_finite()) {
                return Err(MeshError::Coordinate { point, axis, value: p[axis] });
            }
        }
        if let Some(at) = corners.iter().position(|&c| c as usize >= points.len()) {
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

    /// The points and the corners.
    pub fn into_parts(self) -> (Vec<[f64; D]>, Vec<u32>) {
        (self.points, self.corners)
    }
}
