//! Writing features: as surfaces, as tags of the mesh, in numbers.

use std::path::Path;

use atomesh::features::FeatureSet;
use atomesh::mesh::{Tags, is_feature_name};
use atomesh::run::Tools;
use atomesh_io::mesh::{LoadedMesh, MeshData, MeshFormat};
use atomesh_io::output_group::OutputGroup;
use atomesh_io::surface::{SurfaceExtras, SurfaceFormat};
use serde_json::json;

use super::FeaturesRequest;
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::files::{self, surface_format, write_bytes};
use crate::mesh_file;
use crate::session::{Note, NoteKind, Session};
use crate::surfaces::world_axes;

/// Features of a mesh, to be written.
struct Found<'a, const D: usize> {
    loaded: &'a LoadedMesh<D>,
    found: &'a FeatureSet<D>,
    dimension: &'a Dimension<D>,
}

/// The files to write, in formats that are known.
pub(super) struct FeatureFiles<'a> {
    pub(super) request: &'a FeaturesRequest,
    pub(super) surface: Option<(&'a Path, SurfaceFormat)>,
}

impl<'a> FeatureFiles<'a> {
    /// The files that a request names, found writable.
    ///
    /// # Errors
    /// [`JobError`] if there are none, an extension is unknown, or a file cannot be written.
    pub fn new(request: &'a FeaturesRequest, session: &mut Session<'_>) -> Result<Self, JobError> {
        let outputs = [&request.output, &request.mesh_output, &request.json];
        if outputs.iter().all(|path| path.is_none()) {
            let message =
                "nothing to write; expected -o SURFACE, --mesh-output MESH or --json JSON";
            return Err(JobError::misuse(message));
        }
        let surface = match request.output.as_deref() {
            Some(path) => Some((path, surface_format(path)?)),
            None => None,
        };
        if let Some(path) = &request.mesh_output
            && !MeshFormat::of(path).is_ok_and(MeshFormat::holds_tags)
        {
            let known = MeshFormat::tag_endings();
            let message = format!(
                "unknown extension of a mesh file that holds tags; expected one of {known}"
            );
            return Err(JobError::misuse(message).about(path));
        }
        let inputs = [Some(request.mesh.as_path()), request.source()];
        let outputs = outputs.into_iter().flatten().map(|path| path.as_path());
        files::check_apart(inputs.into_iter().flatten(), outputs, session)?;
        Ok(Self { request, surface })
    }

    /// Refuses surfaces in a format for meshes of another dimension.
    ///
    /// # Errors
    /// [`JobError`] says which formats there are.
    pub fn check_dimension(&self, dimension: usize) -> Result<(), JobError> {
        let Some((path, format)) = self.surface else { return Ok(()) };
        format.check_dimension(dimension).map_err(|e| JobError::misuse(e).about(path))
    }

    /// Writes the files.
    ///
    /// # Errors
    /// [`JobError`] names the file that cannot be written.
    pub fn write<const D: usize>(
        &self,
        loaded: &LoadedMesh<D>,
        found: &FeatureSet<D>,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        session.write_together(|group, session| {
            self.write_staged(Found { loaded, found, dimension }, group, session)
        })
    }

    fn write_staged<const D: usize>(
        &self,
        Found { loaded, found, dimension }: Found<'_, D>,
        group: &mut OutputGroup,
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let mesh = &loaded.mesh;
        if let Some((path, _)) = self.surface {
            let path = &files::stage(path, group)?;
            let means: Vec<f32> = found.features.iter().map(|f| f.mean as f32).collect();
            let axes = world_axes(self.request.z_positive, loaded.provenance.as_ref());
            let values = means.iter().all(|mean| mean.is_finite()).then_some(&means[..]);
            let extras = SurfaceExtras { values, axes: Some(&axes) };
            let written = (dimension.files.surface)(path, mesh, &found.groups(), extras, session);
            written.map_err(|e| JobError::from(e).about(path))?;
        }
        if let (Some(path), Some(named)) =
            (&files::stage_any(&self.request.mesh_output, group)?, &self.request.mesh_output)
        {
            let tags = self.tags(loaded, found, dimension.tools)?;
            let format = MeshFormat::of(path).map_err(JobError::misuse)?;
            let (data, lost) = tagged(loaded, &tags, |_| false);
            note_lost(loaded, lost, named, session);
            let written = (dimension.files.mesh)(path, format, &data, session);
            written.map_err(|e| JobError::from(e).about(path))?;
        }
        if let Some(path) = &files::stage_any(&self.request.json, group)? {
            let report = json!({
                "selection": found.selection,
                "intersections": found.intersections.len(),
                "features": found.report(mesh),
                "notes": session.notes_json(),
            });
            write_bytes(path, format!("{report:#}\n").as_bytes())?;
        }
        Ok(())
    }

    /// The mesh's own tags without features that it had; the sides of its box if it has none; the features.
    fn tags<const D: usize>(
        &self,
        loaded: &LoadedMesh<D>,
        found: &FeatureSet<D>,
        tools: &Tools<D>,
    ) -> Result<Tags<D>, JobError> {
        let mesh = &loaded.mesh;
        let groups = loaded.tags.facet_groups();
        let kept: Vec<_> =
            groups.iter().filter(|group| !is_feature_name(&group.name)).cloned().collect();
        let has_groups = !kept.is_empty();
        let regions = match self.request.regions {
            true => Some(found.regions(mesh, self.request.least_island)),
            false => loaded.tags.regions().cloned(),
        };
        let mut tags = Tags::new(mesh, kept, regions).map_err(JobError::content)?;
        if !has_groups {
            let sides = mesh_file::own_sides(mesh, loaded.frame.as_ref(), tools);
            tags = sides.merge(tags).map_err(JobError::content)?;
        }
        tags.merge(found.tags(mesh).map_err(JobError::content)?).map_err(JobError::content)
    }
}

/// Notes the fields of a mesh that its new file does not have: those lost, or all where the format has no place.
pub(crate) fn note_lost<const D: usize>(
    loaded: &LoadedMesh<D>,
    mut lost: Vec<String>,
    path: &Path,
    session: &mut Session<'_>,
) {
    let at_points = loaded.point_fields.iter().map(|field| &field.name);
    let mut all = at_points.chain(loaded.cell_fields.iter().map(|field| &field.name)).peekable();
    let format = MeshFormat::of(path);
    if all.peek().is_some() && !format.is_ok_and(MeshFormat::holds_values) {
        let names = all.cloned().collect::<Vec<_>>().join(", ");
        lost = vec![format!("the format has no place for the fields {names}")];
    }
    for text in lost {
        session.note(Note { kind: NoteKind::Change, file: Some(path.into()), text });
    }
}

/// The mesh with new tags and all else that it had but some values of its cells; and which fields it lost, since a name that another program gave may
/// not fit every format.
pub(crate) fn tagged<'a, const D: usize>(
    loaded: &'a LoadedMesh<D>,
    tags: &'a Tags<D>,
    is_left_out: impl Fn(&str) -> bool,
) -> (MeshData<'a, D>, Vec<String>) {
    let mut data = MeshData::new(&loaded.mesh).with_tags(tags);
    let mut lost = Vec::new();
    for field in &loaded.point_fields {
        match data.clone().with_point_field(&field.name, &field.values) {
            Ok(with) => data = with,
            Err(e) => lost.push(format!("left out: {e}")),
        }
    }
    for field in loaded.cell_fields.iter().filter(|field| !is_left_out(&field.name)) {
        match data.clone().with_cell_field(&field.name, &field.values) {
            Ok(with) => data = with,
            Err(e) => lost.push(format!("left out: {e}")),
        }
    }
    if let Some(frame) = &loaded.frame {
        data = data.with_frame(frame);
    }
    if let Some(provenance) = &loaded.provenance {
        data = data.with_provenance(provenance);
    }
    (data, lost)
}
