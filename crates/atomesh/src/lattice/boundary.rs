//! What any lattice starts from: the user's fixed atoms, the corners of the box, and atoms along its edges.

use crate::fields::NominalDistance;
use crate::geometry::{Bounds, Point, distance_squared};
use crate::region::Outline;

use super::Lattice;
use super::error::{LENGTHS, LatticeError};
use super::plant::Planted;

/// What a lattice fills.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a, const D: usize> {
    /// The image's box.
    pub bounds: Bounds<D>,
    /// d(x).
    pub distance: &'a NominalDistance<D>,
    /// The outline of the mask within which atoms are wanted, if not in all of the box.
    pub outline: Option<&'a Outline<D>>,
}

impl<const D: usize> Place<'_, D> {
    /// Whether an atom is wanted at `p`, where the nominal distance is `d`.
    pub(super) fn needs(&self, p: &Point<D>, d: f64) -> bool {
        self.outline.is_none_or(|outline| outline.needs(p, d))
    }
}

/// What any lattice starts from: the user's fixed atoms, the corners, and the edges of the box.
pub(super) struct Boundary<'a, const D: usize> {
    lattice: Lattice<D>,
    place: Place<'a, D>,
    /// Coordinates are multiples of this power of two.
    pub(super) quantum: f64,
}

impl<'a, const D: usize> Boundary<'a, D> {
    pub(super) fn new(place: Place<'a, D>) -> Result<Self, LatticeError> {
        let Place { bounds, distance, .. } = place;
        let extent = bounds.extent();
        if let Some(axis) = (0..D).find(|&k| extent[k] <= 0.0) {
            return Err(LatticeError::Thin { axis });
        }
        let (least, longest) = (distance.least(), bounds.longest_edge());
        if !(LENGTHS.contains(&least) && LENGTHS.contains(&longest)) {
            return Err(LatticeError::Scale { distance: least, extent: longest });
        }
        let quantum = 2f64.powi(distance.least().log2().floor() as i32 - 16);
        Ok(Self { lattice: Lattice::empty(bounds), place, quantum })
    }

    /// The atoms that nothing moves: the user's, and the corners.
    pub(super) fn fixed(&self, seeds: &[Point<D>]) -> Vec<Point<D>> {
        let wanted = |p: &Point<D>| self.place.needs(p, self.place.distance.at(p));
        let corners = self.lattice.bounds.corners().filter(wanted);
        seeds.iter().copied().chain(corners).collect()
    }

    /// The user's fixed atoms, those planted on an outline, corners, and atoms along every edge of the box at
    /// even steps of ∫dx/d.
    pub(super) fn plant_and_divide(
        mut self,
        seeds: &[Point<D>],
        planted: &[Planted<D>],
    ) -> Result<Lattice<D>, LatticeError> {
        self.plant(seeds)?;
        for atom in planted {
            self.lattice.push(atom.position, atom.freedom, 1.0);
        }
        let distance = self.place.distance;
        let given = self.lattice.len();
        let bounds = self.lattice.bounds;
        for c in bounds.corners() {
            if !self.lattice.atoms.contains(&c) && self.place.needs(&c, distance.at(&c)) {
                self.lattice.push(c, 0, 0.0);
            }
        }
        for axis in 0..D {
            for c in (0..1 << D).filter(|c| c >> axis & 1 == 0) {
                let corner = bounds.corner(c);
                for x in even_steps(&corner, axis, bounds.max[axis], distance) {
                    let mut p = corner;
                    p[axis] = (x / self.quantum).round() * self.quantum;
                    // only a fixed or planted atom can be in the way
                    let d = distance.at(&p);
                    let near = |q: &Point<D>| distance_squared(q, &p) < 0.25 * d * d;
                    if self.place.needs(&p, d) && !self.lattice.atoms[..given].iter().any(near) {
                        self.lattice.push(p, 1 << axis, 1.0);
                    }
                }
            }
        }
        Ok(self.lattice)
    }

    /// The user's fixed atoms.
    fn plant(&mut self, seeds: &[Point<D>]) -> Result<(), LatticeError> {
        let bounds = self.lattice.bounds;
        for (index, p) in seeds.iter().enumerate() {
            if !bounds.contains(p) {
                return Err(LatticeError::SeedOutside {
                    index,
                    point: p.to_vec(),
                    min: bounds.min.to_vec(),
                    max: bounds.max.to_vec(),
                });
            }
            if self.lattice.atoms.contains(p) {
                continue;
            }
            let least = NEAREST * self.place.distance.at(p);
            let mut others = self.lattice.atoms.iter();
            if let Some(first) = others.position(|q| distance_squared(p, q) < least * least) {
                let first =
                    seeds.iter().position(|q| *q == self.lattice.atoms[first]).unwrap_or(first);
                return Err(LatticeError::SeedsNear { first, second: index, least });
            }
            self.lattice.push(*p, 0, 0.0);
        }
        Ok(())
    }
}

/// Seed points nearer to each other than this, over d, are refused: rounded to a file's coordinates they might be one.
const NEAREST: f64 = 1e-6;

/// Where a line from `start` along `axis` to `end` is divided evenly in ∫dx/d, ends left out.
fn even_steps<const D: usize>(
    start: &Point<D>,
    axis: usize,
    end: f64,
    distance: &NominalDistance<D>,
) -> Vec<f64> {
    let length = end - start[axis];
    // Simpson would do as well: d is smooth, and eight samples a nominal distance are plenty.
    let count = ((length / distance.least() * 8.0).ceil() as usize).clamp(8, 1 << 22);
    let h = length / count as f64;
    let rate = |i: usize| {
        let mut p = *start;
        p[axis] += h * i as f64;
        1.0 / distance.at(&p)
    };
    let mut total = Vec::with_capacity(count + 1);
    total.push(0.0);
    let mut before = rate(0);
    for i in 0..count {
        let after = rate(i + 1);
        total.push(total[i] + 0.5 * h * (before + after));
        before = after;
    }
    let all = total[count];
    let pieces = all.round().max(1.0) as usize;
    let mut at = 0;
    (1..pieces)
        .map(|piece| {
            let wanted = all * piece as f64 / pieces as f64;
            while total[at + 1] < wanted {
                at += 1;
            }
            let share = (wanted - total[at]) / (total[at + 1] - total[at]);
            start[axis] + h * (at as f64 + share)
        })
        .collect()
}
