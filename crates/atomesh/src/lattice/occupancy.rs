//! Which places are taken: atoms as balls that must not overlap.

use crate::geometry::{Bounds, Point, distance_squared};

/// Balls around atoms, of diameter γ d, that do not overlap.
///
/// Stands for the paper's flags w(x) on image samples (algorithm 2), without their dependence on the
/// sampling: a place is free if its ball meets no other. Balls of like size share a level of cells.
pub(super) struct Occupancy<const D: usize> {
    bounds: Bounds<D>,
    /// Diameters of level l are in `least·2^l .. least·2^(l+1)`.
    least: f64,
    levels: Vec<Level<D>>,
    centers: Vec<Point<D>>,
    diameters: Vec<f64>,
    /// The next ball of the same cell, or `NONE`.
    next: Vec<u32>,
}

const NONE: u32 = u32::MAX;

struct Level<const D: usize> {
    /// The greatest diameter of its balls.
    greatest: f64,
    width: f64,
    shape: [usize; D],
    heads: Vec<u32>,
    used: bool,
}

impl<const D: usize> Occupancy<D> {
    /// Room for balls with diameters from `least` to `greatest`; `expected` is about their number.
    pub fn new(bounds: Bounds<D>, least: f64, greatest: f64, expected: usize) -> Self {
        let count = (greatest / least).log2().floor().max(0.0) as usize + 1;
        let levels = (0..count)
            .map(|l| Level::new(&bounds, (least * 2f64.powi(l as i32 + 1)).min(greatest), expected))
            .collect();
        Self { bounds, least, levels, centers: Vec::new(), diameters: Vec::new(), next: Vec::new() }
    }

    /// Whether a ball of this diameter at `p` meets no other.
    pub fn is_free(&self, p: &Point<D>, diameter: f64) -> bool {
        let offset = std::array::from_fn(|k| p[k] - self.bounds.min[k]);
        self.levels.iter().filter(|level| level.used).all(|level| {
            let reach = 0.5 * (diameter + level.greatest);
            level.all_near(&offset, reach, |head| {
                let mut at = head;
                while at != NONE {
                    let i = at as usize;
                    let apart = 0.5 * (diameter + self.diameters[i]);
                    // sites of one crystal touch at γ = 1: a rounding must not part them
                    if distance_squared(p, &self.centers[i]) < apart * apart * (1.0 - 1e-9) {
                        return false;
                    }
                    at = self.next[i];
                }
                true
            })
        })
    }

    /// Takes the place, free or not.
    pub fn take(&mut self, p: Point<D>, diameter: f64) {
        let l = (diameter / self.least).log2().floor().max(0.0) as usize;
        let last = self.levels.len() - 1;
        let level = &mut self.levels[l.min(last)];
        level.used = true;
        let head = level.cell_mut(std::array::from_fn(|k| p[k] - self.bounds.min[k]));
        self.next.push(*head);
        *head = self.centers.len() as u32;
        self.centers.push(p);
        self.diameters.push(diameter);
    }
}

impl<const D: usize> Level<D> {
    fn new(bounds: &Bounds<D>, diameter: f64, expected: usize) -> Self {
        // Where balls this small would need more cells than there are atoms, cells hold several.
        let limit = 4.0 * expected as f64 + 1e5;
        let extent = bounds.extent();
        let mut cell = diameter;
        while extent.iter().map(|e| (e / cell).floor() + 1.0).product::<f64>() > limit {
            cell *= 1.25;
        }
        let shape = extent.map(|e| (e / cell) as usize + 1);
        Self {
            greatest: diameter,
            width: cell,
            shape,
            heads: vec![NONE; shape.iter().product()],
            used: false,
        }
    }

    fn along(&self, x: f64, k: usize) -> usize {
        ((x / self.width).max(0.0) as usize).min(self.shape[k] - 1)
    }

    fn cell_mut(&mut self, offset: Point<D>) -> &mut u32 {
        let index = (0..D).rev().fold(0, |i, k| i * self.shape[k] + self.along(offset[k], k));
        &mut self.heads[index]
    }

    /// Whether `test` holds for the lists of all cells within reach.
    fn all_near(&self, offset: &Point<D>, reach: f64, test: impl Fn(u32) -> bool) -> bool {
        let low: [usize; D] = std::array::from_fn(|k| self.along(offset[k] - reach, k));
        let high: [usize; D] = std::array::from_fn(|k| self.along(offset[k] + reach, k));
        let mut index = low;
        loop {
            let cell = (0..D).rev().fold(0, |i, k| i * self.shape[k] + index[k]);
            if !test(self.heads[cell]) {
                return false;
            }
            let Some(k) = (0..D).find(|&k| index[k] < high[k]) else { return true };
            index[k] += 1;
            index[..k].copy_from_slice(&low[..k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg32;

    use super::*;

    #[test]
    fn a_place_is_free_when_no_ball_overlaps() {
        for seed in 0..5 {
            let mut random = Pcg32::seed_from_u64(seed);
            let bounds = Bounds { min: [0.0; 3], max: [20.0; 3] };
            let mut occupancy = Occupancy::new(bounds, 0.5, 6.0, 400);
            let mut balls: Vec<(Point<3>, f64)> = Vec::new();
            for _ in 0..2000 {
                let p = std::array::from_fn(|_| 20.0 * random.random::<f64>());
                let diameter = 0.5 + 5.5 * random.random::<f64>().powi(2);
                let free = balls
                    .iter()
                    .all(|(q, e)| distance_squared(&p, q).sqrt() >= 0.5 * (diameter + e));
                assert_eq!(occupancy.is_free(&p, diameter), free, "seed {seed}");
                if free {
                    occupancy.take(p, diameter);
                    balls.push((p, diameter));
                }
            }
            assert!(balls.len() > 100);
        }
    }
}
