//! Polygons and polyhedra as points, faces and cells.
//!
//! Voronoi cells are such a mesh, and have *sites*; cells from elsewhere need none. Geometry of cells and faces is in
//! `shape`, what a mesh promises in `validate`, and what two-point flow needs of it in `connections`.

mod connections;
mod report;
mod shape;
mod validate;

use std::ops::Range;

use crate::parallel::prelude::*;

use super::compensated_sum;
use crate::geometry::{Bounds, Point};
pub use connections::{BoundaryConnection, Connection, boundary_connections, connections};
pub use report::PolyReport;
pub use validate::PolyFault;

/// Points or cells that one task moves or measures.
const BLOCK: usize = 1 << 12;

/// What a [`PolyMesh`] is made of: faces inside the box first, by owner and neighbour, then side after side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PolyParts<const D: usize> {
    /// The points.
    pub points: Vec<Point<D>>,
    /// The points of all faces, one face after another, their normals out of the owners.
    pub corners: Vec<u32>,
    /// Where each face ends among the corners.
    pub ends: Vec<usize>,
    /// The cell that each face belongs to.
    pub owners: Vec<u32>,
    /// The cell on the other side of each face inside the box.
    pub neighbours: Vec<u32>,
    /// How many faces each side of the box has: xmin, xmax, ymin …
    pub side_counts: [usize; 6],
    /// The sites, one a cell, if there are any.
    pub sites: Option<Vec<Point<D>>>,
}

/// Convex cells that fill a box: polygons in 2-D, polyhedra in 3-D.
///
/// A *face* is a loop of points: two in 2-D, where faces are edges, three or more in 3-D. It belongs to its
/// *owner*, the lesser of its two cells. Its normal, that of a counter-clockwise loop (in 2-D: to the right of the
/// way from the first point to the second), points away from the owner, to the *neighbour* or out of the box. Faces
/// inside the box come first, by owner and neighbour; then those on the sides xmin, xmax, ymin … ([`side_name`]), by
/// owner. That is the order that OpenFOAM asks for. Points are shared: two cells that meet name the same points.
///
/// [`side_name`]: super::side_name
#[derive(Clone, Debug, PartialEq)]
pub struct PolyMesh<const D: usize> {
    points: Vec<Point<D>>,
    corners: Vec<u32>,
    ends: Vec<usize>,
    owners: Vec<u32>,
    neighbours: Vec<u32>,
    /// Where the faces of each side end.
    side_ends: Vec<usize>,
    sites: Option<Vec<Point<D>>>,
    cell_starts: Vec<usize>,
    cell_faces: Vec<u32>,
    measures: Vec<f64>,
    centroids: Vec<Point<D>>,
}

/// (V/n)^(1/D), the mean distance of n sites or cells in a box.
pub(crate) fn mean_distance<const D: usize>(bounds: &Bounds<D>, count: usize) -> f64 {
    (bounds.measure() / count as f64).powf(1.0 / D as f64)
}

impl<const D: usize> PolyMesh<D> {
    /// The mesh of these parts. Without sites there are as many cells as faces name. Cost: O(corners).
    ///
    /// # Errors
    /// [`PolyFault`] if the counts of the parts disagree, a face has fewer than D corners or names a point or cell
    /// that does not exist, or a cell has no measure above 0. [`Self::validate`] checks the rest.
    pub fn new(parts: PolyParts<D>) -> Result<Self, PolyFault> {
        let greatest = parts.owners.iter().chain(&parts.neighbours).max();
        let named = greatest.map_or(0, |&cell| cell as usize + 1);
        let cell_count = parts.sites.as_ref().map_or(named, Vec::len);
        validate::check_parts(&parts, cell_count)?;
        let PolyParts { points, corners, ends, owners, neighbours, side_counts, sites } = parts;
        let mut at = neighbours.len();
        let side_ends = side_counts[..2 * D].iter().map(|n| {
            at += n;
            at
        });
        let side_ends = side_ends.collect();
        let (cell_starts, cell_faces) = faces_of_cells(cell_count, &owners, &neighbours);
        let (measures, centroids) = (Vec::new(), Vec::new());
        let mut mesh = Self {
            points,
            corners,
            ends,
            owners,
            neighbours,
            side_ends,
            sites,
            cell_starts,
            cell_faces,
            measures,
            centroids,
        };
        mesh.measure_cells();
        mesh.check_cells()?;
        Ok(mesh)
    }

    /// The points, each named by some face.
    pub fn points(&self) -> &[Point<D>] {
        &self.points
    }

    /// The sites of Voronoi cells, one a cell; `None` for cells that have none.
    pub fn sites(&self) -> Option<&[Point<D>]> {
        self.sites.as_deref()
    }

    /// The point that stands for each cell where flow is between points: its site, or its centroid if cells have no
    /// sites.
    pub fn centers(&self) -> &[Point<D>] {
        self.sites.as_deref().unwrap_or(&self.centroids)
    }

    /// The number of cells.
    pub fn cell_count(&self) -> usize {
        self.cell_starts.len() - 1
    }

    /// The number of faces.
    pub fn face_count(&self) -> usize {
        self.owners.len()
    }

    /// The number of faces between two cells; they come first.
    pub fn inner_face_count(&self) -> usize {
        self.neighbours.len()
    }

    /// The points of a face.
    pub fn face(&self, face: usize) -> &[u32] {
        let start = if face == 0 { 0 } else { self.ends[face - 1] };
        &self.corners[start..self.ends[face]]
    }

    /// The points of all faces, one face after another.
    pub fn corners(&self) -> &[u32] {
        &self.corners
    }

    /// The cell that each face belongs to.
    pub fn owners(&self) -> &[u32] {
        &self.owners
    }

    /// The cell on the other side of each face inside the box.
    pub fn neighbours(&self) -> &[u32] {
        &self.neighbours
    }

    /// The faces on a side of the box, 2 · axis, and 1 more at its end.
    pub fn side(&self, side: usize) -> Range<usize> {
        let start = if side == 0 { self.neighbours.len() } else { self.side_ends[side - 1] };
        start..self.side_ends[side]
    }

    /// The areas (2-D) or volumes (3-D) of the cells.
    pub fn measures(&self) -> &[f64] {
        &self.measures
    }

    /// The centroids of the cells.
    pub fn centroids(&self) -> &[Point<D>] {
        &self.centroids
    }

    /// The sum of all measures, added with compensation.
    pub fn measure(&self) -> f64 {
        compensated_sum(self.measures.iter().copied())
    }

    /// The faces of a cell, ascending, each with 1 if its normal points out of the cell, else −1.
    pub fn faces_of(&self, cell: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let faces = &self.cell_faces[self.cell_starts[cell]..self.cell_starts[cell + 1]];
        faces.iter().map(move |&face| {
            let owns = self.owners[face as usize] as usize == cell;
            (face as usize, if owns { 1.0 } else { -1.0 })
        })
    }

    /// The mesh with its points and sites moved by an affine map, which turns loops over if it mirrors. Cells
    /// stay convex; unless the map is a similarity, faces no longer stand at right angles to the lines between
    /// their sites.
    pub fn moved(&self, mirrored: bool, to: impl Fn(&Point<D>) -> Point<D> + Sync) -> Self {
        let place = |points: &[Point<D>]| points.par_iter().with_min_len(BLOCK).map(&to).collect();
        let sites = self.sites.as_deref().map(place);
        let mut mesh = Self { points: place(&self.points), sites, ..self.clone() };
        if mirrored {
            for face in 0..mesh.ends.len() {
                let start = if face == 0 { 0 } else { mesh.ends[face - 1] };
                mesh.corners[start..mesh.ends[face]].reverse();
            }
        }
        mesh.measure_cells();
        mesh
    }
}

/// The faces of each cell, ascending: where each cell's begin, and all of them.
fn faces_of_cells(count: usize, owners: &[u32], neighbours: &[u32]) -> (Vec<usize>, Vec<u32>) {
    let mut starts = vec![0; count + 1];
    for &cell in owners.iter().chain(neighbours) {
        starts[cell as usize + 1] += 1;
    }
    for cell in 0..count {
        starts[cell + 1] += starts[cell];
    }
    let mut faces = vec![0; starts[count]];
    let mut next = starts.clone();
    for face in 0..owners.len() {
        for cell in [Some(owners[face]), neighbours.get(face).copied()].into_iter().flatten() {
            faces[next[cell as usize]] = face as u32;
            next[cell as usize] += 1;
        }
    }
    (starts, faces)
}
