//! Growing a lattice outward from a seed (Hale 2001, algorithm 2), boundary first.
//!
//! Assumes d(x) is smooth, |∇d| ≪ 1. Corners, then edges of the box, divided evenly in ∫dx/d; then, in
//! space, its faces, grown as hexagonal crystals from their centres, each as if the others were not there;
//! then the interior from the seeds, or from the centre, as the wanted crystal. Visits atoms breadth
//! first, tries their ideal neighbour sites in crystal order, and takes a site if the ball of diameter
//! γ d around it is free. Where growth could not pass, because the box is narrower than d there, it starts
//! again from the boundary. Coordinates are snapped to binary fractions, so that a perfect crystal stays
//! perfect. Cost: O(atoms). Deterministic.

use crate::fields::NominalDistance;
use crate::geometry::{Bounds, Point, all_axes};
use crate::mesh::MOST_POINTS;
use crate::region::Outline;
use crate::watch::{Phase, Watch, check};

use super::boundary::{Boundary, Place};
use super::crystal::Crystal;
use super::occupancy::{Look, Occupancy, restart_room};
use super::plant::plant;
use super::{Lattice, LatticeError};

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
        Some(outline) => {
            let fixed = boundary.fixed(&options.seed_points);
            plant(outline, distance, gamma, &fixed, watch)?
        }
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
        growth.face(face, watch)?;
    }
    growth.interior(crystal, watch)?;
    Ok(growth.lattice)
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

    /// One side of a box in space.
    fn face(&mut self, side: usize, watch: &mut dyn Watch) -> Result<(), LatticeError> {
        let normal = side / 2;
        let axes: Vec<usize> = (0..D).filter(|&k| k != normal).collect();
        let mut centre = self.snap(self.lattice.bounds.centre());
        centre[normal] = self.lattice.bounds.level(side);
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
        let mut flat = self.lattice.bounds;
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
            // d is read at the site only where the atom's own d does not decide
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
