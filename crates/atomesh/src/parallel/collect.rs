//! Items of parallel loops in vectors.

use std::mem::MaybeUninit;

use super::chain::Parallel;
use super::in_blocks;
use super::slices::IntoParallel;
use super::source::{Pair, Source};

/// What items are collected into.
pub trait FromParallel<T>: Sized {
    /// The items of a loop, in their order.
    fn from_parallel(items: impl Parallel<Item = T>) -> Self;
}

impl<T: Send> FromParallel<T> for Vec<T> {
    fn from_parallel(items: impl Parallel<Item = T>) -> Self {
        let mut into = Self::new();
        into_vec(items, &mut into);
        into
    }
}

/// All, or the first error.
impl<T: Send, E: Send> FromParallel<Result<T, E>> for Result<Vec<T>, E> {
    fn from_parallel(items: impl Parallel<Item = Result<T, E>>) -> Self {
        Vec::from_parallel(items).into_iter().collect()
    }
}

/// All, or nothing if one is missing.
impl<T: Send> FromParallel<Option<T>> for Option<Vec<T>> {
    fn from_parallel(items: impl Parallel<Item = Option<T>>) -> Self {
        Vec::from_parallel(items).into_iter().collect()
    }
}

/// Vectors that get the items of a parallel loop.
pub trait ParallelExtend<T: Send> {
    /// Puts the items behind those that there are.
    fn par_extend(&mut self, items: impl IntoParallel<Parallel: Parallel<Item = T>>);
}

impl<T: Send> ParallelExtend<T> for Vec<T> {
    fn par_extend(&mut self, items: impl IntoParallel<Parallel: Parallel<Item = T>>) {
        into_vec(items.parallel(), self);
    }
}

/// Puts the items of a loop behind those of a vector: straight to their places where their number is known, or else block
/// by block.
pub(super) fn into_vec<P: Parallel<Item: Send>>(items: P, into: &mut Vec<P::Item>) {
    let (source, step, least) = items.parts();
    let length = source.length();
    if !P::EXACT {
        let of_block = |block, start| P::items(&step, block, start).collect();
        let mut blocks: Vec<Vec<P::Item>> = in_blocks(source, least, of_block);
        if let ([one], true) = (&mut blocks[..], into.is_empty()) {
            *into = std::mem::take(one);
            return;
        }
        into.reserve(blocks.iter().map(Vec::len).sum());
        blocks.iter_mut().for_each(|block| into.append(block));
        return;
    }
    into.reserve(length);
    let places = &mut into.spare_capacity_mut()[..length];
    let filled: usize = in_blocks(Pair(source, places), least, |Pair(block, places), start| {
        let pairs = places.iter_mut().zip(P::items(&step, block, start));
        pairs.map(|(place, item): (&mut MaybeUninit<P::Item>, _)| place.write(item)).count()
    })
    .into_iter()
    .sum();
    assert_eq!(filled, length, "an item for each of the source");
    // SAFETY: each of the `length` places behind the items that there were has been written to, and there is room for them.
    unsafe { into.set_len(into.len() + length) };
}
