//! Wells, sides and barriers as text.

use std::fmt;
use std::str::FromStr;

use atomesh_flow::{Barrier, Boundary, Condition, Control, Value};

use super::Numbers;

/// A well: `X,Y[,Z][:rate=Q][:pressure=P][:radius=R]`.
#[derive(Clone, Debug, PartialEq)]
pub struct WellSpec {
    place: Vec<f64>,
    control: Option<Control>,
    radius: Option<f64>,
}

const WELL: &str =
    "X,Y[,Z], then any of :rate=Q or :pressure=P, and :radius=R, as in 120,40:rate=2:radius=0.1";

impl FromStr for WellSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let odd = || format!("{text:?}; expected {WELL}");
        let mut parts = text.split(':');
        let place: Numbers = parts.next().unwrap_or("").parse().map_err(|_| odd())?;
        let mut well = Self { place: place.0, control: None, radius: None };
        for part in parts {
            let (key, value) = part.split_once('=').ok_or_else(odd)?;
            let value =
                value.trim().parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(odd)?;
            match key.trim() {
                "rate" if well.control.is_none() && value >= 0.0 => {
                    well.control = Some(Control::Rate(value));
                }
                "pressure" if well.control.is_none() => {
                    well.control = Some(Control::Pressure(value));
                }
                "radius" if well.radius.is_none() && value > 0.0 => well.radius = Some(value),
                _ => return Err(odd()),
            }
        }
        Ok(well)
    }
}

impl WellSpec {
    /// The coordinates.
    pub fn coordinates(&self) -> &[f64] {
        &self.place
    }

    /// The rate or pressure that it is run by, if one is given.
    pub fn control(&self) -> Option<Control> {
        self.control
    }

    /// The radius, if one is given.
    pub fn radius(&self) -> Option<f64> {
        self.radius
    }
}

impl fmt::Display for WellSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Numbers(self.place.clone()).fmt(f)
    }
}

/// A condition on a side: `NAME=pressure:P` or `NAME=flux:F`.
#[derive(Clone, Debug, PartialEq)]
pub struct SideSpec {
    group: String,
    is_flux: bool,
    value: f64,
}

impl FromStr for SideSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = || {
            let (group, rest) = text.split_once('=')?;
            let (kind, value) = rest.split_once(':')?;
            let is_flux = match kind.trim() {
                "pressure" => false,
                "flux" => true,
                _ => return None,
            };
            let value = value.trim().parse().ok().filter(|v: &f64| v.is_finite())?;
            let group = group.trim().to_string();
            (!group.is_empty()).then_some(Self { group, is_flux, value })
        };
        parsed().ok_or_else(|| {
            format!("{text:?}; expected NAME=pressure:P or NAME=flux:F, as in xmin=pressure:1")
        })
    }
}

impl SideSpec {
    /// The condition.
    pub fn boundary<const D: usize>(&self) -> Boundary<'static, D> {
        let value = Value::Constant(self.value);
        let condition =
            if self.is_flux { Condition::Flux(value) } else { Condition::Pressure(value) };
        Boundary { group: self.group.clone(), condition }
    }
}

/// A barrier: `NAME=M`.
#[derive(Clone, Debug, PartialEq)]
pub struct BarrierSpec(Barrier);

impl FromStr for BarrierSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = || {
            let (group, value) = text.rsplit_once('=')?;
            let multiplier = value.trim().parse().ok().filter(|m: &f64| (0.0..=1.0).contains(m))?;
            let group = group.trim().to_string();
            (!group.is_empty()).then_some(Self(Barrier { group, multiplier }))
        };
        parsed().ok_or_else(|| {
            format!("{text:?}; expected NAME=M, M from 0 to 1, as in feature-2=0.01")
        })
    }
}

impl BarrierSpec {
    /// The barrier.
    pub fn barrier(&self) -> &Barrier {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wells_are_places_with_what_they_are_run_by() {
        let well = |text: &str| text.parse::<WellSpec>();
        let full = well("1,-2.5,3:pressure=-4:radius=0.5").unwrap();
        assert_eq!(full.coordinates(), [1.0, -2.5, 3.0]);
        assert_eq!((full.control, full.radius), (Some(Control::Pressure(-4.0)), Some(0.5)));
        for odd in ["", "1,a", "1,2:rate", "1,2:rate=-1", "1,2:rate=1:pressure=2", "1,2:x=1"] {
            assert!(well(odd).unwrap_err().contains("expected X,Y"), "{odd}");
        }
    }

    #[test]
    fn sides_and_barriers_name_groups() {
        assert!("wall=2".parse::<BarrierSpec>().is_err());
        assert!("xmin=1".parse::<SideSpec>().is_err());
        assert!("xmin=flux:-1".parse::<SideSpec>().is_ok());
    }
}
