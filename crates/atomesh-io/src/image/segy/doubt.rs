//! Whether floating-point samples are what the format code calls them: IBM's numbers are often called IEEE's,
//! and the other way round.
//!
//! Both are a sign, an exponent and a fraction, and nearly any 32 bits are a number of either kind. But the first
//! hexadecimal digit of an IBM fraction is not 0, since numbers are normalised; the same four bits of an IEEE
//! number are the last bit of its exponent and the first three of its fraction, all 0 for values from 2 · 4ᵏ to
//! 2.25 · 4ᵏ: of values spread over several orders of magnitude, one in twelve (log₂ 1.125 over 2). So
//! such words among IBM numbers, and their absence among many IEEE numbers of several exponents, give a
//! wrong code away. If no sample has that last bit of the exponent 0, the two readings differ by a factor, and
//! only its size can raise a doubt.

use std::io::{Read, Seek, SeekFrom};

use super::super::error::ReadReason;
use super::super::note::ReadNote;
use super::super::sample_type::ByteOrder;
use super::super::stream;
use super::super::traces::{Ibm, SampleFormat};
use super::header::Header;

/// The traces that are looked at, spread over the file.
const TRACES: usize = 32;

/// The samples of each that are looked at, from its first.
const SAMPLES: usize = 2048;

/// The first hexadecimal digit of an IBM number's fraction.
const FIRST_DIGIT: u32 = 0x00f0_0000;

/// The first bit of that digit, the last of an IEEE number's exponent.
const FIRST_BIT: u32 = 0x0080_0000;

/// One in so many of IBM numbers may be not normalised: far fewer are written so, far more read so.
const FEW: usize = 64;

/// Different numbers of one exponent among which one with the first digit 0 is bound to be, if they are IEEE's.
const MANY: usize = 64;

/// Exponents that must have as many, since values may leave out a part of one range.
const RANGES: usize = 3;

/// Samples are seldom as large, but for those read as IBM's though they are not.
const LARGE: f64 = 1e7;

/// Looks at samples, and says if they seem to be of the other kind than the header says.
///
/// # Errors
/// If the file cannot be read.
pub(super) fn doubt<R: Read + Seek>(
    source: &mut R,
    header: &Header,
) -> Result<Option<ReadNote>, ReadReason> {
    let stated = header.format;
    let other = match stated {
        SampleFormat::Ibm => SampleFormat::F32,
        SampleFormat::F32 => SampleFormat::Ibm,
        _ => return Ok(None),
    };
    let words = words(source, header)?;
    let (range, other_range) = (range(&words, stated), range(&words, other));
    let is_told = match stated {
        SampleFormat::Ibm => !are_ibm(&words),
        _ => are_not_ieee(&words),
    };
    let is_large =
        stated == SampleFormat::Ibm && are_alike(&words) && range[1].max(-range[0]) >= LARGE;
    let note = ReadNote::SampleFormat { stated, range, other, other_range, is_told };
    Ok((is_told || is_large).then_some(note))
}

/// Different samples of some traces, without their signs and without zeros.
fn words<R: Read + Seek>(source: &mut R, header: &Header) -> Result<Vec<u32>, ReadReason> {
    let mut bytes = vec![0; 4 * header.samples.min(SAMPLES)];
    let mut words = Vec::new();
    for trace in (0..header.traces).step_by(header.traces.div_ceil(TRACES).max(1)) {
        let at = header.start + trace as u64 * header.trace_bytes() as u64;
        source.seek(SeekFrom::Start(at + header.trace_header as u64)).map_err(ReadReason::Io)?;
        let filled = stream::fill(source, &mut bytes)?;
        let numbers = bytes[..filled].as_chunks::<4>().0;
        words.extend(numbers.iter().map(|&b| match header.byte_order {
            ByteOrder::Little => u32::from_le_bytes(b),
            ByteOrder::Big => u32::from_be_bytes(b),
        }));
    }
    words.iter_mut().for_each(|w| *w &= u32::MAX >> 1);
    words.retain(|&w| w != 0);
    words.sort_unstable();
    words.dedup();
    Ok(words)
}

/// The least and the greatest finite size of the samples.
fn range(words: &[u32], format: SampleFormat) -> [f64; 2] {
    let ibm = Ibm::new();
    let value = |&word: &u32| match format {
        SampleFormat::Ibm => ibm.decode(word),
        _ => f32::from_bits(word),
    };
    let values = words.iter().map(value).filter(|v| v.is_finite()).map(f64::from);
    values.fold([f64::INFINITY, 0.0], |[least, most], v| [least.min(v), most.max(v)])
}

/// Whether the words may be IBM numbers: few of them are not normalised. Zero may be written with one exponent
/// that is not 0.
fn are_ibm(words: &[u32]) -> bool {
    let odd = |w: &&u32| **w & FIRST_DIGIT == 0 && **w >> 24 != 0;
    let (zeros, others): (Vec<&u32>, Vec<&u32>) =
        words.iter().filter(odd).partition(|w| **w & 0x00ff_ffff == 0);
    (others.len() + zeros.len().saturating_sub(1)) * FEW <= words.len()
}

/// Whether the words cannot be IEEE numbers: those of many exponents are all normalised as IBM's.
fn are_not_ieee(words: &[u32]) -> bool {
    let is_full = |group: &&[u32]| group.iter().filter(|w| **w & FIRST_BIT == 0).count() >= MANY;
    words.iter().all(|w| w & FIRST_DIGIT != 0)
        && words.chunk_by(|a, b| a >> 24 == b >> 24).filter(is_full).count() >= RANGES
}

/// Whether the two readings of many words differ by a factor alone.
fn are_alike(words: &[u32]) -> bool {
    words.len() >= MANY && words.iter().all(|w| w & FIRST_BIT != 0)
}

#[cfg(test)]
mod tests {
    use super::super::tests::ibm;
    use super::*;

    /// Sizes that are even on a logarithmic scale, as those of waves are over their decay.
    fn sizes(least: f64, greatest: f64, count: usize) -> impl Iterator<Item = f64> {
        (0..count).map(move |k| {
            // the golden ratio leaves no pattern
            let t = (k as f64 * 0.618_033_988_749_895).fract();
            least * (greatest / least).powf(t)
        })
    }

    fn sorted(mut words: Vec<u32>) -> Vec<u32> {
        words.retain(|&w| w != 0);
        words.sort_unstable();
        words.dedup();
        words
    }

    #[test]
    fn numbers_of_each_kind_are_known_over_many_orders_of_magnitude() {
        for (least, greatest) in
            [(1e-6, 1e6), (1e-30, 1e-20), (1.0, 1e3), (1e-3, 1e-1), (1500.0, 4500.0)]
        {
            let words = |of: fn(f64) -> u32| sorted(sizes(least, greatest, 4000).map(of).collect());
            let (as_ibm, as_ieee) = (words(ibm), words(|v| (v as f32).to_bits()));
            assert!(are_ibm(&as_ibm), "{least} to {greatest}");
            assert!(!are_ibm(&as_ieee), "{least} to {greatest}");
            assert!(!are_not_ieee(&as_ieee), "{least} to {greatest}");
        }
        let as_ibm = sorted(sizes(1e-6, 1e6, 4000).map(ibm).collect());
        assert!(are_not_ieee(&as_ibm));
    }

    #[test]
    fn few_or_even_values_raise_no_doubt() {
        for values in [vec![0.0; 100], vec![1.0, 2.0, 3.0], vec![1500.0, 2000.0, 4500.0]] {
            let words = |of: fn(f64) -> u32| sorted(values.iter().copied().map(of).collect());
            assert!(are_ibm(&words(ibm)) && !are_not_ieee(&words(|v| (v as f32).to_bits())));
        }
        // a range without values a little above a power of 4 can be of either kind
        let velocities = sizes(2500.0, 3900.0, 4000).map(|v| (v as f32).to_bits()).collect();
        assert!(!are_not_ieee(&sorted(velocities)));
        // zero with an exponent
        let mut words: Vec<u32> = sizes(1.0, 1e3, 50).map(ibm).collect();
        words.push(0x4000_0000);
        assert!(are_ibm(&sorted(words)));
    }
}
