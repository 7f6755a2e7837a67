//! What goes into a mesh file.

use atomesh::image::Frame;
use atomesh::mesh::{Mesh, Quadratic, Tags};

use super::cell_fields::{CellFields, VectorField};
use super::field::{Field, MeshDataError, Values, check_field};
use super::inp::Sections;
use super::metadata::{self, KnownAs};
use super::provenance::Provenance;
use super::standing::Standing;

/// A mesh in world coordinates, with what is known at its points and cells; borrowed, since meshes
/// are large.
#[derive(Clone, Debug)]
pub struct MeshData<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    point_fields: Vec<Field<'a>>,
    cell_fields: CellFields<'a, D>,
    frame: Option<&'a Frame<D>>,
    provenance: Option<&'a Provenance>,
    tags: Option<&'a Tags<D>>,
    quadratic: Option<&'a Quadratic<D>>,
    sections: Option<&'a Sections>,
}

impl<'a, const D: usize> MeshData<'a, D> {
    /// A mesh alone. Its cells should be positive: they are written as they are.
    pub fn new(mesh: &'a Mesh<D>) -> Self {
        Self {
            mesh,
            point_fields: vec![],
            cell_fields: CellFields::new(mesh.cell_count()),
            frame: None,
            provenance: None,
            tags: None,
            quadratic: None,
            sections: None,
        }
    }

    /// The same with cells of second order, made from this mesh: what is written has their nodes as points,
    /// corners first, and fields at points need a value at each node (see [`Quadratic::extend`]).
    pub fn with_quadratic(mut self, quadratic: &'a Quadratic<D>) -> Self {
        self.quadratic = Some(quadratic);
        self
    }

    /// The cells of second order, if there are any.
    pub fn quadratic(&self) -> Option<&'a Quadratic<D>> {
        self.quadratic
    }

    /// The points that are written: the mesh's, or the nodes of cells of second order.
    pub fn nodes(&self) -> &'a [[f64; D]] {
        self.quadratic.map_or(self.mesh.points(), Quadratic::nodes)
    }

    /// The points of all cells that are written, [`nodes_per_cell`](Self::nodes_per_cell) a cell.
    pub fn cell_nodes(&self) -> &'a [u32] {
        self.quadratic.map_or(self.mesh.corners(), Quadratic::cells)
    }

    /// The points of a cell that is written.
    pub fn nodes_per_cell(&self) -> usize {
        if self.quadratic.is_some() { Quadratic::<D>::NODES } else { Mesh::<D>::CORNERS }
    }

    /// The points of a facet that is written: its corners, then the middles of its edges, if there are any.
    pub fn facet_nodes(&self, facet: &[u32; D]) -> Vec<u32> {
        self.quadratic.map_or_else(|| facet.to_vec(), |quadratic| quadratic.facet(facet))
    }

    /// The same with a value at each point. The pipeline calls d `distance` and b `potential`.
    ///
    /// # Errors
    /// [`MeshDataError`] if the values are not one a point, or the name does not fit every format.
    pub fn with_point_field(
        mut self,
        name: &'a str,
        values: &'a [f32],
    ) -> Result<Self, MeshDataError> {
        let others = self.point_fields.iter().map(Field::name);
        check_field(others, name, values.len(), self.nodes().len())?;
        self.point_fields.push(Field::new(name, values.into()));
        Ok(self)
    }

    /// The same with a value in each cell.
    ///
    /// # Errors
    /// [`MeshDataError`] if the values are not one a cell, or the name does not fit every format.
    pub fn with_cell_field(
        mut self,
        name: &'a str,
        values: impl Into<Values<'a>>,
    ) -> Result<Self, MeshDataError> {
        self.cell_fields = self.cell_fields.with_numbers(name, values)?;
        Ok(self)
    }

    /// The same with a vector in each cell.
    ///
    /// # Errors
    /// As [`Self::with_cell_field`].
    pub fn with_cell_vectors(
        mut self,
        name: &'a str,
        vectors: &'a [[f64; D]],
    ) -> Result<Self, MeshDataError> {
        self.cell_fields = self.cell_fields.with_vectors(name, vectors)?;
        Ok(self)
    }

    /// The same with the frame of the image that the mesh follows.
    pub fn with_frame(mut self, frame: &'a Frame<D>) -> Self {
        self.frame = Some(frame);
        self
    }

    /// The same with its provenance.
    pub fn with_provenance(mut self, provenance: &'a Provenance) -> Self {
        self.provenance = Some(provenance);
        self
    }

    /// The same with groups of facets and cells, which must be those of this mesh: ones of another are
    /// written as they are. Formats that cannot hold them leave them out.
    pub fn with_tags(mut self, tags: &'a Tags<D>) -> Self {
        self.tags = Some(tags);
        self
    }

    /// The same with sections; formats other than Abaqus' leave them out.
    pub fn with_sections(mut self, sections: &'a Sections) -> Self {
        self.sections = Some(sections);
        self
    }

    /// The sections, if there are any.
    pub fn sections(&self) -> Option<&'a Sections> {
        self.sections
    }

    /// The mesh, in world coordinates.
    pub fn mesh(&self) -> &'a Mesh<D> {
        self.mesh
    }

    /// The values at the points.
    pub fn point_fields(&self) -> &[Field<'a>] {
        &self.point_fields
    }

    /// The values in the cells.
    pub fn cell_fields(&self) -> &[Field<'a>] {
        self.cell_fields.numbers()
    }

    /// The vectors in the cells.
    pub fn cell_vectors(&self) -> &[VectorField<'a, D>] {
        self.cell_fields.vectors()
    }

    /// The frame of the image, if it is known.
    pub fn frame(&self) -> Option<&'a Frame<D>> {
        self.frame
    }

    /// The groups of facets and cells, if there are any.
    pub fn tags(&self) -> Option<&'a Tags<D>> {
        self.tags
    }

    /// Where a flat mesh stands in space, if it is known.
    pub(super) fn standing(&self) -> Option<&'a Standing> {
        self.provenance?.standing.as_ref().filter(|_| D == 2)
    }

    /// The provenance, if it is known.
    pub fn provenance(&self) -> Option<&'a Provenance> {
        self.provenance
    }

    /// Frame and provenance as JSON, the text that all mesh files carry; the same for the same data.
    pub(super) fn metadata(&self) -> String {
        self.metadata_with_numbers(&KnownAs::default())
    }

    /// The same with the numbers by which a format knows regions and groups whose own it cannot hold.
    pub(super) fn metadata_with_numbers(&self, known_as: &KnownAs) -> String {
        let points = self.tags.map_or(&[][..], Tags::point_groups);
        metadata::encode_with_tags(self.frame, self.provenance, points, known_as)
    }

    /// The number of the group that each point that is written is in, 0 for none; empty if there are no groups.
    pub(super) fn group_of_points(&self) -> Vec<u32> {
        self.tags.map_or_else(Vec::new, |tags| tags.group_of_points(self.nodes().len()))
    }
}
