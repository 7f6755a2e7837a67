//! PNM, the Netpbm family: PBM, PGM and PPM as text and as bytes, and PAM.
//!
//! Definition: <https://netpbm.sourceforge.net/doc/pnm.html>, <https://netpbm.sourceforge.net/doc/pam.html>.
//! Samples with another greatest value than 255 or 65535 are stretched to the whole range of 8 or 16 bits; labels
//! and masks stay as they are stored, black and white ones 0 where black and 1 where white.
//! Of a file with several images the first is read.

use std::io::{BufRead, BufReader};

use atomesh::image::Samples;

use super::any_image::AnyImage;
use super::codec::{Begins, Codec, Source};
use super::colour::{Channel, Values, unpacked};
use super::error::ReadReason;
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::LoadedImage;
use super::options::Meaning;
use super::sample_type::ByteOrder;
use super::shape::plausible_count;
use super::stream::{self, Layout};
use super::text::TextSamples;

mod header;

use header::{Header, Raster};

const FORMAT: ImageFormat = ImageFormat::named("PNM");

pub(super) const CODEC: Codec = Codec {
    endings: &[".pgm", ".ppm", ".pbm", ".pnm", ".pam"],
    begins: Begins::With(&[b"P1", b"P2", b"P3", b"P4", b"P5", b"P6", b"P7"]),
    ..Codec::reading(FORMAT, read)
};

/// Samples that a byte of the file can stand for at most, those of PBM.
const DENSITY: u64 = 8;

/// The error for a part of the file.
fn wrong(field: &'static str, value: impl ToString, expected: &'static str) -> ReadReason {
    ReadReason::Header { format: FORMAT, field, value: value.to_string(), expected }
}

/// Reads a flat image, colour to luminance.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let (file_bytes, memory) = (source.length, source.memory);
    let mut bytes = BufReader::with_capacity(1 << 16, source.bytes);
    let header = Header::read(&mut bytes)?;
    let count = plausible_count(&header.shape, file_bytes, DENSITY)?;
    let mut values = Values::new(FORMAT, source.options.meaning);
    let white = if values.meaning == Meaning::Brightness { 255 } else { 1 };
    let samples = match header.raster {
        Raster::TextBits => values.of(text_bits(&mut bytes, count, white, memory)?, 1)?,
        Raster::Bits => values.of(bits(&mut bytes, header.shape, white, memory)?, 1)?,
        Raster::Text => {
            let mut text = TextSamples::new(bytes, header.sample_type());
            numbers(&mut text, &header, count, (&mut values, memory))?
        }
        Raster::Bytes => numbers(&mut bytes, &header, count, (&mut values, memory))?,
    };
    let (samples, notes) = values.finish(samples);
    Ok(LoadedImage { notes, ..AnyImage::frameless(&header.shape, samples)?.into() })
}

/// Numbers of one or two bytes, the most significant first, or as text with the least first.
fn numbers(
    source: &mut dyn std::io::Read,
    header: &Header,
    count: usize,
    (values, memory): (&mut Values, Memory),
) -> Result<Samples, ReadReason> {
    let is_text = header.raster == Raster::Text;
    let layout = Layout {
        sample_type: header.sample_type(),
        byte_order: if is_text { ByteOrder::Little } else { ByteOrder::Big },
        count: count.saturating_mul(header.channels),
        reserve: count,
        scale: None,
        turned: None,
        memory,
    };
    let channels = header.channels as u64;
    let read = stream::read_samples(source, &layout).map_err(|reason| match reason {
        ReadReason::Truncated { expected, found } => {
            ReadReason::Truncated { expected: expected / channels, found: found / channels }
        }
        other => other,
    })?;
    let stretches = values.meaning == Meaning::Brightness;
    match read {
        Samples::U8(v) => values.of(checked(v.into_vec(), header, stretches)?, header.channels),
        Samples::U16(v) => values.of(checked(v.into_vec(), header, stretches)?, header.channels),
        other => Ok(other), // no other type is asked for
    }
}

/// A channel's type, as wide as samples are.
trait Value: Channel + Into<f32> + Into<u32> {
    const GREATEST: u32;
    /// The nearest value; the greatest for one above.
    fn rounded(value: f32) -> Self;
}

macro_rules! values {
    ($($number:ty),*) => {
        $(impl Value for $number {
            const GREATEST: u32 = <$number>::MAX as u32;
            fn rounded(value: f32) -> Self {
                value.round() as $number
            }
        })*
    };
}

values!(u8, u16);

/// Values that are in their range, stretched to the whole range of their type if that is wanted.
fn checked<T: Value>(
    mut values: Vec<T>,
    header: &Header,
    stretches: bool,
) -> Result<Vec<T>, ReadReason> {
    if header.is_strict
        && let Some(value) =
            values.iter().map(|&value| value.into()).find(|&v: &u32| v > header.greatest)
    {
        return Err(wrong("sample", value, "0 or 1 in a black and white image"));
    }
    if stretches && header.greatest != T::GREATEST {
        let factor = T::GREATEST as f32 / header.greatest as f32;
        for value in &mut values {
            let real: f32 = (*value).into();
            *value = T::rounded(real * factor);
        }
    }
    Ok(values)
}

/// The grey of a bit, given white's: 1 is black.
fn grey_of(bit: u8, white: u8) -> u8 {
    if bit == 0 { white } else { 0 }
}

/// Bits in rows of whole bytes, the first the most significant.
fn bits(
    source: &mut dyn BufRead,
    [width, height]: [usize; 2],
    white: u8,
    memory: Memory,
) -> Result<Vec<u8>, ReadReason> {
    memory.check(width as u128 * height as u128)?;
    let mut row: Vec<u8> = memory.zeros(width.div_ceil(8))?;
    let mut samples = Vec::new();
    for y in 0..height {
        if stream::fill(source, &mut row)? < row.len() {
            let (expected, found) = ((width * height) as u64, (width * y) as u64);
            return Err(ReadReason::Truncated { expected, found });
        }
        memory.grow(&mut samples, width, width * height)?;
        samples.extend(unpacked(&row, width, 1).map(|bit| grey_of(bit, white)));
    }
    Ok(samples)
}

/// Bits as digits, with blanks between them or without.
fn text_bits(
    source: &mut dyn BufRead,
    count: usize,
    white: u8,
    memory: Memory,
) -> Result<Vec<u8>, ReadReason> {
    let mut samples = Vec::new();
    let mut byte = [0];
    while samples.len() < count {
        if stream::fill(source, &mut byte)? == 0 {
            let (expected, found) = (count as u64, samples.len() as u64);
            return Err(ReadReason::Truncated { expected, found });
        }
        match byte[0] {
            digit @ (b'0' | b'1') => {
                memory.grow(&mut samples, 1, count)?;
                samples.push(grey_of(digit - b'0', white));
            }
            blank if header::is_blank(blank) => {}
            other => return Err(wrong("sample", other.escape_ascii(), "0 or 1")),
        }
    }
    Ok(samples)
}

#[cfg(test)]
mod tests;
