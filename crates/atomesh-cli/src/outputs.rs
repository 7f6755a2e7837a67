//! The files that a run writes: refused before the work if they cannot be, written after it.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use atomesh::features::FeatureFacetOptions;
use atomesh::image::{Image, Samples};
use atomesh::mesh::{Mesh, Regions, Tags};
use atomesh::run::Outcome;
use atomesh::watch::{Phase, Watch};
use atomesh_draw::{PictureFormat, Style};
use atomesh_io::atomic_file::AtomicFile;
use atomesh_io::image::{ImageFormat, WriteReason, write_image};
use atomesh_io::mesh::cells::{
    CellData, ConnectionFiles, foam_mesh_of, write_cells_vtu, write_connections,
};
use atomesh_io::mesh::msh::MshVersion;
use atomesh_io::mesh::openfoam::{check_foam_mesh_writable, write_foam_mesh};
use atomesh_io::mesh::{MeshData, MeshFormat, MeshWriteError, Provenance, write_mesh_as};

use crate::dimension::Dimension;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::run_config::{Backdrop, InputOptions, RunConfig};

/// Where everything goes, in formats that are known.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// The mesh.
    pub mesh: PathBuf,
    mesh_format: Format,
    connections: Option<ConnectionFiles>,
    picture: Option<(PathBuf, PictureFormat)>,
    backdrop: Backdrop,
    /// The report.
    pub report: Option<PathBuf>,
    /// The report as a page.
    pub html: Option<PathBuf>,
    potential: Option<PathBuf>,
    /// Whether cells of second order are written.
    is_quadratic: bool,
    /// Facets with b up to this are tagged as features.
    tag_features: Option<f64>,
    /// The parts that features cut off become regions, unless they have fewer cells than this.
    regions: Option<usize>,
    /// Whether the image comes from a format in which z is up where it grows.
    z_is_height: bool,
}

/// What the mesh is written as.
#[derive(Clone, Copy, Debug)]
enum Format {
    /// Triangles or tetrahedra.
    Simplices(MeshFormat),
    /// Voronoi cells as VTU.
    CellsVtu,
    /// Voronoi cells as OpenFOAM's folder.
    CellsFoam,
}

impl Format {
    /// The format that a path calls for.
    fn of(mesh: &Path, is_voronoi: bool, msh: Option<&str>) -> Result<Self, Failure> {
        if is_voronoi {
            let is_foam = mesh.file_name().is_some_and(|name| name == "polyMesh");
            return match MeshFormat::of(mesh) {
                _ if is_foam => Ok(Self::CellsFoam),
                Ok(MeshFormat::Vtu) => Ok(Self::CellsVtu),
                _ => {
                    let message =
                        "Voronoi cells are written as .vtu, or into a folder named polyMesh";
                    Err(Failure::misuse(message).about(mesh))
                }
            };
        }
        let format =
            MeshFormat::of(mesh).map_err(|_| unknown_ending(mesh, &MeshFormat::endings()))?;
        let Some(version) = msh else { return Ok(Self::Simplices(format)) };
        match format {
            MeshFormat::Msh(_, encoding) => {
                Ok(Self::Simplices(MeshFormat::Msh(msh_version(version)?, encoding)))
            }
            _ => Err(Failure::misuse("--msh is for .msh files").about(mesh)),
        }
    }

    /// Whether it holds groups of facets that follow features.
    fn holds_tags(self) -> bool {
        matches!(self, Self::Simplices(format) if format.holds_tags())
    }

    /// Whether it holds cells of second order.
    fn holds_quadratic(self) -> bool {
        matches!(self, Self::Simplices(format) if format.holds_quadratic())
    }

    /// Tries whether the mesh can be written.
    fn check_writable(self, path: &Path) -> io::Result<()> {
        match self {
            Self::Simplices(format) => format.check_writable(path),
            Self::CellsVtu => AtomicFile::create(path).map(drop),
            Self::CellsFoam => check_foam_mesh_writable(path),
        }
    }
}

impl Outputs {
    /// The files of a run on an image.
    ///
    /// # Errors
    /// [`Failure`] if the mesh is missing or an ending unknown.
    pub fn new(run: &RunConfig, image: &Path) -> Result<Self, Failure> {
        let options = &run.output;
        let Some(mesh) = options.output.clone() else {
            return Err(Failure::misuse("no mesh to write; expected -o MESH, as in -o mesh.vtu"));
        };
        let mesh_format = Format::of(&mesh, run.is_voronoi(), options.msh.as_deref())?;
        let connections = options.connections.as_deref().map(ConnectionFiles::of);
        if let (Some(files), false) = (&connections, run.is_voronoi()) {
            let failure = Failure::misuse("--connections lists those of Voronoi cells");
            return Err(failure.about(&files.head).advise("add --mesh voronoi"));
        }
        if let Some(files) =
            connections.as_ref().filter(|files| files.head.extension().is_none_or(|e| e != "json"))
        {
            return Err(unknown_ending(&files.head, ".json"));
        }
        let picture = picture_file(options.picture.as_deref())?;
        let potential = options.write_potential.clone();
        if let Some(path) = &potential {
            check_potential(path)?;
        }
        let z_is_height = ImageFormat::of(image).is_some_and(ImageFormat::z_is_height);
        let (report, html) = match (options.report.clone(), options.html.clone()) {
            (Some(report), Some(_)) if is_page(&report) => {
                let message = "--html names another page; expected one, or a report in JSON";
                return Err(Failure::misuse(message).about(&report));
            }
            (Some(page), None) if is_page(&page) => (None, Some(page)),
            other => other,
        };
        let is_quadratic = options.order == Some(2);
        if is_quadratic && !mesh_format.holds_quadratic() {
            let message = "--order 2 is for .vtu .vtk .msh .msh2 .inp files";
            return Err(Failure::misuse(message).about(&mesh));
        }
        let tag_features = options.tag_features;
        if tag_features.is_some() && !mesh_format.holds_tags() {
            let message = "the format holds no tags; expected .vtu, .msh, .msh2, .inp or polyMesh";
            return Err(Failure::misuse(message).about(&mesh));
        }
        let regions = options.regions.filter(|&wanted| wanted);
        if regions.is_some() && tag_features.is_none() {
            let message =
                "--regions without --tag-features; expected both, since features cut the mesh";
            return Err(Failure::misuse(message));
        }
        if let (Some(_), Some(labels)) = (regions, &run.input.labels) {
            let message = "are regions already; expected them or --regions";
            return Err(Failure::misuse(message).about(labels));
        }
        let least = run.regions.least_island.unwrap_or(0) as usize;
        if let (Some(page), true) = (&html, run.is_voronoi()) {
            let failure =
                Failure::misuse("a page shows triangles or tetrahedra, not Voronoi cells");
            return Err(failure.about(page).advise("ask for --report in JSON, and --picture"));
        }
        Ok(Self {
            mesh,
            mesh_format,
            connections,
            picture,
            backdrop: options.picture_of.unwrap_or_default(),
            report,
            html,
            potential,
            is_quadratic,
            tag_features,
            regions: regions.map(|_| least),
            z_is_height,
        })
    }

    /// Whether the image is still needed after the atoms have felt it.
    pub fn needs_image(&self) -> bool {
        self.picture.is_some() || self.needs_report()
    }

    /// Whether the mesh is to be measured against the features and the image.
    pub fn needs_report(&self) -> bool {
        self.report.is_some() || self.html.is_some()
    }

    /// How the mesh is drawn.
    pub fn style<const D: usize>(&self, outcome: &Outcome<D>) -> Style {
        let z_up = self.z_is_height && outcome.frame().direction()[D - 1][D - 1] > 0.0;
        Style { units: outcome.units(), z_up, ..Style::default() }
    }

    fn paths(&self) -> impl Iterator<Item = &Path> {
        let picture = self.picture.as_ref().map(|(path, _)| path);
        let others = [picture, self.report.as_ref(), self.html.as_ref(), self.potential.as_ref()];
        let others = others.into_iter().flatten().map(PathBuf::as_path);
        let tables = self.connections.iter().flat_map(ConnectionFiles::paths);
        [self.mesh.as_path()].into_iter().chain(others).chain(tables)
    }

    /// Tries whether every file can be written, and would not take the place of another or of an
    /// input.
    ///
    /// # Errors
    /// [`Failure`] names the first that does not.
    pub fn check(&self, input: &InputOptions, config: Option<&Path>) -> Result<(), Failure> {
        let mut places = Places::taken(input.paths());
        for path in self.paths().chain(config) {
            if path == self.mesh {
                self.mesh_format.check_writable(path).map_err(|e| cannot_write(path, &e))?;
            } else {
                check_writable(path)?;
            }
            places.take(path)?;
        }
        Ok(())
    }

    /// Writes mesh, potential and picture.
    ///
    /// # Errors
    /// [`Failure`] if a file cannot be written, or the user ends the work.
    pub fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        image: Option<&Image<D>>,
        options: serde_json::Value,
        dimension: &Dimension<D>,
        watch: &mut Progress,
    ) -> Result<(), Failure> {
        if let (Some((path, format)), Some(image)) = (&self.picture, image) {
            watch.begin(Phase::Draw);
            let style = self.style(outcome);
            let backdrop = self.backdrop(outcome)?;
            let image = backdrop.as_ref().unwrap_or(image);
            let picture = match outcome.sample_cells() {
                Some(cells) => (dimension.draw_cells)(image, &cells, &style),
                None => (dimension.draw)(image, &outcome.sample_mesh(), &style),
            };
            let bytes = picture.and_then(|p| p.encode(*format)).map_err(Failure::content)?;
            write_bytes(path, &bytes)?;
        }
        let _ = watch.step(Phase::Write, 0.0, None);
        if let Some(path) = &self.potential {
            write_potential(path, outcome, watch)?;
        }
        let seed = options["optimize"]["seed"].as_u64().unwrap_or(0);
        let provenance = Provenance { version: env!("CARGO_PKG_VERSION").into(), options, seed };
        let Format::Simplices(format) = self.mesh_format else {
            return self.write_cells(outcome, &provenance, watch);
        };
        let mesh = outcome.world_mesh();
        let quadratic = self.is_quadratic.then(|| outcome.quadratic());
        let at_nodes = |values: &[f32]| match &quadratic {
            Some(quadratic) => quadratic.extend(values),
            None => values.to_vec(),
        };
        let distance = at_nodes(outcome.distance_at_points());
        let values = at_nodes(outcome.potential_at_points());
        // formats that hold tags have them as regions
        let labels = outcome.labels().filter(|_| !self.mesh_format.holds_tags());
        let labels = labels.map(|l| l.iter().map(|&l| l as f32).collect::<Vec<f32>>());
        let tags = self.tags(outcome, &mesh, watch)?;
        let mut data =
            MeshData::new(&mesh).with_frame(outcome.frame()).with_provenance(&provenance);
        data = data.with_tags(&tags);
        if let Some(quadratic) = &quadratic {
            data = data.with_quadratic(quadratic);
        }
        data = data.with_point_field("distance", &distance).map_err(Failure::content)?;
        data = data.with_point_field("potential", &values).map_err(Failure::content)?;
        if let Some(labels) = &labels {
            data = data.with_cell_field("label", labels).map_err(Failure::content)?;
        }
        write_mesh_as(&self.mesh, format, &data, watch).map_err(|e| self.mesh_failure(e))
    }

    /// What is drawn behind the mesh; `None`: the image.
    fn backdrop<const D: usize>(&self, outcome: &Outcome<D>) -> Result<Option<Image<D>>, Failure> {
        let values = match self.backdrop {
            Backdrop::Image => return Ok(None),
            Backdrop::Potential => outcome.potential().samples().to_vec(),
            Backdrop::Distance => outcome.distance_at_samples(),
            Backdrop::Density => outcome.feature_density(),
        };
        let image = Image::new(*outcome.frame(), Samples::F32(values));
        image.map(Some).map_err(Failure::content)
    }

    /// Writes Voronoi cells and their connections.
    fn write_cells<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        provenance: &Provenance,
        watch: &mut Progress,
    ) -> Result<(), Failure> {
        let Some(mesh) = outcome.world_cells() else {
            return Err(Failure::content("the run made no Voronoi cells"));
        };
        // the VTU file does not name them
        let names_features =
            self.connections.is_some() || matches!(self.mesh_format, Format::CellsFoam);
        let features = names_features.then(|| outcome.cell_features()).flatten();
        let features = features.unwrap_or_default();
        let frame = outcome.frame();
        let data = CellData { mesh: &mesh, features: &features, frame, provenance };
        let written = match self.mesh_format {
            Format::CellsFoam => {
                let mesh = foam_mesh_of(&data).map_err(Failure::content)?;
                write_foam_mesh(&self.mesh, &mesh, watch)
            }
            _ => (|| {
                let mut file = AtomicFile::create(&self.mesh)?;
                write_cells_vtu(&mut file, &data, watch)?;
                Ok(file.commit()?)
            })(),
        };
        written.map_err(|e| self.mesh_failure(e))?;
        match &self.connections {
            Some(files) => write_connections(files, &data, watch).map_err(|e| self.mesh_failure(e)),
            None => Ok(()),
        }
    }

    fn mesh_failure(&self, error: MeshWriteError) -> Failure {
        match error {
            MeshWriteError::Cancelled(_) => Failure::cancelled(),
            _ => Failure::content(error).about(&self.mesh),
        }
    }
}

impl Outputs {
    /// The sides of the box, outline and labels, and the features if they are asked for.
    fn tags<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        world: &Mesh<D>,
        watch: &mut Progress,
    ) -> Result<Tags<D>, Failure> {
        let sides = outcome.tags().map_err(Failure::content)?;
        let Some(below) = self.tag_features else { return Ok(sides) };
        let options = FeatureFacetOptions { below, ..FeatureFacetOptions::default() };
        let found = outcome.features(world, &options, watch).map_err(|e| {
            if e.is_cancelled() { Failure::cancelled() } else { Failure::misuse(e) }
        })?;
        let mut features = found.tags(world).map_err(Failure::content)?;
        if let Some(least) = self.regions {
            features = with_regions(features, world, found.regions(world, least))?;
        }
        watch.say(&format!(
            "{}: {} features of {} facets tagged",
            self.mesh.display(),
            found.features.len(),
            found.features.iter().map(|feature| feature.facets.len()).sum::<usize>(),
        ));
        sides.merge(features).map_err(Failure::content)
    }
}

/// The tags with regions beside them.
///
/// # Errors
/// [`Failure`] if they have regions.
pub fn with_regions<const D: usize>(
    tags: Tags<D>,
    mesh: &Mesh<D>,
    regions: Regions,
) -> Result<Tags<D>, Failure> {
    let regions = Tags::new(mesh, Vec::new(), Some(regions)).map_err(Failure::content)?;
    tags.merge(regions).map_err(Failure::content)
}

fn msh_version(text: &str) -> Result<MshVersion, Failure> {
    match text {
        "4.1" => Ok(MshVersion::V41),
        "2.2" => Ok(MshVersion::V22),
        _ => Err(Failure::misuse(format!("msh version {text:?}; expected 4.1 or 2.2"))),
    }
}

/// Where a picture goes and in which format.
///
/// # Errors
/// [`Failure`] if the ending is unknown.
pub fn picture_file(path: Option<&Path>) -> Result<Option<(PathBuf, PictureFormat)>, Failure> {
    let Some(path) = path else { return Ok(None) };
    let format = PictureFormat::of(path).map_err(|_| unknown_ending(path, ".png, .svg"))?;
    Ok(Some((path.into(), format)))
}

/// Whether a report is to be a page.
fn is_page(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("html"))
}

/// A failure that names the endings that are known.
pub fn unknown_ending(path: &Path, known: &str) -> Failure {
    Failure::misuse(format!("the ending says no format; expected one of {known}")).about(path)
}

/// Checks that a file's ending promises a format that holds single precision.
pub fn check_potential(path: &Path) -> Result<(), Failure> {
    match ImageFormat::from_path(path) {
        Some(format) if format.writes_floats() => Ok(()),
        _ => Err(unknown_ending(path, &ImageFormat::usual_written_endings(", ", true))),
    }
}

/// Places of files that a run must not write over.
pub struct Places(Vec<PathBuf>);

impl Places {
    /// The places of the files that are read.
    pub fn taken<'a>(inputs: impl IntoIterator<Item = &'a Path>) -> Self {
        Self(inputs.into_iter().filter_map(|path| path.canonicalize().ok()).collect())
    }

    /// Takes the place of a file that is written.
    ///
    /// # Errors
    /// [`Failure`] if it is taken.
    pub fn take(&mut self, path: &Path) -> Result<(), Failure> {
        let name = absolute(path);
        if self.0.contains(&name) {
            let message = "would be written over another file of this run";
            return Err(Failure::misuse(message).about(path));
        }
        self.0.push(name);
        Ok(())
    }
}

/// Tries whether a file could be written.
pub fn check_writable(path: &Path) -> Result<(), Failure> {
    AtomicFile::create(path).map(drop).map_err(|e| cannot_write(path, &e))
}

/// Writes a file, whole or not at all.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let write = || {
        let mut file = AtomicFile::create(path)?;
        file.write_all(bytes)?;
        file.commit()
    };
    write().map_err(|e| cannot_write(path, &e))
}

fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    let failure = Failure::content(format!("cannot be written: {error}")).about(path);
    match error.kind() {
        io::ErrorKind::NotFound => failure.advise("make its folder first"),
        _ => failure,
    }
}

fn write_potential<const D: usize>(
    path: &Path,
    outcome: &Outcome<D>,
    watch: &mut Progress,
) -> Result<(), Failure> {
    let samples = Samples::F32(outcome.potential().samples().to_vec());
    let image = Image::new(*outcome.frame(), samples).map_err(Failure::content)?;
    write_image(path, &image, watch).map_err(|e| match e.reason {
        WriteReason::Cancelled(_) => Failure::cancelled(),
        _ => Failure::content(e),
    })
}

/// The path as other spellings of it would be too.
fn absolute(path: &Path) -> PathBuf {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let whole = path.canonicalize().ok();
    whole.unwrap_or_else(|| {
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.into());
        folder.join(path.file_name().unwrap_or_default())
    })
}
