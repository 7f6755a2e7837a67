//! polyMesh, OpenFOAM's format: a folder of text files with the faces of cells of any shape.
//!
//! [`FoamMesh`] is the general form, points, faces as loops of them, and the cells that own the faces;
//! [`FoamMesh::of_mesh`] makes it of triangles or tetrahedra with their tags. OpenFOAM knows space alone:
//! flat cells become one layer of prisms, whose ends are the patch `frontAndBack` of type `empty`.

mod read;
mod simplices;
mod validate;
mod write;

pub use super::error::FoamMeshError;
pub use read::read_foam_mesh;
pub use write::{check_foam_mesh_writable, write_foam_mesh};

/// The names of the files in the folder, in the order in which they are written.
const FILES: [&str; 8] =
    ["points", "faces", "owner", "neighbour", "boundary", "pointZones", "faceZones", "cellZones"];

/// The patch of the ends of prisms that stand for flat cells.
pub const FRONT_AND_BACK: &str = "frontAndBack";

/// What lies beyond a face, as its owner sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beyond {
    /// Another cell.
    Cell(u32),
    /// The outside; the face belongs to the patch of that index.
    Patch(u32),
}

/// A part of the boundary.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Patch {
    /// Its name, an OpenFOAM word.
    pub name: String,
    /// Whether it bounds the single layer of a flat mesh: type `empty`, else `patch`.
    pub is_empty: bool,
}

impl Patch {
    /// A patch of type `patch`.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), is_empty: false }
    }
}

/// A named set of faces, each once, such as a fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaceZone {
    /// Its name.
    pub name: String,
    /// The faces by index, and whether the zone's normal is opposite to the face's.
    pub faces: Vec<(u32, bool)>,
}

/// A named set of cells, such as a region.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CellZone {
    /// Its name.
    pub name: String,
    /// The cells by index.
    pub cells: Vec<u32>,
}

/// A named set of points, such as a well.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PointZone {
    /// Its name.
    pub name: String,
    /// The points by index.
    pub points: Vec<u32>,
}

/// Cells of any shape, given by their faces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FoamMesh {
    points: Vec<[f64; 3]>,
    cell_count: usize,
    patches: Vec<Patch>,
    /// Where the corners of each face end.
    ends: Vec<u32>,
    corners: Vec<u32>,
    owners: Vec<u32>,
    beyond: Vec<Beyond>,
    point_zones: Vec<PointZone>,
    face_zones: Vec<FaceZone>,
    cell_zones: Vec<CellZone>,
    note: String,
}

impl FoamMesh {
    /// Points, and cells that have no faces yet.
    pub fn new(points: Vec<[f64; 3]>, cell_count: usize, patches: Vec<Patch>) -> Self {
        Self { points, cell_count, patches, ..Self::default() }
    }

    /// One layer of prisms, `thickness` high, over flat `cells`, each a loop of points counter-clockwise.
    /// An edge is two points with its owner to the left and what lies beyond it; its face has the index
    /// that the edge has. The patch [`FRONT_AND_BACK`] is put after `patches`.
    ///
    /// # Errors
    /// [`FoamMeshError`] if an edge or a cell names what is not there.
    pub fn extruded<'a>(
        points: &[[f64; 2]],
        cells: impl ExactSizeIterator<Item = &'a [u32]>,
        edges: &[([u32; 2], u32, Beyond)],
        mut patches: Vec<Patch>,
        thickness: f64,
    ) -> Result<Self, FoamMeshError> {
        let ends = Beyond::Patch(patches.len() as u32);
        patches.push(Patch { name: FRONT_AND_BACK.into(), is_empty: true });
        let up = points.len() as u32;
        let level = |z: f64| points.iter().map(move |&[x, y]| [x, y, z]);
        let mut mesh =
            Self::new(level(0.0).chain(level(thickness)).collect(), cells.len(), patches);
        for &([a, b], owner, beyond) in edges {
            if let Some(found) = [a, b].into_iter().find(|&corner| corner >= up) {
                let of = format!("edge {}", mesh.face_count());
                let count = points.len();
                return Err(FoamMeshError::Missing { of, what: "point", found, count });
            }
            mesh.push_face(&[a, b, b + up, a + up], owner, beyond)?;
        }
        let mut corners = Vec::new();
        for (cell, around) in cells.enumerate() {
            corners.clear();
            corners.extend(around.iter().rev());
            mesh.push_face(&corners, cell as u32, ends)?;
            corners.clear();
            corners.extend(around.iter().map(|corner| corner.saturating_add(up)));
            mesh.push_face(&corners, cell as u32, ends)?;
        }
        Ok(mesh)
    }

    /// Adds a face: a loop of points, counter-clockwise as seen from beyond, so that its normal points out
    /// of the owner. Faces may come in any order and be given by either cell; their index is the order in
    /// which they come.
    ///
    /// # Errors
    /// [`FoamMeshError`] if a number names nothing.
    pub fn push_face(
        &mut self,
        corners: &[u32],
        owner: u32,
        beyond: Beyond,
    ) -> Result<(), FoamMeshError> {
        let face = self.owners.len();
        if corners.len() < 3 {
            return Err(FoamMeshError::FewCorners { face, found: corners.len() });
        }
        let of = || format!("face {face}");
        let point = corners.iter().copied().max().unwrap_or(0);
        let other = match beyond {
            Beyond::Cell(cell) => (cell, self.cell_count, "cell"),
            Beyond::Patch(patch) => (patch, self.patches.len(), "patch"),
        };
        for (found, count, what) in
            [(point, self.points.len(), "point"), (owner, self.cell_count, "cell"), other]
        {
            if found as usize >= count {
                return Err(FoamMeshError::Missing { of: of(), what, found, count });
            }
        }
        if beyond == Beyond::Cell(owner) {
            return Err(FoamMeshError::OneCell { face, cell: owner });
        }
        self.corners.extend_from_slice(corners);
        self.ends.push(self.corners.len() as u32);
        self.owners.push(owner);
        self.beyond.push(beyond);
        Ok(())
    }

    /// Adds a named set of points.
    ///
    /// # Errors
    /// [`FoamMeshError::Missing`] if a point is not there.
    pub fn push_point_zone(&mut self, zone: PointZone) -> Result<(), FoamMeshError> {
        let count = self.points.len();
        if let Some(&found) = zone.points.iter().find(|&&point| point as usize >= count) {
            let of = format!("zone {:?}", zone.name);
            return Err(FoamMeshError::Missing { of, what: "point", found, count });
        }
        self.point_zones.push(zone);
        Ok(())
    }

    /// Adds a named set of faces. OpenFOAM lets a face be in one zone at most.
    ///
    /// # Errors
    /// [`FoamMeshError::Missing`] if a face is not there.
    pub fn push_face_zone(&mut self, zone: FaceZone) -> Result<(), FoamMeshError> {
        let count = self.owners.len();
        if let Some(&(found, _)) = zone.faces.iter().find(|(face, _)| *face as usize >= count) {
            let of = format!("zone {:?}", zone.name);
            return Err(FoamMeshError::Missing { of, what: "face", found, count });
        }
        self.face_zones.push(zone);
        Ok(())
    }

    /// Adds a named set of cells.
    ///
    /// # Errors
    /// [`FoamMeshError::Missing`] if a cell is not there.
    pub fn push_cell_zone(&mut self, zone: CellZone) -> Result<(), FoamMeshError> {
        let count = self.cell_count;
        if let Some(&found) = zone.cells.iter().find(|&&cell| cell as usize >= count) {
            let of = format!("zone {:?}", zone.name);
            return Err(FoamMeshError::Missing { of, what: "cell", found, count });
        }
        self.cell_zones.push(zone);
        Ok(())
    }

    /// The same with a line that goes into the file of points as a comment; line breaks become blanks.
    pub fn with_note(mut self, note: &str) -> Self {
        self.note = note.replace(['\n', '\r'], " ");
        self
    }

    /// The points.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// The number of cells.
    pub fn cell_count(&self) -> usize {
        self.cell_count
    }

    /// The number of faces.
    pub fn face_count(&self) -> usize {
        self.owners.len()
    }

    /// The corners, the owner and what is beyond it, of the face of that index.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn face(&self, index: usize) -> (&[u32], u32, Beyond) {
        let start = if index == 0 { 0 } else { self.ends[index - 1] as usize };
        let corners = &self.corners[start..self.ends[index] as usize];
        (corners, self.owners[index], self.beyond[index])
    }

    /// The parts of the boundary.
    pub fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// The named sets of points.
    pub fn point_zones(&self) -> &[PointZone] {
        &self.point_zones
    }

    /// The named sets of faces.
    pub fn face_zones(&self) -> &[FaceZone] {
        &self.face_zones
    }

    /// The named sets of cells.
    pub fn cell_zones(&self) -> &[CellZone] {
        &self.cell_zones
    }

    /// The line that the file of points carries as a comment.
    pub fn note(&self) -> &str {
        &self.note
    }

    /// The same with faces in OpenFOAM's order: those between cells first, by the lower cell, which owns
    /// them, and then the higher; then those of each patch.
    pub fn ordered(&self) -> Self {
        let key = |face: usize| match self.beyond[face] {
            Beyond::Cell(other) => {
                let owner = self.owners[face];
                (0, owner.min(other), owner.max(other), face)
            }
            Beyond::Patch(patch) => (1, patch, 0, face),
        };
        let mut order: Vec<_> = (0..self.face_count()).map(key).collect();
        order.sort_unstable();
        let mut place = vec![(0, false); order.len()];
        let mut sorted = Self {
            points: self.points.clone(),
            cell_count: self.cell_count,
            patches: self.patches.clone(),
            point_zones: self.point_zones.clone(),
            cell_zones: self.cell_zones.clone(),
            note: self.note.clone(),
            ..Self::default()
        };
        for (at, &(_, _, _, face)) in order.iter().enumerate() {
            let (corners, owner, beyond) = self.face(face);
            let start = sorted.corners.len();
            sorted.corners.extend_from_slice(corners);
            let (owner, beyond, turned) = match beyond {
                Beyond::Cell(other) if other < owner => (other, Beyond::Cell(owner), true),
                _ => (owner, beyond, false),
            };
            if turned {
                sorted.corners[start + 1..].reverse();
            }
            sorted.ends.push(sorted.corners.len() as u32);
            sorted.owners.push(owner);
            sorted.beyond.push(beyond);
            place[face] = (at as u32, turned);
        }
        sorted.face_zones = self.face_zones.clone();
        for (face, flipped) in sorted.face_zones.iter_mut().flat_map(|zone| &mut zone.faces) {
            let (at, turned) = place[*face as usize];
            (*face, *flipped) = (at, *flipped != turned);
        }
        sorted
    }
}
