//! From an image to the potential b(x): −1 in features, 0 elsewhere.
//!
//! Two ways lead there. Ridges, faults, horizons and the crests of edges are lines and sheets found one by one and
//! widened to valleys of one depth and width, each in its own module; the others are the image, scaled. What
//! counts there as background and as a full feature is read off the distribution of the samples, so that a
//! few odd ones do not decide:
//! - *dark*, *bright*: the background is the median, which most samples of an image of thin
//!   features are near; a full feature is where only 2 % of the samples on the feature's side of
//!   the median are more extreme. The share is taken of that side, not of all samples, so that
//!   sparse features are found on a flat background. Where no sample is on that side, more than
//!   half of the image is feature, and the range's ends stand in.
//! - *labels*: where values differ, however much.
//! - *edges*: the background is gradient 0, a full feature its 99.5th percentile, or the greatest
//!   gradient if that percentile is 0.
//!
//! b is clipped to −1…0, then smoothed a little. Hale (2001) takes images that are already
//! potentials; the scaling is ours.
//!
//! Cost: a few passes over the samples. Memory: one f32 a sample beside the image.

mod crossings;
mod edge_crests;
mod denoise;
mod horizons;
mod faults;
mod labels;
mod mixture;
mod quantile;
mod ridges;
mod scale;

pub use denoise::{DenoiseError, DenoiseOptions, denoise, noise_level};

use crate::image::{Grid, Image, Samples, Stencil, Units, gaussian, gaussian_between, magnitude};
use crate::watch::{Cancelled, Phase, Watch, check};
pub use mixture::{Mixture, MixtureError, Share, enhance_mixture};
use quantile::{Order, Ranks};
use rayon::prelude::*;
use scale::{Ramp, UnitSamples};
use serde::{Deserialize, Serialize};
use std::str::FromStr;

use crate::crests::{FeaturePoint, widen};

pub use crossings::Polarity;
pub use edge_crests::EdgeCrestOptions;
pub use faults::FaultOptions;
pub use horizons::HorizonOptions;
pub use ridges::RidgeOptions;

/// Of all samples, the share whose gradient is clipped to −1.
const CLIPPED_EDGES: f64 = 0.005;

/// The narrowest Gaussian, in samples, whose derivative still sees the neighbours.
const LEAST_EDGE_SCALE: f64 = 0.3;

/// Standard deviation, in least steps, by which dark and bright features are rounded off.
const ROUNDED: f64 = 1.0;

/// The width of the valleys made of thinned features, in least steps an axis: 1 in the plane, 1.5 in space. Edges of
/// a brain (d = 6) were followed to 0.64 with 1 and 0.66 with 1.5; with 2 cells were bad.
const WIDTH: f64 = 0.5;

/// Samples that one task maps.
const BLOCK: usize = 1 << 16;

/// What in the image attracts atoms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Features {
    /// Dark lines, sheets or spots, such as faults in a fault-enhanced image.
    #[default]
    Dark,
    /// Bright lines, sheets or spots.
    Bright,
    /// Places where values change: outlines of organs, grains, layers.
    Edges,
    /// Places where labels meet: the samples are names, not amounts.
    Labels,
    /// The middles of lines and sheets that are brighter or darker than what is about them
    /// ([`FeatureOptions::ridges`]), thinned to valleys of one depth and width (Hale 2002).
    Ridges,
    /// Faults in seismic amplitudes ([`FeatureOptions::faults`]), thinned alike. Depth is the last axis.
    Faults,
    /// Reflections in seismic amplitudes ([`FeatureOptions::horizons`]), thinned alike.
    Horizons,
    /// Nothing: b = 0, and the mesh is as regular as it can be.
    None,
}

impl Features {
    /// The names of all kinds.
    pub const NAMES: [&str; 8] =
        ["dark", "bright", "edges", "ridges", "faults", "horizons", "labels", "none"];

    const ALL: [Self; Self::NAMES.len()] = [
        Self::Dark,
        Self::Bright,
        Self::Edges,
        Self::Ridges,
        Self::Faults,
        Self::Horizons,
        Self::Labels,
        Self::None,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dark => "dark",
            Self::Bright => "bright",
            Self::Edges => "edges",
            Self::Labels => "labels",
            Self::Ridges => "ridges",
            Self::Faults => "faults",
            Self::Horizons => "horizons",
            Self::None => "none",
        }
    }
}

impl FromStr for Features {
    type Err = ();

    fn from_str(name: &str) -> Result<Self, ()> {
        Self::ALL.into_iter().find(|features| features.name() == name).ok_or(())
    }
}

/// How edges are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum EdgeOperator {
    /// Derivatives of a Gaussian; see [`FeatureOptions::edge_scale`].
    #[default]
    Gaussian,
    /// The paper's: 3 × 3 (× 3) differences. Sharper, and noisier.
    Prewitt,
    /// Derivatives of a Gaussian as wide as the noise asks for, thinned to where they are steepest, and widened
    /// to valleys of one depth and width ([`FeatureOptions::crests`]).
    Crest,
}

/// How an image becomes a potential.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct FeatureOptions {
    /// What attracts atoms. Default: dark, as in the paper's seismic images.
    pub features: Features,
    /// How edges are found; the other features ignore it. Default: Gaussian, since one sample's
    /// noise already makes a Prewitt edge.
    pub edge_operator: EdgeOperator,
    /// Standard deviation of the Gaussian operator, also of the one that finds where labels meet, in least steps from sample to sample, 0.3 or more:
    /// less would hardly reach the neighbours. It is as wide in lattice units along every axis, but not
    /// below 0.7 samples along a coarser one. Prewitt's ignores it. Default 1.5: wide enough to fill
    /// the gaps between samples of a slanted edge, narrow enough to keep the two sides of a sheet of 4
    /// samples apart.
    pub edge_scale: f64,
    /// Standard deviation, in lattice units, of a Gaussian over the finished potential; b is not
    /// scaled to −1 again, so narrow features become shallow. Default: the least step
    /// for dark and bright features, which rounds off the steps of one sample that atoms would catch
    /// on (measured on fault images: better shape and better alignment); none for edges, which the
    /// operator has smoothed. Smoothing that reaches beyond the features' width costs alignment.
    /// Of features that are thinned (ridges, faults, horizons, edges by their crests) it is the width of the valleys
    /// made of them, −exp(−s²/2σ²) at the distance s, no less than 0.7 samples; their depth stays 1. Default: the
    /// least step in 2-D, 1.5 of them in 3-D.
    pub smooth: Option<f64>,
    /// How ridges are found.
    pub ridges: RidgeOptions,
    /// How faults are found.
    pub faults: FaultOptions,
    /// How horizons are found.
    pub horizons: HorizonOptions,
    /// How edges are found by [`EdgeOperator::Crest`].
    pub crests: EdgeCrestOptions,
    /// Takes noise off the image first and keeps its edges ([`denoise`], its other options by default): h / σ, how much
    /// patches of the image may differ in standard deviations of the noise and still be averaged. Labels are names, and
    /// stay as they are. Default: the image is taken as it is.
    pub denoise: Option<f64>,
    /// Negates b, so that atoms keep off features and line up alongside them. Default false.
    pub repel: bool,
    /// The lattice units of `smooth` and of gradients. Default: physical.
    pub units: Units,
}

impl Default for FeatureOptions {
    fn default() -> Self {
        Self {
            features: Features::default(),
            edge_operator: EdgeOperator::default(),
            edge_scale: 1.5,
            smooth: None,
            ridges: RidgeOptions::default(),
            faults: FaultOptions::default(),
            horizons: HorizonOptions::default(),
            crests: EdgeCrestOptions::default(),
            denoise: None,
            repel: false,
            units: Units::default(),
        }
    }
}

impl FeatureOptions {
    /// The standard deviation of [`FeatureOptions::smooth`] along each axis, in samples.
    fn sigma<const D: usize>(&self, grid: &Grid<D>) -> [f64; D] {
        match (self.smooth, self.features) {
            (Some(sigma), _) => grid.step.map(|step| sigma / step),
            (None, Features::Dark | Features::Bright) => {
                grid.step.map(|step| ROUNDED * grid.least_step() / step)
            }
            (None, _) => [0.0; D],
        }
    }

    /// Whether features are thinned to crests, and widened again.
    fn thins(&self) -> bool {
        match self.features {
            Features::Ridges | Features::Faults | Features::Horizons => true,
            Features::Edges => self.edge_operator == EdgeOperator::Crest,
            _ => false,
        }
    }
}

/// Why there is no potential.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnhanceError {
    /// Samples are NaN or infinite.
    #[error(
        "{count} samples are not finite, the first of them sample {first}, which is {value}; \
         expected finite samples"
    )]
    NotFinite {
        /// How many samples are NaN or infinite.
        count: usize,
        /// The index of the first of them, x fastest.
        first: usize,
        /// The first of them.
        value: f64,
    },
    /// A sample of a given potential is outside −1…1.
    #[error("sample {index} is {value}; a potential lies in -1…1, and bytes are not rescaled")]
    OutOfRange {
        /// The index of the sample, x fastest.
        index: usize,
        /// The sample.
        value: f32,
    },
    /// The standard deviation of the edge operator is not a finite number from 0.3.
    #[error("edge scale {value}; expected a finite number of samples, {LEAST_EDGE_SCALE} or more")]
    EdgeScale {
        /// The scale found.
        value: f64,
    },
    /// The standard deviation of the smoothing is not a finite number from 0.
    #[error("smoothing {value}; expected a finite number of lattice units, 0 or more")]
    Smooth {
        /// The standard deviation found.
        value: f64,
    },
    /// A label is no integer.
    #[error("sample {index} is {value}; a label is an integer")]
    Label {
        /// The sample's index, x fastest.
        index: usize,
        /// Its value.
        value: f32,
    },
    /// Values that are no labels.
    #[error("{count} different samples, each all over the image; expected labels, not grey values")]
    Labels {
        /// How many different samples there are.
        count: usize,
    },
    /// Why the image was not denoised.
    #[error(transparent)]
    Denoise(DenoiseError),
    /// An option of how crests are found is out of its range.
    #[error("{option} of {kind} is {value}; expected {least} to {most}")]
    Option {
        /// What is searched for.
        kind: &'static str,
        /// The option.
        option: &'static str,
        /// Its value.
        value: f64,
        /// The least that it may be.
        least: f64,
        /// The greatest that it may be.
        most: f64,
    },
    /// The watch ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<DenoiseError> for EnhanceError {
    fn from(error: DenoiseError) -> Self {
        match error {
            DenoiseError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Denoise(other),
        }
    }
}

/// A potential made from an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Enhanced {
    /// b at the image's samples, x fastest: −1…0, or 0…1 if it repels.
    pub values: Vec<f32>,
    /// Whether the image has no features of the kind asked for, so that b is 0 everywhere:
    /// its samples, or for edges its gradients, are all the same. Callers warn.
    /// Not set where [`Features::None`] was asked for.
    pub constant: bool,
}

/// Makes the potential b(x) of an image, in units of 1.
///
/// # Errors
/// [`EnhanceError::NotFinite`] for NaN or infinite samples, [`EnhanceError::EdgeScale`] and
/// [`EnhanceError::Smooth`] for such options, [`EnhanceError::Cancelled`] if `watch` says so.
///
/// ```
/// use atomesh::enhance::{FeatureOptions, enhance};
/// use atomesh::image::{Frame, Image, Samples};
///
/// let mut grey = vec![153u8; 64];
/// grey[24..32].fill(7); // a dark row
/// let image = Image::new(Frame::new([8, 8])?, Samples::U8(grey))?;
/// let sharp = FeatureOptions { smooth: Some(0.0), ..Default::default() };
/// let b = enhance(&image, &sharp, &mut atomesh::watch::Silent)?;
/// assert_eq!((b.values[0], b.values[27]), (0.0, -1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn enhance<const D: usize>(
    image: &Image<D>,
    options: &FeatureOptions,
    watch: &mut dyn Watch,
) -> Result<Enhanced, EnhanceError> {
    check_options(options)?;
    check(watch, Phase::Potential, 0.0, None)?;
    if let Some(image) = denoised(image, options, watch)? {
        return enhance(&image, &FeatureOptions { denoise: None, ..*options }, watch);
    }
    let unit = UnitSamples::new(image.samples())?;
    check(watch, Phase::Potential, 0.1, None)?;
    let zeros = || vec![0.0; unit.len()];
    let shown = match options.features {
        Features::Labels => return labelled(image, options, watch),
        _ if options.thins() => return thinned(image, options, watch),
        Features::None => None,
        _ if unit.is_constant() => None,
        Features::Dark => Some((zeros(), Ramp::dark(&unit))),
        Features::Bright => Some((zeros(), Ramp::bright(&unit))),
        _ => edges(&unit, image, options, watch)?,
    };
    check(watch, Phase::Potential, 0.8, None)?;
    let constant = shown.is_none() && options.features != Features::None;
    let Some((mut values, ramp)) = shown else {
        return Ok(Enhanced { values: zeros(), constant });
    };
    let sign = if options.repel { -1.0 } else { 1.0 };
    let scale = |start, part: &mut [f32]| {
        if options.features != Features::Edges {
            unit.fill(start, part);
        }
        ramp.apply(part, sign);
    };
    let (least, greatest) = if options.repel { (0.0, 1.0) } else { (-1.0, 0.0) };
    let clip = |part: &mut [f32]| {
        for b in part {
            *b = b.clamp(least, greatest) + 0.0; // rounding may leave the range; no −0
        }
    };
    let grid = image.frame().grid(options.units);
    let sigma = options.sigma(&grid);
    if sigma[0] > 0.0 {
        gaussian_between(&mut values, grid.shape, sigma, scale, clip);
    } else {
        let parts = values.par_chunks_mut(BLOCK).enumerate();
        parts.for_each(|(block, part)| scale(block * BLOCK, part));
    }
    check(watch, Phase::Potential, 1.0, None)?;
    Ok(Enhanced { values, constant })
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
    UnitSamples::new(image.samples())?; // refuses what is not finite
    let denoising = DenoiseOptions { strength, ..DenoiseOptions::for_dimension(D) };
    let grid = image.frame().grid(options.units);
    let values = image.samples().to_f32();
    let clean = denoise(&values, &grid, &denoising, watch)?;
    let clean = Image::new(*image.frame(), Samples::F32(clean));
    Ok(Some(clean.expect("there is a value for each sample of the image")))
}

/// The potential of features that are thinned to crests: valleys of one depth and width.
fn thinned<const D: usize>(
    image: &Image<D>,
    options: &FeatureOptions,
    watch: &mut dyn Watch,
) -> Result<Enhanced, EnhanceError> {
    let grid = image.frame().grid(options.units);
    let width = match options.smooth {
        Some(width) if width > 0.0 => width,
        _ => WIDTH * D as f64 * grid.least_step(),
    };
    let copied;
    let values = match image.samples() {
        Samples::F32(values) => values,
        other => {
            copied = other.to_f32();
            &copied
        }
    };
    let crests: Vec<FeaturePoint<D>> = match options.features {
        Features::Ridges => ridges::ridges(values, &grid, &options.ridges, watch)?,
        Features::Faults => faults::faults(values, &grid, &options.faults, watch)?,
        Features::Horizons => horizons::horizons(values, &grid, &options.horizons, watch)?,
        _ => edge_crests::edge_crests(values, &grid, &options.crests, watch)?,
    };
    check(watch, Phase::Potential, 0.9, None)?;
    let mut values = widen(&crests, &grid, width);
    if options.repel {
        values.par_iter_mut().for_each(|b| *b = -*b + 0.0);
    }
    check(watch, Phase::Potential, 1.0, None)?;
    Ok(Enhanced { values, constant: crests.is_empty() })
}

/// The potential of a label image: valleys of one depth where labels meet.
fn labelled<const D: usize>(
    image: &Image<D>,
    options: &FeatureOptions,
    watch: &mut dyn Watch,
) -> Result<Enhanced, EnhanceError> {
    let grid = image.frame().grid(options.units);
    let labels = image.samples().to_f32();
    let sigma = grid.step.map(|step| (options.edge_scale * grid.least_step() / step).max(0.7));
    let valleys = labels::interfaces(&labels, &grid, sigma, watch)?;
    let constant = valleys.is_none();
    let mut values = valleys.unwrap_or_else(|| vec![0.0; labels.len()]);
    let sign = if options.repel { 1.0 } else { -1.0 };
    let sigma = options.sigma(&grid);
    let turn = |part: &mut [f32]| part.iter_mut().for_each(|b| *b = *b * sign + 0.0);
    turn(&mut values);
    if sigma[0] > 0.0 {
        gaussian(&mut values, grid.shape, sigma);
        values.iter_mut().for_each(|b| *b = b.clamp(-1.0, 1.0));
    }
    check(watch, Phase::Potential, 1.0, None)?;
    Ok(Enhanced { values, constant })
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

/// The widest that Gaussians and reaches may be, in samples: beyond it nothing of an image is left.
const LONGEST: f64 = 1000.0;

/// The longest that a feature may have to be, in samples.
const MOST_EXTENT: f64 = 1e6;

/// Refuses the first of some options that is not within its range, ends included: name, value, least and most.
fn within(
    kind: &'static str,
    ranges: &[(&'static str, f64, f64, f64)],
) -> Result<(), EnhanceError> {
    for &(option, value, least, most) in ranges {
        if !(least..=most).contains(&value) {
            return Err(EnhanceError::Option { kind, option, value, least, most });
        }
    }
    Ok(())
}

fn check_options(options: &FeatureOptions) -> Result<(), EnhanceError> {
    let (scale, smooth) = (options.edge_scale, options.smooth.unwrap_or(0.0));
    if !(scale.is_finite() && scale >= LEAST_EDGE_SCALE) {
        return Err(EnhanceError::EdgeScale { value: scale });
    }
    if !(smooth.is_finite() && smooth >= 0.0) {
        return Err(EnhanceError::Smooth { value: smooth });
    }
    Ok(())
}

/// The gradients of the image, and what of them is a full feature; `None` if all are 0.
fn edges<const D: usize>(
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

#[cfg(test)]
mod tests;
