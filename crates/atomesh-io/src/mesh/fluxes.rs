//! The flux through each facet, as a CSV table with a JSON header.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use atomesh::image::Frame;
use atomesh::watch::{Phase, Watch, check};
use serde_json::json;

use super::cells::connections::{put, table_beside, vector};
use super::error::MeshWriteError;
use super::metadata;
use super::provenance::Provenance;
use crate::atomic_file::AtomicFile;

/// Facets between two looks at the watch.
const FACETS_PER_STEP: usize = 1 << 16;

/// A facet and what flows through it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacetFlux<'a, const D: usize> {
    /// The cell that the flux leaves.
    pub cell: u32,
    /// The cell that it enters, or `None` on the boundary.
    pub neighbour: Option<u32>,
    /// The facet's centroid, in world coordinates.
    pub centroid: [f64; D],
    /// The normal out of `cell`, as long as the facet is large.
    pub area: [f64; D],
    /// What flows out of `cell` in a unit of time.
    pub flux: f64,
    /// The share that the facet lets through: 0 where it is sealed, 1 where it is no barrier.
    pub multiplier: f64,
    /// The name of a group that the facet is in, such as a feature or a side; empty for none.
    pub group: &'a str,
}

/// The facets of a mesh, in its order, with what is known of where they come from.
#[derive(Clone, Copy, Debug)]
pub struct FluxTable<'a, const D: usize> {
    /// The facets.
    pub facets: &'a [FacetFlux<'a, D>],
    /// The frame of the image that the mesh follows.
    pub frame: Option<&'a Frame<D>>,
    /// Where it comes from.
    pub provenance: Option<&'a Provenance>,
}

/// Where a table of fluxes goes: a head, and the table beside it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FluxFiles {
    /// The head, as JSON.
    pub head: PathBuf,
    /// The table, as CSV.
    pub facets: PathBuf,
}

impl FluxFiles {
    /// The files for the head `NAME.json`: NAME-facets.csv beside it.
    pub fn of(head: &Path) -> Self {
        Self { head: head.into(), facets: table_beside(head, "facets") }
    }

    /// Both of them.
    pub fn paths(&self) -> [&Path; 2] {
        [&self.head, &self.facets]
    }
}

/// Writes the table and its head. Both appear only when both are written.
///
/// # Errors
/// If a file cannot be written, or the watch ends the work.
pub fn write_fluxes<const D: usize>(
    files: &FluxFiles,
    table: &FluxTable<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let mut rows = AtomicFile::create(&files.facets)?;
    let (normal, centroid) = (vector::<D>("normal"), vector::<D>("face"));
    let columns = "flux,multiplier,group";
    writeln!(rows, "facet,cell,neighbour,area,{normal},{centroid},{columns}")?;
    let count = table.facets.len();
    for (block, facets) in table.facets.chunks(FACETS_PER_STEP).enumerate() {
        let first = block * FACETS_PER_STEP;
        check(watch, Phase::Write, first as f64 / count as f64, None)?;
        let mut text = String::new();
        facets.iter().enumerate().for_each(|(i, facet)| row(&mut text, first + i, facet));
        rows.write_all(text.as_bytes())?;
    }
    let mut head = AtomicFile::create(&files.head)?;
    head.write_all(head_text(files, table).as_bytes())?;
    check(watch, Phase::Write, 1.0, None)?;
    let committed: io::Result<Vec<()>> = [rows, head].into_iter().map(AtomicFile::commit).collect();
    committed?;
    Ok(())
}

fn row<const D: usize>(text: &mut String, number: usize, facet: &FacetFlux<D>) {
    let neighbour = facet.neighbour.map_or(-1, i64::from);
    let _ = write!(text, "{number},{},{neighbour}", facet.cell);
    let area = facet.area.iter().map(|x| x * x).sum::<f64>().sqrt();
    put(text, &[area]);
    put(text, &facet.area.map(|x| if area > 0.0 { x / area } else { 0.0 }));
    put(text, &facet.centroid);
    put(text, &[facet.flux, facet.multiplier]);
    let _ = writeln!(text, ",{}", quoted(facet.group));
}

/// A name as CSV has it: in quotes where it holds what would end it.
fn quoted(name: &str) -> String {
    match name.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_owned(),
    }
}

fn head_text<const D: usize>(files: &FluxFiles, table: &FluxTable<D>) -> String {
    let name = files.facets.file_name().unwrap_or_default().to_string_lossy();
    let metadata = metadata::encode(table.frame, table.provenance);
    let metadata: serde_json::Value = serde_json::from_str(&metadata).unwrap_or_default();
    let area = if D == 2 { "length" } else { "area" };
    let text = json!({
        "format": "atomesh fluxes",
        "format_version": 1,
        "dimension": D,
        "units": "world units of the frame; fluxes in those of permeability, pressure and length",
        "facets": { "file": name, "count": table.facets.len(), "numbered_from": 0 },
        "columns": {
            "cell": "the cell that the flux leaves where it is above 0",
            "neighbour": "the cell on the other side; -1 on the boundary",
            "area": format!("the facet's {area}"),
            "normal": "unit normal, out of the cell",
            "face": "the facet's centroid",
            "flux": "what flows out of the cell in a unit of time",
            "multiplier": "the share that the facet lets through: 0 sealed, 1 no barrier",
            "group": "a group that the facet is in, such as a feature or a side of the box; empty for none",
        },
        "metadata": metadata,
    });
    format!("{text:#}\n")
}
