//! Wells, sides and barriers as the command line spells them.

use std::fmt;
use std::str::FromStr;

use atomesh::mesh::is_feature_name;
use atomesh_flow::{Barrier, Boundary, Condition, Control, Value, Well};

use crate::failure::Failure;
use crate::values::Numbers;

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
    /// Its place, of `D` coordinates.
    ///
    /// # Errors
    /// [`Failure`] if it has another number of them.
    pub fn place<const D: usize>(&self, option: &str) -> Result<[f64; D], Failure> {
        let count = self.place.len();
        <[f64; D]>::try_from(self.place.clone()).map_err(|_| {
            Failure::misuse(format!("--{option} has {count} coordinates; expected {D}"))
        })
    }

    /// The coordinates.
    pub fn coordinates(&self) -> &[f64] {
        &self.place
    }
}

impl fmt::Display for WellSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Numbers(self.place.clone()).fmt(f)
    }
}

/// All wells with the options that name them, sources first.
pub fn options<'w>(
    sources: &'w [WellSpec],
    sinks: &'w [WellSpec],
) -> impl Iterator<Item = (&'static str, &'w WellSpec)> {
    let of = |option, wells: &'w [WellSpec]| wells.iter().map(move |well| (option, well));
    of("source", sources).chain(of("sink", sinks))
}

/// The wells, sources first, and the numbers of those whose rates are to balance the others'.
///
/// # Errors
/// [`Failure`] if a place has another number of coordinates than `D`.
pub fn wells<const D: usize>(
    sources: &[WellSpec],
    sinks: &[WellSpec],
) -> Result<(Vec<Well<D>>, Vec<usize>), Failure> {
    let (mut wells, mut open) = (Vec::new(), Vec::new());
    for (kind, specs, sign) in [("source", sources, 1.0), ("sink", sinks, -1.0)] {
        for (number, spec) in specs.iter().enumerate() {
            let control = match spec.control {
                Some(Control::Rate(rate)) => Control::Rate(sign * rate),
                Some(pressure) => pressure,
                None => {
                    if kind == "sink" {
                        open.push(wells.len());
                    }
                    Control::Rate(1.0)
                }
            };
            wells.push(Well {
                name: format!("{kind} {}", number + 1),
                place: spec.place(kind)?,
                control,
                radius: spec.radius,
            });
        }
    }
    Ok((wells, open))
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
    pub fn barrier(&self) -> Barrier {
        self.0.clone()
    }
}

/// The barriers: features have `multiplier`, unless one is named with its own.
pub fn barriers<'n>(
    names: impl Iterator<Item = &'n str>,
    multiplier: f64,
    own: &[BarrierSpec],
) -> Vec<Barrier> {
    let of_features = names.filter(|name| is_feature_name(name)).map(|name| {
        let group = name.to_string();
        Barrier { group, multiplier }
    });
    let mut barriers: Vec<Barrier> = of_features.collect();
    for BarrierSpec(barrier) in own {
        barriers.retain(|other| other.group != barrier.group);
        barriers.push(barrier.clone());
    }
    barriers
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
    fn sinks_without_a_rate_are_left_to_balance() {
        let specs = |texts: &[&str]| texts.iter().map(|t| t.parse().unwrap()).collect::<Vec<_>>();
        let sources: Vec<WellSpec> = specs(&["1,1", "2,2:rate=3"]);
        let sinks: Vec<WellSpec> = specs(&["3,3", "4,4:rate=0.5"]);
        let (wells, open) = wells::<2>(&sources, &sinks).unwrap();
        assert_eq!(open, [2]);
        let rates: Vec<Control> = wells.iter().map(|w| w.control).collect();
        let rate = Control::Rate;
        assert_eq!(rates, [rate(1.0), rate(3.0), rate(1.0), rate(-0.5)]);
        assert!(super::wells::<3>(&sources, &sinks).is_err(), "three axes");
    }

    #[test]
    fn a_barrier_of_its_own_takes_the_place_of_the_features() {
        let names = ["xmin", "feature-1", "feature-2", "feature-x"];
        let own = ["feature-2=0.25".parse().unwrap(), "wall=1".parse().unwrap()];
        let found = barriers(names.into_iter(), 0.0, &own);
        let found: Vec<(&str, f64)> =
            found.iter().map(|b| (b.group.as_str(), b.multiplier)).collect();
        assert_eq!(found, [("feature-1", 0.0), ("feature-2", 0.25), ("wall", 1.0)]);
        assert!("wall=2".parse::<BarrierSpec>().is_err());
        assert!("xmin=1".parse::<SideSpec>().is_err());
        assert!("xmin=flux:-1".parse::<SideSpec>().is_ok());
    }
}
