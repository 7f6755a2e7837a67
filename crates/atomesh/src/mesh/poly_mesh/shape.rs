//! Measures, centroids and normals of cells and faces.

use crate::parallel::prelude::*;

use super::{BLOCK, PolyMesh};
use crate::geometry::{Point, Simplex, dot};
use crate::mesh::area_vector;

impl<const D: usize> PolyMesh<D> {
    pub(super) fn measure_cells(&mut self) {
        let cells = 0..self.cell_count();
        let solids = cells.into_par_iter().with_min_len(BLOCK).map(|cell| self.solid(cell));
        (self.measures, self.centroids) = solids.unzip();
    }

    /// The measure and the centroid of a cell: the sum over the simplices from its apex to its faces. Faces are cut
    /// the same way for both cells, so that the sum over all cells is the box's to rounding.
    fn solid(&self, cell: usize) -> (f64, Point<D>) {
        let apex = self.apex(cell);
        let (mut sum, mut moment) = (0.0, [0.0; D]);
        for (face, sign) in self.faces_of(cell) {
            for others in self.face_simplices(face) {
                let measure = sign * Simplex { first: apex, others }.measure();
                sum += measure;
                for k in 0..D {
                    let of_corners: f64 = others.iter().map(|p| p[k] - apex[k]).sum();
                    moment[k] += measure * of_corners / (D + 1) as f64;
                }
            }
        }
        (sum, std::array::from_fn(|k| apex[k] + moment[k] / sum))
    }

    /// A point inside a cell: its site, or the mean of its faces' corners.
    fn apex(&self, cell: usize) -> Point<D> {
        if let Some(sites) = &self.sites {
            return sites[cell];
        }
        let (mut sum, mut count) = ([0.0; D], 0.0);
        for &corner in self.faces_of(cell).flat_map(|(face, _)| self.face(face)) {
            (0..D).for_each(|k| sum[k] += self.points[corner as usize][k]);
            count += 1.0;
        }
        sum.map(|x| x / count)
    }

    /// The points around a polygon (2-D), counter-clockwise if its faces' normals point out of it.
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

    /// The simplices (2-D: a segment, 3-D: triangles) that a face is cut into, from its first point.
    pub fn face_simplices(&self, face: usize) -> impl Iterator<Item = [Point<D>; D]> + '_ {
        self.face_parts(face).map(|corners| corners.map(|c| self.points[c as usize]))
    }

    /// The simplices of [`Self::face_simplices`] as the numbers of their points.
    pub fn face_parts(&self, face: usize) -> impl Iterator<Item = [u32; D]> + '_ {
        let corners = self.face(face);
        (0..corners.len() + 1 - D)
            .map(move |n| std::array::from_fn(|k| corners[if k == 0 { 0 } else { n + k }]))
    }

    /// The normal of a face as long as the face is large, out of its owner.
    pub fn area_vector(&self, face: usize) -> Point<D> {
        let mut sum = [0.0; D];
        for simplex in self.face_simplices(face) {
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
        for simplex in self.face_simplices(face) {
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
}
