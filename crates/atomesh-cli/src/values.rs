//! Values of options: how they are spelt on the command line and in a configuration.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use atomesh::image::Frame;
use atomesh::run::Size;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::de::value::{Error as NameError, StrDeserializer};
use serde::de::{DeserializeOwned, Error as _, IntoDeserializer};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Parses one of the names by which serde knows the values of `T`.
pub fn named<T>(names: &'static [&'static str]) -> impl TypedValueParser<Value = T>
where
    T: DeserializeOwned + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names).try_map(|name| {
        let name: StrDeserializer<'_, NameError> = name.as_str().into_deserializer();
        T::deserialize(name)
    })
}

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

/// A box in world coordinates, `x0..x1,y0..y1` and in 3-D `,z0..z1`.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldBox(Vec<Range<f64>>);

impl FromStr for WorldBox {
    type Err = ValueError;

    fn from_str(text: &str) -> Result<Self, ValueError> {
        let error = || ValueError {
            found: text.into(),
            expected: "a range of finite numbers for each axis, as in 0..50,20..80",
        };
        let range = |part: &str| {
            let (start, end) = part.split_once("..")?;
            let range = start.trim().parse::<f64>().ok()?..end.trim().parse::<f64>().ok()?;
            (range.start.is_finite() && range.end.is_finite() && range.start < range.end)
                .then_some(range)
        };
        text.split(',').map(range).collect::<Option<_>>().map(Self).ok_or_else(error)
    }
}

impl fmt::Display for WorldBox {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ranges: Vec<_> = self.0.iter().map(|r| format!("{}..{}", r.start, r.end)).collect();
        f.write_str(&ranges.join(","))
    }
}

impl WorldBox {
    /// The samples of the box, rounded outward and limited to the image: first, and one past the
    /// last, along each axis. Where the axes are turned, of the least upright box around it.
    pub fn samples<const D: usize>(
        &self,
        frame: &Frame<D>,
    ) -> Result<([usize; D], [usize; D]), String> {
        if self.0.len() != D {
            return Err(format!("the crop {self} names {} of {D} axes", self.0.len()));
        }
        let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
        for corner in 0..1 << D {
            let at = |k: usize| if corner >> k & 1 == 0 { self.0[k].start } else { self.0[k].end };
            let p =
                frame.world_to_lattice(atomesh::image::Units::Samples, &std::array::from_fn(at));
            for k in 0..D {
                (low[k], high[k]) = (low[k].min(p[k]), high[k].max(p[k]));
            }
        }
        let shape = frame.shape();
        // a side meant to be on a sample may come out a rounding beyond it
        let slack = |x: f64| 1e-9 * x.abs().max(1.0);
        for k in 0..D {
            if high[k] + slack(high[k]) < 0.0 || low[k] - slack(low[k]) > (shape[k] - 1) as f64 {
                let axis = ["x", "y", "z"][k];
                return Err(format!(
                    "the crop {self} misses the image: along {axis} it spans samples {:.1} to {:.1}, \
                     the image 0 to {}",
                    low[k],
                    high[k],
                    shape[k] - 1
                ));
            }
        }
        let start = std::array::from_fn(|k| (low[k] + slack(low[k])).floor().max(0.0) as usize);
        let end = std::array::from_fn(|k| {
            ((high[k] - slack(high[k])).ceil().max(0.0) as usize + 1).min(shape[k])
        });
        Ok((start, end))
    }
}

/// A nominal distance: `8`, or `6..18`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeValue(pub Size);

impl FromStr for SizeValue {
    type Err = ValueError;

    fn from_str(text: &str) -> Result<Self, ValueError> {
        let error = || ValueError {
            found: text.into(),
            expected: "a length above 0, as in 8, or two from the lesser to the greater, as in 6..18",
        };
        let length = |part: &str| {
            let length = part.trim().parse::<f64>().ok();
            length.filter(|n| n.is_finite() && *n > 0.0).ok_or_else(error)
        };
        match text.split_once("..") {
            None => Ok(Self(Size::Constant(length(text)?))),
            Some((min, max)) => {
                let (min, max) = (length(min)?, length(max)?);
                if min <= max { Ok(Self(Size::Range { min, max })) } else { Err(error()) }
            }
        }
    }
}

impl Serialize for SizeValue {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            // a wavelength has options of its own
            Size::Default | Size::Wavelength { .. } => serializer.serialize_none(),
            Size::Constant(d) => serializer.serialize_f64(d),
            Size::Range { min, max } => serializer.collect_str(&format_args!("{min}..{max}")),
        }
    }
}

impl<'de> Deserialize<'de> for SizeValue {
    fn deserialize<De: Deserializer<'de>>(deserializer: De) -> Result<Self, De::Error> {
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "a length as in 8, or a range as in \"6..18\"")]
        enum Spelling {
            Number(f64),
            Text(String),
        }
        let text = match Spelling::deserialize(deserializer)? {
            Spelling::Number(d) => d.to_string(),
            Spelling::Text(text) => text,
        };
        text.parse().map_err(De::Error::custom)
    }
}

/// A number within limits, for clap.
pub fn number_in(
    least: f64,
    greatest: f64,
    expected: &'static str,
) -> impl Fn(&str) -> Result<f64, ValueError> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.trim().parse().ok();
        number
            .filter(|n| (least..=greatest).contains(n))
            .ok_or_else(|| ValueError { found: text.into(), expected })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_lengths_or_ascending_ranges() {
        let size = |text: &str| text.parse::<SizeValue>().map(|s| s.0);
        assert_eq!(size("8"), Ok(Size::Constant(8.0)));
        assert_eq!(size("6..18"), Ok(Size::Range { min: 6.0, max: 18.0 }));
        assert_eq!(size("0.5..1e3"), Ok(Size::Range { min: 0.5, max: 1000.0 }));
        for bad in ["", "0", "-1", "nan", "inf", "18..6", "6..", "..18", "6...18", "a", "1,2"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_crop_is_rounded_outward_and_limited_to_the_image() {
        let frame = Frame::new([10, 20]).unwrap().with_spacing([2.0, 0.1]).unwrap();
        let frame = frame.with_origin([-4.0, 1.0]).unwrap();
        let crop = |text: &str| text.parse::<WorldBox>().unwrap().samples(&frame);
        assert_eq!(crop("-4..14,1..2.9"), Ok(([0, 0], [10, 20])));
        assert_eq!(crop("-1..1.5,1.3..1.4"), Ok(([1, 3], [4, 5])));
        assert_eq!(crop("-100..100,-5..1.1"), Ok(([0, 0], [10, 2])));
        let missed = crop("20..30,1..2").unwrap_err();
        assert!(missed.contains("along x") && missed.contains("12.0 to 17.0"), "{missed}");
        assert!(crop("1..2").unwrap_err().contains("1 of 2 axes"));
    }

    #[test]
    fn a_crop_of_mirrored_axes_is_in_order() {
        let frame = Frame::new([10, 10]).unwrap().with_direction([[-1.0, 0.0], [0.0, 1.0]]);
        let crop = "-5..-2,0..3".parse::<WorldBox>().unwrap();
        assert_eq!(crop.samples(&frame.unwrap()), Ok(([2, 0], [6, 4])));
    }

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
