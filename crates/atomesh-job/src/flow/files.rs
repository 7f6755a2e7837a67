//! The files that are written with an answer, in formats that are known before the work.

use std::path::PathBuf;

use atomesh_io::mesh::FluxFiles;
use atomesh_io::output_group::OutputGroup;

use super::options::FlowOutputOptions;
use crate::error::JobError;
use crate::files::{self, PictureFile, check_extension, check_voronoi};
use crate::options::InputOptions;
use crate::session::Session;

/// Where everything goes.
pub(super) struct FlowFiles {
    pub output: Option<PathBuf>,
    pub pressure: Option<PathBuf>,
    pub streamlines: Option<PathBuf>,
    pub streamline_count: usize,
    pub fluxes: Option<FluxFiles>,
    pub report: Option<PathBuf>,
    pub picture: Option<PictureFile>,
    pub shows_pressure: bool,
    pub shows_streamlines: bool,
}

impl FlowFiles {
    /// The files of a run.
    ///
    /// # Errors
    /// [`JobError`] if an extension is unknown.
    pub fn new(options: &FlowOutputOptions) -> Result<Self, JobError> {
        check_extension(options.pressure_output.as_ref(), "vtu")?;
        check_extension(options.streamlines.as_ref(), "vtp")?;
        check_extension(options.fluxes.as_ref(), "json")?;
        if let Some(path) = &options.fluxes {
            files::refuse_standard_output(path, "a table of fluxes is two")?;
            files::check_head(path)?;
        }
        if let Some(path) = &options.output {
            files::check_holds_values(path)?;
        }
        Ok(Self {
            output: options.output.clone(),
            pressure: options.pressure_output.clone(),
            streamlines: options.streamlines.clone(),
            streamline_count: options.streamline_count,
            fluxes: options.fluxes.as_deref().map(FluxFiles::of),
            report: options.report.clone(),
            picture: PictureFile::of(options.picture.as_ref())?,
            shows_pressure: options.picture_of == "pressure",
            shows_streamlines: options.picture_streamlines,
        })
    }

    /// The same files, written to where the group says.
    ///
    /// # Errors
    /// [`JobError`] names the file that cannot be written.
    pub fn staged(&self, group: &mut OutputGroup) -> Result<Self, JobError> {
        let fluxes = match &self.fluxes {
            Some(FluxFiles { head, facets }) => Some(FluxFiles {
                head: files::stage(head, group)?,
                facets: files::stage(facets, group)?,
            }),
            None => None,
        };
        Ok(Self {
            output: files::stage_any(&self.output, group)?,
            pressure: files::stage_any(&self.pressure, group)?,
            streamlines: files::stage_any(&self.streamlines, group)?,
            report: files::stage_any(&self.report, group)?,
            picture: self.picture.as_ref().map(|p| p.staged(group)).transpose()?,
            fluxes,
            ..*self
        })
    }

    /// Tries whether every file can be written, and would not take the place of another or of an input.
    ///
    /// # Errors
    /// [`JobError`] names the first that does not.
    pub fn check(&self, input: &InputOptions, session: &mut Session<'_>) -> Result<(), JobError> {
        let picture = self.picture.as_ref().map(|picture| &picture.path);
        let (output, report) = (self.output.as_ref(), self.report.as_ref());
        let all = [output, self.pressure.as_ref(), self.streamlines.as_ref(), report, picture];
        let all = all.into_iter().flatten().map(PathBuf::as_path);
        let tables = self.fluxes.iter().flat_map(FluxFiles::paths);
        files::check_apart(input.paths(), all.chain(tables), session)
    }

    /// Refuses what Voronoi cells, with one pressure each, have no use for.
    ///
    /// # Errors
    /// [`JobError`] names the first file.
    pub fn check_for_voronoi(&self) -> Result<(), JobError> {
        if let Some(path) = &self.pressure {
            let message = "Voronoi cells have one pressure each; expected -o, which holds it";
            return Err(JobError::misuse(message).about(path));
        }
        self.output.as_deref().map_or(Ok(()), check_voronoi)
    }
}
