//! Growing a lattice outward from a seed (Hale 2001, algorithm 2), boundary first.
//!
//! Assumes d(x) is smooth, |∇d| ≪ 1. Corners, then edges of the box, divided evenly in ∫dx/d; then, in
//! 3-D, its faces, grown as hexagonal crystals from their centres, each as if the others were not there;
//! then the interior from the seeds, or from the centre, as the wanted crystal. Visits atoms breadth
//! first, tries their ideal neighbour sites in crystal order, and takes a site if the ball of diameter
//! γ d around it is free. Where growth could not pass, because the box is narrower than d there, it starts
//! again from the boundary. Coordinates are snapped to binary fractions, so that a perfect crystal stays
//! perfect. Cost: O(atoms). Deterministic.

use crate::fields::NominalDistance;
use crate::geometry::{Bounds, Point, all_axes, distance_squared};
use crate::mesh::MOST_POINTS;
use crate::region::Outline;
use crate::watch::{Cancelled, Phase, Watch, check};

use super::Lattice;
use super::crystal::Crystal;
use super::occupancy::{Look, Occupancy};
use super::outline::{Planted, plant};

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
    grow_within(crystal, Place { bounds, distance, outline: None }, options, watch)
}

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
    fn needs(&self, p: &Point<D>, d: f64) -> bool {
        self.outline.is_none_or(|outline| outline.needs(p, d))
    }
}

/// [`grow`] on the outline of a mask first, then inside of it and one layer beyond.
///
/// # Errors
/// As [`grow`].
pub fn grow_within<const D: usize>(
    crystal: &Crystal<D>,
    place: Place<'_, D>,
    options: &GrowOptions<D>,
    watch: &mut dyn Watch,
) -> Result<Lattice<D>, LatticeError> {
    let Place { bounds, distance, .. } = place;
    let gamma = options.spacing_factor;
    if !(0.1..=1.0).contains(&gamma) {
        return Err(LatticeError::SpacingFactor { value: gamma });
    }
    let boundary = Boundary::new(place)?;
    let quantum = boundary.quantum;
    let planted = match place.outline {
        Some(outline) => plant(outline, distance, gamma, &boundary.fixed(options), watch)?,
        None => Vec::new(),
    };
    let lattice = boundary.plant_and_divide(&options.seed_points, &planted)?;
    let share = place.outline.map_or(1.0, Outline::mean_share);
    let expected = share * distance.estimated_atoms(crystal.density());
    if expected > MOST_POINTS as f64 {
        return Err(LatticeError::TooMany { limit: MOST_POINTS });
    }
    let mut occupancy = balls(bounds, distance, gamma, expected as usize);
    let nominal: Vec<f64> = lattice.atoms().iter().map(|p| distance.at(p)).collect();
    for (p, d) in lattice.atoms().iter().zip(&nominal) {
        occupancy.take(*p, gamma * d);
    }
    // the user's atoms come first, each once
    let seeds = lattice.atoms().iter().take_while(|p| options.seed_points.contains(p)).count();
    let unsure = slope_of_a_step(distance);
    let mut growth =
        Growth { lattice, nominal, occupancy, place, gamma, unsure, quantum, seeds, expected };
    for face in 0..if D == 3 { 6 } else { 0 } {
        growth.face(face / 2, face % 2 == 1, watch)?;
    }
    growth.interior(crystal, watch)?;
    Ok(growth.lattice)
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

    /// The corners of the box.
    fn corners(&self) -> impl Iterator<Item = Point<D>> + use<D> {
        self.lattice.bounds.corners()
    }

    /// The atoms that nothing moves: the user's, and the corners.
    fn fixed(&self, options: &GrowOptions<D>) -> Vec<Point<D>> {
        let wanted = |p: &Point<D>| self.place.needs(p, self.place.distance.at(p));
        options.seed_points.iter().copied().chain(self.corners().filter(wanted)).collect()
    }

    /// The user's fixed atoms, those planted on an outline, corners, and atoms along every edge of the box at
    /// even steps of ∫dx/d.
    pub(super) fn plant_and_divide(
        mut self,
        seeds: &[Point<D>],
        planted: &[Planted<D>],
    ) -> Result<Lattice<D>, LatticeError> {
        self.plant(seeds)?;
        for (p, freedom) in planted {
            self.lattice.push(*p, *freedom, 1.0);
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
            if !self.lattice.atoms.contains(p) {
                self.lattice.push(*p, 0, 0.0);
            }
        }
        Ok(())
    }
}

struct Growth<'a, const D: usize> {
    lattice: Lattice<D>,
    /// d at the atoms.
    nominal: Vec<f64>,
    occupancy: Occupancy<D>,
    place: Place<'a, D>,
    gamma: f64,
    /// See [`slope_of_a_step`].
    unsure: f64,
    quantum: f64,
    /// How many of the first atoms are the user's.
    seeds: usize,
    expected: f64,
}

/// Where growth starts again from the boundary, a site must be this far from other atoms, in d: holes in
/// a crystal are smaller, so that where growth has passed little is added.
const RESTART: f64 = 0.85;

/// The diameter, in d, of the ball that must be free for an atom to be added from the boundary.
pub(super) fn restart_room(gamma: f64) -> f64 {
    (2.0 * RESTART - gamma).max(gamma)
}

/// The most by which d at an ideal site differs from d at its atom, over that.
fn slope_of_a_step<const D: usize>(distance: &NominalDistance<D>) -> f64 {
    1.001 * distance.greatest_slope() // a step is d long, but for its snapping
}

/// Room for about `expected` balls of diameter γ d in `bounds`.
fn balls<const D: usize>(
    bounds: Bounds<D>,
    distance: &NominalDistance<D>,
    gamma: f64,
    expected: usize,
) -> Occupancy<D> {
    let slope = gamma * distance.greatest_slope();
    Occupancy::new(bounds, gamma * distance.least(), gamma * distance.greatest(), expected).smooth(
        slope,
        restart_room(gamma) / gamma,
        slope_of_a_step(distance),
    )
}

impl<const D: usize> Growth<'_, D> {
    fn snap(&self, p: Point<D>) -> Point<D> {
        let inverse = 1.0 / self.quantum; // exact, of a power of two
        p.map(|x| round(x * inverse) * self.quantum)
    }

    /// Adds an atom at `p`, where the nominal distance is `d`.
    fn add(&mut self, p: Point<D>, d: f64, freedom: u8) {
        self.occupancy.take(p, self.gamma * d);
        self.nominal.push(d);
        self.lattice.push(p, freedom, 1.0);
    }

    /// Adds an atom at `p` if a ball of diameter γ d is free there.
    fn try_to_add(&mut self, p: Point<D>, freedom: u8) {
        let d = self.place.distance.at(&p);
        if self.place.needs(&p, d) && self.occupancy.is_free(&p, self.gamma * d) {
            self.add(p, d, freedom);
        }
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
        let mut centre = self.snap(self.lattice.bounds.centre());
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
        let freedom = all_axes::<D>() & !(1 << normal);
        // Atoms of the opposite face, nearer than d in a thin box, do not count; nor do those beside.
        let on_face: Vec<usize> = (0..self.lattice.len())
            .filter(|&i| self.lattice.atoms[i][normal] == centre[normal])
            .collect();
        let mut flat = Bounds { min, max };
        (flat.min[normal], flat.max[normal]) = (centre[normal], centre[normal]);
        let plane = balls(flat, self.place.distance, self.gamma, on_face.len());
        let whole = std::mem::replace(&mut self.occupancy, plane);
        for i in (0..self.seeds).chain(on_face.iter().copied()) {
            self.occupancy.take(self.lattice.atoms[i], self.gamma * self.nominal[i]);
        }
        let first = self.lattice.len();
        self.try_to_add(centre, freedom);
        self.fill(first, &on_face, &steps, freedom, watch)?;
        self.occupancy = whole;
        for i in first..self.lattice.len() {
            self.occupancy.take(self.lattice.atoms[i], self.gamma * self.nominal[i]);
        }
        Ok(())
    }

    /// The inside of the box, from the seeds or the centre.
    fn interior(
        &mut self,
        crystal: &Crystal<D>,
        watch: &mut dyn Watch,
    ) -> Result<(), LatticeError> {
        let freedom = all_axes::<D>();
        let first = self.lattice.len();
        for s in 0..self.seeds {
            self.surround(s, crystal.neighbors(), freedom, self.gamma);
        }
        if self.lattice.len() == first {
            let centre = self.snap(self.lattice.bounds.centre());
            self.try_to_add(centre, freedom);
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
            self.surround(i, steps, freedom, restart_room(self.gamma));
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
        let (from, d) = (self.lattice.atoms[i], self.nominal[i]);
        let (least, greatest) = (d * (1.0 - self.unsure).max(0.0), d * (1.0 + self.unsure));
        for step in steps {
            let step = self.snap(step.map(|s| s * d));
            let site: Point<D> = std::array::from_fn(|k| from[k] + step[k]);
            let inside = (0..D).all(|k| {
                if freedom >> k & 1 == 1 { min[k] < site[k] && site[k] < max[k] } else { true }
            });
            if !inside {
                continue;
            }
            let own = self.gamma * d;
            // d is read at the site only where its atom's does not settle the matter
            let look = self.occupancy.look(&site, &(room * least..=room * greatest), own);
            if look == Look::Taken {
                continue;
            }
            let d = self.place.distance.at(&site);
            let test = room * d;
            let is_free =
                look == Look::Free || self.occupancy.look(&site, &(test..=test), own) == Look::Free;
            if is_free && self.place.needs(&site, d) {
                self.add(site, d, freedom);
            }
        }
    }
}

/// [`f64::round`], which calls a library on machines that need not have an instruction for it.
#[inline(always)]
fn round(x: f64) -> f64 {
    const WHOLE: f64 = (1_u64 << 52) as f64;
    let size = x.abs();
    // adding 2^52 leaves no fraction; a half may go down to an even number then
    let even = (size + WHOLE) - WHOLE;
    let rounded = if size - even == 0.5 { even + 1.0 } else { even };
    if size < WHOLE { rounded.copysign(x) } else { x }
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
