//! The lattice's energy as a function of free variables.

use crate::parallel::prelude::*;

use crate::energy::{Energy, Engine};
use crate::geometry::{Bounds, Point};
use crate::lattice::Lattice;
use crate::minimize::Objective;
use crate::watch::AtomsView;

/// An [`Objective`] whose variables are the atoms' coordinates.
///
/// What the box or a temperature of 0 holds has gradient 0 and so never moves. A temperature T between
/// scales its variables: with x = x₀ + T (z − x₀) the gradient by z is T times that by x.
pub(super) struct LatticeEnergy<'e, const D: usize> {
    lattice: Lattice<D>,
    engine: Box<dyn Engine<D> + 'e>,
    margin: f64,
    /// The farthest an atom may go in any iteration, over its nominal distance.
    longest_move: f64,
    /// The farthest it may go in the next one: at most twice the last move, since moves shrink towards a
    /// minimum and the engine need not be ready for more.
    next_move: f64,
    /// The farthest that the last direction moves an atom, over its nominal distance.
    reach: f64,
    /// dx/dz of each variable, 0…1.
    mobility: Vec<f32>,
    /// The atoms at x, if some mobility is neither 0 nor 1, so that x differs from z.
    atoms: Option<Vec<Point<D>>>,
    /// As of the last evaluation.
    energy: Energy,
}

impl<'e, const D: usize> LatticeEnergy<'e, D> {
    pub fn new(
        lattice: Lattice<D>,
        mut engine: Box<dyn Engine<D> + 'e>,
        margin: f64,
        longest_move: f64,
    ) -> Self {
        let mobility: Vec<f32> =
            (0..lattice.len() * D).map(|v| lattice.mobility(v / D, v % D) as f32).collect();
        engine.prepare(lattice.atoms(), longest_move);
        let is_tempered = mobility.iter().any(|&m| m != 0.0 && m != 1.0);
        let atoms = is_tempered.then(|| lattice.atoms().to_vec());
        Self {
            lattice,
            engine,
            margin,
            longest_move,
            next_move: longest_move,
            reach: 0.0,
            mobility,
            atoms,
            energy: Energy::default(),
        }
    }

    /// The variables of the lattice as it was given.
    pub fn start(&mut self) -> Vec<f64> {
        self.lattice.atoms().as_flattened().to_vec()
    }

    pub fn distances(&self) -> &[f64] {
        self.engine.distances()
    }

    pub fn least_distance(&self) -> f64 {
        self.distances().iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Puts back every variable that may not move.
    pub fn hold(&self, z: &mut [f64]) {
        let start = self.lattice.atoms().as_flattened();
        for ((z, &x), &m) in z.iter_mut().zip(start).zip(&self.mobility) {
            if m == 0.0 {
                *z = x;
            }
        }
    }

    /// Readies the engine for a first iteration from `z`; returns whether the energy has become another
    /// function.
    pub fn prepare(&mut self, z: &[f64]) -> bool {
        self.prepare_for(z, self.longest_move)
    }

    /// Readies the engine for the iteration after one that went `last_step` times its direction.
    pub fn prepare_after(&mut self, z: &[f64], last_step: f64) -> bool {
        self.prepare_for(z, (2.0 * last_step * self.reach).min(self.longest_move))
    }

    fn prepare_for(&mut self, z: &[f64], next_move: f64) -> bool {
        self.next_move = next_move;
        self.place(z);
        let atoms = self.atoms.as_deref().unwrap_or(z.as_chunks().0);
        self.engine.prepare(atoms, next_move)
    }

    /// The energy at `z`, d and β read there, for the report.
    pub fn evaluate_at(&mut self, z: &[f64]) -> Energy {
        let mut gradient = vec![[0.0; D]; z.len() / D];
        self.place(z);
        let atoms = self.atoms.as_deref().unwrap_or(z.as_chunks().0);
        self.engine.prepare(atoms, 1.0); // farther than any list reaches, so that all is read again
        self.engine.evaluate(atoms, &mut gradient)
    }

    /// The lattice with its atoms at `z`.
    pub fn into_lattice(mut self, z: &[f64]) -> Lattice<D> {
        self.place(z);
        let atoms = self.atoms.unwrap_or_else(|| z.as_chunks().0.to_vec());
        self.lattice.moved_to(atoms)
    }

    /// What a watch may see where the last evaluation was, at `z`.
    pub fn view<'z>(&'z self, z: &'z [f64]) -> AtomsView<'z> {
        AtomsView {
            dimension: D,
            coordinates: self.atoms.as_ref().map_or(z, |atoms| atoms.as_flattened()),
            distances: self.engine.distances(),
            energy_atomic: self.energy.atomic,
            energy_image: self.energy.image,
        }
    }

    /// Puts the atoms where the variables say, where these are not their coordinates.
    fn place(&mut self, z: &[f64]) {
        let Some(atoms) = &mut self.atoms else { return };
        let start = self.lattice.atoms().as_flattened();
        let x = atoms.as_flattened_mut();
        for v in 0..z.len() {
            x[v] = start[v] + f64::from(self.mobility[v]) * (z[v] - start[v]);
        }
    }

    /// The part of the box that an atom of nominal distance `d` may be in.
    fn room(&self, d: f64) -> Bounds<D> {
        let Bounds { min, max } = *self.lattice.bounds();
        let inset = |k: usize| (self.margin * d).min(0.5 * (max[k] - min[k]));
        Bounds {
            min: std::array::from_fn(|k| min[k] + inset(k)),
            max: std::array::from_fn(|k| (max[k] - inset(k)).max(min[k] + inset(k))),
        }
    }
}

/// Atoms that one thread works on at a time.
const CHUNK: usize = 2048;

impl<const D: usize> Objective for LatticeEnergy<'_, D> {
    fn evaluate(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
        self.place(z);
        let atoms = self.atoms.as_deref().unwrap_or(z.as_chunks().0);
        let slopes = gradient.as_chunks_mut::<D>().0;
        self.energy = self.engine.evaluate(atoms, slopes);
        let (z, mobility) = (z.as_chunks::<D>().0, self.mobility.as_chunks::<D>().0);
        let distances = self.engine.distances();
        let this = &*self;
        slopes.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(i, slope)| {
            let room = this.room(distances[i]);
            for k in 0..D {
                let outward = (z[i][k] <= room.min[k] && slope[k] > 0.0)
                    || (z[i][k] >= room.max[k] && slope[k] < 0.0);
                slope[k] = if outward { 0.0 } else { slope[k] * f64::from(mobility[i][k]) };
            }
        });
        self.energy.total()
    }

    fn longest_step(&mut self, direction: &[f64]) -> f64 {
        let greatest = direction
            .as_chunks::<D>()
            .0
            .par_iter()
            .zip(self.distances())
            .with_min_len(CHUNK)
            .map(|(p, d)| p.iter().map(|x| x * x).sum::<f64>() / (d * d))
            .reduce(|| 0.0, f64::max); // a maximum is the same in any order
        self.reach = greatest.sqrt();
        if self.reach > 0.0 { self.next_move / self.reach } else { f64::INFINITY }
    }

    fn shorten(&mut self, direction: &mut [f64]) {
        let (limit, distances) = (self.next_move, self.engine.distances());
        direction
            .as_chunks_mut::<D>()
            .0
            .par_iter_mut()
            .zip(distances)
            .with_min_len(CHUNK)
            .for_each(|(p, d)| {
                let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
                if length > limit * d {
                    p.iter_mut().for_each(|x| *x *= limit * d / length);
                }
            });
    }

    fn confine(&self, z: &mut [f64]) {
        let mobility = self.mobility.as_chunks::<D>().0;
        let distances = self.distances();
        z.as_chunks_mut::<D>().0.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(
            |(i, atom)| {
                let room = self.room(distances[i]);
                for k in 0..D {
                    if mobility[i][k] > 0.0 {
                        atom[k] = atom[k].clamp(room.min[k], room.max[k]);
                    }
                }
            },
        );
    }
}
