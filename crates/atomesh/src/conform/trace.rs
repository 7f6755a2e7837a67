//! Curves: pieces of features in the plane; in space the lines in which pieces meet a side of the box or each other.

use crate::crests::{Pieces, tangents};
use crate::geometry::{Bounds, Point, difference, distance_squared, dot};

/// A step along a curve, in mean steps of the image.
const STEP: f64 = 0.5;
/// How far from a piece a curve that is being followed looks for it, in mean steps.
const REACH: f64 = 6.0;
/// How often a place is brought onto a curve.
const ROUNDS: usize = 3;
/// The most steps of a curve.
const MOST_STEPS: usize = 1 << 20;

/// What makes a curve of a piece in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cut {
    /// Nothing: in the plane a piece is a curve.
    None,
    /// The side of the box across this axis at this level.
    Side { axis: usize, level: f64 },
    /// Another piece.
    Piece(u32),
}

/// Where a curve ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// Where the piece ends.
    Free,
    /// On a side of the box.
    Side,
    /// Where it began.
    Closed,
}

/// A curve as a line of places close to each other.
#[derive(Clone, Debug)]
pub(super) struct Curve<const D: usize> {
    pub piece: u32,
    pub cut: Cut,
    pub places: Vec<Point<D>>,
    /// Of a closed curve both are [`End::Closed`], and the first place is the last as well.
    pub ends: [End; 2],
}

/// Follows curves.
pub(super) struct Tracer<'a, const D: usize> {
    pub pieces: &'a Pieces<D>,
    pub bounds: Bounds<D>,
}

impl<const D: usize> Tracer<'_, D> {
    /// The curve through a place near it, followed in both directions.
    pub fn curve(&self, piece: u32, cut: Cut, near: &Point<D>) -> Option<Curve<D>> {
        let (start, tangent) = self.onto(piece, cut, near)?;
        let (forward, end) = self.follow(piece, cut, start, tangent);
        if end == End::Closed {
            return Some(Curve { piece, cut, places: forward, ends: [End::Closed; 2] });
        }
        let (mut places, other) = self.follow(piece, cut, start, tangent.map(|t| -t));
        places.reverse();
        places.extend_from_slice(&forward[1..]);
        Some(Curve { piece, cut, places, ends: [other, end] })
    }

    /// The places from `start` on, and what ends them.
    fn follow(
        &self,
        piece: u32,
        cut: Cut,
        start: Point<D>,
        mut along: Point<D>,
    ) -> (Vec<Point<D>>, End) {
        let step = STEP * self.pieces.step();
        let mut places = vec![start];
        let mut at = start;
        while places.len() < MOST_STEPS {
            let to: Point<D> = std::array::from_fn(|k| at[k] + step * along[k]);
            if let Some(on_side) = self.leaves(&at, &to, cut) {
                let end = self.onto(piece, cut, &on_side).map_or(on_side, |(place, _)| place);
                places.push(self.onto_side(&end, &on_side, cut));
                return (places, End::Side);
            }
            let Some((next, tangent)) = self.onto(piece, cut, &to) else {
                return (places, End::Free);
            };
            let advance = dot(&difference(&next, &at), &along);
            if advance < 0.2 * step {
                return (places, End::Free);
            }
            let turned = dot(&tangent, &along);
            along = if turned < 0.0 { tangent.map(|t| -t) } else { tangent };
            at = next;
            if places.len() > 8 && distance_squared(&at, &start) < step * step {
                places.push(start);
                return (places, End::Closed);
            }
            places.push(at);
        }
        (places, End::Free)
    }

    /// Where the way from a place in the box to another one leaves it, if it does.
    fn leaves(&self, from: &Point<D>, to: &Point<D>, cut: Cut) -> Option<Point<D>> {
        let mut share = f64::INFINITY;
        for k in 0..D {
            if matches!(cut, Cut::Side { axis, .. } if axis == k) {
                continue;
            }
            for level in [self.bounds.min[k], self.bounds.max[k]] {
                let outward =
                    if level == self.bounds.min[k] { to[k] < level } else { to[k] > level };
                if outward {
                    share = share.min(((level - from[k]) / (to[k] - from[k])).clamp(0.0, 1.0));
                }
            }
        }
        let place = std::array::from_fn(|k| from[k] + share * (to[k] - from[k]));
        share.is_finite().then(|| self.bounds.clamp(&place))
    }

    /// `place`, put on the side that `on_side` is on.
    fn onto_side(&self, place: &Point<D>, on_side: &Point<D>, cut: Cut) -> Point<D> {
        let near = 1e-9 * self.bounds.longest_edge();
        let held = |k: usize| {
            let levels = [self.bounds.min[k], self.bounds.max[k]];
            levels.into_iter().find(|level| (on_side[k] - level).abs() <= near)
        };
        let mut place = self.bounds.clamp(place);
        for k in 0..D {
            if let Some(level) = held(k) {
                place[k] = level;
            }
        }
        if let Cut::Side { axis, level } = cut {
            place[axis] = level;
        }
        place
    }

    /// The place of the curve nearest to `p`, and the curve's direction there; `None` beyond its end.
    pub fn onto(&self, piece: u32, cut: Cut, p: &Point<D>) -> Option<(Point<D>, Point<D>)> {
        let reach = REACH * self.pieces.step();
        let mut at = *p;
        let mut tangent = [0.0; D];
        for _ in 0..ROUNDS {
            let foot = self.pieces.foot_on(piece, &at, reach)?;
            if foot.beyond > 0.0 {
                return None;
            }
            let normal = foot.normal;
            match cut {
                Cut::None => {
                    at = foot.position;
                    tangent = tangents(&normal)[0];
                }
                Cut::Side { axis, level } => {
                    at[axis] = level;
                    let mut across = normal;
                    across[axis] = 0.0;
                    let squared = dot(&across, &across);
                    if squared < 0.01 {
                        return None; // the piece lies along the side
                    }
                    let height = foot.signed_distance(&at) / squared;
                    at = std::array::from_fn(|k| at[k] - height * across[k]);
                    let side = std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 });
                    tangent = unit(&cross(&normal, &side))?;
                }
                Cut::Piece(other) => {
                    let second = self.pieces.foot_on(other, &at, reach)?;
                    if second.beyond > 0.0 {
                        return None;
                    }
                    let cosine = dot(&normal, &second.normal);
                    let squared = 1.0 - cosine * cosine;
                    if squared < 0.06 {
                        return None;
                    }
                    let heights = [foot.signed_distance(&at), second.signed_distance(&at)];
                    let first = (heights[0] - cosine * heights[1]) / squared;
                    let last = (heights[1] - cosine * heights[0]) / squared;
                    at = std::array::from_fn(|k| {
                        at[k] - first * normal[k] - last * second.normal[k]
                    });
                    tangent = unit(&cross(&normal, &second.normal))?;
                }
            }
        }
        Some((at, tangent))
    }
}

/// The cross product in space.
fn cross<const D: usize>(a: &Point<D>, b: &Point<D>) -> Point<D> {
    std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % D, (k + 2) % D);
        a[i] * b[j] - a[j] * b[i]
    })
}

/// The vector over its length, if it has one.
fn unit<const D: usize>(v: &Point<D>) -> Option<Point<D>> {
    let length = dot(v, v).sqrt();
    (length > 1e-9).then(|| v.map(|x| x / length))
}
