//! Polygons and polyhedra as points, faces and cells.

use std::ops::Range;

use rayon::prelude::*;

use crate::geometry::{Point, Simplex, difference, dot};

/// Cells that one task measures.
const BLOCK: usize = 1 << 12;

/// What a mesh is made of: faces inside first, by owner and neighbour, then side after side.
#[derive(Default)]
pub(super) struct Parts<const D: usize> {
    pub points: Vec<Point<D>>,
    pub corners: Vec<u32>,
    pub ends: Vec<usize>,
    pub owners: Vec<u32>,
    /// Of the faces inside.
    pub neighbours: Vec<u32>,
    /// How many faces each side has.
    pub side_counts: [usize; 6],
    pub sites: Vec<Point<D>>,
}

/// Convex cells that fill a box: polygons in 2-D, polyhedra in 3-D.
///
/// A *face* is a loop of points: two in 2-D, where faces are edges, three or more in 3-D. It belongs to its
/// *owner*, the lesser of its two cells, and its normal, that of a counter-clockwise loop (in 2-D: to the
/// right of the way from the first point to the second), points away from the owner, to the *neighbour* or out
/// of the box. Faces inside the box come first, by owner and neighbour; then those on the sides xmin, xmax,
/// ymin ... ([`side_name`]), by owner. That is the order that OpenFOAM asks for. Points are shared: two cells that
/// meet name the same points.
#[derive(Clone, Debug, PartialEq)]
pub struct PolyMesh<const D: usize> {
    points: Vec<Point<D>>,
    corners: Vec<u32>,
    ends: Vec<usize>,
    owners: Vec<u32>,
    neighbours: Vec<u32>,
    /// Where the faces of each side end.
    side_ends: Vec<usize>,
    sites: Vec<Point<D>>,
    cell_starts: Vec<usize>,
    cell_faces: Vec<u32>,
    measures: Vec<f64>,
    centroids: Vec<Point<D>>,
}

/// The name of a side of the box: 0 is xmin, 1 xmax, 2 ymin ... of the image's axes.
pub fn side_name(side: usize) -> &'static str {
    ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"][side]
}

impl<const D: usize> PolyMesh<D> {
    pub(super) fn new(parts: Parts<D>) -> Self {
        let Parts { points, corners, ends, owners, neighbours, side_counts, sites } = parts;
        let mut at = neighbours.len();
        let side_ends = side_counts[..2 * D].iter().map(|n| {
            at += n;
            at
        });
        let side_ends = side_ends.collect();
        let mut cell_starts = vec![0; sites.len() + 1];
        for &cell in owners.iter().chain(&neighbours) {
            cell_starts[cell as usize + 1] += 1;
        }
        for cell in 0..sites.len() {
            cell_starts[cell + 1] += cell_starts[cell];
        }
        let mut cell_faces = vec![0; cell_starts[sites.len()]];
        let mut next = cell_starts.clone();
        for face in 0..owners.len() {
            for cell in [Some(owners[face]), neighbours.get(face).copied()].into_iter().flatten() {
                cell_faces[next[cell as usize]] = face as u32;
                next[cell as usize] += 1;
            }
        }
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
        mesh
    }

    fn measure_cells(&mut self) {
        let cells = 0..self.sites.len();
        let solids = cells.into_par_iter().with_min_len(BLOCK).map(|cell| self.solid(cell));
        (self.measures, self.centroids) = solids.unzip();
    }

    /// The measure and the centroid of a cell: the sum over the simplices from its site to its faces. Faces
    /// are cut the same way for both cells, so that the sum over all cells is the box's to rounding.
    fn solid(&self, cell: usize) -> (f64, Point<D>) {
        let site = self.sites[cell];
        let (mut sum, mut moment) = (0.0, [0.0; D]);
        for (face, sign) in self.faces_of(cell) {
            for others in self.simplices(face) {
                let measure = sign * Simplex { first: site, others }.measure();
                sum += measure;
                for k in 0..D {
                    let of_corners: f64 = others.iter().map(|p| p[k] - site[k]).sum();
                    moment[k] += measure * of_corners / (D + 1) as f64;
                }
            }
        }
        (sum, std::array::from_fn(|k| site[k] + moment[k] / sum))
    }

    /// The points, each named by some face.
    pub fn points(&self) -> &[Point<D>] {
        &self.points
    }

    /// The sites, one a cell.
    pub fn sites(&self) -> &[Point<D>] {
        &self.sites
    }

    /// The number of cells.
    pub fn cell_count(&self) -> usize {
        self.sites.len()
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
        let (mut sum, mut lost) = (0.0_f64, 0.0);
        for &term in &self.measures {
            let total = sum + term;
            let (large, small) = if sum.abs() >= term.abs() { (sum, term) } else { (term, sum) };
            lost += (large - total) + small;
            sum = total;
        }
        sum + lost
    }

    /// The faces of a cell, ascending, each with 1 if its normal points out of the cell, else −1.
    pub fn faces_of(&self, cell: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let faces = &self.cell_faces[self.cell_starts[cell]..self.cell_starts[cell + 1]];
        faces.iter().map(move |&face| {
            let owns = self.owners[face as usize] as usize == cell;
            (face as usize, if owns { 1.0 } else { -1.0 })
        })
    }

    /// The points around a cell of a flat mesh, counter-clockwise where the cells are.
    pub fn polygon(&self, cell: usize) -> Vec<u32> {
        let mut edges: Vec<[u32; 2]> = (self.faces_of(cell))
            .map(|(face, sign)| {
                let ends = self.face(face);
                if sign > 0.0 { [ends[0], ends[1]] } else { [ends[1], ends[0]] }
            })
            .collect();
        let mut around = Vec::with_capacity(edges.len());
        let mut at = edges.first().map_or(0, |edge| edge[0]);
        while let Some(next) = edges.iter().position(|edge| edge[0] == at) {
            around.push(at);
            at = edges.swap_remove(next)[1];
        }
        around
    }

    /// The simplices (segments in 2-D, triangles in 3-D) that a face is cut into, from its first point.
    pub fn simplices(&self, face: usize) -> impl Iterator<Item = [Point<D>; D]> + '_ {
        self.parts(face).map(|corners| corners.map(|c| self.points[c as usize]))
    }

    /// The same by the numbers of their points.
    pub fn parts(&self, face: usize) -> impl Iterator<Item = [u32; D]> + '_ {
        let corners = self.face(face);
        (0..corners.len() + 1 - D)
            .map(move |n| std::array::from_fn(|k| corners[if k == 0 { 0 } else { n + k }]))
    }

    /// The normal of a face as long as the face is large, out of its owner.
    pub fn area_vector(&self, face: usize) -> Point<D> {
        let mut sum = [0.0; D];
        for simplex in self.simplices(face) {
            let part = area_vector(&simplex);
            (0..D).for_each(|k| sum[k] += part[k]);
        }
        sum
    }

    /// The centroid of a face.
    pub fn face_centroid(&self, face: usize) -> Point<D> {
        let whole = self.area_vector(face);
        let (mut sum, mut moment) = (0.0, [0.0; D]);
        let first = self.points[self.face(face)[0] as usize];
        for simplex in self.simplices(face) {
            let area = dot(&area_vector(&simplex), &whole);
            sum += area;
            for k in 0..D {
                let of_corners: f64 = simplex.iter().map(|p| p[k] - first[k]).sum();
                moment[k] += area * of_corners / D as f64;
            }
        }
        if sum > 0.0 {
            return std::array::from_fn(|k| first[k] + moment[k] / sum);
        }
        // so thin that its area is lost to rounding
        let corners = self.face(face);
        let mean = |k: usize| corners.iter().map(|&c| self.points[c as usize][k]).sum::<f64>();
        std::array::from_fn(|k| mean(k) / corners.len() as f64)
    }

    /// The mesh with its points and sites moved by an affine map, which turns loops over if it mirrors. Cells
    /// stay convex; unless the map is a similarity, faces no longer stand at right angles to the lines between
    /// their sites.
    pub fn moved(&self, mirrored: bool, to: impl Fn(&Point<D>) -> Point<D> + Sync) -> Self {
        let place = |points: &[Point<D>]| points.par_iter().with_min_len(BLOCK).map(&to).collect();
        let mut mesh =
            Self { points: place(&self.points), sites: place(&self.sites), ..self.clone() };
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

/// The normal of a segment or triangle, as long as the simplex is large: to the right of a segment, on the
/// side from which a triangle runs counter-clockwise.
pub(super) fn area_vector<const D: usize>(simplex: &[Point<D>; D]) -> Point<D> {
    const { assert!(D == 2 || D == 3) };
    let u = difference(&simplex[1], &simplex[0]);
    if D == 2 {
        return std::array::from_fn(|k| if k == 0 { u[1] } else { -u[0] });
    }
    let v = difference(&simplex[D - 1], &simplex[0]);
    std::array::from_fn(|k| {
        let (a, b) = ((k + 1) % D, (k + 2) % D);
        0.5 * (u[a] * v[b] - u[b] * v[a])
    })
}
