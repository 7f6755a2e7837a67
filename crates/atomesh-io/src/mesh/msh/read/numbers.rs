//! The numbers and words of an MSH file, one after another.

use std::str::FromStr;

use super::super::super::column::{Endian, Number};
use super::super::super::format::MshEncoding;
use super::super::super::read_error::{MeshReadError, excerpt, malformed};

/// Numbers of text or binary sections, one after another.
pub(super) struct Numbers<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
    pub encoding: MshEncoding,
    pub endian: Endian,
}

impl<'a> Numbers<'a> {
    pub fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    pub fn expected(&self, what: impl Into<String>) -> MeshReadError {
        malformed(self.at, what, excerpt(self.bytes, self.at))
    }

    pub fn skip_blanks(&mut self) {
        self.at += self.rest().iter().take_while(|b| b.is_ascii_whitespace()).count();
    }

    /// The name of the next section; `None` at the end.
    pub fn section(&mut self) -> Result<Option<&'a str>, MeshReadError> {
        self.skip_blanks();
        if self.rest().is_empty() {
            return Ok(None);
        }
        match self.line()?.strip_prefix('$') {
            Some(name) if !name.is_empty() => Ok(Some(name)),
            _ => Err(self.expected("a section, '$' and a name, before this")),
        }
    }

    /// The rest of the line, without blanks around it.
    pub fn line(&mut self) -> Result<&'a str, MeshReadError> {
        let rest = self.rest();
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        let text =
            std::str::from_utf8(&rest[..length]).map_err(|_| self.expected("a line of text"))?;
        self.at += (length + 1).min(rest.len());
        Ok(text.trim())
    }

    pub fn skip_past(&mut self, mark: &str) -> Result<(), MeshReadError> {
        let found = self.rest().windows(mark.len()).position(|w| w == mark.as_bytes());
        let found = found.ok_or_else(|| self.expected(mark))?;
        self.at += found + mark.len();
        Ok(())
    }

    /// The next word of text, as a number.
    pub fn word<T: FromStr>(&mut self, what: &str) -> Result<T, MeshReadError> {
        self.skip_blanks();
        let rest = self.rest();
        let length = rest.iter().take_while(|b| !b.is_ascii_whitespace()).count();
        let word = std::str::from_utf8(&rest[..length]).ok().and_then(|w| w.parse().ok());
        let value = word.ok_or_else(|| self.expected(what))?;
        self.at += length;
        Ok(value)
    }

    pub fn number<T: Number + FromStr>(&mut self, what: &str) -> Result<T, MeshReadError> {
        if self.encoding == MshEncoding::Text {
            return self.word(what);
        }
        let bytes = self.rest().get(..T::SIZE).ok_or_else(|| self.expected(what))?;
        self.at += T::SIZE;
        Ok(T::take(bytes, self.endian))
    }

    pub fn int(&mut self) -> Result<i32, MeshReadError> {
        self.number("a 32-bit integer")
    }

    pub fn real(&mut self) -> Result<f64, MeshReadError> {
        self.number("a real number")
    }

    /// A number of things that take at least two bytes each (text) or four (binary).
    pub fn bounded(&self, count: u64, what: &str) -> Result<usize, MeshReadError> {
        match usize::try_from(count) {
            Ok(n) if n <= self.rest().len() / 2 + 1 => Ok(n),
            _ => Err(malformed(self.at, format!("{what} that fit the file"), count.to_string())),
        }
    }
}
