//! The crests of b: where faces should fall.

use crate::crests::{Bottom, Search, bottoms, in_large_groups};
use crate::fields::FieldsView;
use crate::geometry::{Point, dot};
use crate::watch::{Cancelled, Phase, Watch};

/// The least height that counts at all: below it lies what a nearly constant image has.
const LEAST_HEIGHT: f32 = 0.05;
/// The least height over that of the highest tenth. On the paper's figure 1 recall is 0.81 with 0.3, 0.82 with 0.4
/// and 0.78 with 0.5.
const HEIGHT_SHARE: f32 = 0.4;

/// A point on a crest of b, in lattice space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crest<const D: usize> {
    /// Where it is.
    pub position: Point<D>,
    /// The unit normal of the feature there; its sign means nothing.
    pub normal: Point<D>,
    /// b there, smoothed.
    pub height: f64,
}

/// The crests of b, where it is above 0 and β too, about one a sample, in the order of the samples.
///
/// As [`crate::measure`] looks for features: in b smoothed by max(1, d/6) samples, in groups of 4 d (2-D) or 6 d²
/// (3-D) samples or more, d its least. Which are high enough is measured against the highest tenth.
///
/// # Errors
/// [`Cancelled`] if the watch ends the work.
pub fn crests<const D: usize>(
    fields: FieldsView<'_, D>,
    watch: &mut dyn Watch,
) -> Result<Vec<Crest<D>>, Cancelled> {
    let FieldsView { potential, weight, distance } = fields;
    if weight.as_constant() == Some(0.0) || potential.range().1 < LEAST_HEIGHT {
        return Ok(Vec::new());
    }
    let grid = potential.grid();
    let size = grid.in_samples(distance.least());
    let valleys: Vec<f32> = potential.samples().iter().map(|b| -b.max(0.0)).collect();
    let sigma = [(size / 6.0).max(1.0); D];
    let search = Search { sigma, least_depth: LEAST_HEIGHT, phase: Phase::Grow };
    let found = highest(bottoms(&valleys, grid.shape, &search, watch)?);
    let least = if D == 2 { 4.0 * size } else { 6.0 * size * size };
    let bounds = grid.bounds();
    let crest = |bottom: &Bottom<D>| {
        let scaled = std::array::from_fn(|k| bottom.position[k] * grid.step[k]);
        // a normal is a slope: per lattice unit it is less where steps are long
        let slope: Point<D> = std::array::from_fn(|k| bottom.normal[k] / grid.step[k]);
        let length = dot(&slope, &slope).sqrt();
        let normal = slope.map(|x| x / length);
        Crest { position: bounds.clamp(&scaled), normal, height: f64::from(bottom.depth) }
    };
    let found = in_large_groups(found, grid.shape, least);
    Ok(found.iter().map(crest).filter(|crest| weight.at(&crest.position) > 0.0).collect())
}

fn highest<const D: usize>(mut found: Vec<Bottom<D>>) -> Vec<Bottom<D>> {
    if found.is_empty() {
        return found;
    }
    let mut heights: Vec<f32> = found.iter().map(|bottom| bottom.depth).collect();
    let place = heights.len() * 9 / 10;
    let (_, high, _) = heights.select_nth_unstable_by(place, f32::total_cmp);
    let least = HEIGHT_SHARE * *high;
    found.retain(|bottom| bottom.depth > least);
    found
}
