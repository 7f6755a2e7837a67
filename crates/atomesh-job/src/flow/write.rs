//! Writing an answer.

use std::path::Path;

use atomesh::geometry::Point;
use atomesh::image::Frame;
use atomesh::watch::Phase;
use atomesh_flow::Setting;
use atomesh_flow::streamlines::{Porosity, Streamline};
use atomesh_io::mesh::cells::CellData;
use atomesh_io::mesh::{
    CellFields, FacetFlux, FluxFiles, FluxTable, MeshData, MeshDataError, MeshFormat, Provenance,
    Streamlines,
};

use super::answer::FlowAnswer;
use super::files::FlowFiles;
use super::flow_mesh::FlowMeshCells;
use super::picture::FlowPictureOptions;
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::files::{PictureFile, write_bytes};
use crate::session::Session;

/// An answer to be written.
pub(super) struct FlowWriting<'a, const D: usize> {
    files: &'a FlowFiles,
    answer: &'a FlowAnswer<D>,
    setting: Setting<'a, D>,
    dimension: &'a Dimension<D>,
}

impl<'a, const D: usize> FlowWriting<'a, D> {
    pub fn new(
        files: &'a FlowFiles,
        answer: &'a FlowAnswer<D>,
        dimension: &'a Dimension<D>,
    ) -> Self {
        Self { files, answer, setting: answer.setting(&dimension.flow), dimension }
    }

    /// Writes everything.
    ///
    /// # Errors
    /// [`JobError`] if a file cannot be written, or the watch ends the work.
    pub fn write(&self, session: &mut Session<'_>) -> Result<(), JobError> {
        let needs_lines = self.files.streamlines.is_some() || self.files.shows_streamlines;
        let lines = if needs_lines { self.lines(session)? } else { Vec::new() };
        session.write_together(|group, session| {
            let files = self.files.staged(group)?;
            if let Some(picture) = &files.picture {
                self.draw(picture, &lines, session)?;
            }
            session.begin(Phase::Write);
            if let Some(path) = &files.output {
                self.write_output(path, session)?;
            }
            if let Some(path) = &files.pressure {
                self.write_pressure(path, session)?;
            }
            if let Some(path) = &files.streamlines {
                self.write_lines(path, &lines, session)?;
            }
            if let Some(files) = &files.fluxes {
                self.write_facets(files, session)?;
            }
            session.end_phase();
            if let Some(path) = &files.report {
                let report = self.answer.report(&self.setting, &self.dimension.flow, session);
                write_bytes(path, format!("{report:#}\n").as_bytes())?;
            }
            Ok(())
        })
    }

    fn lines(&self, session: &mut Session<'_>) -> Result<Vec<Streamline<D>>, JobError> {
        self.answer.streamlines(self.files.streamline_count, &self.dimension.flow, session)
    }

    fn draw(
        &self,
        file: &PictureFile,
        lines: &[Streamline<D>],
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        session.begin(Phase::Draw);
        let lines = if self.files.shows_streamlines { lines } else { &[] };
        let shows_pressure = self.files.shows_pressure;
        let shown = FlowPictureOptions { shows_pressure, lines, ..Default::default() };
        file.write(&self.answer.picture(&shown, self.dimension)?)
    }

    /// Writes the mesh with what is known of its cells.
    fn write_output(&self, path: &Path, session: &mut Session<'_>) -> Result<(), JobError> {
        let FlowAnswer { mesh, grid, solution, velocities, .. } = self.answer;
        let files = &self.dimension.files;
        let permeability = self.answer.permeabilities();
        let porosity = Porosity::Constant(self.answer.porosity);
        let time_of_flight = self.dimension.flow.time_of_flight;
        let times = time_of_flight(grid, &self.setting, solution, porosity, session)?;
        let never = |t: f64| if t.is_finite() { t } else { f64::NAN };
        let times: Vec<f64> = times.into_iter().map(never).collect();
        let fields = OutputFields {
            pressures: &solution.pressures,
            velocities,
            permeability: permeability.as_deref(),
            times: &times,
        };
        let written = match &mesh.cells {
            FlowMeshCells::Simplices { .. } => {
                let Some(data) = self.mesh_data() else { return Ok(()) };
                let data = fields.of_simplices(data).map_err(JobError::content)?;
                let format = MeshFormat::of(path).map_err(JobError::misuse)?;
                (files.mesh)(path, format, &data, session)
            }
            FlowMeshCells::Voronoi { cells, features, wells } => {
                let (Some(frame), Some(provenance)) = (&mesh.frame, &mesh.provenance) else {
                    let message = "Voronoi cells without a frame cannot be written";
                    return Err(JobError::content(message));
                };
                let data = CellData { mesh: &**cells, features, frame, provenance, wells };
                let fields = fields.of_voronoi(cells.cell_count()).map_err(JobError::content)?;
                (files.cells_with)(path, &data, &fields, session)
            }
        };
        written.map_err(|e| JobError::from(e).about(path))
    }

    /// Triangles or tetrahedra with their tags, and where they come from.
    fn mesh_data(&self) -> Option<MeshData<'a, D>> {
        let mesh = &self.answer.mesh;
        let FlowMeshCells::Simplices { mesh: simplices, tags } = &mesh.cells else { return None };
        let mut data = MeshData::new(simplices).with_tags(tags);
        if let Some(frame) = &mesh.frame {
            data = data.with_frame(frame);
        }
        if let Some(provenance) = &mesh.provenance {
            data = data.with_provenance(provenance);
        }
        Some(data)
    }

    /// Writes the pressure with its jumps.
    fn write_pressure(&self, path: &Path, session: &mut Session<'_>) -> Result<(), JobError> {
        let (Some(galerkin), Some(data)) = (&self.answer.galerkin, self.mesh_data()) else {
            return Ok(()); // refused before the work
        };
        let data = data.with_cell_vectors("velocity", &self.answer.velocities);
        let data = data.map_err(JobError::content)?;
        let at = |cell: usize, _: usize, place: &Point<D>| galerkin.pressure(cell, place);
        let written = (self.dimension.files.broken)(path, &data, galerkin.order(), &at, session);
        written.map_err(|e| JobError::from(e).about(path))
    }

    fn write_lines(
        &self,
        path: &Path,
        lines: &[Streamline<D>],
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let well = |number: Option<usize>| number.map(|n| n as u32);
        let lines: Vec<_> = (lines.iter())
            .map(|line| atomesh_io::mesh::TracedLine {
                points: &line.points,
                times: &line.times,
                pressures: &[],
                from: well(line.from),
                to: well(line.to),
            })
            .collect();
        let (frame, provenance) = self.origin();
        let data = Streamlines { lines: &lines, frame, provenance };
        let written = (self.dimension.files.streamlines)(path, &data, session);
        written.map_err(|e| JobError::from(e).about(path))
    }

    fn write_facets(&self, files: &FluxFiles, session: &mut Session<'_>) -> Result<(), JobError> {
        let grid = &self.answer.grid;
        let mut names = vec![""; grid.facets().len()];
        for set in grid.sets() {
            set.facets.iter().for_each(|&facet| names[facet as usize] = &set.name);
        }
        let multipliers = self.setting.multipliers();
        let facets: Vec<FacetFlux<'_, D>> = (grid.facets().iter().enumerate())
            .map(|(number, facet)| FacetFlux {
                cell: facet.cell,
                neighbour: facet.neighbour,
                area: facet.area,
                centroid: facet.centroid,
                flux: self.answer.solution.fluxes[number],
                multiplier: multipliers[number],
                group: names[number],
            })
            .collect();
        let (frame, provenance) = self.origin();
        let table = FluxTable { facets: &facets, frame, provenance };
        let written = (self.dimension.files.fluxes)(files, &table, session);
        written.map_err(|e| JobError::from(e).about(&files.head))
    }

    /// Where the mesh lies and comes from.
    fn origin(&self) -> (Option<&Frame<D>>, Option<&Provenance>) {
        let mesh = &self.answer.mesh;
        (mesh.frame.as_ref(), mesh.provenance.as_ref())
    }
}

/// What is written of each cell.
struct OutputFields<'a, const D: usize> {
    pressures: &'a [f64],
    velocities: &'a [Point<D>],
    permeability: Option<&'a [f64]>,
    times: &'a [f64],
}

impl<'a, const D: usize> OutputFields<'a, D> {
    fn of_simplices(&self, data: MeshData<'a, D>) -> Result<MeshData<'a, D>, MeshDataError> {
        let mut data = data
            .with_cell_field("pressure", self.pressures)?
            .with_cell_vectors("velocity", self.velocities)?;
        if let Some(values) = self.permeability {
            data = data.with_cell_field("permeability", values)?;
        }
        data.with_cell_field("time_of_flight", self.times)
    }

    fn of_voronoi(&self, cell_count: usize) -> Result<CellFields<'a, D>, MeshDataError> {
        let fields = CellFields::new(cell_count)
            .with_numbers("pressure", self.pressures)?
            .with_numbers("time_of_flight", self.times)?
            .with_vectors("velocity", self.velocities)?;
        match self.permeability {
            Some(values) => fields.with_numbers("permeability", values),
            None => Ok(fields),
        }
    }
}
