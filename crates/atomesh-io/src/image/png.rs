//! PNG through the `png` crate: grey and colour of 1 to 16 bits.
//!
//! Samples of fewer than 8 bits are stretched to the whole range of 8, and palettes are followed; as labels and
//! masks both stay as they are stored. Of an animation the first picture is read.

use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};

use ::png::{
    BitDepth, ColorType, Compression, DecodingError, EncodingError, Filter, Transformations,
};
use atomesh::image::Samples;
use atomesh::watch::Watch;

use super::any_image::AnyImage;
use super::codec::{Begins, Codec, Output, Source};
use super::colour::{Values, palette_note, unpacked};
use super::error::{ReadReason, WriteReason};
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::LoadedImage;
use super::options::Meaning;
use super::shape::plausible_count;
use super::stream;
use super::view::ImageView;

const FORMAT: ImageFormat = ImageFormat::named("PNG");

pub(super) const CODEC: Codec = Codec {
    endings: &[".png"],
    begins: Begins::With(&[b"\x89PNG\r\n\x1a\n"]),
    write: Some(write),
    ..Codec::reading(FORMAT, read)
};

/// Samples that a byte of the file can stand for at most: deflate packs 1032 bytes into one, and a byte
/// holds eight samples of one bit.
const DENSITY: u64 = 8 * 1032;

/// Memory that the decoder may take besides 8 bytes for each possible sample.
const WORKING_MEMORY: u64 = 64 << 20;

/// Decodes a flat image.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let (file_bytes, memory) = (source.length, source.memory);
    let mut values = Values::new(FORMAT, source.options.meaning);
    let mut bytes = BufReader::new(source.bytes);
    refuse_broken_palettes(&mut bytes)?;
    let most = file_bytes.saturating_mul(8 * DENSITY).saturating_add(WORKING_MEMORY);
    let most = source.options.memory_limit.map_or(most, |limit| most.min(limit));
    let limits = ::png::Limits { bytes: usize::try_from(most).unwrap_or(usize::MAX) };
    let mut decoder = ::png::Decoder::new_with_limits(bytes, limits);
    // what is not looked at is not unpacked
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let palette = decoder.read_header_info().map_err(reason)?.color_type == ColorType::Indexed;
    decoder.set_transformations(match values.meaning {
        Meaning::Brightness => Transformations::EXPAND,
        Meaning::LabelsByColour if palette => Transformations::EXPAND,
        _ => Transformations::IDENTITY,
    });
    let mut reader = decoder.read_info().map_err(reason)?;
    let shape = [reader.info().width as usize, reader.info().height as usize];
    plausible_count(&shape, file_bytes, DENSITY)?;
    let samples = decoded(&mut reader, shape, &mut values, memory)?;
    if reader.output_color_type().0 == ColorType::Indexed {
        let palette = reader.info().palette.as_deref().unwrap_or_default();
        let is_black = |index: usize| palette.get(3 * index..3 * index + 3) == Some(&[0; 3]);
        values.note(palette_note(&samples, values.meaning, is_black));
    }
    let (samples, notes) = values.finish(samples);
    Ok(LoadedImage { notes, ..AnyImage::frameless(&shape, samples)?.into() })
}

/// Decodes the samples of a plausible shape: what is stored, one value a sample.
fn decoded<R: BufRead + Seek>(
    reader: &mut ::png::Reader<R>,
    [width, height]: [usize; 2],
    values: &mut Values,
    memory: Memory,
) -> Result<Samples, ReadReason> {
    let (color, depth) = reader.output_color_type();
    let count = (width * height).saturating_mul(color.samples());
    match depth {
        BitDepth::One | BitDepth::Two | BitDepth::Four => {
            // grey and palettes alone come in so few bits
            let bits = depth as usize;
            let mut packed: Vec<u8> = memory.zeros((width * bits).div_ceil(8) * height)?;
            reader.next_frame(&mut packed).map_err(reason)?;
            let mut samples = Vec::new();
            memory.grow(&mut samples, count, count)?;
            samples.extend(unpacked(&packed, width, bits));
            values.of(samples, 1)
        }
        BitDepth::Eight => {
            let mut samples: Vec<u8> = memory.zeros(count)?;
            reader.next_frame(&mut samples).map_err(reason)?;
            values.of(samples, color.samples())
        }
        BitDepth::Sixteen => {
            let mut samples: Vec<u16> = memory.zeros(count)?;
            reader.next_frame(bytemuck::cast_slice_mut(&mut samples)).map_err(reason)?;
            samples.iter_mut().for_each(|value| *value = u16::from_be(*value));
            values.of(samples, color.samples())
        }
    }
}

/// Looks at the chunks before the samples for a palette that is not made of whole colours, three
/// bytes each, for the decoder (`png` 0.18.1) panics on one; then goes back to the start.
fn refuse_broken_palettes<R: Read + Seek>(source: &mut BufReader<R>) -> Result<(), ReadReason> {
    let mut at = 8; // behind the signature
    loop {
        source.seek(SeekFrom::Start(at)).map_err(ReadReason::Io)?;
        let mut head = [0; 8];
        let filled = stream::fill(source, &mut head)?;
        let [a, b, c, d, kind @ ..] = head;
        let length = u32::from_be_bytes([a, b, c, d]);
        match &kind {
            _ if filled < head.len() => break, // the decoder says what is missing
            b"IDAT" | b"IEND" => break,
            b"PLTE" if !length.is_multiple_of(3) => {
                return Err(ReadReason::Header {
                    format: FORMAT,
                    field: "PLTE length",
                    value: length.to_string(),
                    expected: "a multiple of 3",
                });
            }
            _ => at += 12 + u64::from(length), // length, kind, check sum
        }
    }
    source.rewind().map_err(ReadReason::Io)
}

/// The reason that a decoder's error stands for.
fn reason(error: DecodingError) -> ReadReason {
    match error {
        DecodingError::LimitsExceeded => {
            ReadReason::decoder(FORMAT, "its parts unpack to more than its size allows")
        }
        other => ReadReason::decoder(FORMAT, other),
    }
}

/// Writes a PNG of 8 or 16 bits, without the frame: PNG cannot hold one.
fn write(out: &mut dyn Output, image: &ImageView, _: &mut dyn Watch) -> Result<(), WriteReason> {
    let too_large = || WriteReason::Shape {
        format: FORMAT,
        shape: image.shape.clone(),
        expected: "flat images up to 2^31 samples across; write .tif, .nii.gz or .npy instead",
    };
    let [width, height] = image.shape[..] else { return Err(too_large()) };
    let side = |n: usize| i32::try_from(n).map(i32::cast_unsigned).map_err(|_| too_large());
    let mut encoder = ::png::Encoder::new(out, side(width)?, side(height)?);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_compression(Compression::Fast);
    encoder.set_filter(Filter::Adaptive);
    let wide: Vec<u16>;
    let (depth, bytes) = match image.samples {
        Samples::U8(values) => (BitDepth::Eight, &values[..]),
        Samples::U16(values) => {
            wide = values.iter().map(|value| value.to_be()).collect();
            (BitDepth::Sixteen, bytemuck::cast_slice(&wide))
        }
        other => {
            return Err(WriteReason::SampleType {
                format: FORMAT,
                sample_type: other.type_name(),
                expected: "uint8 and uint16; write .tif, .nii.gz or .npy instead",
            });
        }
    };
    encoder.set_depth(depth);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(bytes)?;
        writer.finish()
    });
    written.map_err(|error| match error {
        EncodingError::IoError(error) => WriteReason::Io(error),
        other => WriteReason::Encoder { format: FORMAT, error: other.into() },
    })
}

#[cfg(test)]
mod tests;
