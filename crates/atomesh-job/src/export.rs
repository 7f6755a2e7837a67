//! Voronoi cells for other flow simulators.

use std::path::{Path, PathBuf};

use atomesh::mesh::PolyMesh;
use atomesh_flow::{FlowError, FlowMethod, Problem, Setting};
use atomesh_io::mesh::cells::{
    AnyCells, ConnectionFiles, Flow, LoadedCells, MOST_TOUGH_ELEMENTS, ModflowFiles, NO_CELL, Rock,
    Simulator, SimulatorFiles, read_cells,
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

    /// The same files of these cells, written to where the group says.
    fn staged<const D: usize>(
        &self,
        cells: &LoadedCells<D>,
        group: &mut OutputGroup,
    ) -> Result<Self, JobError> {
        let has_wells = cells.wells.iter().any(|cell| *cell != NO_CELL);
        let mut modflow = |files: &ModflowFiles| {
            Ok(ModflowFiles {
                grid: files::stage(&files.grid, group)?,
                npf: files::stage(&files.npf, group)?,
                hfb: files::stage_any(&files.hfb, group)?,
                wells: files::stage_any(&files.wells.clone().filter(|_| has_wells), group)?,
            })
        };
        match self {
            Self::Connections(files) => Ok(Self::Connections(staged_list(files, group)?)),
            Self::Disv(files) => modflow(files).map(Self::Disv),
            Self::Disu(files) => modflow(files).map(Self::Disu),
            Self::Simulator(files) => Ok(Self::Simulator(SimulatorFiles {
                simulator: files.simulator,
                grid: files::stage(&files.grid, group)?,
                sides: (files.sides.iter().take(2 * D))
                    .map(|side| files::stage(side, group))
                    .collect::<Result<_, _>>()?,
                wells: files::stage_any(&files.wells.clone().filter(|_| has_wells), group)?,
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

/// The least share of what sealed faces would let through with which heads of compartments that nothing else holds are
/// right to three digits in double precision, rounded up to a power of ten. `open` are transmissibilities of open faces.
///
/// Of a compartment of n cells whose faces would let ΣT through, the equations' least eigenvalue is about m ΣT / n, m being
/// the share, and the greatest is below twice the greatest sum of a cell's transmissibilities. Rounding errors of the
/// solution are as large as their ratio times 2⁻⁵².
fn least_share<const D: usize>(mesh: &PolyMesh<D>, setting: &Setting<D>, open: &[f64]) -> f64 {
    const DIGITS: f64 = 1e-3;
    let of_cell = |cell: u32| setting.compartment_of()[cell as usize] as usize;
    let count = setting.compartments().len();
    let (mut cells, mut across, mut sums) =
        (vec![0_usize; count], vec![0.0; count], vec![0.0; mesh.cell_count()]);
    setting.compartment_of().iter().for_each(|&number| cells[number as usize] += 1);
    for (face, (&neighbour, &t)) in mesh.neighbours().iter().zip(open).enumerate() {
        let both = [mesh.owners()[face], neighbour];
        both.iter().for_each(|&cell| sums[cell as usize] += t);
        if setting.multipliers()[face] == 0.0 {
            let [a, b] = both.map(of_cell);
            if a != b {
                across[a] += t;
                across[b] += t;
            }
        }
    }
    let greatest = |number: usize| {
        let own = sums.iter().zip(setting.compartment_of());
        let own = own.filter(|(_, of)| **of as usize == number);
        own.fold(0.0, |most: f64, (sum, _)| most.max(*sum))
    };
    let least = (0..count).filter(|&number| across[number] > 0.0).map(|number| {
        let ratio = 2.0 * greatest(number) * cells[number] as f64 / across[number];
        ratio * f64::EPSILON / DIGITS
    });
    10f64.powf(least.fold(0.0, f64::max).log10().ceil()).min(1.0)
}

/// Cells that are exported.
struct Export<'a, const D: usize> {
    request: &'a ExportRequest,
    format: &'a ExportFormat,
    cells: &'a LoadedCells<D>,
}

impl<const D: usize> Export<'_, D> {
    /// MODFLOW finds no heads in cells that are sealed off from all given ones, and ends without saying which.
    fn warn_of_compartments(
        &self,
        setting: &Setting<D>,
        method: &FlowMethod<D>,
        session: &mut Session<'_>,
    ) -> Result<(), FlowError> {
        let count = setting.compartments().len();
        if count > 1 {
            let mesh = &self.cells.mesh;
            let open = vec![1.0; mesh.inner_face_count()];
            let open = (method.transmissibilities)(mesh, setting.permeability(), &open)?;
            let share = least_share(mesh, setting, &open);
            let text = format!(
                "sealed features part the cells into {count} compartments; MODFLOW 6 needs a given head in each, or a \
                 share of {share:e} or more, with which heads are right to three digits"
            );
            session.warn(Some(&self.request.output), text);
        }
        Ok(())
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
        let LoadedCells { mesh, features, fields, .. } = self.cells;
        let method = &dimension.flow;
        let grid = (method.grid_of_cells)(mesh, Some(features));
        let barriers = self.request.barrier.iter().map(|spec| spec.barrier().clone()).collect();
        let permeability = permeability::given(&self.request.permeability, fields)?;
        let problem = Problem { permeability, barriers, ..Problem::default() };
        let about = |e: FlowError| JobError::from(e).about(&self.request.cells);
        let setting = (method.setting)(&problem, &grid).map_err(about)?;
        if matches!(self.format, ExportFormat::Disv(_) | ExportFormat::Disu(_)) {
            self.warn_of_compartments(&setting, method, session).map_err(about)?;
        }
        let multipliers = setting.multipliers();
        self.check_simulator(multipliers, session)?;
        let found = (method.transmissibilities)(mesh, setting.permeability(), multipliers);
        let found = found.map_err(about)?;
        let k: Vec<f64> = (0..mesh.cell_count())
            .map(|cell| problem.permeability.scalar(cell).expect("it is no tensor"))
            .collect();
        let data = self.cells.data();
        let (top, thickness) = (self.request.top, self.request.thickness);
        let rock = Rock { permeability: &k, multipliers, top, thickness };
        session.write_together(|group, session| {
            let written = match self.format.staged(self.cells, group)? {
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
