//! Properties of cells from an image: means, deviations, extremes, majorities and totals of the samples inside.
//!
//! A sample stands for the box around it, one sample wide and cut at the image's box: on a side of the image's box half
//! of it is inside, on an edge a quarter, at a corner an eighth. So the boxes of all samples fill the image's box, and
//! totals are conserved: summed over cells that fill the box, they are the sum over samples of value times box. A sample
//! counts by the exact volume (in 2-D area) that its box shares with the cell (`overlap`), not by its centre.
//!
//! Cells and image may have different frames; each cell is moved to the image's sample coordinates. Where there is no
//! image, or a sample is not finite, a cell has no samples; its *coverage* is the part that has. Cells are handled in
//! parallel, each by itself: overlaps, sums, statistics. The same result at any thread count. Cost: O(samples in the
//! bounds of the cells).

mod cells;
mod clip;
mod overlap;
mod statistic;

#[cfg(test)]
mod tests;

use crate::geometry::Point;
use crate::image::{Frame, Image, Samples, Units};
use crate::parallel::prelude::*;
use crate::watch::{Cancelled, Phase, Watch, check};
pub use cells::CellSurfaces;
use clip::Axis;
use overlap::{Overlaps, Surface};
use statistic::Tally;
pub use statistic::{Statistic, UnknownStatistic};

/// Cells sampled between two looks at the watch; a few tenths of a second.
const CELLS_PER_STEP: usize = 1 << 15;

/// Cells that a thread takes at once.
const CELLS_PER_TASK: usize = 64;

/// Overlaps below this share of a sample's box or of the cell, whichever is smaller, count only in totals: they may be
/// roundings, which with coordinates up to 10⁴ samples are some 10⁻¹².
const ROUNDING: f64 = 1e-9;

/// Why cells cannot be sampled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// The image's box has no extent.
    #[error("the image has 1 sample along {}; expected 2 or more along every axis", ["x", "y", "z"][*axis])]
    Thin {
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
    },
    /// The number of samples differs from the frame's.
    #[error("{found} samples for a frame that holds {expected}")]
    SampleCount {
        /// The product of the frame's shape.
        expected: usize,
        /// The number of samples given.
        found: usize,
    },
    /// A negative sample, for a mean that needs samples of 0 or more.
    #[error("sample {index} is {value}; the {statistic} mean needs samples of 0 or more")]
    Negative {
        /// The mean asked for.
        statistic: Statistic,
        /// The sample's index, x fastest.
        index: usize,
        /// The sample found.
        value: f64,
    },
    /// A label that is not a whole number.
    #[error("sample {index} is {value}; the {statistic} of labels needs whole numbers")]
    Label {
        /// The statistic asked for.
        statistic: Statistic,
        /// The sample's index, x fastest.
        index: usize,
        /// The sample found.
        value: f64,
    },
    /// The work was ended by its watch.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// How cells are sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleOptions<'a> {
    /// What is computed, in the order of the results.
    pub statistics: &'a [Statistic],
    /// The value of cells without samples, other than of totals. Default: NaN.
    pub fill: f64,
}

impl<'a> SampleOptions<'a> {
    /// The defaults for some statistics.
    pub fn new(statistics: &'a [Statistic]) -> Self {
        Self { statistics, fill: f64::NAN }
    }
}

/// The statistics of the samples in each cell.
#[derive(Clone, Debug, PartialEq)]
pub struct CellProperties {
    /// A value for each cell, for each statistic in the order asked for.
    pub values: Vec<Vec<f64>>,
    /// The measure of each cell in world units, without its sign.
    pub measures: Vec<f64>,
    /// The part of each cell that has samples, from 0 to 1.
    pub coverage: Vec<f64>,
}

impl CellProperties {
    /// The number of cells with a coverage below 1.
    pub fn partial_count(&self) -> usize {
        self.coverage.iter().filter(|&&part| part < 1.0).count()
    }
}

/// The statistics of the samples of `image` in each of `cells`, which lie in the world.
///
/// # Errors
/// As [`sample_in_frame`].
pub fn sample<const D: usize>(
    cells: &impl CellSurfaces<D>,
    image: &Image<D>,
    options: SampleOptions<'_>,
    watch: &mut dyn Watch,
) -> Result<CellProperties, SampleError> {
    sample_in_frame(cells, image.frame(), image.samples(), options, watch)
}

/// [`sample`] for samples and cells in any coordinates that `frame` maps samples to, such as lattice coordinates.
///
/// # Errors
/// [`SampleError`] if the image has one sample along an axis or another number of samples than the frame, a
/// mean or majority is not defined for the samples, or the watch ends the work.
pub fn sample_in_frame<const D: usize>(
    cells: &impl CellSurfaces<D>,
    frame: &Frame<D>,
    samples: &Samples,
    options: SampleOptions<'_>,
    watch: &mut dyn Watch,
) -> Result<CellProperties, SampleError> {
    check_samples(frame, samples, options.statistics)?;
    let sampler =
        Sampler { cells, frame, samples, options, unit: frame.spacing().iter().product() };
    let (count, kinds) = (cells.cell_count(), options.statistics.len());
    let mut properties = CellProperties {
        values: vec![Vec::with_capacity(count); kinds],
        measures: Vec::with_capacity(count),
        coverage: Vec::with_capacity(count),
    };
    for start in (0..count).step_by(CELLS_PER_STEP) {
        check(watch, Phase::Measure, start as f64 / count as f64, None)?;
        let range = start..count.min(start + CELLS_PER_STEP);
        let found: Vec<Found> = range
            .into_par_iter()
            .with_min_len(CELLS_PER_TASK)
            .map_init(
                || Buffers::new(frame, options.statistics),
                |buffers, cell| sampler.cell(cell, buffers),
            )
            .collect();
        for Found { measure, coverage, values } in found {
            properties.measures.push(measure);
            properties.coverage.push(coverage);
            properties.values.iter_mut().zip(values).for_each(|(all, value)| all.push(value));
        }
    }
    Ok(properties)
}

/// Checks that there are as many samples as the frame says, and that every statistic is defined for them.
pub(crate) fn check_samples<const D: usize>(
    frame: &Frame<D>,
    samples: &Samples,
    statistics: &[Statistic],
) -> Result<(), SampleError> {
    let (expected, found) = (frame.sample_count(), samples.len());
    if found != expected {
        return Err(SampleError::SampleCount { expected, found });
    }
    if let Some(axis) = frame.shape().iter().position(|&n| n < 2) {
        return Err(SampleError::Thin { axis });
    }
    let first = |wrong: &(dyn Fn(f64) -> bool + Sync)| {
        let index = (0..found).into_par_iter().find_first(|&i| wrong(samples.get(i)))?;
        Some((index, samples.get(index)))
    };
    if let Some(&statistic) = statistics.iter().find(|s| s.needs_positive())
        && let Some((index, value)) = first(&|v| v.is_finite() && v < 0.0)
    {
        return Err(SampleError::Negative { statistic, index, value });
    }
    let is_whole = !matches!(samples, Samples::F32(_) | Samples::F64(_));
    if let Some(&statistic) = statistics.iter().find(|s| s.needs_labels() && !is_whole)
        && let Some((index, value)) = first(&|v| v.is_finite() && v.fract() != 0.0)
    {
        return Err(SampleError::Label { statistic, index, value });
    }
    Ok(())
}

/// The properties of one cell.
struct Found {
    measure: f64,
    coverage: f64,
    values: Vec<f64>,
}

/// Buffers that a thread uses again for each of its cells.
struct Buffers {
    surface: Surface,
    overlaps: Overlaps,
    tally: Tally,
}

impl Buffers {
    fn new<const D: usize>(frame: &Frame<D>, statistics: &[Statistic]) -> Self {
        let axis = |k: usize| match frame.shape().get(k) {
            Some(&count) => Axis::of_samples(count),
            None => Axis::single(),
        };
        Self {
            surface: Surface::default(),
            overlaps: Overlaps::new(std::array::from_fn(axis)),
            tally: Tally::new(statistics),
        }
    }
}

struct Sampler<'a, const D: usize, C> {
    cells: &'a C,
    frame: &'a Frame<D>,
    samples: &'a Samples,
    options: SampleOptions<'a>,
    /// The measure in the world of a box one sample wide.
    unit: f64,
}

impl<const D: usize, C: CellSurfaces<D>> Sampler<'_, D, C> {
    fn cell(&self, cell: usize, buffers: &mut Buffers) -> Found {
        let Buffers { surface, overlaps, tally } = buffers;
        surface.clear();
        self.cells.visit_facets(cell, &mut |facet| push(surface, facet, self.frame));
        let signed = surface.measure();
        let (measure, sign) = (signed.abs(), signed.signum());
        tally.clear(ROUNDING * measure.min(1.0));
        let [nx, ny] = [self.frame.shape()[0], self.frame.shape()[1]];
        overlaps.each_row(surface, |[x, y, z], row| {
            let start = x + nx * (y + ny * z);
            for (i, overlap) in row.iter().enumerate() {
                tally.add(self.samples.get(start + i), sign * overlap);
            }
        });
        let coverage = if measure > 0.0 { (tally.weight / measure).min(1.0) } else { 0.0 };
        let values = self.options.statistics.iter().map(|&statistic| match statistic {
            Statistic::Total => tally.total(self.unit),
            _ if tally.weight == 0.0 => self.options.fill,
            _ => tally.value(statistic, self.unit),
        });
        Found {
            measure: measure * self.unit,
            coverage: if coverage > 1.0 - ROUNDING { 1.0 } else { coverage },
            values: values.collect(),
        }
    }
}

/// Adds a facet in sample coordinates; an edge in the plane (2-D) becomes a wall of height one.
fn push<const D: usize>(surface: &mut Surface, facet: &[Point<D>], frame: &Frame<D>) {
    let place = |p: &Point<D>, z: f64| -> Point<3> {
        let p = frame.world_to_lattice(Units::Samples, p);
        std::array::from_fn(|k| p.get(k).copied().unwrap_or(z))
    };
    if D == 2 {
        let below = facet.iter().map(|p| place(p, 0.0));
        let above = facet.iter().rev().map(|p| place(p, 1.0));
        surface.push(below.chain(above));
    } else {
        surface.push(facet.iter().map(|p| place(p, 0.0)));
    }
}
