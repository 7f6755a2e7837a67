//! The slow reference for growth: algorithm 2 as it is written, each site tried against every atom there is.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::boundary::{Boundary, Place};
use super::grow::{GrowOptions, grow};
use super::occupancy::restart_room;
use super::{Crystal, Lattice};
use crate::fields::NominalDistance;
use crate::geometry::{Bounds, Point, all_axes, distance_squared};
use crate::image::Grid;
use crate::watch::Silent;

struct SlowGrowth<'a, const D: usize> {
    lattice: Lattice<D>,
    distance: &'a NominalDistance<D>,
    gamma: f64,
    quantum: f64,
    /// Atoms that take no part: those off the face that is being filled.
    hidden: Vec<bool>,
}

impl<const D: usize> SlowGrowth<'_, D> {
    fn try_site(&mut self, p: Point<D>, room: f64, freedom: u8) {
        let d = self.distance.at(&p);
        let free = self.lattice.atoms.iter().zip(&self.hidden).all(|(q, &hidden)| {
            let apart = 0.5 * (room * d + self.gamma * self.distance.at(q));
            hidden || distance_squared(&p, q) >= apart * apart * (1.0 - 1e-9)
        });
        if free {
            self.lattice.push(p, freedom, 1.0);
            self.hidden.push(false);
        }
    }

    fn surround(&mut self, i: usize, steps: &[Point<D>], room: f64, freedom: u8) {
        let Bounds { min, max } = self.lattice.bounds;
        let from = self.lattice.atoms[i];
        let d = self.distance.at(&from);
        for v in steps {
            let site =
                std::array::from_fn(|k| from[k] + (v[k] * d / self.quantum).round() * self.quantum);
            let inside = |k: usize| min[k] < site[k] && site[k] < max[k];
            if (0..D).all(|k| freedom >> k & 1 == 0 || inside(k)) {
                self.try_site(site, room, freedom);
            }
        }
    }

    fn fill(&mut self, first: usize, rim: &[usize], steps: &[Point<D>], freedom: u8) {
        let mut next = first;
        for turn in 0..=rim.len() {
            while next < self.lattice.len() {
                self.surround(next, steps, self.gamma, freedom);
                next += 1;
            }
            if let Some(&i) = rim.get(turn) {
                self.surround(i, steps, restart_room(self.gamma), freedom);
            }
        }
    }

    fn centre(&self) -> Point<D> {
        self.lattice.bounds.centre().map(|x| (x / self.quantum).round() * self.quantum)
    }

    fn face(&mut self, side: usize, seeds: usize) {
        let (normal, level) = (side / 2, self.lattice.bounds.level(side));
        let axes: Vec<usize> = (0..D).filter(|&k| k != normal).collect();
        let steps: Vec<Point<D>> = (Crystal::hexagonal().neighbors().iter())
            .map(|v| {
                std::array::from_fn(|k| axes.iter().position(|&a| a == k).map_or(0.0, |a| v[a]))
            })
            .collect();
        let on_face: Vec<usize> =
            (0..self.lattice.len()).filter(|&i| self.lattice.atoms[i][normal] == level).collect();
        let hidden = (0..self.lattice.len()).map(|i| i >= seeds && !on_face.contains(&i));
        self.hidden = hidden.collect();
        let first = self.lattice.len();
        let mut centre = self.centre();
        centre[normal] = level;
        let freedom = all_axes::<D>() & !(1 << normal);
        self.try_site(centre, self.gamma, freedom);
        self.fill(first, &on_face, &steps, freedom);
        self.hidden.fill(false);
    }
}

fn grown_slowly<const D: usize>(
    crystal: &Crystal<D>,
    bounds: Bounds<D>,
    distance: &NominalDistance<D>,
    options: &GrowOptions<D>,
) -> Lattice<D> {
    let boundary = Boundary::new(Place { bounds, distance, outline: None }).unwrap();
    let quantum = boundary.quantum;
    let lattice = boundary.plant_and_divide(&options.seed_points, &[]).unwrap();
    let seeds = lattice.atoms.iter().take_while(|p| options.seed_points.contains(p)).count();
    let hidden = vec![false; lattice.len()];
    let gamma = options.spacing_factor;
    let mut growth = SlowGrowth { lattice, distance, gamma, quantum, hidden };
    for side in 0..if D == 3 { 6 } else { 0 } {
        growth.face(side, seeds);
    }
    let (first, all) = (growth.lattice.len(), all_axes::<D>());
    for s in 0..seeds {
        growth.surround(s, crystal.neighbors(), gamma, all);
    }
    if growth.lattice.len() == first {
        growth.try_site(growth.centre(), gamma, all);
    }
    let rim: Vec<usize> = (0..first).collect();
    growth.fill(first, &rim, crystal.neighbors(), all);
    growth.lattice
}

/// d of one value, of a gentle slope, of steep bumps whose slope is limited to 0.45.
fn distance<const D: usize>(grid: &Grid<D>, kind: usize, random: &mut Pcg64) -> NominalDistance<D> {
    let least = 2.0 + 3.0 * random.random::<f64>();
    if kind == 0 {
        return NominalDistance::constant(grid, least).unwrap();
    }
    let mut field = vec![0f32; grid.sample_count()];
    for (i, d) in field.iter_mut().enumerate() {
        let bump = if random.random::<f32>() < 0.02 { 0.0 } else { 30.0 };
        let slope = 0.1 * (i % grid.shape[0]) as f32;
        *d = least as f32 + if kind == 1 { slope } else { bump };
    }
    NominalDistance::from_field(grid, &field, 0.45).unwrap()
}

fn fast_equals_slow<const D: usize>(crystals: &[Crystal<D>], longest: usize) {
    for seed in 0..24 {
        let mut random = Pcg64::seed_from_u64(seed);
        // thin boxes too
        let shape =
            std::array::from_fn(|_| 2 + (random.random::<f64>().powi(2) * longest as f64) as usize);
        let grid = Grid { shape, step: [1.0; D] };
        let distance = distance(&grid, seed as usize % 3, &mut random);
        let bounds = grid.bounds();
        let mut point = || bounds.extent().map(|e| e * random.random::<f64>());
        let options = GrowOptions {
            seed_points: (0..seed / 3 % 4).map(|_| point()).collect(),
            spacing_factor: [0.8, 0.6, 1.0, 0.3][seed as usize / 6],
        };
        let crystal = &crystals[seed as usize / 2 % crystals.len()];
        let fast = grow(crystal, bounds, &distance, &options, &mut Silent).unwrap();
        let slow = grown_slowly(crystal, bounds, &distance, &options);
        assert_eq!(fast.atoms, slow.atoms, "seed {seed}");
        assert_eq!(fast.freedom, slow.freedom, "seed {seed}");
    }
}

#[test]
fn fast_and_slow_growth_make_the_same_lattice_to_the_bit() {
    fast_equals_slow(&[Crystal::hexagonal()], 90);
    fast_equals_slow(&[Crystal::body_centered_cubic(), Crystal::face_centered_cubic()], 26);
}
