//! Values of options: how they are spelt on the command line, in a configuration, and as strings elsewhere.

#[cfg(feature = "clap")]
mod arguments;
mod labels;
mod materials;
mod size;
mod wells;
mod world_box;

#[cfg(feature = "clap")]
pub use arguments::{count_in, named, number_in};
pub use labels::{LabelSize, Labels};
pub use materials::MaterialSpec;
pub use size::SizeValue;
pub use wells::{BarrierSpec, SideSpec, WellSpec};
pub use world_box::WorldBox;

use std::fmt;
use std::str::FromStr;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A value that is spelt as text in a configuration too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Text<T>(pub T);

impl<T: FromStr> FromStr for Text<T> {
    type Err = T::Err;

    fn from_str(text: &str) -> Result<Self, T::Err> {
        text.parse().map(Self)
    }
}

impl<T: fmt::Display> Serialize for Text<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&self.0)
    }
}

impl<'de, T: FromStr<Err: fmt::Display>> Deserialize<'de> for Text<T> {
    fn deserialize<De: Deserializer<'de>>(deserializer: De) -> Result<Self, De::Error> {
        String::deserialize(deserializer)?.parse().map_err(De::Error::custom)
    }
}

/// What is wrong with the text of a value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{found:?}; expected {expected}")]
pub struct ValueError {
    found: String,
    expected: &'static str,
}

/// Numbers set apart by commas, such as a point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<f64>")]
pub struct Numbers(pub Vec<f64>);

impl TryFrom<Vec<f64>> for Numbers {
    type Error = ValueError;

    fn try_from(numbers: Vec<f64>) -> Result<Self, ValueError> {
        match numbers.iter().find(|n| !n.is_finite()) {
            Some(odd) => Err(ValueError { found: odd.to_string(), expected: "finite numbers" }),
            None => Ok(Self(numbers)),
        }
    }
}

impl FromStr for Numbers {
    type Err = ValueError;

    fn from_str(text: &str) -> Result<Self, ValueError> {
        let expected = "finite numbers set apart by commas, as in 1.5,0,-2";
        let number = |part: &str| part.trim().parse().ok().filter(|n: &f64| n.is_finite());
        let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
        numbers.map(Self).ok_or_else(|| ValueError { found: text.into(), expected })
    }
}

impl fmt::Display for Numbers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.iter().map(f64::to_string).collect::<Vec<_>>().join(","))
    }
}

/// Counts set apart by commas: a shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Counts(pub Vec<usize>);

impl FromStr for Counts {
    type Err = ValueError;

    fn from_str(text: &str) -> Result<Self, ValueError> {
        let expected = "counts of 1 or more set apart by commas, x first, as in 640,480";
        let count = |part: &str| part.trim().parse().ok().filter(|&n: &usize| n > 0);
        let counts: Option<Vec<usize>> = text.split(',').map(count).collect();
        counts.map(Self).ok_or_else(|| ValueError { found: text.into(), expected })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_survives_a_round_trip() {
        for text in ["0..50,-2.5..80", "0..1,0..1,0..1"] {
            assert_eq!(text.parse::<WorldBox>().unwrap().to_string(), text);
        }
        for bad in ["", "1", "1..1", "2..1", "0..nan", "0..1,"] {
            assert!(bad.parse::<WorldBox>().is_err(), "{bad}");
        }
        for bad in ["", "1,", "nan", "1;2"] {
            assert!(bad.parse::<Numbers>().is_err() && bad.parse::<Counts>().is_err(), "{bad}");
        }
    }
}
