//! JPEG through the `zune-jpeg` crate: grey and colour of 8 bits.
//!
//! The orientation that a camera notes is not followed: row 0 is the first one stored.

use std::io::Read;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::any_image::AnyImage;
use super::codec::{Begins, Codec, Source};
use super::colour::Values;
use super::error::ReadReason;
use super::format::ImageFormat;
use super::note::{LoadedImage, ReadNote};
use super::options::Meaning;
use super::shape::plausible_count;

const FORMAT: ImageFormat = ImageFormat::named("JPEG");

pub(super) const CODEC: Codec = Codec {
    endings: &[".jpg", ".jpeg"],
    begins: Begins::With(&[b"\xff\xd8\xff"]),
    ..Codec::reading(FORMAT, read)
};

/// Samples that a byte of the file can stand for at most: a block of 64 samples takes at least a bit, and
/// axes may be subsampled fourfold.
const DENSITY: u64 = 8 * 64 * 4;

/// Bytes that the decoder may hold of a value: itself, and of progressive files its coefficient of two bytes.
const BYTES_PER_VALUE: u128 = 3;

/// Decodes a flat image. The file is held whole meanwhile.
fn read(mut source: Source) -> Result<LoadedImage, ReadReason> {
    let memory = source.memory;
    memory.check(source.length.into())?;
    let mut file = Vec::new();
    source.bytes.read_to_end(&mut file).map_err(ReadReason::Io)?;
    let options = DecoderOptions::default()
        .set_strict_mode(false)
        .set_max_width(usize::MAX)
        .set_max_height(usize::MAX);
    let mut headers = JpegDecoder::new_with_options(ZCursor::new(&file[..]), options);
    headers.decode_headers().map_err(|e| ReadReason::decoder(FORMAT, e))?;
    let (width, height) = headers.dimensions().unwrap_or_default();
    // of others the decoder makes RGB
    let color = match headers.input_colorspace() {
        Some(color @ (ColorSpace::Luma | ColorSpace::LumaA | ColorSpace::RGBA)) => color,
        _ => ColorSpace::RGB,
    };
    let count = plausible_count(&[width, height], source.length, DENSITY)?;
    let values = count.saturating_mul(color.num_components());
    memory.check(values as u128 * BYTES_PER_VALUE)?;
    let mut samples = memory.zeros(values)?;
    let options = options.jpeg_set_out_colorspace(color);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(&file[..]), options);
    decoder.decode_into(&mut samples).map_err(|e| ReadReason::decoder(FORMAT, e))?;
    let mut values = Values::new(FORMAT, source.options.meaning);
    if values.meaning != Meaning::Brightness {
        values.note(ReadNote::Lossy);
    }
    let samples = values.of(samples, color.num_components())?;
    let (samples, notes) = values.finish(samples);
    Ok(LoadedImage { notes, ..AnyImage::frameless(&[width, height], samples)?.into() })
}

#[cfg(test)]
mod tests;
