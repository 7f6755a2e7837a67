//! Connecting points by Delaunay's rule: no point lies inside the circumsphere of a cell.
//!
//! The points are checked, scaled by a power of two, which is exact, and put along a Hilbert curve;
//! insertion one by one makes the cells; the cells are put in a canonical order.
//! Threads share the work, but nothing depends on them, and the cells do not depend on the order of
//! the points either.
//!
//! Points on a common circle or sphere, as in every perfect crystal, leave the choice of cells open.
//! It is made as if each point's lift |x|² were raised by an infinitesimal amount, larger by orders
//! for points later in lexicographic order (Devillers & Teillaud 2011). The result is valid, has no
//! cell without volume, and is the same however the points are numbered.

mod canonical;
mod insertion;
mod prepare;
mod rounds;
#[cfg(test)]
mod tests;

use super::{Mesh, MeshError};
use crate::geometry::Point;
use crate::watch::{Cancelled, Phase, Watch, check};

use crate::parallel::prelude::*;
use prepare::Prepared;
pub use prepare::merge_duplicates;

/// Why points were not connected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConnectError {
    /// Fewer points than one cell has corners.
    #[error("{count} points cannot be connected; expected at least {least}")]
    TooFew {
        /// How many there are.
        count: usize,
        /// The corners of one cell.
        least: usize,
    },
    /// More points than indices of 32 bits can number.
    #[error("{count} points are too many; expected at most {most}")]
    TooMany {
        /// How many there are.
        count: usize,
        /// How many there may be.
        most: usize,
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
    /// A coordinate is too near zero, beside the others, for exact arithmetic.
    #[error(
        "point {point} has the coordinate {value:e} along axis {axis}; \
         expected 0 or a magnitude of at least {least:e}, 2^-140 of the largest"
    )]
    TooSmall {
        /// The point's index.
        point: usize,
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
        /// The coordinate found.
        value: f64,
        /// The least magnitude that is not 0.
        least: f64,
    },
    /// Two points are equal.
    #[error("points {first} and {second} are equal; expected distinct points")]
    Duplicate {
        /// The lower index.
        first: usize,
        /// The higher index.
        second: usize,
    },
    /// All points lie on one line (2-D) or one plane (3-D).
    #[error("all {count} points lie on one {}; they have no cells", if *.dimension == 2 { "line" } else { "plane" })]
    Flat {
        /// How many points there are.
        count: usize,
        /// The dimension of their space.
        dimension: usize,
    },
    /// The work was ended by its watch.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The cells do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Most points that can be connected: the cells' facets are numbered by 32 bits.
pub(crate) const MOST_POINTS: usize = 1 << 27;

/// Points inserted between two looks at the watch: some 10 ms.
const STRIDE: usize = 4096;

/// Makes cells of prepared points; `None` if all lie on one line (2-D) or plane (3-D).
///
/// Returns the corners, as the caller's indices, `D + 1` a cell, in the order of
/// [`canonical::arrange`] and orientation positive.
type Connector<const D: usize> =
    fn(&Prepared<D>, &mut dyn Watch) -> Result<Option<Vec<u32>>, Cancelled>;

/// Connects points to a [`Mesh`] by Delaunay's rule.
#[derive(Clone, Copy, Debug)]
pub struct Delaunay<const D: usize> {
    connector: Connector<D>,
    /// Puts cells, as prepared points, in the order of [`canonical::arrange`].
    arranger: fn(&Prepared<D>, &[u32]) -> Vec<u32>,
}

/// Cells of `N` corners, prepared points, in canonical order, as the caller's indices.
fn in_order<const D: usize, const N: usize>(prepared: &Prepared<D>, cells: &[u32]) -> Vec<u32> {
    canonical::arrange(&[cells.as_chunks::<N>().0.to_vec()], &prepared.order)
}

impl Delaunay<2> {
    /// Triangles, by incremental insertion (Bowyer 1981, Watson 1981), on all threads.
    pub fn new() -> Self {
        Self {
            connector: insertion::connect::<2, 3>,
            arranger: |of, cells| in_order::<2, 3>(of, cells),
        }
    }
}

impl Delaunay<3> {
    /// Tetrahedra, by incremental insertion (Bowyer 1981, Watson 1981), on all threads.
    pub fn new() -> Self {
        Self {
            connector: insertion::connect::<3, 4>,
            arranger: |of, cells| in_order::<3, 4>(of, cells),
        }
    }
}

impl Default for Delaunay<2> {
    fn default() -> Self {
        Self::new()
    }
}

impl Default for Delaunay<3> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const D: usize> Delaunay<D> {
    /// Connects all `points`; the mesh has the same points in the same order.
    ///
    /// The cells fill the convex hull. Each has positive orientation by exact arithmetic and no
    /// point inside its circumsphere. Its corners come in Hilbert order (see
    /// [`crate::geometry::hilbert_order`]) but for the last two, which follow from the orientation;
    /// the cells come in lexicographic order of their corners' places in it, so that cells near in
    /// the list are near in space.
    ///
    /// Reports [`Phase::Connect`] to `watch`. Cost: about O(n log n) for points of limited crowding.
    ///
    /// # Errors
    /// [`ConnectError`] if points are too few, too many, equal, on one line or plane, or have a
    /// coordinate that is not finite; or if `watch` ends the work.
    pub fn connect(
        &self,
        points: &[Point<D>],
        watch: &mut dyn Watch,
    ) -> Result<Mesh<D>, ConnectError> {
        check(watch, Phase::Connect, 0.0, None)?;
        let prepared = Prepared::new(points)?;
        let corners = (self.connector)(&prepared, watch)?
            .ok_or(ConnectError::Flat { count: points.len(), dimension: D })?;
        check(watch, Phase::Connect, 1.0, None)?;
        Ok(Mesh::new(points.par_iter().copied().collect(), corners)?)
    }

    /// The mesh of points and cells that are known to be those of [`Self::connect`], with cells and corners in its order.
    pub(crate) fn arrange(
        &self,
        points: Vec<Point<D>>,
        corners: Vec<u32>,
    ) -> Result<Mesh<D>, ConnectError> {
        let prepared = Prepared::new(&points)?;
        let mut ranks = vec![0; points.len()];
        prepared.order.iter().zip(0..).for_each(|(&point, rank)| ranks[point as usize] = rank);
        let cells: Vec<u32> = corners.iter().map(|&point| ranks[point as usize]).collect();
        Ok(Mesh::new(points, (self.arranger)(&prepared, &cells))?)
    }
}
