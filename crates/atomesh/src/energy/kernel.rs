//! The inner loop of the pairs engine.

use crate::geometry::Point;

use super::lanes::{Lanes, WIDTH};
use super::neighbors::List;
use super::pair;

/// Below any u² of two atoms that are not at one place; far enough above 0 that 1/d², up to 1e60, over it is finite.
const TINY: f64 = 1e-200;

/// What scales a pair's distance and energy.
pub(super) trait Scale {
    /// 1/d² and the weight 1 − β of the pairs of atom i with others.
    ///
    /// # Safety
    /// The others must be atoms.
    unsafe fn of<L: Lanes>(&self, i: usize, others: &[u32; WIDTH]) -> (L::Wide, L::Wide);
}

/// d and β the same everywhere.
pub(super) struct Uniform {
    pub inverse_squared: f64,
    pub weight: f64,
}

impl Scale for Uniform {
    #[inline(always)]
    unsafe fn of<L: Lanes>(&self, _: usize, _: &[u32; WIDTH]) -> (L::Wide, L::Wide) {
        (L::splat(self.inverse_squared), L::splat(self.weight))
    }
}

/// d, and β where there are weights, from atom to atom.
pub(super) struct Graded<'a> {
    /// d at every atom.
    pub distances: &'a [f64],
    /// 1 − β where there are no weights.
    pub weight: f64,
    /// β at every atom, or nothing.
    pub weights: &'a [f64],
}

impl Scale for Graded<'_> {
    #[inline(always)]
    unsafe fn of<L: Lanes>(&self, i: usize, others: &[u32; WIDTH]) -> (L::Wide, L::Wide) {
        // SAFETY: there are as many distances, and as many weights or none, as atoms.
        let sum = |all: &[f64]| L::add(L::splat(all[i]), unsafe { L::pick(all, others) });
        let mut weight = L::splat(self.weight);
        if !self.weights.is_empty() {
            weight = L::sub(L::splat(1.0), L::mul(L::splat(0.5), sum(self.weights)));
        }
        let inverse = L::div(L::splat(2.0), sum(self.distances));
        (L::mul(inverse, inverse), weight)
    }
}

/// Some atoms of a chunk.
pub(super) struct Members<'a> {
    pub atoms: &'a [u32],
    /// The list of each.
    pub lists: &'a [List],
    /// The neighbours of all lists of the chunk.
    pub neighbors: &'a [u32],
}

/// ∂A/∂x of some atoms, added to `slopes`; returns their energy, a pair's half to either.
#[inline(always)]
pub(super) fn add_pairs<L: Lanes, S: Scale, const D: usize>(
    atoms: &[Point<D>],
    members: Members<'_>,
    scale: &S,
    slopes: &mut [Point<D>],
) -> f64 {
    let mut energy = 0.0;
    for ((slope, &i), list) in slopes.iter_mut().zip(members.atoms).zip(members.lists) {
        let others = members.neighbors[list.start as usize..][..list.padded()].as_chunks().0;
        let i = i as usize;
        let atom = Atom::<L, S, D> { atoms, i, at: atoms[i].map(L::splat), scale };
        let (pairs, pull) = atom.sum(others, list.surplus());
        energy += 0.5 * pairs;
        (0..D).for_each(|k| slope[k] += pull[k]);
    }
    energy
}

/// An atom whose pairs are summed.
struct Atom<'a, L: Lanes, S, const D: usize> {
    atoms: &'a [Point<D>],
    /// Its number.
    i: usize,
    /// Where it is.
    at: [L::Wide; D],
    scale: &'a S,
}

impl<L: Lanes, S: Scale, const D: usize> Atom<'_, L, S, D> {
    /// Σ w φ(r/d) over its pairs with others, and the gradient Σ w f(r/d)/(d r) v: [`WIDTH`] of them side by
    /// side, without a branch on the cut-off; the last `surplus` others do not count.
    #[inline(always)]
    fn sum(&self, others: &[[u32; WIDTH]], surplus: usize) -> (f64, Point<D>) {
        let mut sums = [L::splat(0.0); WIDTH];
        if let Some((last, whole)) = others.split_last() {
            let all = L::splat(pair::CUTOFF);
            for others in whole {
                self.add_block(others, all, &mut sums);
            }
            self.add_block(last, L::wide(CUTOFFS[surplus]), &mut sums);
        }
        let [energy, pull @ ..] = L::totals(sums);
        (energy, std::array::from_fn(|k| pull[k]))
    }

    /// Adds the energy of its pairs with some others, and the gradient, to `sums`.
    #[inline(always)]
    fn add_block(&self, others: &[u32; WIDTH], cutoff: L::Wide, sums: &mut [L::Wide; WIDTH]) {
        // SAFETY: lists hold indices of atoms.
        let (columns, (inverse_squared, weight)) =
            unsafe { (L::columns(self.atoms, others), self.scale.of::<L>(self.i, others)) };
        let v: [L::Wide; D] = std::array::from_fn(|k| L::sub(columns[k], self.at[k]));
        let mut r_squared = L::mul(v[0], v[0]);
        for v in &v[1..] {
            r_squared = L::add(r_squared, L::mul(*v, *v));
        }
        let u_squared = L::mul(r_squared, inverse_squared);
        let u = L::sqrt(u_squared);
        let phi = energy_inside::<L>(u, u_squared);
        sums[0] = L::add(sums[0], L::where_less(u, cutoff, L::mul(weight, phi)));
        // two atoms at one place push nowhere: v is 0
        let scale = L::div(L::mul(weight, inverse_squared), L::max(u_squared, L::splat(TINY)));
        let force = L::mul(u, force_inside::<L>(u, u_squared));
        let slope = L::where_less(u, cutoff, L::mul(scale, force));
        for k in 0..D {
            sums[1 + k] = L::add(sums[1 + k], L::mul(slope, v[k]));
        }
    }
}

/// The cut-off where none, one … of the last lanes do not count.
const CUTOFFS: [[f64; WIDTH]; WIDTH] = {
    let mut cutoffs = [[pair::CUTOFF; WIDTH]; WIDTH];
    let mut surplus = 0;
    while surplus < WIDTH {
        let mut lane = WIDTH - surplus;
        while lane < WIDTH {
            cutoffs[surplus][lane] = -1.0;
            lane += 1;
        }
        surplus += 1;
    }
    cutoffs
};

/// φ(u) inside the cut-off: [`pair::energy`], side by side.
#[inline(always)]
fn energy_inside<L: Lanes>(u: L::Wide, u_squared: L::Wide) -> L::Wide {
    let c = L::splat;
    let inner = L::sub(c(19.0 / 24.0), L::mul(c(5.0 / 16.0), u));
    let outer = L::sub(L::mul(u_squared, inner), c(9.0 / 8.0));
    L::add(c(pair::SELF_ENERGY), L::mul(u, outer))
}

/// f(u) inside the cut-off: [`pair::force`], side by side.
#[inline(always)]
fn force_inside<L: Lanes>(u: L::Wide, u_squared: L::Wide) -> L::Wide {
    let c = L::splat;
    let inner = L::sub(L::mul(c(5.0 / 4.0), u), c(19.0 / 8.0));
    L::add(c(9.0 / 8.0), L::mul(u_squared, inner))
}

#[cfg(test)]
mod tests {
    use super::super::lanes::Plain;
    use super::*;

    #[test]
    fn lanes_hold_the_pair_potential() {
        for i in 0..150 {
            let u = 0.01 * f64::from(i);
            let (lanes, squares) = ([u; WIDTH], [u * u; WIDTH]);
            // the same polynomials, in another order of roundings: some 2⁻⁵³ of terms up to 5
            assert!((energy_inside::<Plain>(lanes, squares)[0] - pair::energy(u)).abs() < 4e-15);
            assert!((force_inside::<Plain>(lanes, squares)[0] - pair::force(u)).abs() < 4e-15);
        }
    }
}
