//! The answer: pressures, velocities, fluxes, and whether what flows in flows out.

use atomesh::geometry::{Point, difference};

use crate::grid::FlowGrid;
use crate::setting::Setting;
use crate::solve::SolveReport;

/// The rate and pressures of a well.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct WellFlow {
    /// Its name.
    pub name: String,
    /// The compartment that it is in, from 1.
    pub compartment: usize,
    /// The flow into the domain per unit of time; below 0 out of it.
    pub rate: f64,
    /// The mean pressure of its cells.
    pub cell_pressure: f64,
    /// The pressure at its wall; `None` without a radius.
    pub wall_pressure: Option<f64>,
}

/// The mass balance.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Balance {
    /// Into the domain through wells of positive rate.
    pub wells_in: f64,
    /// Out of it through wells of negative rate; 0 or more.
    pub wells_out: f64,
    /// In through the boundary.
    pub boundary_in: f64,
    /// Out through the boundary; 0 or more.
    pub boundary_out: f64,
    /// What the source term q brings, below 0 takes.
    pub source: f64,
    /// In less out.
    pub error: f64,
    /// The largest of |in − out| of a cell.
    pub cell_error: f64,
    /// All that flows in: the scale of the errors.
    pub scale: f64,
}

impl Balance {
    /// The larger of the two errors, relative to the scale; 0 if nothing flows.
    pub fn relative_error(&self) -> f64 {
        if self.scale > 0.0 { self.cell_error.max(self.error.abs()) / self.scale } else { 0.0 }
    }
}

/// Steady flow on a grid.
#[derive(Clone, Debug)]
pub struct Solution<const D: usize> {
    /// The mean pressure of each cell; of Voronoi cells that at the site.
    pub pressures: Vec<f64>,
    /// The flow through each facet per unit of time, out of its `cell`.
    pub fluxes: Vec<f64>,
    /// What the source term and wells bring into each cell.
    pub sources: Vec<f64>,
    /// The wells, in the problem's order.
    pub wells: Vec<WellFlow>,
    /// Compartments, numbered from 1, in which the pressure is known up to a constant only: its mean in one cell is 0.
    pub pinned: Vec<usize>,
    /// How the equations were solved.
    pub solve: SolveReport,
}

impl<const D: usize> Solution<D> {
    /// Puts compartments that nothing drives to rest: what a scheme finds to flow there is rounding, which would be drawn
    /// as any other flow.
    pub(crate) fn rest(mut self, grid: &FlowGrid<D>, setting: &Setting<'_, D>) -> Self {
        let compartments = setting.compartments();
        let at_rest = |compartment: usize| compartments[compartment].pressure_at_rest();
        let of_cell = |cell: u32| at_rest(setting.compartment_of()[cell as usize] as usize);
        for (cell, (pressure, source)) in
            self.pressures.iter_mut().zip(&mut self.sources).enumerate()
        {
            if let Some(rest) = of_cell(cell as u32) {
                (*pressure, *source) = (rest, 0.0);
            }
        }
        for (facet, flux) in grid.facets().iter().zip(&mut self.fluxes) {
            if of_cell(facet.cell).is_some() {
                *flux = 0.0;
            }
        }
        for well in &mut self.wells {
            if let Some(rest) = at_rest(well.compartment - 1) {
                (well.rate, well.cell_pressure) = (0.0, rest);
                well.wall_pressure = well.wall_pressure.map(|_| rest);
            }
        }
        self
    }

    /// The mean Darcy velocity of each cell from its fluxes, `v = Σ F_f (x_f − x_K) / |K|`, F_f outward. In simplices it is
    /// the mean of the lowest-order field with these fluxes (Raviart & Thomas 1977). Exact where the velocity is
    /// constant.
    pub fn velocities(&self, grid: &FlowGrid<D>) -> Vec<Point<D>> {
        let velocity = |cell: usize| {
            let centre = &grid.centroids()[cell];
            let mut velocity = [0.0; D];
            for &number in grid.facets_of(cell) {
                let facet = &grid.facets()[number as usize];
                let out = if facet.cell as usize == cell { 1.0 } else { -1.0 };
                let way = difference(&facet.centroid, centre);
                for axis in 0..D {
                    velocity[axis] += out * self.fluxes[number as usize] * way[axis];
                }
            }
            velocity.map(|x| x / grid.measures()[cell])
        };
        (0..grid.cell_count()).map(velocity).collect()
    }

    /// The mass balance, from fluxes and sources alone.
    pub fn balance(&self, grid: &FlowGrid<D>) -> Balance {
        let mut balance = Balance {
            // an empty sum is −0
            wells_in: self.wells.iter().fold(0.0, |sum, well| sum + well.rate.max(0.0)),
            wells_out: self.wells.iter().fold(0.0, |sum, well| sum + (-well.rate).max(0.0)),
            boundary_in: 0.0,
            boundary_out: 0.0,
            source: 0.0,
            error: 0.0,
            cell_error: 0.0,
            scale: 0.0,
        };
        let mut excess = self.sources.clone();
        for (facet, &flux) in grid.facets().iter().zip(&self.fluxes) {
            excess[facet.cell as usize] -= flux;
            match facet.neighbour {
                Some(cell) => excess[cell as usize] += flux,
                None if flux < 0.0 => balance.boundary_in -= flux,
                None => balance.boundary_out += flux,
            }
        }
        let wells: f64 = self.wells.iter().map(|well| well.rate).sum();
        balance.source = self.sources.iter().sum::<f64>() - wells;
        balance.error = excess.iter().sum();
        balance.cell_error = excess.iter().fold(0.0, |most, x| most.max(x.abs()));
        let source = balance.source.max(0.0);
        let inward = balance.wells_in + balance.boundary_in + source;
        let outward = balance.wells_out + balance.boundary_out + (-balance.source).max(0.0);
        balance.scale = inward.max(outward);
        balance
    }

    /// The largest flow through a sealed facet, as a share of the balance's scale.
    pub fn leak(&self, grid: &FlowGrid<D>, setting: &Setting<'_, D>) -> f64 {
        let scale = self.balance(grid).scale;
        let sealed = setting.multipliers().iter().zip(&self.fluxes);
        let most =
            sealed.filter(|(m, _)| **m == 0.0).fold(0.0_f64, |most, (_, f)| most.max(f.abs()));
        if scale > 0.0 { most / scale } else { 0.0 }
    }
}
