//! What can be cut into blocks.

use std::ops::Range;
use std::slice::{Chunks, ChunksExact, ChunksExactMut, ChunksMut, Iter, IterMut};

/// Items in an order, which can be cut in two.
pub trait Source: Send + Sized {
    /// An item.
    type Item;
    /// The items one after another.
    type Items: Iterator<Item = Self::Item>;

    /// How many there are.
    fn length(&self) -> usize;

    /// Those before a place and those from it on.
    fn cut(self, at: usize) -> (Self, Self);

    /// The items.
    fn items(self) -> Self::Items;
}

macro_rules! range {
    ($($number:ty),*) => {$(
        impl Source for Range<$number> {
            type Item = $number;
            type Items = Self;

            fn length(&self) -> usize {
                self.end.saturating_sub(self.start) as usize
            }

            fn cut(self, at: usize) -> (Self, Self) {
                let middle = self.start + at as $number;
                (self.start..middle, middle..self.end)
            }

            fn items(self) -> Self::Items {
                self
            }
        }
    )*};
}

range!(u32, usize);

impl<'a, T: Sync> Source for &'a [T] {
    type Item = &'a T;
    type Items = Iter<'a, T>;

    fn length(&self) -> usize {
        self.len()
    }

    fn cut(self, at: usize) -> (Self, Self) {
        self.split_at(at)
    }

    fn items(self) -> Self::Items {
        self.iter()
    }
}

impl<'a, T: Send> Source for &'a mut [T] {
    type Item = &'a mut T;
    type Items = IterMut<'a, T>;

    fn length(&self) -> usize {
        self.len()
    }

    fn cut(self, at: usize) -> (Self, Self) {
        self.split_at_mut(at)
    }

    fn items(self) -> Self::Items {
        self.iter_mut()
    }
}

impl<T: Send> Source for Vec<T> {
    type Item = T;
    type Items = std::vec::IntoIter<T>;

    fn length(&self) -> usize {
        self.len()
    }

    fn cut(mut self, at: usize) -> (Self, Self) {
        let behind = self.split_off(at);
        (self, behind)
    }

    fn items(self) -> Self::Items {
        self.into_iter()
    }
}

/// Pieces of a slice, all of one size but, unless they are exact, the last.
#[derive(Clone, Debug)]
pub struct Pieces<S> {
    pub(super) slice: S,
    pub(super) size: usize,
    pub(super) exact: bool,
}

macro_rules! pieces {
    ($slice:ty, $item:ty, $bound:ident, $split:ident, $items:ident, $($way:ident)+) => {
        impl<'a, T: $bound> Source for Pieces<$slice> {
            type Item = $item;
            type Items = $items<'a, T>;

            fn length(&self) -> usize {
                let length = self.slice.len();
                if self.exact { length / self.size } else { length.div_ceil(self.size) }
            }

            fn cut(self, at: usize) -> (Self, Self) {
                let Self { slice, size, exact } = self;
                let (before, behind) = slice.$split((at * size).min(slice.len()));
                (Self { slice: before, size, exact }, Self { slice: behind, size, exact })
            }

            fn items(self) -> Self::Items {
                match self.exact {
                    true => $items::Exact(pieces!(@exact self, $($way)+)),
                    false => $items::Some(pieces!(@some self, $($way)+)),
                }
            }
        }
    };
    (@exact $self:ident, shared) => { $self.slice.chunks_exact($self.size) };
    (@some $self:ident, shared) => { $self.slice.chunks($self.size) };
    (@exact $self:ident, mutable) => { $self.slice.chunks_exact_mut($self.size) };
    (@some $self:ident, mutable) => { $self.slice.chunks_mut($self.size) };
}

macro_rules! either {
    ($name:ident, $item:ty, $bound:ident, $exact:ident, $some:ident) => {
        /// Pieces one after another.
        #[derive(Debug)]
        pub enum $name<'a, T> {
            /// Of one size.
            Exact($exact<'a, T>),
            /// The last may be shorter.
            Some($some<'a, T>),
        }

        impl<'a, T: $bound> Iterator for $name<'a, T> {
            type Item = $item;

            fn next(&mut self) -> Option<Self::Item> {
                match self {
                    Self::Exact(items) => items.next(),
                    Self::Some(items) => items.next(),
                }
            }

            fn size_hint(&self) -> (usize, Option<usize>) {
                match self {
                    Self::Exact(items) => items.size_hint(),
                    Self::Some(items) => items.size_hint(),
                }
            }
        }
    };
}

either!(SharedPieces, &'a [T], Sync, ChunksExact, Chunks);
either!(MutablePieces, &'a mut [T], Send, ChunksExactMut, ChunksMut);
pieces!(&'a [T], &'a [T], Sync, split_at, SharedPieces, shared);
pieces!(&'a mut [T], &'a mut [T], Send, split_at_mut, MutablePieces, mutable);

/// Two sources side by side, cut at the same places; as long as the shorter.
#[derive(Clone, Debug)]
pub struct Pair<A, B>(pub(super) A, pub(super) B);

impl<A: Source, B: Source> Source for Pair<A, B> {
    type Item = (A::Item, B::Item);
    type Items = std::iter::Zip<A::Items, B::Items>;

    fn length(&self) -> usize {
        self.0.length().min(self.1.length())
    }

    fn cut(self, at: usize) -> (Self, Self) {
        let ((a, more_a), (b, more_b)) = (self.0.cut(at), self.1.cut(at));
        (Self(a, b), Self(more_a, more_b))
    }

    fn items(self) -> Self::Items {
        self.0.items().zip(self.1.items())
    }
}
