//! Files of polygons and polyhedra: VTU, OpenFOAM's polyMesh, lists of connections, and grids of MODFLOW, PFLOTRAN, TOUGH and OPM.
//!
//! All hold world coordinates, and name cells, faces and points from 0 on in the mesh's order, so that a cell of
//! one file is the cell of that number in the others. Polyhedra of a VTU file stand in another order; its array `cell`
//! has their numbers.

pub(super) mod connections;
mod foam;
mod modflow;
mod raw;
mod read;
mod read_vtu;
mod simulators;
mod table;
mod topology;
mod vtu;

pub use connections::{ConnectionFiles, Flow, write_connections, write_connections_with_flow};
pub use foam::foam_mesh_of;
pub use modflow::{ModflowFiles, Rock, write_modflow};
pub use raw::CellReadError;
pub use read::{AnyCells, LoadedCells, read_cells};
pub use simulators::{MOST_TOUGH_ELEMENTS, Simulator, SimulatorFiles, write_simulator};
pub use vtu::{write_cells_vtu, write_cells_vtu_with};

use std::io::Write;
use std::path::PathBuf;

use atomesh::features::FeatureFaces;
use atomesh::image::Frame;
use atomesh::mesh::PolyMesh;
use atomesh::watch::{Phase, Watch, check};

use super::error::MeshWriteError;
use super::provenance::Provenance;
use crate::atomic_file::AtomicFile;

/// Polygons or polyhedra in world coordinates, with what is known of them.
#[derive(Clone, Copy, Debug)]
pub struct CellData<'a, const D: usize> {
    /// The mesh, in world coordinates.
    pub mesh: &'a PolyMesh<D>,
    /// Which of its faces lie on features of the image.
    pub features: &'a FeatureFaces,
    /// The frame of the image that the mesh follows.
    pub frame: &'a Frame<D>,
    /// Where it comes from.
    pub provenance: &'a Provenance,
}

impl<const D: usize> CellData<'_, D> {
    /// Frame and provenance as JSON, the text that all mesh files carry.
    pub(super) fn metadata(&self) -> String {
        super::metadata::encode(Some(self.frame), Some(self.provenance))
    }
}

/// Writes texts to files. All appear only when all are written.
///
/// # Errors
/// If a file cannot be written, or the watch ends the work.
fn write_texts(texts: &[(&PathBuf, String)], watch: &mut dyn Watch) -> Result<(), MeshWriteError> {
    let mut finished = Vec::new();
    for (n, (path, text)) in texts.iter().enumerate() {
        check(watch, Phase::Write, n as f64 / texts.len() as f64, None)?;
        let mut file = AtomicFile::create(path)?;
        file.write_all(text.as_bytes())?;
        finished.push(file);
    }
    for file in finished {
        file.commit()?;
    }
    Ok(())
}
