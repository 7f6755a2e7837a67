//! Where the entries of a NIfTI header stand, in bytes, in either version, and their numbers.

use super::super::sample_type::ByteOrder;

/// Where the entries that are used stand.
pub(super) struct Places {
    pub dim: usize,
    pub datatype: usize,
    pub pixdim: usize,
    pub vox_offset: usize,
    pub scl_slope: usize,
    pub scl_inter: usize,
    pub xyzt_units: usize,
    pub qform_code: usize,
    pub sform_code: usize,
    pub quatern_b: usize,
    pub qoffset_x: usize,
    pub srow_x: usize,
    pub magic: usize,
}

/// NIfTI-1: 348 bytes.
pub(super) const FIRST: Places = Places {
    dim: 40,
    datatype: 70,
    pixdim: 76,
    vox_offset: 108,
    scl_slope: 112,
    scl_inter: 116,
    xyzt_units: 123,
    qform_code: 252,
    sform_code: 254,
    quatern_b: 256,
    qoffset_x: 268,
    srow_x: 280,
    magic: 344,
};

/// NIfTI-2: 540 bytes.
pub(super) const SECOND: Places = Places {
    dim: 16,
    datatype: 12,
    pixdim: 104,
    vox_offset: 168,
    scl_slope: 176,
    scl_inter: 184,
    xyzt_units: 500,
    qform_code: 344,
    sform_code: 348,
    quatern_b: 352,
    qoffset_x: 376,
    srow_x: 400,
    magic: 4,
};

/// The entries of a header by their places.
pub(super) struct Entries<'a> {
    pub bytes: &'a [u8],
    pub byte_order: ByteOrder,
    /// Whether this is NIfTI-2, whose numbers are wider.
    pub is_second: bool,
}

impl Entries<'_> {
    /// Where things stand in this version.
    pub fn places(&self) -> &'static Places {
        if self.is_second { &SECOND } else { &FIRST }
    }

    /// `N` bytes from a place inside the header, the least significant first.
    fn part<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut part: [u8; N] = std::array::from_fn(|k| self.bytes[at + k]);
        if self.byte_order == ByteOrder::Big {
            part.reverse();
        }
        part
    }

    pub fn i16(&self, at: usize) -> i16 {
        i16::from_le_bytes(self.part(at))
    }

    /// The entry `k` of the shape.
    pub fn dim(&self, k: usize) -> i64 {
        match self.is_second {
            true => i64::from_le_bytes(self.part(SECOND.dim + 8 * k)),
            false => self.i16(FIRST.dim + 2 * k).into(),
        }
    }

    /// A code of the frame or the units; the upper bits of the units are of time.
    pub fn code(&self, at: usize) -> i32 {
        match self.is_second {
            true => i32::from_le_bytes(self.part(at)),
            false if at == FIRST.xyzt_units => self.bytes[at].into(),
            false => self.i16(at).into(),
        }
    }

    /// The real number `k` of those that begin at a place.
    pub fn real(&self, at: usize, k: usize) -> f64 {
        match self.is_second {
            true => f64::from_le_bytes(self.part(at + 8 * k)),
            false => f32::from_le_bytes(self.part(at + 4 * k)).into(),
        }
    }

    /// The bytes before the samples, as stored.
    pub fn vox_offset(&self) -> f64 {
        match self.is_second {
            true => i64::from_le_bytes(self.part(SECOND.vox_offset)) as f64,
            false => self.real(FIRST.vox_offset, 0),
        }
    }
}
