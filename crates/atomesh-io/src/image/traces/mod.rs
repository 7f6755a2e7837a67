//! Samples that are stored trace by trace, as columns of an image, to x fastest.
//!
//! Traces are read in blocks, and each sample is written to its place. For every depth the block's traces lie
//! side by side, so that cache lines are used whole on both sides.

use std::io::Read;

use atomesh::image::Samples;

use super::error::ReadReason;
use super::memory::Memory;
use super::sample_type::ByteOrder;
use super::stream;

mod number;

pub(super) use number::Ibm;
pub use number::SampleFormat;

/// Bytes of traces that are held at a time.
const BLOCK: usize = 1 << 21;

/// The place of a trace whose samples are left out.
pub(super) const NOWHERE: usize = usize::MAX;

/// How traces lie in a stream of bytes, one after another.
pub(super) struct TraceLayout<'a> {
    pub format: SampleFormat,
    pub byte_order: ByteOrder,
    /// Bytes before the samples of each.
    pub header_bytes: usize,
    /// Samples of each.
    pub samples: usize,
    /// Where each belongs in a plane of equal depth; [`NOWHERE`] if its samples are not wanted.
    pub places: &'a [usize],
    /// The places of a plane.
    pub plane: usize,
    /// The memory that the samples may take.
    pub memory: Memory,
}

/// Reads the samples of all traces to their places; places without a trace stay 0.
pub(super) fn read(source: &mut dyn Read, layout: &TraceLayout<'_>) -> Result<Samples, ReadReason> {
    /// Reads numbers with one function for each type.
    macro_rules! read_as {
        ($kind:ident, $number:ident) => {
            Samples::$kind(spread(source, layout, $number::from_be_bytes)?.into())
        };
    }
    Ok(match layout.format {
        SampleFormat::Ibm => {
            let ibm = Ibm::new();
            Samples::F32(spread(source, layout, |b| ibm.decode(u32::from_be_bytes(b)))?.into())
        }
        SampleFormat::F32 => read_as!(F32, f32),
        SampleFormat::F64 => read_as!(F64, f64),
        SampleFormat::I8 => read_as!(I8, i8),
        SampleFormat::I16 => read_as!(I16, i16),
        SampleFormat::I32 => read_as!(I32, i32),
        SampleFormat::U8 => read_as!(U8, u8),
        SampleFormat::U16 => read_as!(U16, u16),
        SampleFormat::U32 => read_as!(U32, u32),
    })
}

/// The traces as numbers of `N` bytes.
fn spread<const N: usize, T: Copy + Default>(
    source: &mut dyn Read,
    layout: &TraceLayout<'_>,
    decode: impl Fn([u8; N]) -> T,
) -> Result<Vec<T>, ReadReason> {
    let TraceLayout { byte_order, header_bytes, samples: depth, places, plane, memory, .. } =
        *layout;
    let mut samples = memory.zeros(plane.saturating_mul(depth))?;
    let each = header_bytes + depth * N;
    let mut buffer: Vec<u8> = memory.zeros(each * (BLOCK / each).clamp(1, places.len().max(1)))?;
    for (block, places) in places.chunks(buffer.len() / each).enumerate() {
        let bytes = &mut buffer[..places.len() * each];
        let filled = stream::fill(source, bytes)?;
        if filled < bytes.len() {
            let whole = block * (buffer.len() / each) + filled / each;
            let count = |traces: usize| (traces * depth) as u64;
            let (expected, found) = (count(layout.places.len()), count(whole));
            return Err(ReadReason::Truncated { expected, found });
        }
        for z in 0..depth {
            let row = &mut samples[z * plane..][..plane];
            for (trace, &place) in bytes.chunks_exact(each).zip(places) {
                if place == NOWHERE {
                    continue;
                }
                let mut number = [0; N];
                number.copy_from_slice(&trace[header_bytes + z * N..][..N]);
                if byte_order == ByteOrder::Little {
                    number.reverse();
                }
                row[place] = decode(number);
            }
        }
    }
    Ok(samples)
}
