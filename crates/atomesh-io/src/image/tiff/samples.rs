//! What a page's numbers become: one value a sample.

use ::tiff::decoder::DecodingResult;
use atomesh::image::Samples;

use super::super::channels::{mixed, without_colour};
use super::super::colour::{Values, unpacked};
use super::super::error::ReadReason;
use super::super::options::Meaning;
use super::FORMAT;
use super::page::Page;

/// The samples of a decoded page, one value each by what values mean.
pub(super) fn samples(
    decoded: DecodingResult,
    page: &Page,
    values: &mut Values,
) -> Result<Samples, ReadReason> {
    let channels = page.channels();
    let stored = match decoded {
        DecodingResult::U8(v) => Samples::U8(whole_bytes(v, page, values.meaning).into()),
        DecodingResult::U16(v) => Samples::U16(v.into()),
        DecodingResult::U32(v) => Samples::U32(v.into()),
        DecodingResult::F16(v) => Samples::F32(v.iter().map(|h| h.to_f32()).collect()),
        DecodingResult::F32(v) => Samples::F32(v.into()),
        DecodingResult::F64(v) => Samples::F64(v.into()),
        DecodingResult::I8(v) => Samples::I8(v.into()),
        DecodingResult::I16(v) => Samples::I16(v.into()),
        DecodingResult::I32(v) => Samples::I32(v.into()),
        DecodingResult::U64(v) => {
            let doubles = without_colour(v, channels, FORMAT)?.iter().map(|&n| n as f64).collect();
            return Ok(Samples::F64(doubles));
        }
        DecodingResult::I64(v) => {
            let doubles = without_colour(v, channels, FORMAT)?.iter().map(|&n| n as f64).collect();
            return Ok(Samples::F64(doubles));
        }
    };
    mixed(stored, channels, values)
}

/// Samples of fewer than 8 bits, each in a byte; of pictures they are stretched to its whole range.
fn whole_bytes(decoded: Vec<u8>, page: &Page, meaning: Meaning) -> Vec<u8> {
    let bits = usize::from(page.color.bit_depth());
    if bits >= 8 {
        return decoded;
    }
    let factor = if meaning == Meaning::Brightness { 255 / ((1 << bits) - 1) } else { 1 };
    unpacked(&decoded, page.width, bits).map(|value| value * factor).collect()
}

/// The samples of a page that were decoded here, one value each by what values mean: of pictures few bits are stretched,
/// and shades turned round where 0 is white.
pub(super) fn of_stored(
    stored: Samples,
    page: &Page,
    values: &mut Values,
) -> Result<Samples, ReadReason> {
    let stored = match stored {
        Samples::U8(v) => Samples::U8(whole_bytes(v.into_vec(), page, values.meaning).into()),
        other => other,
    };
    let is_turned = page.is_white_zero && values.meaning == Meaning::Brightness;
    let stored = if is_turned { turned(stored)? } else { stored };
    mixed(stored, page.channels(), values)
}

/// Shades from the other end of their range.
fn turned(stored: Samples) -> Result<Samples, ReadReason> {
    Ok(match stored {
        Samples::U8(v) => Samples::U8(v.iter().map(|x| u8::MAX - x).collect()),
        Samples::U16(v) => Samples::U16(v.iter().map(|x| u16::MAX - x).collect()),
        Samples::U32(v) => Samples::U32(v.iter().map(|x| u32::MAX - x).collect()),
        _ => {
            return Err(ReadReason::Unsupported {
                format: FORMAT,
                found: "signed numbers or floats with 0 for white".into(),
                expected: "unsigned integers there",
            });
        }
    })
}
