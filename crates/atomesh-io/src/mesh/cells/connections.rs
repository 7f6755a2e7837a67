//! The list of connections that flow simulators read: three tables as CSV and a head as JSON.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use atomesh::mesh::{boundary_connections, connections, feature_name, side_name};
use atomesh::watch::{Phase, Watch, check};
use serde_json::json;

use super::super::error::MeshWriteError;
use super::{CellData, WELL};
use crate::atomic_file::AtomicFile;

/// Where a list of connections goes: a head, and three tables beside it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConnectionFiles {
    /// The head, as JSON.
    pub head: PathBuf,
    /// The cells.
    pub cells: PathBuf,
    /// The faces between two cells.
    pub connections: PathBuf,
    /// The faces on the sides of the box.
    pub boundary: PathBuf,
}

impl ConnectionFiles {
    /// The files for the head `NAME.json`: NAME-cells.csv, NAME-connections.csv and NAME-boundary.csv beside it.
    pub fn of(head: &Path) -> Self {
        let table = |name: &str| table_beside(head, name);
        Self {
            head: head.into(),
            cells: table("cells"),
            connections: table("connections"),
            boundary: table("boundary"),
        }
    }

    /// All of them.
    pub fn paths(&self) -> [&Path; 4] {
        [&self.head, &self.cells, &self.connections, &self.boundary]
    }
}

/// The file NAME-table.csv beside the head NAME.json.
pub(in super::super) fn table_beside(head: &Path, table: &str) -> PathBuf {
    let mut name = head.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{table}.csv"));
    head.with_file_name(name)
}

/// How much flows, for the lists that say it.
#[derive(Clone, Copy, Debug)]
pub struct Flow<'a> {
    /// The permeability of each cell.
    pub permeability: &'a [f64],
    /// The transmissibility of each face between two cells.
    pub transmissibilities: &'a [f64],
}

/// A list being written.
struct List<'a, const D: usize> {
    data: &'a CellData<'a, D>,
    flow: Option<Flow<'a>>,
    files: &'a ConnectionFiles,
}

/// Writes the list. All files appear only when all are written.
///
/// # Errors
/// If a file cannot be written, or the watch ends the work.
pub fn write_connections<const D: usize>(
    files: &ConnectionFiles,
    data: &CellData<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    write_list(&List { data, flow: None, files }, watch)
}

/// Writes the list with permeability and transmissibilities, each in a last column.
///
/// # Errors
/// If a file cannot be written, or the watch ends the work.
pub fn write_connections_with_flow<const D: usize>(
    files: &ConnectionFiles,
    data: &CellData<D>,
    flow: Flow,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    write_list(&List { data, flow: Some(flow), files }, watch)
}

fn write_list<const D: usize>(list: &List<D>, watch: &mut dyn Watch) -> Result<(), MeshWriteError> {
    let mut finished = Vec::new();
    let texts: [fn(&List<D>) -> String; 4] = [head, cells, inner, boundary];
    for (n, (path, text)) in list.files.paths().into_iter().zip(texts).enumerate() {
        check(watch, Phase::Write, n as f64 / 4.0, None)?;
        let mut file = AtomicFile::create(path)?;
        file.write_all(text(list).as_bytes())?;
        finished.push(file);
    }
    let committed: io::Result<Vec<()>> = finished.into_iter().map(AtomicFile::commit).collect();
    committed?;
    Ok(())
}

/// The names of the axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// The names of a vector's components.
pub(in super::super) fn vector<const D: usize>(name: &str) -> String {
    AXES[..D].iter().map(|axis| format!("{name}_{axis}")).collect::<Vec<_>>().join(",")
}

/// Appends numbers, each with as many digits as tell it from all others.
pub(in super::super) fn put(text: &mut String, numbers: &[f64]) {
    for number in numbers {
        let _ = write!(text, ",{number:?}");
    }
}

/// The name of a column that a list with flow has, after a comma.
fn column<const D: usize>(list: &List<D>, name: &str) -> String {
    list.flow.map_or_else(String::new, |_| format!(",{name}"))
}

fn cells<const D: usize>(list: &List<D>) -> String {
    let mesh = list.data.mesh;
    let mut more = column(list, "permeability");
    let wells = list.data.well_of_cells();
    if !wells.is_empty() {
        let _ = write!(more, ",{WELL}");
    }
    let mut text = format!("cell,{},volume,{}{more}\n", vector::<D>("site"), vector::<D>("center"));
    for cell in 0..mesh.cell_count() {
        let _ = write!(text, "{cell}");
        put(&mut text, &mesh.centers()[cell]);
        put(&mut text, &[mesh.measures()[cell]]);
        put(&mut text, &mesh.centroids()[cell]);
        put(&mut text, list.flow.map_or(&[], |flow| &flow.permeability[cell..=cell]));
        if let Some(well) = wells.get(cell) {
            let _ = write!(text, ",{well}");
        }
        text.push('\n');
    }
    text
}

fn inner<const D: usize>(list: &List<D>) -> String {
    let more = column(list, "transmissibility");
    let (normal, face) = (vector::<D>("normal"), vector::<D>("face"));
    let mut text = format!(
        "cell_i,cell_j,area,distance_i,distance_j,{normal},{face},geometry,orthogonality,feature{more}\n"
    );
    let faces = connections(list.data.mesh);
    for (face, (connection, feature)) in faces.iter().zip(&list.data.features.of_faces).enumerate()
    {
        let _ = write!(text, "{},{}", connection.cells[0], connection.cells[1]);
        put(&mut text, &[connection.area]);
        put(&mut text, &connection.distances);
        put(&mut text, &connection.normal);
        put(&mut text, &connection.centroid);
        put(&mut text, &[connection.geometry(), connection.orthogonality]);
        let _ = write!(text, ",{feature}");
        put(&mut text, list.flow.map_or(&[], |flow| &flow.transmissibilities[face..=face]));
        text.push('\n');
    }
    text
}

fn boundary<const D: usize>(list: &List<D>) -> String {
    let more = column(list, "transmissibility");
    let (normal, face) = (vector::<D>("normal"), vector::<D>("face"));
    let mut text = format!("cell,side,area,distance,{normal},{face}{more}\n");
    for side in boundary_connections(list.data.mesh) {
        let _ = write!(text, "{},{}", side.cell, side_name(side.side));
        put(&mut text, &[side.area, side.distance]);
        put(&mut text, &side.normal);
        put(&mut text, &side.centroid);
        match list.flow {
            // the site is the side
            Some(_) if side.distance == 0.0 => text.push(','),
            Some(flow) => {
                let k = flow.permeability[side.cell as usize];
                put(&mut text, &[k * side.area / side.distance]);
            }
            None => {}
        }
        text.push('\n');
    }
    text
}

fn head<const D: usize>(list: &List<D>) -> String {
    let (data, files) = (list.data, list.files);
    let mesh = data.mesh;
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let measure = if D == 2 { "area" } else { "volume" };
    let area = if D == 2 { "length" } else { "area" };
    let metadata: serde_json::Value = serde_json::from_str(&data.metadata()).unwrap_or_default();
    let features: Vec<_> = (data.features.areas.iter().enumerate())
        .map(|(n, area)| json!({ "id": n + 1, "name": feature_name(n as u32 + 1), "area": area }))
        .collect();
    let mut text = json!({
        "format": "atomesh connections",
        "format_version": 1,
        "dimension": D,
        "units": "world units of the frame, lengths, areas and volumes alike",
        "cells": { "file": name(&files.cells), "count": mesh.cell_count(), "numbered_from": 0 },
        "connections": { "file": name(&files.connections), "count": mesh.inner_face_count() },
        "boundary": {
            "file": name(&files.boundary),
            "count": mesh.face_count() - mesh.inner_face_count(),
            "sides": (0..2 * D).map(side_name).collect::<Vec<_>>(),
        },
        "columns": {
            "site": "the point whose nearest points are the cell; on the cell's border at a side of the box",
            "volume": format!("the cell's {measure}"),
            "center": "the cell's centroid",
            "area": format!("the face's {area}"),
            "distance_i, distance_j": "from each site to the plane of the face; distance: 0 where a site lies on the side",
            "normal": "unit normal, from cell_i to cell_j, or out of the box",
            "face": "the face's centroid",
            "geometry": "area / (distance_i + distance_j): transmissibility over permeability where both cells have the same; with k_i and k_j it is area / (distance_i/k_i + distance_j/k_j)",
            "orthogonality": "cosine of the angle between normal and the line from site to site; 1 unless the frame stretches the lattice",
            "feature": "the feature that the face lies on, from 1 on; 0 for none",
        },
        "features": features,
        "metadata": metadata,
    });
    if !data.wells.is_empty() {
        text["columns"][WELL] = "the number of the well in the cell, from 1 on; 0 for none".into();
    }
    if list.flow.is_some() {
        text["columns"]["permeability"] = "k of the cell".into();
        text["columns"]["transmissibility"] = "what flows for a unit of pressure: multiplier · area / (distance_i/k_i + distance_j/k_j), k · area / distance to a side; nothing where a site lies on the side, whose pressure is then the cell's".into();
    }
    format!("{text:#}\n")
}
