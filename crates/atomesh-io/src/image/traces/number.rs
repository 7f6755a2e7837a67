//! How samples of traces are written, IBM's floating point among them.

use std::fmt;

/// How a sample of a trace is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SampleFormat {
    /// IBM's floating point of 32 bits.
    Ibm,
    /// IEEE's floating point of 32 bits.
    #[serde(rename = "ieee")]
    F32,
    /// IEEE's floating point of 64 bits.
    #[serde(rename = "float64")]
    F64,
    /// A signed integer of 32 bits.
    #[serde(rename = "int32")]
    I32,
    /// A signed integer of 16 bits.
    #[serde(rename = "int16")]
    I16,
    /// A signed byte.
    #[serde(rename = "int8")]
    I8,
    /// An unsigned integer of 32 bits.
    #[serde(rename = "uint32")]
    U32,
    /// An unsigned integer of 16 bits.
    #[serde(rename = "uint16")]
    U16,
    /// An unsigned byte.
    #[serde(rename = "uint8")]
    U8,
}

impl SampleFormat {
    /// The names by which options call them.
    pub const NAMES: &'static [&'static str] =
        &["ibm", "ieee", "float64", "int32", "int16", "int8", "uint32", "uint16", "uint8"];

    /// The bytes that a sample takes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::Ibm | Self::I32 | Self::F32 | Self::U32 => 4,
            Self::F64 => 8,
        }
    }
}

/// IBM or IEEE, or the name of an integer's type.
impl fmt::Display for SampleFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Ibm => "IBM",
            Self::F32 => "IEEE",
            Self::F64 => "float64",
            Self::I32 => "int32",
            Self::I16 => "int16",
            Self::I8 => "int8",
            Self::U32 => "uint32",
            Self::U16 => "uint16",
            Self::U8 => "uint8",
        })
    }
}

/// What a fraction of 24 bits is multiplied by, for each of IBM's exponents: 16^(e − 64) / 2²⁴.
fn ibm_scales() -> [f64; 128] {
    std::array::from_fn(|exponent| 2f64.powi(4 * (exponent as i32 - 64) - 24))
}

/// Decodes IBM's single precision: a sign, 7 bits of exponent to 16, a fraction of 24 bits. Exact
/// where single precision has the value; beyond its range infinite.
pub(in super::super) struct Ibm([f64; 128]);

impl Ibm {
    pub fn new() -> Self {
        Self(ibm_scales())
    }

    #[inline]
    pub fn decode(&self, bits: u32) -> f32 {
        let size = f64::from(bits & 0xff_ffff) * self.0[(bits >> 24 & 0x7f) as usize];
        let value = size as f32;
        if bits >> 31 == 0 { value } else { -value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ibm_numbers_have_their_known_values() {
        // the examples of IBM's "System/360 Principles of Operation" and of SEG-Y revision 1
        for (bits, value) in [
            (0x4110_0000, 1.0),
            (0xc276_a000, -118.625),
            (0x4280_0000, 128.0),
            (0x4019_999a, 1_677_722.0 / 16_777_216.0),
            (0x0000_0000, 0.0),
            (0x435c_e000, 1486.0),
            (0xc110_0000, -1.0),
            (0x4000_0001, 2f32.powi(-24)), // not normalised
        ] {
            assert_eq!(Ibm::new().decode(bits), value, "{bits:#010x}");
        }
        assert_eq!(Ibm::new().decode(0x7fff_ffff), f32::INFINITY);
        assert_eq!(Ibm::new().decode(0x0000_0001), 0.0);
    }
}
