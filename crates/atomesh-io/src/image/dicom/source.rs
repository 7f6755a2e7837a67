//! The bytes of a file, as they are or inflated.

use std::io::{self, Read, Seek, SeekFrom};

use flate2::read::DeflateDecoder;

/// The bytes of a file.
pub(super) enum Bytes<R> {
    /// As they are.
    Plain(R),
    /// Inflated from some place on.
    Inflated(Inflated<R>),
    /// None, while they change hands.
    Gone,
}

impl<R: Read + Seek> Read for Bytes<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Plain(source) => source.read(buffer),
            Self::Inflated(source) => source.read(buffer),
            Self::Gone => Ok(0),
        }
    }
}

impl<R: Read + Seek> Seek for Bytes<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            Self::Plain(source) => source.seek(to),
            Self::Inflated(source) => source.seek(to),
            Self::Gone => Ok(0),
        }
    }
}

/// Bytes that are inflated as they are read, and counted as if they stood in the file from where the deflated ones
/// begin. Nothing is held: to go back is to inflate from the beginning.
pub(super) struct Inflated<R> {
    packed: Option<DeflateDecoder<R>>,
    /// Where they begin.
    pub start: u64,
    at: u64,
}

impl<R: Read + Seek> Inflated<R> {
    /// What is deflated in `source` from byte `start` on.
    pub fn new(mut source: R, start: u64) -> io::Result<Self> {
        source.seek(SeekFrom::Start(start))?;
        Ok(Self { packed: Some(DeflateDecoder::new(source)), start, at: start })
    }
}

impl<R: Read> Read for Inflated<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let Some(packed) = &mut self.packed else { return Ok(0) };
        let count = packed.read(buffer)?;
        self.at += count as u64;
        Ok(count)
    }
}

impl<R: Read + Seek> Seek for Inflated<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let target = match to {
            SeekFrom::Start(place) => Some(place),
            SeekFrom::Current(step) => self.at.checked_add_signed(step),
            SeekFrom::End(_) => None,
        };
        let target = target.filter(|&place| place >= self.start);
        let target = target.ok_or_else(|| io::Error::from(io::ErrorKind::InvalidInput))?;
        if target < self.at
            && let Some(packed) = self.packed.take()
        {
            *self = Self::new(packed.into_inner(), self.start)?;
        }
        let left = target - self.at;
        let skipped = io::copy(&mut self.by_ref().take(left), &mut io::sink())?;
        match self.at == target {
            true => Ok(self.at),
            false => Err(io::Error::new(
                io::ErrorKind::UnexpectedEof,
                format!("{skipped} of {left} bytes are left"),
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Cursor, Write};

    #[test]
    fn inflated_bytes_are_read_from_any_place_of_them() {
        let bytes: Vec<u8> = (0..50_000_u32).flat_map(|k| (k * k).to_le_bytes()).collect();
        let mut packed = flate2::write::DeflateEncoder::new(vec![9; 7], Default::default());
        packed.write_all(&bytes).unwrap();
        let mut source = Inflated::new(Cursor::new(packed.finish().unwrap()), 7).unwrap();
        let mut word = [0; 4];
        for place in [0, 120_000, 40, 199_996, 0] {
            assert_eq!(source.seek(SeekFrom::Start(7 + place)).unwrap(), 7 + place);
            source.read_exact(&mut word).unwrap();
            assert_eq!(word, bytes[place as usize..][..4]);
        }
        assert_eq!(source.seek(SeekFrom::Current(-4)).unwrap(), 7);
        assert!(source.seek(SeekFrom::Start(8 + 200_000)).is_err());
        assert!(source.seek(SeekFrom::Start(6)).is_err());
    }
}
