//! The crests of b where it repels: the places where faces of Voronoi cells should fall.

use super::{FeaturePoint, ValleySearch, bottoms, in_large_groups, strongest};
use crate::fields::FieldsView;
use crate::watch::{Cancelled, Phase, Watch};

/// The least b that counts, smoothed: below it lies what a nearly constant image has.
const LEAST_HEIGHT: f32 = 0.05;
/// The least b over that of the highest tenth. On the paper's figure 1 recall is 0.81 with 0.3, 0.82 with 0.4 and 0.78
/// with 0.5.
const HEIGHT_SHARE: f32 = 0.4;

/// Points on the crests of b, where b and β are above 0, about one a sample and in the order of the samples; in lattice
/// coordinates, and as strong as b is there, smoothed.
///
/// b is smoothed by max(1, d/6) samples, d being the least nominal distance. Points lower than 0.4 of the highest tenth,
/// and groups too small for d, are left out ([`in_large_groups`]).
///
/// # Errors
/// [`Cancelled`] if the watch ends the work.
pub fn repelling_crests<const D: usize>(
    fields: FieldsView<'_, D>,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, Cancelled> {
    let FieldsView { potential, weight, distance } = fields;
    if weight.as_constant() == Some(0.0) || potential.range().1 < LEAST_HEIGHT {
        return Ok(Vec::new());
    }
    let grid = potential.grid();
    let size = grid.in_samples(distance.least());
    let valleys: Vec<f32> = potential.samples().iter().map(|b| -b.max(0.0)).collect();
    let sigma = [(size / 6.0).max(1.0); D];
    let search = ValleySearch { sigma, least_depth: LEAST_HEIGHT, phase: Phase::Grow };
    let high = strongest(bottoms(&valleys, grid.shape, &search, watch)?, HEIGHT_SHARE);
    let crests = in_large_groups(high, grid.shape, size);
    let placed = crests.iter().map(|crest| crest.in_lattice(grid));
    Ok(placed.filter(|crest| weight.at(&crest.position) > 0.0).collect())
}
