//! Which places are taken: atoms as balls that must not overlap.

use std::ops::RangeInclusive;

use crate::geometry::{Bounds, Point, distance_squared};

/// Balls around atoms, of diameter γ d, that do not overlap.
///
/// Stands for the paper's flags w(x) on image samples (algorithm 2), without their dependence on the
/// sampling: a place is free if its ball meets no other. Balls of like size share a level of cells.
/// Where diameters are known to vary smoothly, each ball is kept on every level whose balls it can
/// meet, so that one level answers for a place; else on its own level, and all are asked.
pub(super) struct Occupancy<const D: usize> {
    bounds: Bounds<D>,
    /// Diameters of level l are in `least·2^l .. least·2^(l+1)`.
    least: f64,
    greatest: f64,
    levels: Vec<Level<D>>,
    smooth: Option<Smooth>,
}

/// How far the diameters of two balls that meet can differ.
///
/// A ball that may be put at a place has diameter D; the place is tested with κ D ≥ D. It meets a ball
/// of diameter E at r < (κ D + E)/2, where |D − E| ≤ S r. So E is within D's share `low..=high`.
#[derive(Clone, Copy)]
struct Smooth {
    /// The least and the greatest E/D.
    low: f64,
    high: f64,
}

/// What a look at a place finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Look {
    /// A ball of any of the diameters meets no other.
    Free,
    /// One of the least meets no other, but one of the greatest may.
    Unsure,
    /// A ball of the least diameter meets another.
    Taken,
}

const NONE: u32 = u32::MAX;

/// Bounds are widened by this share, so that no rounding hides a ball.
const SLACK: f64 = 1e-6;

#[derive(Clone, Copy)]
struct Ball<const D: usize> {
    center: Point<D>,
    diameter: f64,
    /// The next ball of the same cell, or `NONE`.
    next: u32,
}

struct Level<const D: usize> {
    /// The greatest diameter of the balls that it is asked for.
    greatest: f64,
    inverse_width: f64,
    shape: [usize; D],
    /// How far apart in `heads` neighbouring cells along each axis are.
    strides: [usize; D],
    heads: Vec<u32>,
    balls: Vec<Ball<D>>,
}

impl<const D: usize> Occupancy<D> {
    /// Room for balls with diameters from `least` to `greatest`; `expected` is about their number.
    pub fn new(bounds: Bounds<D>, least: f64, greatest: f64, expected: usize) -> Self {
        let count = (greatest / least).log2().floor().max(0.0) as usize + 1;
        let levels = (0..count)
            .map(|l| Level::new(&bounds, (least * 2f64.powi(l as i32 + 1)).min(greatest), expected))
            .collect();
        Self { bounds, least, greatest, levels, smooth: None }
    }

    /// The same, where the diameters of two balls differ by at most `slope` times the distance of their
    /// centres, places are tested with at most `wide` times the diameter of the ball to put there, and
    /// that differs from `own` (see [`Self::look`]) by at most the share `unsure`.
    pub fn smooth(mut self, slope: f64, wide: f64, unsure: f64) -> Self {
        let (half, half_wide) = (0.5 * slope, 0.5 * slope * wide);
        if half < 1.0 && half_wide < 1.0 && unsure < 1.0 {
            let low = (1.0 - half_wide) / (1.0 + half) * (1.0 - unsure);
            let high = (1.0 + half_wide) / (1.0 - half) * (1.0 + unsure);
            self.smooth = Some(Smooth { low: low * (1.0 - SLACK), high: high * (1.0 + SLACK) });
        }
        self
    }

    /// Whether a ball of this diameter at `p` meets no other.
    pub fn is_free(&self, p: &Point<D>, diameter: f64) -> bool {
        self.look(p, &(diameter..=diameter), diameter) == Look::Free
    }

    /// Whether a ball at `p` whose diameter is within `tests` meets another; `own` is the diameter of a
    /// ball to be put near there.
    pub fn look(&self, p: &Point<D>, tests: &RangeInclusive<f64>, own: f64) -> Look {
        let offset = std::array::from_fn(|k| p[k] - self.bounds.min[k]);
        let look = |level: &Level<D>, other: f64| {
            level.look(p, &offset, tests, 0.5 * (tests.end() + other.min(self.greatest)))
        };
        match self.smooth {
            Some(smooth) => look(&self.levels[self.level_of(own)], smooth.high * own),
            None => (self.levels.iter()).map(|l| look(l, l.greatest)).max().unwrap_or(Look::Free),
        }
    }

    /// Takes the place, free or not.
    pub fn take(&mut self, p: Point<D>, diameter: f64) {
        let offset = std::array::from_fn(|k| p[k] - self.bounds.min[k]);
        let (first, last) = match self.smooth {
            Some(Smooth { low, high }) => (diameter / high, diameter / low),
            None => (diameter, diameter),
        };
        for l in self.level_of(first)..=self.level_of(last) {
            self.levels[l].put(&offset, Ball { center: p, diameter, next: NONE });
        }
    }

    fn level_of(&self, diameter: f64) -> usize {
        // the floor of the logarithm of a number above 1 is its exponent
        let exponent = ((diameter / self.least).max(1.0).to_bits() >> 52) as usize - 1023;
        exponent.min(self.levels.len() - 1)
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
        let mut cells = 1;
        let strides = shape.map(|n| {
            cells *= n;
            cells / n
        });
        Self {
            greatest: diameter,
            inverse_width: cell.recip(),
            shape,
            strides,
            heads: vec![NONE; cells],
            balls: Vec::new(),
        }
    }

    #[inline(always)]
    fn along(&self, x: f64, k: usize) -> usize {
        // a cast takes what is negative to 0
        ((x * self.inverse_width) as usize).min(self.shape[k] - 1)
    }

    fn cell(&self, offset: &Point<D>) -> usize {
        (0..D).map(|k| self.along(offset[k], k) * self.strides[k]).sum()
    }

    fn put(&mut self, offset: &Point<D>, mut ball: Ball<D>) {
        let cell = self.cell(offset);
        ball.next = self.heads[cell];
        self.heads[cell] = self.balls.len() as u32;
        self.balls.push(ball);
    }

    /// See [`Occupancy::look`], at the balls of one cell.
    #[inline(always)]
    fn look_at(&self, cell: usize, p: &Point<D>, tests: &RangeInclusive<f64>) -> Look {
        let mut seen = Look::Free;
        let mut at = self.heads[cell];
        while at != NONE {
            let ball = &self.balls[at as usize];
            let apart = distance_squared(p, &ball.center);
            let meets = |test: f64| {
                let least = 0.5 * (test + ball.diameter);
                // sites of one crystal touch at γ = 1: a rounding must not part them
                apart < least * least * (1.0 - 1e-9)
            };
            if meets(*tests.end()) {
                if meets(*tests.start()) {
                    return Look::Taken;
                }
                seen = Look::Unsure;
            }
            at = ball.next;
        }
        seen
    }

    /// See [`Occupancy::look`]; balls are met within `reach` only.
    fn look(
        &self,
        p: &Point<D>,
        offset: &Point<D>,
        tests: &RangeInclusive<f64>,
        reach: f64,
    ) -> Look {
        // sites that are taken are mostly taken by an atom just there
        if self.balls.is_empty() || self.look_at(self.cell(offset), p, tests) == Look::Taken {
            return if self.balls.is_empty() { Look::Free } else { Look::Taken };
        }
        let low: [usize; D] = std::array::from_fn(|k| self.along(offset[k] - reach, k));
        let high: [usize; D] = std::array::from_fn(|k| self.along(offset[k] + reach, k));
        let mut row: usize = (0..D).map(|k| low[k] * self.strides[k]).sum();
        let mut index = low;
        let mut seen = Look::Free;
        loop {
            for cell in row..=row + high[0] - low[0] {
                seen = seen.max(self.look_at(cell, p, tests));
                if seen == Look::Taken {
                    return seen;
                }
            }
            let Some(k) = (1..D).find(|&k| index[k] < high[k]) else { return seen };
            for j in 1..k {
                row -= (index[j] - low[j]) * self.strides[j];
                index[j] = low[j];
            }
            index[k] += 1;
            row += self.strides[k];
        }
    }
}

/// Where growth starts again from the boundary, a site must be this far from other atoms, over d: holes in a
/// crystal are smaller, so that where growth has passed little is added.
const RESTART: f64 = 0.85;

/// The diameter, over d, of the ball that must be free for an atom to be added from the boundary.
pub(super) fn restart_room(gamma: f64) -> f64 {
    (2.0 * RESTART - gamma).max(gamma)
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
