//! Streamlines and times of flight, from fluxes through facets alone.
//!
//! In a triangle or tetrahedron the velocity is that of the least order that has the cell's fluxes (Raviart & Thomas
//! 1977), `v = Σ F_i (x − x_i) / (D |K|)`, x_i the corner opposite facet i. A line in it is straight, and each
//! barycentric coordinate follows an equation of its own, so that where and when it leaves is a closed form (Pollock
//! 1988; Matringe, Juanes & Tchelepi 2006). Voronoi cells are cut into simplices about their centroid (`pieces`).
//! Lines go from simplex to simplex by their corners' numbers, never by searching for a place, so they do not leave
//! the mesh; a facet without flux is never crossed. Each line stands for the same flow (`starts`).

mod follow;
mod pieces;
mod simplex;
mod starts;
#[cfg(test)]
mod tests;
mod time;

use atomesh::geometry::Point;
use atomesh::watch::{Phase, Watch, check};
use rayon::prelude::*;

use crate::error::FlowError;
use crate::grid::Grid;
use crate::setting::Setting;
use crate::solution::Solution;

pub use time::time_of_flight;

use follow::Tracer;
use pieces::Field;
use starts::starts;

/// Lines between two looks at the watch.
const BATCH: usize = 64;

/// Why a streamline ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum End {
    /// At a well.
    Well,
    /// On the boundary, where something flows out.
    Boundary,
    /// Where nothing flows out of a cell, or around a corner without end.
    Stagnation,
    /// After as many segments as allowed.
    Limit,
}

/// The way of a particle.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Streamline<const D: usize> {
    /// Its points, from the start on. Two points of a line are apart.
    #[serde(serialize_with = "as_vectors")]
    pub points: Vec<Point<D>>,
    /// The time of flight from the start to each point.
    pub times: Vec<f64>,
    /// The cell of each segment between two points.
    pub cells: Vec<u32>,
    /// The well that it comes from, by its number in the problem; `None` from the boundary.
    pub from: Option<usize>,
    /// The well that it goes to.
    pub to: Option<usize>,
    /// Why it ends.
    pub end: End,
}

fn as_vectors<const D: usize, S: serde::Serializer>(
    points: &[Point<D>],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(points.iter().map(|point| point.as_slice()))
}

/// The share of a cell that fluid fills, more than 0 and at most 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Porosity<'a> {
    /// The same everywhere.
    Constant(f64),
    /// One for each cell.
    Cells(&'a [f64]),
}

impl Porosity<'_> {
    /// Finds the first value that is no porosity.
    ///
    /// # Errors
    /// [`FlowError::Porosity`] and [`FlowError::PorosityCount`].
    pub fn check(&self, cell_count: usize) -> Result<(), FlowError> {
        let values = match self {
            Self::Constant(value) => std::slice::from_ref(value),
            Self::Cells(values) if values.len() != cell_count => {
                let (found, expected) = (values.len(), cell_count);
                return Err(FlowError::PorosityCount { found, expected });
            }
            Self::Cells(values) => values,
        };
        match values.iter().position(|&value| !(value > 0.0 && value <= 1.0)) {
            Some(cell) => Err(FlowError::Porosity { cell, value: values[cell] }),
            None => Ok(()),
        }
    }

    /// The porosity of a cell.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn of(&self, cell: usize) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Cells(values) => values[cell],
        }
    }
}

/// Options of [`trace`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceOptions<'a> {
    /// How many lines, dealt among wells and boundaries by what flows in there. Default 100.
    pub count: usize,
    /// The porosity. Default 1, so that times are those of the Darcy velocity.
    pub porosity: Porosity<'a>,
    /// The most segments of a line. Default 100 000.
    pub limit: usize,
}

impl Default for TraceOptions<'_> {
    fn default() -> Self {
        Self { count: 100, porosity: Porosity::Constant(1.0), limit: 100_000 }
    }
}

/// Follows lines from where something flows in, wells in their order and then the boundary, each for the same share of
/// the flow. The same bits at any number of threads.
///
/// A line from a well begins at the well's place. Where a well takes all that flows into its cells, lines end at its
/// place. Between the well and the boundary of its cells the line is straight, and takes the time in which the
/// well fills, or empties, the pores of its cells: `φ V / Q`, exact for radial flow. What a source term brings in along the way
/// starts no lines. Cost: O(segments); for Voronoi cells a small dense system for each cell passed.
///
/// # Errors
/// [`FlowError::Porosity`], [`FlowError::PorosityCount`], [`FlowError::Cancelled`].
pub fn trace<const D: usize>(
    grid: &Grid<D>,
    setting: &Setting<'_, D>,
    solution: &Solution<D>,
    options: &TraceOptions<'_>,
    watch: &mut dyn Watch,
) -> Result<Vec<Streamline<D>>, FlowError> {
    options.porosity.check(grid.cell_count())?;
    let field = Field::new(grid, setting, solution);
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
