//! What the pages of a file must have in common, and the tags that say it.

use std::io::{Read, Seek};

use ::tiff::decoder::Decoder;
use ::tiff::decoder::ifd::Value;
use ::tiff::tags::{PhotometricInterpretation, SampleFormat, Tag, Type, ValueBuffer};
use ::tiff::{ColorType, TiffError};

use super::super::error::ReadReason;
use super::super::sample_type::SampleType;
use super::super::shape::shape_text;
use super::chunks::IMAGE_DEPTH;
use super::packing::ZSTD;
use super::{FORMAT, reason};

/// What all pages must have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Page {
    pub width: usize,
    pub height: usize,
    /// The planes of the page itself, 1 of nearly all.
    pub depth: usize,
    pub color: ColorType,
    pub sample_format: SampleFormat,
    /// Whether 0 stands for white.
    pub is_white_zero: bool,
    /// Whether each channel is a plane of its own.
    pub is_planar: bool,
    /// Whether its samples are packed by ZSTD.
    pub is_zstd: bool,
}

/// The bits of a tag that mark a page as a smaller copy of another or as a mask of its opacity.
const COPY_OR_MASK: u32 = 1 | 4;

fn unsupported(found: String) -> ReadReason {
    ReadReason::Unsupported {
        format: FORMAT,
        found,
        expected: "grey of 1 to 64 bits, with or without opacity, and colour of 8, 16, 32 or 64",
    }
}

impl Page {
    /// Shape and type of the page at which the decoder is, if they are supported.
    pub fn of<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Self, ReadReason> {
        let (width, height) = decoder.dimensions().map_err(reason)?;
        let shade = shade(decoder);
        let compression = decoder.find_tag_unsigned::<u16>(Tag::Compression).map_err(reason)?;
        let depth = decoder.find_tag_unsigned::<u32>(IMAGE_DEPTH).map_err(reason)?.unwrap_or(1);
        let planar = decoder.find_tag_unsigned::<u16>(Tag::PlanarConfiguration).map_err(reason)?;
        let (color, sample_format) = match shade {
            Some(PhotometricInterpretation::RGBPalette) => {
                let bits = decoder.find_tag_unsigned(Tag::BitsPerSample).map_err(reason)?;
                (ColorType::Palette(bits.unwrap_or(1)), SampleFormat::Uint)
            }
            _ => {
                let color = decoder.colortype().map_err(reason)?;
                (color, decoder.image_buffer_layout().map_err(reason)?.sample_format)
            }
        };
        let color = match color {
            ColorType::Multiband { bit_depth, num_samples: 2 } if has_opacity(decoder) => {
                ColorType::GrayA(bit_depth)
            }
            other => other,
        };
        let is_read = match color {
            ColorType::Gray(bits) | ColorType::Palette(bits) => {
                [1, 2, 4, 8, 16, 32, 64].contains(&bits)
            }
            ColorType::GrayA(bits) | ColorType::RGB(bits) | ColorType::RGBA(bits) => {
                [8, 16, 32, 64].contains(&bits)
            }
            ColorType::Multiband { bit_depth, num_samples } => {
                return Err(unsupported(format!("{num_samples} channels of {bit_depth} bits")));
            }
            other => return Err(unsupported(format!("{other:?} samples"))),
        };
        if !is_read {
            return Err(unsupported(format!("samples of {} bits", color.bit_depth())));
        }
        if depth == 0 {
            return Err(unsupported("pages of depth 0".into()));
        }
        let is_white_zero = shade == Some(PhotometricInterpretation::WhiteIsZero);
        let is_zstd = compression.is_some_and(|code| ZSTD.contains(&code));
        let (width, height, depth) = (width as usize, height as usize, depth as usize);
        let page = Self {
            width,
            height,
            depth,
            color,
            sample_format,
            is_white_zero,
            is_planar: planar == Some(2),
            is_zstd,
        };
        Ok(Self { is_planar: page.is_planar && page.channels() > 1, ..page })
    }

    /// Whether the decoder leaves it to us.
    pub fn is_own(&self) -> bool {
        self.is_zstd
            || self.is_planar
            || self.depth > 1
            || matches!(self.color, ColorType::GrayA(_))
    }

    /// Bits of a value.
    pub fn bits(&self) -> usize {
        self.color.bit_depth().into()
    }

    /// The planes of channels: 1 where those of a sample are together.
    pub fn planes(&self) -> usize {
        if self.is_planar { self.channels() } else { 1 }
    }

    /// The bytes of a row of samples, the channels of each together.
    pub fn width_bytes(&self) -> usize {
        (self.width.saturating_mul(self.bits() * self.channels())).div_ceil(8)
    }

    /// The bytes of a sample with all its channels.
    pub fn sample_bytes(&self) -> u128 {
        (u128::from(self.color.bit_depth()) * self.channels() as u128).div_ceil(8)
    }

    /// Shape and type for a message.
    pub fn text(&self) -> String {
        let Self { width, height, depth, color, sample_format, .. } = *self;
        let mut shape = vec![width, height];
        shape.extend((depth > 1).then_some(depth));
        format!("{} {color:?} {sample_format:?}", shape_text(&shape))
    }

    /// The interleaved values of a sample.
    pub fn channels(&self) -> usize {
        match self.color {
            ColorType::GrayA(_) => 2,
            ColorType::RGB(_) => 3,
            ColorType::RGBA(_) => 4,
            _ => 1,
        }
    }

    /// The type of its values, where they take whole bytes.
    pub fn sample_type(&self) -> Option<SampleType> {
        Some(match (self.sample_format, self.color.bit_depth()) {
            (SampleFormat::Uint, 8) => SampleType::U8,
            (SampleFormat::Uint, 16) => SampleType::U16,
            (SampleFormat::Uint, 32) => SampleType::U32,
            (SampleFormat::Uint, 64) => SampleType::U64,
            (SampleFormat::Int, 8) => SampleType::I8,
            (SampleFormat::Int, 16) => SampleType::I16,
            (SampleFormat::Int, 32) => SampleType::I32,
            (SampleFormat::Int, 64) => SampleType::I64,
            (SampleFormat::IEEEFP, 16) => SampleType::F16,
            (SampleFormat::IEEEFP, 32) => SampleType::F32,
            (SampleFormat::IEEEFP, 64) => SampleType::F64,
            _ => return None,
        })
    }
}

/// Whether the page at which the decoder is, is marked as a smaller copy of another one, or as a mask.
pub(super) fn is_copy<R: Read + Seek>(decoder: &mut Decoder<R>) -> bool {
    let marks = decoder.find_tag_unsigned::<u32>(Tag::NewSubfileType);
    marks.is_ok_and(|marks| marks.is_some_and(|marks| marks & COPY_OR_MASK != 0))
}

/// Whether the channel behind the first is one of opacity.
fn has_opacity<R: Read + Seek>(decoder: &mut Decoder<R>) -> bool {
    let extra = decoder.find_tag_unsigned_vec::<u16>(Tag::ExtraSamples);
    matches!(extra.ok().flatten().as_deref(), Some([1 | 2]))
}

/// How numbers become shades on the page at which the decoder is.
fn shade<R: Read + Seek>(decoder: &mut Decoder<R>) -> Option<PhotometricInterpretation> {
    let number = decoder.find_tag_unsigned(Tag::PhotometricInterpretation).ok()?;
    PhotometricInterpretation::from_u16(number?)
}

/// The description of the page at which the decoder is, empty if there is none; bytes that are no UTF-8 are taken
/// as Latin 1, as old programs write the micro sign.
///
/// # Errors
/// What the decoder says of one that cannot be read.
pub(super) fn description<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<String, TiffError> {
    let mut buffer = ValueBuffer::empty(Type::ASCII);
    if decoder.image_ifd().find_tag_buf(Tag::ImageDescription, &mut buffer)?.is_none() {
        return Ok(String::new());
    }
    let bytes = buffer.as_bytes();
    let bytes = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
    Ok(match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    })
}

/// A positive number in a tag of the page at which the decoder is.
pub(super) fn positive<R: Read + Seek>(decoder: &mut Decoder<R>, tag: Tag) -> Option<f64> {
    let number = match decoder.find_tag(tag).ok()?? {
        Value::Rational(above, below) => f64::from(above) / f64::from(below),
        Value::Float(value) => f64::from(value),
        Value::Double(value) => value,
        other => other.into_u64().ok()? as f64,
    };
    (number.is_finite() && number > 0.0).then_some(number)
}
