//! The flux through a facet from the pressures on its two sides.
//!
//! With n out of the first cell, the jump `[p] = p₁ − p₂` and the weighted mean `g = {k ∂p/∂n}`, the flux is
//! `F = b [p] − a g`, and the equations hold the terms
//!
//! ```text
//! F(p) [v] ∓ a ([p] + ε g(p)) g(v)        − symmetric, + Oden, Babuška & Baumann
//! ```
//!
//! in which ε is the resistance of a barrier, across which `[p] = −ε g`; 0 without one. Both forms are consistent
//! if `a + b ε = 1`. With s = 1/σ, σ the penalty:
//!
//! - symmetric: `a = s/(ε + s)`, `b = 1/(ε + s)` (Juntunen & Stenberg 2009): the interior penalty at ε = 0
//!   (`a = 1`, `b = σ`), no flow at ε = ∞, and as stable for any ε between;
//! - Oden, Babuška & Baumann: `b = ε/(ε + s)²`, `a = 1 − bε`: their form at ε = 0 (`a = 1`, `b = 0`), no flow at
//!   ε = ∞. The terms with a cancel in the energy, except `a ε g²`, and b is never below 0.
//!
//! The mean is weighted by the permeability of the other side, so that the penalty grows with the harmonic mean of the
//! two (Ern, Stephansen & Zunino 2009). σ keeps the energy positive. It follows from the sharp trace inequality for
//! polynomials w of degree p − 1, such as a slope (Warburton & Hesthaven 2003),
//! `‖w‖²_F ≤ p (p + D − 1)/D · |F|/|K| ‖w‖²_K`, summed over the D + 1 facets of a cell.

use atomesh::geometry::{Point, difference, dot};

use super::element::{Affine, Element};
use super::options::{DgOptions, Form};
use crate::grid::FlowGrid;
use crate::permeability::Tensor;
use crate::problem::Condition;
use crate::setting::Setting;

/// One cell beside a facet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side<const D: usize> {
    /// The cell.
    pub cell: u32,
    /// Its functions at the facet's nodes.
    pub trace: u32,
    /// The direction, in the cell's ξ, along which the slope of p is the side's part of g.
    pub direction: Point<D>,
    /// +1 for the first side, −1 for the second: p's part of the jump.
    pub sign: f64,
}

/// A facet through which pressures drive a flux.
#[derive(Clone, Debug)]
pub(super) struct Interface<const D: usize> {
    /// The facet's area, or length.
    pub measure: f64,
    /// a.
    pub slope_weight: f64,
    /// b.
    pub jump_weight: f64,
    /// ε.
    pub resistance: f64,
    /// −1 in the symmetric form, +1 in Oden, Babuška & Baumann's.
    pub sign: f64,
    first: Side<D>,
    second: Option<Side<D>>,
}

impl<const D: usize> Interface<D> {
    /// The cells beside it: one on the boundary.
    #[inline]
    pub fn sides(&self) -> impl Iterator<Item = &Side<D>> {
        std::iter::once(&self.first).chain(&self.second)
    }

    /// The side of a cell.
    #[inline]
    pub fn side_of(&self, cell: u32) -> &Side<D> {
        self.second.as_ref().filter(|side| side.cell == cell).unwrap_or(&self.first)
    }
}

/// One side of a facet before its weight is known.
struct Flank<const D: usize> {
    cell: u32,
    trace: u32,
    /// k n in ξ.
    direction: Point<D>,
    /// n·k n.
    permeability: f64,
    /// The centroid's distance from the facet.
    distance: f64,
    /// The penalty for a weight of 1.
    penalty: f64,
}

/// What interfaces are made from.
pub(super) struct InterfaceMaker<'a, const D: usize> {
    pub grid: &'a FlowGrid<D>,
    pub setting: &'a Setting<'a, D>,
    /// The map of each cell.
    pub cells: &'a [Affine<D>],
    pub options: &'a DgOptions,
}

impl<const D: usize> InterfaceMaker<'_, D> {
    /// The interface of a facet; `None` where pressures drive no flux: sealed facets, and those of the boundary without a
    /// given pressure.
    pub fn interface(&self, facet: usize) -> Option<Interface<D>> {
        if !self.is_open(facet) {
            return None;
        }
        let own = &self.grid.facets()[facet];
        let first = self.flank(facet, own.cell);
        let second = own.neighbour.map(|cell| self.flank(facet, cell));
        let other = second.as_ref().map_or(0.0, |side| side.permeability);
        let sum = first.permeability + other;
        // the first side's weight: 1 on the boundary
        let weight = if second.is_some() { other / sum } else { 1.0 };
        let penalty = |flank: &Flank<D>, weight: f64| weight * weight * flank.penalty;
        let mut sigma = penalty(&first, weight);
        let mut resistance = first.distance / first.permeability;
        if let Some(second) = &second {
            sigma += penalty(second, 1.0 - weight);
            resistance += second.distance / second.permeability;
        }
        resistance *= 1.0 / self.setting.multipliers()[facet] - 1.0;
        let form = self.options.form;
        let (slope_weight, jump_weight) = weights(form, 1.0 / sigma, resistance);
        Some(Interface {
            measure: own.measure(),
            slope_weight,
            jump_weight,
            resistance,
            sign: if form == Form::InteriorPenalty { -1.0 } else { 1.0 },
            first: first.side(weight, 1.0),
            second: second.map(|second| second.side(1.0 - weight, -1.0)),
        })
    }

    fn is_open(&self, facet: usize) -> bool {
        match self.grid.facets()[facet].neighbour {
            Some(_) => self.setting.multipliers()[facet] > 0.0,
            None => matches!(self.setting.condition(facet), Some(Condition::Pressure(_))),
        }
    }

    fn flank(&self, facet: usize, cell: u32) -> Flank<D> {
        let Self { grid, setting, cells, options } = self;
        let affine = &cells[cell as usize];
        let measure = grid.facets()[facet].measure();
        let normal = grid.facets()[facet].area.map(|x| x / measure);
        let flow = product(&setting.permeability().tensor(cell as usize), &normal);
        let permeability = dot(&normal, &flow);
        let away = difference(&grid.facets()[facet].centroid, &affine.centroid);
        let (order, dimension) = (options.order as f64, D as f64);
        let trace_bound = order * (order + dimension - 1.0) / dimension * measure
            / grid.measures()[cell as usize];
        Flank {
            cell,
            trace: trace_of(grid, facet, cell),
            direction: affine.gradients.map(|gradient| dot(&gradient, &flow)),
            permeability,
            distance: dot(&away, &normal).abs(),
            penalty: options.penalty * (dimension + 1.0) * trace_bound * permeability,
        }
    }
}

impl<const D: usize> Flank<D> {
    /// The side of a weight and a sign.
    fn side(&self, weight: f64, sign: f64) -> Side<D> {
        let direction = self.direction.map(|x| weight * x);
        Side { cell: self.cell, trace: self.trace, direction, sign }
    }
}

/// a and b.
fn weights(form: Form, s: f64, resistance: f64) -> (f64, f64) {
    let sum = resistance + s;
    match form {
        Form::InteriorPenalty => (s / sum, 1.0 / sum),
        // a = 1 − ε²/(ε + s)², without cancellation
        Form::OdenBabuskaBaumann => {
            (s * (2.0 * resistance + s) / (sum * sum), resistance / (sum * sum))
        }
    }
}

/// The number of a cell's trace on a facet.
pub(super) fn trace_of<const D: usize>(grid: &FlowGrid<D>, facet: usize, cell: u32) -> u32 {
    let mesh = grid.mesh().expect("checked before");
    let own = &mesh.corners()[cell as usize * (D + 1)..(cell as usize + 1) * (D + 1)];
    let facet = grid.facet_corners(facet).expect("facets of a mesh have corners");
    let place = |corner| own.iter().position(|c| *c == corner).expect("the cell has the facet");
    Element::<D>::trace_number(&facet.map(place)) as u32
}

/// The product of a tensor and a vector.
pub(super) fn product<const D: usize>(tensor: &Tensor<D>, vector: &Point<D>) -> Point<D> {
    tensor.map(|row| dot(&row, vector))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_consistent_at_any_resistance() {
        for form in [Form::InteriorPenalty, Form::OdenBabuskaBaumann] {
            for resistance in [0.0, 1e-9, 0.5, 1.0, 1e9] {
                let (a, b) = weights(form, 0.3, resistance);
                assert!((a + b * resistance - 1.0).abs() < 1e-14, "{form:?} {resistance}");
                assert!(b >= 0.0);
            }
        }
        assert_eq!(weights(Form::OdenBabuskaBaumann, 0.3, 0.0), (1.0, 0.0));
        assert_eq!(weights(Form::InteriorPenalty, 0.25, 0.0), (1.0, 4.0));
    }
}
