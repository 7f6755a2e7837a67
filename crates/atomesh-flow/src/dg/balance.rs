//! Corrects the fluxes so that every cell balances.
//!
//! Equations are solved to rounding, or to a tolerance, of the pressures. Where little flows compared with what the
//! pressures could drive, as through a sealing layer, this error can be a large part of the flow. So each cell's excess,
//! inflow less outflow, is passed from neighbour to neighbour, on a shortest path, to where it may leave: a facet or a
//! well of given pressure. In a compartment with neither, the excesses sum to 0, and its pinned cell is left with
//! rounding. A flux changes by at most the sum of the excesses, which are the residual of the equations.

use super::scheme::Scheme;

/// Fluxes through facets, inflow of cells from sources and wells, and rates of wells of given pressure.
pub(super) struct Flows {
    pub fluxes: Vec<f64>,
    pub sources: Vec<f64>,
    pub rates: Vec<f64>,
}

/// Makes every cell balance to rounding of its own fluxes. Cost: O(cells).
pub(super) fn balance<const D: usize>(scheme: &Scheme<'_, D>, flows: &mut Flows) {
    let facets = scheme.grid.facets();
    let mut excess = flows.sources.clone();
    for (facet, flux) in facets.iter().zip(&flows.fluxes) {
        excess[facet.cell as usize] -= flux;
        if let Some(other) = facet.neighbour {
            excess[other as usize] += flux;
        }
    }
    let (order, ways) = ways(scheme);
    for cell in order.into_iter().rev().map(|cell| cell as usize) {
        let Way::Facet(number) = ways[cell] else {
            leave(scheme, flows, cell, excess[cell]);
            continue;
        };
        let facet = &facets[number as usize];
        let is_first = facet.cell as usize == cell;
        flows.fluxes[number as usize] += if is_first { excess[cell] } else { -excess[cell] };
        if let Some(other) = facet.neighbour {
            excess[if is_first { other } else { facet.cell } as usize] += excess[cell];
        }
    }
}

/// Where a cell's excess goes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    /// Unknown yet, or nowhere.
    None,
    /// Through a facet.
    Facet(u32),
    /// Into a well of given pressure, or that which pins the pressure of a compartment.
    Well,
}

/// The way of each cell, and the cells in an order in which each comes after the one that its excess goes to.
fn ways<const D: usize>(scheme: &Scheme<'_, D>) -> (Vec<u32>, Vec<Way>) {
    let mut ways = vec![Way::None; scheme.grid.cell_count()];
    let mut order: Vec<u32> = Vec::with_capacity(ways.len());
    for cell in 0..ways.len() as u32 {
        let mut own = scheme.grid.facets_of(cell as usize).iter();
        let is_exit = |facet: &&u32| {
            let interface = &scheme.interfaces[**facet as usize];
            interface.is_some() && scheme.grid.facets()[**facet as usize].neighbour.is_none()
        };
        if scheme.pin(cell) > 0.0 || scheme.pressure_wells_of(cell).next().is_some() {
            ways[cell as usize] = Way::Well;
            order.push(cell);
        } else if let Some(&facet) = own.find(is_exit) {
            ways[cell as usize] = Way::Facet(facet);
            order.push(cell);
        }
    }
    let mut next = 0;
    while let Some(&cell) = order.get(next) {
        next += 1;
        for &facet in scheme.grid.facets_of(cell as usize) {
            let Some(interface) = &scheme.interfaces[facet as usize] else { continue };
            for side in interface.sides() {
                if ways[side.cell as usize] == Way::None {
                    ways[side.cell as usize] = Way::Facet(facet);
                    order.push(side.cell);
                }
            }
        }
    }
    (order, ways)
}

/// Gives the excess of a cell to its well of given pressure.
fn leave<const D: usize>(scheme: &Scheme<'_, D>, flows: &mut Flows, cell: usize, excess: f64) {
    if let Some(well) = scheme.pressure_wells_of(cell as u32).next() {
        flows.sources[cell] -= excess;
        flows.rates[well.well] -= excess;
    }
}
