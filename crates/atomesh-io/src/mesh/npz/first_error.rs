//! A writer that keeps its first error.

use std::io::{self, Seek, SeekFrom, Write};

/// Hands bytes on until the first error, and then only counts what comes. An archive that is dropped unfinished tries to
/// write its end and prints that it cannot: with this it can.
pub(super) struct FirstError<'a, W> {
    out: &'a mut W,
    error: Option<io::Error>,
    at: u64,
    end: u64,
}

impl<'a, W: Write + Seek> FirstError<'a, W> {
    pub fn new(out: &'a mut W) -> Self {
        Self { out, error: None, at: 0, end: 0 }
    }

    /// The first error, if there was one.
    pub fn result(self) -> io::Result<()> {
        self.error.map_or(Ok(()), Err)
    }

    /// Does something, unless there was an error; then gives `instead`.
    fn attempt<T>(
        &mut self,
        act: impl FnOnce(&mut W) -> io::Result<T>,
        instead: T,
    ) -> io::Result<T> {
        if self.error.is_some() {
            return Ok(instead);
        }
        act(self.out).map_err(|e| {
            let kind = e.kind();
            if kind != io::ErrorKind::Interrupted {
                self.error = Some(e);
            }
            kind.into()
        })
    }
}

impl<W: Write + Seek> Write for FirstError<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.attempt(|out| out.write(bytes), bytes.len())?;
        self.at += count as u64;
        self.end = self.end.max(self.at);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.attempt(W::flush, ())
    }
}

impl<W: Write + Seek> Seek for FirstError<'_, W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let counted = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(step) => self.end.checked_add_signed(step),
            SeekFrom::Current(step) => self.at.checked_add_signed(step),
        };
        self.at = self.attempt(|out| out.seek(to), counted.unwrap_or(0))?;
        Ok(self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn what_comes_after_an_error_is_taken_and_the_error_is_kept() {
        let mut room = [0; 4];
        let mut out = Cursor::new(&mut room[..]);
        let mut writer = FirstError::new(&mut out);
        writer.write_all(b"abc").unwrap();
        writer.seek(SeekFrom::Start(2)).unwrap();
        // there is no place before the first, which only the inner writer knows
        writer.write_all(b"CD").unwrap();
        assert!(writer.seek(SeekFrom::Current(-9)).is_err());
        let error = Cursor::new([0; 1]).seek(SeekFrom::Current(-9)).unwrap_err();
        writer.write_all(b"more").unwrap();
        assert_eq!(writer.seek(SeekFrom::Start(1)).unwrap(), 1);
        assert_eq!(writer.seek(SeekFrom::End(0)).unwrap(), 8);
        assert_eq!(writer.result().unwrap_err().to_string(), error.to_string());
        assert_eq!(&room, b"abCD");
    }
}
