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

use std::fmt::Write as _;
use std::io::Write;
use std::path::{Path, PathBuf};

use atomesh::features::FeatureFaces;
use atomesh::image::Frame;
use atomesh::mesh::{PolyMesh, well_name};
use atomesh::watch::{Phase, Watch, check};

use self::connections::{put, table_beside, vector};
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
    /// The cell of each well, in their order; [`NO_CELL`] for one that no cell has.
    pub wells: &'a [u32],
}

/// In place of the cell of a well that has none.
pub const NO_CELL: u32 = u32::MAX;

/// The array, and the column of tables, of the number of the well in each cell, from 1 on; 0 for none.
const WELL: &str = "well";

impl<const D: usize> CellData<'_, D> {
    /// The number of the well in each cell, from 1 on; empty if there are no wells.
    fn well_of_cells(&self) -> Vec<u32> {
        if self.wells.is_empty() {
            return Vec::new();
        }
        let mut wells = vec![0; self.mesh.cell_count()];
        for (number, &cell) in self.wells.iter().enumerate().rev() {
            if let Some(well) = wells.get_mut(cell as usize) {
                *well = number as u32 + 1;
            }
        }
        wells
    }

    /// Frame and provenance as JSON, the text that all mesh files carry.
    pub(super) fn metadata(&self) -> String {
        super::metadata::encode(Some(self.frame), Some(self.provenance))
    }
}

/// The table NAME-wells.csv beside a grid, for formats that have no room for wells.
fn wells_beside(grid: &Path) -> PathBuf {
    table_beside(grid, "wells")
}

/// The wells that cells have: name, cell, as the grid's format calls it, and place; nothing where there are none.
fn wells_table<const D: usize>(
    data: &CellData<D>,
    name_of: impl Fn(usize) -> String,
) -> Option<String> {
    let known = || data.wells.iter().zip(1..).filter(|(cell, _)| **cell != NO_CELL);
    known().next()?;
    let mut text = format!("well,cell,{}\n", vector::<D>("site"));
    for (&cell, number) in known() {
        let _ = write!(text, "{},{}", well_name(number), name_of(cell as usize));
        put(&mut text, &data.mesh.centers()[cell as usize]);
        text.push('\n');
    }
    Some(text)
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
