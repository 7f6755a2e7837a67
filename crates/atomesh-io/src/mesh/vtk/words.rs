//! The words and lines of VTK's legacy files.

use super::super::read_error::{MeshReadError, excerpt, malformed};

/// Takes words and lines one after another; between them may be binary data.
pub(crate) struct Words<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
}

impl<'a> Words<'a> {
    /// Takes the first three lines; whether data are binary.
    pub fn head(&mut self) -> Result<bool, MeshReadError> {
        if !self.bytes.starts_with(b"# vtk DataFile Version") {
            return Err(malformed(0, "\"# vtk DataFile Version\"", excerpt(self.bytes, 0)));
        }
        self.line()?;
        self.line()?; // the title
        match self.line()? {
            "BINARY" => Ok(true),
            "ASCII" => Ok(false),
            other => Err(malformed(self.at, "BINARY or ASCII before this", other)),
        }
    }

    pub fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// The rest of the line, without blanks around it.
    pub fn line(&mut self) -> Result<&'a str, MeshReadError> {
        let rest = self.rest();
        if rest.is_empty() {
            return Ok("");
        }
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        let text = std::str::from_utf8(&rest[..length]);
        let text =
            text.map_err(|_| malformed(self.at, "a line of text", excerpt(self.bytes, self.at)))?;
        self.at += (length + 1).min(rest.len());
        Ok(text.trim())
    }

    /// Passes over lines up to an empty one.
    pub fn skip_metadata(&mut self) -> Result<(), MeshReadError> {
        self.line()?; // the keyword's own line
        while !self.line()?.is_empty() {}
        Ok(())
    }

    /// The next word, if there is one.
    pub fn keyword(&mut self) -> Result<Option<&'a str>, MeshReadError> {
        self.at += self.rest().iter().take_while(|b| b.is_ascii_whitespace()).count();
        let rest = self.rest();
        let length = rest.iter().take_while(|b| !b.is_ascii_whitespace()).count();
        let word = std::str::from_utf8(&rest[..length]);
        let word = word.map_err(|_| malformed(self.at, "a word", excerpt(self.bytes, self.at)))?;
        self.at += length;
        Ok((length > 0).then_some(word))
    }

    /// Passes over a word, if it comes next; what comes next may be binary.
    pub fn accept(&mut self, word: &str) -> bool {
        let blanks = self.rest().iter().take_while(|b| b.is_ascii_whitespace()).count();
        let found = self.rest()[blanks..].starts_with(word.as_bytes());
        if found {
            self.at += blanks + word.len();
        }
        found
    }

    pub fn word(&mut self) -> Result<&'a str, MeshReadError> {
        self.keyword()?.ok_or_else(|| malformed(self.at, "a word", "the end"))
    }

    pub fn count(&mut self) -> Result<usize, MeshReadError> {
        let word = self.word()?;
        word.parse().map_err(|_| malformed(self.at, "a count before this", word))
    }
}
