//! Sample values of one type, in memory that clones share.

use std::fmt;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use crate::parallel::{FromParallel, Parallel};

/// Memory that is kept elsewhere, such as an array of another language's: the same values as long as it lives.
pub type Elsewhere<T> = Arc<dyn AsRef<[T]> + Send + Sync>;

/// Sample values of one type. A clone shares their memory, whoever keeps it; who writes to them has a copy of their own.
pub struct Values<T>(Kept<T>);

enum Kept<T> {
    Here(Arc<Vec<T>>),
    Elsewhere(Elsewhere<T>),
}

impl<T> Values<T> {
    /// Values that are kept elsewhere, without a copy.
    pub fn elsewhere(values: Elsewhere<T>) -> Self {
        Self(Kept::Elsewhere(values))
    }

    /// The values, to be changed and added to. Cost: a copy if somebody else has them too.
    pub fn to_mut(&mut self) -> &mut Vec<T>
    where
        T: Clone,
    {
        if let Kept::Elsewhere(values) = &self.0 {
            self.0 = Kept::Here(Arc::new((**values).as_ref().to_vec()));
        }
        match &mut self.0 {
            Kept::Here(values) => Arc::make_mut(values),
            Kept::Elsewhere(_) => unreachable!("a copy was made"),
        }
    }

    /// The values themselves, without a copy if nobody else has them.
    pub fn into_vec(self) -> Vec<T>
    where
        T: Clone,
    {
        match self.0 {
            Kept::Here(values) => Arc::try_unwrap(values).unwrap_or_else(|v| v.to_vec()),
            Kept::Elsewhere(values) => (*values).as_ref().to_vec(),
        }
    }
}

impl<T> Deref for Values<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        match &self.0 {
            Kept::Here(values) => values,
            Kept::Elsewhere(values) => (**values).as_ref(),
        }
    }
}

/// Cost: a copy if somebody else has the values too.
impl<T: Clone> DerefMut for Values<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        self.to_mut()
    }
}

impl<T> From<Vec<T>> for Values<T> {
    fn from(values: Vec<T>) -> Self {
        Self(Kept::Here(Arc::new(values)))
    }
}

impl<T> FromIterator<T> for Values<T> {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
        Vec::from_iter(values).into()
    }
}

impl<T: Send> FromParallel<T> for Values<T> {
    fn from_parallel(values: impl Parallel<Item = T>) -> Self {
        Vec::from_parallel(values).into()
    }
}

impl<'a, T> IntoIterator for &'a Values<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<T> Clone for Values<T> {
    fn clone(&self) -> Self {
        Self(match &self.0 {
            Kept::Here(values) => Kept::Here(Arc::clone(values)),
            Kept::Elsewhere(values) => Kept::Elsewhere(Arc::clone(values)),
        })
    }
}

impl<T: fmt::Debug> fmt::Debug for Values<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

impl<T: PartialEq> PartialEq for Values<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Memory that says where it is.
    struct Array(Vec<u8>);

    impl AsRef<[u8]> for Array {
        fn as_ref(&self) -> &[u8] {
            &self.0
        }
    }

    #[test]
    fn clones_share_memory_until_one_writes() {
        let array = Array(vec![1, 2, 3]);
        let place = array.0.as_ptr();
        let elsewhere = Values::elsewhere(Arc::new(array));
        assert_eq!(elsewhere.as_ptr(), place);
        for first in [elsewhere, Values::from(vec![1, 2, 3])] {
            let mut second = first.clone();
            assert_eq!(first.as_ptr(), second.as_ptr());
            second[0] = 9;
            assert_ne!(first.as_ptr(), second.as_ptr());
            assert_eq!((&first[..], &second[..]), (&[1, 2, 3][..], &[9, 2, 3][..]));
            assert_eq!(first.clone().into_vec(), [1, 2, 3]);
        }
    }

    #[test]
    fn values_that_nobody_else_has_are_given_without_a_copy() {
        let values = Values::from(vec![1.5f32, 2.0]);
        let place = values.as_ptr();
        let given = values.into_vec();
        assert_eq!(given.as_ptr(), place);
    }
}
