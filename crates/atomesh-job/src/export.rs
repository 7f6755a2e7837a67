//! Voronoi cells for other flow simulators.

use std::path::{Path, PathBuf};

use atomesh_flow::{FlowError, Problem};
use atomesh_io::mesh::cells::{
    AnyCells, CellData, ConnectionFiles, Flow, LoadedCells, MOST_TOUGH_ELEMENTS, ModflowFiles,
    Rock, Simulator, SimulatorFiles, read_cells,
};
use atomesh_io::output_group::OutputGroup;

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::files::{self, unknown_extension};
use crate::mesh::staged_list;
use crate::mesh_file;
use crate::permeability;
use crate::session::{Note, NoteKind, Session};
use crate::values::BarrierSpec;
#[cfg(feature = "clap")]
use crate::values::number_in;

/// Voronoi cells, what flows through them, and where they go.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct ExportRequest {
    /// Voronoi cells that atomesh wrote: .vtu, or .json (a list of connections)
    #[cfg_attr(feature = "clap", arg(value_name = "CELLS"))]
    pub cells: PathBuf,
    /// File to write: .json (connections), .disv (MODFLOW 6, polygons), .disu (MODFLOW 6, polyhedra), .uge (PFLOTRAN,
    /// explicit unstructured grid), .tough (TOUGH's file MESH), .opm (OPM's text of a grid)
    #[cfg_attr(feature = "clap", arg(short, long, value_name = "FILE"))]
    pub output: PathBuf,
    /// Permeability: a number above 0, or the name of a field of the cells
    #[cfg_attr(feature = "clap", arg(long, value_name = "VALUE|NAME", default_value_t = Self::default().permeability))]
    pub permeability: String,
    /// Share of the flow that a feature lets through, 0 (sealed) to 1 (open). May be given many times
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME=M"))]
    pub barrier: Vec<BarrierSpec>,
    /// Thickness of the layer of polygons
    #[cfg_attr(feature = "clap", arg(long, value_name = "LENGTH", default_value_t = Self::default().thickness,
        value_parser = number_in(f64::MIN_POSITIVE, f64::MAX, "a number above 0")))]
    pub thickness: f64,
    /// Height of the layer's top
    #[cfg_attr(feature = "clap", arg(long, value_name = "HEIGHT", default_value_t = Self::default().top,
        allow_hyphen_values = true, value_parser = number_in(f64::MIN, f64::MAX, "a finite number")))]
    pub top: f64,
}

impl Default for ExportRequest {
    fn default() -> Self {
        Self {
            cells: PathBuf::new(),
            output: PathBuf::new(),
            permeability: "1".into(),
            barrier: Vec::new(),
            thickness: 1.0,
            top: 0.0,
        }
    }
}

/// What became of [`export_file`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExportSummary {
    /// How many cells.
    pub cell_count: usize,
    /// How many faces between two cells.
    pub connections: usize,
    /// How many of them let nothing through.
    pub sealed: usize,
    /// The least transmissibility of the others.
    pub least: f64,
    /// The greatest.
    pub greatest: f64,
}

/// What is written.
enum ExportFormat {
    Connections(ConnectionFiles),
    Disv(ModflowFiles),
    Disu(ModflowFiles),
    Simulator(SimulatorFiles),
}

impl ExportFormat {
    fn of(request: &ExportRequest) -> Result<Self, JobError> {
        let path = request.output.as_path();
        files::refuse_standard_output(path, "all that is exported is several")?;
        let modflow = || ModflowFiles::of(path, !request.barrier.is_empty());
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        match extension.to_str() {
            Some("json") => {
                files::check_head(path)?;
                Ok(Self::Connections(ConnectionFiles::of(path)))
            }
            Some("disv") => Ok(Self::Disv(modflow())),
            Some("disu") => Ok(Self::Disu(modflow())),
            // how many sides there are is known when the cells are
            Some("uge") => Ok(Self::Simulator(SimulatorFiles::of(Simulator::Pflotran, path, 3))),
            Some("tough") => Ok(Self::Simulator(SimulatorFiles::of(Simulator::Tough, path, 3))),
            Some("opm") => Ok(Self::Simulator(SimulatorFiles::of(Simulator::Opm, path, 3))),
            _ => {
                let known =
                    ".json (connections), .disv, .disu (MODFLOW 6), .uge (PFLOTRAN), .tough, .opm";
                Err(unknown_extension(path, known))
            }
        }
    }

    /// The same files of cells of so many axes, written to where the group says.
    fn staged(&self, dimension: usize, group: &mut OutputGroup) -> Result<Self, JobError> {
        let mut modflow = |files: &ModflowFiles| {
            Ok(ModflowFiles {
                grid: files::stage(&files.grid, group)?,
                npf: files::stage(&files.npf, group)?,
                hfb: files::stage_any(&files.hfb, group)?,
            })
        };
        match self {
            Self::Connections(files) => Ok(Self::Connections(staged_list(files, group)?)),
            Self::Disv(files) => modflow(files).map(Self::Disv),
            Self::Disu(files) => modflow(files).map(Self::Disu),
            Self::Simulator(files) => Ok(Self::Simulator(SimulatorFiles {
                simulator: files.simulator,
                grid: files::stage(&files.grid, group)?,
                sides: (files.sides.iter().take(2 * dimension))
                    .map(|side| files::stage(side, group))
                    .collect::<Result<_, _>>()?,
            })),
        }
    }

    fn paths(&self) -> Vec<&Path> {
        match self {
            Self::Connections(files) => files.paths().to_vec(),
            Self::Disv(files) | Self::Disu(files) => files.paths(),
            Self::Simulator(files) => files.paths(),
        }
    }
}

/// Reads Voronoi cells and writes them for other simulators.
///
/// # Errors
/// [`JobError`] if a file cannot be used, options make no sense, or the watch ends the work.
pub fn export_file(
    request: &ExportRequest,
    session: &mut Session<'_>,
) -> Result<ExportSummary, JobError> {
    let format = ExportFormat::of(request)?;
    files::check_apart([request.cells.as_path()], format.paths(), session)?;
    let read = read_cells(&request.cells, session)
        .map_err(|e| mesh_file::cells_refusal(e, &request.cells))?;
    match (read, &format) {
        (AnyCells::Flat(_), ExportFormat::Disu(_)) => {
            let message = "holds polygons; expected a file to write that ends in .disv";
            Err(JobError::misuse(message).about(&request.cells))
        }
        (AnyCells::Volume(_), ExportFormat::Disv(_)) => {
            let message = "holds polyhedra; expected a file to write that ends in .disu";
            Err(JobError::misuse(message).about(&request.cells))
        }
        (AnyCells::Flat(cells), _) => {
            Export { request, format: &format, cells: &cells }.write(&Dimension::plane(), session)
        }
        (AnyCells::Volume(cells), _) => {
            Export { request, format: &format, cells: &cells }.write(&Dimension::space(), session)
        }
    }
}

/// Cells that are exported.
struct Export<'a, const D: usize> {
    request: &'a ExportRequest,
    format: &'a ExportFormat,
    cells: &'a LoadedCells<D>,
}

impl<const D: usize> Export<'_, D> {
    /// MODFLOW finds no heads in cells that are sealed off from all given ones, and ends without saying which.
    fn warn_of_compartments(&self, count: usize, session: &mut Session<'_>) {
        if count > 1 {
            let text = format!(
                "sealed features part the cells into {count} compartments; MODFLOW 6 needs a given head in each, or a \
                 share above 0, such as 1e-9"
            );
            session.warn(Some(&self.request.output), text);
        }
    }

    /// Refuses what a simulator's files do not hold, and says what they leave out.
    fn check_simulator(
        &self,
        multipliers: &[f64],
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let ExportFormat::Simulator(SimulatorFiles { simulator, .. }) = self.format else {
            return Ok(());
        };
        let output = &self.request.output;
        let say = |text: &str, session: &mut Session<'_>| {
            let file = Some(output.clone());
            session.note(Note { kind: NoteKind::Change, file, text: text.into() });
        };
        match simulator {
            Simulator::Tough => {
                let count = self.cells.mesh.cell_count();
                if count > MOST_TOUGH_ELEMENTS {
                    let message = format!(
                        "{count} cells; names of five characters tell {MOST_TOUGH_ELEMENTS} apart"
                    );
                    return Err(JobError::content(message).about(output));
                }
                say(
                    "TOUGH's columns hold numbers of ten characters; coordinates and areas are rounded to them",
                    session,
                );
            }
            Simulator::Opm => {
                if multipliers.iter().any(|m| *m > 0.0 && *m < 1.0) {
                    let message = "OPM's grids hold no shares of flow; expected barriers of 0 or 1";
                    return Err(JobError::misuse(message).about(output));
                }
                say("OPM's grids hold geometry; permeability is not written", session);
            }
            Simulator::Pflotran => {
                say("PFLOTRAN's grids hold geometry; permeability is not written", session);
            }
        }
        Ok(())
    }

    fn write(
        &self,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<ExportSummary, JobError> {
        let LoadedCells { mesh, features, fields, frame, provenance, .. } = self.cells;
        let method = &dimension.flow;
        let grid = (method.grid_of_cells)(mesh, Some(features));
        let barriers = self.request.barrier.iter().map(|spec| spec.barrier().clone()).collect();
        let permeability = permeability::given(&self.request.permeability, fields)?;
        let problem = Problem { permeability, barriers, ..Problem::default() };
        let about = |e: FlowError| JobError::from(e).about(&self.request.cells);
        let setting = (method.setting)(&problem, &grid).map_err(about)?;
        if matches!(self.format, ExportFormat::Disv(_) | ExportFormat::Disu(_)) {
            self.warn_of_compartments(setting.compartments().len(), session);
        }
        let multipliers = setting.multipliers();
        self.check_simulator(multipliers, session)?;
        let found = (method.transmissibilities)(mesh, setting.permeability(), multipliers);
        let found = found.map_err(about)?;
        let k: Vec<f64> = (0..mesh.cell_count())
            .map(|cell| problem.permeability.scalar(cell).expect("it is no tensor"))
            .collect();
        let data = CellData { mesh, features, frame, provenance };
        let (top, thickness) = (self.request.top, self.request.thickness);
        let rock = Rock { permeability: &k, multipliers, top, thickness };
        session.write_together(|group, session| {
            let written = match self.format.staged(D, group)? {
                ExportFormat::Connections(files) => {
                    let flow = Flow { permeability: &k, transmissibilities: &found };
                    (dimension.files.connections_with_flow)(&files, &data, flow, session)
                }
                ExportFormat::Disv(files) | ExportFormat::Disu(files) => {
                    (dimension.files.modflow)(&files, &data, &rock, session)
                }
                ExportFormat::Simulator(files) => {
                    (dimension.files.simulator)(&files, &data, &rock, session)
                }
            };
            written.map_err(|e| JobError::from(e).about(&self.request.output))
        })?;
        let open = found.iter().copied().filter(|t| *t > 0.0);
        let (least, greatest) =
            open.fold((f64::INFINITY, 0.0_f64), |(l, m), t| (l.min(t), m.max(t)));
        Ok(ExportSummary {
            cell_count: mesh.cell_count(),
            connections: mesh.inner_face_count(),
            sealed: multipliers.iter().filter(|multiplier| **multiplier == 0.0).count(),
            least,
            greatest,
        })
    }
}
