//! Moving one point so that the least dihedral angle around it grows (Freitag & Ollivier-Gooch 1997).
//!
//! The worst cosine around a point is the greatest of smooth functions, one a cell. Those that are nearly as great are
//! active. The negative of the shortest vector in the hull of their gradients lowers them all. A step along it is
//! shortened until the greatest cosine falls.

use super::shape::{INVERTED, shape};
use super::tetrahedra::Tetrahedra;
use crate::geometry::{Point, difference, dot};

/// Cosines within this of the greatest are active: 10° against 12°, or 20° against 22°.
const ACTIVE: f64 = 0.01;
/// The most active cells that count.
const MOST_ACTIVE: usize = 6;
/// The most directions, and the most times that a step is shortened.
const DIRECTIONS: usize = 4;
const SHORTENINGS: usize = 5;
/// How much the greatest cosine must fall for a step to count.
const GAIN: f64 = 1e-4;

/// Moves a point to lower the greatest cosine of its cells, until it is below `cosine_limit` or nothing helps. Says
/// whether it has moved.
pub(super) fn smooth(tetrahedra: &mut Tetrahedra, point: u32, cosine_limit: f64) -> bool {
    let freedom = tetrahedra.freedom[point as usize];
    if freedom == 0 {
        return false;
    }
    let mut star = Vec::with_capacity(40);
    tetrahedra.star(point, &mut star);
    let opposite: Vec<[Point<3>; 3]> =
        star.iter().map(|&cell| opposite_facet(tetrahedra, cell, point)).collect();
    let start = tetrahedra.points[point as usize];
    let mut at = start;
    let mut worst = worst_cosine(&opposite, &at, f64::INFINITY);
    for _ in 0..DIRECTIONS {
        if worst <= cosine_limit {
            break;
        }
        let Some((direction, reach)) = descent(&opposite, &at, worst, freedom) else { break };
        let mut step = 0.5 * reach;
        let mut moved = false;
        for _ in 0..SHORTENINGS {
            let to = std::array::from_fn(|k| at[k] + step * direction[k]);
            let then = worst_cosine(&opposite, &to, worst - GAIN);
            if then < worst - GAIN {
                (at, worst, moved) = (to, then, true);
                break;
            }
            step *= 0.4;
        }
        if !moved {
            break;
        }
    }
    if at == start {
        return false;
    }
    tetrahedra.move_point(point, at, &star);
    true
}

/// The facet of a cell opposite a point, in the order that makes (facet, point) positive.
pub(super) fn opposite_facet(tetrahedra: &Tetrahedra, cell: u32, point: u32) -> [Point<3>; 3] {
    let k = tetrahedra.place(cell, point);
    let [p, q, r] = [1, 2, 3].map(|n| {
        let corner = tetrahedra.corners[cell as usize][(k + n) & 3];
        tetrahedra.points[corner as usize]
    });
    // three exchanges take the point to the end; they and an odd place make it an even number
    if k.is_multiple_of(2) { [q, p, r] } else { [p, q, r] }
}

/// The greatest cosine of the cells between a place and the facets, or some cosine of `enough` or more.
#[inline]
pub(super) fn worst_cosine(opposite: &[[Point<3>; 3]], at: &Point<3>, enough: f64) -> f64 {
    let mut worst = -1.0_f64;
    for [p, q, r] in opposite {
        worst = worst.max(shape(p, q, r, at).cosine);
        if worst >= enough {
            break;
        }
    }
    worst
}

/// A unit vector along which all active cosines fall, and how far the nearest facet is from the point.
fn descent(
    opposite: &[[Point<3>; 3]],
    at: &Point<3>,
    worst: f64,
    freedom: u8,
) -> Option<(Point<3>, f64)> {
    let mut reach = f64::INFINITY;
    let mut gradients: [Point<3>; MOST_ACTIVE] = [[0.0; 3]; MOST_ACTIVE];
    let mut count = 0;
    for [p, q, r] in opposite {
        let now = shape(p, q, r, at).cosine;
        let edge = difference(p, at);
        let length = dot(&edge, &edge).sqrt();
        reach = reach.min(length);
        if now < worst - ACTIVE || count == MOST_ACTIVE {
            continue;
        }
        let h = 1e-5 * length;
        for k in (0..3).filter(|k| freedom >> k & 1 == 1) {
            let mut to = *at;
            to[k] += h;
            let mut then = shape(p, q, r, &to).cosine;
            let mut run = h;
            if then == INVERTED {
                to[k] -= 2.0 * h;
                (then, run) = (shape(p, q, r, &to).cosine, -h);
            }
            gradients[count][k] = if then == INVERTED { 0.0 } else { (then - now) / run };
        }
        count += 1;
    }
    let x = shortest(&gradients[..count])?;
    let length = dot(&x, &x).sqrt();
    let direction = x.map(|x| -x / length);
    direction.iter().all(|x| x.is_finite()).then_some((direction, reach))
}

/// The shortest vector in the hull of some vectors, nearly (Frank & Wolfe 1956); `None` if it is about 0.
fn shortest(vectors: &[Point<3>]) -> Option<Point<3>> {
    let mut x = *vectors.first()?;
    for _ in 0..12 {
        let (mut corner, mut least) = (x, f64::INFINITY);
        for v in vectors {
            let along = dot(&x, v);
            if along < least {
                (corner, least) = (*v, along);
            }
        }
        let step = difference(&corner, &x);
        let length = dot(&step, &step);
        if length == 0.0 {
            break;
        }
        let t = (-dot(&x, &step) / length).clamp(0.0, 1.0);
        x = std::array::from_fn(|k| x[k] + t * step[k]);
    }
    let largest = vectors.iter().map(|v| dot(v, v)).fold(0.0, f64::max);
    (dot(&x, &x) > 1e-6 * largest).then_some(x)
}
