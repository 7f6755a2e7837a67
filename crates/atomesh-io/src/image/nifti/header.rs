//! The 348 bytes of a NIfTI-1 header.

use std::io::Read;

use super::super::affine::Affine;
use super::super::error::ReadReason;
use super::super::options::GivenFrame;
use super::super::sample_type::{ByteOrder, SampleType};
use super::super::{spelling, stream};
use super::FORMAT;
use super::quaternion::rotation;

/// The bytes of a header.
pub(super) const BYTES: usize = 348;

/// Where the samples of a single file begin at the earliest: the header and four bytes that say
/// whether extensions follow.
pub(super) const FIRST_SAMPLE: u64 = 352;

/// Where the entries that are used stand in the header, in bytes.
pub(super) mod at {
    pub const DIM: usize = 40;
    pub const DATATYPE: usize = 70;
    pub const BITPIX: usize = 72;
    pub const PIXDIM: usize = 76;
    pub const VOX_OFFSET: usize = 108;
    pub const SCL_SLOPE: usize = 112;
    pub const SCL_INTER: usize = 116;
    pub const XYZT_UNITS: usize = 123;
    pub const QFORM_CODE: usize = 252;
    pub const SFORM_CODE: usize = 254;
    pub const QUATERN_B: usize = 256;
    pub const QOFFSET_X: usize = 268;
    pub const SROW_X: usize = 280;
    pub const MAGIC: usize = 344;
}

/// What a header says about the samples.
pub(super) struct Header {
    /// Samples along x, y (and z).
    pub shape: Vec<usize>,
    pub sample_type: SampleType,
    pub byte_order: ByteOrder,
    /// The bytes before the first sample.
    pub offset: u64,
    /// Slope and intercept, if they change anything.
    pub scale: Option<(f64, f64)>,
    /// Sample indices to world coordinates.
    pub affine: Affine,
    /// The unit of these, if it is named.
    pub unit: Option<&'static str>,
}

/// The error for an entry of the header.
pub(super) fn wrong(
    field: &'static str,
    value: impl ToString,
    expected: &'static str,
) -> ReadReason {
    ReadReason::Header { format: FORMAT, field, value: value.to_string(), expected }
}

impl Header {
    /// Reads and checks a header.
    pub fn read(source: &mut dyn Read) -> Result<Self, ReadReason> {
        let mut bytes = [0; BYTES];
        let filled = stream::fill(source, &mut bytes)?;
        if filled < BYTES {
            return Err(wrong("length", format!("{filled} bytes"), "348 bytes"));
        }
        Self::parse(&bytes)
    }

    /// The same, with an affine that is sound where the caller puts something else in its place.
    pub fn with_given(self, given: GivenFrame) -> Self {
        Self { affine: self.affine.with_given(given), ..self }
    }

    /// Reads a header from its bytes.
    pub fn parse(bytes: &[u8; BYTES]) -> Result<Self, ReadReason> {
        let byte_order =
            match (i32::from_le_bytes(part(bytes, 0)), i32::from_be_bytes(part(bytes, 0))) {
                (348, _) => ByteOrder::Little,
                (_, 348) => ByteOrder::Big,
                (540, _) | (_, 540) => {
                    return Err(wrong(
                        "sizeof_hdr",
                        "540, that of NIfTI-2",
                        "348, that of NIfTI-1",
                    ));
                }
                (other, _) => return Err(wrong("sizeof_hdr", other, "348")),
            };
        let entries = Entries { bytes, byte_order };
        match &part::<4>(bytes, at::MAGIC) {
            b"n+1\0" => {}
            b"ni1\0" => {
                return Err(wrong("magic", "\"ni1\", a header without samples", "\"n+1\""));
            }
            other => {
                let text = format!("\"{}\"", other.escape_ascii());
                return Err(wrong("magic", text, "\"n+1\": is this an ANALYZE file?"));
            }
        }
        let shape = entries.shape()?;
        Ok(Self {
            sample_type: entries.sample_type()?,
            byte_order,
            offset: entries.offset()?,
            scale: entries.scale()?,
            affine: entries.affine(shape.len())?,
            // the upper bits are of time
            unit: match bytes[at::XYZT_UNITS] & 7 {
                1 => Some("m"),
                2 => Some("mm"),
                3 => Some("um"),
                _ => None,
            },
            shape,
        })
    }
}

/// `N` bytes from the place `at`, which is inside the header.
fn part<const N: usize>(bytes: &[u8; BYTES], at: usize) -> [u8; N] {
    std::array::from_fn(|k| bytes[at + k])
}

/// The entries of a header by their places.
struct Entries<'a> {
    bytes: &'a [u8; BYTES],
    byte_order: ByteOrder,
}

impl Entries<'_> {
    fn i16(&self, at: usize) -> i16 {
        match self.byte_order {
            ByteOrder::Little => i16::from_le_bytes(part(self.bytes, at)),
            ByteOrder::Big => i16::from_be_bytes(part(self.bytes, at)),
        }
    }

    fn f64(&self, at: usize) -> f64 {
        f64::from(match self.byte_order {
            ByteOrder::Little => f32::from_le_bytes(part(self.bytes, at)),
            ByteOrder::Big => f32::from_be_bytes(part(self.bytes, at)),
        })
    }

    /// The shape: two or three axes; any further ones must have a single sample.
    fn shape(&self) -> Result<Vec<usize>, ReadReason> {
        let axis_count = self.i16(at::DIM);
        if !(1..=7).contains(&axis_count) {
            return Err(wrong("dim[0]", axis_count, "1 to 7 axes"));
        }
        let mut shape = Vec::new();
        for axis in 1..=axis_count as usize {
            const NAMES: [&str; 7] =
                ["dim[1]", "dim[2]", "dim[3]", "dim[4]", "dim[5]", "dim[6]", "dim[7]"];
            let count = self.i16(at::DIM + 2 * axis);
            if count < 1 {
                return Err(wrong(NAMES[axis - 1], count, "1 to 32767 samples"));
            }
            shape.push(count as usize);
        }
        let volume_count = shape.iter().skip(3).map(|&n| n as u64).product();
        if volume_count > 1 {
            return Err(ReadReason::Volumes { count: volume_count });
        }
        if axis_count == 1 {
            return Err(wrong("dim[0]", 1, "2 or 3 axes"));
        }
        shape.truncate(3);
        Ok(shape)
    }

    fn sample_type(&self) -> Result<SampleType, ReadReason> {
        let unsupported = |found: &str| {
            Err(ReadReason::Unsupported {
                format: FORMAT,
                found: found.into(),
                expected: "integers and floats of 8 to 64 bits",
            })
        };
        let code = self.i16(at::DATATYPE);
        if let Some(sample_type) = spelling::of_nifti(code) {
            return Ok(sample_type);
        }
        match code {
            1 => unsupported("single bits"),
            32 | 1792 | 2048 => unsupported("complex numbers"),
            128 | 2304 => unsupported("colours"),
            1536 => unsupported("floats of 128 bits"),
            code => Err(wrong("datatype", code, "a code that NIfTI-1 defines")),
        }
    }

    /// The bytes before the samples; 0, which some writers leave there, means the least possible.
    fn offset(&self) -> Result<u64, ReadReason> {
        let offset = self.f64(at::VOX_OFFSET);
        if offset == 0.0 {
            Ok(FIRST_SAMPLE)
        } else if offset >= FIRST_SAMPLE as f64 && offset < 1e18 && offset.fract() == 0.0 {
            Ok(offset as u64)
        } else {
            Err(wrong("vox_offset", offset, "a whole number from 352"))
        }
    }

    /// Slope and intercept; a slope of 0 or NaN stands for none.
    fn scale(&self) -> Result<Option<(f64, f64)>, ReadReason> {
        let (slope, intercept) = (self.f64(at::SCL_SLOPE), self.f64(at::SCL_INTER));
        if slope == 0.0 || slope.is_nan() {
            Ok(None)
        } else if slope.is_infinite() {
            Err(wrong("scl_slope", slope, "a finite number"))
        } else if !intercept.is_finite() {
            Err(wrong("scl_inter", intercept, "a finite number"))
        } else {
            Ok(if (slope, intercept) == (1.0, 0.0) { None } else { Some((slope, intercept)) })
        }
    }

    /// Sample spacing; 0 stands for 1 and a sign means nothing, as in the format's own library.
    /// `axis_count` of them are used, and the others are 1.
    fn pixdim(&self, axis_count: usize) -> Result<[f64; 3], ReadReason> {
        const NAMES: [&str; 3] = ["pixdim[1]", "pixdim[2]", "pixdim[3]"];
        let mut spacing = [1.0; 3];
        for axis in 0..axis_count {
            let value = self.f64(at::PIXDIM + 4 * (axis + 1)).abs();
            if !value.is_finite() {
                return Err(wrong(NAMES[axis], value, "a finite number"));
            }
            spacing[axis] = if value == 0.0 { 1.0 } else { value };
        }
        Ok(spacing)
    }

    /// The sform if its code is above 0, else the qform if its code is, else spacing alone.
    fn affine(&self, axis_count: usize) -> Result<Affine, ReadReason> {
        if self.i16(at::SFORM_CODE) > 0 {
            return Ok(Affine {
                matrix: std::array::from_fn(|r| {
                    std::array::from_fn(|c| self.f64(at::SROW_X + 16 * r + 4 * c))
                }),
                origin: std::array::from_fn(|r| self.f64(at::SROW_X + 16 * r + 12)),
            });
        }
        let spacing = self.pixdim(axis_count)?;
        if self.i16(at::QFORM_CODE) <= 0 {
            return Ok(Affine::scaling(spacing));
        }
        let quaternion = std::array::from_fn(|k| self.f64(at::QUATERN_B + 4 * k));
        let mut matrix = rotation(quaternion)?;
        let qfac = if self.f64(at::PIXDIM) < 0.0 { -1.0 } else { 1.0 };
        for row in &mut matrix {
            row[2] *= qfac;
            for c in 0..3 {
                row[c] *= spacing[c];
            }
        }
        Ok(Affine { matrix, origin: std::array::from_fn(|r| self.f64(at::QOFFSET_X + 4 * r)) })
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::view::ImageView;
    use super::super::encode::encode;
    use super::*;
    use atomesh::image::{Frame, Image, Samples};

    /// A header for 4 × 3 × 2 bytes, changed by `edit`, and read.
    fn parse(edit: impl FnOnce(&mut [u8; BYTES])) -> Result<Header, ReadReason> {
        let frame = Frame::new([4, 3, 2]).unwrap();
        let image = Image::new(frame, Samples::U8(vec![0; 24].into())).unwrap();
        let encoded = encode(&ImageView::of(&image), 2, 8).unwrap();
        let mut bytes = std::array::from_fn(|k| encoded[k]);
        edit(&mut bytes);
        Header::parse(&bytes)
    }

    fn put<const N: usize>(at: usize, value: [u8; N]) -> impl FnOnce(&mut [u8; BYTES]) {
        move |bytes| bytes[at..at + N].copy_from_slice(&value)
    }

    fn message(edit: impl FnOnce(&mut [u8; BYTES])) -> String {
        match parse(edit) {
            Ok(_) => "no error".into(),
            Err(reason) => reason.to_string(),
        }
    }

    #[test]
    fn wrong_entries_are_named_with_their_values() {
        let dim = |k: usize, n: i16| put(at::DIM + 2 * k, n.to_le_bytes());
        let single = |at: usize, x: f32| put(at, x.to_le_bytes());
        for (text, part) in [
            (message(dim(0, 0)), "dim[0] is 0"),
            (message(dim(0, 8)), "dim[0] is 8"),
            (message(dim(0, 1)), "dim[0] is 1"),
            (message(dim(2, -3)), "dim[2] is -3"),
            (message(dim(3, 0)), "dim[3] is 0"),
            (message(put(0, 540i32.to_le_bytes())), "NIfTI-2"),
            (message(put(0, 540i32.to_be_bytes())), "NIfTI-2"),
            (message(put(0, [0; 4])), "sizeof_hdr is 0"),
            (message(put(at::MAGIC, *b"ni1\0")), "header without samples"),
            (message(put(at::MAGIC, [0; 4])), "ANALYZE"),
            (message(put(at::DATATYPE, 128i16.to_le_bytes())), "colours"),
            (message(put(at::DATATYPE, 32i16.to_le_bytes())), "complex"),
            (message(put(at::DATATYPE, 77i16.to_le_bytes())), "datatype is 77"),
            (message(single(at::VOX_OFFSET, 300.0)), "vox_offset is 300"),
            (message(single(at::VOX_OFFSET, f32::NAN)), "vox_offset is NaN"),
            (message(single(at::VOX_OFFSET, 3e38)), "vox_offset"),
            (message(single(at::SCL_SLOPE, f32::INFINITY)), "scl_slope is inf"),
            (message(single(at::SCL_INTER, f32::NAN)), "scl_inter is NaN"),
        ] {
            assert!(text.contains(part), "{text} lacks {part}");
        }
    }

    #[test]
    fn further_axes_are_allowed_where_they_hold_one_volume() {
        let axes = |count: i16, fourth: i16, fifth: i16| {
            move |bytes: &mut [u8; BYTES]| {
                put(at::DIM, count.to_le_bytes())(bytes);
                put(at::DIM + 8, fourth.to_le_bytes())(bytes);
                put(at::DIM + 10, fifth.to_le_bytes())(bytes);
            }
        };
        assert_eq!(parse(axes(4, 1, 99)).unwrap().shape, [4, 3, 2]);
        assert_eq!(parse(axes(5, 1, 1)).unwrap().shape, [4, 3, 2]);
        assert!(matches!(parse(axes(5, 4, 3)), Err(ReadReason::Volumes { count: 12 })));
        assert_eq!(parse(axes(2, 1, 1)).unwrap().shape, [4, 3]);
    }

    #[test]
    fn the_unit_is_that_of_space_alone() {
        for (code, unit) in
            [(0, None), (1, Some("m")), (2, Some("mm")), (3 | 8, Some("um")), (8, None)]
        {
            assert_eq!(parse(put(at::XYZT_UNITS, [code])).unwrap().unit, unit, "{code}");
        }
    }

    #[test]
    fn a_slope_of_zero_or_nan_or_one_does_not_scale() {
        for slope in [0.0, f32::NAN, 1.0] {
            assert_eq!(parse(put(at::SCL_SLOPE, slope.to_le_bytes())).unwrap().scale, None);
        }
        let scale = parse(put(at::SCL_SLOPE, 2f32.to_le_bytes())).unwrap().scale;
        assert_eq!(scale, Some((2.0, 0.0)));
    }

    #[test]
    fn the_frame_is_the_sform_then_the_qform_then_the_spacing() {
        let codes = |sform: i16, qform: i16| {
            move |bytes: &mut [u8; BYTES]| {
                put(at::SFORM_CODE, sform.to_le_bytes())(bytes);
                put(at::QFORM_CODE, qform.to_le_bytes())(bytes);
                put(at::SROW_X + 12, 5f32.to_le_bytes())(bytes);
                put(at::QOFFSET_X, 7f32.to_le_bytes())(bytes);
                put(at::PIXDIM + 4, (-3f32).to_le_bytes())(bytes);
                put(at::PIXDIM + 8, 0f32.to_le_bytes())(bytes);
            }
        };
        let affine = |sform, qform| parse(codes(sform, qform)).unwrap().affine;
        assert_eq!((affine(1, 1).origin[0], affine(1, 1).matrix[0][0]), (5.0, 1.0));
        assert_eq!((affine(0, 1).origin[0], affine(0, 1).matrix[0][0]), (7.0, 3.0));
        assert_eq!((affine(0, 0).origin[0], affine(0, 0).matrix[0][0]), (0.0, 3.0));
        assert_eq!(affine(0, 0).matrix[1][1], 1.0);
        let nan = |bytes: &mut [u8; BYTES]| {
            codes(0, 0)(bytes);
            put(at::PIXDIM + 12, f32::NAN.to_le_bytes())(bytes);
        };
        assert!(message(nan).contains("pixdim[3] is NaN"));
    }
}
