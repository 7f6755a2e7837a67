//! Energy and gradient of all atoms, from their lists: chunk by chunk, each atom gathering its own sum.

use crate::parallel::prelude::*;

use crate::fields::HeldCell;
use crate::geometry::Point;

use super::PairsEngine;
use crate::energy::Energy;
use crate::energy::kernel::{Graded, Members, Scale, Uniform, add_pairs};
use crate::energy::lanes::{self, Lanes, Plain};
use crate::energy::neighbors::{CHUNK, Chunk};

/// Atoms per batch; the next batch's samples are prefetched.
const BATCH: usize = 8;

/// What belongs to the atoms of one chunk.
pub(super) struct Own<'a, const D: usize> {
    /// Their gradient.
    pub slopes: &'a mut [Point<D>],
    /// The samples around them.
    pub held: &'a mut [HeldCell],
}

impl<const D: usize> PairsEngine<'_, D> {
    /// Energy and gradient of one chunk of atoms, each gathering over its own list.
    #[inline(always)]
    pub(super) fn gather<L: Lanes>(&self, atoms: &[Point<D>], c: usize, own: Own<'_, D>) -> Energy {
        match (self.fields.distance.is_constant(), self.fields.weight.as_constant()) {
            (true, Some(beta)) => {
                let inverse_squared = self.fields.distance.least().powi(-2);
                let scale = Uniform { inverse_squared, weight: 1.0 - beta };
                self.gather_with::<L, _>(atoms, c, &scale, own)
            }
            (_, beta) => {
                let (distances, weights) = (&self.distances[..], &self.weights[..]);
                let scale = Graded { distances, weight: 1.0 - beta.unwrap_or(0.0), weights };
                self.gather_with::<L, _>(atoms, c, &scale, own)
            }
        }
    }

    /// The same, batch by batch: while the pairs of one are summed, memory brings the next one's samples.
    #[inline(always)]
    fn gather_with<L: Lanes, S: Scale>(
        &self,
        atoms: &[Point<D>],
        c: usize,
        scale: &S,
        own: Own<'_, D>,
    ) -> Energy {
        let Own { slopes, held } = own;
        let members = &self.order[c * CHUNK..][..slopes.len()];
        let Chunk { lists, neighbors } = &self.lists.chunks[c];
        let has_image = self.fields.weight.as_constant() != Some(0.0);
        let prefetch = |held: &[HeldCell], first: usize| {
            let batch = members.iter().zip(held).skip(first).take(BATCH);
            batch.for_each(|(&i, held)| self.fields.potential.prefetch(&atoms[i as usize], held));
        };
        if has_image {
            prefetch(held, 0);
        }
        let mut energy = Energy::default();
        for (batch, slopes) in slopes.chunks_mut(BATCH).enumerate() {
            let (first, end) = (batch * BATCH, batch * BATCH + slopes.len());
            let these = &members[first..end];
            if has_image {
                prefetch(held, end);
                energy.image += self.image_part(atoms, these, &mut held[first..end], slopes);
            } else {
                slopes.fill([0.0; D]);
            }
            let these = Members { atoms: these, lists: &lists[first..end], neighbors };
            energy.atomic += add_pairs::<L, _, D>(atoms, these, scale, slopes);
        }
        energy
    }

    /// The same with wider registers. The operations are the same, in the same order, each rounded once,
    /// so the result is the same to the last bit.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,popcnt")]
    fn gather_avx2(&self, atoms: &[Point<D>], c: usize, own: Own<'_, D>) -> Energy {
        self.gather::<lanes::Avx2>(atoms, c, own)
    }

    /// The same with more registers.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
    fn gather_avx512(&self, atoms: &[Point<D>], c: usize, own: Own<'_, D>) -> Energy {
        self.gather::<lanes::Avx2>(atoms, c, own)
    }

    /// The image's part of some atoms: β b, and the gradient.
    #[inline(always)]
    fn image_part(
        &self,
        atoms: &[Point<D>],
        members: &[u32],
        held: &mut [HeldCell],
        slopes: &mut [Point<D>],
    ) -> f64 {
        let mut energy = 0.0;
        for ((slope, held), &i) in slopes.iter_mut().zip(held).zip(members) {
            let beta = self.fields.weight.as_constant().unwrap_or_else(|| self.weights[i as usize]);
            let atom = &atoms[i as usize];
            energy += beta * self.fields.potential.value_and_gradient_held(atom, held, slope);
            *slope = slope.map(|g| beta * g);
        }
        energy
    }

    /// Energy and gradient of all chunks, the gradient in the tree's order.
    pub(super) fn gather_all(
        &self,
        atoms: &[Point<D>],
        slopes: &mut [Point<D>],
        held: &mut [HeldCell],
    ) -> Energy {
        #[cfg(target_arch = "x86_64")]
        let (wide, more) = (lanes::has_avx2(), lanes::has_avx512());
        let gather = |c: usize, own: Own<'_, D>| {
            // SAFETY: the processor has been asked whether it has these instructions.
            #[cfg(target_arch = "x86_64")]
            unsafe {
                if more {
                    return self.gather_avx512(atoms, c, own);
                }
                if wide {
                    return self.gather_avx2(atoms, c, own);
                }
            }
            self.gather::<Plain>(atoms, c, own)
        };
        let chunks = slopes.par_chunks_mut(CHUNK).zip(held.par_chunks_mut(CHUNK)).enumerate();
        let parts: Vec<Energy> =
            chunks.map(|(c, (slopes, held))| gather(c, Own { slopes, held })).collect();
        parts.into_iter().sum()
    }
}
