//! The mesh that flow is computed on: as read, or that of an image.

use std::path::Path;

use atomesh::features::{FeatureFaces, FeatureFacetOptions};
use atomesh::image::{Frame, Image, Units};
use atomesh::mesh::{Mesh, PolyMesh, Tags};
use atomesh::run::{AcrossFeature, Outcome, Prepared, Tools};
use atomesh_flow::{FlowGrid, FlowMethod};
use atomesh_io::mesh::cells::LoadedCells;
use atomesh_io::mesh::{LoadedMesh, OwnedField, Provenance};

use super::options::FlowOptions;
use super::problem::place;
use crate::error::JobError;
use crate::images::is_z_up;
use crate::mesh::{cells_of_wells, meshed, refusal};
use crate::mesh_file::{self, MeshFile};
use crate::options::RunConfig;
use crate::session::Session;

/// The cells that something flows through, in the world.
#[derive(Clone, Debug)]
pub enum FlowMeshCells<const D: usize> {
    /// Triangles or tetrahedra.
    Simplices {
        /// The mesh.
        mesh: Mesh<D>,
        /// Its sides and features.
        tags: Tags<D>,
    },
    /// Voronoi cells.
    Voronoi {
        /// The cells.
        cells: Box<PolyMesh<D>>,
        /// Their faces on features.
        features: FeatureFaces,
        /// The cell of each well, in their order; [`atomesh_io::mesh::cells::NO_CELL`] for one that no cell has.
        wells: Vec<u32>,
    },
}

/// A mesh with what belongs to it.
#[derive(Clone, Debug)]
pub struct FlowMesh<const D: usize> {
    /// The cells.
    pub cells: FlowMeshCells<D>,
    /// Fields of the cells.
    pub cell_fields: Vec<OwnedField<f64>>,
    /// The frame of the image that the mesh follows.
    pub frame: Option<Frame<D>>,
    /// The image.
    pub image: Option<Image<D>>,
    /// Where the mesh comes from.
    pub provenance: Option<Provenance>,
    /// The lattice units of the mesh.
    pub units: Units,
    /// Whether z grows upwards in pictures.
    pub z_up: bool,
    /// Facets that pass a feature which is a barrier; none of a mesh as read.
    pub across: Vec<AcrossFeature<D>>,
}

/// A mesh as read, whose dimension the file decides.
pub(super) enum AnyFlowMesh {
    Flat(FlowMesh<2>),
    Volume(FlowMesh<3>),
}

/// Reads triangles or tetrahedra, or else Voronoi cells.
///
/// # Errors
/// [`JobError`] if the file holds neither.
pub(super) fn read(path: &Path, session: &mut Session<'_>) -> Result<AnyFlowMesh, JobError> {
    Ok(match mesh_file::read(path, session)? {
        MeshFile::Flat(mesh) => AnyFlowMesh::Flat(FlowMesh::of_mesh(mesh, Tools::plane())?),
        MeshFile::Volume(mesh) => AnyFlowMesh::Volume(FlowMesh::of_mesh(mesh, Tools::space())?),
        MeshFile::Polygons(cells) => AnyFlowMesh::Flat(FlowMesh::of_cells(cells)),
        MeshFile::Polyhedra(cells) => AnyFlowMesh::Volume(FlowMesh::of_cells(cells)),
    })
}

impl<const D: usize> FlowMesh<D> {
    /// Voronoi cells as read.
    pub fn of_cells(loaded: LoadedCells<D>) -> Self {
        let LoadedCells { mesh, features, fields, frame, provenance, wells, .. } = loaded;
        Self {
            cells: FlowMeshCells::Voronoi { cells: Box::new(mesh), features, wells },
            cell_fields: fields,
            frame: Some(frame),
            image: None,
            provenance: Some(provenance),
            units: Units::Physical,
            z_up: false,
            across: Vec::new(),
        }
    }

    /// Triangles or tetrahedra as read; sides that the file does not name are found.
    ///
    /// # Errors
    /// [`JobError`] if the file's groups of facets do not go with the sides.
    pub fn of_mesh(loaded: LoadedMesh<D>, tools: &Tools<D>) -> Result<Self, JobError> {
        let LoadedMesh { mesh, tags, cell_fields, frame, provenance, .. } = loaded;
        let mesh = mesh_file::oriented(mesh);
        let tags = match tags.facet_group("xmin") {
            Some(_) => tags,
            None => {
                let sides = mesh_file::own_sides(&mesh, frame.as_ref(), tools);
                sides.merge(tags).map_err(JobError::content)?
            }
        };
        Ok(Self {
            cells: FlowMeshCells::Simplices { mesh, tags },
            cell_fields,
            frame,
            image: None,
            provenance,
            units: Units::Physical,
            z_up: false,
            across: Vec::new(),
        })
    }

    /// The mesh of an image, without the image. Wells are atoms if `run` has them among its seed points.
    ///
    /// # Errors
    /// [`JobError`] as [`crate::mesh::mesh()`], and if a well is not in the image.
    pub(super) fn of_prepared(
        run: &RunConfig,
        flow: &FlowOptions,
        prepared: Prepared<D>,
        session: &mut Session<'_>,
    ) -> Result<Self, JobError> {
        check_wells(run, flow, &prepared)?;
        let outcome = meshed(run, prepared, session)?;
        let across = match flow.multiplier < 1.0 {
            true => outcome.across_features(session).map_err(|e| refusal(run, e))?,
            false => Vec::new(),
        };
        let cells = match outcome.world_cells() {
            Some(cells) => {
                let features = outcome.cell_features_from(-flow.below).unwrap_or_default();
                let wells = cells_of_wells(&outcome);
                FlowMeshCells::Voronoi { cells: Box::new(cells), features, wells }
            }
            None => {
                let mesh = outcome.world_mesh();
                let tags = tags(&outcome, &mesh, flow, session);
                let tags = tags.map_err(|e| e.about_any(run.input.shown()))?;
                FlowMeshCells::Simplices { mesh, tags }
            }
        };
        Ok(Self {
            cells,
            cell_fields: Vec::new(),
            frame: Some(*outcome.frame()),
            image: None,
            provenance: Some(run.provenance::<D>()),
            units: outcome.units(),
            z_up: is_z_up(run.input.shown(), outcome.frame()),
            across,
        })
    }

    /// Cells and facets, as the schemes take them.
    pub fn grid(&self, method: &FlowMethod<D>) -> FlowGrid<D> {
        match &self.cells {
            FlowMeshCells::Voronoi { cells, features, .. } => {
                (method.grid_of_cells)(cells, Some(features))
            }
            FlowMeshCells::Simplices { mesh, tags } => (method.grid_of_mesh)(mesh, tags),
        }
    }
}

/// Refuses wells outside the image.
fn check_wells<const D: usize>(
    run: &RunConfig,
    flow: &FlowOptions,
    prepared: &Prepared<D>,
) -> Result<(), JobError> {
    let frame = prepared.frame();
    for (option, well) in flow.wells() {
        let place = frame.world_to_lattice(Units::Samples, &place(option, well)?);
        let last = frame.shape().map(|n| n as f64 - 1.0);
        if (0..D).any(|k| !(-1e-9..=last[k] + 1e-9).contains(&place[k])) {
            return Err(JobError::misuse(format!("--{option} {well} lies outside the image"))
                .about_any(run.input.shown())
                .advise("places are in world coordinates; atomesh info IMAGE shows the box"));
        }
    }
    Ok(())
}

/// Sides, outline, interfaces and features.
fn tags<const D: usize>(
    outcome: &Outcome<D>,
    mesh: &Mesh<D>,
    flow: &FlowOptions,
    session: &mut Session<'_>,
) -> Result<Tags<D>, JobError> {
    let options = FeatureFacetOptions { below: flow.below, ..FeatureFacetOptions::default() };
    let found = outcome
        .features(mesh, &options, session)
        .map_err(|e| if e.is_cancelled() { JobError::cancelled() } else { JobError::content(e) })?;
    let features = found.tags(mesh).map_err(JobError::content)?;
    outcome.tags().and_then(|tags| tags.merge(features)).map_err(JobError::content)
}
