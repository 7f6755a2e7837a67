//! Growing a lattice outward from a seed (Hale 2001, algorithm 2), boundary first.
//!
//! Assumes d(x) is smooth, |∇d| ≪ 1. Corners, then edges of the box, divided evenly in ∫dx/d; then, in
//! 3-D, its faces, grown as hexagonal crystals from their centres, each as if the others were not there;
//! then the interior from the seeds, or from the centre, as the wanted crystal. Visits atoms breadth
//! first, tries their ideal neighbour sites in crystal order, and takes a site if the ball of diameter
//! γ d around it is free. Where growth could not pass, because the box is narrower than d there, it starts
//! again from the boundary. Coordinates are snapped to binary fractions, so that a perfect crystal stays
//! perfect. Cost: O(atoms). Deterministic.

use crate::distance::NominalDistance;
use crate::geometry::{Bounds, Point, distance_squared};
use crate::mesh::MOST_POINTS;
use crate::watch::{Cancelled, Phase, Watch, check};

use super::Lattice;
use super::crystal::Crystal;
use super::occupancy::Occupancy;

/// How a lattice is grown.
#[derive(Clone, Debug, PartialEq)]
pub struct GrowOptions<const D: usize> {
    /// γ, the share of d that an atom keeps to itself. Default 0.8, the paper's.
    pub spacing_factor: f64,
    /// Atoms that stay where they are and from which the interior grows, in lattice coordinates: wells.
    /// Default none: growth starts at the centre.
    pub seed_points: Vec<Point<D>>,
}

impl<const D: usize> Default for GrowOptions<D> {
    fn default() -> Self {
        Self { spacing_factor: 0.8, seed_points: Vec::new() }
    }
}

/// Why a lattice could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LatticeError {
    /// The box has no extent along an axis.
    #[error("the image has 1 sample along {}; a mesh needs 2 or more along every axis", ["x", "y", "z"][*axis])]
    Thin {
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
    },
    /// Lengths whose squares, in single precision for some, would overflow or vanish.
    #[error(
        "a nominal distance of {distance:e} in a box of {extent:e}; expected lengths of {:e} to {:e}",
        LENGTHS.start(), LENGTHS.end()
    )]
    Scale {
        /// The least nominal distance.
        distance: f64,
        /// The box's greatest extent.
        extent: f64,
    },
    /// A seed point lies outside the box.
    #[error(
        "seed point {index} at {point:?} lies outside the box {min:?} to {max:?} (lattice coordinates)"
    )]
    SeedOutside {
        /// The point's place in the list.
        index: usize,
        /// Its lattice coordinates.
        point: Vec<f64>,
        /// The box's least corner.
        min: Vec<f64>,
        /// The box's greatest corner.
        max: Vec<f64>,
    },
    /// γ is not in 0.1…1.
    #[error("spacing factor {value}; expected 0.1 to 1")]
    SpacingFactor {
        /// The factor given.
        value: f64,
    },
    /// More atoms than indices can count.
    #[error("more than {limit} atoms; choose a larger nominal distance")]
    TooMany {
        /// The greatest number of atoms.
        limit: usize,
    },
    /// Scattered atoms could not be connected.
    #[error("scattering: {0}")]
    Connect(String),
    /// The caller ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Lengths that can be reckoned with.
const LENGTHS: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

/// Grows a lattice that fills the box.
///
/// # Errors
/// [`LatticeError`] if the box is thin, lengths are absurd, a seed lies outside, or the work was cancelled.
pub fn grow<const D: usize>(
    crystal: &Crystal<D>,
    bounds: Bounds<D>,
    distance: &NominalDistance<D>,
    options: &GrowOptions<D>,
    watch: &mut dyn Watch,
) -> Result<Lattice<D>, LatticeError> {
    let gamma = options.spacing_factor;
    if !(0.1..=1.0).contains(&gamma) {
        return Err(LatticeError::SpacingFactor { value: gamma });
    }
    let boundary = Boundary::new(bounds, distance)?;
    let quantum = boundary.quantum;
    let lattice = boundary.plant_and_divide(&options.seed_points)?;
    let expected = distance.estimated_atoms(crystal.density());
    if expected > MOST_POINTS as f64 {
        return Err(LatticeError::TooMany { limit: MOST_POINTS });
    }
    let (least, greatest) = (gamma * distance.least(), gamma * distance.greatest());
    let mut occupancy = Occupancy::new(bounds, least, greatest, expected as usize);
    for p in lattice.atoms() {
        occupancy.take(*p, gamma * distance.at(p));
    }
    // the user's atoms come first, each once
    let seeds = lattice.atoms().iter().take_while(|p| options.seed_points.contains(p)).count();
    let mut growth = Growth { lattice, occupancy, distance, gamma, quantum, seeds, expected };
    for face in 0..if D == 3 { 6 } else { 0 } {
        growth.face(face / 2, face % 2 == 1, watch)?;
    }
    growth.interior(crystal, watch)?;
    Ok(growth.lattice)
}

/// What any lattice starts from: the user's fixed atoms, the corners, and the edges of the box.
pub(super) struct Boundary<'a, const D: usize> {
    lattice: Lattice<D>,
    distance: &'a NominalDistance<D>,
    /// Coordinates are multiples of this power of two.
    quantum: f64,
}

impl<'a, const D: usize> Boundary<'a, D> {
    pub(super) fn new(
        bounds: Bounds<D>,
        distance: &'a NominalDistance<D>,
    ) -> Result<Self, LatticeError> {
        let extent = bounds.extent();
        if let Some(axis) = (0..D).find(|&k| extent[k] <= 0.0) {
            return Err(LatticeError::Thin { axis });
        }
        let (least, longest) = (distance.least(), extent.iter().copied().fold(0.0, f64::max));
        if !(LENGTHS.contains(&least) && LENGTHS.contains(&longest)) {
            return Err(LatticeError::Scale { distance: least, extent: longest });
        }
        let quantum = 2f64.powi(distance.least().log2().floor() as i32 - 16);
        Ok(Self { lattice: Lattice::empty(bounds), distance, quantum })
    }

    /// The user's fixed atoms, corners, and atoms along every edge of the box at even steps of ∫dx/d.
    pub(super) fn plant_and_divide(
        mut self,
        seeds: &[Point<D>],
    ) -> Result<Lattice<D>, LatticeError> {
        self.plant(seeds)?;
        let given = self.lattice.len();
        let Bounds { min, max } = self.lattice.bounds;
        let corner = |c: usize| -> Point<D> {
            std::array::from_fn(|k| if c >> k & 1 == 1 { max[k] } else { min[k] })
        };
        for c in 0..1 << D {
            if !self.lattice.atoms.contains(&corner(c)) {
                self.lattice.push(corner(c), 0, 0.0);
            }
        }
        for axis in 0..D {
            for c in (0..1 << D).filter(|c| c >> axis & 1 == 0) {
                for x in even_steps(&corner(c), axis, max[axis], self.distance) {
                    let mut p = corner(c);
                    p[axis] = (x / self.quantum).round() * self.quantum;
                    // only a fixed atom can be in the way
                    let reach = 0.5 * self.distance.at(&p);
                    let near = |q: &Point<D>| distance_squared(q, &p) < reach * reach;
                    if !self.lattice.atoms[..given].iter().any(near) {
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
            if !self.lattice.atoms.contains(p) {
                self.lattice.push(*p, 0, 0.0);
            }
        }
        Ok(())
    }
}

struct Growth<'a, const D: usize> {
    lattice: Lattice<D>,
    occupancy: Occupancy<D>,
    distance: &'a NominalDistance<D>,
    gamma: f64,
    quantum: f64,
    /// How many of the first atoms are the user's.
    seeds: usize,
    expected: f64,
}

/// Where growth starts again from the boundary, a site must be this far from other atoms, in d: holes in
/// a crystal are smaller, so that where growth has passed little is added.
const RESTART: f64 = 0.85;

impl<const D: usize> Growth<'_, D> {
    fn snap(&self, p: Point<D>) -> Point<D> {
        p.map(|x| (x / self.quantum).round() * self.quantum)
    }

    fn add(&mut self, p: Point<D>, freedom: u8, temperature: f32) {
        self.occupancy.take(p, self.gamma * self.distance.at(&p));
        self.lattice.push(p, freedom, temperature);
    }

    fn is_free(&self, p: &Point<D>) -> bool {
        self.occupancy.is_free(p, self.gamma * self.distance.at(p))
    }

    /// One face of the box in 3-D, where `normal` is at its least or greatest.
    fn face(
        &mut self,
        normal: usize,
        far: bool,
        watch: &mut dyn Watch,
    ) -> Result<(), LatticeError> {
        let axes: Vec<usize> = (0..D).filter(|&k| k != normal).collect();
        let Bounds { min, max } = self.lattice.bounds;
        let mut centre: Point<D> = std::array::from_fn(|k| 0.5 * (min[k] + max[k]));
        centre = self.snap(centre);
        centre[normal] = if far { max[normal] } else { min[normal] };
        let steps: Vec<Point<D>> = Crystal::hexagonal()
            .neighbors()
            .iter()
            .map(|v| {
                let mut step = [0.0; D];
                (step[axes[0]], step[axes[1]]) = (v[0], v[1]);
                step
            })
            .collect();
        let freedom = axes.iter().map(|k| 1u8 << k).sum();
        // Atoms of the opposite face, nearer than d in a thin box, do not count; nor do those beside.
        let on_face: Vec<usize> = (0..self.lattice.len())
            .filter(|&i| self.lattice.atoms[i][normal] == centre[normal])
            .collect();
        let mut flat = Bounds { min, max };
        (flat.min[normal], flat.max[normal]) = (centre[normal], centre[normal]);
        let (least, greatest) = (self.distance.least(), self.distance.greatest());
        let plane = Occupancy::new(flat, self.gamma * least, self.gamma * greatest, on_face.len());
        let whole = std::mem::replace(&mut self.occupancy, plane);
        for i in (0..self.seeds).chain(on_face.iter().copied()) {
            let p = self.lattice.atoms[i];
            self.occupancy.take(p, self.gamma * self.distance.at(&p));
        }
        let first = self.lattice.len();
        if self.is_free(&centre) {
            self.add(centre, freedom, 1.0);
        }
        self.fill(first, &on_face, &steps, freedom, watch)?;
        self.occupancy = whole;
        for p in &self.lattice.atoms[first..] {
            self.occupancy.take(*p, self.gamma * self.distance.at(p));
        }
        Ok(())
    }

    /// The inside of the box, from the seeds or the centre.
    fn interior(
        &mut self,
        crystal: &Crystal<D>,
        watch: &mut dyn Watch,
    ) -> Result<(), LatticeError> {
        let Bounds { min, max } = self.lattice.bounds;
        let freedom = ((1usize << D) - 1) as u8;
        let first = self.lattice.len();
        for s in 0..self.seeds {
            self.surround(s, crystal.neighbors(), freedom, self.gamma);
        }
        if self.lattice.len() == first {
            let centre = self.snap(std::array::from_fn(|k| 0.5 * (min[k] + max[k])));
            if self.is_free(&centre) {
                self.add(centre, freedom, 1.0);
            }
        }
        let boundary: Vec<usize> = (0..first).collect();
        self.fill(first, &boundary, crystal.neighbors(), freedom, watch)
    }

    /// Grows from the atoms from `first` on; then, where that left room, from those of the `rim`.
    fn fill(
        &mut self,
        first: usize,
        rim: &[usize],
        steps: &[Point<D>],
        freedom: u8,
        watch: &mut dyn Watch,
    ) -> Result<(), LatticeError> {
        self.spread(first, steps, freedom, watch)?;
        for &i in rim {
            let next = self.lattice.len();
            self.surround(i, steps, freedom, (2.0 * RESTART - self.gamma).max(self.gamma));
            self.spread(next, steps, freedom, watch)?;
        }
        Ok(())
    }

    /// Algorithm 2's loop: the atoms from `first` on are the queue of those whose sites are still to be
    /// tried, which visits sites in the same order as a queue of sites does.
    fn spread(
        &mut self,
        first: usize,
        steps: &[Point<D>],
        freedom: u8,
        watch: &mut dyn Watch,
    ) -> Result<(), LatticeError> {
        let mut at = first;
        while at < self.lattice.len() {
            if at.is_multiple_of(4096) {
                let done = (self.lattice.len() as f64 / self.expected.max(1.0)).min(1.0);
                check(watch, Phase::Grow, done, None)?;
            }
            self.surround(at, steps, freedom, self.gamma);
            at += 1;
        }
        Ok(())
    }

    /// Puts atoms on the ideal sites around atom `i` where a ball of diameter `room` d is free.
    fn surround(&mut self, i: usize, steps: &[Point<D>], freedom: u8, room: f64) {
        let Bounds { min, max } = self.lattice.bounds;
        let from = self.lattice.atoms[i];
        let d = self.distance.at(&from);
        for step in steps {
            let step = self.snap(step.map(|s| s * d));
            let site: Point<D> = std::array::from_fn(|k| from[k] + step[k]);
            let inside = (0..D).all(|k| {
                if freedom >> k & 1 == 1 { min[k] < site[k] && site[k] < max[k] } else { true }
            });
            if inside && self.occupancy.is_free(&site, room * self.distance.at(&site)) {
                self.add(site, freedom, 1.0);
            }
        }
    }
}

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
    for i in 0..count {
        total.push(total[i] + 0.5 * h * (rate(i) + rate(i + 1)));
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
