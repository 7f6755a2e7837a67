//! Streamlines and times of flight, from fluxes through facets alone.
//!
//! In a triangle or tetrahedron the velocity is the lowest-order field with the cell's fluxes (Raviart & Thomas
//! 1977), `v = Σ F_i (x − x_i) / (D |K|)`, x_i the corner opposite facet i. A line in it is straight, and each
//! barycentric coordinate obeys its own equation, so that place and time of exit are a closed form (Pollock
//! 1988; Matringe, Juanes & Tchelepi 2006). Voronoi cells are cut into simplices about their centroid (`pieces`).
//! Lines go from simplex to simplex by their corners' numbers, without searching for places. So they do not leave
//! the mesh, and never cross a facet without flux. Each line stands for the same flow (`starts`).

mod follow;
mod line;
mod options;
mod pieces;
mod simplex;
mod starts;
#[cfg(test)]
mod tests;
mod time;
mod wells;

use atomesh::watch::{Phase, Watch, check};
use rayon::prelude::*;

use crate::error::FlowError;
use crate::grid::FlowGrid;
use crate::setting::Setting;
use crate::solution::Solution;

pub use line::{End, Streamline};
pub use options::{Porosity, TraceOptions};
pub use time::time_of_flight;

use follow::Tracer;
use pieces::FluxField;
use starts::starts;

/// Lines between two steps of the watch.
const BATCH: usize = 64;

/// Follows lines from the inflow, through wells in their order and then the boundary, each for the same share of
/// the flow. The same bits at any number of threads.
///
/// A line from a well begins at the well's place; lines end at the place of a well that takes all that flows into its
/// cells. Between the well and the boundary of its cells a line is straight and takes the time in which the
/// well fills, or empties, the pores of its cells: `φ V / Q`, exact for radial flow. No lines start at a source term.
/// Cost: O(segments); for Voronoi cells a small dense system for each cell passed.
///
/// # Errors
/// [`FlowError::Porosity`], [`FlowError::PorosityCount`], [`FlowError::Cancelled`].
pub fn trace<const D: usize>(
    grid: &FlowGrid<D>,
    setting: &Setting<'_, D>,
    solution: &Solution<D>,
    options: &TraceOptions<'_>,
    watch: &mut dyn Watch,
) -> Result<Vec<Streamline<D>>, FlowError> {
    options.porosity.check(grid.cell_count())?;
    let field = FluxField::new(grid, setting, solution);
    let starts = starts(&field, setting, options);
    let tracer = Tracer::new(&field, setting, options);
    let mut lines = Vec::with_capacity(starts.len());
    for batch in starts.chunks(BATCH) {
        check(watch, Phase::Trace, lines.len() as f64 / starts.len() as f64, None)?;
        lines.par_extend(batch.par_iter().map(|start| tracer.follow(start)));
    }
    check(watch, Phase::Trace, 1.0, None)?;
    Ok(lines)
}
