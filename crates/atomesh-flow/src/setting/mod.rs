//! A problem placed on a grid: every name found, every compartment known to have a solution.

mod wells;
#[cfg(test)]
mod tests;

use atomesh::geometry::Sets;

use crate::error::FlowError;
use crate::grid::{FlowFacet, FlowGrid, cell_mean, facet_integral};
use crate::permeability::Permeability;
use crate::problem::{Condition, Control, Problem};
use wells::place_wells;
pub use wells::{PlacedWell, well_index};

/// Rates whose sum is below this share of the sum of their magnitudes balance.
const BALANCED: f64 = 1e-9;

/// Cells between which something can flow.
#[derive(Clone, Debug, PartialEq)]
pub struct Compartment {
    /// The number of cells.
    pub cell_count: usize,
    /// Their area (plane) or volume (space).
    pub measure: f64,
    /// The lowest cell.
    pub first: u32,
    /// What flows in through wells of given rate, boundaries of given flux, and the source term.
    pub rate: f64,
    /// The sum of the magnitudes of these rates.
    pub scale: f64,
    /// Whether a well or boundary fixes a pressure. If not, the pressure is known up to a constant.
    pub has_pressure: bool,
    /// The least and the greatest of these pressures; infinite, the greater first, if there are none.
    pub pressures: [f64; 2],
}

impl Compartment {
    fn add(&mut self, rate: f64) {
        self.rate += rate;
        self.scale += rate.abs();
    }

    fn fix(&mut self, pressure: f64) {
        self.has_pressure = true;
        let [least, greatest] = self.pressures;
        self.pressures = [least.min(pressure), greatest.max(pressure)];
    }

    /// Whether anything drives flow in it: a rate, or pressures that differ. Without, the pressure is the same all over it,
    /// and what schemes find to flow is rounding.
    pub fn is_driven(&self) -> bool {
        self.scale > 0.0 || self.pressures[0] < self.pressures[1]
    }

    /// The pressure all over it if nothing drives flow in it: that given, or 0 where none is.
    pub fn pressure_at_rest(&self) -> Option<f64> {
        let pressure = if self.has_pressure { self.pressures[0] } else { 0.0 };
        (!self.is_driven()).then_some(pressure)
    }

    fn is_balanced(&self) -> bool {
        self.rate.abs() <= BALANCED * self.scale
    }
}

/// A problem placed on a grid and known to have a solution.
#[derive(Clone, Debug)]
pub struct Setting<'a, const D: usize> {
    problem: &'a Problem<'a, D>,
    multipliers: Vec<f64>,
    conditions: Vec<Option<u32>>,
    wells: Vec<PlacedWell>,
    compartments: Vec<Compartment>,
    compartment_of: Vec<u32>,
    sources: Vec<f64>,
}

impl<'a, const D: usize> Setting<'a, D> {
    /// Finds the facets and cells that the problem names, and the compartments that its sealed barriers
    /// (multiplier 0) cut the grid into. Cost: O(cells · (1 + wells)).
    ///
    /// A well at a place that several cells share, such as a point of the mesh, flows into all of them that no
    /// barrier separates from the lowest one.
    ///
    /// # Errors
    /// [`FlowError`] names what is not found, out of range or not finite, and a compartment without a given pressure
    /// whose rates do not sum to 0.
    pub fn new(problem: &'a Problem<'a, D>, grid: &FlowGrid<D>) -> Result<Self, FlowError> {
        problem.permeability.check(grid.cell_count())?;
        let multipliers = multipliers(problem, grid)?;
        let conditions = conditions(problem, grid)?;
        let compartment_of = compartments(grid, &multipliers);
        let wells = place_wells(problem, grid, &multipliers)?;
        let source = |cell: usize| {
            problem.source.map_or(0.0, |q| cell_mean(grid, cell, &q) * grid.measures()[cell])
        };
        let sources = (0..grid.cell_count()).map(source).collect();
        let mut setting = Self {
            problem,
            multipliers,
            conditions,
            wells,
            compartments: Vec::new(),
            compartment_of,
            sources,
        };
        setting.compartments = setting.find_compartments(grid);
        setting.check_balance(grid)?;
        Ok(setting)
    }

    /// The problem.
    pub fn problem(&self) -> &'a Problem<'a, D> {
        self.problem
    }

    /// The permeability.
    pub fn permeability(&self) -> &'a Permeability<D> {
        &self.problem.permeability
    }

    /// The multiplier of each facet: 1 where nothing hinders flow.
    pub fn multipliers(&self) -> &[f64] {
        &self.multipliers
    }

    /// The condition on a facet of the boundary; `None` without one, so that nothing flows.
    pub fn condition(&self, facet: usize) -> Option<Condition<'a, D>> {
        let number = self.conditions[facet]?;
        Some(self.problem.boundaries[number as usize].condition)
    }

    /// The problem's number of the condition on a facet of the boundary.
    ///
    /// # Panics
    /// If there is none.
    pub(crate) fn boundary(&self, facet: usize) -> u32 {
        self.conditions[facet].expect("a condition holds on the facet")
    }

    /// The wells with their cells, in the problem's order.
    pub fn wells(&self) -> &[PlacedWell] {
        &self.wells
    }

    /// The compartments, in the order of their lowest cells.
    pub fn compartments(&self) -> &[Compartment] {
        &self.compartments
    }

    /// Whether anything flows: a compartment has a rate, or pressures that differ.
    pub fn is_driven(&self) -> bool {
        self.compartments.iter().any(Compartment::is_driven)
    }

    /// The compartments whose pressure nothing fixes, each with the cell whose mean pressure schemes set to 0.
    pub fn pinned(&self) -> impl Iterator<Item = (usize, u32)> + '_ {
        let all = self.compartments.iter().enumerate();
        all.filter(|(_, own)| !own.has_pressure).map(|(number, own)| (number, own.first))
    }

    /// The compartment of each cell, from 0.
    pub fn compartment_of(&self) -> &[u32] {
        &self.compartment_of
    }

    /// What the source term q brings into each cell, without wells.
    pub fn sources(&self) -> &[f64] {
        &self.sources
    }

    fn find_compartments(&self, grid: &FlowGrid<D>) -> Vec<Compartment> {
        let count = self.compartment_of.iter().max().map_or(0, |&most| most as usize + 1);
        let none = Compartment {
            cell_count: 0,
            measure: 0.0,
            first: u32::MAX,
            rate: 0.0,
            scale: 0.0,
            has_pressure: false,
            pressures: [f64::INFINITY, f64::NEG_INFINITY],
        };
        let mut all = vec![none; count];
        for (cell, &number) in self.compartment_of.iter().enumerate() {
            let own = &mut all[number as usize];
            own.cell_count += 1;
            own.measure += grid.measures()[cell];
            own.first = own.first.min(cell as u32);
            own.add(self.sources[cell]);
        }
        for (number, facet) in grid.facets().iter().enumerate() {
            let own = &mut all[self.compartment_of[facet.cell as usize] as usize];
            match self.condition(number) {
                Some(Condition::Pressure(value)) => own.fix(value.at(&facet.centroid)),
                Some(Condition::Flux(value)) => {
                    own.add(facet_integral(grid, number, &value));
                }
                None => {}
            }
        }
        for placed in &self.wells {
            let own = &mut all[self.compartment_of[placed.cells[0] as usize] as usize];
            match self.problem.wells[placed.well].control {
                Control::Rate(rate) => own.add(rate),
                Control::Pressure(pressure) => own.fix(pressure),
            }
        }
        all
    }

    fn check_balance(&self, grid: &FlowGrid<D>) -> Result<(), FlowError> {
        let whole: f64 = grid.measures().iter().sum();
        for (number, compartment) in self.compartments.iter().enumerate() {
            if compartment.has_pressure || compartment.is_balanced() {
                continue;
            }
            return Err(FlowError::Unbalanced {
                compartment: number + 1,
                cells: compartment.cell_count,
                share: compartment.measure / whole,
                inside: self.inside(grid, number as u32),
                rate: compartment.rate,
            });
        }
        Ok(())
    }

    /// Names of the wells and boundaries of a compartment.
    fn inside(&self, grid: &FlowGrid<D>, compartment: u32) -> String {
        let within = |cell: u32| self.compartment_of[cell as usize] == compartment;
        let wells = self.wells.iter().filter(|placed| within(placed.cells[0]));
        let mut names: Vec<&str> =
            wells.map(|placed| self.problem.wells[placed.well].name.as_str()).collect();
        for (number, boundary) in self.problem.boundaries.iter().enumerate() {
            let holds = |(at, facet): (usize, &FlowFacet<D>)| {
                self.conditions[at] == Some(number as u32) && within(facet.cell)
            };
            if grid.facets().iter().enumerate().any(holds) {
                names.push(&boundary.group);
            }
        }
        match names.is_empty() {
            true => "a source term".to_string(),
            false => names.join(", "),
        }
    }
}

fn multipliers<const D: usize>(
    problem: &Problem<'_, D>,
    grid: &FlowGrid<D>,
) -> Result<Vec<f64>, FlowError> {
    let mut multipliers = vec![1.0; grid.facets().len()];
    for barrier in &problem.barriers {
        let name = || barrier.group.clone();
        if !(0.0..=1.0).contains(&barrier.multiplier) {
            return Err(FlowError::Multiplier { name: name(), value: barrier.multiplier });
        }
        for &facet in facets_named(grid, &barrier.group)? {
            if grid.facets()[facet as usize].neighbour.is_none() {
                let (found, expected) = ("lie on the boundary", "a barrier inside the mesh");
                return Err(FlowError::Place { name: name(), found, expected });
            }
            multipliers[facet as usize] = barrier.multiplier;
        }
    }
    Ok(multipliers)
}

fn conditions<const D: usize>(
    problem: &Problem<'_, D>,
    grid: &FlowGrid<D>,
) -> Result<Vec<Option<u32>>, FlowError> {
    let mut conditions = vec![None; grid.facets().len()];
    for (number, boundary) in problem.boundaries.iter().enumerate() {
        let (value, what) = match boundary.condition {
            Condition::Pressure(value) => (value, "pressure"),
            Condition::Flux(value) => (value, "flux"),
        };
        for &facet in facets_named(grid, &boundary.group)? {
            let name = || boundary.group.clone();
            let own = &grid.facets()[facet as usize];
            if own.neighbour.is_some() {
                let (found, expected) = ("lie inside the mesh", "facets of the boundary");
                return Err(FlowError::Place { name: name(), found, expected });
            }
            let at = value.at(&own.centroid);
            if !at.is_finite() {
                return Err(FlowError::NotFinite { name: name(), what, value: at });
            }
            conditions[facet as usize] = Some(number as u32);
        }
    }
    Ok(conditions)
}

fn facets_named<'g, const D: usize>(
    grid: &'g FlowGrid<D>,
    name: &str,
) -> Result<&'g [u32], FlowError> {
    match grid.sets().iter().find(|set| set.name == name) {
        Some(set) => Ok(&set.facets),
        None => {
            let known: Vec<&str> = grid.sets().iter().map(|set| set.name.as_str()).collect();
            let known = if known.is_empty() { "none".to_string() } else { known.join(", ") };
            Err(FlowError::Group { name: name.to_string(), known })
        }
    }
}

/// The compartment of each cell, numbered in the order of their lowest cells.
fn compartments<const D: usize>(grid: &FlowGrid<D>, multipliers: &[f64]) -> Vec<u32> {
    let mut sets = Sets::new(grid.cell_count());
    for (facet, &multiplier) in grid.facets().iter().zip(multipliers) {
        if let Some(other) = facet.neighbour.filter(|_| multiplier > 0.0) {
            sets.join(facet.cell, other);
        }
    }
    sets.numbers()
}
