//! The files that are written with a mesh, in formats that are known before the work.

use std::path::{Path, PathBuf};

use atomesh_io::mesh::cells::ConnectionFiles;
use atomesh_io::mesh::{Elastic, MeshFormat, Sections};
use atomesh_io::output_group::OutputGroup;

use super::format::{MshWish, OutputFormat};
use crate::error::JobError;
use crate::files::{self, PictureFile, has_extension, unknown_extension};
use crate::options::{Backdrop, OutputOptions, RunConfig, View};
use crate::session::Session;
use crate::values::{MaterialSpec, Text};

/// Where everything goes.
#[derive(Clone, Debug)]
pub(super) struct Outputs {
    pub mesh: PathBuf,
    pub format: OutputFormat,
    pub connections: Option<ConnectionFiles>,
    pub picture: Option<PictureFile>,
    pub backdrop: Backdrop,
    pub view: View,
    /// The movie of the run.
    pub movie: Option<PathBuf>,
    pub report: Option<PathBuf>,
    /// The report as a page.
    pub html: Option<PathBuf>,
    pub potential: Option<PathBuf>,
    /// The options of the run, written for another.
    pub config: Option<PathBuf>,
    /// Whether cells of second order are written.
    pub is_quadratic: bool,
    /// What the cells are in Abaqus' file, and their materials.
    pub sections: Option<Sections>,
    /// Facets with b up to this are tagged as features.
    pub tag_features: Option<f64>,
    /// The parts that features cut off become regions, unless they have fewer cells than this.
    pub regions: Option<usize>,
}

impl Outputs {
    /// The files of a run.
    ///
    /// # Errors
    /// [`JobError`] if the mesh is missing, an extension is unknown, or options contradict each other.
    pub fn new(run: &RunConfig, config: Option<&Path>) -> Result<Self, JobError> {
        let options = &run.output;
        let Some(mesh) = options.output.clone() else {
            return Err(JobError::misuse("no mesh to write; expected -o MESH, as in -o mesh.vtu"));
        };
        if config.is_some() {
            check_names(run)?;
        }
        let is_voronoi = run.is_voronoi();
        let msh =
            MshWish { version: options.msh.as_deref(), is_text: options.msh_text == Some(true) };
        let format = OutputFormat::of(&mesh, is_voronoi, msh)?;
        let connections = connections(options, is_voronoi)?;
        let picture = PictureFile::of(options.picture.as_ref())?;
        files::check_extension(options.movie.as_ref(), "png")?;
        if let Some(path) = &options.write_potential {
            files::check_potential(path)?;
        }
        let (report, html) = reports(options)?;
        let is_quadratic = options.order == Some(2);
        if is_quadratic && !format.holds_quadratic() {
            let message = "--order 2 is for .vtu .vtk .msh .msh2 .inp files";
            return Err(JobError::misuse(message).about(&mesh));
        }
        if options.tag_features.is_some() && !format.holds_tags() {
            let message = "the format holds no tags; expected .vtu, .msh, .msh2, .inp or polyMesh";
            return Err(JobError::misuse(message).about(&mesh));
        }
        let regions = regions(run)?;
        let sections = sections(options, &mesh, format)?;
        if let (Some(page), true) = (&html, is_voronoi) {
            let refusal =
                JobError::misuse("a page shows triangles or tetrahedra, not Voronoi cells");
            return Err(refusal.about(page).advise("ask for --report in JSON, and --picture"));
        }
        Ok(Self {
            mesh,
            format,
            connections,
            picture,
            backdrop: options.picture_of.unwrap_or_default(),
            view: options.view.unwrap_or_default(),
            movie: options.movie.clone(),
            report,
            html,
            potential: options.write_potential.clone(),
            config: config.map(Path::to_path_buf),
            is_quadratic,
            sections,
            tag_features: options.tag_features,
            regions,
        })
    }

    /// The same files, written to where the group says.
    ///
    /// # Errors
    /// [`JobError`] names the file that cannot be written.
    pub fn staged(&self, group: &mut OutputGroup) -> Result<Self, JobError> {
        Ok(Self {
            mesh: files::stage(&self.mesh, group)?,
            connections: self.connections.as_ref().map(|f| staged_list(f, group)).transpose()?,
            picture: self.picture.as_ref().map(|p| p.staged(group)).transpose()?,
            movie: files::stage_any(&self.movie, group)?,
            report: files::stage_any(&self.report, group)?,
            html: files::stage_any(&self.html, group)?,
            potential: files::stage_any(&self.potential, group)?,
            config: files::stage_any(&self.config, group)?,
            sections: self.sections.clone(),
            ..*self
        })
    }

    /// Whether something is drawn over an image.
    pub fn is_drawn(&self) -> bool {
        self.picture.is_some() || self.movie.is_some()
    }

    /// Whether the picture shows groups of facets or regions.
    pub fn shows_tags(&self) -> bool {
        self.picture.is_some() && self.view != View::Slices
    }

    /// Whether the image is still needed after the atoms have felt it.
    pub fn needs_image(&self) -> bool {
        self.is_drawn() || self.needs_report()
    }

    /// Whether the mesh is to be measured against the features and the image.
    pub fn needs_report(&self) -> bool {
        self.report.is_some() || self.html.is_some()
    }

    /// Tries whether every file can be written, and would not take the place of another or of an
    /// input.
    ///
    /// # Errors
    /// [`JobError`] names the first that does not.
    pub fn check(&self, run: &RunConfig, session: &mut Session<'_>) -> Result<(), JobError> {
        let picture = self.picture.as_ref().map(|picture| &picture.path);
        let (report, html) = (self.report.as_ref(), self.html.as_ref());
        let movie = self.movie.as_ref();
        let others = [Some(&self.mesh), picture, movie, report, html, self.potential.as_ref()];
        let others = others.into_iter().flatten().map(PathBuf::as_path);
        let tables = self.connections.iter().flat_map(ConnectionFiles::paths);
        let all = others.chain(tables).chain(self.config.as_deref());
        files::check_apart(run.input.paths(), all, session)
    }
}

/// Refuses names of files that a configuration, which is text, cannot hold.
fn check_names(run: &RunConfig) -> Result<(), JobError> {
    let RunConfig { mut input, mut output, .. } = run.clone();
    let names = input.files_mut().into_iter().chain(output.files_mut()).flatten();
    match names.into_iter().find(|path| path.to_str().is_none()) {
        Some(path) => {
            let message = "the name is not UTF-8, which --write-config cannot hold";
            Err(JobError::misuse(message).advise("choose another name").about(path))
        }
        None => Ok(()),
    }
}

/// A list of connections, written to where the group says.
pub(crate) fn staged_list(
    files: &ConnectionFiles,
    group: &mut OutputGroup,
) -> Result<ConnectionFiles, JobError> {
    Ok(ConnectionFiles {
        head: files::stage(&files.head, group)?,
        cells: files::stage(&files.cells, group)?,
        connections: files::stage(&files.connections, group)?,
        boundary: files::stage(&files.boundary, group)?,
    })
}

fn connections(
    options: &OutputOptions,
    is_voronoi: bool,
) -> Result<Option<ConnectionFiles>, JobError> {
    let Some(head) = options.connections.as_deref() else { return Ok(None) };
    if !is_voronoi {
        let refusal = JobError::misuse("--connections lists those of Voronoi cells");
        return Err(refusal.about(head).advise("add --mesh voronoi"));
    }
    files::refuse_standard_output(head, "a list of connections is four")?;
    files::check_head(head)?;
    if head.extension().is_none_or(|extension| extension != "json") {
        return Err(unknown_extension(head, ".json"));
    }
    Ok(Some(ConnectionFiles::of(head)))
}

/// The files of the report as JSON and as a page.
fn reports(options: &OutputOptions) -> Result<(Option<PathBuf>, Option<PathBuf>), JobError> {
    match (options.report.clone(), options.html.clone()) {
        (Some(report), Some(_)) if has_extension(&report, "html") => {
            let message = "--html names another page; expected one, or a report in JSON";
            Err(JobError::misuse(message).about(&report))
        }
        (Some(page), None) if has_extension(&page, "html") => Ok((None, Some(page))),
        other => Ok(other),
    }
}

/// The sections that options ask for.
///
/// # Errors
/// [`JobError`] if the file holds none, or materials stand without sections.
fn sections(
    options: &OutputOptions,
    mesh: &Path,
    format: OutputFormat,
) -> Result<Option<Sections>, JobError> {
    let materials = options.material.as_deref().unwrap_or_default();
    let Some(kind) = options.section else {
        return match materials {
            [] => Ok(None),
            _ => Err(JobError::misuse("--material without --section; expected both")),
        };
    };
    if format != OutputFormat::Simplices(MeshFormat::Inp) {
        return Err(JobError::misuse("--section is for .inp files (Abaqus)").about(mesh));
    }
    let elastic = |Text(given): &Text<MaterialSpec>| Elastic {
        region: given.region,
        youngs_modulus: given.youngs_modulus,
        poissons_ratio: given.poissons_ratio,
    };
    Ok(Some(Sections { kind, materials: materials.iter().map(elastic).collect() }))
}

/// The least size of the parts that become regions, if they do.
fn regions(run: &RunConfig) -> Result<Option<usize>, JobError> {
    if run.output.regions != Some(true) {
        return Ok(None);
    }
    if run.output.tag_features.is_none() {
        let message =
            "--regions without --tag-features; expected both, since features cut the mesh";
        return Err(JobError::misuse(message));
    }
    if let Some(labels) = &run.input.labels {
        let message = "are regions already; expected them or --regions";
        return Err(JobError::misuse(message).about(labels));
    }
    Ok(Some(run.regions.least_island.unwrap_or(0) as usize))
}
