//! Frames of JPEG and JPEG-LS.

use jpeg_decoder::{Decoder, PixelFormat};

use super::super::affine::wrong;
use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::pixels::Pixels;
use super::{FORMAT, jpeg12, unsupported};

/// What a frame of JPEG says of itself, in its start of frame (ITU T.81, B.2.2).
#[derive(Debug, PartialEq, Eq)]
pub(super) struct FrameHead {
    /// The last four bits of the marker: 0 to 2 are DCT, 3 is lossless, 7 JPEG-LS.
    pub process: u8,
    pub precision: u8,
    /// Samples along x and y.
    pub shape: [usize; 2],
    pub components: u8,
}

impl FrameHead {
    /// Looks for the start of frame.
    fn find(packed: &[u8]) -> Option<Self> {
        let mut rest = packed.strip_prefix(&[0xff, 0xd8])?;
        loop {
            let marker = *rest.strip_prefix(&[0xff])?.first()?;
            if marker == 0xff {
                rest = &rest[1..]; // a filling byte
                continue;
            }
            rest = &rest[2..];
            let length = usize::from(u16::from_be_bytes(*rest.first_chunk()?));
            let body = rest.get(2..length)?;
            match marker {
                // tables of Huffman's codes, of arithmetic coding, and an extension have numbers in between
                0xc4 | 0xc8 | 0xcc => {}
                0xc0..=0xcf | 0xf7 => {
                    let &[precision, h, l, high, low, components, ..] = body else { return None };
                    let number = |bytes| usize::from(u16::from_be_bytes(bytes));
                    let shape = [number([high, low]), number([h, l])];
                    let process = marker & 0xf;
                    return Some(Self { process, precision, shape, components });
                }
                0xd9 | 0xda => return None,
                _ => {}
            }
            rest = &rest[length..];
        }
    }

    /// The same, if it agrees with the header of the file.
    fn check(packed: &[u8], pixels: &Pixels) -> Result<Self, ReadReason> {
        let found = Self::find(packed);
        let head = found.ok_or_else(|| bad("without a start of frame"))?;
        check_frame(head.shape, head.precision, head.components.into(), pixels)?;
        Ok(head)
    }
}

/// Checks what a packed frame says of itself against the header of the file.
pub(super) fn check_frame(
    shape: [usize; 2],
    precision: u8,
    components: usize,
    pixels: &Pixels,
) -> Result<(), ReadReason> {
    if shape != pixels.shape {
        let ([nx, ny], [mx, my]) = (shape, pixels.shape);
        let found = format!("{nx} × {ny} samples where the header says {mx} × {my}");
        return Err(wrong(FORMAT, "packed frame", found, "the header's rows and columns"));
    }
    if components != 1 {
        return Err(unsupported(
            format!("{components} values a sample in a packed frame"),
            "one value a sample",
        ));
    }
    if !(1..=pixels.allocated).contains(&precision.into()) {
        let found = format!("{precision} bits where the header allocates {}", pixels.allocated);
        return Err(wrong(FORMAT, "packed frame", found, "bits that are allocated"));
    }
    Ok(())
}

fn bad(value: impl Into<String>) -> ReadReason {
    wrong(FORMAT, "packed frame", value, "a frame of JPEG")
}

/// Unpacks a frame of JPEG: by DCT of 8 and 12 bits, and lossless.
pub(super) fn unpack(
    packed: &[u8],
    pixels: &Pixels,
    memory: Memory,
) -> Result<Vec<i64>, ReadReason> {
    let head = FrameHead::check(packed, pixels)?;
    let precision = head.precision;
    let mut values = Vec::new();
    memory.reserve(&mut values, pixels.count())?;
    match head.process {
        0 | 1 if precision == 12 => {
            let samples = jpeg12::unpack(packed, head.shape).ok_or_else(|| bad("corrupt"))?;
            values.extend(samples.iter().map(|&v| pixels.decoded(v.into(), precision)));
        }
        0..=2 if precision == 8 => {
            let (bytes, _) = decoded(packed)?;
            values.extend(bytes.iter().map(|&v| pixels.decoded(v.into(), precision)));
        }
        3 => {
            let (bytes, is_wide) = decoded(packed)?;
            let (pairs, _) = bytes.as_chunks::<2>();
            match is_wide {
                true => values.extend(
                    pairs.iter().map(|&v| pixels.decoded(u16::from_ne_bytes(v).into(), precision)),
                ),
                false => {
                    values.extend(bytes.iter().map(|&v| pixels.decoded(v.into(), precision)));
                }
            }
        }
        process => {
            return Err(unsupported(
                format!("JPEG of process {process} and {precision} bits"),
                "lossless JPEG, and DCT of 8 bits, or of 12 if sequential",
            ));
        }
    }
    whole(values, pixels)
}

/// The bytes that the decoder makes, and whether a sample takes two.
fn decoded(packed: &[u8]) -> Result<(Vec<u8>, bool), ReadReason> {
    let mut decoder = Decoder::new(packed);
    let bytes = decoder.decode().map_err(|e| ReadReason::decoder(FORMAT, e))?;
    let is_wide = decoder.info().is_some_and(|info| info.pixel_format == PixelFormat::L16);
    Ok((bytes, is_wide))
}

/// Unpacks a frame of JPEG-LS.
pub(super) fn unpack_ls(
    packed: &[u8],
    pixels: &Pixels,
    memory: Memory,
) -> Result<Vec<i64>, ReadReason> {
    let head = FrameHead::check(packed, pixels)?;
    let [nx, ny] = pixels.shape.map(|n| n as u32);
    let decoded = jpegls::decode(packed, nx, ny);
    let (samples, ..) = decoded.map_err(|e| ReadReason::decoder(FORMAT, e))?;
    let mut values = Vec::new();
    memory.reserve(&mut values, pixels.count())?;
    values.extend(samples.iter().map(|&v| pixels.decoded(v.into(), head.precision)));
    whole(values, pixels)
}

/// The values, if they are all.
pub(super) fn whole(values: Vec<i64>, pixels: &Pixels) -> Result<Vec<i64>, ReadReason> {
    let (found, expected) = (values.len(), pixels.count());
    if found < expected {
        let (found, expected) = (found as u64, expected as u64);
        return Err(ReadReason::Truncated { expected, found });
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_start_of_frame_is_found_behind_other_segments() {
        let file = [
            &[0xff, 0xd8, 0xff, 0xe0, 0, 4, 0xff, 0xc0][..], // an application's, with a marker in it
            &[0xff, 0xff, 0xc4, 0, 2],                       // filled up, empty tables
            &[0xff, 0xc3, 0, 11, 12, 0, 5, 1, 2, 1, 1, 0x11, 0],
        ]
        .concat();
        let head = FrameHead { process: 3, precision: 12, shape: [258, 5], components: 1 };
        assert_eq!(FrameHead::find(&file), Some(head));
        for length in 0..file.len() - 5 {
            assert_eq!(FrameHead::find(&file[..length]), None, "{length}");
        }
        assert_eq!(FrameHead::find(&[0xff, 0xd8, 0xff, 0xda, 0, 2, 0, 0]), None);
    }
}
