//! Values on the scale 0…1.

use crate::enhance::quantile::{Order, Ranks};
use crate::parallel::prelude::*;

/// An image's values, moved and scaled to 0…1 while they are read.
#[derive(Clone, Copy)]
pub(super) struct UnitValues<'a> {
    values: &'a [f32],
    least: f64,
    scale: f64,
}

impl<'a> UnitValues<'a> {
    /// `None` if all values are the same.
    pub(super) fn new(values: &'a [f32]) -> Option<Self> {
        let ends = |part: &[f32]| {
            part.iter().fold((f32::MAX, f32::MIN), |(a, b), &v| (a.min(v), b.max(v)))
        };
        let both = |a: (f32, f32), b: (f32, f32)| (a.0.min(b.0), a.1.max(b.1));
        let (least, greatest) =
            values.par_chunks(1 << 16).map(ends).reduce(|| (f32::MAX, f32::MIN), both);
        let (least, greatest) = (f64::from(least), f64::from(greatest));
        (greatest > least).then(|| Self { values, least, scale: 1.0 / (greatest - least) })
    }

    /// Writes values from index `start` on.
    pub(super) fn fill(&self, start: usize, out: &mut [f32]) {
        for (out, &v) in out.iter_mut().zip(&self.values[start..]) {
            *out = ((f64::from(v) - self.least) * self.scale) as f32;
        }
    }

    /// The value below which a share of all others is.
    pub(super) fn quantile(&self, share: f64) -> f32 {
        let count = self.values.len();
        let order = Order::new(count, |start, out: &mut [f32]| self.fill(start, out));
        order.ranked((share * count as f64) as usize).value
    }
}
