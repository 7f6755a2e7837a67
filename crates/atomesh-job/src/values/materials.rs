//! Elastic materials of regions.

use std::fmt;
use std::str::FromStr;

use super::ValueError;

/// The elastic material of a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialSpec {
    /// The region's number.
    pub region: i32,
    /// Young's modulus, above 0.
    pub youngs_modulus: f64,
    /// Poisson's ratio, above -1 and below 0.5.
    pub poissons_ratio: f64,
}

impl FromStr for MaterialSpec {
    type Err = ValueError;

    fn from_str(text: &str) -> Result<Self, ValueError> {
        let parse = || {
            let (region, constants) = text.split_once('=')?;
            let (modulus, ratio) = constants.split_once(',')?;
            let number = |text: &str| text.trim().parse().ok().filter(|x: &f64| x.is_finite());
            Some(Self {
                region: region.trim().parse().ok()?,
                youngs_modulus: number(modulus).filter(|x| *x > 0.0)?,
                poissons_ratio: number(ratio).filter(|x| *x > -1.0 && *x < 0.5)?,
            })
        };
        let expected = "a region, E above 0 and NU above -1 and below 0.5, as in 2=210e3,0.3";
        parse().ok_or_else(|| ValueError { found: text.into(), expected })
    }
}

impl fmt::Display for MaterialSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { region, youngs_modulus, poissons_ratio } = self;
        write!(f, "{region}={youngs_modulus},{poissons_ratio}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_survive_a_round_trip_and_others_are_refused() {
        for text in ["1=210000,0.3", "-2=0.5,-0.25", "0=1,0"] {
            assert_eq!(text.parse::<MaterialSpec>().unwrap().to_string(), text);
        }
        for bad in [
            "", "1", "1=2", "1=,0.3", "a=1,0.3", "1=0,0.3", "1=-5,0.3", "1=1,0.5", "1=1,-1",
            "1=inf,0",
        ] {
            assert!(bad.parse::<MaterialSpec>().is_err(), "{bad}");
        }
    }
}
