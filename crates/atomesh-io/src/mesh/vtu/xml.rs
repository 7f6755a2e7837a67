//! The subset of XML that VTK's files use: tags with attributes, comments, text; no entities in values that
//! matter, no namespaces. Appended data may be raw bytes, so this reads bytes.

use super::super::read_error::{MeshReadError, excerpt, malformed};

/// An opening tag (or one that closes itself).
#[derive(Clone, Debug)]
pub(crate) struct Tag<'a> {
    /// Where it begins.
    pub at: usize,
    pub name: &'a str,
    attributes: Vec<(&'a str, &'a str)>,
    /// Whether it ends in "/>".
    pub closed: bool,
}

impl<'a> Tag<'a> {
    /// The value of an attribute.
    pub fn get(&self, name: &str) -> Option<&'a str> {
        self.attributes.iter().find(|(n, _)| *n == name).map(|(_, value)| *value)
    }

    /// The value of an attribute that must be there.
    pub fn require(&self, name: &str) -> Result<&'a str, MeshReadError> {
        self.get(name).ok_or_else(|| {
            let found = format!("<{}> without it", self.name);
            malformed(self.at, format!("the attribute {name}"), found)
        })
    }

    /// The value of an attribute that must be a count.
    pub fn count(&self, name: &str) -> Result<usize, MeshReadError> {
        let value = self.require(name)?;
        value.trim().parse().map_err(|_| malformed(self.at, format!("a count in {name}"), value))
    }
}

/// What comes next in a file.
#[derive(Clone, Debug)]
pub(super) enum Event<'a> {
    Open(Tag<'a>),
    Close(&'a str),
    End,
}

/// Reads tags one after another.
pub(super) struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Scanner<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Where the next event is looked for: after an opening tag, where its text begins.
    pub fn at(&self) -> usize {
        self.at
    }

    /// The next tag; text, comments and declarations are passed over.
    pub fn next(&mut self) -> Result<Event<'a>, MeshReadError> {
        loop {
            let Some(open) = find(self.bytes, self.at, b"<") else {
                self.at = self.bytes.len();
                return Ok(Event::End);
            };
            self.at = open + 1;
            let rest = &self.bytes[self.at..];
            if rest.starts_with(b"!--") {
                self.skip_to(b"-->")?;
            } else if rest.starts_with(b"?") || rest.starts_with(b"!") {
                self.skip_to(b">")?;
            } else if rest.starts_with(b"/") {
                self.at += 1;
                let name = self.name()?;
                self.skip_to(b">")?;
                return Ok(Event::Close(name));
            } else {
                return self.tag(open).map(Event::Open);
            }
        }
    }

    fn tag(&mut self, at: usize) -> Result<Tag<'a>, MeshReadError> {
        let mut tag = Tag { at, name: self.name()?, attributes: vec![], closed: false };
        loop {
            self.skip_blanks();
            match self.bytes.get(self.at) {
                Some(b'>') => {
                    self.at += 1;
                    return Ok(tag);
                }
                Some(b'/') if self.bytes.get(self.at + 1) == Some(&b'>') => {
                    self.at += 2;
                    tag.closed = true;
                    return Ok(tag);
                }
                _ => {
                    let attribute = self.attribute()?;
                    tag.attributes.push(attribute);
                }
            }
        }
    }

    fn attribute(&mut self) -> Result<(&'a str, &'a str), MeshReadError> {
        let name = self.name()?;
        self.skip_blanks();
        if self.bytes.get(self.at) != Some(&b'=') {
            return Err(self.expected("'='"));
        }
        self.at += 1;
        self.skip_blanks();
        let quote = match self.bytes.get(self.at) {
            Some(&q) if q == b'"' || q == b'\'' => q,
            _ => return Err(self.expected("a quoted value")),
        };
        let start = self.at + 1;
        let end =
            find(self.bytes, start, &[quote]).ok_or_else(|| self.expected("a closing quote"))?;
        let value = std::str::from_utf8(&self.bytes[start..end])
            .map_err(|_| malformed(start, "UTF-8", excerpt(self.bytes, start)))?;
        self.at = end + 1;
        Ok((name, value))
    }

    fn name(&mut self) -> Result<&'a str, MeshReadError> {
        let plain = |b: &&u8| b.is_ascii_alphanumeric() || b"_-.:".contains(b);
        let rest = &self.bytes[self.at.min(self.bytes.len())..];
        let length = rest.iter().take_while(plain).count();
        match std::str::from_utf8(&rest[..length]) {
            Ok(name) if length > 0 => {
                self.at += length;
                Ok(name)
            }
            _ => Err(self.expected("a name")),
        }
    }

    fn skip_blanks(&mut self) {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    fn skip_to(&mut self, end: &[u8]) -> Result<(), MeshReadError> {
        match find(self.bytes, self.at, end) {
            Some(at) => {
                self.at = at + end.len();
                Ok(())
            }
            None => Err(malformed(self.at, format!("\"{}\"", end.escape_ascii()), "the end")),
        }
    }

    fn expected(&self, what: &str) -> MeshReadError {
        malformed(self.at, what, excerpt(self.bytes, self.at))
    }
}

/// Where `what` is, from `start` on.
pub(super) fn find(bytes: &[u8], start: usize, what: &[u8]) -> Option<usize> {
    let rest = bytes.get(start..)?;
    let place = match what {
        [one] => rest.iter().position(|b| b == one),
        _ => rest.windows(what.len()).position(|w| w == what),
    };
    place.map(|p| p + start)
}
