//! From options to a problem on a grid.

use atomesh::mesh::is_feature_name;
use atomesh_flow::{Barrier, Control, FlowGrid, Permeability, Problem, Well};

use super::options::FlowOptions;
use crate::error::JobError;
use crate::values::{BarrierSpec, SideSpec, WellSpec};

/// The problem that options pose on a grid.
///
/// # Errors
/// [`JobError`] if a well has another number of coordinates than `D`, or nothing flows.
pub(super) fn problem<const D: usize>(
    options: &FlowOptions,
    grid: &FlowGrid<D>,
    permeability: Permeability<D>,
) -> Result<Problem<'static, D>, JobError> {
    let (wells, open) = wells(&options.source, &options.sink)?;
    let names = grid.sets().iter().map(|set| set.name.as_str());
    let mut problem = Problem {
        permeability,
        source: None,
        wells,
        boundaries: options.side.iter().map(SideSpec::boundary).collect(),
        barriers: barriers(names, options.multiplier, &options.barrier),
    };
    problem.balance_wells(&open);
    if problem.wells.is_empty() && problem.boundaries.is_empty() {
        let message = "nothing flows; expected --source and --sink, or --side";
        return Err(JobError::misuse(message));
    }
    Ok(problem)
}

/// The place of a well, of `D` coordinates.
///
/// # Errors
/// [`JobError`] if it has another number of them.
pub(super) fn place<const D: usize>(option: &str, well: &WellSpec) -> Result<[f64; D], JobError> {
    let count = well.coordinates().len();
    well.coordinates()
        .try_into()
        .map_err(|_| JobError::misuse(format!("--{option} has {count} coordinates; expected {D}")))
}

/// The wells, sources first, and the numbers of those whose rates are to balance the others'.
fn wells<const D: usize>(
    sources: &[WellSpec],
    sinks: &[WellSpec],
) -> Result<(Vec<Well<D>>, Vec<usize>), JobError> {
    let (mut wells, mut open) = (Vec::new(), Vec::new());
    for (kind, specs, sign) in [("source", sources, 1.0), ("sink", sinks, -1.0)] {
        for (number, spec) in specs.iter().enumerate() {
            let control = match spec.control() {
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
                place: place(kind, spec)?,
                control,
                radius: spec.radius(),
            });
        }
    }
    Ok((wells, open))
}

/// The barriers: features have `multiplier`, unless one is named with its own.
fn barriers<'n>(
    names: impl Iterator<Item = &'n str>,
    multiplier: f64,
    own: &[BarrierSpec],
) -> Vec<Barrier> {
    let of_features = names.filter(|name| is_feature_name(name)).map(|name| {
        let group = name.to_string();
        Barrier { group, multiplier }
    });
    let mut barriers: Vec<Barrier> = of_features.collect();
    for barrier in own.iter().map(BarrierSpec::barrier) {
        barriers.retain(|other| other.group != barrier.group);
        barriers.push(barrier.clone());
    }
    barriers
}

#[cfg(test)]
mod tests {
    use super::*;

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
    }
}
