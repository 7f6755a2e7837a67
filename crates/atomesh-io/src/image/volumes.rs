//! Volumes one after another behind a header, plain or packed by gzip, of which one is read.

use std::io::{self, Read};

use atomesh::image::Samples;

use super::channels::mixed;
use super::colour::Values;
use super::error::ReadReason;
use super::gunzip::Unpacked;
use super::memory::Memory;
use super::note::ReadNote;
use super::sample_type::{ByteOrder, SampleType};
use super::shape::{shape_text, too_large};
use super::stream::{self, GZIP_RATIO, Layout};

/// The most bytes that are unpacked behind the samples, so that their check sum is checked.
const MOST_BEHIND: u64 = 1 << 24;

/// What a header says of its volumes.
pub(super) struct Volumes<'a> {
    /// Samples of each along x, y (and z).
    pub shape: &'a [usize],
    pub count: u64,
    pub sample_type: SampleType,
    /// Values a sample: 3 or 4 of colours.
    pub channels: usize,
    pub byte_order: ByteOrder,
    /// Slope and intercept, if they change anything.
    pub scale: Option<(f64, f64)>,
    /// Bytes between the header and the first sample.
    pub gap: u64,
}

impl Volumes<'_> {
    /// The number, from 0, of the volume that is wanted, and a note if it is one of several.
    ///
    /// # Errors
    /// [`ReadReason::Volumes`] if there are several, and none was chosen, or one that is not there.
    pub fn chosen(&self, wanted: Option<usize>) -> Result<(u64, Option<ReadNote>), ReadReason> {
        let Self { count, shape, .. } = *self;
        let (axis, total) = ("volume", usize::try_from(count).unwrap_or(usize::MAX));
        match wanted {
            Some(wanted) if count == 1 => {
                Ok((0, (wanted > 1).then_some(ReadNote::OnePlane { axis, wanted })))
            }
            None if count == 1 => Ok((0, None)),
            Some(number) if (1..=count).contains(&(number as u64)) => {
                Ok((number as u64 - 1, Some(ReadNote::Chosen { axis, number, count: total })))
            }
            wanted => Err(ReadReason::Volumes { count, shape: shape_text(shape), wanted }),
        }
    }

    /// Reads a volume. `source` is behind the header, and `bytes` the size of the file: of a plain one, as far as it
    /// is not read yet. Memory for packed samples is allocated as they come.
    pub fn read(
        &self,
        which: u64,
        source: &mut Unpacked,
        bytes: u64,
        values: &mut Values,
        memory: Memory,
    ) -> Result<Samples, ReadReason> {
        let size = self.sample_type.size();
        let samples = self.shape.iter().try_fold(1u64, |n, &m| n.checked_mul(m as u64));
        let sample_bytes = (size * self.channels) as u64;
        let whole = samples.and_then(|n| n.checked_mul(sample_bytes));
        let (Some(expected), Some(whole)) = (samples, whole) else {
            return Err(too_large(self.shape, bytes));
        };
        let numbers = expected.saturating_mul(self.channels as u64);
        let reserve = if source.is_packed {
            let most = u128::from(bytes) * u128::from(GZIP_RATIO);
            if u128::from(whole) * u128::from(which + 1) > most {
                return Err(too_large(self.shape, bytes));
            }
            (bytes / size as u64).saturating_mul(4)
        } else {
            let found = bytes.saturating_sub(self.gap) / sample_bytes;
            let expected = expected.saturating_mul(self.count);
            if found < expected {
                return Err(ReadReason::Truncated { expected, found });
            }
            numbers
        };
        let before = self.gap.saturating_add(whole.saturating_mul(which));
        let skipped = io::copy(&mut (&mut source.bytes).take(before), &mut io::sink());
        if skipped.map_err(|e| ReadReason::decoder(values.format, e))? < before {
            return Err(ReadReason::Truncated { expected, found: 0 });
        }
        let layout = Layout {
            sample_type: self.sample_type,
            byte_order: self.byte_order,
            count: numbers as usize,
            reserve: usize::try_from(reserve).unwrap_or(usize::MAX),
            scale: self.scale,
            turned: None,
            memory,
        };
        let stored = stream::read_samples(&mut source.bytes, &layout)?;
        if source.is_packed {
            io::copy(&mut (&mut source.bytes).take(MOST_BEHIND), &mut io::sink())
                .map_err(|e| ReadReason::decoder(values.format, e))?;
        }
        mixed(stored, self.channels, values)
    }
}
