//! The types that samples have in files.

use std::fmt;
use std::str::FromStr;

/// The type of a sample in a file, by NumPy's names.
///
/// The samples of an image are held in the same type, but for `bool` (held as `uint8`), `float16`
/// (as `float32`), and 64-bit integers (as `float64`, which is exact up to 2⁵³).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SampleType {
    /// A byte that is 0 or 1.
    Bool,
    /// An unsigned byte.
    U8,
    /// A signed byte.
    I8,
    /// An unsigned 16-bit integer.
    U16,
    /// A signed 16-bit integer.
    I16,
    /// An unsigned 32-bit integer.
    U32,
    /// A signed 32-bit integer.
    I32,
    /// An unsigned 64-bit integer.
    U64,
    /// A signed 64-bit integer.
    I64,
    /// Half precision.
    F16,
    /// Single precision.
    F32,
    /// Double precision.
    F64,
}

impl SampleType {
    /// All of them.
    pub const ALL: [Self; 12] = [
        Self::Bool,
        Self::U8,
        Self::I8,
        Self::U16,
        Self::I16,
        Self::U32,
        Self::I32,
        Self::U64,
        Self::I64,
        Self::F16,
        Self::F32,
        Self::F64,
    ];

    /// NumPy's name: `bool`, `uint8` ... `float64`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::U8 => "uint8",
            Self::I8 => "int8",
            Self::U16 => "uint16",
            Self::I16 => "int16",
            Self::U32 => "uint32",
            Self::I32 => "int32",
            Self::U64 => "uint64",
            Self::I64 => "int64",
            Self::F16 => "float16",
            Self::F32 => "float32",
            Self::F64 => "float64",
        }
    }

    /// The bytes that a sample takes in a file.
    pub fn size(self) -> usize {
        match self {
            Self::Bool | Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 | Self::F16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }
}

impl fmt::Display for SampleType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name is none of the sample types'.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown sample type {name:?}; expected {}",
    SampleType::ALL.map(SampleType::name).join(", ")
)]
pub struct UnknownSampleType {
    /// The name given.
    pub name: String,
}

impl FromStr for SampleType {
    type Err = UnknownSampleType;

    fn from_str(name: &str) -> Result<Self, UnknownSampleType> {
        Self::ALL
            .into_iter()
            .find(|t| t.name() == name)
            .ok_or_else(|| UnknownSampleType { name: name.into() })
    }
}

/// Which byte of a number comes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ByteOrder {
    /// The least significant byte first, as on nearly every machine of today.
    #[default]
    Little,
    /// The most significant byte first, as on networks and old workstations.
    Big,
}

/// A word that names no byte order.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown byte order {name:?}; expected little or big")]
pub struct UnknownByteOrder {
    /// The word given.
    pub name: String,
}

impl FromStr for ByteOrder {
    type Err = UnknownByteOrder;

    fn from_str(name: &str) -> Result<Self, UnknownByteOrder> {
        match name {
            "little" => Ok(Self::Little),
            "big" => Ok(Self::Big),
            _ => Err(UnknownByteOrder { name: name.into() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back_and_others_refused_with_the_list() {
        for kind in SampleType::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
        }
        let message = "u8".parse::<SampleType>().unwrap_err().to_string();
        assert!(message.contains("\"u8\"") && message.contains("uint8, int8"), "{message}");
        assert_eq!("big".parse(), Ok(ByteOrder::Big));
        assert!("middle".parse::<ByteOrder>().unwrap_err().to_string().contains("\"middle\""));
    }
}
