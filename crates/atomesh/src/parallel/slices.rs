//! Where parallel loops begin.

use std::ops::Range;

use super::chain::{Parallel, Plain};
use super::source::Pieces;

/// What a parallel loop can be made of.
pub trait IntoParallel {
    /// The loop.
    type Parallel: Parallel;

    /// The loop over all items.
    fn parallel(self) -> Self::Parallel;

    /// The same, by the name that `rayon` gives it.
    fn into_par_iter(self) -> Self::Parallel
    where
        Self: Sized,
    {
        self.parallel()
    }
}

impl<P: Parallel> IntoParallel for P {
    type Parallel = P;

    fn parallel(self) -> P {
        self
    }
}

macro_rules! plain {
    ($([$($generics:tt)*] $source:ty;)*) => {$(
        impl<$($generics)*> IntoParallel for $source {
            type Parallel = Plain<$source>;

            fn parallel(self) -> Plain<$source> {
                Plain(self)
            }
        }
    )*};
}

plain! {
    [] Range<u32>;
    [] Range<usize>;
    ['a, T: Sync] &'a [T];
    ['a, T: Send] &'a mut [T];
    [T: Send] Vec<T>;
}

impl<'a, T: Sync> IntoParallel for &'a Vec<T> {
    type Parallel = Plain<&'a [T]>;

    fn parallel(self) -> Self::Parallel {
        Plain(self)
    }
}

impl<'a, T: Send> IntoParallel for &'a mut Vec<T> {
    type Parallel = Plain<&'a mut [T]>;

    fn parallel(self) -> Self::Parallel {
        Plain(self)
    }
}

/// Parallel loops over slices.
pub trait ParallelSlice<T: Sync> {
    /// The slice.
    fn slice(&self) -> &[T];

    /// The loop over its items.
    fn par_iter(&self) -> Plain<&[T]> {
        Plain(self.slice())
    }

    /// The loop over pieces of `size` items, of which the last may have fewer.
    ///
    /// # Panics
    /// If `size` is 0.
    fn par_chunks(&self, size: usize) -> Plain<Pieces<&[T]>> {
        assert!(size > 0, "pieces without items");
        Plain(Pieces { slice: self.slice(), size, exact: false })
    }

    /// The loop over pieces of `size` items, without those that are left.
    ///
    /// # Panics
    /// If `size` is 0.
    fn par_chunks_exact(&self, size: usize) -> Plain<Pieces<&[T]>> {
        assert!(size > 0, "pieces without items");
        Plain(Pieces { slice: self.slice(), size, exact: true })
    }
}

impl<T: Sync> ParallelSlice<T> for [T] {
    fn slice(&self) -> &[T] {
        self
    }
}

/// Parallel loops that change slices.
pub trait ParallelSliceMut<T: Send> {
    /// The slice.
    fn slice_mut(&mut self) -> &mut [T];

    /// The loop over its items.
    fn par_iter_mut(&mut self) -> Plain<&mut [T]> {
        Plain(self.slice_mut())
    }

    /// The loop over pieces of `size` items, of which the last may have fewer.
    ///
    /// # Panics
    /// If `size` is 0.
    fn par_chunks_mut(&mut self, size: usize) -> Plain<Pieces<&mut [T]>> {
        assert!(size > 0, "pieces without items");
        Plain(Pieces { slice: self.slice_mut(), size, exact: false })
    }

    /// The loop over pieces of `size` items, without those that are left.
    ///
    /// # Panics
    /// If `size` is 0.
    fn par_chunks_exact_mut(&mut self, size: usize) -> Plain<Pieces<&mut [T]>> {
        assert!(size > 0, "pieces without items");
        Plain(Pieces { slice: self.slice_mut(), size, exact: true })
    }

    /// Sorts; items that are equal may change places.
    fn par_sort_unstable(&mut self)
    where
        T: Ord,
    {
        rayon::slice::ParallelSliceMut::par_sort_unstable(self.slice_mut());
    }

    /// Sorts by `key`; items that are equal may change places.
    fn par_sort_unstable_by_key<K: Ord>(&mut self, key: impl Fn(&T) -> K + Sync) {
        rayon::slice::ParallelSliceMut::par_sort_unstable_by_key(self.slice_mut(), key);
    }

    /// Sorts by `key`; items that are equal stay in their order.
    fn par_sort_by_key<K: Ord>(&mut self, key: impl Fn(&T) -> K + Sync) {
        rayon::slice::ParallelSliceMut::par_sort_by_key(self.slice_mut(), key);
    }
}

impl<T: Send> ParallelSliceMut<T> for [T] {
    fn slice_mut(&mut self) -> &mut [T] {
        self
    }
}
