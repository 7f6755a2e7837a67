//! What in an image attracts atoms, and how it is found.

use super::thin::{CrestOptions, FaultOptions, HorizonOptions};
use super::{EnhanceError, LEAST_EDGE_SCALE};
use crate::image::{Grid, Units};
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Standard deviation, in least steps, by which dark and bright features are rounded off.
const ROUNDED: f64 = 1.0;

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
    /// to valleys of one depth and width ([`FeatureOptions::edges`]).
    Crest,
}

/// How an image becomes a potential.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct FeatureOptions {
    /// What attracts atoms. Default: dark, as in the paper's seismic images.
    pub features: Features,
    /// How edges are found; the other features ignore it. Default: Gaussian, since the noise of one sample is enough to
    /// make a Prewitt edge.
    pub edge_operator: EdgeOperator,
    /// Standard deviation, in least steps, of the Gaussian operator, and of the Gaussian that finds where labels meet; 0.3
    /// or more, since less would hardly reach the neighbours. It is as wide in lattice units along every axis, but not
    /// below 0.7 samples along a coarser one. Prewitt's operator ignores it. Default 1.5: wide enough to fill
    /// the gaps between samples of a slanted edge, narrow enough to keep the two sides of a sheet of 4
    /// samples apart.
    pub edge_scale: f64,
    /// Standard deviation, in lattice units, of a Gaussian over the finished potential, 0 or more. b is not
    /// scaled to −1 again, so narrow features become shallow. Default for dark and bright features: the least step,
    /// which rounds off the steps of one sample that atoms would catch on (measured on fault images: better shape and
    /// better alignment). Default for edges: none, since the operator has smoothed. Smoothing that reaches beyond the
    /// features' width costs alignment.
    /// Of features that are thinned (ridges, faults, horizons, edges by their crests) it is the width of the valleys
    /// made of them, −exp(−s²/2σ²) at the distance s, no less than 0.7 samples; their depth stays 1. Default: one
    /// least step in 2-D, 1.5 in 3-D.
    pub smooth: Option<f64>,
    /// How ridges are found.
    pub ridges: CrestOptions,
    /// How faults are found.
    pub faults: FaultOptions,
    /// How horizons are found.
    pub horizons: HorizonOptions,
    /// How edges are found by [`EdgeOperator::Crest`].
    #[serde(rename = "crests")]
    pub edges: CrestOptions,
    /// Takes noise off the image first and keeps its edges ([`denoise`](super::denoise), its other options by default):
    /// h / σ, how much patches of the image may differ, in standard deviations of the noise, and still be averaged; 0.01
    /// to 100. Labels are names, and stay as they are. Default: the image stays as it is.
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
            ridges: CrestOptions::default(),
            faults: FaultOptions::default(),
            horizons: HorizonOptions::default(),
            edges: CrestOptions::default(),
            denoise: None,
            repel: false,
            units: Units::default(),
        }
    }
}

impl FeatureOptions {
    /// The standard deviation of [`FeatureOptions::smooth`] along each axis, in samples.
    pub(super) fn sigma<const D: usize>(&self, grid: &Grid<D>) -> [f64; D] {
        match (self.smooth, self.features) {
            (Some(sigma), _) => grid.step.map(|step| sigma / step),
            (None, Features::Dark | Features::Bright) => {
                grid.step.map(|step| ROUNDED * grid.least_step() / step)
            }
            (None, _) => [0.0; D],
        }
    }

    /// Whether features are thinned to crests, and widened again.
    pub(super) fn thins(&self) -> bool {
        match self.features {
            Features::Ridges | Features::Faults | Features::Horizons => true,
            Features::Edges => self.edge_operator == EdgeOperator::Crest,
            _ => false,
        }
    }

    /// Refuses a width out of its range.
    pub(super) fn check(&self) -> Result<(), EnhanceError> {
        let (scale, smooth) = (self.edge_scale, self.smooth.unwrap_or(0.0));
        if !(scale.is_finite() && scale >= LEAST_EDGE_SCALE) {
            return Err(EnhanceError::EdgeScale { value: scale });
        }
        if !(smooth.is_finite() && smooth >= 0.0) {
            return Err(EnhanceError::Smooth { value: smooth });
        }
        Ok(())
    }
}
