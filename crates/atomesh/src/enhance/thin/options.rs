//! What finders of crests share: options, and which crests they keep.

use crate::enhance::error::{LONGEST, MOST_EXTENT, Within, within};
use crate::enhance::{EnhanceError, LEAST_EDGE_SCALE};
use serde::{Deserialize, Serialize};

/// Which of the lines and sheets along which an image is extreme count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Polarity {
    /// Those brighter than what is about them; of amplitudes, peaks.
    #[default]
    Bright,
    /// Those darker than what is about them; of amplitudes, troughs.
    Dark,
    /// Both.
    Both,
}

/// How the lines and sheets that features are thinned to are found.
///
/// `None` stands for the default of whatever is looked for. Lengths are in least steps or samples, as each option says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct CrestOptions {
    /// Which ridges or horizons count; faults and edges have no polarity. Default: bright, of amplitudes the peaks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polarity: Option<Polarity>,
    /// Standard deviation, in least steps, of the Gaussian whose derivatives find ridges, horizons and edges; 0.3 or
    /// more. Default of ridges: 1.5, as wide as features of three samples, and blind to what is finer (Hale's of 2002 is
    /// 3). Of horizons: 1, since reflections are a few samples apart. Of edges: the least of 1.5…4 at which half the
    /// image's contrast stands out of its noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Standard deviation, in least steps, of the Gaussian that smooths the structure tensor, whose leading eigenvector is
    /// the normal of ridges and horizons; of horizons also of the window in which amplitudes are balanced, 0.3 or more.
    /// Of ridges 0 takes normals from the second derivatives at each sample instead, for features that cross or lie close
    /// together. Default of ridges: 12, Hale's (2002). Of horizons: 8, narrower than faults are apart, wider than a
    /// wavelength.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal_scale: Option<f64>,
    /// The least strength of a crest, 0…1, where it is linked to stronger ones. Default of ridges: 0.3, between the
    /// background and a full feature. Of horizons: 0.15, where 1 is the 98th percentile. Of edges: 0.2, where 1 is the
    /// 98th percentile of their gradients; with 0.1 atoms of a brain's mesh also followed what nobody would call an edge,
    /// at the cost of those that count. Of faults: a likelihood of 0.15; less finds more of where a fault dies out, and
    /// more beside it. Atoms are put on edges of 0.07 and more, in groups that reach 0.2: what is weaker than noise is left
    /// out anyway.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low: Option<f64>,
    /// The least strength of the strongest crest of a group, 0…1. Default: 0.5; of horizons 0.4.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub high: Option<f64>,
    /// The least length of a line, in samples; the least area of a sheet is its square. Default: 10 for ridges and edges,
    /// 20 for horizons and faults: single groups of noise are smaller, and what is smaller cuts few layers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_length: Option<f64>,
}

impl CrestOptions {
    /// These options, and of `others` those that are not given here.
    pub fn or(self, others: Self) -> Self {
        Self {
            polarity: self.polarity.or(others.polarity),
            scale: self.scale.or(others.scale),
            normal_scale: self.normal_scale.or(others.normal_scale),
            low: self.low.or(others.low),
            high: self.high.or(others.high),
            least_length: self.least_length.or(others.least_length),
        }
    }

    /// The thresholds, with the defaults of what is looked for.
    pub(super) fn thresholds(&self, default: Thresholds) -> Thresholds {
        Thresholds {
            low: self.low.unwrap_or(default.low),
            high: self.high.unwrap_or(default.high),
            least_length: self.least_length.unwrap_or(default.least_length),
        }
    }

    /// Refuses an option that no finder takes; `kind` is what is looked for.
    pub(super) fn check(&self, kind: &'static str) -> Result<(), EnhanceError> {
        let given = |option, value: Option<f64>, least, most| {
            value.map(|value| Within { option, value, least, most })
        };
        let ranges = [
            given("scale", self.scale, LEAST_EDGE_SCALE, LONGEST),
            given("normal-scale", self.normal_scale, 0.0, LONGEST),
            given("low", self.low, 0.0, 1.0),
            given("high", self.high, 0.0, 1.0),
            given("least-length", self.least_length, 0.0, MOST_EXTENT),
        ];
        within(kind, ranges.into_iter().flatten())
    }
}

/// What crests must be to be kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Thresholds {
    /// See [`CrestOptions::low`].
    pub low: f64,
    /// See [`CrestOptions::high`].
    pub high: f64,
    /// See [`CrestOptions::least_length`].
    pub least_length: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::{FaultOptions, FeatureOptions, HorizonOptions};

    #[test]
    fn options_keep_their_names_in_files() {
        let text = r#"{"ridges": {"polarity": "dark", "scale": 2.0, "normal-scale": 0.0},
            "horizons": {"balanced": false, "low": 0.25}, "crests": {"scale": 1.0, "high": 0.75},
            "faults": {"layer-reach": 3.0, "least-length": 30.0}}"#;
        let options: FeatureOptions = serde_json::from_str(text).unwrap();
        let none = CrestOptions::default();
        let expected = FeatureOptions {
            ridges: CrestOptions {
                polarity: Some(Polarity::Dark),
                scale: Some(2.0),
                normal_scale: Some(0.0),
                ..none
            },
            horizons: HorizonOptions {
                balanced: false,
                crests: CrestOptions { low: Some(0.25), ..none },
            },
            edges: CrestOptions { scale: Some(1.0), high: Some(0.75), ..none },
            faults: FaultOptions {
                layer_reach: 3.0,
                crests: CrestOptions { least_length: Some(30.0), ..none },
                ..Default::default()
            },
            ..Default::default()
        };
        assert_eq!(options, expected);
        let written = serde_json::to_string(&options).unwrap();
        assert_eq!(serde_json::from_str::<FeatureOptions>(&written).unwrap(), options);
        for unknown in ["ridges", "horizons", "crests", "faults"] {
            let text = format!(r#"{{"{unknown}": {{"lenght": 1.0}}}}"#);
            let error = serde_json::from_str::<FeatureOptions>(&text).unwrap_err().to_string();
            assert!(error.contains("unknown field `lenght`"), "{error}");
        }
    }

    #[test]
    fn what_is_not_given_is_taken_from_others() {
        let some = CrestOptions { low: Some(0.1), ..Default::default() };
        let others = CrestOptions { low: Some(0.2), high: Some(0.9), ..Default::default() };
        let both = some.or(others);
        assert_eq!((both.low, both.high, both.scale), (Some(0.1), Some(0.9), None));
    }
}
