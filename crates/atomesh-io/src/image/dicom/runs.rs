//! Frames of run lengths (PS3.5, annex G).

use super::super::affine::wrong;
use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::FORMAT;
use super::pixels::Pixels;

/// The most bytes that a byte of a run can stand for.
pub(super) const RATIO: u64 = 64;

/// Unpacks a frame.
pub(super) fn unpack(
    packed: &[u8],
    pixels: &Pixels,
    memory: Memory,
) -> Result<Vec<i64>, ReadReason> {
    if pixels.allocated == 1 {
        return Err(wrong(FORMAT, "run lengths", "of samples of a bit", "whole bytes"));
    }
    let size = usize::from(pixels.allocated / 8);
    let bytes = unpack_bytes(packed, memory.zeros(pixels.count() * size)?, size)?;
    let mut values = Vec::new();
    memory.reserve(&mut values, pixels.count())?;
    let fold = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
    let number = |sample: &[u8]| sample.iter().rev().fold(0, fold);
    values.extend(bytes.chunks_exact(size).map(|sample| pixels.value(number(sample))));
    Ok(values)
}

/// Unpacks samples with the least byte first, into all of `bytes`. There is a segment for each byte of a sample, the most
/// significant first.
fn unpack_bytes(packed: &[u8], mut bytes: Vec<u8>, size: usize) -> Result<Vec<u8>, ReadReason> {
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
        assert_eq!(unpack_bytes(&packed, vec![0; 4], 2).unwrap(), [9, 1, 9, 2]);
        assert!(unpack_bytes(&packed, vec![0; 6], 2).is_err(), "too few");
        assert!(unpack_bytes(&packed, vec![0; 4], 1).is_err(), "other segments");
        assert!(unpack_bytes(&packed[..40], vec![0; 4], 2).is_err(), "no header");
    }
}
