//! What headers in text share: lines, lists of numbers, and samples as text.

use std::io::{self, BufRead, Read};
use std::str::FromStr;

use super::error::ReadReason;
use super::sample_type::SampleType;

/// The longest header that is read, detached names included.
const LONGEST_HEADER: usize = 1 << 22;

/// The longest word that can be a number; the digits of any double precision fit.
const LONGEST_WORD: usize = 1 << 11;

/// Takes the lines of a header one by one, and counts their bytes.
pub(super) struct Lines<'a> {
    source: &'a mut dyn BufRead,
    /// The bytes taken so far.
    pub bytes: u64,
}

impl<'a> Lines<'a> {
    /// The lines from where `source` is.
    pub fn new(source: &'a mut dyn BufRead) -> Self {
        Self { source, bytes: 0 }
    }

    /// The next line without its end, none at the end of the file. Bytes that are no UTF-8, as in
    /// comments of old files, are replaced.
    pub fn next(&mut self) -> Result<Option<String>, ReadReason> {
        let mut line = Vec::new();
        let room = (LONGEST_HEADER as u64).saturating_sub(self.bytes);
        let count = (&mut *self.source).take(room).read_until(b'\n', &mut line);
        let count = count.map_err(ReadReason::Io)?;
        self.bytes += count as u64;
        if count == 0 {
            return Ok(None);
        }
        while let Some(b'\n' | b'\r') = line.last() {
            line.pop();
        }
        Ok(Some(String::from_utf8_lossy(&line).into_owned()))
    }
}

/// All words of `text` as numbers, none if one of them is not.
pub(super) fn numbers<T: FromStr>(text: &str) -> Option<Vec<T>> {
    text.split_whitespace().map(|word| word.parse().ok()).collect()
}

/// At most 80 characters of a value, for a message.
pub(super) fn shortened(value: &str) -> String {
    match value.char_indices().nth(80) {
        Some((end, _)) => format!("{} ...", &value[..end]),
        None => value.into(),
    }
}

/// Reads decimal numbers, parted by blanks or commas, as the bytes of samples, least significant
/// first.
pub(super) struct TextSamples<R> {
    source: R,
    sample_type: SampleType,
    /// Bytes of a sample that are not taken yet, and where the next one is.
    pending: Vec<u8>,
    next: usize,
    /// The words taken so far.
    count: u64,
}

impl<R: BufRead> TextSamples<R> {
    /// The samples of that type from where `source` is.
    pub fn new(source: R, sample_type: SampleType) -> Self {
        Self { source, sample_type, pending: Vec::new(), next: 0, count: 0 }
    }

    /// The next word, empty at the end.
    fn word(&mut self) -> io::Result<Vec<u8>> {
        let mut word = Vec::new();
        loop {
            let buffer = self.source.fill_buf()?;
            if buffer.is_empty() {
                return Ok(word);
            }
            let is_gap = |b: &u8| b.is_ascii_whitespace() || *b == b',';
            let end = buffer.iter().position(is_gap);
            let taken = end.unwrap_or(buffer.len());
            word.extend_from_slice(&buffer[..taken]);
            self.source.consume(taken + usize::from(end.is_some()));
            if word.len() > LONGEST_WORD {
                return Err(self.wrong());
            }
            if end.is_some() && !word.is_empty() {
                return Ok(word);
            }
        }
    }

    /// The error for the word at hand. It is not told: a header may name any file as that of its samples.
    fn wrong(&self) -> io::Error {
        let text = format!("word {} is not of type {}", self.count + 1, self.sample_type);
        io::Error::new(io::ErrorKind::InvalidData, text)
    }

    /// Makes the next sample's bytes ready.
    fn advance(&mut self) -> io::Result<()> {
        let word = self.word()?;
        self.pending.clear();
        self.next = 0;
        if word.is_empty() {
            return Ok(());
        }
        /// The bytes of the word as one of the types.
        macro_rules! bytes_as {
            ($text:expr, $($kind:ident $number:ty),*) => {
                match self.sample_type {
                    $(SampleType::$kind => {
                        $text.parse::<$number>().ok().map(|n| n.to_le_bytes().to_vec())
                    })*
                    SampleType::Bool | SampleType::F16 => None,
                }
            };
        }
        let text = std::str::from_utf8(&word).unwrap_or_default();
        let bytes = bytes_as!(text, U8 u8, I8 i8, U16 u16, I16 i16, U32 u32, I32 i32, U64 u64,
            I64 i64, F32 f32, F64 f64);
        self.pending = bytes.ok_or_else(|| self.wrong())?;
        self.count += 1;
        Ok(())
    }
}

impl<R: BufRead> Read for TextSamples<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut filled = 0;
        while filled < buffer.len() {
            if self.next == self.pending.len() {
                self.advance()?;
                if self.pending.is_empty() {
                    break;
                }
            }
            let count = (buffer.len() - filled).min(self.pending.len() - self.next);
            buffer[filled..filled + count]
                .copy_from_slice(&self.pending[self.next..self.next + count]);
            self.next += count;
            filled += count;
        }
        Ok(filled)
    }
}

/// Reads bytes that are written in two hexadecimal digits each, with gaps between any of them.
pub(super) struct HexBytes<R> {
    source: R,
    /// The digits taken so far.
    count: u64,
}

impl<R: BufRead> HexBytes<R> {
    /// The bytes from where `source` is.
    pub fn new(source: R) -> Self {
        Self { source, count: 0 }
    }

    /// The next digit, if there is one.
    fn digit(&mut self) -> io::Result<Option<u8>> {
        loop {
            let Some(&letter) = self.source.fill_buf()?.first() else { return Ok(None) };
            self.source.consume(1);
            if letter.is_ascii_whitespace() {
                continue;
            }
            self.count += 1;
            let digit = char::from(letter).to_digit(16).map(|digit| digit as u8);
            // the letter is not told: a header may name any file as that of its samples
            let wrong = || {
                let text = format!("letter {} is no hexadecimal digit", self.count);
                io::Error::new(io::ErrorKind::InvalidData, text)
            };
            return digit.map(Some).ok_or_else(wrong);
        }
    }
}

impl<R: BufRead> Read for HexBytes<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        for filled in 0..buffer.len() {
            let (Some(high), Some(low)) = (self.digit()?, self.digit()?) else { return Ok(filled) };
            buffer[filled] = high << 4 | low;
        }
        Ok(buffer.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_become_samples_whatever_parts_them() {
        let text = b" 1, -2\n3\t\r\n 400 ,5";
        for capacity in [1, 2, 100] {
            let source = io::BufReader::with_capacity(capacity, &text[..]);
            let mut bytes = Vec::new();
            TextSamples::new(source, SampleType::I16).read_to_end(&mut bytes).unwrap();
            let numbers: Vec<_> =
                bytes.as_chunks::<2>().0.iter().map(|&b| i16::from_le_bytes(b)).collect();
            assert_eq!(numbers, [1, -2, 3, 400, 5]);
        }
    }

    #[test]
    fn words_that_are_no_sample_are_counted_and_not_told() {
        for (text, kind, word) in [
            ("1 300", SampleType::U8, 2),
            ("1.5", SampleType::I32, 1),
            ("root:x", SampleType::U8, 1),
        ] {
            let read = TextSamples::new(text.as_bytes(), kind).read_to_end(&mut Vec::new());
            let message = read.unwrap_err().to_string();
            assert_eq!(message, format!("word {word} is not of type {kind}"));
        }
        let endless = vec![b'1'; 1 << 20];
        assert!(TextSamples::new(&endless[..], SampleType::F64).read(&mut [0; 8]).is_err());
    }

    #[test]
    fn lines_end_in_either_way_and_are_counted() {
        let mut source = &b"NRRD0004\r\n# \xe9\nlast"[..];
        let mut lines = Lines::new(&mut source);
        assert_eq!(lines.next().unwrap().unwrap(), "NRRD0004");
        assert_eq!(lines.next().unwrap().unwrap(), "# \u{fffd}");
        assert_eq!(lines.next().unwrap().unwrap(), "last");
        assert_eq!((lines.next().unwrap(), lines.bytes), (None, 18));
    }

    #[test]
    fn hexadecimal_digits_become_bytes() {
        let mut bytes = Vec::new();
        HexBytes::new(&b"0a Ff\n1 2"[..]).read_to_end(&mut bytes).unwrap();
        assert_eq!(bytes, [0x0a, 0xff, 0x12]);
        let odd = HexBytes::new(&b"0a0"[..]).read(&mut [0; 9]).unwrap();
        assert_eq!(odd, 1);
        let message = HexBytes::new(&b"0a password"[..]).read(&mut [0; 9]).unwrap_err().to_string();
        assert_eq!(message, "letter 3 is no hexadecimal digit");
    }
}
