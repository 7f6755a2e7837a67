//! `atomesh export`: Voronoi cells for other flow simulators.

use std::path::{Path, PathBuf};

use atomesh::mesh::PolyMesh;
use atomesh_flow::two_point::transmissibilities;
use atomesh_flow::{FlowError, Grid, Permeability, Problem, Setting};
use atomesh_io::mesh::MeshWriteError;
use atomesh_io::mesh::cells::{
    AnyCells, CellData, CellReadError, ConnectionFiles, Flow, LoadedCells, ModflowFiles, Rock,
    read_cells, write_connections_with_flow, write_modflow,
};

use super::flow::wells::BarrierSpec;
use crate::failure::Failure;
use crate::outputs::{Places, check_writable, unknown_ending};
use crate::progress::{Progress, writing};
use crate::values::number_in;

/// Write Voronoi cells for other flow simulators: connections with transmissibilities, or MODFLOW 6 grids
///
/// The transmissibility of a face of area A between two cells is m · A / (d₁/k₁ + d₂/k₂): d the distances of the
/// sites from it, k the permeabilities, m the multiplier of a barrier that it lies on. Faces of Voronoi cells stand
/// at right angles to the lines between sites, so this is exact for linear pressures and isotropic k; triangles
/// and tetrahedra are refused, since for them it is not.
///
/// A list of connections (.json) is NAME.json and NAME-cells.csv, NAME-connections.csv, NAME-boundary.csv beside it.
/// MODFLOW's grid is .disv for polygons, one layer of prisms, and .disu for polyhedra, with the permeability in
/// NAME.npf and barriers in NAME.hfb beside it. Polyhedra have a height of 1 in a .disu file and the area that makes
/// their volume: conductances and volumes are right for confined flow, tops and bottoms mean nothing.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  Cells and connections with transmissibilities, feature 1 sealed, feature 2 nearly so:
    atomesh mesh faults.png -o cells.vtu --mesh voronoi --connections cells.json
    atomesh export cells.json -o flow.json --permeability 2.5 --barrier feature-1=0 \\
      --barrier feature-2=0.01
  A layer 10 thick for MODFLOW 6, with permeability from a field of the cells:
    atomesh export cells.vtu -o layer.disv --permeability k --thickness 10")]
pub struct ExportArgs {
    /// Voronoi cells that atomesh wrote: .vtu, or .json (a list of connections, which also names features)
    #[arg(value_name = "CELLS")]
    cells: PathBuf,
    /// File to write: .json (connections), .disv (MODFLOW 6, polygons), .disu (MODFLOW 6, polyhedra)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Permeability: a number above 0, or the name of a field of the cells
    #[arg(long, value_name = "VALUE|NAME", default_value = "1")]
    permeability: String,
    /// What share of the flow a feature lets through, 0 (sealed) to 1. May be given many times
    #[arg(long, value_name = "NAME=M")]
    barrier: Vec<BarrierSpec>,
    /// Thickness of the layer of polygons (.disv)
    #[arg(long, value_name = "LENGTH", default_value = "1",
        value_parser = number_in(f64::MIN_POSITIVE, f64::MAX, "a number above 0"))]
    thickness: f64,
    /// Height of the layer's top (.disv)
    #[arg(long, value_name = "HEIGHT", default_value = "0", allow_hyphen_values = true,
        value_parser = number_in(f64::MIN, f64::MAX, "a finite number"))]
    top: f64,
}

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Connections,
    Disv,
    Disu,
}

impl Format {
    fn of(path: &Path) -> Result<Self, Failure> {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        match extension.to_str() {
            Some("json") => Ok(Self::Connections),
            Some("disv") => Ok(Self::Disv),
            Some("disu") => Ok(Self::Disu),
            _ => Err(unknown_ending(path, ".json (connections), .disv, .disu (MODFLOW 6)")),
        }
    }
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`Failure`] if a file cannot be used, options make no sense, or the user ends the work.
pub fn run(args: &ExportArgs, watch: &mut Progress) -> Result<String, Failure> {
    let format = Format::of(&args.output)?;
    let mut places = Places::taken([args.cells.as_path()]);
    {
        let _guard = writing();
        for path in paths(args, format) {
            places.take(&path)?;
            check_writable(&path)?;
        }
    }
    let read = read_cells(&args.cells, watch).map_err(|e| read_failure(e, &args.cells))?;
    match (read, format) {
        (AnyCells::Flat(_), Format::Disu) => {
            let message = "holds polygons; expected a file to write that ends in .disv";
            Err(Failure::misuse(message).about(&args.cells))
        }
        (AnyCells::Volume(_), Format::Disv) => {
            let message = "holds polyhedra; expected a file to write that ends in .disu";
            Err(Failure::misuse(message).about(&args.cells))
        }
        (AnyCells::Flat(cells), _) => export(args, format, &cells, watch),
        (AnyCells::Volume(cells), _) => export(args, format, &cells, watch),
    }
}

fn paths(args: &ExportArgs, format: Format) -> Vec<PathBuf> {
    if format == Format::Connections {
        return ConnectionFiles::of(&args.output).paths().map(Path::to_path_buf).to_vec();
    }
    let files = ModflowFiles::of(&args.output, !args.barrier.is_empty());
    files.paths().into_iter().map(Path::to_path_buf).collect()
}

fn read_failure(error: CellReadError, path: &Path) -> Failure {
    match error {
        CellReadError::Cancelled(_) => Failure::cancelled(),
        CellReadError::Format => Failure::misuse(error).about(path),
        CellReadError::Io { error, .. } => {
            Failure::content(format!("cannot be read: {error}")).about(path)
        }
        CellReadError::Mesh(_) | CellReadError::NotVoronoi { .. } => Failure::content(error)
            .about(path)
            .advise("`atomesh mesh IMAGE -o CELLS.vtu --mesh voronoi` makes Voronoi cells"),
        _ => Failure::content(error).about(path),
    }
}

fn export<const D: usize>(
    args: &ExportArgs,
    format: Format,
    cells: &LoadedCells<D>,
    watch: &mut Progress,
) -> Result<String, Failure> {
    let grid = Grid::of_cells(&cells.mesh, Some(&cells.features));
    let barriers = args.barrier.iter().map(BarrierSpec::barrier).collect();
    let permeability = permeability(args, cells)?;
    let problem = Problem { permeability, barriers, ..Problem::default() };
    let failure = |e: FlowError| flow_failure(e, args);
    let setting = Setting::new(&problem, &grid).map_err(failure)?;
    let multipliers = setting.multipliers();
    let found =
        transmissibilities(&cells.mesh, setting.permeability(), multipliers).map_err(failure)?;
    let k: Vec<f64> = (0..cells.mesh.cell_count())
        .map(|cell| problem.permeability.scalar(cell).expect("it is no tensor"))
        .collect();
    let (frame, provenance) = (&cells.frame, &cells.provenance);
    let data = CellData { mesh: &cells.mesh, features: &cells.features, frame, provenance };
    let _guard = writing();
    let written = if format == Format::Connections {
        let flow = Flow { permeability: &k, transmissibilities: &found };
        write_connections_with_flow(&ConnectionFiles::of(&args.output), &data, flow, watch)
    } else {
        let (top, thickness) = (args.top, args.thickness);
        let rock = Rock { permeability: &k, multipliers, top, thickness };
        let files = ModflowFiles::of(&args.output, !args.barrier.is_empty());
        write_modflow(&files, &data, &rock, watch)
    };
    written.map_err(|e| match e {
        MeshWriteError::Cancelled(_) => Failure::cancelled(),
        _ => Failure::content(e).about(&args.output),
    })?;
    watch.say(&summary(args, &cells.mesh, &found, multipliers));
    Ok(String::new())
}

fn summary<const D: usize>(
    args: &ExportArgs,
    mesh: &PolyMesh<D>,
    transmissibilities: &[f64],
    multipliers: &[f64],
) -> String {
    let sealed = multipliers.iter().filter(|multiplier| **multiplier == 0.0).count();
    let open = transmissibilities.iter().copied().filter(|t| *t > 0.0);
    let (least, most) = open.fold((f64::INFINITY, 0.0_f64), |(l, m), t| (l.min(t), m.max(t)));
    let (path, cells) = (args.output.display(), mesh.cell_count());
    let faces = mesh.inner_face_count();
    format!(
        "{path}: {cells} cells, {faces} connections, {sealed} of them sealed; transmissibilities \
         {least:.3e} to {most:.3e}"
    )
}

/// A number, or the field of the cells that is called so.
fn permeability<const D: usize>(
    args: &ExportArgs,
    cells: &LoadedCells<D>,
) -> Result<Permeability<D>, Failure> {
    let text = &args.permeability;
    if let Some(field) = cells.fields.iter().find(|field| &field.name == text) {
        let k = Permeability::Cells(field.values.clone());
        let checked = k.check(cells.mesh.cell_count());
        checked.map_err(|e| Failure::content(e).about(&args.cells))?;
        return Ok(k);
    }
    match text.parse::<f64>() {
        Ok(k) if k > 0.0 && k.is_finite() => Ok(Permeability::Uniform(k)),
        Ok(k) => Err(Failure::misuse(format!("--permeability {k}: expected a number above 0"))),
        Err(_) => {
            let names: Vec<&str> = cells.fields.iter().map(|field| field.name.as_str()).collect();
            let names = if names.is_empty() { "none".to_string() } else { names.join(", ") };
            let message =
                format!("the cells have no field {text:?}; known are {names}, or a number above 0");
            Err(Failure::misuse(message).about(&args.cells))
        }
    }
}

fn flow_failure(error: FlowError, args: &ExportArgs) -> Failure {
    match error {
        FlowError::Cancelled(_) => Failure::cancelled(),
        FlowError::Group { .. } => Failure::misuse(error)
            .about(&args.cells)
            .advise("features are named in a list of connections (.json), not in a .vtu file"),
        FlowError::Place { .. } => Failure::misuse(error).about(&args.cells),
        _ => Failure::content(error).about(&args.cells),
    }
}
