//! MODFLOW 6's files of a grid and its permeability: DISV or DISU, NPF, and HFB for barriers.
//!
//! Polygons are one layer of prisms (DISV): the cell's centre is its site, so that MODFLOW's conductance, which goes
//! by the distances of the centres from a face, is the two-point transmissibility times the thickness. Polyhedra
//! are DISU. MODFLOW knows prisms only: between two cells it takes a width times the lesser of their heights.
//! So every polyhedron is written with a height of 1 and the area that makes its volume, all connections lie
//! flat (`ihc` 1) and are as wide as the face is large. Conductances and volumes are then those of the cells; tops and
//! bottoms are not, so the files are for confined flow (`icelltype` 0). In plan (CELL2D) a polyhedron is its outline as
//! seen from above, around its site: pictures and paths of particles take it from there.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use atomesh::mesh::{Connection, PolyMesh, connections};
use atomesh::watch::Watch;

use super::super::error::MeshWriteError;
use super::{CellData, wells_beside, wells_table, write_texts};

/// MODFLOW reads lines of any length; people do not.
const NUMBERS_A_LINE: usize = 8;

/// Where MODFLOW's files go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ModflowFiles {
    /// The grid: NAME.disv or NAME.disu.
    pub grid: PathBuf,
    /// Node property flow: NAME.npf.
    pub npf: PathBuf,
    /// Barriers: NAME.hfb, where there are any.
    pub hfb: Option<PathBuf>,
    /// The cells of wells: NAME-wells.csv, written where there are any.
    pub wells: Option<PathBuf>,
}

impl ModflowFiles {
    /// The files beside that of the grid.
    pub fn of(grid: &Path, has_barriers: bool) -> Self {
        Self {
            grid: grid.into(),
            npf: grid.with_extension("npf"),
            hfb: has_barriers.then(|| grid.with_extension("hfb")),
            wells: Some(wells_beside(grid)),
        }
    }

    /// All of them.
    pub fn paths(&self) -> Vec<&Path> {
        let all = [Some(&self.grid), Some(&self.npf), self.hfb.as_ref(), self.wells.as_ref()];
        all.into_iter().flatten().map(PathBuf::as_path).collect()
    }
}

/// What MODFLOW needs besides the cells.
#[derive(Clone, Copy, Debug)]
pub struct Rock<'a> {
    /// Permeability (MODFLOW: hydraulic conductivity) of each cell.
    pub permeability: &'a [f64],
    /// The multiplier of each face between two cells.
    pub multipliers: &'a [f64],
    /// The top of the layer of polygons; not of polyhedra.
    pub top: f64,
    /// Its thickness.
    pub thickness: f64,
}

/// Writes polygons as DISV, polyhedra as DISU. All files appear only when all are written.
///
/// # Errors
/// If a file cannot be written, or the watch ends the work.
pub fn write_modflow<const D: usize>(
    files: &ModflowFiles,
    data: &CellData<D>,
    rock: &Rock,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let faces = connections(data.mesh);
    let grid = if D == 2 { disv(data.mesh, rock) } else { disu(data.mesh, &faces) };
    let mut texts = vec![(&files.grid, grid), (&files.npf, npf(rock, D))];
    if let Some(path) = &files.hfb {
        texts.push((path, hfb(&faces, rock, D)));
    }
    let wells = wells_table(data, |cell| (cell + 1).to_string());
    texts.extend(files.wells.as_ref().zip(wells));
    write_texts(&texts, watch)
}

/// Appends a block.
fn block(text: &mut String, name: &str, lines: &str) {
    let _ = write!(text, "BEGIN {name}\n{lines}END {name}\n\n");
}

/// Appends an array: one number if all are the same.
fn array<T: PartialEq + std::fmt::Debug>(text: &mut String, name: &str, values: &[T]) {
    let _ = writeln!(text, "  {name}");
    match values.first() {
        Some(first) if values.iter().all(|value| value == first) => {
            let _ = writeln!(text, "    CONSTANT {first:?}");
        }
        _ => {
            text.push_str("    INTERNAL FACTOR 1\n");
            for line in values.chunks(NUMBERS_A_LINE) {
                text.push_str("     ");
                line.iter().for_each(|value| {
                    let _ = write!(text, " {value:?}");
                });
                text.push('\n');
            }
        }
    }
}

fn disv<const D: usize>(mesh: &PolyMesh<D>, rock: &Rock) -> String {
    let mut text = "# one layer of Voronoi cells, written by atomesh\n".to_string();
    let (cells, points) = (mesh.cell_count(), mesh.points().len());
    block(&mut text, "DIMENSIONS", &format!("  NLAY 1\n  NCPL {cells}\n  NVERT {points}\n"));
    let mut lines = String::new();
    array(&mut lines, "TOP", &vec![rock.top; cells]);
    array(&mut lines, "BOTM", &vec![rock.top - rock.thickness; cells]);
    array(&mut lines, "IDOMAIN", &vec![1; cells]);
    block(&mut text, "GRIDDATA", &lines);
    plan(&mut text, mesh, clockwise);
    text
}

/// Appends the points and each cell in the plane, by its site and the points around it.
fn plan<const D: usize>(
    text: &mut String,
    mesh: &PolyMesh<D>,
    around: fn(&PolyMesh<D>, usize) -> Vec<u32>,
) {
    let mut lines = String::new();
    for (number, point) in mesh.points().iter().enumerate() {
        let _ = writeln!(lines, "  {} {:?} {:?}", number + 1, point[0], point[1]);
    }
    block(text, "VERTICES", &lines);
    lines.clear();
    for (cell, site) in mesh.centers().iter().enumerate() {
        let around = around(mesh, cell);
        let _ = write!(lines, "  {} {:?} {:?} {}", cell + 1, site[0], site[1], around.len());
        for corner in around {
            let _ = write!(lines, " {}", corner + 1);
        }
        lines.push('\n');
    }
    block(text, "CELL2D", &lines);
}

/// A cell's points, clockwise with y up, as MODFLOW asks.
fn clockwise<const D: usize>(mesh: &PolyMesh<D>, cell: usize) -> Vec<u32> {
    let mut around = mesh.polygon(cell);
    let place = |at: usize| &mesh.points()[around[at % around.len()] as usize];
    let twice: f64 = (0..around.len())
        .map(|at| place(at)[0] * place(at + 1)[1] - place(at)[1] * place(at + 1)[0])
        .sum();
    if twice > 0.0 {
        around.reverse();
    }
    around
}

fn disu<const D: usize>(mesh: &PolyMesh<D>, faces: &[Connection<D>]) -> String {
    let cells = mesh.cell_count();
    // the neighbours of each cell, with the distance of its own site from the face
    let mut beside: Vec<Vec<(u32, f64, f64)>> = vec![Vec::new(); cells];
    for face in faces {
        let [a, b] = face.cells;
        beside[a as usize].push((b, face.distances[0], face.area));
        beside[b as usize].push((a, face.distances[1], face.area));
    }
    let (mut iac, mut ja, mut ihc, mut cl12, mut hwva) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (cell, own) in beside.iter_mut().enumerate() {
        own.sort_by_key(|entry| entry.0);
        iac.push(own.len() + 1);
        ja.push(cell + 1);
        ihc.push(1);
        cl12.push(0.0);
        hwva.push(0.0);
        for &(other, distance, area) in own.iter() {
            ja.push(other as usize + 1);
            ihc.push(1);
            cl12.push(distance);
            hwva.push(area);
        }
    }
    let mut text = "# Voronoi cells, each with a height of 1 and the area that makes its volume; \
                    written by atomesh\n"
        .to_string();
    let (links, points) = (ja.len(), mesh.points().len());
    block(&mut text, "DIMENSIONS", &format!("  NODES {cells}\n  NJA {links}\n  NVERT {points}\n"));
    let mut lines = String::new();
    let height = |site: &[f64; D], by: f64| site[D - 1] + by;
    array(&mut lines, "TOP", &mesh.centers().iter().map(|s| height(s, 0.5)).collect::<Vec<_>>());
    array(&mut lines, "BOT", &mesh.centers().iter().map(|s| height(s, -0.5)).collect::<Vec<_>>());
    array(&mut lines, "AREA", mesh.measures());
    block(&mut text, "GRIDDATA", &lines);
    lines.clear();
    array(&mut lines, "IAC", &iac);
    array(&mut lines, "JA", &ja);
    array(&mut lines, "IHC", &ihc);
    array(&mut lines, "CL12", &cl12);
    array(&mut lines, "HWVA", &hwva);
    block(&mut text, "CONNECTIONDATA", &lines);
    plan(&mut text, mesh, outline);
    text
}

/// The points of a cell's outline as seen from above, clockwise with y up: the hull of its points in the plane (Andrew's
/// monotone chain), since the cell is convex.
fn outline<const D: usize>(mesh: &PolyMesh<D>, cell: usize) -> Vec<u32> {
    let place = |point: u32| {
        let p = mesh.points()[point as usize];
        [p[0], p[1]]
    };
    let mut points: Vec<u32> =
        mesh.faces_of(cell).flat_map(|(face, _)| mesh.face(face)).copied().collect();
    points.sort_unstable_by(|&a, &b| {
        let [p, q] = [place(a), place(b)];
        p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])).then(a.cmp(&b))
    });
    points.dedup_by(|a, b| place(*a) == place(*b));
    let half = |order: &mut dyn Iterator<Item = u32>| {
        let mut chain: Vec<u32> = Vec::new();
        for point in order {
            let turns = |chain: &[u32]| {
                let [.., a, b] = *chain else { return true };
                let ([a, b], c) = ([a, b].map(place), place(point));
                (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) < 0.0
            };
            while !turns(&chain) {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop(); // the other half begins with it
        chain
    };
    let mut around = half(&mut points.iter().copied());
    around.extend(half(&mut points.iter().rev().copied()));
    around
}

fn npf(rock: &Rock, _dimension: usize) -> String {
    let mut text = "# permeability, written by atomesh\n".to_string();
    let mut lines = String::new();
    array(&mut lines, "ICELLTYPE", &vec![0; rock.permeability.len()]);
    array(&mut lines, "K", rock.permeability);
    block(&mut text, "GRIDDATA", &lines);
    text
}

/// A hydraulic characteristic below 0 multiplies the conductance by its magnitude; 0 seals.
fn hfb<const D: usize>(faces: &[Connection<D>], rock: &Rock, dimension: usize) -> String {
    let hindered: Vec<_> =
        faces.iter().zip(rock.multipliers).filter(|(_, multiplier)| **multiplier < 1.0).collect();
    let mut text = "# barriers, written by atomesh\n".to_string();
    block(&mut text, "DIMENSIONS", &format!("  MAXHFB {}\n", hindered.len()));
    let mut lines = String::new();
    // cells of DISV are named by layer and number
    let layer = if dimension == 2 { "1 " } else { "" };
    for (face, multiplier) in hindered {
        let [a, b] = face.cells.map(|cell| cell + 1);
        let _ = writeln!(lines, "  {layer}{a} {layer}{b} {:?}", 0.0 - multiplier);
    }
    block(&mut text, "PERIOD 1", &lines);
    text.replace("END PERIOD 1", "END PERIOD")
}
