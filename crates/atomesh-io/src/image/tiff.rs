//! TIFF and BigTIFF through the `tiff` crate: one page is flat, many are the planes of a volume.

use std::io::{BufReader, Read, Seek, Write};

use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::encoder::colortype::{
    ColorType as Encoded, Gray8, Gray16, Gray32, Gray32Float, Gray64Float, GrayI8, GrayI16, GrayI32,
};
use ::tiff::encoder::{TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, TiffValue};
use ::tiff::tags::SampleFormat;
use ::tiff::{ColorType, TiffError};
use atomesh::image::Samples;
use atomesh::watch::{Phase, Watch, check};

use super::any_image::AnyImage;
use super::codec::{Begins, Codec, Output, Source};
use super::colour::{first_of, grey, in_place};
use super::error::{ReadReason, WriteReason};
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::LoadedImage;
use super::shape::{plausible_count, shape_text};
use super::view::ImageView;

const FORMAT: ImageFormat = ImageFormat::named("TIFF");

pub(super) const CODEC: Codec = Codec {
    endings: &[".tif", ".tiff"],
    begins: Begins::With(&[b"II\x2a\0", b"II\x2b\0", b"MM\0\x2a", b"MM\0\x2b"]),
    writes_floats: true,
    write: Some(write),
    ..Codec::reading(FORMAT, read)
};

/// Samples that a byte of the file may stand for: a constant image packs about 1400 into one byte
/// by LZW and 1032 by deflate.
const DENSITY: u64 = 4096;

/// Reads all pages. They are compared before the first one is decoded.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let (file_bytes, memory) = (source.length, source.memory);
    let bytes = BufReader::with_capacity(1 << 16, source.bytes);
    let mut decoder = Decoder::new(bytes).map_err(reason)?;
    let first = Page::of(&mut decoder)?;
    plausible_count(&[first.width, first.height], file_bytes, DENSITY)?;
    let mut page_count = 1;
    while decoder.more_images() {
        decoder.next_image().map_err(reason)?;
        page_count += 1;
        let page = Page::of(&mut decoder)?;
        if page != first {
            return Err(ReadReason::Page {
                page: page_count,
                found: page.text(),
                expected: first.text(),
            });
        }
    }
    let shape = match page_count {
        1 => vec![first.width, first.height],
        _ => vec![first.width, first.height, page_count],
    };
    let count = plausible_count(&shape, file_bytes, DENSITY)?;
    memory.check(count as u128 * first.sample_bytes())?;

    let mut limits = Limits::default();
    limits.decoding_buffer_size = count.saturating_mul(4 * 8);
    limits.intermediate_buffer_size = limits.decoding_buffer_size.saturating_add(1 << 20);
    limits.ifd_value_size = usize::try_from(file_bytes).unwrap_or(usize::MAX);
    let mut decoder = decoder.with_limits(limits);
    let mut volume = None;
    for page in 0..page_count {
        if page_count > 1 {
            decoder.seek_to_image(page).map_err(reason)?;
        }
        let plane = samples(decoder.read_image().map_err(reason)?, first.color)?;
        append(&mut volume, plane, count, memory)?;
    }
    match volume {
        Some(samples) => Ok(AnyImage::frameless(&shape, samples)?.into()),
        None => Err(ReadReason::Truncated { expected: count as u64, found: 0 }),
    }
}

/// The reason that a decoder's error stands for.
fn reason(error: TiffError) -> ReadReason {
    ReadReason::decoder(FORMAT, error)
}

/// What all pages must have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Page {
    width: usize,
    height: usize,
    color: ColorType,
    sample_format: SampleFormat,
}

impl Page {
    /// Shape and type of the page at which the decoder is, if they are supported.
    fn of<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Self, ReadReason> {
        let unsupported = |found: String| ReadReason::Unsupported {
            format: FORMAT,
            found,
            expected: "grey and colour of 8, 16, 32 or 64 bits, channels interleaved",
        };
        let (width, height) = decoder.dimensions().map_err(reason)?;
        let color = decoder.colortype().map_err(reason)?;
        let layout = decoder.image_buffer_layout().map_err(reason)?;
        let bits = match color {
            ColorType::Gray(b) | ColorType::GrayA(b) | ColorType::RGB(b) | ColorType::RGBA(b) => b,
            other => return Err(unsupported(format!("{other:?} samples"))),
        };
        if ![8, 16, 32, 64].contains(&bits) {
            return Err(unsupported(format!("samples of {bits} bits")));
        }
        if layout.planes > 1 {
            return Err(unsupported(format!("{} separate channel planes", layout.planes)));
        }
        Ok(Self {
            width: width as usize,
            height: height as usize,
            color,
            sample_format: layout.sample_format,
        })
    }

    /// The bytes of a sample with all its channels.
    fn sample_bytes(&self) -> u128 {
        u128::from(self.color.bit_depth()) * u128::from(self.color.num_samples()) / 8
    }

    /// Shape and type for a message.
    fn text(&self) -> String {
        let Self { color, sample_format, .. } = self;
        format!("{} {color:?} {sample_format:?}", shape_text(&[self.width, self.height]))
    }
}

/// The samples of a decoded page, colour to luminance.
fn samples(decoded: DecodingResult, color: ColorType) -> Result<Samples, ReadReason> {
    let channels = match color {
        ColorType::GrayA(_) => 2,
        ColorType::RGB(_) => 3,
        ColorType::RGBA(_) => 4,
        _ => 1,
    };
    Ok(match decoded {
        DecodingResult::U8(v) => Samples::U8(grey(v, channels)),
        DecodingResult::U16(v) => Samples::U16(grey(v, channels)),
        DecodingResult::U32(v) => Samples::U32(grey(v, channels)),
        DecodingResult::F32(v) => Samples::F32(grey_floats(v, channels)),
        DecodingResult::F64(v) => Samples::F64(grey_floats(v, channels)),
        DecodingResult::F16(v) => {
            let single = v.iter().map(|h| h.to_f32()).collect::<Vec<f32>>();
            Samples::F32(grey_floats(single, channels))
        }
        DecodingResult::I8(v) => Samples::I8(without_colour(v, channels)?),
        DecodingResult::I16(v) => Samples::I16(without_colour(v, channels)?),
        DecodingResult::I32(v) => Samples::I32(without_colour(v, channels)?),
        DecodingResult::U64(v) => {
            Samples::F64(without_colour(v, channels)?.iter().map(|&n| n as f64).collect())
        }
        DecodingResult::I64(v) => {
            Samples::F64(without_colour(v, channels)?.iter().map(|&n| n as f64).collect())
        }
    })
}

/// Grey samples without their opacity; colour is refused.
fn without_colour<T: Copy>(interleaved: Vec<T>, channels: usize) -> Result<Vec<T>, ReadReason> {
    match channels {
        1 => Ok(interleaved),
        2 => Ok(first_of::<2, T>(interleaved)),
        _ => Err(ReadReason::Unsupported {
            format: FORMAT,
            found: "colour in signed integers or integers of 64 bits".into(),
            expected: "colour in unsigned integers of 8 to 32 bits and in floats",
        }),
    }
}

/// Floats without their opacity, colour to Rec. 601 luminance.
fn grey_floats<T>(interleaved: Vec<T>, channels: usize) -> Vec<T>
where
    T: Copy + Into<f64> + FromDouble,
{
    let luminance = |sample: &[T]| {
        let [r, g, b] = [0, 1, 2].map(|c| sample[c].into());
        T::from_double(0.299 * r + 0.587 * g + 0.114 * b)
    };
    match channels {
        2 => first_of::<2, T>(interleaved),
        3 => in_place::<3, T>(interleaved, luminance),
        4 => in_place::<4, T>(interleaved, luminance),
        _ => interleaved,
    }
}

/// A float that a double can be rounded to.
trait FromDouble {
    /// The nearest value.
    fn from_double(value: f64) -> Self;
}

impl FromDouble for f32 {
    fn from_double(value: f64) -> Self {
        value as f32
    }
}

impl FromDouble for f64 {
    fn from_double(value: f64) -> Self {
        value
    }
}

/// Puts a plane behind those that are there; the first one is taken as it is.
fn append(
    volume: &mut Option<Samples>,
    plane: Samples,
    count: usize,
    memory: Memory,
) -> Result<(), ReadReason> {
    macro_rules! extend {
        ($($kind:ident),*) => {
            match (volume.as_mut(), plane) {
                $((Some(Samples::$kind(all)), Samples::$kind(more)) => {
                    memory.grow(all, more.len(), count)?;
                    all.extend_from_slice(&more);
                })*
                (_, plane) => *volume = Some(plane), // pages of one type: only the first comes here
            }
        };
    }
    extend!(U8, I8, U16, I16, U32, I32, F32, F64);
    Ok(())
}

/// Writes a page for each z, not compressed; BigTIFF where 32-bit offsets would not reach.
fn write(
    out: &mut dyn Output,
    image: &ImageView,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let samples = image.samples;
    if samples.len() as u64 * samples.sample_size() as u64 > 4_000_000_000 {
        let encoder = TiffEncoder::<_, TiffKindBig>::new_generic(out).map_err(failure)?;
        write_pages(encoder, image, watch)
    } else {
        let encoder = TiffEncoder::<_, TiffKindStandard>::new_generic(out).map_err(failure)?;
        write_pages(encoder, image, watch)
    }
}

/// Writes the pages with one function for each type.
fn write_pages<W: Write + Seek, K: TiffKind>(
    mut encoder: TiffEncoder<W, K>,
    image: &ImageView,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let side = |n: usize| {
        u32::try_from(n).map_err(|_| WriteReason::Shape {
            format: FORMAT,
            shape: image.shape.clone(),
            expected: "up to 2^32 samples across; write .npy instead",
        })
    };
    let size = [side(image.shape[0])?, side(image.shape[1])?];
    match image.samples {
        Samples::U8(v) => write_planes::<Gray8, _, _>(&mut encoder, v, size, watch),
        Samples::I8(v) => write_planes::<GrayI8, _, _>(&mut encoder, v, size, watch),
        Samples::U16(v) => write_planes::<Gray16, _, _>(&mut encoder, v, size, watch),
        Samples::I16(v) => write_planes::<GrayI16, _, _>(&mut encoder, v, size, watch),
        Samples::U32(v) => write_planes::<Gray32, _, _>(&mut encoder, v, size, watch),
        Samples::I32(v) => write_planes::<GrayI32, _, _>(&mut encoder, v, size, watch),
        Samples::F32(v) => write_planes::<Gray32Float, _, _>(&mut encoder, v, size, watch),
        Samples::F64(v) => write_planes::<Gray64Float, _, _>(&mut encoder, v, size, watch),
        other => Err(WriteReason::SampleType {
            format: FORMAT,
            sample_type: other.type_name(),
            expected: "integers up to 32 bits, float32 and float64",
        }),
    }
}

/// Writes planes of so many samples along x and y, strip by strip.
fn write_planes<C: Encoded, W: Write + Seek, K: TiffKind>(
    encoder: &mut TiffEncoder<W, K>,
    samples: &[C::Inner],
    size: [u32; 2],
    watch: &mut dyn Watch,
) -> Result<(), WriteReason>
where
    [C::Inner]: TiffValue,
{
    let [width, height] = size;
    let mut left = samples;
    for plane in samples.chunks_exact(width as usize * height as usize) {
        let mut page = encoder.new_image::<C>(width, height).map_err(failure)?;
        let mut rows = plane;
        while !rows.is_empty() {
            check(watch, Phase::Write, 1.0 - left.len() as f64 / samples.len() as f64, None)?;
            let count = (page.next_strip_sample_count() as usize).min(rows.len());
            page.write_strip(&rows[..count]).map_err(failure)?;
            rows = &rows[count..];
            left = &left[count..];
        }
        page.finish().map_err(failure)?;
    }
    Ok(())
}

/// The reason that an encoder's error stands for.
fn failure(error: TiffError) -> WriteReason {
    match error {
        TiffError::IoError(e) => WriteReason::Io(e),
        other => WriteReason::Encoder { format: FORMAT, error: other.into() },
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ReadOptions, decode_image};
    use super::*;
    use ::tiff::encoder::colortype::{Gray64, RGB8, RGB32Float};
    use atomesh::image::{Frame, Image};
    use atomesh::watch::Silent;
    use std::io::Cursor;

    fn decode(bytes: &[u8]) -> Result<AnyImage, ReadReason> {
        decode_image(bytes, FORMAT, &ReadOptions::default(), &mut Silent)
    }

    fn encode<const D: usize>(shape: [usize; D], samples: Samples) -> Vec<u8> {
        let image = Image::new(Frame::new(shape).unwrap(), samples).unwrap();
        let mut bytes = Cursor::new(Vec::new());
        write(&mut bytes, &ImageView::of(&image), &mut Silent).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn every_type_goes_there_and_back() {
        for samples in [
            Samples::U8(vec![0, 1, 255, 3, 4, 5]),
            Samples::I8(vec![-128, 1, 127, 3, 4, 5]),
            Samples::U16(vec![0, 1, 65535, 3, 4, 5]),
            Samples::I16(vec![-32768, 1, 2, 3, 4, 5]),
            Samples::U32(vec![u32::MAX, 1, 2, 3, 4, 5]),
            Samples::I32(vec![i32::MIN, 1, 2, 3, 4, 5]),
            Samples::F32(vec![-0.5, f32::INFINITY, 2.0, 3.0, 4.0, 1e-30]),
            Samples::F64(vec![-0.5, 1e300, 2.0, 3.0, 4.0, 5.0]),
        ] {
            let flat = decode(&encode([3, 2], samples.clone())).unwrap();
            assert_eq!((flat.shape(), flat.samples()), (vec![3, 2], &samples));
            let volume = decode(&encode([1, 2, 3], samples.clone())).unwrap();
            assert_eq!((volume.shape(), volume.samples()), (vec![1, 2, 3], &samples));
        }
    }

    #[test]
    fn pages_of_another_shape_or_type_are_named() {
        let mut bytes = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
        encoder.write_image::<Gray8>(3, 2, &[0; 6]).unwrap();
        encoder.write_image::<Gray8>(3, 2, &[0; 6]).unwrap();
        encoder.write_image::<Gray8>(2, 2, &[0; 4]).unwrap();
        let text = decode(bytes.get_ref()).unwrap_err().to_string();
        assert!(text.starts_with("page 3 is 2 × 2") && text.contains("expected 3 × 2"), "{text}");

        let mut bytes = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
        encoder.write_image::<Gray8>(3, 2, &[0; 6]).unwrap();
        encoder.write_image::<GrayI8>(3, 2, &[0; 6]).unwrap();
        let text = decode(bytes.get_ref()).unwrap_err().to_string();
        assert!(text.contains("page 2") && text.contains("Int"), "{text}");
    }

    #[test]
    fn colour_becomes_luminance_and_wide_integers_doubles() {
        let mut bytes = Cursor::new(Vec::new());
        TiffEncoder::new(&mut bytes)
            .unwrap()
            .write_image::<RGB8>(2, 1, &[255, 0, 0, 9, 9, 9])
            .unwrap();
        assert_eq!(*decode(bytes.get_ref()).unwrap().samples(), Samples::U8(vec![76, 9]));

        let mut bytes = Cursor::new(Vec::new());
        TiffEncoder::new(&mut bytes)
            .unwrap()
            .write_image::<RGB32Float>(1, 1, &[1.0, 0.0, 0.0])
            .unwrap();
        assert_eq!(*decode(bytes.get_ref()).unwrap().samples(), Samples::F32(vec![0.299]));

        let mut bytes = Cursor::new(Vec::new());
        TiffEncoder::new(&mut bytes).unwrap().write_image::<Gray64>(1, 1, &[1 << 40]).unwrap();
        let image = decode(bytes.get_ref()).unwrap();
        assert_eq!(*image.samples(), Samples::F64(vec![(1u64 << 40) as f64]));
    }

    #[test]
    fn cut_files_are_refused_wherever_they_end() {
        let bytes = encode([5, 4, 3], Samples::U16((0..60).collect()));
        for length in 1..bytes.len() {
            assert!(decode(&bytes[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn an_absurd_size_is_refused_before_room_is_made() {
        let mut bytes = encode([3, 2], Samples::U8(vec![0; 6]));
        // the entries of width, length and rows per strip, each 12 bytes
        for tag in [256u16, 257, 278] {
            let [low, high] = tag.to_le_bytes();
            let entry = [low, high, 4, 0, 1, 0, 0, 0]; // one 32-bit number
            let at = bytes.windows(8).position(|w| w == entry).unwrap();
            bytes[at + 8..at + 12].copy_from_slice(&60_000u32.to_le_bytes());
        }
        let error = decode(&bytes).unwrap_err();
        assert!(matches!(error, ReadReason::TooLarge { .. }), "{error}");
    }
}
