//! What a run of flow would take, before anything is meshed or solved.

use atomesh::image::Image;
use atomesh_flow::dg::{self, DgOptions};
use atomesh_flow::solve::SolveMethod;
use atomesh_io::image::AnyImage;
use atomesh_io::mesh::World;

use super::flow_mesh::AnyFlowMesh;
use super::{FlowMesh, FlowMeshCells, FlowOptions, FlowRequest, Opened, Source};
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::memory;
use crate::mesh::{Expectation, ShownImage, expect_image, on_threads};
use crate::options::RunConfig;
use crate::session::Session;

/// What a run of flow would take.
#[derive(Clone, Debug)]
pub struct FlowExpectation {
    /// How many cells.
    pub cell_count: u64,
    /// What the cells are called.
    pub cells: &'static str,
    /// How many unknowns.
    pub unknowns: u64,
    /// Bytes that the process takes at its peak.
    pub memory: u64,
    /// From the start to the answer, without files.
    pub seconds: f64,
}

/// Says what [`flow_file`](super::flow_file) would take; writes nothing.
///
/// # Errors
/// As [`flow_file`](super::flow_file).
pub fn expect(
    request: FlowRequest,
    session: &mut Session<'_>,
) -> Result<FlowExpectation, JobError> {
    let Opened { run, options, source, .. } = Opened::new(request, session)?;
    match source {
        Source::Mesh(mesh) => Ok(match *mesh {
            AnyFlowMesh::Flat(mesh) => of_mesh(&mesh, &options, &Dimension::plane(), session),
            AnyFlowMesh::Volume(mesh) => of_mesh(&mesh, &options, &Dimension::space(), session),
        }),
        Source::Image(loaded) => {
            let world = loaded.world();
            let image = loaded.image;
            match image {
                AnyImage::Flat(image) => {
                    of_image(&run, &options, (image, world), &Dimension::plane(), session)
                }
                AnyImage::Volume(image) => {
                    of_image(&run, &options, (image, world), &Dimension::space(), session)
                }
            }
        }
    }
}

fn of_image<const D: usize>(
    run: &RunConfig,
    options: &FlowOptions,
    (image, world): (Image<D>, World),
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<FlowExpectation, JobError> {
    let mesh = expect_image(run, ShownImage { image, world }, dimension, session)?;
    let Expectation { cell_count, cells, memory, seconds, .. } = mesh;
    let equations = Equations::of::<D>(cell_count, run.is_voronoi(), options);
    // the mesh is there while equations are solved, what made it is not
    let memory = memory.max(equations.bytes + memory / 2);
    let seconds = seconds + equations.seconds;
    Ok(FlowExpectation { cell_count, cells, unknowns: equations.unknowns, memory, seconds })
}

fn of_mesh<const D: usize>(
    mesh: &FlowMesh<D>,
    options: &FlowOptions,
    dimension: &Dimension<D>,
    session: &Session<'_>,
) -> FlowExpectation {
    let (cells, is_voronoi) = match &mesh.cells {
        FlowMeshCells::Voronoi { .. } => (dimension.voronoi_cells, true),
        FlowMeshCells::Simplices { .. } => (dimension.cells, false),
    };
    let cell_count = mesh.grid(&dimension.flow).cell_count() as u64;
    let equations = Equations::of::<D>(cell_count, is_voronoi, options);
    let memory = memory::peak().unwrap_or(0) + equations.bytes;
    let seconds = session.elapsed().as_secs_f64() + equations.seconds;
    FlowExpectation { cell_count, cells, unknowns: equations.unknowns, memory, seconds }
}

/// What equations take.
struct Equations {
    unknowns: u64,
    bytes: u64,
    seconds: f64,
}

/// Processor seconds that an unknown takes, in the plane, where factors are made, and in space, where equations of second
/// order are iterated; measured on 100,000 and 350,000 unknowns.
const UNKNOWN_SECONDS: [f64; 2] = [4e-6, 2e-5];

/// Faces of a Voronoi cell, each counted at one of its two cells.
const FACES: [u64; 2] = [3, 7];

impl Equations {
    fn of<const D: usize>(cells: u64, is_voronoi: bool, options: &FlowOptions) -> Self {
        // of simplices each inner facet has two cells; those on the sides are few
        let (inner, galerkin) = match is_voronoi {
            true => (FACES[D - 2] * cells, DgOptions { order: 0, ..options.galerkin() }),
            false => ((D as u64 + 1) * cells / 2, options.galerkin()),
        };
        let unknowns = dg::unknowns_of::<D>(cells, galerkin.order);
        let is_direct =
            D == 2 && options.solver == SolveMethod::Auto || options.solver == SolveMethod::Direct;
        let factors = if is_direct { dg::factor_memory(unknowns) } else { 0 };
        Self {
            unknowns,
            bytes: dg::memory_of::<D>(cells, inner, galerkin.order) + factors,
            seconds: on_threads(UNKNOWN_SECONDS[D - 2] * unknowns as f64),
        }
    }
}
