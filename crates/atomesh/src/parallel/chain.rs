//! What is done to items on the way.

use super::slices::IntoParallel;
use super::source::{Pair, Source};

/// Items of a source, and what is done to them: `rayon`'s `ParallelIterator` and `IndexedParallelIterator` in one. What
/// ends a loop is [`Finish`](super::Finish).
pub trait Parallel: Sized {
    /// Where the items come from.
    type Source: Source;
    /// What is done to them, shared by all threads.
    type Step: Sync;
    /// What comes of them.
    type Item;

    /// Whether every item of the source gives one.
    const EXACT: bool;

    /// The parts, and the least items of a block.
    fn parts(self) -> (Self::Source, Self::Step, usize);

    /// The items of a block whose first one has the number `start`.
    fn items(
        step: &Self::Step,
        block: Self::Source,
        start: usize,
    ) -> impl Iterator<Item = Self::Item>;

    /// Items changed by `f`.
    fn map<R, F: Fn(Self::Item) -> R + Sync>(self, f: F) -> Map<Self, F> {
        Map(self, f)
    }

    /// Items changed by `f`, which has a state that `init` makes for each block.
    fn map_init<T, R, I, F>(self, init: I, f: F) -> MapInit<Self, I, F>
    where
        I: Fn() -> T + Sync,
        F: Fn(&mut T, Self::Item) -> R + Sync,
    {
        MapInit(self, init, f)
    }

    /// The items for which `f` is true.
    fn filter<F: Fn(&Self::Item) -> bool + Sync>(self, f: F) -> Filter<Self, F> {
        Filter(self, f)
    }

    /// What `f` makes of items, where it makes something.
    fn filter_map<R, F: Fn(Self::Item) -> Option<R> + Sync>(self, f: F) -> FilterMap<Self, F> {
        FilterMap(self, f)
    }

    /// All that `f` makes of each item, one after another.
    fn flat_map_iter<R: IntoIterator, F: Fn(Self::Item) -> R + Sync>(
        self,
        f: F,
    ) -> FlatMap<Self, F> {
        FlatMap(self, f)
    }

    /// What is in each item, one after another.
    fn flatten_iter(self) -> Flatten<Self>
    where
        Self::Item: IntoIterator,
    {
        FlatMap(self, |item| item)
    }

    /// Copies of the items.
    fn copied<'a, T: Copy + 'a>(self) -> Map<Self, fn(&'a T) -> T>
    where
        Self: Parallel<Item = &'a T>,
    {
        Map(self, |item| *item)
    }

    /// Items with their numbers. Where items were left out before, numbers mean nothing.
    fn enumerate(self) -> Enumerate<Self> {
        const { assert!(Self::EXACT, "only what has an item for each of the source is numbered") };
        Enumerate(self)
    }

    /// Items with those of another, as many as the shorter has.
    fn zip<Q: IntoParallel>(self, other: Q) -> Zip<Self, Q::Parallel> {
        const { assert!(Self::EXACT, "only what has an item for each of the source is paired") };
        Zip(self, other.parallel())
    }

    /// The same in blocks of no fewer items.
    fn with_min_len(self, least: usize) -> WithMinLen<Self> {
        WithMinLen(self, least)
    }
}

/// A source as it is.
#[derive(Clone, Debug)]
pub struct Plain<S>(pub(super) S);

impl<S: Source> Parallel for Plain<S> {
    type Source = S;
    type Step = ();
    type Item = S::Item;
    const EXACT: bool = true;

    fn parts(self) -> (S, (), usize) {
        (self.0, (), 1)
    }

    fn items(_: &(), block: S, _: usize) -> impl Iterator<Item = S::Item> {
        block.items()
    }
}

/// [`Parallel::map`].
#[derive(Clone, Debug)]
pub struct Map<P, F>(P, F);

impl<P: Parallel, R, F: Fn(P::Item) -> R + Sync> Parallel for Map<P, F> {
    type Source = P::Source;
    type Step = (P::Step, F);
    type Item = R;
    const EXACT: bool = P::EXACT;

    fn parts(self) -> (P::Source, (P::Step, F), usize) {
        let (source, step, least) = self.0.parts();
        (source, (step, self.1), least)
    }

    fn items(step: &Self::Step, block: P::Source, start: usize) -> impl Iterator<Item = R> {
        P::items(&step.0, block, start).map(&step.1)
    }
}

/// [`Parallel::map_init`].
#[derive(Clone, Debug)]
pub struct MapInit<P, I, F>(P, I, F);

impl<P, T, R, I, F> Parallel for MapInit<P, I, F>
where
    P: Parallel,
    I: Fn() -> T + Sync,
    F: Fn(&mut T, P::Item) -> R + Sync,
{
    type Source = P::Source;
    type Step = (P::Step, I, F);
    type Item = R;
    const EXACT: bool = P::EXACT;

    fn parts(self) -> (P::Source, Self::Step, usize) {
        let (source, step, least) = self.0.parts();
        (source, (step, self.1, self.2), least)
    }

    fn items(step: &Self::Step, block: P::Source, start: usize) -> impl Iterator<Item = R> {
        let mut state = (step.1)();
        P::items(&step.0, block, start).map(move |item| (step.2)(&mut state, item))
    }
}

/// [`Parallel::filter`].
#[derive(Clone, Debug)]
pub struct Filter<P, F>(P, F);

impl<P: Parallel, F: Fn(&P::Item) -> bool + Sync> Parallel for Filter<P, F> {
    type Source = P::Source;
    type Step = (P::Step, F);
    type Item = P::Item;
    const EXACT: bool = false;

    fn parts(self) -> (P::Source, Self::Step, usize) {
        let (source, step, least) = self.0.parts();
        (source, (step, self.1), least)
    }

    fn items(step: &Self::Step, block: P::Source, start: usize) -> impl Iterator<Item = P::Item> {
        P::items(&step.0, block, start).filter(&step.1)
    }
}

/// [`Parallel::filter_map`].
#[derive(Clone, Debug)]
pub struct FilterMap<P, F>(P, F);

impl<P: Parallel, R, F: Fn(P::Item) -> Option<R> + Sync> Parallel for FilterMap<P, F> {
    type Source = P::Source;
    type Step = (P::Step, F);
    type Item = R;
    const EXACT: bool = false;

    fn parts(self) -> (P::Source, Self::Step, usize) {
        let (source, step, least) = self.0.parts();
        (source, (step, self.1), least)
    }

    fn items(step: &Self::Step, block: P::Source, start: usize) -> impl Iterator<Item = R> {
        P::items(&step.0, block, start).filter_map(&step.1)
    }
}

/// [`Parallel::flat_map_iter`].
#[derive(Clone, Debug)]
pub struct FlatMap<P, F>(P, F);

impl<P: Parallel, R: IntoIterator, F: Fn(P::Item) -> R + Sync> Parallel for FlatMap<P, F> {
    type Source = P::Source;
    type Step = (P::Step, F);
    type Item = R::Item;
    const EXACT: bool = false;

    fn parts(self) -> (P::Source, Self::Step, usize) {
        let (source, step, least) = self.0.parts();
        (source, (step, self.1), least)
    }

    fn items(step: &Self::Step, block: P::Source, start: usize) -> impl Iterator<Item = R::Item> {
        P::items(&step.0, block, start).flat_map(&step.1)
    }
}

/// [`Parallel::flatten_iter`].
pub type Flatten<P> = FlatMap<P, fn(<P as Parallel>::Item) -> <P as Parallel>::Item>;

/// [`Parallel::enumerate`].
#[derive(Clone, Debug)]
pub struct Enumerate<P>(P);

impl<P: Parallel> Parallel for Enumerate<P> {
    type Source = P::Source;
    type Step = P::Step;
    type Item = (usize, P::Item);
    const EXACT: bool = P::EXACT;

    fn parts(self) -> (P::Source, P::Step, usize) {
        self.0.parts()
    }

    fn items(
        step: &P::Step,
        block: P::Source,
        start: usize,
    ) -> impl Iterator<Item = (usize, P::Item)> {
        (start..).zip(P::items(step, block, start))
    }
}

/// [`Parallel::zip`].
#[derive(Clone, Debug)]
pub struct Zip<P, Q>(P, Q);

impl<P: Parallel, Q: Parallel> Parallel for Zip<P, Q> {
    type Source = Pair<P::Source, Q::Source>;
    type Step = (P::Step, Q::Step);
    type Item = (P::Item, Q::Item);
    const EXACT: bool = P::EXACT && Q::EXACT;

    fn parts(self) -> (Self::Source, Self::Step, usize) {
        let ((a, step_a, least_a), (b, step_b, least_b)) = (self.0.parts(), self.1.parts());
        (Pair(a, b), (step_a, step_b), least_a.max(least_b))
    }

    fn items(
        step: &Self::Step,
        block: Self::Source,
        start: usize,
    ) -> impl Iterator<Item = Self::Item> {
        P::items(&step.0, block.0, start).zip(Q::items(&step.1, block.1, start))
    }
}

/// [`Parallel::with_min_len`].
#[derive(Clone, Debug)]
pub struct WithMinLen<P>(P, usize);

impl<P: Parallel> Parallel for WithMinLen<P> {
    type Source = P::Source;
    type Step = P::Step;
    type Item = P::Item;
    const EXACT: bool = P::EXACT;

    fn parts(self) -> (P::Source, P::Step, usize) {
        let (source, step, least) = self.0.parts();
        (source, step, least.max(self.1))
    }

    fn items(step: &P::Step, block: P::Source, start: usize) -> impl Iterator<Item = P::Item> {
        P::items(step, block, start)
    }
}
