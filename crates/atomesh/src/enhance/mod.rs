//! From an image to the potential b(x): −1 in features, 0 elsewhere.
//!
//! Ridges, faults, horizons and the crests of edges are lines and sheets, found one by one and widened to valleys of one
//! depth and width (`thin`). Other features are the image itself, scaled (`scale`, `edges`, `labels`). What counts there
//! as background and as a full feature is read off the distribution of the samples, so that a few odd ones do not decide:
//! - *dark*, *bright*: the background is the median, near which most samples of an image of thin features are. A full
//!   feature is where only 2 % of the samples on the feature's side of the median are more extreme. The share is of that
//!   side, not of all samples, so that sparse features are found on a flat background. Where no sample is on that side,
//!   more than half of the image is feature, and the ends of the range take these places;
//! - *labels*: where values differ, however much;
//! - *edges*: the background is gradient 0, a full feature its 99.5th percentile, or the greatest gradient if that
//!   percentile is 0.
//!
//! b is clipped to −1…0, then smoothed a little. Hale (2001) takes images that are already
//! potentials; the scaling is ours.
//!
//! Cost: a few passes over the samples. Memory: one f32 a sample beside the image.

mod denoise;
mod edges;
mod error;
mod labels;
mod mixture;
mod options;
mod quantile;
mod scale;
mod thin;

#[cfg(test)]
mod tests;

pub use denoise::{DenoiseError, DenoiseOptions, denoise, noise_level};
pub use error::EnhanceError;
pub use mixture::{Mixture, MixtureError, Share, enhance_mixture};
pub use options::{EdgeOperator, FeatureOptions, Features};
pub use thin::{CrestOptions, FaultOptions, HorizonOptions, Polarity};

use crate::crests::FeaturePoint;
use crate::image::{Grid, Image, Samples, Units};
use crate::parallel::prelude::*;
use crate::watch::{Cancelled, Phase, Watch, check};
use scale::UnitSamples;

/// The narrowest Gaussian, in samples, whose derivative still sees the neighbours.
const LEAST_EDGE_SCALE: f64 = 0.3;

/// A potential made from an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Enhanced<const D: usize> {
    /// b at the image's samples, x fastest: −1…0, or 0…1 if it repels.
    pub values: Vec<f32>,
    /// Whether the image has no features of the kind asked for, so that b is 0 everywhere:
    /// its samples, or for edges its gradients, are all the same. Callers warn.
    /// Not set where [`Features::None`] was asked for.
    pub constant: bool,
    /// The crests that b is made of, in lattice coordinates, where it is made of crests of one kind.
    pub crests: Option<Vec<FeaturePoint<D>>>,
}

/// Makes the potential b(x) of an image, in units of 1. Samples without data ([`Image::absent`]) count as what is beside
/// them, and are no features: b is 0 there.
///
/// # Errors
/// [`EnhanceError`] for samples that are not finite, labels that are not integers, options out of their ranges, and if
/// `watch` ends the work.
///
/// ```
/// use atomesh::enhance::{FeatureOptions, enhance};
/// use atomesh::image::{Frame, Image, Samples};
///
/// let mut grey = vec![153u8; 64];
/// grey[24..32].fill(7); // a dark row
/// let image = Image::new(Frame::new([8, 8])?, Samples::U8(grey.into()))?;
/// let sharp = FeatureOptions { smooth: Some(0.0), ..Default::default() };
/// let b = enhance(&image, &sharp, &mut atomesh::watch::Silent)?;
/// assert_eq!((b.values[0], b.values[27]), (0.0, -1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn enhance<const D: usize>(
    image: &Image<D>,
    options: &FeatureOptions,
    watch: &mut dyn Watch,
) -> Result<Enhanced<D>, EnhanceError> {
    options.check()?;
    check(watch, Phase::Potential, 0.0, None)?;
    if let Some(image) = denoised(image, options, watch)? {
        return enhance(&image, &FeatureOptions { denoise: None, ..*options }, watch);
    }
    if let Some(continued) = image.continued() {
        return Ok(enhance(&continued, options, watch)?.within(image, options));
    }
    let unit = UnitSamples::new(image.samples())?;
    check(watch, Phase::Potential, 0.1, None)?;
    match options.features {
        Features::Labels => labels::labelled(image, options, watch),
        _ if options.thins() => thin::thinned(image, options, watch),
        _ => scale::scaled(&unit, image, options, watch),
    }
}

impl<const D: usize> Enhanced<D> {
    /// The same without what was found at samples where the image has no data.
    fn within(mut self, image: &Image<D>, options: &FeatureOptions) -> Self {
        let Some(absent) = image.absent() else { return self };
        let all = self.values.par_iter_mut().zip(absent);
        all.filter(|(_, is_absent)| **is_absent).for_each(|(b, _)| *b = 0.0);
        if let Some(crests) = &mut self.crests {
            keep_present(crests, &image.frame().grid(options.units), absent);
        }
        let is_zero = self.values.par_iter().all(|&b| b == 0.0);
        self.constant |= is_zero && options.features != Features::None;
        self
    }
}

/// Drops points, in lattice coordinates, that are nearest to samples without data.
fn keep_present<const D: usize>(
    points: &mut Vec<FeaturePoint<D>>,
    grid: &Grid<D>,
    absent: &[bool],
) {
    let strides = grid.strides();
    let nearest = |point: &FeaturePoint<D>| -> usize {
        let along = |k: usize| {
            let place = (point.position[k] / grid.step[k]).round().max(0.0) as usize;
            place.min(grid.shape[k] - 1) * strides[k]
        };
        (0..D).map(along).sum()
    };
    points.retain(|point| !absent[nearest(point)]);
}

/// The image without its noise; `None` if that is not asked for.
fn denoised<const D: usize>(
    image: &Image<D>,
    options: &FeatureOptions,
    watch: &mut dyn Watch,
) -> Result<Option<Image<D>>, EnhanceError> {
    let Some(strength) = options.denoise else { return Ok(None) };
    if matches!(options.features, Features::Labels | Features::None) {
        return Ok(None);
    }
    without_noise(image, strength, options.units, watch).map(Some)
}

/// The image without its noise, in single precision: [`denoise`] with a `strength` from 0.01 to 10, in a lattice of those
/// units. Samples without data are continued from their neighbours.
///
/// # Errors
/// [`EnhanceError`] if a sample is not finite, the strength is out of range, or the watch ends the work.
pub fn without_noise<const D: usize>(
    image: &Image<D>,
    strength: f64,
    units: Units,
    watch: &mut dyn Watch,
) -> Result<Image<D>, EnhanceError> {
    UnitSamples::new(image.samples())?; // refuses what is not finite
    let denoising = DenoiseOptions { strength, ..DenoiseOptions::for_dimension(D) };
    let grid = image.frame().grid(units);
    let values = image.continued().as_ref().unwrap_or(image).samples().to_f32();
    let clean = denoise(&values, &grid, &denoising, watch)?;
    let clean = image.clone().with_samples(Samples::F32(clean.into()));
    Ok(clean.expect("there are as many samples as before"))
}

/// Points on the features of an image, in lattice coordinates: crests between samples, whatever the potential is made
/// by, and places between labels. `None` for features that are the valleys of the potential itself (dark, bright).
///
/// # Errors
/// As [`enhance()`].
pub fn feature_points<const D: usize>(
    image: &Image<D>,
    options: &FeatureOptions,
    watch: &mut dyn Watch,
) -> Result<Option<Vec<FeaturePoint<D>>>, EnhanceError> {
    let is_crest = matches!(
        options.features,
        Features::Edges
            | Features::Ridges
            | Features::Faults
            | Features::Horizons
            | Features::Labels
    );
    if !is_crest {
        return Ok(None);
    }
    options.check()?;
    if let Some(image) = denoised(image, options, watch)? {
        return feature_points(&image, &FeatureOptions { denoise: None, ..*options }, watch);
    }
    let grid = image.frame().grid(options.units);
    if let (Some(continued), Some(absent)) = (image.continued(), image.absent()) {
        let mut found = feature_points(&continued, options, watch)?;
        if let Some(points) = &mut found {
            keep_present(points, &grid, absent);
        }
        return Ok(found);
    }
    let mut points = match options.features {
        Features::Labels => labels::interface_points(image, options, watch)?,
        Features::Edges => {
            let low = options.edges.low.or(Some(WEAK_EDGES.0));
            let high = options.edges.high.or(Some(WEAK_EDGES.1));
            let edges = CrestOptions { low, high, ..options.edges };
            thin::crest_points(image, &FeatureOptions { edges, ..*options }, watch)?
        }
        _ => thin::crest_points(image, options, watch)?,
    };
    to_lattice(&mut points, &grid);
    Ok(Some(points))
}

/// The thresholds of edges that atoms are put on, lower than those of crests: what is weaker than noise is left out before,
/// and a boundary of little contrast is one all the same. Of the boundaries of grains whose contrast is three times the
/// noise and more 0.95 are met with these, 0.78 with 0.2 and 0.5.
const WEAK_EDGES: (f64, f64) = (0.07, 0.2);

/// Points on the bottoms of the valleys of b, smoothed by a Gaussian of `sigma` least steps, where it is below
/// −`least_depth`, in lattice coordinates and the order of their samples; their strength is the depth.
///
/// # Errors
/// [`Cancelled`] if `watch` ends the work.
///
/// # Panics
/// If there are not as many values as the grid has samples.
pub fn valley_points<const D: usize>(
    potential: &[f32],
    grid: &Grid<D>,
    sigma: f64,
    least_depth: f32,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, Cancelled> {
    let mut points = thin::valleys(potential, grid, sigma, least_depth, watch)?;
    to_lattice(&mut points, grid);
    Ok(points)
}

/// Moves points from samples to the lattice; their normals are there already.
fn to_lattice<const D: usize>(points: &mut [FeaturePoint<D>], grid: &Grid<D>) {
    for point in points {
        (0..D).for_each(|k| point.position[k] *= grid.step[k]);
    }
}

/// Takes samples as a potential as they are, without rescaling.
///
/// # Errors
/// [`EnhanceError::OutOfRange`] for the first sample that is NaN or outside −1…1.
pub fn given_potential(samples: Samples) -> Result<Vec<f32>, EnhanceError> {
    let values = samples.into_f32();
    // a NaN is not contained either
    match values.par_iter().position_first(|b| !(-1.0..=1.0).contains(b)) {
        Some(index) => Err(EnhanceError::OutOfRange { index, value: values[index] }),
        None => Ok(values),
    }
}
