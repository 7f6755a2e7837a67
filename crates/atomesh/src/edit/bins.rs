//! Atoms by the part of the box that they are in, so that those near a place are found without asking all.

use crate::geometry::{Bounds, Point};

/// Atoms in a bin, about, when the bins are made.
const ATOMS_PER_BIN: f64 = 4.0;

/// Cubes over a box, each with a list of atoms; a place beyond the box counts to the nearest cube.
#[derive(Clone, Debug)]
pub(super) struct AtomBins<const D: usize> {
    min: Point<D>,
    inverse_width: f64,
    shape: [usize; D],
    bins: Vec<Vec<u32>>,
}

impl<const D: usize> AtomBins<D> {
    /// Bins of atoms 0, 1, 2 …
    pub fn new(bounds: &Bounds<D>, atoms: &[Point<D>]) -> Self {
        let room = bounds.measure() * ATOMS_PER_BIN / atoms.len().max(1) as f64;
        let inverse_width = room.powf(-1.0 / D as f64);
        let shape = bounds.extent().map(|extent| (extent * inverse_width) as usize + 1);
        let bins = vec![Vec::new(); shape.iter().product()];
        let mut bins = Self { min: bounds.min, inverse_width, shape, bins };
        atoms.iter().zip(0..).for_each(|(p, atom)| bins.insert(atom, p));
        bins
    }

    /// Adds an atom.
    pub fn insert(&mut self, atom: u32, at: &Point<D>) {
        let bin = self.number(&self.bin(at));
        self.bins[bin].push(atom);
    }

    /// Takes an atom out that is at this place.
    pub fn remove(&mut self, atom: u32, at: &Point<D>) {
        let bin = self.number(&self.bin(at));
        self.bins[bin].retain(|&other| other != atom);
    }

    /// All atoms within `reach` of a place along every axis, and some more, ascending: whatever edits led here.
    pub fn near(&self, p: &Point<D>, reach: f64) -> Vec<u32> {
        let (low, high) = (self.bin(&p.map(|x| x - reach)), self.bin(&p.map(|x| x + reach)));
        let counts: [usize; D] = std::array::from_fn(|k| high[k] - low[k] + 1);
        let mut atoms = Vec::new();
        for code in 0..counts.iter().product() {
            let mut rest = code;
            let bin = std::array::from_fn(|k| {
                let offset = rest % counts[k];
                rest /= counts[k];
                low[k] + offset
            });
            atoms.extend_from_slice(&self.bins[self.number(&bin)]);
        }
        atoms.sort_unstable();
        atoms
    }

    /// The bin of a place, along each axis.
    fn bin(&self, p: &Point<D>) -> [usize; D] {
        std::array::from_fn(|k| {
            // a cast takes what is negative to 0
            (((p[k] - self.min[k]) * self.inverse_width) as usize).min(self.shape[k] - 1)
        })
    }

    fn number(&self, bin: &[usize; D]) -> usize {
        (0..D).rev().fold(0, |number, k| number * self.shape[k] + bin[k])
    }
}
