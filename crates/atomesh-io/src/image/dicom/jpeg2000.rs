//! Frames of JPEG 2000.

use hayro_jpeg2000::{DecodeSettings, DecoderContext, Image};

use super::super::affine::wrong;
use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::jpeg::{check_frame, whole};
use super::pixels::Pixels;
use super::{FORMAT, unsupported};

/// Where a codestream begins, with the size of its image (ITU T.800, A.5.1).
const START: [u8; 4] = [0xff, 0x4f, 0xff, 0x51];

/// The most bits of a sample: beyond, single precision, in which the decoder works, is not exact.
const MOST_BITS: u8 = 20;

/// The most tiles; numbers of tiles have 16 bits.
const MOST_TILES: u64 = 1 << 16;

/// What a codestream says of its image.
struct Size {
    shape: [usize; 2],
    components: usize,
    precision: u8,
    is_signed: bool,
    is_subsampled: bool,
    tiles: u64,
}

impl Size {
    fn find(packed: &[u8]) -> Option<Self> {
        // behind the boxes of a JP2 file, if there are any
        let boxes = packed.windows(4).take(1 << 12).position(|word| word == START)?;
        let body = packed.get(boxes + 8..)?;
        let word = |k: usize| Some(u32::from_be_bytes(*body.get(4 * k..)?.first_chunk()?) as usize);
        let [x, y, x0, y0] = [word(0)?, word(1)?, word(2)?, word(3)?];
        let [tile_x, tile_y] = [word(4)?.max(1), word(5)?.max(1)];
        let &[high, low, bits, step_x, step_y, ..] = body.get(32..)? else { return None };
        Some(Self {
            shape: [x.checked_sub(x0)?, y.checked_sub(y0)?],
            components: u16::from_be_bytes([high, low]).into(),
            precision: (bits & 0x7f) + 1,
            is_signed: bits & 0x80 != 0,
            is_subsampled: [step_x, step_y] != [1, 1],
            tiles: x.div_ceil(tile_x) as u64 * y.div_ceil(tile_y) as u64,
        })
    }
}

/// Unpacks a frame.
pub(super) fn unpack(
    packed: &[u8],
    pixels: &Pixels,
    memory: Memory,
) -> Result<Vec<i64>, ReadReason> {
    let bad = |value: &str| wrong(FORMAT, "packed frame", value, "a codestream of JPEG 2000");
    let size = Size::find(packed).ok_or_else(|| bad("without its size"))?;
    check_frame(size.shape, size.precision, size.components, pixels)?;
    if size.is_subsampled || size.tiles > MOST_TILES {
        return Err(bad("subsampled, or of too many tiles"));
    }
    if size.precision > MOST_BITS {
        let found = format!("JPEG 2000 of {} bits", size.precision);
        return Err(unsupported(found, "20 bits at most"));
    }
    let settings =
        DecodeSettings { resolve_palette_indices: false, strict: true, target_resolution: None };
    let decoder = |error| ReadReason::decoder(FORMAT, error);
    let image = Image::new(packed, &settings).map_err(decoder)?;
    if [image.width() as usize, image.height() as usize] != pixels.shape {
        return Err(bad("of another shape"));
    }
    let mut context = DecoderContext::default();
    let decoded = image.decode(&mut context).map_err(decoder)?;
    let samples = decoded.components().first().ok_or_else(|| bad("empty"))?.samples();
    // the decoder adds half the range whether samples are signed or not, and limits nothing
    let half = 1_i64 << (size.precision - 1);
    let (offset, least, greatest) =
        if size.is_signed { (half, -half, half - 1) } else { (0, 0, 2 * half - 1) };
    let value = |sample: &f32| {
        let number = (sample.round() as i64 - offset).clamp(least, greatest);
        pixels.decoded(number as u64, size.precision)
    };
    let mut values = Vec::new();
    memory.reserve(&mut values, pixels.count())?;
    values.extend(samples.iter().take(pixels.count()).map(value));
    whole(values, pixels)
}
