//! One DICOM image: what its header says, and its samples.

use std::io::{Read, Seek};

use super::super::affine::{Affine, World, wrong};
use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::super::sample_type::ByteOrder;
use super::FORMAT;
use super::data_set::{DataSet, PixelData, Reader, tag};

/// The most bytes that a byte of a run can stand for.
const RUN_RATIO: u64 = 64;

/// How the samples of a slice lie in its file. Slices of a series agree in this.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pixels {
    /// Samples along x and y.
    pub shape: [usize; 2],
    /// Bits that a sample takes.
    pub allocated: u16,
    /// The lowest bits of these, which count.
    pub stored: u16,
    pub is_signed: bool,
    /// Whether the least value is white.
    pub is_inverted: bool,
}

/// The header of a slice.
#[derive(Clone, Debug)]
pub(super) struct Slice {
    pub series: String,
    pub pixels: Pixels,
    /// World units from sample to sample along x and y, if the file says it.
    pub spacing: Option<[f64; 2]>,
    /// The same at the detector of a radiograph.
    pub imager_spacing: Option<[f64; 2]>,
    /// The number in the series, if the file says it.
    pub instance: Option<f64>,
    /// Sample 0 in the world of the file, LPS.
    pub position: Option<[f64; 3]>,
    /// The directions of x and y there.
    pub axes: Option<[[f64; 3]; 2]>,
    pub scale: Scale,
    byte_order: ByteOrder,
    is_run_length: bool,
    place: PixelData,
}

/// What stored numbers are rescaled by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    slope: f64,
    intercept: f64,
}

impl Scale {
    /// The value of a stored number, in single precision.
    pub fn of(&self, stored: i64) -> f32 {
        (stored as f64 * self.slope + self.intercept) as f32
    }
}

fn unsupported(found: impl Into<String>, expected: &'static str) -> ReadReason {
    ReadReason::Unsupported { format: FORMAT, found: found.into(), expected }
}

impl Slice {
    /// Reads the header of an image; none if the file is sound and holds no image.
    pub fn read<R: Read + Seek>(reader: &mut Reader<R>) -> Result<Option<Self>, ReadReason> {
        let set = reader.read()?;
        let (Some(rows), Some(columns)) = (set.short(tag::ROWS), set.short(tag::COLUMNS)) else {
            return Ok(None);
        };
        let frames = set.text(tag::FRAME_COUNT).unwrap_or("1".into());
        if frames != "1" {
            return Err(unsupported(format!("{frames} frames"), "one, a slice of a series"));
        }
        let is_run_length = check_syntax(&set.text(tag::TRANSFER_SYNTAX).unwrap_or_default())?;
        if set.get(tag::MODALITY_TABLE).is_some() {
            return Err(unsupported("a modality look-up table", "a rescale slope and intercept"));
        }
        let pixels = pixels(&set, [columns, rows])?;
        let place = set.pixels.ok_or_else(|| wrong(FORMAT, "pixel data", "missing", "samples"))?;
        let axes = set.decimals::<6>(tag::ORIENTATION, "image orientation (patient)")?;
        let slope = set.decimals(tag::SLOPE, "rescale slope")?.unwrap_or([1.0])[0];
        let intercept = set.decimals(tag::INTERCEPT, "rescale intercept")?.unwrap_or([0.0])[0];
        let slice = Self {
            series: set.text(tag::SERIES).unwrap_or_default(),
            pixels,
            spacing: spacing(&set, tag::PIXEL_SPACING, "pixel spacing")?,
            imager_spacing: spacing(&set, tag::IMAGER_SPACING, "imager pixel spacing")?,
            instance: set.decimals(tag::INSTANCE, "instance number")?.map(|[number]| number),
            position: set.decimals(tag::POSITION, "image position (patient)")?,
            axes: axes.map(|[a, b, c, d, e, f]| [[a, b, c], [d, e, f]]),
            scale: Scale { slope, intercept },
            byte_order: set.byte_order,
            is_run_length,
            place,
        };
        slice.check_size(reader.file_bytes)?;
        Ok(Some(slice))
    }

    /// Whether the samples are numbers as they are stored.
    pub fn is_plain(&self) -> bool {
        self.scale == Scale { slope: 1.0, intercept: 0.0 }
    }

    /// Sample indices to our world, with the given step from slice to slice.
    pub fn affine(&self, step: [f64; 3]) -> Affine {
        let spacing = self.spacing.unwrap_or([1.0; 2]);
        let [x, y] = self.axes.unwrap_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let matrix = std::array::from_fn(|r| [x[r] * spacing[0], y[r] * spacing[1], step[r]]);
        let affine = Affine { matrix, origin: self.position.unwrap_or_default() };
        affine.turned_from(World::LeftPosterior)
    }

    /// Checks that a file of `file_bytes` bytes can hold the samples.
    fn check_size(&self, file_bytes: u64) -> Result<(), ReadReason> {
        let PixelData { start, length } = self.place;
        let there = file_bytes.saturating_sub(start);
        let there = length.map_or(there, |length| there.min(length.into()));
        let ratio = if self.is_run_length { RUN_RATIO } else { 1 };
        let found = there.saturating_mul(ratio) / self.pixels.size() as u64;
        let [nx, ny] = self.pixels.shape;
        let expected = (nx * ny) as u64;
        if found < expected { Err(ReadReason::Truncated { expected, found }) } else { Ok(()) }
    }

    /// Reads the samples as they are stored, least value black.
    pub fn samples<R: Read + Seek>(
        &self,
        reader: &mut Reader<R>,
        memory: Memory,
    ) -> Result<Vec<i64>, ReadReason> {
        let size = self.pixels.size();
        let whole = self.pixels.shape[0] * self.pixels.shape[1] * size;
        let (bytes, byte_order) = match self.place {
            PixelData { start, length: None } if self.is_run_length => (
                unpack_runs(&reader.fragments(start)?, memory.zeros(whole)?, size)?,
                ByteOrder::Little,
            ),
            PixelData { start, length: Some(_) } if !self.is_run_length => {
                (reader.pixel_bytes(start, whole as u64)?, self.byte_order)
            }
            _ => return Err(wrong(FORMAT, "pixel data", "packed otherwise", "as the syntax says")),
        };
        let mut values = Vec::new();
        memory.reserve(&mut values, bytes.len() / size)?;
        for sample in bytes.chunks_exact(size) {
            let fold = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
            let number = match byte_order {
                ByteOrder::Little => sample.iter().rev().fold(0, fold),
                ByteOrder::Big => sample.iter().fold(0, fold),
            };
            values.push(self.pixels.value(number));
        }
        Ok(values)
    }
}

impl Pixels {
    /// The bytes of a sample.
    fn size(&self) -> usize {
        usize::from(self.allocated) / 8
    }

    /// Type and shade for a message.
    pub fn text(&self) -> String {
        let Self { allocated, stored, is_signed, is_inverted, .. } = self;
        let sign = if *is_signed { "signed" } else { "unsigned" };
        let white = if *is_inverted { "least" } else { "greatest" };
        format!("{stored} of {allocated} bits, {sign}, the {white} white")
    }

    /// The value of stored bits.
    fn value(&self, number: u64) -> i64 {
        // bits beyond those that count held drawings in old files
        let unused = 64 - u32::from(self.stored);
        let value = match self.is_signed {
            true => ((number << unused) as i64) >> unused,
            false => (number << unused >> unused) as i64,
        };
        match (self.is_inverted, self.is_signed) {
            (false, _) => value,
            (true, true) => -1 - value,
            (true, false) => (1 << self.stored) - 1 - value,
        }
    }
}

fn pixels(set: &DataSet, shape: [u16; 2]) -> Result<Pixels, ReadReason> {
    let colours = set.short(tag::SAMPLES_PER_PIXEL).unwrap_or(1);
    let photometric = set.text(tag::PHOTOMETRIC).unwrap_or("MONOCHROME2".into());
    let is_inverted = match photometric.as_str() {
        "MONOCHROME1" => true,
        "MONOCHROME2" => false,
        _ => return Err(unsupported(format!("{photometric} samples"), "grey ones")),
    };
    if colours != 1 {
        return Err(unsupported(format!("{colours} values a sample"), "one value a sample"));
    }
    if shape.contains(&0) {
        return Err(wrong(FORMAT, "rows and columns", format!("{shape:?}"), "1 or more"));
    }
    let allocated = set.short(tag::BITS_ALLOCATED).unwrap_or(0);
    if ![8, 16, 32].contains(&allocated) {
        return Err(wrong(FORMAT, "bits allocated", allocated.to_string(), "8, 16 or 32"));
    }
    let stored = set.short(tag::BITS_STORED).unwrap_or(allocated);
    let high = set.short(tag::HIGH_BIT).unwrap_or(stored.wrapping_sub(1));
    if !(1..=allocated).contains(&stored) || high != stored - 1 {
        let value = format!("{stored}, the highest of them {high}");
        return Err(wrong(FORMAT, "bits stored", value, "the lowest of those allocated"));
    }
    Ok(Pixels {
        shape: shape.map(usize::from),
        allocated,
        stored,
        is_signed: set.short(tag::IS_SIGNED) == Some(1),
        is_inverted,
    })
}

/// A spacing along x and y; the file has that between rows, along y, first.
fn spacing(set: &DataSet, tag: u32, name: &'static str) -> Result<Option<[f64; 2]>, ReadReason> {
    let spacing = set.decimals::<2>(tag, name)?;
    if let Some(spacing) = spacing.filter(|s| s.iter().any(|&s| s <= 0.0)) {
        return Err(wrong(FORMAT, name, format!("{spacing:?}"), "numbers above 0"));
    }
    Ok(spacing.map(|[y, x]| [x, y]))
}

/// Whether a transfer syntax packs samples by run lengths.
///
/// # Errors
/// If it packs them in a way that is not read.
fn check_syntax(syntax: &str) -> Result<bool, ReadReason> {
    let name = match syntax {
        "1.2.840.10008.1.2" | "1.2.840.10008.1.2.1" | "1.2.840.10008.1.2.2" => return Ok(false),
        "1.2.840.10008.1.2.5" => return Ok(true),
        "1.2.840.10008.1.2.4.50" | "1.2.840.10008.1.2.4.51" => "JPEG",
        "1.2.840.10008.1.2.4.57" | "1.2.840.10008.1.2.4.70" => "lossless JPEG",
        "1.2.840.10008.1.2.4.80" | "1.2.840.10008.1.2.4.81" => "JPEG-LS",
        "1.2.840.10008.1.2.4.90" | "1.2.840.10008.1.2.4.91" => "JPEG 2000",
        _ => "an unknown way",
    };
    Err(unsupported(
        format!("samples packed by {name} (transfer syntax {syntax:?})"),
        "plain or run length: unpack them first, as by gdcmconv --raw",
    ))
}

/// Unpacks a frame of run lengths (PS3.5, annex G) to samples with the least byte first, into all of
/// `bytes`. There is a segment for each byte of a sample, the most significant first.
fn unpack_runs(packed: &[u8], mut bytes: Vec<u8>, size: usize) -> Result<Vec<u8>, ReadReason> {
    let whole = bytes.len();
    let bad =
        |value: &str| wrong(FORMAT, "run lengths", value, "a segment for each byte of a sample");
    let word = |k: usize| {
        let bytes = packed.get(4 * k..)?.first_chunk()?;
        Some(u32::from_le_bytes(*bytes) as usize)
    };
    if word(0) != Some(size) || packed.len() < 64 {
        return Err(bad("other segments"));
    }
    for segment in 0..size {
        let runs = word(1 + segment).and_then(|start| packed.get(start..));
        let runs = runs.ok_or_else(|| bad("a segment outside"))?;
        let mut places = (size - 1 - segment..whole).step_by(size);
        unpack_segment(runs, &mut |byte| match places.next() {
            Some(place) => {
                bytes[place] = byte;
                true
            }
            None => false,
        });
        if places.next().is_some() {
            return Err(bad("a segment cut short"));
        }
    }
    Ok(bytes)
}

/// Gives the bytes of a segment to `put` until it wants no more, or they end.
fn unpack_segment(runs: &[u8], put: &mut dyn FnMut(u8) -> bool) {
    let mut rest = runs;
    while let [control, after @ ..] = rest {
        rest = match *control {
            count @ 0..=127 => {
                let count = (usize::from(count) + 1).min(after.len());
                if !after[..count].iter().all(|&byte| put(byte)) {
                    return;
                }
                &after[count..]
            }
            128 => after,
            count => {
                let Some((&byte, after)) = after.split_first() else { return };
                if !(0..257 - u16::from(count)).all(|_| put(byte)) {
                    return;
                }
                after
            }
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stored_bits_become_values_of_either_sign_and_shade() {
        let of = |stored, is_signed, is_inverted| Pixels {
            shape: [1, 1],
            allocated: 16,
            stored,
            is_signed,
            is_inverted,
        };
        assert_eq!(of(12, false, false).value(0xf123), 0x123);
        assert_eq!(of(12, true, false).value(0x0fff), -1);
        assert_eq!(of(12, true, false).value(0xf800), -2048);
        assert_eq!(of(12, false, true).value(0), 4095);
        assert_eq!(of(12, true, true).value(0x800), 2047);
        assert_eq!(of(16, true, true).value(0), -1);
    }

    #[test]
    fn runs_are_unpacked_as_the_standard_says() {
        // PS3.5, G.3.2: a literal of 3, a byte 4 times, nothing, a literal of 1
        let mut bytes = Vec::new();
        unpack_segment(&[2, 7, 8, 9, 253, 5, 128, 0, 6], &mut |b| {
            bytes.push(b);
            true
        });
        assert_eq!(bytes, [7, 8, 9, 5, 5, 5, 5, 6]);

        let mut packed = vec![0; 64];
        packed[0] = 2; // segments
        packed[4] = 64;
        packed[8] = 68;
        packed.extend([1, 1, 2, 128]); // high bytes 1, 2
        packed.extend([255, 9, 128, 128]); // low bytes 9, 9
        assert_eq!(unpack_runs(&packed, vec![0; 4], 2).unwrap(), [9, 1, 9, 2]);
        assert!(unpack_runs(&packed, vec![0; 6], 2).is_err(), "too few");
        assert!(unpack_runs(&packed, vec![0; 4], 1).is_err(), "other segments");
        assert!(unpack_runs(&packed[..40], vec![0; 4], 2).is_err(), "no header");
    }
}
