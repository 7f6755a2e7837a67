//! Edges as a potential: the magnitude of the gradient.

use super::quantile::{Order, Ranks};
use super::scale::{Ramp, UnitSamples};
use super::{EdgeOperator, EnhanceError, FeatureOptions};
use crate::image::{Image, Stencil, magnitude};
use crate::watch::{Phase, Watch, check};

/// The share of all samples, those of the greatest gradients, that are clipped to −1.
const CLIPPED_EDGES: f64 = 0.005;

/// The gradients of the image, and the line from none to a full feature; `None` if all are 0.
pub(super) fn edges<const D: usize>(
    unit: &UnitSamples,
    image: &Image<D>,
    options: &FeatureOptions,
    watch: &mut dyn Watch,
) -> Result<Option<(Vec<f32>, Ramp)>, EnhanceError> {
    let stencil = match options.edge_operator {
        EdgeOperator::Prewitt => Stencil::Prewitt,
        EdgeOperator::Gaussian | EdgeOperator::Crest => Stencil::Gaussian(options.edge_scale),
    };
    // only the steps' ratios matter, and ratios are safe in single precision
    let grid = image.frame().grid(options.units).in_least_steps();
    let fill = |start, out: &mut [f32]| unit.fill(start, out);
    let values = magnitude(fill, &grid, stencil, &mut |done| {
        check(watch, Phase::Potential, 0.1 + 0.5 * done, None)
    })?;
    let copy = |start: usize, out: &mut [f32]| {
        out.copy_from_slice(&values[start..start + out.len()]);
    };
    let count = values.len();
    let share = |clipped: f64| count - 1 - (clipped * count as f64) as usize;
    let order = Order::new(count, copy);
    let mut feature = order.ranked(share(CLIPPED_EDGES)).value;
    if feature == 0.0 {
        feature = order.ranked(share(0.0)).value;
    }
    Ok((feature != 0.0).then_some((values, Ramp { background: 0.0, feature })))
}
