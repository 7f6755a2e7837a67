//! All curves of all pieces, where they meet, and the atoms on them.

use crate::parallel::prelude::*;

use crate::crests::Pieces;
use crate::fields::NominalDistance;
use crate::geometry::{Bins, Bounds, Point, difference, distance_squared, dot};

use super::atoms::FeatureAtom;
use super::segments::{Segment, Segments};
use super::trace::{Curve, Cut, End, Tracer};

/// A curve or a part of one shorter than this, over d, has no atoms of its own.
const LEAST_LENGTH: f64 = 0.75;
/// Curves are looked for this near to the places of pieces, over how far apart these are, and found at most so many mean
/// steps away.
const NEAR: f64 = 0.75;
const FARTHEST_START: f64 = 5.0;
/// Ends nearer to another curve than this, over d, are joined to it.
const JOIN: f64 = 0.6;

/// A place at which curves meet or end.
#[derive(Clone, Debug)]
struct Node<const D: usize> {
    place: Point<D>,
    pieces: Vec<u32>,
}

/// The curves of all pieces and the nodes on them.
pub(super) struct Curves<const D: usize> {
    curves: Vec<Curve<D>>,
    /// For each curve the nodes on it, by the length at which they are.
    stops: Vec<Vec<(f64, u32)>>,
    nodes: Vec<Node<D>>,
    /// The mean step of the image.
    step: f64,
}

impl<const D: usize> Curves<D> {
    /// The curves of all pieces: in the plane the pieces themselves, in space where they meet sides and each other.
    pub fn of(pieces: &Pieces<D>, bounds: &Bounds<D>, distance: &NominalDistance<D>) -> Self {
        let mut curves = traced(pieces, bounds, distance);
        let step = pieces.step();
        let segments = Segments::of(&curves, bounds, step);
        join_ends(&mut curves, segments, distance, step);
        let stops = vec![Vec::new(); curves.len()];
        let mut found = Self { stops, curves, nodes: Vec::new(), step };
        found.cross(bounds);
        found
    }

    /// Nodes where curves cross, and at all ends.
    fn cross(&mut self, bounds: &Bounds<D>) {
        let crossings = crossings(&self.curves, &Segments::of(&self.curves, bounds, self.step));
        let mut bins = Bins::new(bounds, self.step, crossings.len() + 2 * self.curves.len());
        for (place, on) in crossings {
            let node = self.node(&mut bins, place, on.iter().map(|&(curve, _)| curve));
            for (curve, length) in on {
                self.stops[curve].push((length, node));
            }
        }
        for curve in 0..self.curves.len() {
            let Curve { places, ends, .. } = &self.curves[curve];
            if ends[0] == End::Closed {
                continue;
            }
            let ends = [(0.0, places[0]), (length_of(places), places[places.len() - 1])];
            for (length, place) in ends {
                let node = self.node(&mut bins, place, [curve].into_iter());
                self.stops[curve].push((length, node));
            }
        }
        for stops in &mut self.stops {
            stops.sort_by(|a, b| a.0.total_cmp(&b.0));
            stops.dedup_by(|a, b| a.1 == b.1 && (a.0 - b.0).abs() < 1e-6);
        }
    }

    /// A node at a place: the first that is there already, or a new one. `bins` hold all of them.
    fn node(
        &mut self,
        bins: &mut Bins<D>,
        place: Point<D>,
        curves: impl Iterator<Item = usize>,
    ) -> u32 {
        let reach = 0.5 * self.step;
        let mut first = None;
        bins.near(&place, reach, |i| {
            if distance_squared(&self.nodes[i].place, &place) < reach * reach {
                first = Some(first.map_or(i, |first: usize| first.min(i)));
            }
        });
        let at = first.unwrap_or_else(|| {
            bins.push(&place);
            self.nodes.push(Node { place, pieces: Vec::new() });
            self.nodes.len() - 1
        });
        for curve in curves {
            let Curve { piece, cut, .. } = self.curves[curve];
            let other = if let Cut::Piece(other) = cut { Some(other) } else { None };
            for piece in [Some(piece), other].into_iter().flatten() {
                if !self.nodes[at].pieces.contains(&piece) {
                    self.nodes[at].pieces.push(piece);
                }
            }
        }
        at as u32
    }

    /// Atoms on the curves: one on each node, and evenly at ∫ds/d between them.
    pub fn atoms(&self, distance: &NominalDistance<D>) -> Vec<FeatureAtom<D>> {
        let mut atoms: Vec<FeatureAtom<D>> = (self.nodes.iter())
            .map(|node| FeatureAtom::new(node.place, node.pieces.clone(), 0))
            .collect();
        for (curve, stops) in self.curves.iter().zip(&self.stops) {
            let lengths = Lengths::of(&curve.places, distance);
            let mut pieces = vec![curve.piece];
            if let Cut::Piece(other) = curve.cut {
                pieces.push(other);
            }
            let mut add = |from: f64, to: f64, count: usize| {
                for i in 1..count {
                    let at = from + (to - from) * i as f64 / count as f64;
                    let place = lengths.place(&curve.places, at);
                    atoms.push(FeatureAtom::new(place, pieces.clone(), 1));
                }
            };
            let all = lengths.scaled[lengths.scaled.len() - 1];
            if stops.is_empty() {
                // closed: an atom where it begins
                let count = (all.round() as usize).max(3);
                add(-all / count as f64, all, count + 1);
                continue;
            }
            let at: Vec<f64> = stops.iter().map(|stop| lengths.scaled_at(stop.0)).collect();
            let mut parts: Vec<(f64, f64)> = at.windows(2).map(|w| (w[0], w[1])).collect();
            if curve.ends[0] == End::Closed {
                parts.push((at[at.len() - 1], all + at[0]));
            }
            for (from, to) in parts {
                add(from, to, ((to - from).round() as usize).max(1));
            }
        }
        atoms
    }
}

/// All curves of all pieces, the strongest pieces first.
fn traced<const D: usize>(
    pieces: &Pieces<D>,
    bounds: &Bounds<D>,
    distance: &NominalDistance<D>,
) -> Vec<Curve<D>> {
    let mut curves = Follower::new(pieces, bounds, distance);
    let places: Vec<(Point<D>, u32)> = pieces.places().collect();
    let near = NEAR * pieces.apart() * pieces.step();
    if D == 2 {
        curves.follow(Cut::None, places.iter());
    } else {
        let sides = (0..D).flat_map(|axis| [(axis, bounds.min[axis]), (axis, bounds.max[axis])]);
        for (axis, level) in sides {
            let is_near = |(place, _): &&(Point<D>, u32)| (place[axis] - level).abs() <= near;
            curves.follow(Cut::Side { axis, level }, places.iter().filter(is_near));
        }
        for (other, starts) in meetings(pieces, &places, near).iter().enumerate() {
            let starts = starts.iter().map(|&i| &places[i as usize]);
            curves.follow(Cut::Piece(other as u32), starts);
        }
    }
    curves.curves
}

/// For each piece the places on those before it that are near to it.
fn meetings<const D: usize>(
    pieces: &Pieces<D>,
    places: &[(Point<D>, u32)],
    near: f64,
) -> Vec<Vec<u32>> {
    let others = |(place, piece): &(Point<D>, u32)| {
        let mut others = pieces.near(place, near);
        others.retain(|&other| {
            *piece < other
                && pieces.foot_on(other, place, near).is_some_and(|foot| {
                    foot.beyond == 0.0 && foot.signed_distance(place).abs() < near
                })
        });
        others
    };
    let found: Vec<Vec<u32>> = places.par_iter().with_min_len(1 << 7).map(others).collect();
    let mut of_pieces = vec![Vec::new(); pieces.len()];
    for (i, others) in found.iter().enumerate() {
        others.iter().for_each(|&other| of_pieces[other as usize].push(i as u32));
    }
    of_pieces
}

/// Follows curves, each once.
struct Follower<'a, const D: usize> {
    tracer: Tracer<'a, D>,
    distance: &'a NominalDistance<D>,
    curves: Vec<Curve<D>>,
    /// The places of the curves followed, those too short among them, with their pieces and what made them.
    walked: Vec<(Point<D>, u32, Cut)>,
    bins: Bins<D>,
}

impl<'a, const D: usize> Follower<'a, D> {
    fn new(pieces: &'a Pieces<D>, bounds: &Bounds<D>, distance: &'a NominalDistance<D>) -> Self {
        Self {
            tracer: Tracer { pieces, bounds: *bounds },
            distance,
            curves: Vec::new(),
            walked: Vec::new(),
            bins: Bins::new(bounds, pieces.step(), pieces.points().len()),
        }
    }

    /// Follows every curve of a kind near `starts` that no curve before it goes along.
    fn follow<'b>(&mut self, cut: Cut, starts: impl Iterator<Item = &'b (Point<D>, u32)>) {
        let step = self.tracer.pieces.step();
        for &(near, piece) in starts {
            let Some((start, _)) = self.tracer.onto(piece, cut, &near) else { continue };
            if distance_squared(&start, &near) > (FARTHEST_START * step).powi(2) {
                continue;
            }
            let mut is_walked = false;
            self.bins.near(&start, 1.5 * step, |i| {
                let (place, on, by) = &self.walked[i];
                is_walked |= (*on, *by) == (piece, cut)
                    && distance_squared(place, &start) < (1.5 * step).powi(2);
            });
            if is_walked {
                continue;
            }
            let Some(curve) = self.tracer.curve(piece, cut, &start) else { continue };
            for place in &curve.places {
                self.bins.push(place);
                self.walked.push((*place, piece, cut));
            }
            if length_of(&curve.places) >= LEAST_LENGTH * self.distance.at(&start) {
                self.curves.push(curve);
            }
        }
    }
}

/// The length of a line of places.
fn length_of<const D: usize>(places: &[Point<D>]) -> f64 {
    places.windows(2).map(|w| distance_squared(&w[0], &w[1]).sqrt()).sum()
}

/// Free ends that are near another curve are led onto it. `segments` are those of the curves.
fn join_ends<const D: usize>(
    curves: &mut [Curve<D>],
    mut segments: Segments<D>,
    distance: &NominalDistance<D>,
    step: f64,
) {
    for curve in 0..curves.len() {
        for end in 0..2 {
            if curves[curve].ends[end] != End::Free {
                continue;
            }
            let places = &curves[curve].places;
            let place = if end == 0 { places[0] } else { places[places.len() - 1] };
            let reach = JOIN * distance.at(&place) + 2.0 * step;
            let Some(to) = nearest_on_others(curves, &segments, curve, &place, reach) else {
                continue;
            };
            // a little beyond, so that the two cross
            let over = std::array::from_fn(|k| to[k] + 1e-3 * (to[k] - place[k]));
            let places = &mut curves[curve].places;
            let (index, ends) = match end {
                0 => (0, [over, place]),
                _ => (places.len() - 1, [place, over]),
            };
            places.insert(if end == 0 { 0 } else { places.len() }, over);
            segments.push(Segment { curve, index, ends });
        }
    }
}

/// The place on another curve of the same kind nearest to `p`.
fn nearest_on_others<const D: usize>(
    curves: &[Curve<D>],
    segments: &Segments<D>,
    own: usize,
    p: &Point<D>,
    reach: f64,
) -> Option<Point<D>> {
    let mut best = (reach * reach, usize::MAX, None);
    segments.near(p, reach, |number| {
        let Segment { curve, ends: [a, b], .. } = &segments.all()[number];
        if *curve == own || curves[*curve].cut != curves[own].cut {
            return;
        }
        let foot = foot_on_line(p, a, b).1;
        let squared = distance_squared(&foot, p);
        if squared < best.0 || squared == best.0 && number < best.1 && best.2.is_some() {
            best = (squared, number, Some(foot));
        }
    });
    best.2
}

/// The share along a line and the place on it that are nearest to `p`.
fn foot_on_line<const D: usize>(p: &Point<D>, a: &Point<D>, b: &Point<D>) -> (f64, Point<D>) {
    let along = difference(b, a);
    let squared = dot(&along, &along);
    let t = if squared > 0.0 { dot(&difference(p, a), &along) / squared } else { 0.0 };
    let t = t.clamp(0.0, 1.0);
    (t, std::array::from_fn(|k| a[k] + t * along[k]))
}

/// A crossing: where, and at which length of which curves.
type Crossing<const D: usize> = (Point<D>, Vec<(usize, f64)>);

/// How far apart two lines may be along an axis that meet.
const GAP: f64 = 0.5;

/// Where lines of places cross, or, in space, pass within half a sample of each other: by the first curve, then the
/// second, then along both.
fn crossings<const D: usize>(curves: &[Curve<D>], segments: &Segments<D>) -> Vec<Crossing<D>> {
    let all = segments.all();
    let starts: Vec<Vec<f64>> = curves.iter().map(|curve| starts_of(&curve.places)).collect();
    let length = |[a, b]: &[Point<D>; 2]| distance_squared(a, b).sqrt();
    let of = |number: usize| {
        let first = all[number];
        let met = |other: usize| {
            let second = all[other];
            let [a, b] = &first.ends;
            let [c, d] = &second.ends;
            let (s, t, place) = meeting([a, b], [c, d])?;
            let at_first = starts[first.curve][first.index] + s * length(&first.ends);
            let at_second = starts[second.curve][second.index] + t * length(&second.ends);
            let order = [first.curve, second.curve, first.index, second.index];
            Some((order, (place, vec![(first.curve, at_first), (second.curve, at_second)])))
        };
        segments.later_near(number, GAP).into_iter().filter_map(met).collect::<Vec<_>>()
    };
    let found = (0..all.len()).into_par_iter().with_min_len(1 << 8).map(of);
    let mut found: Vec<([usize; 4], Crossing<D>)> = found.flatten_iter().collect();
    found.sort_by_key(|(order, _)| *order);
    found.into_iter().map(|(_, crossing)| crossing).collect()
}

/// The length along a line of places up to each of them.
fn starts_of<const D: usize>(places: &[Point<D>]) -> Vec<f64> {
    let lengths = places.windows(2).map(|w| distance_squared(&w[0], &w[1]).sqrt());
    let sums = lengths.scan(0.0, |sum, length| {
        *sum += length;
        Some(*sum)
    });
    std::iter::once(0.0).chain(sums).collect()
}

/// Where two short lines meet: the shares along them, and the place.
fn meeting<const D: usize>(
    [a, b]: [&Point<D>; 2],
    [c, d]: [&Point<D>; 2],
) -> Option<(f64, f64, Point<D>)> {
    let (u, v, w) = (difference(b, a), difference(d, c), difference(c, a));
    if (0..D)
        .any(|k| a[k].max(b[k]) + GAP < c[k].min(d[k]) || c[k].max(d[k]) + GAP < a[k].min(b[k]))
    {
        return None;
    }
    let (uu, vv, uv) = (dot(&u, &u), dot(&v, &v), dot(&u, &v));
    let determinant = uu * vv - uv * uv;
    if determinant <= 1e-12 * uu * vv {
        return None;
    }
    let s = (dot(&u, &w) * vv - dot(&v, &w) * uv) / determinant;
    let t = (dot(&u, &w) * uv - dot(&v, &w) * uu) / determinant;
    if !(0.0..1.0).contains(&s) || !(0.0..1.0).contains(&t) {
        return None;
    }
    let p: Point<D> = std::array::from_fn(|k| a[k] + s * u[k]);
    let q: Point<D> = std::array::from_fn(|k| c[k] + t * v[k]);
    let near = if D == 2 { f64::INFINITY } else { 0.25 };
    (distance_squared(&p, &q) < near).then(|| (s, t, std::array::from_fn(|k| 0.5 * (p[k] + q[k]))))
}

/// The length along a line of places, and the same over d.
struct Lengths {
    plain: Vec<f64>,
    scaled: Vec<f64>,
}

impl Lengths {
    fn of<const D: usize>(places: &[Point<D>], distance: &NominalDistance<D>) -> Self {
        let (mut plain, mut scaled) = (vec![0.0], vec![0.0]);
        for pair in places.windows(2) {
            let length = distance_squared(&pair[0], &pair[1]).sqrt();
            let middle = std::array::from_fn(|k| 0.5 * (pair[0][k] + pair[1][k]));
            plain.push(plain[plain.len() - 1] + length);
            scaled.push(scaled[scaled.len() - 1] + length / distance.at(&middle));
        }
        Self { plain, scaled }
    }

    /// The scaled length at a plain one.
    fn scaled_at(&self, length: f64) -> f64 {
        between(&self.plain, &self.scaled, length)
    }

    /// The place at a scaled length; beyond the last one it begins again.
    fn place<const D: usize>(&self, places: &[Point<D>], scaled: f64) -> Point<D> {
        let all = self.scaled[self.scaled.len() - 1];
        let at = scaled.rem_euclid(all);
        let i = self.scaled.partition_point(|&x| x <= at).clamp(1, self.scaled.len() - 1);
        let (low, high) = (self.scaled[i - 1], self.scaled[i]);
        let share = if high > low { (at - low) / (high - low) } else { 0.0 };
        std::array::from_fn(|k| places[i - 1][k] + share * (places[i][k] - places[i - 1][k]))
    }
}

/// The value at `x` of what is linear between (from, to).
fn between(from: &[f64], to: &[f64], x: f64) -> f64 {
    let i = from.partition_point(|&y| y <= x).clamp(1, from.len() - 1);
    let (low, high) = (from[i - 1], from[i]);
    let share = if high > low { (x - low) / (high - low) } else { 0.0 };
    to[i - 1] + share * (to[i] - to[i - 1])
}
