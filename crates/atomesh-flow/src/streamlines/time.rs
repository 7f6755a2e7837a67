//! The time of flight to each cell.

use std::collections::VecDeque;

use atomesh::watch::{Phase, Watch, check};

use super::options::Porosity;
use super::pieces::FluxField;
use crate::error::FlowError;
use crate::grid::FlowGrid;
use crate::setting::Setting;
use crate::solution::Solution;

/// Sweeps over cells in cycles end when times change by less than this share, or after so many.
const TOLERANCE: f64 = 1e-12;
const SWEEPS: usize = 1000;

/// The mean time of flight from the inflow to each cell: `v·∇τ = φ` by first-order upwind differences,
/// `Σ F_out τ_K = Σ F_in τ_upwind + φ |K|`, solved in the order of the flow (Natvig & Lie 2008). Infinite where nothing
/// flows through a cell. Cost: O(cells), and a sweep over the cells in cycles until they converge, if there are any.
///
/// # Errors
/// [`FlowError::Porosity`], [`FlowError::PorosityCount`], [`FlowError::Cancelled`].
pub fn time_of_flight<const D: usize>(
    grid: &FlowGrid<D>,
    setting: &Setting<'_, D>,
    solution: &Solution<D>,
    porosity: Porosity<'_>,
    watch: &mut dyn Watch,
) -> Result<Vec<f64>, FlowError> {
    porosity.check(grid.cell_count())?;
    let field = FluxField::new(grid, setting, solution);
    let (order, sorted) = flow_order(&field);
    let mut times = vec![f64::INFINITY; grid.cell_count()];
    let update = |cell: usize, times: &mut Vec<f64>| {
        let (mut inward, mut sum) = (0.0, porosity.of(cell) * grid.measures()[cell]);
        for &facet in grid.facets_of(cell) {
            let flux = -field.out_of(cell, facet as usize);
            let upwind = field.beyond(cell, facet as usize);
            let before = upwind.map_or(0.0, |upwind| times[upwind as usize]);
            // a flux from a cell without flow is rounding
            if flux > 0.0 && before.is_finite() {
                inward += flux;
                sum += flux * before;
            }
        }
        let through = inward + solution.sources[cell].max(0.0);
        let time = if through > 0.0 { sum / through } else { f64::INFINITY };
        let change = (time - times[cell]).abs();
        times[cell] = time;
        if time.is_finite() && change > TOLERANCE * time { 1 } else { 0 }
    };
    check(watch, Phase::Trace, 0.0, None)?;
    for &cell in &order[..sorted] {
        update(cell as usize, &mut times);
    }
    let cycles = &order[sorted..];
    cycles.iter().for_each(|&cell| times[cell as usize] = 0.0);
    for sweep in 0..SWEEPS {
        check(watch, Phase::Trace, sweep as f64 / SWEEPS as f64, None)?;
        let changed: usize = cycles.iter().map(|&cell| update(cell as usize, &mut times)).sum();
        if changed == 0 {
            break;
        }
    }
    check(watch, Phase::Trace, 1.0, None)?;
    Ok(times)
}

/// The cells in the order of the flow, each after all that flow into it, and how many could be ordered so. Where only
/// cycles are left, the cell that the flow reached first comes next, so that few sweeps are needed.
fn flow_order<const D: usize>(field: &FluxField<'_, D>) -> (Vec<u32>, usize) {
    let grid = field.grid;
    let count = grid.cell_count();
    let into = |cell: usize| {
        let facets = grid.facets_of(cell).iter();
        facets.filter(move |&&f| {
            field.out_of(cell, f as usize) < 0.0 && field.beyond(cell, f as usize).is_some()
        })
    };
    let mut waits: Vec<usize> = (0..count).map(|cell| into(cell).count()).collect();
    let mut done: Vec<bool> = waits.iter().map(|&waits| waits == 0).collect();
    let mut order: Vec<u32> = (0..count as u32).filter(|&cell| done[cell as usize]).collect();
    // the cells that the flow has reached, then all others
    let (mut reached, mut others) = (VecDeque::new(), 0..count as u32);
    let (mut at, mut sorted) = (0, None);
    while order.len() < count {
        let Some(&cell) = order.get(at) else {
            sorted = sorted.or(Some(order.len()));
            let next = reached.pop_front().or_else(|| others.next());
            let Some(next) = next else { break };
            if !std::mem::replace(&mut done[next as usize], true) {
                order.push(next);
            }
            continue;
        };
        at += 1;
        for &facet in grid.facets_of(cell as usize) {
            let out = field.out_of(cell as usize, facet as usize) > 0.0;
            let Some(next) = field.beyond(cell as usize, facet as usize).filter(|_| out) else {
                continue;
            };
            waits[next as usize] -= 1;
            if done[next as usize] {
                continue;
            }
            if waits[next as usize] == 0 {
                done[next as usize] = true;
                order.push(next);
            } else {
                reached.push_back(next);
            }
        }
    }
    let sorted = sorted.unwrap_or(order.len());
    (order, sorted)
}
