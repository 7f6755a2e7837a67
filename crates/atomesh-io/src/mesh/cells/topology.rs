//! Cells as files list them, each with all of its faces, made into a mesh whose faces are shared.

use std::collections::HashMap;

use atomesh::geometry::Point;
use atomesh::mesh::PolyParts;

use super::super::read_error::{MeshReadError, malformed};
use super::raw::CellReadError;

/// The faces of cells, one cell after another, their normals out of the cell.
#[derive(Debug, Default)]
pub(super) struct CellFaces {
    /// The points of all faces.
    corners: Vec<u32>,
    /// Where each face ends among the corners.
    ends: Vec<usize>,
    /// Where each cell ends among the faces.
    cell_ends: Vec<usize>,
}

impl CellFaces {
    /// The edges of polygons whose points run counter-clockwise; `ends` tells where each one's points end.
    ///
    /// # Errors
    /// If ends do not grow up to the number of points.
    pub fn of_polygons(points: &[u32], ends: &[u32]) -> Result<Self, MeshReadError> {
        let mut found = Self::default();
        let mut start = 0;
        for (cell, &end) in ends.iter().enumerate() {
            let around = points.get(start..end as usize).ok_or_else(|| not_growing(cell, end))?;
            start = end as usize;
            for at in 0..around.len() {
                found.add_face([around[at], around[(at + 1) % around.len()]]);
            }
            found.cell_ends.push(found.ends.len());
        }
        Ok(found)
    }

    /// The faces of polyhedra as VTK lists them: of each cell how many, then of each face how many points, and
    /// which; `ends` tells where each cell's list ends.
    ///
    /// # Errors
    /// If the lists are not as long as they say.
    pub fn of_polyhedra(list: &[u32], ends: &[u32]) -> Result<Self, MeshReadError> {
        let mut found = Self::default();
        let mut start = 0;
        for (cell, &end) in ends.iter().enumerate() {
            let own = list.get(start..end as usize).ok_or_else(|| not_growing(cell, end))?;
            start = end as usize;
            let wrong = || {
                let expected = format!("faces of cell {cell} as long as they say");
                malformed(0, expected, format!("a list of {} numbers", own.len()))
            };
            let (&count, mut rest) = own.split_first().ok_or_else(wrong)?;
            for _ in 0..count {
                let (&length, tail) = rest.split_first().ok_or_else(wrong)?;
                let (face, next) = tail.split_at_checked(length as usize).ok_or_else(wrong)?;
                found.add_face(face.iter().copied());
                rest = next;
            }
            if !rest.is_empty() {
                return Err(wrong());
            }
            found.cell_ends.push(found.ends.len());
        }
        Ok(found)
    }

    fn add_face(&mut self, corners: impl IntoIterator<Item = u32>) {
        self.corners.extend(corners);
        self.ends.push(self.corners.len());
    }

    /// How many cells there are.
    pub fn cell_count(&self) -> usize {
        self.cell_ends.len()
    }

    /// The faces of a cell.
    fn cell(&self, cell: usize) -> impl Iterator<Item = &[u32]> {
        let first = if cell == 0 { 0 } else { self.cell_ends[cell - 1] };
        (first..self.cell_ends[cell]).map(|face| {
            let start = if face == 0 { 0 } else { self.ends[face - 1] };
            &self.corners[start..self.ends[face]]
        })
    }

    /// The same cells in another order: cell n is that at `order[n]`.
    pub fn ordered(&self, order: &[usize]) -> Self {
        let mut found = Self::default();
        for &cell in order {
            self.cell(cell).for_each(|face| found.add_face(face.iter().copied()));
            found.cell_ends.push(found.ends.len());
        }
        found
    }

    /// The parts of a mesh of these cells: faces with the same points become one, turned as the first of its two cells
    /// has it. `side_of` tells on which side of the box a face with one cell is.
    ///
    /// # Errors
    /// If three cells have a face, or one has a face that is neither another's nor on a side.
    pub fn parts<const D: usize>(
        &self,
        points: Vec<Point<D>>,
        sites: Vec<Point<D>>,
        side_of: impl Fn(&[u32]) -> Option<usize>,
    ) -> Result<PolyParts<D>, CellReadError> {
        let faces = self.shared()?;
        let (mut inner, outer): (Vec<Shared>, Vec<Shared>) =
            faces.into_iter().partition(|face| face.neighbour.is_some());
        inner.sort_by_key(|face| (face.owner, face.neighbour));
        let mut parts = PolyParts { points, sites: Some(sites), ..PolyParts::default() };
        for face in inner {
            add(&mut parts, &face);
            parts.neighbours.extend(face.neighbour);
        }
        let mut on_sides: [Vec<Shared>; 6] = Default::default();
        for face in outer {
            let side = side_of(face.corners);
            let border = CellReadError::Border { cell: face.owner as usize };
            on_sides[side.ok_or(border)?].push(face);
        }
        for (count, faces) in parts.side_counts.iter_mut().zip(&on_sides) {
            *count = faces.len();
        }
        on_sides.iter().flatten().for_each(|face| add(&mut parts, face));
        Ok(parts)
    }

    /// The faces, each once, in the order of their owners.
    fn shared(&self) -> Result<Vec<Shared<'_>>, CellReadError> {
        let mut faces: Vec<Shared> = Vec::new();
        let mut known: HashMap<Vec<u32>, usize> = HashMap::new();
        for cell in 0..self.cell_count() {
            for corners in self.cell(cell) {
                let mut key = corners.to_vec();
                key.sort_unstable();
                let at = *known.entry(key).or_insert(faces.len());
                match faces.get_mut(at) {
                    None => faces.push(Shared { corners, owner: cell as u32, neighbour: None }),
                    Some(face) if face.neighbour.is_none() && face.owner as usize != cell => {
                        face.neighbour = Some(cell as u32);
                    }
                    Some(_) => return Err(CellReadError::Crowded { cell }),
                }
            }
        }
        Ok(faces)
    }
}

/// A face between two cells, or one and the border.
struct Shared<'a> {
    corners: &'a [u32],
    owner: u32,
    neighbour: Option<u32>,
}

fn add<const D: usize>(parts: &mut PolyParts<D>, face: &Shared) {
    parts.corners.extend_from_slice(face.corners);
    parts.ends.push(parts.corners.len());
    parts.owners.push(face.owner);
}

fn not_growing(cell: usize, end: u32) -> MeshReadError {
    malformed(0, format!("growing offsets at cell {cell}"), end.to_string())
}
