//! What goes into a mesh file and what comes out of one.

use atomesh::image::Frame;
use atomesh::mesh::{Mesh, Quadratic, Tags};

use super::cell_fields::{CellFields, VectorField};

/// Names that some format gives to other arrays.
const RESERVED: [&str; 4] = ["points", "cells", "metadata", super::metadata::NAME];

/// What is wrong with the parts of a [`MeshData`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshDataError {
    /// A field has not one value for each point or cell.
    #[error("field {name:?} has {found} values for {expected} points or cells")]
    FieldLength {
        /// The field's name.
        name: String,
        /// The number of points or cells.
        expected: usize,
        /// The number of values.
        found: usize,
    },
    /// A name that not every format can hold.
    #[error(
        "field name {name:?}; expected 1 to 64 letters, digits, '_' or '-', other than those of other fields and {RESERVED:?}"
    )]
    FieldName {
        /// The name found.
        name: String,
    },
}

/// Where a mesh comes from: what is needed to make it again, and nothing that differs between two
/// runs of the same input, options and seed (no threads, paths or times).
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// The version of atomesh.
    pub version: String,
    /// The options of the run.
    pub options: serde_json::Value,
    /// The seed of the run's random numbers.
    pub seed: u64,
}

/// The numbers of a field, in the precision in which files keep them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Values<'a> {
    /// Single precision: enough for what was measured.
    Single(&'a [f32]),
    /// Double precision: for sums, and for labels above 2²⁴.
    Double(&'a [f64]),
}

impl Values<'_> {
    /// How many numbers there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Single(values) => values.len(),
            Self::Double(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number `i`.
    ///
    /// # Panics
    /// If there is none.
    pub fn get(&self, i: usize) -> f64 {
        match self {
            Self::Single(values) => values[i].into(),
            Self::Double(values) => values[i],
        }
    }
}

macro_rules! values {
    ($($kind:ident of $number:ty),*) => {$(
        impl<'a> From<&'a [$number]> for Values<'a> {
            fn from(values: &'a [$number]) -> Self {
                Self::$kind(values)
            }
        }

        impl<'a> From<&'a Vec<$number>> for Values<'a> {
            fn from(values: &'a Vec<$number>) -> Self {
                Self::$kind(values)
            }
        }
    )*};
}
values!(Single of f32, Double of f64);

/// A named value for each point, or each cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field<'a> {
    name: &'a str,
    values: Values<'a>,
}

impl<'a> Field<'a> {
    /// A field whose name and number of values were checked.
    pub(super) fn new(name: &'a str, values: Values<'a>) -> Self {
        Self { name, values }
    }

    /// The name, fit for every format.
    pub fn name(&self) -> &'a str {
        self.name
    }

    /// The values, one for each point or cell.
    pub fn values(&self) -> Values<'a> {
        self.values
    }
}

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
        check_field(others, name, [values.len(), self.nodes().len()])?;
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

    /// The same with a vector in each cell. VTU alone holds vectors; other formats leave them out.
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

    /// The provenance, if it is known.
    pub fn provenance(&self) -> Option<&'a Provenance> {
        self.provenance
    }
}

/// Checks that a field's name fits and is new among `others`, and that it has as many values as it should:
/// found and expected.
pub(super) fn check_field<'n>(
    mut others: impl Iterator<Item = &'n str>,
    name: &str,
    [found, expected]: [usize; 2],
) -> Result<(), MeshDataError> {
    let plain = |c: u8| c.is_ascii_alphanumeric() || b"_-".contains(&c);
    let fits = (1..=64).contains(&name.len()) && name.bytes().all(plain);
    if !fits || RESERVED.contains(&name) || others.any(|other| other == name) {
        return Err(MeshDataError::FieldName { name: name.into() });
    }
    if found != expected {
        return Err(MeshDataError::FieldLength { name: name.into(), expected, found });
    }
    Ok(())
}

/// A named value for each point, or each cell, as read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnedField<T = f32> {
    /// The name in the file.
    pub name: String,
    /// One value for each point or cell.
    pub values: Vec<T>,
}

/// A mesh as read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedMesh<const D: usize> {
    /// The mesh, in world coordinates, with cells in the file's order and orientation.
    pub mesh: Mesh<D>,
    /// The scalar fields at the points, in the file's order; other fields are left out.
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
    /// Cells that a triangle or tetrahedral mesh has no room for (points, lines, surface triangles
    /// of a volume mesh, quadrilaterals ...) and that were left out: how many.
    pub skipped_cells: usize,
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
