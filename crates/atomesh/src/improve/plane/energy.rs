//! What cells and guides cost.

use crate::geometry::{Point, difference, distance_squared, dot};

use super::guides::Guide;

/// What a cell costs for each unit of sine below the floor, over the floor: more than any q and guide gain.
const BELOW_FLOOR: f64 = 10.0;
/// The same, for being below at all.
const JUST_BELOW: f64 = 0.5;
/// The q of a cell that costs nothing. It is about the mean of aligned meshes, so that neither more cells nor
/// fewer are cheaper for their number.
const COMMON_QUALITY: f64 = 0.9;
/// The share of a guide's pull that is felt from afar.
const FAR_SHARE: f64 = 0.1;

/// A fall from 1 to 0 as a squared distance or sine grows.
struct Fall {
    to: f64,
    slope: f64,
}

impl Fall {
    const fn between(from: f64, to: f64) -> Self {
        Self { to: to * to, slope: 1.0 / (to * to - from * from) }
    }

    #[inline]
    fn at(&self, squared: f64) -> f64 {
        ((self.to - squared) * self.slope).clamp(0.0, 1.0)
    }
}

/// The pull of an edge falls from 0.7 τ to 1.6 τ: within τ counts, and some room is left.
const NEAR: Fall = Fall::between(0.7, 1.6);
/// From afar, from 0 to 3 τ.
const FAR: Fall = Fall::between(0.0, 3.0);
/// It falls as the edge leans, from 14° to 30° (sines): within 20° counts.
const ALONG: Fall = Fall::between(0.241_921_896, 0.5);
/// From afar, from 0° to 50°.
const ASTRIDE: Fall = Fall::between(0.0, 0.766_044_443);

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
        let across = dot(&self.along, &guide.normal);
        let sine = across * across * self.inverse_length_squared;
        if sine >= ASTRIDE.to {
            return 0.0;
        }
        let w = difference(&guide.position, &self.from);
        let t = (dot(&w, &self.along) * self.inverse_length_squared).clamp(0.0, 1.0);
        let foot = [w[0] - t * self.along[0], w[1] - t * self.along[1]];
        let distance = dot(&foot, &foot) * guide.inverse_reach_squared;
        if distance >= FAR.to {
            return 0.0;
        }
        (1.0 - FAR_SHARE) * NEAR.at(distance) * ALONG.at(sine)
            + FAR_SHARE * FAR.at(distance) * ASTRIDE.at(sine)
    }
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

    /// What a cell costs, and the sine of its least angle.
    pub fn of_cell(&self, corners: [Point<2>; 3], guides: &[u32]) -> (f64, f64) {
        let [a, b, c] = corners;
        let lengths = [(a, b), (b, c), (c, a)].map(|(p, q)| distance_squared(&p, &q).sqrt());
        let shape = Shape::new(doubled_area(a, b, c), lengths);
        let mut cost = self.of_shape(shape);
        if !guides.is_empty() && shape.sine > 0.0 {
            let edges = [Edge::new(a, b), Edge::new(b, c), Edge::new(c, a)];
            let edges = [&edges[0], &edges[1], &edges[2]];
            cost += guides.iter().map(|&guide| self.of_guide(guide, edges)).sum::<f64>();
        }
        (cost, shape.sine)
    }

    /// Whether cells whose least sine was `old` may have `new` instead: the floor is kept where it was, what
    /// is below it does not sink, and no cell gets so flat that rounding could hide an inversion.
    #[inline]
    pub fn allows(&self, old: f64, new: f64) -> bool {
        new >= old.min(self.sine_floor) && new > 1e-7
    }
}
