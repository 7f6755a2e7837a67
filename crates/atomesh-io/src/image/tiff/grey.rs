//! Numbers as they are stored, where the decoder would refuse a palette or turn shades round: it is shown the
//! page's photometric interpretation as "black is zero".

use std::io::{self, Read, Seek, SeekFrom};

/// The tag of the photometric interpretation.
const PHOTOMETRIC: u16 = 262;

/// Black is zero.
const GREY: u16 = 1;

/// A file, of which single bytes read otherwise.
pub(super) struct Patched<R> {
    inner: R,
    at: u64,
    patches: Vec<(u64, u8)>,
}

impl<R: Read + Seek> Patched<R> {
    /// The file as it is, from its beginning.
    pub fn new(inner: R) -> Self {
        Self { inner, at: 0, patches: Vec::new() }
    }

    /// Makes the directory at a place, and no other, say that black is zero.
    ///
    /// # Errors
    /// As the file gives.
    pub fn make_grey(&mut self, directory: u64) -> io::Result<()> {
        self.patches.clear();
        self.seek(SeekFrom::Start(0))?;
        let head: [u8; 4] = self.array()?;
        let is_little = head[0] == b'I';
        let number = |bytes: &[u8]| {
            let fold = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
            if is_little { bytes.iter().rev().fold(0, fold) } else { bytes.iter().fold(0, fold) }
        };
        let is_big = number(&head[2..]) == 43;
        self.seek(SeekFrom::Start(directory))?;
        let (count, entry_bytes, value_at) = match is_big {
            true => (number(&self.array::<8>()?), 20, 12),
            false => (number(&self.array::<2>()?), 12, 8),
        };
        let first = self.at;
        for entry in 0..count {
            let start = first + entry_bytes * entry;
            self.seek(SeekFrom::Start(start))?;
            if number(&self.array::<2>()?) == u64::from(PHOTOMETRIC) {
                let bytes = if is_little { GREY.to_le_bytes() } else { GREY.to_be_bytes() };
                self.patches.extend((start + value_at..).zip(bytes));
                break;
            }
        }
        Ok(())
    }

    fn array<const N: usize>(&mut self) -> io::Result<[u8; N]> {
        let mut bytes = [0; N];
        self.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}

impl<R: Read> Read for Patched<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        for &(place, byte) in &self.patches {
            if let Some(k) = place.checked_sub(self.at).filter(|&k| k < count as u64) {
                buffer[k as usize] = byte;
            }
        }
        self.at += count as u64;
        Ok(count)
    }
}

impl<R: Seek> Seek for Patched<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.at = self.inner.seek(to)?;
        Ok(self.at)
    }
}
