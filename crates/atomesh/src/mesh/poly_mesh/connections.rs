//! Which cells are connected, and by what: the geometry that two-point flow needs.

use crate::parallel::prelude::*;

use super::PolyMesh;
use crate::geometry::{Point, difference, dot};

/// Faces that one task looks at.
const BLOCK: usize = 1 << 12;

/// A face between two cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Connection<const D: usize> {
    /// The two cells, the lesser first.
    pub cells: [u32; 2],
    /// The face's area (3-D) or length (2-D).
    pub area: f64,
    /// From each cell's centre, [`PolyMesh::centers`], to the face's plane.
    pub distances: [f64; 2],
    /// The unit normal, from the first cell to the second.
    pub normal: Point<D>,
    /// The face's centroid.
    pub centroid: Point<D>,
    /// The cosine of the angle between the normal and the line from centre to centre: 1 where flux between two
    /// points is exact for isotropic permeability.
    pub orthogonality: f64,
}

impl<const D: usize> Connection<D> {
    /// The geometric part of the transmissibility, area / (d₁ + d₂), of cells of one permeability. With
    /// permeabilities k₁ and k₂ it is area / (d₁/k₁ + d₂/k₂).
    pub fn geometry(&self) -> f64 {
        self.area / (self.distances[0] + self.distances[1])
    }
}

/// A face on a side of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundaryConnection<const D: usize> {
    /// The cell.
    pub cell: u32,
    /// The side's number: see [`side_name`](crate::mesh::side_name).
    pub side: usize,
    /// The face's area (3-D) or length (2-D).
    pub area: f64,
    /// From the cell's centre to the side: 0 where the centre lies on it.
    pub distance: f64,
    /// The unit normal, out of the box.
    pub normal: Point<D>,
    /// The face's centroid.
    pub centroid: Point<D>,
}

/// The faces between cells, in the mesh's order. Lengths are in the unit of the mesh's coordinates.
pub fn connections<const D: usize>(mesh: &PolyMesh<D>) -> Vec<Connection<D>> {
    let connection = |face: usize| {
        let cells = [mesh.owners()[face], mesh.neighbours()[face]];
        let centers = cells.map(|cell| &mesh.centers()[cell as usize]);
        let axis = difference(centers[1], centers[0]);
        let length = dot(&axis, &axis).sqrt();
        let centroid = mesh.face_centroid(face);
        let (area, mut normal) = unit(&mesh.area_vector(face));
        if !normal.iter().all(|x| x.is_finite()) {
            normal = axis.map(|x| x / length); // so thin that its own is lost to rounding
        }
        let from = |center: &Point<D>| dot(&difference(&centroid, center), &normal);
        let distances = [from(centers[0]), -from(centers[1])];
        let orthogonality = dot(&normal, &axis) / length;
        Connection { cells, area, distances, normal, centroid, orthogonality }
    };
    (0..mesh.inner_face_count()).into_par_iter().with_min_len(BLOCK).map(connection).collect()
}

/// The faces on the sides of the box, side after side.
pub fn boundary_connections<const D: usize>(mesh: &PolyMesh<D>) -> Vec<BoundaryConnection<D>> {
    let sides = (0..2 * D).flat_map(|side| mesh.side(side).map(move |face| (side, face)));
    sides
        .map(|(side, face)| {
            let cell = mesh.owners()[face];
            let centroid = mesh.face_centroid(face);
            let (area, normal) = unit(&mesh.area_vector(face));
            let distance = dot(&difference(&centroid, &mesh.centers()[cell as usize]), &normal);
            BoundaryConnection { cell, side, area, distance: distance.max(0.0), normal, centroid }
        })
        .collect()
}

/// The length of a vector, and the vector of length 1.
fn unit<const D: usize>(vector: &Point<D>) -> (f64, Point<D>) {
    let length = dot(vector, vector).sqrt();
    (length, vector.map(|x| x / length))
}
