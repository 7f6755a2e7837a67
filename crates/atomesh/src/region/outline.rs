//! The outline of a mask: where the smoothed mask passes through one half.
//!
//! A binary mask is a staircase. Smoothed by a Gaussian of σ = max(step, d/4) along each axis it has smooth level sets.
//! Of the levels near one half, that is taken which holds as much as the mask does, and the shares are shifted so that
//! it is one half. The outline differs from the mask's own boundary by about σ²/2 times (curvature − mean curvature),
//! far less than d. The logit of the smoothed mask is nearly linear in the distance from a straight edge, so that
//! Newton's method finds the nearest outline in two or three steps.

use crate::fields::NominalDistance;
use crate::fields::{Interpolation, ScalarField};
use crate::geometry::{Bounds, Point, distance_squared, dot};
use crate::image::{Grid, Image, Samples, gaussian};
use crate::watch::{Phase, Watch, check};

use super::RegionError;

/// Standard deviation of the smoothing, over the least nominal distance: steps of single samples vanish, and what is as
/// large as an edge stays.
const SMOOTH: f64 = 0.25;

/// How far beyond the mask atoms are needed, over the nominal distance: one layer.
const MARGIN: f64 = 1.1;

/// Newton steps at most; two or three suffice.
const STEP_LIMIT: usize = 30;

/// The outline of a mask, in lattice space, and what lies inside of it.
#[derive(Clone, Debug)]
pub struct Outline<const D: usize> {
    /// The smoothed and shifted mask, 0…1.
    share: ScalarField<D>,
    bounds: Bounds<D>,
    /// `offset` plus the distance from the mask, up to some nominal distances.
    beyond: NominalDistance<D>,
    offset: f64,
    sample_share: f64,
}

impl<const D: usize> Outline<D> {
    /// The outline of a mask: samples that are not 0 are inside, or, if all are shares within 0…1, those of at least one
    /// half. `None` if all samples are inside: the mesh fills the box.
    ///
    /// # Errors
    /// [`RegionError::EmptyMask`] if no sample is inside, [`RegionError::NotFinite`] if one is not
    /// finite, [`RegionError::Cancelled`].
    pub fn new(
        mask: &Image<D>,
        grid: Grid<D>,
        distance: &NominalDistance<D>,
        watch: &mut dyn Watch,
    ) -> Result<Option<Self>, RegionError> {
        check(watch, Phase::Distance, 0.2, None)?;
        let mut share = shares(mask.samples())?;
        let whole: f64 = share.iter().map(|&s| f64::from(s)).sum();
        let inside = share.iter().filter(|&&s| s >= 0.5).count();
        if inside == 0 {
            return Err(RegionError::EmptyMask { count: share.len() });
        }
        if inside == share.len() {
            return Ok(None);
        }
        let (offset, far) = (distance.least(), 4.0 * distance.greatest() + distance.least());
        let field: Vec<f32> =
            share.iter().map(|&s| if s >= 0.5 { offset as f32 } else { far as f32 }).collect();
        let beyond = NominalDistance::from_field(&grid, &field, 1.0)?;
        drop(field);
        check(watch, Phase::Distance, 0.5, None)?;
        let sigma = grid.step.map(|step| (SMOOTH * distance.least() / step).max(1.0));
        gaussian(&mut share, grid.shape, sigma);
        share.iter_mut().for_each(|s| *s = s.clamp(0.0, 1.0)); // rounding may step over
        shift(&mut share, whole, sigma.into_iter().fold(f64::INFINITY, f64::min));
        let sample_share = whole / share.len() as f64;
        let share = ScalarField::new(grid, share, Interpolation::Spline)?;
        check(watch, Phase::Distance, 0.8, None)?;
        Ok(Some(Self { share, bounds: grid.bounds(), beyond, offset, sample_share }))
    }

    /// The smoothed mask at a point, 0…1.
    pub fn share(&self, p: &Point<D>) -> f64 {
        self.share.value(p).clamp(0.0, 1.0)
    }

    /// Whether a point is inside of the outline.
    pub fn is_inside(&self, p: &Point<D>) -> bool {
        self.share(p) > 0.5
    }

    /// Whether the mesh of the mask needs an atom at `p`, where the nominal distance is `d`: inside, or within one layer
    /// beyond.
    pub fn needs(&self, p: &Point<D>, d: f64) -> bool {
        self.beyond.at(p) - self.offset <= MARGIN * d
    }

    /// The least nominal distance that the outline was made for.
    pub fn least_distance(&self) -> f64 {
        self.offset
    }

    /// The box of the image.
    pub fn bounds(&self) -> &Bounds<D> {
        &self.bounds
    }

    /// The sampling of the mask.
    pub fn grid(&self) -> &Grid<D> {
        self.share.grid()
    }

    /// Whether sample `index` is inside of the outline.
    pub(crate) fn sample_is_inside(&self, index: usize) -> bool {
        self.share.samples()[index] > 0.5
    }

    /// The mean of the mask over all samples.
    pub fn mean_share(&self) -> f64 {
        self.sample_share
    }

    /// The logit of the smoothed mask, and its gradient along the axes in `freedom` (bit k: axis k).
    fn logit(&self, p: &Point<D>, freedom: u8) -> (f64, Point<D>) {
        let mut gradient = [0.0; D];
        let share = self.share.value_and_gradient(p, &mut gradient).clamp(1e-7, 1.0 - 1e-7);
        let spread = share * (1.0 - share);
        for (k, g) in gradient.iter_mut().enumerate() {
            *g = if freedom >> k & 1 == 1 { *g / spread } else { 0.0 };
        }
        ((share / (1.0 - share)).ln(), gradient)
    }

    /// The outward unit normal of the outline near `p`, along the axes in `freedom`; `None` where the mask is constant.
    pub fn normal(&self, p: &Point<D>, freedom: u8) -> Option<Point<D>> {
        let (_, gradient) = self.logit(p, freedom);
        let length = dot(&gradient, &gradient).sqrt();
        (length > 0.0 && length.is_finite()).then(|| gradient.map(|g| -g / length))
    }

    /// The point of the outline that Newton's method reaches from `p` along the mask's gradient, by moves along the axes
    /// in `freedom`; `None` if there is none within `reach` and within the box.
    pub fn project(&self, p: &Point<D>, freedom: u8, reach: f64) -> Option<Point<D>> {
        let mut q = *p;
        for _ in 0..STEP_LIMIT {
            let (value, gradient) = self.logit(&q, freedom);
            let squared = dot(&gradient, &gradient);
            // the logit of an edge rises by 1.7/σ; where it is so flat that a step leaves reach, the search ends
            if squared.is_nan() || value.abs() > 4.0 * reach * squared.sqrt() {
                return None;
            }
            let step = value / squared.max(f64::MIN_POSITIVE);
            q = std::array::from_fn(|k| q[k] - step * gradient[k]);
            if !self.bounds.contains(&q) || distance_squared(&q, p) > reach * reach {
                return None;
            }
            if step * step * squared <= (1e-10 * reach).powi(2) {
                return Some(q);
            }
        }
        None
    }

    /// Where the segment from `inside` to `outside` crosses the outline, by bisection: on the segment to rounding, and
    /// exactly on a side of the box that both ends lie on.
    pub fn crossing(&self, inside: &Point<D>, outside: &Point<D>) -> Point<D> {
        let at = |t: f64| -> Point<D> {
            std::array::from_fn(|k| inside[k] + t * (outside[k] - inside[k]))
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let t = 0.5 * (low + high);
            if self.is_inside(&at(t)) { low = t } else { high = t }
        }
        at(0.5 * (low + high))
    }

    /// The potential that draws atoms to the outline, at the samples: −4 m (1 − m) of the smoothed mask m.
    /// Along a straight outline a valley of depth 1 and a half-width of about σ.
    pub fn valley(&self) -> impl Iterator<Item = f32> + '_ {
        self.share.samples().iter().map(|&m| -4.0 * m * (1.0 - m))
    }

    /// Makes of the samples of b the potential for a masked mesh: the lesser of b, inside of the mask, and the outline's
    /// [`Self::valley`].
    pub fn combine(&self, samples: &mut [f32]) {
        for (i, (b, valley)) in samples.iter_mut().zip(self.valley()).enumerate() {
            let own = if self.sample_is_inside(i) { *b } else { 0.0 };
            *b = own.min(valley).max(-1.0);
        }
    }
}

/// Greatest shift of the outline's level from one half to keep the mask's measure.
const MOST_SHIFT: f64 = 0.15;

/// Within this distance of the level, in samples, a sample counts in part: somewhat more than half a sample, so that
/// what a level holds does not jump from sample to sample.
const SOFT: f64 = 0.75;

/// Shifts smoothed shares so that the level of one half holds as much as the mask, `whole`: smoothing moves a bent
/// outline toward its centre of curvature. All logits are shifted alike. `sigma` is the least standard deviation of the
/// smoothing, in samples.
fn shift(shares: &mut [f32], whole: f64, sigma: f64) {
    // an edge smoothed by σ has the slope 1/σ√2π where it is one half
    let slope = sigma * (2.0 * std::f64::consts::PI).sqrt() / (2.0 * SOFT);
    let (least, most) = (0.5 - MOST_SHIFT, 0.5 + MOST_SHIFT);
    let reach = 0.5 / slope;
    let is_near = |s: f64| least - reach < s && s < most + reach;
    let near: Vec<f64> = shares.iter().map(|&s| f64::from(s)).filter(|&s| is_near(s)).collect();
    let above = shares.iter().filter(|&&s| f64::from(s) >= most + reach).count() as f64;
    let held = |level: f64| {
        let part = |s: &f64| (0.5 + (s - level) * slope).clamp(0.0, 1.0);
        above + near.iter().map(part).sum::<f64>()
    };
    let (mut low, mut high) = (least, most);
    for _ in 0..24 {
        let level = 0.5 * (low + high);
        if held(level) > whole { low = level } else { high = level }
    }
    let level = 0.5 * (low + high);
    for share in shares {
        let s = f64::from(*share);
        *share = (s * (1.0 - level) / (s * (1.0 - level) + (1.0 - s) * level)) as f32;
    }
}

/// Whether each sample of a mask is inside: not 0, or, where all values are within 0…1, one half or more.
///
/// # Errors
/// [`RegionError::NotFinite`] names the first value that is no number.
pub fn samples_inside(mask: &Samples) -> Result<Vec<bool>, RegionError> {
    Ok(shares(mask)?.into_iter().map(|share| share >= 0.5).collect())
}

/// The share of each sample that is inside: the values, if all are within 0…1; else 1 where they are not 0.
fn shares(samples: &Samples) -> Result<Vec<f32>, RegionError> {
    let mut values = samples.to_f32();
    if let Some(index) = values.iter().position(|v| !v.is_finite()) {
        return Err(RegionError::NotFinite { index, value: values[index] });
    }
    let is_share = values.iter().all(|v| (0.0..=1.0).contains(v));
    if !is_share {
        values.iter_mut().for_each(|v| *v = if *v == 0.0 { 0.0 } else { 1.0 });
    }
    Ok(values)
}
