//! Guides: points on the valleys of b that edges should follow.
//!
//! They are found from b as the run made it. Its features have a deviation of about a sample already, and it is
//! smoothed so far that they have max(1, d/6) in all. Valleys pull alike, whatever their depth. The least depth that
//! counts is relative to the deepest tenth of them, since smoothing thin features took most of their depth.

use crate::crests::{FeaturePoint, ValleySearch, bottoms, in_large_groups, strongest};
use crate::fields::{FieldsView, ScalarField};
use crate::geometry::Point;
use crate::watch::{Cancelled, Phase, Watch};

/// The least depth that counts at all: below it lies what a nearly constant image has.
const LEAST_DEPTH: f32 = 0.05;
/// The least depth over the depth of the deepest tenth. On two fault images, bottoms chosen so are those that
/// a sharper image shows: 0.99 and 0.98 of them found.
const DEPTH_SHARE: f32 = 0.22;
/// The least square of the added deviation, in samples: derivatives of less are those of noise.
const LEAST_VARIANCE: f64 = 0.8;
/// The cost of a missed length of valley, over d, where β = 1/2; a lost unit of a cell's q costs 1.
const PULL: f64 = 5.0;
/// The greatest β/(1 − β).
const GREATEST_ODDS: f64 = 4.0;

/// A point on a valley that edges should follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Guide {
    /// The point, in lattice space.
    pub at: FeaturePoint<2>,
    /// What it costs if no edge follows it.
    pub pull: f64,
    /// 1/τ² with τ the distance that counts as near: a sample, or 0.1 d if that is more.
    pub inverse_reach_squared: f64,
}

/// The guides of b where β is above 0.
pub(super) fn find_guides(
    fields: FieldsView<'_, 2>,
    watch: &mut dyn Watch,
) -> Result<Vec<Guide>, Cancelled> {
    let FieldsView { potential, weight, distance } = fields;
    if weight.as_constant() == Some(0.0) || potential.range().0 > -LEAST_DEPTH {
        return Ok(Vec::new());
    }
    let grid = potential.grid();
    let step = grid.step.iter().product::<f64>().sqrt();
    let bounds = grid.bounds();
    let guide = |bottom: &FeaturePoint<2>| {
        let scaled = std::array::from_fn(|k| bottom.position[k] * grid.step[k]);
        let position = bounds.clamp(&scaled);
        // a normal is a slope: per lattice unit it is less where steps are long
        let slope: Point<2> = std::array::from_fn(|k| bottom.normal[k] / grid.step[k]);
        let length = slope[0].hypot(slope[1]);
        let d = distance.at(&position);
        let weight = weight.at(&position);
        let odds = (weight / (1.0 - weight)).min(GREATEST_ODDS);
        Guide {
            at: FeaturePoint { position, normal: slope.map(|x| x / length), ..*bottom },
            pull: PULL * odds * step / d,
            inverse_reach_squared: step.max(0.1 * d).powi(-2),
        }
    };
    let valleys = deep_valleys(potential, distance.least() / step, watch)?;
    Ok(valleys.iter().map(guide).filter(|guide| guide.pull > 0.0).collect())
}

/// The bottoms of valleys that edges of `size` samples should follow.
fn deep_valleys(
    potential: &ScalarField<2>,
    size: f64,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<2>>, Cancelled> {
    let variance = ((size / 6.0).powi(2) - 1.0).max(LEAST_VARIANCE);
    let sigma = [variance.sqrt(); 2];
    let search = ValleySearch { sigma, least_depth: LEAST_DEPTH, phase: Phase::Improve };
    let shape = potential.grid().shape;
    let found = strongest(bottoms(potential.samples(), shape, &search, watch)?, DEPTH_SHARE);
    Ok(in_large_groups(found, shape, size))
}
