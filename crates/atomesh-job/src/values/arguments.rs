//! Parsers of values for clap.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::de::value::{Error as NameError, StrDeserializer};
use serde::de::{DeserializeOwned, IntoDeserializer};

use super::ValueError;

/// Parses one of the names by which serde knows the values of `T`.
pub fn named<T>(names: &'static [&'static str]) -> impl TypedValueParser<Value = T>
where
    T: DeserializeOwned + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names).try_map(|name| {
        let name: StrDeserializer<'_, NameError> = name.as_str().into_deserializer();
        T::deserialize(name)
    })
}

/// A number within limits, for clap.
pub fn number_in(
    least: f64,
    greatest: f64,
    expected: &'static str,
) -> impl Fn(&str) -> Result<f64, ValueError> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.trim().parse().ok();
        number
            .filter(|n| (least..=greatest).contains(n))
            .ok_or_else(|| ValueError { found: text.into(), expected })
    }
}

/// A count that is not too low, for clap.
pub fn count_in(
    least: usize,
    expected: &'static str,
) -> impl Fn(&str) -> Result<usize, ValueError> + Clone + Send + Sync + 'static {
    move |text| {
        let count = text.trim().parse().ok().filter(|&n| n >= least);
        count.ok_or_else(|| ValueError { found: text.into(), expected })
    }
}
