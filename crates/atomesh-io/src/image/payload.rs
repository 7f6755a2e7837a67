//! The samples that a header in text describes: after it, or in files of their own; plain, packed or
//! as text.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::PathBuf;

use atomesh::image::Samples;
use bzip2_rs::DecoderReader as Bzip2Decoder;
use flate2::bufread::ZlibDecoder;

use super::detached::DataFolders;
use super::error::ReadReason;
use super::format::ImageFormat;
use super::gunzip::Gunzip;
use super::memory::Memory;
use super::sample_type::{ByteOrder, SampleType};
use super::shape::plausible_count;
use super::stream::{self, GZIP_RATIO, Layout};
use super::text::{HexBytes, TextSamples};
use super::watched::Watched;

/// The most files that hold one image's samples.
const MOST_FILES: usize = 1 << 16;

/// Samples for each byte of a file from which on a shape is called absurd and not cut short.
const ABSURD: u64 = 1 << 10;

/// How samples are turned into bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    /// As they are in memory.
    Raw,
    /// As decimal numbers.
    Text,
    /// Packed by gzip.
    Gzip,
    /// Packed by zlib.
    Zlib,
    /// Packed by bzip2.
    Bzip2,
    /// Bytes in two hexadecimal digits each.
    Hex,
}

/// The most bytes that a byte of bzip2 can stand for: a block of one value, 45 MB, takes some 40 bytes.
const BZIP2_RATIO: u64 = 1 << 20;

/// What a header says about its samples.
#[derive(Clone, Debug)]
pub(super) struct Payload {
    /// The header's format, for messages.
    pub format: ImageFormat,
    /// Samples along x, y (and z).
    pub shape: Vec<usize>,
    pub sample_type: SampleType,
    pub byte_order: ByteOrder,
    pub encoding: Encoding,
    /// Lines before the samples, in each file.
    pub line_skip: u64,
    /// Bytes after those lines, once unpacked, in each file; none if the samples are the last bytes of the
    /// file, whatever comes before.
    pub byte_skip: Option<u64>,
    /// The files that hold the samples one after another, relative to the header's folder; none if
    /// they follow the header.
    pub files: Option<Vec<String>>,
}

impl Payload {
    /// Reads the samples. `source` is behind the header; `rest` bytes follow there.
    pub fn read<R: Read>(
        &self,
        source: BufReader<Watched<R>>,
        rest: u64,
        folders: Option<DataFolders>,
        memory: Memory,
    ) -> Result<Samples, ReadReason> {
        let Some(names) = &self.files else { return self.decode(source, rest, memory) };
        let (paths, bytes) = self.found(names, folders)?;
        // of one file, what stands before its samples is left out as after a header
        let (before, of_whole) = match (paths.len(), self.byte_skip) {
            (..2, skip) => ((0, 0), (self.line_skip, skip)),
            (_, Some(skip)) if skip == 0 || self.encoding == Encoding::Raw => {
                ((self.line_skip, skip), (0, Some(0)))
            }
            _ => return Err(self.unsupported("packed samples in several files, after other bytes")),
        };
        let chain = Chain { paths: paths.into_iter(), before, open: None };
        let source = BufReader::with_capacity(1 << 16, source.into_inner().over(chain, bytes));
        let (line_skip, byte_skip) = of_whole;
        Self { line_skip, byte_skip, ..self.clone() }.decode(source, bytes, memory)
    }

    /// The files of samples, and the bytes in all of them.
    fn found(
        &self,
        names: &[String],
        folders: Option<DataFolders>,
    ) -> Result<(Vec<PathBuf>, u64), ReadReason> {
        let unsupported =
            |found, expected| ReadReason::Unsupported { format: self.format, found, expected };
        let Some(folders) = folders else {
            let first = names.first().map_or("", String::as_str);
            let found = format!(
                "a header whose samples are in {} files, the first of them {first:?}",
                names.len()
            );
            let expected = "samples after the header where there is no folder";
            return Err(unsupported(found, expected));
        };
        if names.len() > MOST_FILES {
            return Err(unsupported(format!("samples in {} files", names.len()), "65536 at most"));
        }
        check_apart(names)?;
        let (mut paths, mut bytes) = (Vec::new(), 0_u64);
        for name in names {
            let (path, length) = folders.find(name)?;
            bytes = bytes.saturating_add(length);
            paths.push(path);
        }
        Ok((paths, bytes))
    }

    fn unsupported(&self, found: &str) -> ReadReason {
        ReadReason::Unsupported {
            format: self.format,
            found: found.into(),
            expected: "one file of samples, or several without anything else in them",
        }
    }

    /// Reads the samples from a stream of `bytes` bytes that holds them all.
    fn decode(
        &self,
        mut source: impl BufRead,
        bytes: u64,
        memory: Memory,
    ) -> Result<Samples, ReadReason> {
        let size = self.sample_type.size() as u64;
        let density = match self.encoding {
            Encoding::Raw => ABSURD,
            Encoding::Text => 1,
            Encoding::Gzip | Encoding::Zlib => GZIP_RATIO / size,
            Encoding::Bzip2 => BZIP2_RATIO / size,
            Encoding::Hex => 1,
        };
        let count = plausible_count(&self.shape, bytes, density)?;
        let line_skip = if self.byte_skip.is_some() { self.line_skip } else { 0 };
        let lines = skip_lines(&mut source, line_skip).map_err(ReadReason::Io)?;
        match self.encoding {
            Encoding::Raw => {
                let whole = (count as u64).saturating_mul(size);
                let bytes = bytes.saturating_sub(lines);
                let skip = self.byte_skip.unwrap_or(bytes.saturating_sub(whole));
                let found = bytes.saturating_sub(skip) / size;
                if found < count as u64 {
                    return Err(ReadReason::Truncated { expected: count as u64, found });
                }
                skip_bytes(&mut source, skip).map_err(ReadReason::Io)?;
                self.samples(&mut source, [count; 2], memory)
            }
            Encoding::Text => {
                self.skip_inside(&mut source)?;
                let mut words = TextSamples::new(source, self.sample_type);
                self.samples(&mut words, [count; 2], memory)
            }
            Encoding::Gzip => self.unpack(Gunzip::new(source), count, bytes, memory),
            Encoding::Zlib => self.unpack(ZlibDecoder::new(source), count, bytes, memory),
            Encoding::Bzip2 => self.unpack(Bzip2Decoder::new(source), count, bytes, memory),
            Encoding::Hex => {
                let mut digits = HexBytes::new(source);
                self.skip_inside(&mut digits)?;
                self.samples(&mut digits, [count; 2], memory)
            }
        }
    }

    /// Reads packed samples. Memory is allocated as they come. Behind them only as much is unpacked as the
    /// check sum needs.
    fn unpack(
        &self,
        mut packed: impl Read,
        count: usize,
        bytes: u64,
        memory: Memory,
    ) -> Result<Samples, ReadReason> {
        self.skip_inside(&mut packed)?;
        let reserve = (bytes as usize / self.sample_type.size()).saturating_mul(4);
        let samples = self.samples(&mut packed, [count, reserve], memory)?;
        packed.read(&mut [0]).map_err(|e| ReadReason::decoder(self.format, e))?;
        Ok(samples)
    }

    fn skip_inside(&self, source: &mut dyn Read) -> Result<(), ReadReason> {
        match self.byte_skip {
            Some(skip) => skip_bytes(source, skip).map_err(ReadReason::Io),
            None => Err(self.unsupported("packed samples after an unknown number of bytes")),
        }
    }

    fn samples(
        &self,
        source: &mut dyn Read,
        [count, reserve]: [usize; 2],
        memory: Memory,
    ) -> Result<Samples, ReadReason> {
        // text is turned into bytes with the least significant first
        let byte_order =
            if self.encoding == Encoding::Text { ByteOrder::Little } else { self.byte_order };
        let layout = Layout {
            sample_type: self.sample_type,
            byte_order,
            count,
            reserve,
            scale: None,
            turned: None,
            memory,
        };
        stream::read_samples(source, &layout)
    }
}

/// Refuses names that come twice: a short file would stand for any number of samples.
fn check_apart(names: &[String]) -> Result<(), ReadReason> {
    let mut sorted: Vec<&String> = names.iter().collect();
    sorted.sort_unstable();
    match sorted.chunk_by(|a, b| a == b).find(|same| same.len() > 1) {
        Some(same) => Err(ReadReason::DataTwice { path: same[0].into(), times: same.len() }),
        None => Ok(()),
    }
}

/// Takes `count` lines, and returns the number of their bytes.
fn skip_lines(source: &mut dyn BufRead, count: u64) -> io::Result<u64> {
    let mut bytes = 0;
    for _ in 0..count {
        let line = source.skip_until(b'\n')?;
        if line == 0 {
            break;
        }
        bytes += line as u64;
    }
    Ok(bytes)
}

/// Takes up to `count` bytes.
fn skip_bytes(source: &mut dyn Read, count: u64) -> io::Result<()> {
    io::copy(&mut source.take(count), &mut io::sink()).map(drop)
}

/// Files one after another, each opened when the one before it ends.
struct Chain {
    paths: std::vec::IntoIter<PathBuf>,
    /// The lines, and then bytes, that are left out at the beginning of each file.
    before: (u64, u64),
    open: Option<BufReader<File>>,
}

impl Read for Chain {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            if let Some(file) = &mut self.open {
                let count = file.read(buffer)?;
                if count > 0 || buffer.is_empty() {
                    return Ok(count);
                }
            }
            let Some(path) = self.paths.next() else { return Ok(0) };
            let mut file = BufReader::new(File::open(path)?);
            skip_lines(&mut file, self.before.0)?;
            skip_bytes(&mut file, self.before.1)?;
            self.open = Some(file);
        }
    }
}

/// The names that a pattern such as `slice%03d.raw` stands for, with numbers from `first` to `last`
/// by `step`; none if it has no number, or stands for no or too many names.
pub(super) fn pattern_names(pattern: &str, range: &[i64]) -> Option<Vec<String>> {
    let (before, rest) = pattern.split_once('%')?;
    let end = rest.find(|c: char| !c.is_ascii_digit())?;
    let (width, rest) = rest.split_at(end);
    let after = rest.strip_prefix(['d', 'i', 'u'])?;
    let is_zero = width.starts_with('0');
    let width = if width.is_empty() { 0 } else { width.parse::<u8>().ok()?.into() };
    let (first, last, step) = match *range {
        [first, last] => (first, last, 1),
        [first, last, step] => (first, last, step),
        _ => return None,
    };
    let count = last.checked_sub(first)?.checked_div(step).filter(|n| *n >= 0)? as usize + 1;
    if count > MOST_FILES {
        return None;
    }
    let name = |k: usize| {
        let number = first + k as i64 * step;
        match is_zero {
            true => format!("{before}{number:0width$}{after}"),
            false => format!("{before}{number:width$}{after}"),
        }
    };
    Some((0..count).map(name).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_count_as_printf_does() {
        let names = |pattern, range: &[i64]| pattern_names(pattern, range).unwrap_or_default();
        assert_eq!(names("a%03d.raw", &[8, 12, 2]), ["a008.raw", "a010.raw", "a012.raw"]);
        assert_eq!(names("%d", &[3, 1, -1]), ["3", "2", "1"]);
        assert_eq!(names("x%2d", &[9, 10]), ["x 9", "x10"]);
        for (pattern, range) in [
            ("plain.raw", &[1, 2, 1][..]),
            ("a%s", &[1, 2, 1]),
            ("a%03d", &[1, 2, 0]),
            ("a%03d", &[2, 1, 1]),
            ("a%03d", &[0, i64::MAX, 1]),
            ("a%03d", &[i64::MIN, i64::MAX, 1]),
            ("a%999d", &[1, 2, 1]),
            ("a%", &[1, 2]),
            ("a%d", &[1]),
        ] {
            assert_eq!(pattern_names(pattern, range), None, "{pattern} {range:?}");
        }
    }
}
