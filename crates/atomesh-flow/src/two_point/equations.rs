//! One equation per cell: the flow out through its faces equals that in from sources, sides and wells.

use std::collections::BTreeMap;

use atomesh::geometry::Point;
use atomesh::watch::{Phase, Watch, check};

use super::boundary::{Side, Sides};
use super::shares::share;
use super::well::Coupling;
use crate::error::FlowError;
use crate::grid::FlowGrid;
use crate::problem::Control;
use crate::setting::Setting;
use crate::solution::{Solution, WellFlow};
use crate::solve::{SolveOptions, SolveReport, Sparse, System, solve};

/// The unknown of a cell whose pressure is given.
const NONE: u32 = u32::MAX;

/// The equations, and what the fluxes are computed from.
pub(super) struct Equations<'a, const D: usize> {
    grid: &'a FlowGrid<D>,
    setting: &'a Setting<'a, D>,
    /// The transmissibility of each face between two cells.
    inner: Vec<f64>,
    sides: Sides,
    wells: Vec<Coupling>,
    /// The number of each cell's unknown, or [`NONE`].
    unknowns: Vec<u32>,
    /// The cell of each unknown.
    cells: Vec<u32>,
}

impl<'a, const D: usize> Equations<'a, D> {
    pub fn new(
        grid: &'a FlowGrid<D>,
        setting: &'a Setting<'a, D>,
        inner: Vec<f64>,
        sides: Sides,
        wells: Vec<Coupling>,
    ) -> Self {
        let cells: Vec<u32> =
            (0..grid.cell_count() as u32).filter(|&c| sides.fixed[c as usize].is_none()).collect();
        let mut unknowns = vec![NONE; grid.cell_count()];
        for (number, &cell) in cells.iter().enumerate() {
            unknowns[cell as usize] = number as u32;
        }
        Self { grid, setting, inner, sides, wells, unknowns, cells }
    }

    /// The pressure of each cell.
    pub fn solve(
        &self,
        sites: &[Point<D>],
        options: &SolveOptions,
        watch: &mut dyn Watch,
    ) -> Result<(Vec<f64>, SolveReport), FlowError> {
        let (matrix, rhs) = self.assemble();
        check(watch, Phase::Assemble, 1.0, None)?;
        let places: Vec<Point<D>> = self.cells.iter().map(|&cell| sites[cell as usize]).collect();
        let system = System {
            matrix: &matrix,
            rhs: &rhs,
            is_symmetric: true,
            block: 1,
            places: &places,
            coarse: None,
        };
        let (found, report) = match rhs.is_empty() {
            false => solve(&system, options, watch)?,
            true => (Vec::new(), nothing_to_solve()),
        };
        let pressure = |cell: usize| match self.sides.fixed[cell] {
            Some(pressure) => pressure,
            None => found[self.unknowns[cell] as usize],
        };
        Ok(((0..self.unknowns.len()).map(pressure).collect(), report))
    }

    /// The matrix and the right-hand side, row after row.
    fn assemble(&self) -> (Sparse, Vec<f64>) {
        let (mut diagonal, mut rhs) = self.diagonal_and_rhs();
        let (mut starts, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        let mut row: Vec<(u32, f64)> = Vec::new();
        for (number, &cell) in self.cells.iter().enumerate() {
            row.clear();
            for &face in self.grid.facets_of(cell as usize) {
                let Some((other, transmissibility)) = self.across(face, cell) else { continue };
                diagonal[number] += transmissibility;
                match self.sides.fixed[other as usize] {
                    Some(pressure) => rhs[number] += transmissibility * pressure,
                    None => row.push((self.unknowns[other as usize], -transmissibility)),
                }
            }
            self.pin(cell, &mut diagonal[number]);
            row.push((number as u32, diagonal[number]));
            row.sort_by_key(|entry| entry.0);
            for &(column, value) in &row {
                // rounding may split the face between two cells in two
                if columns.len() > starts[number] && columns.last() == Some(&column) {
                    *values.last_mut().expect("there is one before") += value;
                } else {
                    columns.push(column);
                    values.push(value);
                }
            }
            starts.push(columns.len());
        }
        (Sparse::new(self.cells.len(), starts, columns, values), rhs)
    }

    /// The cell beyond an inner face of positive transmissibility, and the transmissibility.
    fn across(&self, face: u32, cell: u32) -> Option<(u32, f64)> {
        let facet = &self.grid.facets()[face as usize];
        let neighbour = facet.neighbour?;
        let other = if facet.cell == cell { neighbour } else { facet.cell };
        let transmissibility = self.inner[face as usize];
        (transmissibility > 0.0).then_some((other, transmissibility))
    }

    /// What sources, wells and sides add to the diagonal and to the right-hand side.
    fn diagonal_and_rhs(&self) -> (Vec<f64>, Vec<f64>) {
        let mut diagonal = vec![0.0; self.cells.len()];
        let sources = self.setting.sources();
        let mut rhs: Vec<f64> = self.cells.iter().map(|&cell| sources[cell as usize]).collect();
        for (facet, side) in self.grid.facets()[self.inner.len()..].iter().zip(&self.sides.faces) {
            let number = self.unknowns[facet.cell as usize];
            match *side {
                _ if number == NONE => {}
                Side::Inflow(rate) => rhs[number as usize] += rate,
                Side::Pressure { value, transmissibility } => {
                    diagonal[number as usize] += transmissibility;
                    rhs[number as usize] += transmissibility * value;
                }
                Side::Fixed => unreachable!("its cell has no unknown"),
            }
        }
        for well in &self.wells {
            let number = self.unknowns[well.cell as usize];
            if number == NONE {
                continue;
            }
            match (self.setting.problem().wells[well.well].control, well.index) {
                (Control::Pressure(pressure), Some(index)) => {
                    diagonal[number as usize] += index;
                    rhs[number as usize] += index * pressure;
                }
                (Control::Pressure(_), None) => unreachable!("it was refused"),
                (Control::Rate(rate), _) => rhs[number as usize] += rate,
            }
        }
        (diagonal, rhs)
    }

    /// Adds a well of pressure 0 in the first cell of a compartment without a given pressure, so that the matrix is
    /// definite.
    fn pin(&self, cell: u32, diagonal: &mut f64) {
        let number = self.setting.compartment_of()[cell as usize] as usize;
        let compartment = &self.setting.compartments()[number];
        if !compartment.has_pressure && compartment.first == cell {
            let k = self.setting.permeability().scalar(cell as usize).unwrap_or(1.0);
            let width = self.grid.measures()[cell as usize].powf(1.0 / D as f64);
            *diagonal += k * width.powi(D as i32 - 2);
        }
    }

    /// Fluxes, sources and wells from the pressures.
    pub fn solution(&self, pressures: Vec<f64>, solve: SolveReport) -> Solution<D> {
        let wells: Vec<WellFlow> = self.wells.iter().map(|w| self.flow(w, &pressures)).collect();
        let mut sources = self.setting.sources().to_vec();
        for (well, flow) in self.wells.iter().zip(&wells) {
            sources[well.cell as usize] += flow.rate;
        }
        let fluxes = self.fluxes(&pressures, &sources);
        let pinned = self.setting.pinned().map(|(number, _)| number + 1).collect();
        Solution { pressures, fluxes, sources, wells, pinned, solve }
    }

    fn flow(&self, well: &Coupling, pressures: &[f64]) -> WellFlow {
        let problem = &self.setting.problem().wells[well.well];
        let cell_pressure = pressures[well.cell as usize];
        let (rate, wall_pressure) = match (problem.control, well.index) {
            (Control::Rate(rate), index) => (rate, index.map(|index| cell_pressure + rate / index)),
            (Control::Pressure(wall), index) => {
                (index.unwrap_or(0.0) * (wall - cell_pressure), Some(wall))
            }
        };
        let compartment = self.setting.compartment_of()[well.cell as usize] as usize + 1;
        WellFlow { name: problem.name.clone(), compartment, rate, cell_pressure, wall_pressure }
    }

    /// The flux through each face, out of its cell. Through the sides on which a cell's site lies flows what balances
    /// the cell.
    fn fluxes(&self, pressures: &[f64], sources: &[f64]) -> Vec<f64> {
        let facets = self.grid.facets();
        let mut fluxes = vec![0.0; facets.len()];
        let mut excess = sources.to_vec();
        let mut fixed: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for (face, facet) in facets.iter().enumerate() {
            let cell = facet.cell as usize;
            let flux = match (facet.neighbour, self.inner.get(face)) {
                (Some(other), Some(&transmissibility)) if transmissibility > 0.0 => {
                    transmissibility * (pressures[cell] - pressures[other as usize])
                }
                (Some(_), _) => 0.0,
                (None, _) => match self.sides.faces[face - self.inner.len()] {
                    Side::Inflow(rate) => 0.0 - rate,
                    Side::Pressure { value, transmissibility } => {
                        transmissibility * (pressures[cell] - value)
                    }
                    Side::Fixed => {
                        fixed.entry(cell).or_default().push(face as u32);
                        continue;
                    }
                },
            };
            fluxes[face] = flux;
            excess[cell] -= flux;
            if let Some(other) = facet.neighbour {
                excess[other as usize] += flux;
            }
        }
        for (cell, faces) in fixed {
            share(self.grid, cell, &faces, excess[cell], &mut fluxes);
        }
        fluxes
    }
}

fn nothing_to_solve() -> SolveReport {
    SolveReport { method: "none", unknowns: 0, nonzeros: 0, iterations: 0, residual: 0.0 }
}
