//! Loops on all threads, in the words of `rayon`, compiled once.
//!
//! `rayon` compiles the whole of its machinery again for each closure that it is given: about 3,000 lines of the
//! compiler's intermediate code each time, more than half of all that this crate once came to. Here that machinery is
//! compiled once, for [`each`], whose work is known by its address alone; around it a loop is cut into blocks of items,
//! and within a block it is a loop of the standard library's iterators. The traits have the names of `rayon`'s and do
//! the same, so that those who know these know ours.
//!
//! A [`Source`] is what can be cut: a range, a slice, chunks of one. A [`Parallel`] is a source and what is done to its
//! items on the way. Nothing here depends on the number of threads but the number of blocks; who reduces floating-point
//! numbers must not let it show, as with `rayon`.

mod chain;
mod collect;
mod finish;
mod slices;
mod source;
#[cfg(test)]
mod tests;

pub use chain::Parallel;
pub use collect::{FromParallel, ParallelExtend};
pub use finish::Finish;
pub use slices::{IntoParallel, ParallelSlice, ParallelSliceMut};
pub use source::Source;

use std::sync::{Mutex, PoisonError};

use rayon::iter::{IndexedParallelIterator, ParallelIterator};

/// All that parallel loops need.
pub mod prelude {
    pub use super::{
        Finish, IntoParallel, Parallel, ParallelExtend, ParallelSlice, ParallelSliceMut,
    };
}

/// Blocks that each thread gets, so that one is not left alone with the last of them.
const BLOCKS_A_THREAD: usize = 8;

/// Does `work` for every number below `count`, on all threads.
pub fn each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    match count {
        0 => {}
        1 => work(0),
        _ => rayon::iter::IntoParallelIterator::into_par_iter(0..count)
            .with_max_len(1)
            .for_each(work),
    }
}

/// Does `work` for blocks of a source, each with the number of its first item, and returns what came of them, in order.
/// Blocks have `least` items or more.
fn in_blocks<S: Source, R: Send>(
    source: S,
    least: usize,
    work: impl Fn(S, usize) -> R + Sync,
) -> Vec<R> {
    let mut blocks = cut(source, least);
    if blocks.len() < 2 {
        return blocks.pop().map(|(start, block)| work(block, start)).into_iter().collect();
    }
    let slots: Vec<Mutex<Slot<S, R>>> =
        blocks.into_iter().map(|(start, block)| Mutex::new(Slot::Open(start, block))).collect();
    each(slots.len(), &|number| {
        let take = || {
            let mut slot = slots[number].lock().unwrap_or_else(PoisonError::into_inner);
            std::mem::replace(&mut *slot, Slot::Taken)
        };
        if let Slot::Open(start, block) = take() {
            let made = work(block, start);
            *slots[number].lock().unwrap_or_else(PoisonError::into_inner) = Slot::Done(made);
        }
    });
    let done =
        slots.into_iter().map(|slot| slot.into_inner().unwrap_or_else(PoisonError::into_inner));
    done.filter_map(|slot| if let Slot::Done(made) = slot { Some(made) } else { None }).collect()
}

/// A block on its way.
enum Slot<S, R> {
    /// To be done: its first item's number, and its items.
    Open(usize, S),
    /// Being done.
    Taken,
    /// Done.
    Done(R),
}

/// The blocks of a source, each with the number of its first item; none of a source without items.
fn cut<S: Source>(source: S, least: usize) -> Vec<(usize, S)> {
    let length = source.length();
    let most = BLOCKS_A_THREAD * rayon::current_num_threads();
    let count = if rayon::current_num_threads() == 1 { 1 } else { most };
    let count = count.min(length / least.max(1)).max(1);
    let mut blocks = Vec::with_capacity(count);
    let (mut rest, mut start) = (source, 0);
    for number in 1..count {
        let end = (length as u128 * number as u128 / count as u128) as usize;
        let (block, behind) = rest.cut(end - start);
        blocks.push((start, block));
        (rest, start) = (behind, end);
    }
    if length > 0 {
        blocks.push((start, rest));
    }
    blocks
}
