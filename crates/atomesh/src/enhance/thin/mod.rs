//! Features thinned to crests, and widened again to valleys of one depth and width.
//!
//! However ridges, edges, horizons and faults differ, they are found in one order ([`crests`]):
//!
//! 1. options are checked, and steps measured in the least one;
//! 2. a field is made of the image, and at every sample the direction across the feature that may be there;
//! 3. only where the field is greatest along that direction is there a crest, a point between samples (non-maximum
//!    suppression);
//! 4. of all crests those stay that are strong, or linked to strong ones, in large enough groups (hysteresis).
//!
//! Then [`widen`] makes b of them.

mod crossings;
mod edges;
mod faults;
mod horizons;
mod options;
mod ridges;
mod unit;

pub use faults::FaultOptions;
pub use horizons::HorizonOptions;
pub use options::{CrestOptions, Polarity};

use super::{EnhanceError, Enhanced, FeatureOptions, Features, to_lattice};
use crate::crests::{FeaturePoint, Hysteresis, linked, widen};
use crate::image::{Grid, Image, Samples};
use crate::parallel::prelude::*;
use crate::watch::{Phase, Watch, check};
use edges::Edges;
use faults::Faults;
use horizons::Horizons;
use options::Thresholds;
use ridges::Ridges;
pub(super) use ridges::valleys;

/// The width of the valleys made of thinned features, in least steps an axis: 1 in the plane, 1.5 in space. Edges of
/// a brain (d = 6) were followed to 0.64 with 1 and 0.66 with 1.5; with 2 cells were bad.
const WIDTH: f64 = 0.5;

/// What tells the crests of one kind of features.
trait Finder<const D: usize> {
    /// What is found, as messages name it.
    const KIND: &'static str;
    /// The thresholds that stand where none are given.
    const THRESHOLDS: Thresholds;

    /// The options that all finders share.
    fn options(&self) -> &CrestOptions;

    /// Refuses options out of the finder's own ranges.
    fn check(&self) -> Result<(), EnhanceError> {
        Ok(())
    }

    /// The points at which the finder's field is greatest across features, their strengths within 0…1, in an image of
    /// finite values; none if it is constant. Positions are in samples, normals per lattice unit.
    fn points(
        &self,
        values: &[f32],
        grid: &Grid<D>,
        watch: &mut dyn Watch,
    ) -> Result<Vec<FeaturePoint<D>>, EnhanceError>;

    /// The fewest points of features of a measure: of a length, or its square.
    fn least_count(measure: f64) -> usize {
        measure.ceil() as usize
    }
}

/// The crests of an image of finite values, in the order of their samples; none if the image is constant.
///
/// # Errors
/// [`EnhanceError::Option`] for an option out of its range, [`EnhanceError::Cancelled`] if the watch ends the work.
///
/// # Panics
/// If there are not as many values as the grid has samples.
fn crests<const D: usize, F: Finder<D>>(
    finder: &F,
    values: &[f32],
    grid: &Grid<D>,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, EnhanceError> {
    finder.options().check(F::KIND)?;
    finder.check()?;
    check(watch, Phase::Potential, 0.0, None)?;
    let points = finder.points(values, grid, watch)?;
    let Thresholds { low, high, least_length } = finder.options().thresholds(F::THRESHOLDS);
    // strengths are in single precision, and a threshold is compared as one of them
    let kept = linked(
        points,
        grid.shape,
        Hysteresis {
            low: f64::from(low as f32),
            high: f64::from(high as f32),
            least_count: F::least_count(least_length.powi(D as i32 - 1)),
        },
    );
    check(watch, Phase::Potential, 1.0, None)?;
    Ok(kept)
}

/// The potential of features that are thinned to crests: valleys of one depth and width.
pub(super) fn thinned<const D: usize>(
    image: &Image<D>,
    options: &FeatureOptions,
    watch: &mut dyn Watch,
) -> Result<Enhanced<D>, EnhanceError> {
    let grid = image.frame().grid(options.units);
    let width = match options.smooth {
        Some(width) if width > 0.0 => width,
        _ => WIDTH * D as f64 * grid.least_step(),
    };
    let mut crests = crest_points(image, options, watch)?;
    check(watch, Phase::Potential, 0.9, None)?;
    let mut values = widen(&crests, &grid, width);
    if options.repel {
        values.par_iter_mut().for_each(|b| *b = -*b + 0.0); // no −0
    }
    check(watch, Phase::Potential, 1.0, None)?;
    to_lattice(&mut crests, &grid);
    Ok(Enhanced { values, constant: crests.is_empty(), crests: Some(crests) })
}

/// The crests of features that are thinned, or of edges; positions in samples, normals per lattice unit.
pub(super) fn crest_points<const D: usize>(
    image: &Image<D>,
    options: &FeatureOptions,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, EnhanceError> {
    let grid = image.frame().grid(options.units);
    let copied;
    let values = match image.samples() {
        Samples::F32(values) => &**values,
        other => {
            copied = other.to_f32();
            &copied
        }
    };
    match options.features {
        Features::Ridges => crests(&Ridges(options.ridges), values, &grid, watch),
        Features::Faults => crests(&Faults(options.faults), values, &grid, watch),
        Features::Horizons => crests(&Horizons(options.horizons), values, &grid, watch),
        _ => crests(&Edges(options.edges), values, &grid, watch),
    }
}
