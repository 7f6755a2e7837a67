//! How the image becomes a potential.

use atomesh::enhance::{
    CrestOptions, EdgeOperator, FaultOptions, FeatureOptions, Features, HorizonOptions, Mixture,
    Polarity,
};

use super::section::section;
use crate::values::Text;
#[cfg(feature = "clap")]
use crate::values::{named, number_in};

section! {
    /// How the image becomes a potential.
    pub struct PotentialOptions {
        /// What attracts atoms. In images that show features directly: dark or bright places, edges, boundaries
        /// between labels (labels), or none. In raw images: ridges (the middles of lines and sheets), and in
        /// seismic amplitudes faults and horizons. Several kinds may share a potential, each with its weight, as
        /// in faults,horizons:0.5. Default: dark
        #[arg(long, visible_alias = "as", value_name = "KIND[:WEIGHT],...")]
        pub features: Text<Mixture>,
        /// How edges are found: by derivatives of a Gaussian (gaussian), by the paper's Prewitt differences
        /// (prewitt), or thinned to where a Gaussian's gradient is greatest, then widened to valleys of one depth
        /// (crest). Default: gaussian
        #[arg(long, value_name = "OPERATOR",
            value_parser = named::<EdgeOperator>(&["gaussian", "prewitt", "crest"]))]
        pub edge_operator: EdgeOperator,
        /// Standard deviation of the Gaussian that finds edges and boundaries between labels, in units of the
        /// smallest sample spacing, 0.3 or more. Default: 1.5; with --edge-operator crest, from the image's noise
        #[arg(long, value_name = "SIGMA",
            value_parser = number_in(0.3, 1000.0, "a number of samples from 0.3 to 1000"))]
        pub edge_scale: f64,
        /// Remove noise before features are found, but keep edges (non-local means). SHARE is how much patches
        /// of the image may differ, relative to the noise, and still be averaged, 0.01 to 10; 0.4 if left out.
        /// Default: off
        #[arg(long, value_name = "SHARE", num_args = 0..=1, require_equals = true,
            default_missing_value = "0.4",
            value_parser = number_in(0.01, 10.0, "a number from 0.01 to 10"))]
        pub denoise: f64,
        /// Which ridges and horizons: bright ones (peaks), dark ones (troughs), or both. Default: bright
        #[arg(long, value_name = "WHICH",
            value_parser = named::<Polarity>(&["bright", "dark", "both"]))]
        pub polarity: Polarity,
        /// Standard deviation of the Gaussian whose derivatives find ridges and horizons, in units of the smallest
        /// sample spacing, 0.3 or more. Default: 1.5 for ridges, 1 for horizons
        #[arg(long, value_name = "SIGMA",
            value_parser = number_in(0.3, 1000.0, "a number of samples from 0.3 to 1000"))]
        pub scale: f64,
        /// Standard deviation of the Gaussian that averages the directions of ridges and horizons, in units of the
        /// smallest sample spacing; for ridges, 0 takes the direction at each sample. Default: 12 for ridges, 8 for
        /// horizons
        #[arg(long, value_name = "SIGMA",
            value_parser = number_in(0.0, 1000.0, "a number of samples from 0 to 1000"))]
        pub normal_scale: f64,
        /// Least strength of features where connected to stronger parts (hysteresis), 0 to 1. Default: 0.3 for
        /// ridges, 0.15 for horizons and faults, 0.2 for edge crests, 0.07 for edges that atoms are put on
        #[arg(long, value_name = "SHARE", value_parser = number_in(0.0, 1.0, "a number from 0 to 1"))]
        pub low: f64,
        /// Strength that each feature must reach somewhere (hysteresis), 0 to 1. Default: 0.4 for horizons, 0.5 for
        /// ridges, faults and edge crests, 0.2 for edges that atoms are put on
        #[arg(long, value_name = "SHARE", value_parser = number_in(0.0, 1.0, "a number from 0 to 1"))]
        pub high: f64,
        /// Least length of a feature in samples; in 3-D its square is the least area. Default: 10 for ridges and edge
        /// crests, 20 for horizons and faults
        #[arg(long, value_name = "LENGTH",
            value_parser = number_in(0.0, 1e6, "a number of samples from 0 to 1e6"))]
        pub least_length: f64,
        /// Mean distance, along layers and in samples, of what is compared on the two sides of a fault, 1 to 1000: a
        /// larger value tolerates more noise but blurs faults close together. Default: 4
        #[arg(long, value_name = "LENGTH",
            value_parser = number_in(1.0, 1000.0, "a number of samples from 1 to 1000"))]
        pub layer_reach: f64,
        /// Standard deviation of the average along a fault's dip, in samples, 0.5 to 1000: a larger value tolerates
        /// more noise but blurs curved faults. Default: 12
        #[arg(long, value_name = "SIGMA",
            value_parser = number_in(0.5, 1000.0, "a number of samples from 0.5 to 1000"))]
        pub dip_reach: f64,
        /// Least dip of a fault from the horizontal in degrees, in sample coordinates, 20 to 85. Default: 45
        #[arg(long, value_name = "DEGREES",
            value_parser = number_in(20.0, 85.0, "an angle from 20 to 85"))]
        pub least_dip: f64,
        /// Repel atoms from features, so that they line up alongside. Default: false; true with
        /// --mesh voronoi, whose faces then fall on the features
        #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true,
            default_missing_value = "true")]
        pub repel: bool,
        /// Standard deviation of the Gaussian that smooths the potential, in lattice units; for ridges, faults,
        /// horizons and edge crests, the width of their valleys. Default: the smallest sample spacing; with
        /// --mesh voronoi, a quarter of the edge length for dark and bright features that repel; none for edges
        #[arg(long, value_name = "SIGMA",
            value_parser = number_in(0.0, f64::MAX, "a length of 0 or more"))]
        pub smooth: f64,
    }
}

impl PotentialOptions {
    /// The core's options: what is not given comes from `basis`.
    pub fn feature_options(&self, basis: FeatureOptions) -> FeatureOptions {
        let single = self.features.as_ref().and_then(|mixture| mixture.0.single());
        let crests = self.crests();
        FeatureOptions {
            features: single.unwrap_or(basis.features),
            edge_operator: self.edge_operator.unwrap_or(basis.edge_operator),
            edge_scale: self.edge_scale.unwrap_or(basis.edge_scale),
            smooth: self.smooth.or(basis.smooth),
            denoise: self.denoise.or(basis.denoise),
            repel: self.repel.unwrap_or(basis.repel),
            ridges: crests.or(basis.ridges),
            horizons: HorizonOptions { crests: crests.or(basis.horizons.crests), ..basis.horizons },
            faults: FaultOptions {
                layer_reach: self.layer_reach.unwrap_or(basis.faults.layer_reach),
                dip_reach: self.dip_reach.unwrap_or(basis.faults.dip_reach),
                least_dip: self.least_dip.unwrap_or(basis.faults.least_dip),
                crests: crests.or(basis.faults.crests),
                ..basis.faults
            },
            edges: CrestOptions { scale: self.edge_scale, ..crests }.or(basis.edges),
            ..basis
        }
    }

    /// What is given for all kinds of crests.
    fn crests(&self) -> CrestOptions {
        CrestOptions {
            polarity: self.polarity,
            scale: self.scale,
            normal_scale: self.normal_scale,
            low: self.low,
            high: self.high,
            least_length: self.least_length,
        }
    }

    /// Whether the boundaries between labels are the only features.
    pub fn are_labels(&self) -> bool {
        let single = self.features.as_ref().and_then(|mixture| mixture.0.single());
        single == Some(Features::Labels)
    }

    /// The kinds of features, if they are more than one of weight 1.
    pub fn mixture(&self) -> Option<Mixture> {
        let Text(mixture) = self.features.as_ref()?;
        mixture.single().is_none().then(|| mixture.clone())
    }
}
