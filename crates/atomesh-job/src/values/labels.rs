//! Labels of an image, as options name them.

use std::fmt;
use std::str::FromStr;

use super::ValueError;

/// Labels set apart by commas.
#[derive(Clone, Debug, PartialEq)]
pub struct Labels(pub Vec<i32>);

impl FromStr for Labels {
    type Err = ValueError;

    fn from_str(text: &str) -> Result<Self, ValueError> {
        let labels: Result<Vec<i32>, _> = text.split(',').map(|part| part.trim().parse()).collect();
        let expected = "labels, whole numbers set apart by commas, as in 0,3";
        labels.map(Self).map_err(|_| ValueError { found: text.into(), expected })
    }
}

impl fmt::Display for Labels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.iter().map(i32::to_string).collect::<Vec<_>>().join(","))
    }
}

/// The edge length wanted where a label is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelSize {
    /// The label.
    pub label: i32,
    /// The length in lattice units, above 0.
    pub size: f64,
}

impl FromStr for LabelSize {
    type Err = ValueError;

    fn from_str(text: &str) -> Result<Self, ValueError> {
        let parse = || {
            let (label, size) = text.split_once('=')?;
            let size = size.trim().parse().ok().filter(|n: &f64| n.is_finite() && *n > 0.0)?;
            Some(Self { label: label.trim().parse().ok()?, size })
        };
        let expected = "a label and a length above 0, as in 2=1.5";
        parse().ok_or_else(|| ValueError { found: text.into(), expected })
    }
}

impl fmt::Display for LabelSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.label, self.size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_survive_a_round_trip_and_other_texts_are_refused() {
        for text in ["0", "-1,3,7"] {
            assert_eq!(text.parse::<Labels>().unwrap().to_string(), text);
        }
        for text in ["2=1.5", "-3=0.25"] {
            assert_eq!(text.parse::<LabelSize>().unwrap().to_string(), text);
        }
        for bad in ["", "a", "1,", "1.5", "1;2"] {
            assert!(bad.parse::<Labels>().is_err(), "{bad}");
        }
        for bad in ["", "1", "=2", "1=", "1=0", "1=-2", "1=inf", "1=nan", "x=2", "1.5=2"] {
            assert!(bad.parse::<LabelSize>().is_err(), "{bad}");
        }
    }
}
