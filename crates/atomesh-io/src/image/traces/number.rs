//! How samples of traces are written, IBM's floating point among them.

/// The type of the samples in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Number {
    Ibm,
    I32,
    I16,
    F32,
    F64,
    I8,
    U32,
    U16,
    U8,
}

impl Number {
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

/// What a fraction of 24 bits is multiplied by, for each of IBM's exponents: 16^(e − 64) / 2²⁴.
fn ibm_scales() -> [f64; 128] {
    std::array::from_fn(|exponent| 2f64.powi(4 * (exponent as i32 - 64) - 24))
}

/// Decodes IBM's single precision: a sign, 7 bits of exponent to 16, a fraction of 24 bits. Exact
/// where single precision has the value; beyond its range infinite.
pub(super) struct Ibm([f64; 128]);

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
