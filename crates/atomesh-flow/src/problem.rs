//! What flows where, by names and places.

use atomesh::geometry::Point;

use crate::permeability::Permeability;

/// A value everywhere: a number, or a function of the place.
#[derive(Clone, Copy)]
pub enum Value<'a, const D: usize> {
    /// The same everywhere.
    Constant(f64),
    /// A function of the place, in the mesh's coordinates.
    Field(&'a (dyn Fn(&Point<D>) -> f64 + Sync)),
}

impl<const D: usize> Value<'_, D> {
    /// The value at a place.
    pub fn at(&self, place: &Point<D>) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Field(field) => field(place),
        }
    }
}

impl<const D: usize> std::fmt::Debug for Value<'_, D> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Constant(value) => write!(f, "Constant({value})"),
            Self::Field(_) => write!(f, "Field(..)"),
        }
    }
}

/// What holds on a part of the boundary. Nothing flows through the rest.
#[derive(Clone, Copy, Debug)]
pub enum Condition<'a, const D: usize> {
    /// The pressure.
    Pressure(Value<'a, D>),
    /// The flow into the domain through a unit of length (plane) or area (space): `k ∂p/∂n`, n outward.
    Flux(Value<'a, D>),
}

/// A condition on the facets of a group.
#[derive(Clone, Debug)]
pub struct Boundary<'a, const D: usize> {
    /// The group's name, such as `xmin`.
    pub group: String,
    /// What holds there.
    pub condition: Condition<'a, D>,
}

/// A group of facets that hinder flow.
#[derive(Clone, Debug, PartialEq)]
pub struct Barrier {
    /// The group's name, such as `feature-1`.
    pub group: String,
    /// The transmissibility multiplier m, 0…1: the share of the flow that passes, for the same mean pressures in the two
    /// cells beside the facet. 0 seals, 1 does nothing. It multiplies two-point transmissibilities; in other schemes
    /// it is the resistance `(1/m − 1)·(δ₁/k₁ + δ₂/k₂)`, δ the distances of the cells' centres from the facet.
    pub multiplier: f64,
}

/// How a well is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Control {
    /// By its rate: the flow into the domain per unit of time; below 0 out of it.
    Rate(f64),
    /// By the pressure at its wall; the well needs a radius.
    Pressure(f64),
}

/// A well: in the plane a line normal to it, in space a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Well<const D: usize> {
    /// Its name in reports.
    pub name: String,
    /// Where it is, inside the mesh.
    pub place: Point<D>,
    /// How it is run.
    pub control: Control,
    /// Its radius, above 0 and less than the equivalent radius of the cells around it.
    pub radius: Option<f64>,
}

/// Steady flow `−∇·(k∇p) = q` with wells, conditions on the boundary, and barriers.
#[derive(Clone, Debug)]
pub struct Problem<'a, const D: usize> {
    /// The permeability k.
    pub permeability: Permeability<D>,
    /// q: the flow into the domain per unit of area (plane) or volume (space), without wells.
    pub source: Option<Value<'a, D>>,
    /// The wells.
    pub wells: Vec<Well<D>>,
    /// Conditions on the boundary; a facet that two groups hold obeys the one named last.
    pub boundaries: Vec<Boundary<'a, D>>,
    /// Barriers; a facet that two groups hold obeys the one named last.
    pub barriers: Vec<Barrier>,
}

impl<const D: usize> Default for Problem<'_, D> {
    /// Permeability 1, and no flow.
    fn default() -> Self {
        Self {
            permeability: Permeability::Uniform(1.0),
            source: None,
            wells: Vec::new(),
            boundaries: Vec::new(),
            barriers: Vec::new(),
        }
    }
}

impl<const D: usize> Problem<'_, D> {
    /// Gives the wells numbered `open` equal rates such that the rates of all wells sum to 0.
    ///
    /// # Panics
    /// If there is no such well.
    pub fn balance_wells(&mut self, open: &[usize]) {
        let rate = |(number, well): (usize, &Well<D>)| match well.control {
            Control::Rate(rate) if !open.contains(&number) => rate,
            _ => 0.0,
        };
        let others: f64 = self.wells.iter().enumerate().map(rate).sum();
        for &number in open {
            self.wells[number].control = Control::Rate(-others / open.len() as f64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn open_wells_share_what_the_others_leave() {
        let well =
            |control: Control| Well { name: String::new(), place: [0.0; 2], control, radius: None };
        let rates =
            [Control::Rate(3.0), Control::Rate(9.0), Control::Pressure(5.0), Control::Rate(-1.0)];
        let wells = rates.into_iter().map(well).chain([well(Control::Rate(0.0))]).collect();
        let mut problem = Problem { wells, ..Problem::default() };
        problem.balance_wells(&[1, 4]);
        let controls: Vec<Control> = problem.wells.iter().map(|w| w.control).collect();
        assert_eq!(controls[1], Control::Rate(-1.0));
        assert_eq!(controls[4], Control::Rate(-1.0));
        assert_eq!(controls[2], Control::Pressure(5.0));
    }
}
