//! PNG, JPEG and PNM through the `image` crate.
//!
//! Bits of fewer than 8 and PNM's samples with another greatest value than 255 or 65535 come
//! stretched to the whole range of 8 or 16 bits. The orientation that a camera notes in a JPEG is
//! not followed: row 0 is the first one stored.

use std::io::{BufReader, Read, Seek, SeekFrom, Write};

use ::image::codecs::png::PngEncoder;
use ::image::error::LimitErrorKind;
use ::image::{DynamicImage, ImageBuffer, ImageDecoder, ImageError, ImageReader, Limits, Luma};
use atomesh::image::{Image, Samples};

use super::stream;
use super::{AnyImage, ImageFormat, ReadReason, WriteReason};

/// Decodes a flat image, colour to luminance in place.
pub(super) fn read<R: Read + Seek>(
    source: R,
    file_bytes: u64,
    format: ImageFormat,
) -> Result<AnyImage, ReadReason> {
    // samples that a byte of the file can stand for at most, and the codec's name
    let (density, codec) = match format {
        // deflate packs 1032 bytes into one, and a byte holds eight samples of one bit
        ImageFormat::Png => (8 * 1032, ::image::ImageFormat::Png),
        // a block of 64 samples takes at least a bit, and axes may be subsampled fourfold
        ImageFormat::Jpeg => (8 * 64 * 4, ::image::ImageFormat::Jpeg),
        _ => (8, ::image::ImageFormat::Pnm),
    };
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(file_bytes.saturating_mul(8 * density) + (64 << 20));
    let mut source = BufReader::new(source);
    if format == ImageFormat::Png {
        refuse_broken_palettes(&mut source)?;
    }
    let mut reader = ImageReader::with_format(source, codec);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| reason(format, e))?;
    let (width, height) = decoder.dimensions();
    let shape = [width as usize, height as usize];
    super::plausible_count(&shape, file_bytes, density)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(|e| reason(format, e))?;
    let samples = match decoded {
        DynamicImage::ImageLuma8(i) => Samples::U8(i.into_raw()),
        DynamicImage::ImageLumaA8(i) => Samples::U8(first_of::<2, u8>(i.into_raw())),
        DynamicImage::ImageRgb8(i) => Samples::U8(luminance::<3, u8>(i.into_raw())),
        DynamicImage::ImageRgba8(i) => Samples::U8(luminance::<4, u8>(i.into_raw())),
        DynamicImage::ImageLuma16(i) => Samples::U16(i.into_raw()),
        DynamicImage::ImageLumaA16(i) => Samples::U16(first_of::<2, u16>(i.into_raw())),
        DynamicImage::ImageRgb16(i) => Samples::U16(luminance::<3, u16>(i.into_raw())),
        DynamicImage::ImageRgba16(i) => Samples::U16(luminance::<4, u16>(i.into_raw())),
        other => {
            return Err(ReadReason::Unsupported {
                format,
                found: format!("{:?} samples", other.color()),
                expected: "grey and colour of 8 and 16 bits",
            });
        }
    };
    AnyImage::frameless(&shape, samples)
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
                    format: ImageFormat::Png,
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

/// The reason that a codec's error stands for.
fn reason(format: ImageFormat, error: ImageError) -> ReadReason {
    match error {
        ImageError::Limits(e) if e.kind() == LimitErrorKind::InsufficientMemory => {
            ReadReason::decoder(format, "its parts unpack to more than its size allows")
        }
        other => ReadReason::decoder(format, other),
    }
}

/// An integer that can carry a colour channel.
pub(super) trait Channel: Copy {
    /// As a wide integer.
    fn widen(self) -> u64;
    /// From a weighted mean of values of this type.
    fn narrow(mean: u64) -> Self;
}

macro_rules! channels {
    ($($number:ty),*) => {
        $(impl Channel for $number {
            fn widen(self) -> u64 {
                self.into()
            }
            fn narrow(mean: u64) -> Self {
                mean as $number // a mean is no greater than what it is taken of
            }
        })*
    };
}

channels!(u8, u16, u32);

/// Rec. 601 luminance of interleaved samples, red, green and blue first of `N`, in place.
///
/// The weights 0.299, 0.587, 0.114 are rounded to 2⁻¹⁶ so that they add up to exactly 1: white stays
/// white, and the result is rounded to the nearest integer.
pub(super) fn luminance<const N: usize, T: Channel>(mut interleaved: Vec<T>) -> Vec<T> {
    let count = interleaved.len() / N;
    for k in 0..count {
        let [r, g, b] = [0, 1, 2].map(|c| interleaved[k * N + c].widen());
        interleaved[k] = T::narrow((19_595 * r + 38_470 * g + 7_471 * b + 32_768) >> 16);
    }
    interleaved.truncate(count);
    interleaved.shrink_to_fit();
    interleaved
}

/// The first of every `N` interleaved samples, in place.
pub(super) fn first_of<const N: usize, T: Copy>(mut interleaved: Vec<T>) -> Vec<T> {
    let count = interleaved.len() / N;
    for k in 0..count {
        interleaved[k] = interleaved[k * N];
    }
    interleaved.truncate(count);
    interleaved.shrink_to_fit();
    interleaved
}

/// Writes a PNG of 8 or 16 bits; the frame is left out, for PNG has no room for one.
pub(super) fn write<const D: usize>(
    out: &mut dyn Write,
    image: &Image<D>,
) -> Result<(), WriteReason> {
    const FORMAT: ImageFormat = ImageFormat::Png;
    let too_large = || WriteReason::Shape {
        format: FORMAT,
        shape: image.frame().shape().to_vec(),
        expected: "flat images up to 2^31 samples across; write .tif, .nii.gz or .npy instead",
    };
    let [width, height] = image.frame().shape()[..] else { return Err(too_large()) };
    let side = |n: usize| i32::try_from(n).map(i32::cast_unsigned).map_err(|_| too_large());
    let (width, height) = (side(width)?, side(height)?);
    let encoder = PngEncoder::new(out);
    let done = match image.samples() {
        Samples::U8(v) => ImageBuffer::<Luma<u8>, _>::from_raw(width, height, &v[..])
            .map(|i| i.write_with_encoder(encoder)),
        Samples::U16(v) => ImageBuffer::<Luma<u16>, _>::from_raw(width, height, &v[..])
            .map(|i| i.write_with_encoder(encoder)),
        other => {
            return Err(WriteReason::SampleType {
                format: FORMAT,
                sample_type: other.type_name(),
                expected: "uint8 and uint16; write .tif, .nii.gz or .npy instead",
            });
        }
    };
    match done.ok_or_else(too_large)? {
        Ok(()) => Ok(()),
        Err(ImageError::IoError(e)) => Err(WriteReason::Io(e)),
        Err(e) => Err(WriteReason::Encoder { format: FORMAT, error: e.into() }),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ReadOptions, decode_image};
    use super::*;
    use ::image::ColorType;
    use atomesh::watch::Silent;

    fn decode(bytes: &[u8], format: ImageFormat) -> Result<AnyImage, ReadReason> {
        decode_image(bytes, format, &ReadOptions::default(), &mut Silent)
    }

    /// A file made by the codec itself, `pixels` bytes of the given colours.
    fn encoded(pixels: &[u8], width: u32, height: u32, color: ColorType, png: bool) -> Vec<u8> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let format = if png { ::image::ImageFormat::Png } else { ::image::ImageFormat::Jpeg };
        ::image::write_buffer_with_format(&mut bytes, pixels, width, height, color, format)
            .unwrap();
        bytes.into_inner()
    }

    #[test]
    fn luminance_keeps_greys_and_weighs_colours() {
        for grey in 0..=255u8 {
            assert_eq!(luminance::<3, u8>(vec![grey; 3]), [grey]);
        }
        assert_eq!(luminance::<3, u8>(vec![255, 0, 0, 0, 255, 0, 0, 0, 255]), [76, 150, 29]);
        assert_eq!(luminance::<4, u16>(vec![65535, 65535, 65535, 0]), [65535]);
        assert_eq!(luminance::<3, u32>(vec![u32::MAX; 3]), [u32::MAX]);
    }

    #[test]
    fn png_of_each_kind_is_read() {
        let grey =
            decode(&encoded(&[1, 2, 3, 4, 5, 6], 3, 2, ColorType::L8, true), ImageFormat::Png);
        let grey = grey.unwrap();
        assert_eq!(grey.shape(), [3, 2]);
        assert_eq!(*grey.samples(), Samples::U8(vec![1, 2, 3, 4, 5, 6]));

        let wide: Vec<u8> = [1u16, 60_000].iter().flat_map(|s| s.to_ne_bytes()).collect();
        let wide = encoded(&wide, 1, 2, ColorType::L16, true);
        let wide = decode(&wide, ImageFormat::Png).unwrap();
        assert_eq!(*wide.samples(), Samples::U16(vec![1, 60_000]));

        let rgba = encoded(&[255, 0, 0, 0, 9, 9, 9, 255], 2, 1, ColorType::Rgba8, true);
        let rgba = decode(&rgba, ImageFormat::Png).unwrap();
        assert_eq!(*rgba.samples(), Samples::U8(vec![76, 9]));

        let alpha = encoded(&[7, 0, 8, 255], 2, 1, ColorType::La8, true);
        assert_eq!(*decode(&alpha, ImageFormat::Png).unwrap().samples(), Samples::U8(vec![7, 8]));
    }

    #[test]
    fn jpeg_is_read_to_within_its_own_rounding() {
        let bytes = encoded(&[100; 3 * 16 * 8], 16, 8, ColorType::Rgb8, false);
        let image = decode(&bytes, ImageFormat::Jpeg).unwrap();
        assert_eq!(image.shape(), [16, 8]);
        let range = image.range();
        assert!(range.min >= 98.0 && range.max <= 102.0, "{range:?}");
    }

    #[test]
    fn pnm_is_read_in_text_and_bytes() {
        let text = decode(b"P2\n# a note\n2 2\n255\n0 10\n20 255\n", ImageFormat::Pnm).unwrap();
        assert_eq!(*text.samples(), Samples::U8(vec![0, 10, 20, 255]));
        let wide = decode(b"P5 1 2 65535\n\x01\x02\xff\xff", ImageFormat::Pnm).unwrap();
        assert_eq!(*wide.samples(), Samples::U16(vec![258, 65535]));
        let stretched = decode(b"P2 3 1 15 0 5 15 ", ImageFormat::Pnm).unwrap();
        assert_eq!(*stretched.samples(), Samples::U8(vec![0, 85, 255]));
        let colour = decode(b"P6 1 1 255\n\xff\x00\x00", ImageFormat::Pnm).unwrap();
        assert_eq!(*colour.samples(), Samples::U8(vec![76]));
    }

    #[test]
    fn cut_files_are_refused_wherever_they_end() {
        let pixels: Vec<u8> = (0..=255).collect();
        let png = encoded(&pixels, 16, 16, ColorType::L8, true);
        // the last chunk, IEND, carries no samples
        for length in 1..png.len() - 16 {
            assert!(decode(&png[..length], ImageFormat::Png).is_err(), "{length}");
        }
        let pnm = b"P5 4 4 255\n0123456789abcdef";
        for length in 1..pnm.len() {
            assert!(decode(&pnm[..length], ImageFormat::Pnm).is_err(), "{length}");
        }
    }

    /// A PNG of one 8-bit index, 0, into a palette of these bytes.
    fn indexed(palette: &[u8]) -> Vec<u8> {
        let mut samples = flate2::write::ZlibEncoder::new(Vec::new(), Default::default());
        samples.write_all(&[0, 0]).unwrap(); // no filter, index 0
        let samples = samples.finish().unwrap();
        let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
        let size = [0, 0, 0, 1, 0, 0, 0, 1, 8, 3, 0, 0, 0];
        let chunks =
            [(b"IHDR", &size[..]), (b"PLTE", palette), (b"IDAT", &samples), (b"IEND", &[])];
        for (kind, content) in chunks {
            let body = [&kind[..], content].concat();
            let mut sum = flate2::Crc::new();
            sum.update(&body);
            png.extend((content.len() as u32).to_be_bytes());
            png.extend(body);
            png.extend(sum.sum().to_be_bytes());
        }
        png
    }

    #[test]
    fn palettes_are_followed_and_broken_ones_refused() {
        let image = decode(&indexed(&[255, 0, 0, 9, 9, 9]), ImageFormat::Png).unwrap();
        assert_eq!(*image.samples(), Samples::U8(vec![76]));
        for length in [1, 2, 4, 5, 7] {
            let error = decode(&indexed(&vec![1; length]), ImageFormat::Png).unwrap_err();
            assert!(error.to_string().contains("multiple of 3"), "{error}");
        }
    }

    #[test]
    fn absurd_sizes_are_refused_before_room_is_made() {
        let error = decode(b"P5 4294967295 4294967295 255\n0123", ImageFormat::Pnm).unwrap_err();
        assert!(matches!(error, ReadReason::TooLarge { .. }), "{error}");
        let mut png = encoded(&[0; 4], 2, 2, ColorType::L8, true);
        png[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
        assert!(decode(&png, ImageFormat::Png).is_err()); // its check sum no longer agrees either
    }
}
