//! What flow is computed on: a mesh as read, or that of an image.

use std::path::Path;

use atomesh::features::{FeatureFaces, FeatureFacetOptions};
use atomesh::image::{Frame, Image, Units};
use atomesh::mesh::{Mesh, PolyMesh, Tags};
use atomesh::run::Outcome;
use atomesh_flow::dg::{self, Form};
use atomesh_flow::{FlowError, Grid, Problem, Setting, two_point};
use atomesh_io::image::{AnyImage, ImageFormat};
use atomesh_io::mesh::cells::{AnyCells, CellReadError, LoadedCells, read_cells};
use atomesh_io::mesh::{AnyMesh, LoadedMesh, MeshFormat, OwnedField, Provenance};

use super::answer::Answer;
use super::files::Files;
use super::permeability::permeability;
use super::{FlowOptions, wells};
use crate::dimension::Dimension;
use crate::failure::Failure;
use crate::frame_options::{self, FrameOptions};
use crate::memory;
use crate::mesh_file;
use crate::meshing::{Meshing, labels_alone, shown_path};
use crate::progress::Progress;
use crate::run_config::RunConfig;
use crate::values::Numbers;

/// The cells, in the world.
pub enum Body<const D: usize> {
    /// Triangles or tetrahedra, with their sides and features.
    Simplices(Mesh<D>, Tags<D>),
    /// Voronoi cells, with their faces on features.
    Polytopes(Box<PolyMesh<D>>, FeatureFaces),
}

/// A mesh with what belongs to it.
pub struct Ground<const D: usize> {
    /// The cells.
    pub body: Body<D>,
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
    let is_list = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    if !is_image && (is_list || MeshFormat::of(&path).is_ok()) {
        refuse_mesh_options(&run)?;
        let (flat, volume) = (Dimension::flat(), Dimension::volume());
        return match read(&path, is_list, watch)? {
            AnyGround::Flat(ground) => solve(flow, &run.frame, ground, (&flat, files), watch),
            AnyGround::Volume(ground) => solve(flow, &run.frame, ground, (&volume, files), watch),
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

/// A mesh as read, whose dimension the file decides.
enum AnyGround {
    Flat(Ground<2>),
    Volume(Ground<3>),
}

/// Reads triangles or tetrahedra, or else Voronoi cells.
fn read(path: &Path, is_list: bool, watch: &mut Progress) -> Result<AnyGround, Failure> {
    let simplices = match is_list {
        false => mesh_file::read(path),
        true => Err(Failure::misuse("no list of connections of Voronoi cells").about(path)),
    };
    let failure = match simplices {
        Ok(AnyMesh::Flat(mesh)) => return Ok(AnyGround::Flat(loaded(mesh)?)),
        Ok(AnyMesh::Volume(mesh)) => return Ok(AnyGround::Volume(loaded(mesh)?)),
        Err(failure) => failure,
    };
    match read_cells(path, watch) {
        Ok(AnyCells::Flat(cells)) => Ok(AnyGround::Flat(loaded_cells(cells))),
        Ok(AnyCells::Volume(cells)) => Ok(AnyGround::Volume(loaded_cells(cells))),
        Err(CellReadError::Cancelled(_)) => Err(Failure::cancelled()),
        Err(e) if is_list => Err(Failure::content(e).about(path)),
        Err(_) => Err(failure),
    }
}

/// Voronoi cells as read.
fn loaded_cells<const D: usize>(loaded: LoadedCells<D>) -> Ground<D> {
    let LoadedCells { mesh, features, fields, frame, provenance } = loaded;
    Ground {
        body: Body::Polytopes(Box::new(mesh), features),
        cell_fields: fields,
        frame: Some(frame),
        image: None,
        provenance: Some(provenance),
        units: Units::Physical,
        z_up: false,
    }
}

/// A mesh as read.
fn loaded<const D: usize>(loaded: LoadedMesh<D>) -> Result<Ground<D>, Failure> {
    let LoadedMesh { mesh, tags, cell_fields, frame, provenance, .. } = loaded;
    let mesh = mesh_file::turned_right(mesh);
    let tags = match tags.facet_group("xmin") {
        Some(_) => tags,
        None => {
            let sides = mesh_file::own_sides(&mesh, frame.as_ref());
            sides.merge(tags).map_err(Failure::content)?
        }
    };
    Ok(Ground {
        body: Body::Simplices(mesh, tags),
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
    for (option, spec) in wells::options(&flow.source, &flow.sink) {
        let place = prepared.frame().world_to_lattice(Units::Samples, &spec.place(option)?);
        let shape = prepared.frame().shape();
        if (0..D).any(|k| !(-1e-9..=shape[k] as f64 - 1.0 + 1e-9).contains(&place[k])) {
            let message = format!("--{option} {spec} lies outside the image");
            return Err(Failure::misuse(message)
                .about(meshing.path)
                .advise("places are in world coordinates; atomesh info IMAGE shows the box"));
        }
    }
    let outcome = prepared.run(watch).map_err(|e| meshing.failure(e))?;
    let z_is_height = ImageFormat::of(meshing.path).is_some_and(ImageFormat::z_is_height);
    let z_up = z_is_height && outcome.frame().direction()[D - 1][D - 1] > 0.0;
    let body = match outcome.world_cells() {
        Some(cells) => {
            let features = outcome.cell_features_from(-flow.below).unwrap_or_default();
            Body::Polytopes(Box::new(cells), features)
        }
        None => {
            let mesh = outcome.world_mesh();
            let tags = tags(&outcome, &mesh, flow, watch).map_err(|f| f.about(meshing.path))?;
            Body::Simplices(mesh, tags)
        }
    };
    let options = meshing.run.provenance::<D>();
    let seed = options["optimize"]["seed"].as_u64().unwrap_or(0);
    let provenance = Provenance { version: env!("CARGO_PKG_VERSION").into(), options, seed };
    Ok(Ground {
        body,
        cell_fields: Vec::new(),
        frame: Some(*outcome.frame()),
        image,
        provenance: Some(provenance),
        units: outcome.units(),
        z_up,
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
    let grid = match &ground.body {
        Body::Polytopes(cells, features) => Grid::of_cells(cells, Some(features)),
        Body::Simplices(mesh, tags) => Grid::of_mesh(mesh, tags),
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
    let (solution, galerkin) = match &ground.body {
        Body::Polytopes(cells, _) => {
            files.check_for_cells(flow)?;
            let solution = two_point::solve(cells, &grid, &setting, &flow.solve(), watch);
            (solution.map_err(failure)?, None)
        }
        Body::Simplices(..) => {
            let options = flow.galerkin();
            check_memory(dg::memory(&grid, &options))?;
            if D == 3 && options.form == Form::OdenBabuskaBaumann && grid.cell_count() > OBB_CELLS {
                watch.say("warning: obb takes long on so many tetrahedra; sipg is much faster");
            }
            let answer = dg::solve(&grid, &setting, &options, watch).map_err(failure)?;
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
    if answer.solution.balance(&grid).scale == 0.0 {
        watch.say("warning: nothing flows: barriers part all that drives it, or it is the same everywhere");
    }
    files.write(&answer, dimension, watch)?;
    watch.say(&answer.summary(watch));
    Ok(answer.table())
}

/// Tetrahedra from which on Oden, Babuška & Baumann's equations, which iteration does not solve, take minutes.
const OBB_CELLS: usize = 3000;

/// Refuses equations that do not fit.
fn check_memory(needed: u64) -> Result<(), Failure> {
    let Some(available) = memory::available().filter(|&available| needed > available) else {
        return Ok(());
    };
    let (needed, available) = (memory::text(needed), memory::text(available));
    let message = format!("the equations need some {needed} of memory; {available} are left");
    Err(Failure::content(message).advise("choose a lower --order, or a greater --size"))
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
