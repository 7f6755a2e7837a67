//! What solving leaves unbalanced, sent away.
//!
//! Equations are solved to rounding, or to a tolerance, of pressures; where little flows beside what pressures could
//! move, as through a sealing layer, that can be much of the flow. So each cell's excess, what comes in less what goes
//! out, is passed on from neighbour to neighbour, on a shortest way, to where it may leave: a facet of given
//! pressure or a well of given pressure. In a compartment with neither the excesses sum to 0, and what is left to its
//! pinned cell is rounding. Fluxes change by no more than the excesses, the residual of the equations, sum to.

use super::scheme::Scheme;

/// Fluxes through facets, and what flows into cells by sources and wells together, and by wells of given pressure.
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
    /// Not known yet, or nowhere.
    None,
    /// Through a facet.
    Facet(u32),
    /// Into a well of given pressure, or that which pins the pressure.
    Well,
}

/// The way of each cell, and the cells in an order in which each comes after that to which it passes its excess.
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

/// Lets the excess of a cell go into its well of given pressure.
fn leave<const D: usize>(scheme: &Scheme<'_, D>, flows: &mut Flows, cell: usize, excess: f64) {
    if let Some(well) = scheme.pressure_wells_of(cell as u32).next() {
        flows.sources[cell] -= excess;
        flows.rates[well.well] -= excess;
    }
}
