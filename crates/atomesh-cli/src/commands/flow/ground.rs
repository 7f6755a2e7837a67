//! What flow is computed on: a mesh as read, or that of an image.

use atomesh::features::FeatureFacetOptions;
use atomesh::geometry::Bounds;
use atomesh::image::{Frame, Image, Units};
use atomesh::mesh::{Mesh, Tags};
use atomesh::pipeline::Outcome;
use atomesh::voronoi::{FeatureFaces, PolyMesh};
use atomesh_flow::{FlowError, Grid, Problem, Setting, dg, two_point};
use atomesh_io::image::{AnyImage, ImageFormat};
use atomesh_io::mesh::{AnyMesh, LoadedMesh, MeshFormat, OwnedField, Provenance};

use super::answer::Answer;
use super::files::Files;
use super::permeability::permeability;
use super::{FlowOptions, wells};
use crate::dimension::Dimension;
use crate::failure::Failure;
use crate::frame_options::{self, FrameOptions};
use crate::mesh_file;
use crate::meshing::{Meshing, labels_alone, shown_path};
use crate::progress::Progress;
use crate::run_config::RunConfig;
use crate::values::Numbers;

/// A mesh in the world with what belongs to it.
pub struct Ground<const D: usize> {
    /// Triangles or tetrahedra.
    pub mesh: Mesh<D>,
    /// Its sides and features.
    pub tags: Tags<D>,
    /// The Voronoi cells and their faces on features, if flow is computed on them.
    pub cells: Option<(PolyMesh<D>, FeatureFaces)>,
    /// Fields of the mesh's cells.
    pub cell_fields: Vec<OwnedField<f64>>,
    /// The frame of the image.
    pub frame: Option<Frame<D>>,
    /// The image.
    pub image: Option<Image<D>>,
    /// Where the mesh comes from.
    pub provenance: Option<Provenance>,
    /// The lattice units of the mesh.
    pub units: Units,
    /// Whether z grows upwards in pictures.
    pub z_up: bool,
}

/// Meshes or reads, solves and writes; the text is for standard output.
///
/// # Errors
/// [`Failure`] if options make no sense, a file cannot be used, or the user ends the work.
pub fn run(
    mut run: RunConfig,
    flow: &FlowOptions,
    files: &Files,
    watch: &mut Progress,
) -> Result<String, Failure> {
    labels_alone(&mut run);
    let path = match &run.input.image {
        Some(path) => path.clone(),
        None => shown_path(&run)?.to_path_buf(),
    };
    let is_image = ImageFormat::of(&path).is_some() || run.frame.shape.is_some();
    if !is_image && MeshFormat::of(&path).is_ok() {
        refuse_mesh_options(&run)?;
        return match mesh_file::read(&path)? {
            AnyMesh::Flat(mesh) => {
                let ground = loaded(mesh)?;
                solve(flow, &run.frame, ground, (&Dimension::flat(), files), watch)
            }
            AnyMesh::Volume(mesh) => {
                let ground = loaded(mesh)?;
                solve(flow, &run.frame, ground, (&Dimension::volume(), files), watch)
            }
        };
    }
    // wells are atoms, so that cells meet or centre there
    let places = flow.source.iter().chain(&flow.sink);
    let places = places.map(|well| Numbers(well.coordinates().to_vec()));
    run.lattice.seed_point.get_or_insert_default().extend(places);
    run.check()?;
    let image = frame_options::read(&path, &run.frame.read_options()?, watch)?;
    let meshing = Meshing { run: &run, path: &path };
    match image {
        AnyImage::Flat(image) => {
            let dimension = Dimension::flat();
            let ground = meshed(meshing, flow, image, (&dimension, files), watch)?;
            solve(flow, &run.frame, ground, (&dimension, files), watch)
        }
        AnyImage::Volume(image) => {
            let dimension = Dimension::volume();
            let ground = meshed(meshing, flow, image, (&dimension, files), watch)?;
            solve(flow, &run.frame, ground, (&dimension, files), watch)
        }
    }
}

/// A mesh as read is not meshed again.
fn refuse_mesh_options(run: &RunConfig) -> Result<(), Failure> {
    let others = [
        ("lattice", run.lattice.is_empty()),
        ("features", run.features.is_empty()),
        ("regions", run.regions.is_empty()),
        ("optimisation", run.optimize.is_empty()),
        ("improvement", run.improve.is_empty()),
    ];
    match others.iter().find(|(_, is_empty)| !is_empty) {
        Some((section, _)) => Err(Failure::misuse(format!(
            "options of {section} with a mesh; expected an image, or none of them"
        ))),
        None => Ok(()),
    }
}

/// A mesh as read.
fn loaded<const D: usize>(loaded: LoadedMesh<D>) -> Result<Ground<D>, Failure> {
    let LoadedMesh { mesh, tags, cell_fields, frame, provenance, .. } = loaded;
    let mesh = mesh_file::turned_right(mesh);
    let tags = match Bounds::of(mesh.points()) {
        Some(bounds) if tags.facet_group("xmin").is_none() => {
            let tolerance = 1e-9 * bounds.extent().iter().fold(0.0_f64, |a, b| a.max(*b));
            Tags::sides(&mesh, &bounds, tolerance).merge(tags).map_err(Failure::content)?
        }
        _ => tags,
    };
    Ok(Ground {
        mesh,
        tags,
        cells: None,
        cell_fields,
        frame,
        image: None,
        provenance,
        units: Units::Physical,
        z_up: false,
    })
}

/// The mesh of an image.
fn meshed<const D: usize>(
    meshing: Meshing<'_>,
    flow: &FlowOptions,
    image: Image<D>,
    (dimension, files): (&Dimension<D>, &Files),
    watch: &mut Progress,
) -> Result<Ground<D>, Failure> {
    let keep = files.needs_image();
    let (prepared, image) = meshing.prepare(image, dimension, keep, watch)?;
    let outcome = prepared.run(watch).map_err(|e| meshing.failure(e))?;
    let z_is_height = ImageFormat::of(meshing.path).is_some_and(ImageFormat::z_is_height);
    let z_up = z_is_height && outcome.frame().direction()[D - 1][D - 1] > 0.0;
    let mesh = outcome.world_mesh();
    let cells = outcome.world_cells();
    let features = || outcome.cell_features_from(-flow.below).unwrap_or_default();
    let tags = if cells.is_some() {
        Tags::default()
    } else {
        tags(&outcome, &mesh, flow, watch).map_err(|f| f.about(meshing.path))?
    };
    let options = meshing.run.provenance::<D>();
    let seed = options["optimize"]["seed"].as_u64().unwrap_or(0);
    let provenance = Provenance { version: env!("CARGO_PKG_VERSION").into(), options, seed };
    Ok(Ground {
        tags,
        cells: cells.map(|cells| (cells, features())),
        cell_fields: Vec::new(),
        frame: Some(*outcome.frame()),
        image,
        provenance: Some(provenance),
        units: outcome.units(),
        z_up,
        mesh,
    })
}

/// Sides, outline, interfaces and features.
fn tags<const D: usize>(
    outcome: &Outcome<D>,
    mesh: &Mesh<D>,
    flow: &FlowOptions,
    watch: &mut Progress,
) -> Result<Tags<D>, Failure> {
    let options = FeatureFacetOptions { below: flow.below, ..FeatureFacetOptions::default() };
    let found = outcome
        .features(mesh, &options, watch)
        .map_err(|e| if e.is_cancelled() { Failure::cancelled() } else { Failure::content(e) })?;
    let features = found.tags(mesh).map_err(Failure::content)?;
    outcome.tags().and_then(|tags| tags.merge(features)).map_err(Failure::content)
}

/// Solves and writes.
fn solve<const D: usize>(
    flow: &FlowOptions,
    frame: &FrameOptions,
    ground: Ground<D>,
    (dimension, files): (&Dimension<D>, &Files),
    watch: &mut Progress,
) -> Result<String, Failure> {
    let grid = match &ground.cells {
        Some((cells, features)) => Grid::of_cells(cells, Some(features)),
        None => Grid::of_mesh(&ground.mesh, &ground.tags),
    };
    let (wells, open) = wells::wells(&flow.source, &flow.sink)?;
    let names = grid.sets().iter().map(|set| set.name.as_str());
    let mut problem = Problem {
        permeability: permeability(flow, frame, &ground, dimension, watch)?,
        source: None,
        wells,
        boundaries: flow.side.iter().map(wells::SideSpec::boundary).collect(),
        barriers: wells::barriers(names, flow.multiplier, &flow.barrier),
    };
    problem.balance_wells(&open);
    if problem.wells.is_empty() && problem.boundaries.is_empty() {
        let message = "nothing flows; expected --source and --sink, or --side";
        return Err(Failure::misuse(message));
    }
    let setting = Setting::new(&problem, &grid).map_err(failure)?;
    let (solution, galerkin) = match &ground.cells {
        Some((cells, _)) => {
            if flow.form.is_some() || flow.order.is_some() {
                let message =
                    "--form and --order are for triangles and tetrahedra, not Voronoi cells";
                return Err(Failure::misuse(message));
            }
            let solution = two_point::solve(cells, &grid, &setting, &flow.solve(), watch);
            (solution.map_err(failure)?, None)
        }
        None => {
            let answer = dg::solve(&grid, &setting, &flow.galerkin(), watch).map_err(failure)?;
            (answer.solution.clone(), Some(answer))
        }
    };
    let answer = Answer {
        ground: &ground,
        grid: &grid,
        setting: &setting,
        velocities: solution.velocities(&grid),
        solution,
        galerkin,
        porosity: flow.porosity,
    };
    files.write(&answer, dimension, watch)?;
    watch.say(&answer.summary(watch));
    Ok(answer.table())
}

/// What the library refuses, in the user's terms.
pub fn failure(error: FlowError) -> Failure {
    match &error {
        FlowError::Cancelled(_) => Failure::cancelled(),
        FlowError::Solve(atomesh_flow::solve::SolveError::Cancelled(_)) => Failure::cancelled(),
        FlowError::Group { .. }
        | FlowError::Place { .. }
        | FlowError::Multiplier { .. }
        | FlowError::NotFinite { .. }
        | FlowError::WellOutside { .. }
        | FlowError::WellRadius { .. }
        | FlowError::Order { .. }
        | FlowError::Tensor => Failure::misuse(error),
        FlowError::Unbalanced { .. } => Failure::content(error).advise(
            "give a pressure by --side or --sink ...:pressure=P:radius=R, open a barrier by --barrier NAME=M \
             or --multiplier, or move the wells",
        ),
        _ => Failure::content(error),
    }
}
