//! The header of a PNM file: words before the samples, or, in PAM, lines.

use std::io::BufRead;

use super::super::error::ReadReason;
use super::super::sample_type::SampleType;
use super::super::stream;
use super::super::text::shortened;
use super::wrong;

/// How samples stand in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Raster {
    /// Digits 0 and 1.
    TextBits,
    /// Decimal numbers.
    Text,
    /// Bits, eight in a byte.
    Bits,
    /// Numbers of one or two bytes.
    Bytes,
}

/// What a header says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub raster: Raster,
    /// Samples along x and y.
    pub shape: [usize; 2],
    /// Values of a sample: grey or colour, with or without opacity.
    pub channels: usize,
    /// The value of white, from 1 to 65535.
    pub greatest: u32,
    /// Whether greater values are refused, not cut.
    pub is_strict: bool,
}

impl Header {
    /// Reads a header, up to the first sample.
    pub fn read(source: &mut dyn BufRead) -> Result<Self, ReadReason> {
        let magic = [byte(source)?, byte(source)?];
        let (raster, channels) = match magic[1] {
            Some(b'1') => (Raster::TextBits, 1),
            Some(b'2') => (Raster::Text, 1),
            Some(b'3') => (Raster::Text, 3),
            Some(b'4') => (Raster::Bits, 1),
            Some(b'5') => (Raster::Bytes, 1),
            Some(b'6') => (Raster::Bytes, 3),
            _ => return Self::read_pam(source),
        };
        let shape = [number(source)? as usize, number(source)? as usize];
        let greatest = match raster {
            Raster::TextBits | Raster::Bits => 1,
            Raster::Text | Raster::Bytes => number(source)?,
        };
        Self { raster, shape, channels, greatest, is_strict: false }.checked()
    }

    fn read_pam(source: &mut dyn BufRead) -> Result<Self, ReadReason> {
        let mut entries = Pam::default();
        match byte(source)? {
            Some(b'\n') => entries.read(source)?,
            other => return Err(wrong("byte after P7", text_of(other), "a line break")),
        }
        let [width, height, depth, greatest] = entries.numbers;
        let missing = |name| wrong(name, "missing", "a line of that name");
        let shape = [
            width.ok_or_else(|| missing("WIDTH"))? as usize,
            height.ok_or_else(|| missing("HEIGHT"))? as usize,
        ];
        let channels = depth.ok_or_else(|| missing("DEPTH"))?;
        let greatest = greatest.ok_or_else(|| missing("MAXVAL"))?;
        let kind = entries.kind.join(" ");
        let (expected, is_strict) = match kind.as_str() {
            "BLACKANDWHITE" => (1, true),
            "BLACKANDWHITE_ALPHA" => (2, true),
            "GRAYSCALE" => (1, false),
            "GRAYSCALE_ALPHA" => (2, false),
            "RGB" => (3, false),
            "RGB_ALPHA" => (4, false),
            "" if (1..=4).contains(&channels) => (channels, false),
            "" => return Err(wrong("DEPTH", channels, "1 to 4")),
            _ => return Err(wrong("TUPLTYPE", shortened(&kind), "black and white, grey or RGB")),
        };
        if channels != expected {
            return Err(wrong("DEPTH", channels, "the number of values that TUPLTYPE has"));
        }
        if is_strict && greatest != 1 {
            return Err(wrong("MAXVAL", greatest, "1 in a black and white image"));
        }
        let channels = channels as usize;
        Self { raster: Raster::Bytes, shape, channels, greatest, is_strict }.checked()
    }

    fn checked(self) -> Result<Self, ReadReason> {
        match self.greatest {
            1..=0xffff => Ok(self),
            other => Err(wrong("MAXVAL", other, "1 to 65535")),
        }
    }

    /// The type that holds the greatest value.
    pub fn sample_type(&self) -> SampleType {
        if self.greatest <= 0xff { SampleType::U8 } else { SampleType::U16 }
    }
}

/// The lines of a PAM header.
#[derive(Default)]
struct Pam {
    /// Those of [`NAMES`].
    numbers: [Option<u32>; 4],
    kind: Vec<String>,
}

/// The lines with a number.
const NAMES: [&str; 4] = ["WIDTH", "HEIGHT", "DEPTH", "MAXVAL"];

/// The longest line that is read.
const LONGEST_LINE: usize = 1 << 12;

impl Pam {
    fn read(&mut self, source: &mut dyn BufRead) -> Result<(), ReadReason> {
        loop {
            let line = line(source)?;
            if line.starts_with('#') {
                continue;
            }
            let mut words = line.split_whitespace();
            let Some(name) = words.next() else {
                return Err(wrong("line", "empty", "ENDHDR to end the header"));
            };
            let rest = words.collect::<Vec<_>>().join(" ");
            match (name, NAMES.iter().position(|own| *own == name)) {
                ("ENDHDR", _) => return Ok(()),
                ("TUPLTYPE", _) => self.kind.push(rest),
                (_, Some(at)) if self.numbers[at].is_some() => {
                    return Err(wrong(NAMES[at], "given twice", "one line of that name"));
                }
                (_, Some(at)) => {
                    let number = rest.parse();
                    self.numbers[at] = Some(number.map_err(|_| {
                        wrong(NAMES[at], shortened(&rest), "a whole number below 2^32")
                    })?);
                }
                _ => {
                    let expected = "WIDTH, HEIGHT, DEPTH, MAXVAL, TUPLTYPE or ENDHDR";
                    return Err(wrong("line", shortened(&line), expected));
                }
            }
        }
    }
}

/// A line without its end, as text.
fn line(source: &mut dyn BufRead) -> Result<String, ReadReason> {
    let mut line = Vec::new();
    while let Some(next) = byte(source)?.filter(|&next| next != b'\n') {
        line.push(next);
        if line.len() > LONGEST_LINE {
            return Err(wrong("line", "longer than 4096 bytes", "a header"));
        }
    }
    String::from_utf8(line).map_err(|_| wrong("line", "not UTF-8", "text"))
}

/// The next byte; none at the end.
fn byte(source: &mut dyn BufRead) -> Result<Option<u8>, ReadReason> {
    let mut byte = [0];
    Ok((stream::fill(source, &mut byte)? > 0).then_some(byte[0]))
}

fn text_of(byte: Option<u8>) -> String {
    byte.map_or("missing".into(), |byte| format!("\"{}\"", byte.escape_ascii()))
}

/// What parts words: also the vertical tab, which [`u8::is_ascii_whitespace`] leaves out.
pub(super) fn is_blank(byte: u8) -> bool {
    byte.is_ascii_whitespace() || byte == 0x0b
}

/// The next number, with the one blank after it; blanks and comments before it are passed over.
fn number(source: &mut dyn BufRead) -> Result<u32, ReadReason> {
    let mut value: Option<u32> = None;
    loop {
        let mut next = byte(source)?;
        if next == Some(b'#') {
            while !matches!(next, None | Some(b'\n' | b'\r')) {
                next = byte(source)?;
            }
        }
        match (next, value) {
            (Some(digit @ b'0'..=b'9'), _) => {
                let sum = value.unwrap_or(0).checked_mul(10);
                let sum = sum.and_then(|sum| sum.checked_add(u32::from(digit - b'0')));
                value = Some(sum.ok_or_else(|| wrong("number", "too large", "one below 2^32"))?);
            }
            (Some(blank), None) if is_blank(blank) => {}
            (Some(blank), Some(value)) if is_blank(blank) => return Ok(value),
            (None, Some(value)) => return Ok(value),
            (other, _) => return Err(wrong("number", text_of(other), "width, height and MAXVAL")),
        }
    }
}
