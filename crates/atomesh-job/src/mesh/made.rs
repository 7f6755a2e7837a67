//! A mesh that a run has made, and what is done with it: looked at as if it had been read, and written.

use atomesh::image::Image;
use atomesh::mesh::Regions;
use atomesh::run::Outcome;
use atomesh_io::mesh::cells::LoadedCells;
use atomesh_io::mesh::{LoadedMesh, OwnedField, World};

use super::MeshSummary;
use super::figures::{Figures, Measured, RunPage};
use super::movie::Recording;
use super::outputs::Outputs;
use super::write::{Writing, cells_of_wells};
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::files::write_bytes;
use crate::options::RunConfig;
use crate::sample::Property;
use crate::session::Session;

/// What outputs need beside the mesh.
pub(super) struct Wanted<'a, const D: usize> {
    /// The atoms of the run.
    pub recording: Option<&'a Recording<D>>,
    /// Whether the shape is measured though no report asks for it.
    pub measures_shape: bool,
}

impl<const D: usize> Default for Wanted<'_, D> {
    fn default() -> Self {
        Self { recording: None, measures_shape: false }
    }
}

/// A mesh that a run has made, and what it was made from.
#[derive(Clone, Copy, Debug)]
pub struct MadeMesh<'a, const D: usize> {
    /// The run's options; those of the output name the files that [`MadeMesh::write`] writes.
    pub run: &'a RunConfig,
    /// What the run gave.
    pub outcome: &'a Outcome<D>,
    /// The image, which pictures and reports need.
    pub image: Option<&'a Image<D>>,
    /// What is known of the world, as [`crate::mesh::MeshImages::world`].
    pub world: &'a World,
    /// Properties of the cells, written with them.
    pub properties: &'a [Property],
    /// The regions of the triangles or tetrahedra, in place of those that labels of the image give.
    pub regions: Option<&'a Regions>,
}

impl<const D: usize> MadeMesh<'_, D> {
    /// The triangles or tetrahedra as reading the file that [`MadeMesh::write`] writes would give them, in single
    /// precision where files have it.
    ///
    /// # Errors
    /// [`JobError`] if there are too many groups of facets to number.
    pub fn loaded(&self) -> Result<LoadedMesh<D>, JobError> {
        let outcome = self.outcome;
        let field = |name: &str, values: &[f32]| OwnedField {
            name: name.to_owned(),
            values: values.to_vec(),
        };
        Ok(LoadedMesh {
            mesh: outcome.world_mesh(),
            point_fields: vec![
                field("distance", outcome.distance_at_points()),
                field("potential", outcome.potential_at_points()),
            ],
            tags: outcome.tags().map_err(JobError::content)?,
            cell_fields: Vec::new(),
            frame: Some(*outcome.frame()),
            provenance: Some(self.run.provenance::<D>().in_world(self.world)),
            skipped_cells: 0,
            skipped_fields: Vec::new(),
        })
    }

    /// The Voronoi cells in the same way; `None` if none were asked for.
    pub fn loaded_cells(&self) -> Option<LoadedCells<D>> {
        let outcome = self.outcome;
        Some(LoadedCells {
            mesh: outcome.world_cells()?,
            features: outcome.cell_features().unwrap_or_default(),
            fields: Vec::new(),
            skipped_fields: Vec::new(),
            frame: *outcome.frame(),
            provenance: self.run.provenance::<D>().in_world(self.world),
            wells: cells_of_wells(outcome),
        })
    }

    /// Writes the mesh, and all else that the options of the output name.
    ///
    /// # Errors
    /// [`JobError`] if options contradict each other, a picture or report is asked for without an image, a file cannot
    /// be written, or the watch ends the work.
    pub fn write(
        &self,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<MeshSummary, JobError> {
        let outputs = Outputs::new(self.run, None)?;
        outputs.check(self.run, session)?;
        if outputs.needs_image() && self.image.is_none() {
            return Err(JobError::misuse("pictures and reports need the image; expected it too"));
        }
        if let Some(path) = &outputs.movie {
            let message = "a movie shows a run, and this one is over";
            let advice = "`atomesh mesh --movie` makes it with the mesh";
            return Err(JobError::misuse(message).advise(advice).about(path));
        }
        self.write_outputs(&outputs, Wanted::default(), dimension, session)
    }

    /// The report, with all that is measured against the image.
    ///
    /// # Errors
    /// [`JobError`] if the image is missing, the mesh cannot be measured, or the watch ends the work.
    pub fn report(
        &self,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<serde_json::Value, JobError> {
        let image = self.image.ok_or_else(|| JobError::misuse("a report needs the image"))?;
        let measured = Measured::All(image);
        let figures = Figures::new(self.run, self.outcome, measured, dimension.tools, session)?;
        session.end_phase();
        Ok(figures.json(self.run, self.outcome, session))
    }

    /// Measures as far as is asked for, and writes the outputs together.
    pub(super) fn write_outputs(
        &self,
        outputs: &Outputs,
        wanted: Wanted<'_, D>,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<MeshSummary, JobError> {
        let Self { run, outcome, image, world, properties, regions } = *self;
        let measured = match image {
            Some(image) if outputs.needs_report() => Measured::All(image),
            _ if wanted.measures_shape => Measured::Shape,
            _ => Measured::Nothing,
        };
        let figures = Figures::new(run, outcome, measured, dimension.tools, session)?;
        let tagged = session.write_together(|group, session| {
            let outputs = &outputs.staged(group)?;
            let recording = wanted.recording;
            let writing =
                Writing { run, outputs, outcome, world, properties, regions, recording, dimension };
            let tagged = writing.write(image, session)?;
            self.write_about(&writing, &figures, session)?;
            Ok(tagged)
        })?;
        let cells = if run.is_voronoi() { dimension.voronoi_cells } else { dimension.cells };
        let (mesh, improved) = (outputs.mesh.clone(), outcome.improve_report().cloned());
        Ok(MeshSummary { mesh, cells, figures, improved, tagged })
    }

    /// Writes the options and reports.
    fn write_about(
        &self,
        writing: &Writing<'_, D>,
        figures: &Figures,
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let Writing { run, outputs, outcome, dimension, .. } = *writing;
        if let Some(path) = &outputs.config {
            write_bytes(path, run.clone().with_defaults::<D>().to_toml()?.as_bytes())?;
        }
        session.end_phase();
        if let Some(path) = &outputs.report {
            let text = format!("{:#}\n", figures.json(run, outcome, session));
            write_bytes(path, text.as_bytes())?;
        }
        if let (Some(path), Some(image), Some(report)) =
            (&outputs.html, self.image, &figures.report)
        {
            let page = RunPage { run, outcome, image, report, style: writing.style() };
            page.write(path, &outputs.mesh, dimension, session)?;
        }
        Ok(())
    }
}
