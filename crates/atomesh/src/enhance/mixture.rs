//! Several kinds of features in one potential, each with its weight: faults and horizons, as in Fig. 9 of Hale (2001).

use std::fmt;
use std::str::FromStr;

use super::{EnhanceError, Enhanced, FeatureOptions, Features, denoised, enhance};
use crate::image::Image;
use crate::watch::Watch;

/// A kind of features and what it weighs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// The kind.
    pub features: Features,
    /// The depth of its valleys in the mixture, above 0, at most 1.
    pub weight: f64,
}

/// Kinds of features and their weights, as in `faults:1,horizons:0.5`; a weight of 1 may be left out.
///
/// There is at least one kind, and none is given twice.
///
/// ```
/// use atomesh::enhance::Mixture;
///
/// let mixture: Mixture = "faults,horizons:0.5".parse()?;
/// assert_eq!(mixture.shares()[1].weight, 0.5);
/// assert_eq!(mixture.to_string(), "faults,horizons:0.5");
/// # Ok::<(), atomesh::enhance::MixtureError>(())
/// ```
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Mixture(Vec<Share>);

/// Why a text is not a mixture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MixtureError {
    /// An unknown kind.
    #[error("{name:?} is not a kind of features; expected one of {}", Features::NAMES.join(", "))]
    Kind {
        /// The name found.
        name: String,
    },
    /// A weight out of its range.
    #[error("{text:?} weighs {name}; expected a number above 0, at most 1")]
    Weight {
        /// The kind of features.
        name: String,
        /// The weight found.
        text: String,
    },
    /// A kind that is given twice.
    #[error("{name} is given twice; expected each kind once")]
    Twice {
        /// The kind of features.
        name: String,
    },
}

impl From<Mixture> for String {
    fn from(mixture: Mixture) -> Self {
        mixture.to_string()
    }
}

impl TryFrom<String> for Mixture {
    type Error = MixtureError;

    fn try_from(text: String) -> Result<Self, MixtureError> {
        text.parse()
    }
}

impl Mixture {
    /// The kinds in the order in which they were given.
    pub fn shares(&self) -> &[Share] {
        &self.0
    }

    /// The kind, if there is only one, of weight 1.
    pub fn single(&self) -> Option<Features> {
        match self.0[..] {
            [Share { features, weight: 1.0 }] => Some(features),
            _ => None,
        }
    }

    /// Whether a kind is among them.
    pub fn contains(&self, features: Features) -> bool {
        self.0.iter().any(|share| share.features == features)
    }
}

impl From<Features> for Mixture {
    fn from(features: Features) -> Self {
        Self(vec![Share { features, weight: 1.0 }])
    }
}

impl FromStr for Mixture {
    type Err = MixtureError;

    fn from_str(text: &str) -> Result<Self, MixtureError> {
        let mut shares: Vec<Share> = Vec::new();
        for part in text.split(',') {
            let (name, weight) = part.split_once(':').unwrap_or((part, "1"));
            let name = name.trim();
            let features = name.parse().map_err(|()| MixtureError::Kind { name: name.into() })?;
            let number: Option<f64> = weight.trim().parse().ok();
            let Some(weight) = number.filter(|w| *w > 0.0 && *w <= 1.0) else {
                return Err(MixtureError::Weight { name: name.into(), text: weight.into() });
            };
            if shares.iter().any(|share| share.features == features) {
                return Err(MixtureError::Twice { name: name.into() });
            }
            shares.push(Share { features, weight });
        }
        Ok(Self(shares))
    }
}

impl fmt::Display for Mixture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, Share { features, weight }) in self.0.iter().enumerate() {
            let comma = if i == 0 { "" } else { "," };
            write!(f, "{comma}{}", features.name())?;
            if *weight != 1.0 {
                write!(f, ":{weight}")?;
            }
        }
        Ok(())
    }
}

/// Makes one potential of several kinds of features: at each sample the deepest of their valleys, each scaled by the
/// weight of its kind. `image_of` gives the image of each kind: one for labels, one for all others, of the same shape.
///
/// Where features of two kinds meet, the potential is that of the stronger, not the sum, so that it stays within
/// −1…0 (0…1 if it repels) and crossings do not gather atoms.
///
/// # Errors
/// As [`enhance`], which finds each kind by these options.
pub fn enhance_mixture<'a, const D: usize>(
    mixture: &Mixture,
    options: &FeatureOptions,
    image_of: impl Fn(Features) -> &'a Image<D>,
    watch: &mut dyn Watch,
) -> Result<Enhanced<D>, EnhanceError> {
    let mut all: Option<Enhanced<D>> = None;
    // the denoised image, for all kinds but labels
    let mut clean: Option<Image<D>> = None;
    for Share { features, weight } in &mixture.0 {
        let mut options = FeatureOptions { features: *features, ..*options };
        let image = image_of(*features);
        if clean.is_none() {
            clean = denoised(image, &options, watch)?;
        }
        options.denoise = None;
        let image = clean.as_ref().filter(|_| *features != Features::Labels).unwrap_or(image);
        let mut one = enhance(image, &options, watch)?;
        let weight = *weight as f32;
        one.values.iter_mut().for_each(|b| *b *= weight);
        one.crests = None; // each kind has its own
        all = Some(match all {
            None => one,
            Some(mut all) => {
                all.constant &= one.constant;
                for (b, other) in all.values.iter_mut().zip(one.values) {
                    if other.abs() > b.abs() {
                        *b = other;
                    }
                }
                all
            }
        });
    }
    Ok(all.unwrap_or(Enhanced { values: Vec::new(), constant: true, crests: None }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Frame, Samples};
    use crate::watch::Silent;

    #[test]
    fn what_is_no_mixture_is_named() {
        let error = |text: &str| text.parse::<Mixture>().unwrap_err().to_string();
        assert!(error("folds").starts_with("\"folds\" is not a kind"));
        assert!(error("").contains("dark, bright, edges"));
        assert!(error("dark:2").contains("\"2\" weighs dark"));
        for weight in ["0", "-1", "nan", "x", ""] {
            assert!(format!("edges:{weight}").parse::<Mixture>().is_err(), "{weight}");
        }
        assert!(error("dark,edges,dark:0.5").contains("dark is given twice"));
    }

    #[test]
    fn every_kind_survives_its_name() {
        for name in Features::NAMES {
            let mixture: Mixture = format!("{name}:0.25").parse().unwrap();
            assert_eq!(mixture.to_string(), format!("{name}:0.25"));
            assert_eq!(mixture.single(), None);
            let mixture: Mixture = name.parse().unwrap();
            assert_eq!(mixture.to_string(), name);
            assert!(mixture.single().is_some_and(|f| f.name() == name && mixture.contains(f)));
        }
    }

    #[test]
    fn the_deeper_valley_counts_and_by_its_weight() {
        let mut grey = vec![100u8; 32 * 32];
        grey[8 * 32..9 * 32].fill(0); // a dark row
        (0..32).for_each(|y| grey[y * 32 + 20] = 200); // a bright column
        let image = Image::new(Frame::new([32, 32]).unwrap(), Samples::U8(grey.into())).unwrap();
        for repel in [false, true] {
            let options = FeatureOptions { repel, smooth: Some(0.0), ..Default::default() };
            let mixture = "dark,bright:0.5".parse().unwrap();
            let found = enhance_mixture(&mixture, &options, |_| &image, &mut Silent).unwrap();
            let sign = if repel { 1.0 } else { -1.0 };
            let at = |x: usize, y: usize| sign * found.values[y * 32 + x];
            assert_eq!((at(3, 8), at(20, 3), at(3, 3)), (1.0, 0.5, 0.0));
            assert!(!found.constant);
        }
    }
}
