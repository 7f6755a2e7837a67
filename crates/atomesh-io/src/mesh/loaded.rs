//! What comes out of a mesh file.

use atomesh::image::Frame;
use atomesh::mesh::{Mesh, Tags};

use super::field::OwnedField;
use super::provenance::Provenance;

/// A mesh as read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedMesh<const D: usize> {
    /// The mesh, in world coordinates, with cells in the file's order and orientation.
    pub mesh: Mesh<D>,
    /// The scalar fields at the points, in the file's order.
    pub point_fields: Vec<OwnedField>,
    /// The groups of facets and cells, as far as the format holds them and they are the mesh's.
    pub tags: Tags<D>,
    /// The scalar fields in the cells, in the file's order, for the cells that are kept; in double precision,
    /// since labels and sums need it.
    pub cell_fields: Vec<OwnedField<f64>>,
    /// The frame of the image that the mesh follows, if atomesh wrote the file.
    pub frame: Option<Frame<D>>,
    /// The provenance, if atomesh wrote the file.
    pub provenance: Option<Provenance>,
    /// The number of cells left out: points, lines, surface triangles of a volume mesh, quadrilaterals ...
    pub skipped_cells: usize,
    /// The names of fields left out: vectors and tensors, values that are no numbers or not one for each point or cell.
    pub skipped_fields: Vec<String>,
}

impl<const D: usize> LoadedMesh<D> {
    /// The values of the field of that name.
    pub fn point_field(&self, name: &str) -> Option<&[f32]> {
        self.point_fields.iter().find(|f| f.name == name).map(|f| f.values.as_slice())
    }

    /// The values in the cells of the field of that name.
    pub fn cell_field(&self, name: &str) -> Option<&[f64]> {
        self.cell_fields.iter().find(|f| f.name == name).map(|f| f.values.as_slice())
    }
}

/// A mesh whose dimension the file decides.
#[derive(Clone, Debug, PartialEq)]
pub enum AnyMesh {
    /// Triangles in a plane of constant z.
    Flat(LoadedMesh<2>),
    /// Tetrahedra.
    Volume(LoadedMesh<3>),
}
