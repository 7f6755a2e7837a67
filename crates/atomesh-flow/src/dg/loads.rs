//! The right-hand side, from the source term, wells and the boundary.

use atomesh::geometry::Point;
use rayon::prelude::*;

use super::basis::MOST;
use super::scheme::Scheme;
use crate::problem::{Condition, Control, Value};

/// The right-hand side, and the inflow of each cell from the source term and wells of given rate.
pub(super) struct Loads {
    pub rhs: Vec<f64>,
    pub sources: Vec<f64>,
}

/// Makes the loads. In compartments without a given pressure, the source term and the fluxes on the boundary sum to 0
/// only to the error of quadrature; the excess is subtracted evenly, as a source.
pub(super) fn loads<const D: usize>(scheme: &Scheme<'_, D>) -> Loads {
    let count = scheme.element.count();
    let cells = (0..scheme.grid.cell_count()).into_par_iter();
    let mut rhs = vec![0.0; scheme.grid.cell_count() * count];
    let mut sources: Vec<f64> = cells
        .zip(rhs.par_chunks_exact_mut(count))
        .map(|(cell, own)| add_source(scheme, cell, own))
        .collect();
    for placed in scheme.setting.wells() {
        if let Control::Rate(rate) = scheme.setting.problem().wells[placed.well].control {
            for &cell in &placed.cells {
                sources[cell as usize] +=
                    rate * scheme.grid.measures()[cell as usize] / placed.measure;
            }
        }
    }
    balance_pinned(scheme, &mut sources);
    for (own, source) in rhs.chunks_exact_mut(count).zip(&sources) {
        own[0] = *source;
    }
    for well in &scheme.pressure_wells {
        for &cell in &well.cells {
            let share = scheme.grid.measures()[cell as usize] / well.measure;
            rhs[cell as usize * count] += share * well.index * well.pressure;
        }
    }
    for facet in 0..scheme.grid.facets().len() {
        match scheme.setting.condition(facet) {
            Some(Condition::Pressure(value)) => add_pressure(scheme, facet, &value, &mut rhs),
            Some(Condition::Flux(value)) => add_flux(scheme, facet, &value, &mut rhs),
            None => {}
        }
    }
    Loads { rhs, sources }
}

/// Writes the source term's part of a cell's equations; returns the cell's inflow from it.
fn add_source<const D: usize>(scheme: &Scheme<'_, D>, cell: usize, into: &mut [f64]) -> f64 {
    let measure = scheme.grid.measures()[cell];
    let field = match &scheme.setting.problem().source {
        None => return 0.0,
        Some(Value::Constant(q)) => {
            into[0] = q * measure;
            return into[0];
        }
        Some(field) => field,
    };
    let mesh = scheme.grid.mesh().expect("checked before");
    let corners = &mesh.corners()[cell * (D + 1)..(cell + 1) * (D + 1)];
    let rule = &scheme.element.cell_rule;
    for ((barycentric, weight), values) in
        rule.places().zip(&rule.weights).zip(&scheme.element.samples)
    {
        let q = measure * weight * field.at(&place(mesh.points(), corners, barycentric));
        into.iter_mut().zip(values).for_each(|(sum, value)| *sum += q * value);
    }
    into[0]
}

/// The place of barycentric coordinates.
pub(super) fn place<const D: usize>(
    points: &[Point<D>],
    corners: &[u32],
    barycentric: &[f64],
) -> Point<D> {
    std::array::from_fn(|axis| {
        corners.iter().zip(barycentric).map(|(&c, x)| x * points[c as usize][axis]).sum()
    })
}

fn balance_pinned<const D: usize>(scheme: &Scheme<'_, D>, sources: &mut [f64]) {
    let compartments = scheme.setting.compartments();
    let compartment_of = scheme.setting.compartment_of();
    let mut excess = vec![0.0; compartments.len()];
    for (cell, source) in sources.iter().enumerate() {
        excess[compartment_of[cell] as usize] += source;
    }
    for (number, facet) in scheme.grid.facets().iter().enumerate() {
        if let Some(Condition::Flux(value)) = scheme.setting.condition(number) {
            excess[compartment_of[facet.cell as usize] as usize] +=
                scheme.facet_integral(number, &value);
        }
    }
    for (cell, source) in sources.iter_mut().enumerate() {
        let number = compartment_of[cell] as usize;
        if !compartments[number].has_pressure {
            *source -= excess[number] * scheme.grid.measures()[cell] / compartments[number].measure;
        }
    }
}

fn add_pressure<const D: usize>(
    scheme: &Scheme<'_, D>,
    facet: usize,
    value: &Value<'_, D>,
    rhs: &mut [f64],
) {
    let Some(interface) = &scheme.interfaces[facet] else { return };
    let side = interface.side_of(scheme.grid.facets()[facet].cell);
    let trace = scheme.element.trace(side.trace);
    let count = scheme.element.count();
    let own = &mut rhs[side.cell as usize * count..][..count];
    let mut slopes = [0.0; MOST];
    for (node, weight) in scheme.element.facet_rule.weights.iter().enumerate() {
        trace.slopes_along(&side.direction, node, &mut slopes);
        let given = value.at(&scheme.node(facet, node)) - scheme.reference_of(facet);
        let given = weight * interface.measure * given;
        for (k, sum) in own.iter_mut().enumerate() {
            *sum += given
                * (interface.jump_weight * trace.values(node)[k]
                    + interface.sign * interface.slope_weight * slopes[k]);
        }
    }
}

fn add_flux<const D: usize>(
    scheme: &Scheme<'_, D>,
    facet: usize,
    value: &Value<'_, D>,
    rhs: &mut [f64],
) {
    let cell = scheme.grid.facets()[facet].cell;
    let trace = scheme.element.trace(super::interface::trace_of(scheme.grid, facet, cell));
    let count = scheme.element.count();
    let measure = scheme.grid.facets()[facet].measure();
    let own = &mut rhs[cell as usize * count..][..count];
    for (node, weight) in scheme.element.facet_rule.weights.iter().enumerate() {
        let flow = weight * measure * value.at(&scheme.node(facet, node));
        own.iter_mut().zip(trace.values(node)).for_each(|(sum, value)| *sum += flow * value);
    }
}
