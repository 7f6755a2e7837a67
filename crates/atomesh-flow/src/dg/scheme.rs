//! A setting made ready for the equations: maps of cells, interfaces, wells with their indices, and loads.

use atomesh::geometry::{Point, dot};
use rayon::prelude::*;

use super::basis::MOST;
use super::element::{Affine, Element};
use super::interface::{Interface, InterfaceMaker};
use super::options::DgOptions;
use crate::error::FlowError;
use crate::grid::FlowGrid;
use crate::problem::{Condition, Control, Value};
use crate::setting::{Setting, well_index};

/// A well of given pressure.
#[derive(Clone, Debug)]
pub(super) struct PressureWell {
    /// Its number in the problem.
    pub well: usize,
    /// Its cells.
    pub cells: Vec<u32>,
    /// Their measure.
    pub measure: f64,
    /// Its rate per unit of pressure.
    pub index: f64,
    /// The pressure at its wall, less the reference.
    pub pressure: f64,
}

/// Everything that the equations are made of.
pub(super) struct Scheme<'a, const D: usize> {
    pub grid: &'a FlowGrid<D>,
    pub setting: &'a Setting<'a, D>,
    pub element: Element<D>,
    pub cells: Vec<Affine<D>>,
    /// By facet; `None` where pressures drive no flux.
    pub interfaces: Vec<Option<Interface<D>>>,
    pub pressure_wells: Vec<PressureWell>,
    /// By compartment: pressures are solved for relative to this one, so that a large constant costs no digits.
    pub references: Vec<f64>,
    /// Cells of wells of given pressure, ascending, each with the well's place in `pressure_wells`.
    well_cells: Vec<(u32, usize)>,
    /// Cells in which a pressure is pinned, ascending, each with the index of the well that pins it.
    pins: Vec<(u32, f64)>,
}

impl<'a, const D: usize> Scheme<'a, D> {
    /// Makes the scheme; the caller has checked the options.
    pub fn new(
        grid: &'a FlowGrid<D>,
        setting: &'a Setting<'a, D>,
        options: &DgOptions,
    ) -> Result<Self, FlowError> {
        let mesh = grid.mesh().ok_or(FlowError::NotSimplices)?;
        let numbers = 0..grid.cell_count();
        let affine = |cell: usize| {
            let corners = &mesh.corners()[cell * (D + 1)..(cell + 1) * (D + 1)];
            Affine::of(&mesh.simplex(corners), &grid.centroids()[cell])
        };
        let cells: Vec<Affine<D>> = numbers.into_par_iter().map(affine).collect();
        let facets = (0..grid.facets().len()).into_par_iter();
        let maker = InterfaceMaker { grid, setting, cells: &cells, options };
        let interfaces = facets.map(|facet| maker.interface(facet)).collect();
        let references = references(grid, setting);
        let pressure_wells = pressure_wells(setting, &references)?;
        let mut well_cells: Vec<(u32, usize)> = (pressure_wells.iter().enumerate())
            .flat_map(|(at, well)| well.cells.iter().map(move |&cell| (cell, at)))
            .collect();
        well_cells.sort_unstable();
        let index = |cell: u32| {
            let size = grid.measures()[cell as usize].powf((D as f64 - 2.0) / D as f64);
            setting.permeability().mean(cell as usize) * size
        };
        let mut pins: Vec<(u32, f64)> =
            setting.pinned().map(|(_, cell)| (cell, index(cell))).collect();
        pins.sort_unstable_by_key(|pin| pin.0);
        let element = Element::new(options.order);
        Ok(Self {
            grid,
            setting,
            element,
            cells,
            interfaces,
            pressure_wells,
            references,
            well_cells,
            pins,
        })
    }

    /// The wells of given pressure that flow into a cell.
    pub fn pressure_wells_of(&self, cell: u32) -> impl Iterator<Item = &PressureWell> {
        let first = self.well_cells.partition_point(|entry| entry.0 < cell);
        let own = self.well_cells[first..].iter().take_while(move |entry| entry.0 == cell);
        own.map(|entry| &self.pressure_wells[entry.1])
    }

    /// The index of the well that pins a cell's pressure; 0 elsewhere.
    pub fn pin(&self, cell: u32) -> f64 {
        let at = self.pins.binary_search_by_key(&cell, |pin| pin.0);
        at.map_or(0.0, |at| self.pins[at].1)
    }

    /// The reference pressure of a cell.
    pub fn reference(&self, cell: usize) -> f64 {
        self.references[self.setting.compartment_of()[cell] as usize]
    }

    /// The flux through a facet, out of its cell, for these coefficients of the pressures relative to their references.
    pub fn flux(&self, facet: usize, coefficients: &[f64]) -> f64 {
        let Some(interface) = &self.interfaces[facet] else {
            return match self.setting.condition(facet) {
                Some(Condition::Flux(value)) => -self.facet_integral(facet, &value),
                _ => 0.0,
            };
        };
        let count = self.element.count();
        let (a, b) = (interface.slope_weight, interface.jump_weight);
        let mut sum = 0.0;
        let mut slopes = [0.0; MOST];
        for (node, weight) in self.element.facet_rule.weights.iter().enumerate() {
            let (mut jump, mut slope) = (0.0, 0.0);
            for side in interface.sides() {
                let trace = self.element.trace(side.trace);
                let own = &coefficients[side.cell as usize * count..][..count];
                trace.slopes_along(&side.direction, node, &mut slopes);
                let product = |values: &[f64]| own.iter().zip(values).map(|(c, v)| c * v).sum();
                let value: f64 = product(trace.values(node));
                jump += side.sign * value;
                slope += product(&slopes[..count]);
            }
            if let Some(Condition::Pressure(value)) = self.setting.condition(facet) {
                jump -= value.at(&self.node(facet, node)) - self.reference_of(facet);
            }
            sum += weight * (b * jump - a * slope);
        }
        sum * interface.measure
    }

    /// The integral of a value over a facet, by the rule of the equations.
    pub fn facet_integral(&self, facet: usize, value: &Value<'_, D>) -> f64 {
        let weights = self.element.facet_rule.weights.iter().enumerate();
        let at = |(node, weight): (usize, &f64)| weight * value.at(&self.node(facet, node));
        self.grid.facets()[facet].measure() * weights.map(at).sum::<f64>()
    }

    /// The reference pressure of a facet's cell.
    pub fn reference_of(&self, facet: usize) -> f64 {
        self.reference(self.grid.facets()[facet].cell as usize)
    }

    /// The place of a node of the rule on a facet.
    pub fn node(&self, facet: usize, node: usize) -> Point<D> {
        let corners = self.grid.facet_corners(facet).expect("facets of a mesh have corners");
        let mesh = self.grid.mesh().expect("checked before");
        let weights = self.element.facet_rule.place(node);
        std::array::from_fn(|axis| {
            let at = |(&corner, w): (&u32, &f64)| w * mesh.points()[corner as usize][axis];
            corners.iter().zip(weights).map(at).sum()
        })
    }
}

/// The middle between the least and the greatest given pressure of each compartment; 0 without one.
fn references<const D: usize>(grid: &FlowGrid<D>, setting: &Setting<'_, D>) -> Vec<f64> {
    let mut ranges = vec![(f64::INFINITY, f64::NEG_INFINITY); setting.compartments().len()];
    let mut include = |cell: u32, pressure: f64| {
        let range = &mut ranges[setting.compartment_of()[cell as usize] as usize];
        *range = (range.0.min(pressure), range.1.max(pressure));
    };
    for (number, facet) in grid.facets().iter().enumerate() {
        if let Some(Condition::Pressure(value)) = setting.condition(number) {
            include(facet.cell, value.at(&facet.centroid));
        }
    }
    for placed in setting.wells() {
        if let Control::Pressure(pressure) = setting.problem().wells[placed.well].control {
            include(placed.cells[0], pressure);
        }
    }
    let middle = |(low, high): (f64, f64)| if low <= high { low + 0.5 * (high - low) } else { 0.0 };
    ranges.into_iter().map(middle).collect()
}

fn pressure_wells<const D: usize>(
    setting: &Setting<'_, D>,
    references: &[f64],
) -> Result<Vec<PressureWell>, FlowError> {
    let mut wells = Vec::new();
    for placed in setting.wells() {
        let well = &setting.problem().wells[placed.well];
        if let Control::Pressure(pressure) = well.control {
            let equivalent = placed.equivalent_radius::<D>();
            let index = well_index::<D>(&well.name, placed.permeability, well.radius, equivalent)?;
            let compartment = setting.compartment_of()[placed.cells[0] as usize];
            wells.push(PressureWell {
                well: placed.well,
                cells: placed.cells.clone(),
                measure: placed.measure,
                index,
                pressure: pressure - references[compartment as usize],
            });
        }
    }
    Ok(wells)
}

/// The value of a polynomial.
pub(super) fn value(coefficients: &[f64], values: &[f64]) -> f64 {
    coefficients.iter().zip(values).map(|(c, v)| c * v).sum()
}

/// The gradient, in space, of a polynomial with these slopes along ξ.
pub(super) fn gradient<const D: usize>(affine: &Affine<D>, slopes: &Point<D>) -> Point<D> {
    std::array::from_fn(|axis| {
        let column: Point<D> = std::array::from_fn(|k| affine.gradients[k][axis]);
        dot(&column, slopes)
    })
}
