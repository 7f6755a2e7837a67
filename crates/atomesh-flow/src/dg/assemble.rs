//! The matrix: the columns of each cell's rows, and their values.
//!
//! Each cell gathers its own rows from its facets, so that cells can be done in parallel and sums have a fixed
//! order. The price is that every facet is evaluated from both sides.

use std::ops::Range;

use atomesh::watch::{Cancelled, Phase, Watch, check};
use rayon::prelude::*;

use super::basis::MOST;
use super::interface::{Interface, Side, product};
use super::scheme::Scheme;
use crate::solve::Sparse;

/// Cells whose rows are made by one task.
const BLOCK: usize = 256;
/// Blocks between two steps of the watch.
const STRIDE: usize = 64;

/// Rows of consecutive cells.
#[derive(Default)]
struct Rows {
    lengths: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

/// The matrix. Cost: O(cells).
pub(super) fn matrix<const D: usize>(
    scheme: &Scheme<'_, D>,
    watch: &mut dyn Watch,
) -> Result<Sparse, Cancelled> {
    let cell_count = scheme.grid.cell_count();
    let size = cell_count * scheme.element.count();
    let mut all = Rows::default();
    let mut starts = Vec::with_capacity(size + 1);
    starts.push(0);
    for begin in (0..cell_count).step_by(BLOCK * STRIDE) {
        check(watch, Phase::Assemble, begin as f64 / cell_count as f64, None)?;
        let end = (begin + BLOCK * STRIDE).min(cell_count);
        let ranges: Vec<Range<usize>> =
            (begin..end).step_by(BLOCK).map(|first| first..(first + BLOCK).min(end)).collect();
        let blocks: Vec<Rows> = ranges.into_par_iter().map(|range| rows(scheme, range)).collect();
        for block in blocks {
            for length in block.lengths {
                starts.push(starts.last().copied().unwrap_or(0) + length);
            }
            all.columns.extend(block.columns);
            all.values.extend(block.values);
        }
    }
    Ok(Sparse::new(size, starts, all.columns, all.values))
}

fn rows<const D: usize>(scheme: &Scheme<'_, D>, cells: Range<usize>) -> Rows {
    let count = scheme.element.count();
    let mut rows = Rows::default();
    let mut beside: Vec<u32> = Vec::new();
    for cell in cells {
        find_beside(scheme, cell, &mut beside);
        let width = beside.len() * count;
        let first = rows.values.len();
        rows.values.resize(first + count * width, 0.0);
        fill(scheme, cell, &beside, &mut rows.values[first..]);
        for _ in 0..count {
            rows.lengths.push(width);
            for &other in &beside {
                let start = other * count as u32;
                rows.columns.extend(start..start + count as u32);
            }
        }
    }
    rows
}

/// The cells to which a cell is coupled, ascending, itself included: those beyond open facets, and those of the same
/// wells of given pressure.
fn find_beside<const D: usize>(scheme: &Scheme<'_, D>, cell: usize, beside: &mut Vec<u32>) {
    beside.clear();
    beside.push(cell as u32);
    for &facet in scheme.grid.facets_of(cell) {
        if let Some(interface) = &scheme.interfaces[facet as usize] {
            beside.extend(interface.sides().map(|side| side.cell));
        }
    }
    for well in scheme.pressure_wells_of(cell as u32) {
        beside.extend(&well.cells);
    }
    beside.sort_unstable();
    beside.dedup();
}

/// Fills a cell's rows, whose columns are the functions of the cells `beside`.
fn fill<const D: usize>(scheme: &Scheme<'_, D>, cell: usize, beside: &[u32], rows: &mut [f64]) {
    let count = scheme.element.count();
    let width = beside.len() * count;
    let at = |other: u32| beside.binary_search(&other).expect("it is beside") * count;
    let own = at(cell as u32);
    let affine = &scheme.cells[cell];
    let tensor = scheme.setting.permeability().tensor(cell);
    let measure = scheme.grid.measures()[cell];
    let metric = std::array::from_fn(|a| {
        let flow = product(&tensor, &affine.gradients[a]);
        affine.gradients.map(|gradient| measure * atomesh::geometry::dot(&flow, &gradient))
    });
    // slices start at the cell's own columns, so the last row may be shorter than `width`
    scheme.element.add_stiffness(&metric, &mut rows[own..], width);
    for &facet in scheme.grid.facets_of(cell) {
        if let Some(interface) = &scheme.interfaces[facet as usize] {
            let mine = interface.side_of(cell as u32);
            for side in interface.sides() {
                let coupling = Coupling { interface, mine, other: side };
                add_coupling(scheme, &coupling, &mut rows[at(side.cell)..], width);
            }
        }
    }
    for well in scheme.pressure_wells_of(cell as u32) {
        let share = measure / well.measure;
        for &other in &well.cells {
            let part = scheme.grid.measures()[other as usize] / well.measure;
            rows[at(other)] += well.index * share * part;
        }
    }
    rows[own] += scheme.pin(cell as u32);
}

/// Two sides of an interface, which may be the same.
struct Coupling<'a, const D: usize> {
    interface: &'a Interface<D>,
    mine: &'a Side<D>,
    other: &'a Side<D>,
}

/// Adds the terms of the other side's functions to the equations of mine.
fn add_coupling<const D: usize>(
    scheme: &Scheme<'_, D>,
    coupling: &Coupling<'_, D>,
    rows: &mut [f64],
    width: usize,
) {
    let Coupling { interface, mine, other } = coupling;
    let count = scheme.element.count();
    let (own, from) = (scheme.element.trace(mine.trace), scheme.element.trace(other.trace));
    let (mut own_slopes, mut slopes) = ([0.0; MOST], [0.0; MOST]);
    let (mut flux, mut law) = ([0.0; MOST], [0.0; MOST]);
    let (a, b) = (interface.slope_weight, interface.jump_weight);
    for (node, weight) in scheme.element.facet_rule.weights.iter().enumerate() {
        own.slopes_along(&mine.direction, node, &mut own_slopes);
        from.slopes_along(&other.direction, node, &mut slopes);
        let weight = weight * interface.measure;
        let values = from.values(node);
        for k in 0..count {
            let jump = other.sign * values[k];
            flux[k] = weight * mine.sign * (b * jump - a * slopes[k]);
            law[k] = weight * interface.sign * a * (jump + interface.resistance * slopes[k]);
        }
        for (i, (row, value)) in rows.chunks_mut(width).zip(own.values(node)).enumerate() {
            let slope = own_slopes[i];
            for (k, entry) in row[..count].iter_mut().enumerate() {
                *entry += value * flux[k] + slope * law[k];
            }
        }
    }
}
