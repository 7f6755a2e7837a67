//! The nominal distance wanted.

use std::str::FromStr;

use atomesh::run::Size;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::ValueError;

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
}
