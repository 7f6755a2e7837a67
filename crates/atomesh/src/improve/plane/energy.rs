//! What cells and guides cost.

use crate::geometry::{Point, difference, distance_squared, dot};

use super::guides::Guide;

/// What a cell below the floor costs for each unit of sine, over the floor's: more than any q and guide gain.
const BELOW_FLOOR: f64 = 10.0;
/// What a cell costs in addition for being below the floor at all.
const JUST_BELOW: f64 = 0.5;
/// The q of a cell that costs nothing. It is about the mean of aligned meshes, so that neither more cells nor
/// fewer are cheaper for their number.
const COMMON_QUALITY: f64 = 0.9;
/// The share of a guide's pull on edges far from it.
const FAR_SHARE: f64 = 0.1;

/// The sine of the least angle of the flattest cell that may be made.
const FLATTEST: f64 = 1e-7;

/// A fall from 1 to 0 as a squared distance or sine grows.
struct Ramp {
    to: f64,
    slope: f64,
}

impl Ramp {
    const fn between(from: f64, to: f64) -> Self {
        Self { to: to * to, slope: 1.0 / (to * to - from * from) }
    }

    #[inline]
    fn at(&self, squared: f64) -> f64 {
        ((self.to - squared) * self.slope).clamp(0.0, 1.0)
    }
}

/// How well an edge follows a guide falls with the distance, from 0.7 τ to 1.6 τ: the alignment measure counts up
/// to τ.
const NEAR: Ramp = Ramp::between(0.7, 1.6);
/// The same for the far share: from 0 to 3 τ.
const FAR: Ramp = Ramp::between(0.0, 3.0);
/// It falls with the angle, from 14° to 30° (sines): the alignment measure counts up to 20°.
const ALONG: Ramp = Ramp::between(0.241_921_896, 0.5);
/// The same for the far share: from 0° to 50°.
const ALONG_FAR: Ramp = Ramp::between(0.0, 0.766_044_443);

/// The sine of a triangle's least angle; 0 or less if it is flat or inverted.
pub(super) fn least_sine(a: Point<2>, b: Point<2>, c: Point<2>) -> f64 {
    let lengths = [(a, b), (b, c), (c, a)].map(|(p, q)| distance_squared(&p, &q).sqrt());
    Shape::new(doubled_area(a, b, c), lengths).sine
}

/// Twice the signed area.
#[inline]
pub(super) fn doubled_area(a: Point<2>, b: Point<2>, c: Point<2>) -> f64 {
    cross(difference(&b, &a), difference(&c, &a))
}

#[inline]
pub(super) fn cross(a: Point<2>, b: Point<2>) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The shape of a triangle.
#[derive(Clone, Copy)]
pub(super) struct Shape {
    /// Twice the inradius over the circumradius: 1 if it is equilateral.
    pub q: f64,
    /// The sine of the least angle.
    pub sine: f64,
}

impl Shape {
    #[inline]
    pub fn new(doubled_area: f64, lengths: [f64; 3]) -> Self {
        let [a, b, c] = lengths;
        if doubled_area <= 0.0 {
            return Self { q: 0.0, sine: -1.0 };
        }
        let inverse = 1.0 / (a * b * c);
        let q = 4.0 * doubled_area * doubled_area * inverse / (a + b + c);
        Self { q, sine: doubled_area * a.min(b).min(c) * inverse }
    }
}

/// An edge, ready to be compared with guides.
#[derive(Clone, Copy)]
pub(super) struct Edge {
    from: Point<2>,
    along: Point<2>,
    inverse_length_squared: f64,
}

impl Edge {
    #[inline]
    pub fn new(from: Point<2>, to: Point<2>) -> Self {
        let along = difference(&to, &from);
        Self { from, along, inverse_length_squared: 1.0 / dot(&along, &along) }
    }

    /// How well the edge follows a guide, 0 to 1.
    #[inline]
    pub fn follows(&self, guide: &Guide) -> f64 {
        let across = dot(&self.along, &guide.at.normal);
        let sine = across * across * self.inverse_length_squared;
        if sine >= ALONG_FAR.to {
            return 0.0;
        }
        let w = difference(&guide.at.position, &self.from);
        let t = (dot(&w, &self.along) * self.inverse_length_squared).clamp(0.0, 1.0);
        let foot = [w[0] - t * self.along[0], w[1] - t * self.along[1]];
        let distance = dot(&foot, &foot) * guide.inverse_reach_squared;
        if distance >= FAR.to {
            return 0.0;
        }
        (1.0 - FAR_SHARE) * NEAR.at(distance) * ALONG.at(sine)
            + FAR_SHARE * FAR.at(distance) * ALONG_FAR.at(sine)
    }
}

/// What a cell costs.
#[derive(Clone, Copy)]
pub(super) struct CellCost {
    pub cost: f64,
    /// The sine of its least angle.
    pub sine: f64,
}

/// What decides the energy of cells.
pub(super) struct Energy<'a> {
    /// All guides.
    pub guides: &'a [Guide],
    /// The sine of the least angle that cells should keep.
    pub sine_floor: f64,
    /// The weight of shape against guides.
    pub shape_weight: f64,
}

impl<'a> Energy<'a> {
    pub fn new(guides: &'a [Guide], sine_floor: f64) -> Self {
        Self { guides, sine_floor, shape_weight: 1.0 }
    }

    /// What a shape costs.
    #[inline]
    pub fn of_shape(&self, shape: Shape) -> f64 {
        let mut cost = self.shape_weight * (COMMON_QUALITY - shape.q);
        if shape.sine < self.sine_floor {
            cost += JUST_BELOW + BELOW_FLOOR * (1.0 - shape.sine / self.sine_floor);
        }
        cost
    }

    /// What a guide costs in a cell with these edges.
    #[inline]
    pub fn of_guide(&self, guide: u32, edges: [&Edge; 3]) -> f64 {
        let guide = &self.guides[guide as usize];
        let best = edges.iter().fold(0.0_f64, |best, edge| best.max(edge.follows(guide)));
        guide.pull * (1.0 - best)
    }

    /// What a cell costs.
    pub fn of_cell(&self, corners: [Point<2>; 3], guides: &[u32]) -> CellCost {
        let [a, b, c] = corners;
        let lengths = [(a, b), (b, c), (c, a)].map(|(p, q)| distance_squared(&p, &q).sqrt());
        let shape = Shape::new(doubled_area(a, b, c), lengths);
        let mut cost = self.of_shape(shape);
        if !guides.is_empty() && shape.sine > 0.0 {
            let edges = [Edge::new(a, b), Edge::new(b, c), Edge::new(c, a)];
            let edges = [&edges[0], &edges[1], &edges[2]];
            cost += guides.iter().map(|&guide| self.of_guide(guide, edges)).sum::<f64>();
        }
        CellCost { cost, sine: shape.sine }
    }

    /// The least sine that cells must keep whose least sine is `old`: the floor if they keep it, else what they have;
    /// and no cell gets so flat that rounding could hide an inversion.
    #[inline]
    pub fn sine_to_keep(&self, old: f64) -> f64 {
        old.min(self.sine_floor).max(FLATTEST)
    }

    /// Whether cells whose least sine was `old` may have `new` instead: the floor is kept where it was kept, cells
    /// below it do not sink, and no cell gets so flat that rounding could hide an inversion.
    #[inline]
    pub fn allows(&self, old: f64, new: f64) -> bool {
        new >= old.min(self.sine_floor) && new > FLATTEST
    }
}
