//! What ends a parallel loop.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::chain::Parallel;
use super::collect::{FromParallel, into_vec};
use super::in_blocks;

/// The ends of parallel loops, by `rayon`'s names. Blocks are put together in the order of their items.
pub trait Finish: Parallel {
    /// Does `f` to every item.
    fn for_each(self, f: impl Fn(Self::Item) + Sync) {
        let (source, step, least) = self.parts();
        in_blocks(source, least, |block, start| Self::items(&step, block, start).for_each(&f));
    }

    /// Does `f`, with a state that `init` makes for each block, to every item.
    fn for_each_init<T>(self, init: impl Fn() -> T + Sync, f: impl Fn(&mut T, Self::Item) + Sync) {
        let (source, step, least) = self.parts();
        in_blocks(source, least, |block, start| {
            let mut state = init();
            Self::items(&step, block, start).for_each(|item| f(&mut state, item));
        });
    }

    /// All items in their order.
    fn collect<C: FromParallel<Self::Item>>(self) -> C {
        C::from_parallel(self)
    }

    /// All items in their order, in place of those of a vector, whose memory is used again.
    fn collect_into_vec(self, into: &mut Vec<Self::Item>)
    where
        Self::Item: Send,
    {
        into.clear();
        into_vec(self, into);
    }

    /// All items put together, beginning with `identity`, which must change nothing.
    fn reduce(
        self,
        identity: impl Fn() -> Self::Item + Sync,
        op: impl Fn(Self::Item, Self::Item) -> Self::Item + Sync,
    ) -> Self::Item
    where
        Self::Item: Send,
    {
        let (source, step, least) = self.parts();
        let of_block = |block, start| Self::items(&step, block, start).fold(identity(), &op);
        in_blocks(source, least, of_block).into_iter().fold(identity(), op)
    }

    /// All items put together; `None` if there are none.
    fn reduce_with(
        self,
        op: impl Fn(Self::Item, Self::Item) -> Self::Item + Sync,
    ) -> Option<Self::Item>
    where
        Self::Item: Send,
    {
        let (source, step, least) = self.parts();
        let of_block = |block, start| Self::items(&step, block, start).reduce(&op);
        in_blocks(source, least, of_block).into_iter().flatten().reduce(op)
    }

    /// The items of each block put together, beginning with `init`: the `reduce` of what is returned does
    /// the same with the blocks.
    fn fold<T: Send>(
        self,
        init: impl Fn() -> T + Sync,
        f: impl Fn(T, Self::Item) -> T + Sync,
    ) -> Folded<T> {
        let (source, step, least) = self.parts();
        let of_block = |block, start| Self::items(&step, block, start).fold(init(), &f);
        Folded(in_blocks(source, least, of_block))
    }

    /// How many items there are.
    fn count(self) -> usize {
        let (source, step, least) = self.parts();
        let of_block = |block, start| Self::items(&step, block, start).count();
        in_blocks(source, least, of_block).into_iter().sum()
    }

    /// The least item by `compare`; of equals the first.
    fn min_by(
        self,
        compare: impl Fn(&Self::Item, &Self::Item) -> std::cmp::Ordering + Sync,
    ) -> Option<Self::Item>
    where
        Self::Item: Send,
    {
        self.reduce_with(|a, b| if compare(&b, &a).is_lt() { b } else { a })
    }

    /// The halves of pairs.
    fn unzip<A: Send, B: Send>(self) -> (Vec<A>, Vec<B>)
    where
        Self: Parallel<Item = (A, B)>,
    {
        self.collect::<Vec<(A, B)>>().into_iter().unzip()
    }

    /// Whether `f` is true for all items. Blocks that have not begun are left out once one item is found.
    fn all(self, f: impl Fn(Self::Item) -> bool + Sync) -> bool {
        let (source, step, least) = self.parts();
        let is_found = AtomicBool::new(false);
        in_blocks(source, least, |block, start| {
            let goes_on = !is_found.load(Ordering::Relaxed);
            if goes_on && !Self::items(&step, block, start).all(&f) {
                is_found.store(true, Ordering::Relaxed);
            }
        });
        !is_found.into_inner()
    }

    /// The first item for which `f` is true. Blocks behind one that has such an item are left out, if they have not begun.
    fn find_first(self, f: impl Fn(&Self::Item) -> bool + Sync) -> Option<Self::Item>
    where
        Self::Item: Send,
    {
        let (source, step, least) = self.parts();
        let first = AtomicUsize::new(usize::MAX);
        let of_block = |block, start| {
            let goes_on = first.load(Ordering::Relaxed) > start;
            let found = goes_on.then(|| Self::items(&step, block, start).find(&f)).flatten();
            if found.is_some() {
                first.fetch_min(start, Ordering::Relaxed);
            }
            found
        };
        in_blocks(source, least, of_block).into_iter().flatten().next()
    }

    /// The number of the first item for which `f` is true.
    fn position_first(self, f: impl Fn(Self::Item) -> bool + Sync) -> Option<usize> {
        const { assert!(Self::EXACT, "only what has an item for each of the source is numbered") };
        self.enumerate().filter_map(|(at, item)| f(item).then_some(at)).find_first(|_| true)
    }
}

impl<P: Parallel> Finish for P {}

/// What came of each block, in order.
#[derive(Debug)]
pub struct Folded<T>(Vec<T>);

impl<T> Folded<T> {
    /// All put together, beginning with `identity`.
    pub fn reduce(self, identity: impl Fn() -> T, op: impl Fn(T, T) -> T) -> T {
        self.0.into_iter().fold(identity(), op)
    }
}
