//! What can be sampled in: triangles and tetrahedra, and Voronoi cells.

use std::path::Path;

use atomesh::image::{Frame, Image};
use atomesh::run::Tools;
use atomesh::sample::{CellProperties, SampleError, SampleOptions};
use atomesh::watch::Watch;
use atomesh_io::mesh::cells::LoadedCells;
use atomesh_io::mesh::{
    CellFields, LoadedMesh, MeshData, MeshDataError, MeshFormat, OwnedField, Provenance,
};

use super::Property;
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::files::check_voronoi;
use crate::session::Session;

/// A mesh as read, whose cells get properties and go into another file.
pub trait SampledMesh<const D: usize> {
    /// The number of cells.
    fn cell_count(&self) -> usize;

    /// The frame of the image that the mesh follows, if it is known.
    fn frame(&self) -> Option<&Frame<D>>;

    /// What the file says of its making, if it does.
    fn provenance(&self) -> Option<&Provenance>;

    /// The fields that the cells have; they have none then.
    fn take_fields(&mut self) -> Vec<OwnedField<f64>>;

    /// Samples an image.
    ///
    /// # Errors
    /// [`SampleError`], also when cancelled.
    fn sample(
        &self,
        image: &Image<D>,
        options: SampleOptions<'_>,
        tools: &Tools<D>,
        watch: &mut dyn Watch,
    ) -> Result<CellProperties, SampleError>;

    /// Refuses a file to write whose format does not hold such a mesh.
    ///
    /// # Errors
    /// [`JobError`] says which one does.
    fn check_output(&self, path: &Path) -> Result<(), JobError>;

    /// Writes the mesh with properties of its cells.
    ///
    /// # Errors
    /// [`JobError`] if the file cannot be written, or a name does not fit it.
    fn write(
        &self,
        path: &Path,
        properties: &[Property],
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<(), JobError>;
}

impl<const D: usize> SampledMesh<D> for LoadedMesh<D> {
    fn cell_count(&self) -> usize {
        self.mesh.cell_count()
    }

    fn frame(&self) -> Option<&Frame<D>> {
        self.frame.as_ref()
    }

    fn provenance(&self) -> Option<&Provenance> {
        self.provenance.as_ref()
    }

    fn take_fields(&mut self) -> Vec<OwnedField<f64>> {
        std::mem::take(&mut self.cell_fields)
    }

    fn sample(
        &self,
        image: &Image<D>,
        options: SampleOptions<'_>,
        tools: &Tools<D>,
        watch: &mut dyn Watch,
    ) -> Result<CellProperties, SampleError> {
        (tools.sample)(&self.mesh, image, options, watch)
    }

    fn check_output(&self, _: &Path) -> Result<(), JobError> {
        Ok(())
    }

    fn write(
        &self,
        path: &Path,
        properties: &[Property],
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let mut data = MeshData::new(&self.mesh).with_tags(&self.tags);
        for field in &self.point_fields {
            data = data.with_point_field(&field.name, &field.values).map_err(JobError::content)?;
        }
        for field in properties {
            data = data.with_cell_field(&field.name, field.values()).map_err(JobError::content)?;
        }
        if let Some(frame) = &self.frame {
            data = data.with_frame(frame);
        }
        if let Some(provenance) = &self.provenance {
            data = data.with_provenance(provenance);
        }
        let format = MeshFormat::of(path).map_err(JobError::misuse)?;
        let written = (dimension.files.mesh)(path, format, &data, session);
        written.map_err(|e| JobError::from(e).about(path))
    }
}

impl<const D: usize> SampledMesh<D> for LoadedCells<D> {
    fn cell_count(&self) -> usize {
        self.mesh.cell_count()
    }

    fn frame(&self) -> Option<&Frame<D>> {
        Some(&self.frame)
    }

    fn provenance(&self) -> Option<&Provenance> {
        Some(&self.provenance)
    }

    fn take_fields(&mut self) -> Vec<OwnedField<f64>> {
        std::mem::take(&mut self.fields)
    }

    fn sample(
        &self,
        image: &Image<D>,
        options: SampleOptions<'_>,
        tools: &Tools<D>,
        watch: &mut dyn Watch,
    ) -> Result<CellProperties, SampleError> {
        (tools.sample_cells)(&self.mesh, image, options, watch)
    }

    fn check_output(&self, path: &Path) -> Result<(), JobError> {
        check_voronoi(path)
    }

    fn write(
        &self,
        path: &Path,
        properties: &[Property],
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let data = self.data();
        let fields = cell_fields(self.mesh.cell_count(), properties).map_err(JobError::content)?;
        let written = (dimension.files.cells_with)(path, &data, &fields, session);
        written.map_err(|e| JobError::from(e).about(path))
    }
}

/// The properties of a mesh of `cell_count` cells, as its file takes them.
///
/// # Errors
/// [`MeshDataError`] if values are not one a cell, or a name does not fit the format.
pub(crate) fn cell_fields<const D: usize>(
    cell_count: usize,
    properties: &[Property],
) -> Result<CellFields<'_, D>, MeshDataError> {
    let none = CellFields::new(cell_count);
    properties
        .iter()
        .try_fold(none, |fields, field| fields.with_numbers(&field.name, field.values()))
}
