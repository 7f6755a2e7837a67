//! What a NIfTI header says, 348 bytes of NIfTI-1 or 540 of NIfTI-2.

use std::io::Read;

use super::super::affine::Affine;
use super::super::error::ReadReason;
use super::super::note::ReadNote;
use super::super::options::GivenFrame;
use super::super::sample_type::{ByteOrder, SampleType};
use super::super::{spelling, stream};
use super::FORMAT;
use super::places::Entries;
#[cfg(test)]
use super::places::FIRST;
use super::quaternion::rotation;

/// The bytes of a header of NIfTI-1.
pub(super) const FIRST_BYTES: usize = 348;

/// The bytes of a header of NIfTI-2.
const SECOND_BYTES: usize = 540;

/// Where the samples of a single file of NIfTI-1 begin at the earliest: the header and four bytes that say
/// whether extensions follow.
pub(super) const FIRST_SAMPLE: u64 = 352;

/// What a header says about the samples.
#[derive(Debug)]
pub(super) struct Header {
    /// The bytes that it takes.
    pub bytes: u64,
    /// Whether the samples are in a file of their own.
    pub is_pair: bool,
    /// Samples along x, y (and z).
    pub shape: Vec<usize>,
    /// How many such images there are.
    pub volumes: u64,
    pub sample_type: SampleType,
    /// Values a sample: 3 or 4 of colours.
    pub channels: usize,
    pub byte_order: ByteOrder,
    /// The bytes before the first sample.
    pub offset: u64,
    /// Slope and intercept, if they change anything.
    pub scale: Option<(f64, f64)>,
    /// Sample indices to world coordinates.
    pub affine: Affine,
    /// The unit of these, if it is named.
    pub unit: Option<&'static str>,
    pub notes: Vec<ReadNote>,
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
    /// Reads and checks a header of either version.
    pub fn read(source: &mut dyn Read) -> Result<Self, ReadReason> {
        let mut bytes = [0; SECOND_BYTES];
        let (first, more) = bytes.split_at_mut(FIRST_BYTES);
        let filled = stream::fill(source, first)?;
        if filled < FIRST_BYTES {
            return Err(wrong("length", format!("{filled} bytes"), "348 bytes"));
        }
        let is_second = matches!(size(first), Some((SECOND_BYTES, _)));
        if is_second {
            let filled = FIRST_BYTES + stream::fill(source, more)?;
            if filled < SECOND_BYTES {
                return Err(wrong("length", format!("{filled} bytes"), "540 bytes"));
            }
        }
        Self::parse(if is_second { &bytes } else { &bytes[..FIRST_BYTES] })
    }

    /// The same, with an affine that is sound where the caller puts something else in its place.
    pub fn with_given(self, given: GivenFrame) -> Self {
        Self { affine: self.affine.with_given(given), ..self }
    }

    /// Reads a header from its bytes, 348 or 540.
    pub fn parse(bytes: &[u8]) -> Result<Self, ReadReason> {
        let (header_bytes, byte_order) =
            size(bytes).filter(|(n, _)| *n == bytes.len()).ok_or_else(|| {
                wrong(
                    "sizeof_hdr",
                    i32::from_le_bytes(std::array::from_fn(|k| bytes[k])),
                    "348, or 540 of NIfTI-2",
                )
            })?;
        let entries = Entries { bytes, byte_order, is_second: header_bytes == SECOND_BYTES };
        let is_pair = entries.is_pair()?;
        let (shape, volumes) = entries.shape()?;
        let (sample_type, channels) = entries.sample_type()?;
        let mut notes = Vec::new();
        let unit = match entries.code(entries.places().xyzt_units) & 7 {
            1 => Some("m"),
            2 => Some("mm"),
            3 => Some("um"),
            _ => None,
        };
        Ok(Self {
            bytes: header_bytes as u64,
            is_pair,
            volumes,
            sample_type,
            channels,
            byte_order,
            offset: entries.offset(is_pair)?,
            scale: if channels == 1 { entries.scale()? } else { None },
            affine: entries.affine(shape.len(), &mut notes)?,
            unit,
            shape,
            notes,
        })
    }
}

/// The size that a header states of itself, if it is one of the two, and the order of its bytes.
fn size(bytes: &[u8]) -> Option<(usize, ByteOrder)> {
    let word: [u8; 4] = bytes.first_chunk().copied()?;
    let known = |n: i32| [FIRST_BYTES, SECOND_BYTES].into_iter().find(|&size| n == size as i32);
    let little = known(i32::from_le_bytes(word)).map(|size| (size, ByteOrder::Little));
    little.or(known(i32::from_be_bytes(word)).map(|size| (size, ByteOrder::Big)))
}

impl Entries<'_> {
    /// Whether the samples are in another file, as the magic word says.
    fn is_pair(&self) -> Result<bool, ReadReason> {
        let end = if self.is_second { 8 } else { 4 };
        let magic = &self.bytes[self.places().magic..][..end];
        let version = if self.is_second { b'2' } else { b'1' };
        match *magic {
            [b'n', b'+', v, 0, ..] if v == version => Ok(false),
            [b'n', b'i', v, 0, ..] if v == version => Ok(true),
            _ => {
                let text = format!("\"{}\"", magic.escape_ascii());
                Err(wrong("magic", text, "\"n+1\" or \"n+2\": is this an ANALYZE file?"))
            }
        }
    }

    /// The shape, two or three axes, and how many such images further axes hold.
    fn shape(&self) -> Result<(Vec<usize>, u64), ReadReason> {
        let axis_count = self.dim(0);
        if !(1..=7).contains(&axis_count) {
            return Err(wrong("dim[0]", axis_count, "1 to 7 axes"));
        }
        let mut shape = Vec::new();
        for axis in 1..=axis_count as usize {
            const NAMES: [&str; 7] =
                ["dim[1]", "dim[2]", "dim[3]", "dim[4]", "dim[5]", "dim[6]", "dim[7]"];
            let count = usize::try_from(self.dim(axis)).ok().filter(|&n| n > 0);
            let count =
                count.ok_or_else(|| wrong(NAMES[axis - 1], self.dim(axis), "1 sample or more"))?;
            shape.push(count);
        }
        if axis_count == 1 {
            return Err(wrong("dim[0]", 1, "2 or 3 axes"));
        }
        let volumes = shape.iter().skip(3).try_fold(1u64, |n, &m| n.checked_mul(m as u64));
        let volumes =
            volumes.ok_or_else(|| wrong("dim[4] ... dim[7]", "huge", "volumes that fit a file"))?;
        shape.truncate(3);
        Ok((shape, volumes))
    }

    /// The type of a value, and how many there are a sample.
    fn sample_type(&self) -> Result<(SampleType, usize), ReadReason> {
        let unsupported = |found: &str| {
            Err(ReadReason::Unsupported {
                format: FORMAT,
                found: found.into(),
                expected: "integers and floats of 8 to 64 bits, and colours of 8",
            })
        };
        let code = self.i16(self.places().datatype);
        if let Some(sample_type) = spelling::of_nifti(code) {
            return Ok((sample_type, 1));
        }
        match code {
            1 => unsupported("single bits"),
            32 | 1792 | 2048 => unsupported("complex numbers"),
            128 => Ok((SampleType::U8, 3)),
            2304 => Ok((SampleType::U8, 4)),
            1536 => unsupported("floats of 128 bits"),
            code => Err(wrong("datatype", code, "a code that NIfTI defines")),
        }
    }

    /// The bytes before the samples; 0, which some writers leave there, means the least possible.
    fn offset(&self, is_pair: bool) -> Result<u64, ReadReason> {
        let least = match (is_pair, self.is_second) {
            (true, _) => 0,
            (false, false) => FIRST_SAMPLE,
            (false, true) => SECOND_BYTES as u64 + 4,
        };
        let offset = self.vox_offset();
        if offset == 0.0 {
            Ok(least)
        } else if offset >= least as f64 && offset < 1e18 && offset.fract() == 0.0 {
            Ok(offset as u64)
        } else {
            Err(wrong(
                "vox_offset",
                offset,
                match least {
                    0 => "a whole number from 0",
                    FIRST_SAMPLE => "a whole number from 352",
                    _ => "a whole number from 544",
                },
            ))
        }
    }

    /// Slope and intercept; a slope of 0 or NaN stands for none.
    fn scale(&self) -> Result<Option<(f64, f64)>, ReadReason> {
        let places = self.places();
        let (slope, intercept) = (self.real(places.scl_slope, 0), self.real(places.scl_inter, 0));
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
            let value = self.real(self.places().pixdim, axis + 1).abs();
            if !value.is_finite() {
                return Err(wrong(NAMES[axis], value, "a finite number"));
            }
            spacing[axis] = if value == 0.0 { 1.0 } else { value };
        }
        Ok(spacing)
    }

    /// The sform if its code is above 0 and it is not all 0, else the qform if its code is, else spacing alone.
    fn affine(&self, axis_count: usize, notes: &mut Vec<ReadNote>) -> Result<Affine, ReadReason> {
        let places = self.places();
        let has_qform = self.code(places.qform_code) > 0;
        if self.code(places.sform_code) > 0 {
            let row = |r: usize, c: usize| self.real(places.srow_x, 4 * r + c);
            let matrix: [[f64; 3]; 3] = std::array::from_fn(|r| std::array::from_fn(|c| row(r, c)));
            if matrix.as_flattened().iter().any(|&x| x != 0.0) {
                return Ok(Affine { matrix, origin: std::array::from_fn(|r| row(r, 3)) });
            }
            let taken = if has_qform { "the qform" } else { "pixdim" };
            notes.push(ReadNote::NoMatrix { taken });
        }
        let spacing = self.pixdim(axis_count)?;
        if !has_qform {
            return Ok(Affine::scaling(spacing));
        }
        let quaternion = std::array::from_fn(|k| self.real(places.quatern_b, k));
        let mut matrix = rotation(quaternion)?;
        let qfac = if self.real(places.pixdim, 0) < 0.0 { -1.0 } else { 1.0 };
        for row in &mut matrix {
            row[2] *= qfac;
            for c in 0..3 {
                row[c] *= spacing[c];
            }
        }
        Ok(Affine { matrix, origin: std::array::from_fn(|r| self.real(places.qoffset_x, r)) })
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::view::ImageView;
    use super::super::encode::encode;
    use super::*;
    use atomesh::image::{Frame, Image, Samples};

    /// A header for 4 × 3 × 2 bytes, changed by `edit`, and read.
    fn parse(edit: impl FnOnce(&mut [u8; FIRST_BYTES])) -> Result<Header, ReadReason> {
        let frame = Frame::new([4, 3, 2]).unwrap();
        let image = Image::new(frame, Samples::U8(vec![0; 24].into())).unwrap();
        let encoded = encode(&ImageView::of(&image), 2, 8).unwrap();
        let mut bytes = std::array::from_fn(|k| encoded[k]);
        edit(&mut bytes);
        Header::parse(&bytes)
    }

    fn put<const N: usize>(at: usize, value: [u8; N]) -> impl FnOnce(&mut [u8; FIRST_BYTES]) {
        move |bytes| bytes[at..at + N].copy_from_slice(&value)
    }

    fn message(edit: impl FnOnce(&mut [u8; FIRST_BYTES])) -> String {
        match parse(edit) {
            Ok(_) => "no error".into(),
            Err(reason) => reason.to_string(),
        }
    }

    #[test]
    fn wrong_entries_are_named_with_their_values() {
        let dim = |k: usize, n: i16| put(FIRST.dim + 2 * k, n.to_le_bytes());
        let single = |at: usize, x: f32| put(at, x.to_le_bytes());
        for (text, part) in [
            (message(dim(0, 0)), "dim[0] is 0"),
            (message(dim(0, 8)), "dim[0] is 8"),
            (message(dim(0, 1)), "dim[0] is 1"),
            (message(dim(2, -3)), "dim[2] is -3"),
            (message(dim(3, 0)), "dim[3] is 0"),
            (message(put(0, [0; 4])), "sizeof_hdr is 0"),
            (message(put(FIRST.magic, [0; 4])), "ANALYZE"),
            (message(put(FIRST.datatype, 1536i16.to_le_bytes())), "128 bits"),
            (message(put(FIRST.datatype, 32i16.to_le_bytes())), "complex"),
            (message(put(FIRST.datatype, 77i16.to_le_bytes())), "datatype is 77"),
            (message(single(FIRST.vox_offset, 300.0)), "vox_offset is 300"),
            (message(single(FIRST.vox_offset, f32::NAN)), "vox_offset is NaN"),
            (message(single(FIRST.vox_offset, 3e38)), "vox_offset"),
            (message(single(FIRST.scl_slope, f32::INFINITY)), "scl_slope is inf"),
            (message(single(FIRST.scl_inter, f32::NAN)), "scl_inter is NaN"),
        ] {
            assert!(text.contains(part), "{text} lacks {part}");
        }
    }

    #[test]
    fn further_axes_are_allowed_where_they_hold_one_volume() {
        let axes = |count: i16, fourth: i16, fifth: i16| {
            move |bytes: &mut [u8; FIRST_BYTES]| {
                put(FIRST.dim, count.to_le_bytes())(bytes);
                put(FIRST.dim + 8, fourth.to_le_bytes())(bytes);
                put(FIRST.dim + 10, fifth.to_le_bytes())(bytes);
            }
        };
        assert_eq!(parse(axes(4, 1, 99)).unwrap().shape, [4, 3, 2]);
        assert_eq!(parse(axes(5, 1, 1)).unwrap().shape, [4, 3, 2]);
        assert_eq!(parse(axes(5, 4, 3)).unwrap().volumes, 12);
        assert_eq!(parse(axes(2, 1, 1)).unwrap().shape, [4, 3]);
        assert!(parse(put(FIRST.magic, *b"ni1\0")).unwrap().is_pair);
    }

    #[test]
    fn the_unit_is_that_of_space_alone() {
        for (code, unit) in
            [(0, None), (1, Some("m")), (2, Some("mm")), (3 | 8, Some("um")), (8, None)]
        {
            assert_eq!(parse(put(FIRST.xyzt_units, [code])).unwrap().unit, unit, "{code}");
        }
    }

    #[test]
    fn a_slope_of_zero_or_nan_or_one_does_not_scale() {
        for slope in [0.0, f32::NAN, 1.0] {
            assert_eq!(parse(put(FIRST.scl_slope, slope.to_le_bytes())).unwrap().scale, None);
        }
        let scale = parse(put(FIRST.scl_slope, 2f32.to_le_bytes())).unwrap().scale;
        assert_eq!(scale, Some((2.0, 0.0)));
    }

    #[test]
    fn the_frame_is_the_sform_then_the_qform_then_the_spacing() {
        let codes = |sform: i16, qform: i16| {
            move |bytes: &mut [u8; FIRST_BYTES]| {
                put(FIRST.sform_code, sform.to_le_bytes())(bytes);
                put(FIRST.qform_code, qform.to_le_bytes())(bytes);
                put(FIRST.srow_x + 12, 5f32.to_le_bytes())(bytes);
                put(FIRST.qoffset_x, 7f32.to_le_bytes())(bytes);
                put(FIRST.pixdim + 4, (-3f32).to_le_bytes())(bytes);
                put(FIRST.pixdim + 8, 0f32.to_le_bytes())(bytes);
            }
        };
        let affine = |sform, qform| parse(codes(sform, qform)).unwrap().affine;
        assert_eq!((affine(1, 1).origin[0], affine(1, 1).matrix[0][0]), (5.0, 1.0));
        assert_eq!((affine(0, 1).origin[0], affine(0, 1).matrix[0][0]), (7.0, 3.0));
        assert_eq!((affine(0, 0).origin[0], affine(0, 0).matrix[0][0]), (0.0, 3.0));
        assert_eq!(affine(0, 0).matrix[1][1], 1.0);
        let nan = |bytes: &mut [u8; FIRST_BYTES]| {
            codes(0, 0)(bytes);
            put(FIRST.pixdim + 12, f32::NAN.to_le_bytes())(bytes);
        };
        assert!(message(nan).contains("pixdim[3] is NaN"));
    }

    #[test]
    fn a_matrix_of_zeros_counts_for_nothing() {
        let zeros = |bytes: &mut [u8; FIRST_BYTES]| {
            put(FIRST.sform_code, 2i16.to_le_bytes())(bytes);
            put(FIRST.qform_code, 0i16.to_le_bytes())(bytes);
            bytes[FIRST.srow_x..FIRST.srow_x + 48].fill(0);
            put(FIRST.pixdim + 4, 3f32.to_le_bytes())(bytes);
        };
        let header = parse(zeros).unwrap();
        assert_eq!(header.affine, Affine::scaling([3.0, 1.0, 1.0]));
        assert_eq!(header.notes, [ReadNote::NoMatrix { taken: "pixdim" }]);
    }
}
