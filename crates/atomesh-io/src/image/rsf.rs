//! Madagascar's regularly sampled format: a text of `key=value`, and samples in a file that it names.
//!
//! Definition: <https://reproducibility.org/wiki/Guide_to_RSF_file_format>. The last value of a key
//! counts. `n1` is the fastest axis, `o1`, `d1` its origin and spacing, `label1`
//! and `unit1` its name and unit; `in` names the file of samples, or is `stdin` where they follow the
//! text after two form feeds and an end of transmission.
//!
//! Axes: where `label1` says depth or time (or `unit1` is one of time, or the caller says so), the
//! first axis is the vertical one, as in seismic data: a flat image has x = axis 2, y = axis 1, a
//! volume x = axis 2, y = axis 3, z = axis 1. Else x, y, z are the axes 1, 2, 3.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::PathBuf;

use atomesh::image::{Frame, Image, Samples};

use super::any_image::AnyImage;
use super::codec::{Codec, Source};
use super::detached::DataFolders;
use super::error::ReadReason;
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::{LoadedImage, ReadNote};
use super::options::Vertical;
use super::sample_type::{ByteOrder, SampleType};
use super::shape::plausible_count;
use super::spelling;
use super::stream::{self, Layout};
use super::text::shortened;
use super::traces::{self, SampleFormat, TraceLayout};

const FORMAT: ImageFormat = ImageFormat::named("RSF");

pub(super) const CODEC: Codec =
    Codec { endings: &[".rsf"], has_frame: true, ..Codec::reading(FORMAT, read) };

/// The longest text that is read.
const LONGEST_TEXT: u64 = 1 << 20;

/// Separates the text from samples in the same file.
const END_OF_TEXT: &[u8] = b"\x0c\x0c\x04";

/// The error for an entry of the text.
fn wrong(field: &'static str, value: &str, expected: &'static str) -> ReadReason {
    ReadReason::Header { format: FORMAT, field, value: shortened(value), expected }
}

/// Reads a flat image or a volume.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let vertical = source.options.segy.vertical;
    let Source { bytes: mut source, length: file_bytes, folders, memory, .. } = source;
    let mut text = vec![0; file_bytes.min(LONGEST_TEXT) as usize];
    let filled = stream::fill(&mut source, &mut text)?;
    text.truncate(filled);
    let end = text.windows(END_OF_TEXT.len()).position(|at| at == END_OF_TEXT);
    let header = Header::parse(&String::from_utf8_lossy(&text[..end.unwrap_or(filled)]), vertical)?;
    let samples = match (header.data.as_str(), folders) {
        ("stdin" | "stdout", _) => {
            let Some(end) = end else {
                return Err(wrong("in", &header.data, "samples after two form feeds and ^D"));
            };
            let start = (end + END_OF_TEXT.len()) as u64;
            source.seek(SeekFrom::Start(start)).map_err(ReadReason::Io)?;
            header.samples(&mut source, file_bytes - start, memory)?
        }
        (_, None) => {
            return Err(ReadReason::Unsupported {
                format: FORMAT,
                found: format!("a header whose samples are in {:?}", header.data),
                expected: "samples after the header where there is no folder",
            });
        }
        (name, Some(folders)) => {
            let (mut file, bytes, moved) = open(folders, name)?;
            let samples = header.samples(&mut file, bytes, memory)?;
            return Ok(header.place(samples)?.noting(moved));
        }
    };
    header.place(samples)
}

/// Opens the file of samples: where the text says, or else beside it, since headers move; a note says so.
fn open(folders: DataFolders, name: &str) -> Result<(File, u64, Option<ReadNote>), ReadReason> {
    let refusal = match folders.open(name) {
        Ok((file, bytes)) => return Ok((file, bytes, None)),
        Err(refusal) => refusal,
    };
    let named = PathBuf::from(name);
    let Some(beside) = named.file_name().and_then(|name| name.to_str()) else {
        return Err(refusal);
    };
    match folders.open(beside) {
        Ok((file, bytes)) => Ok((file, bytes, Some(ReadNote::DataBeside { named }))),
        Err(_) => Err(refusal),
    }
}

/// An axis of the array.
#[derive(Clone, Debug)]
struct Axis {
    /// 1 for the fastest.
    number: usize,
    count: usize,
    origin: f64,
    spacing: f64,
    label: String,
    unit: String,
}

/// How samples are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoding {
    Binary(SampleType, ByteOrder),
    Text,
}

/// What the text says.
struct Header {
    data: String,
    encoding: Encoding,
    /// Two or three, fastest first; further ones have one sample.
    axes: Vec<Axis>,
    /// Whether the first axis is vertical.
    is_vertical: bool,
    /// Whether a label or the caller said so.
    is_known: bool,
}

impl Header {
    fn parse(text: &str, vertical: Option<Vertical>) -> Result<Self, ReadReason> {
        let entries = entries(text);
        let get = |key: &str| entries.get(key).map(String::as_str);
        let data = get("in").ok_or_else(|| wrong("in", "missing", "the file of samples"))?;
        let encoding = encoding(get("data_format").unwrap_or("native_float"), get("esize"))?;
        let mut axes = Vec::new();
        for k in 1..=9_usize {
            let key = |name: &str| get(&format!("{name}{k}"));
            let Some(count) = key("n") else { break };
            axes.push(Axis {
                number: k,
                count: whole(count)?,
                origin: key("o").map_or(Ok(0.0), |v| real("o", v))?,
                spacing: key("d").map_or(Ok(1.0), |v| real("d", v))?,
                label: key("label").unwrap_or_default().into(),
                unit: key("unit").unwrap_or_default().into(),
            });
        }
        while axes.len() > 2 && axes.last().is_some_and(|axis| axis.count == 1) {
            axes.pop();
        }
        if !(2..=3).contains(&axes.len()) {
            return Err(ReadReason::Unsupported {
                format: FORMAT,
                found: format!("an array of {} axes", axes.len()),
                expected: "2 or 3 axes of more than one sample",
            });
        }
        let says_so = axes[0].is_vertical();
        Ok(Self {
            data: data.into(),
            encoding,
            is_vertical: says_so || vertical.is_some(),
            is_known: says_so || vertical.is_some() || axes.iter().any(|a| !a.label.is_empty()),
            axes,
        })
    }

    /// Reads the samples, x fastest.
    fn samples(
        &self,
        source: &mut dyn Read,
        bytes: u64,
        memory: Memory,
    ) -> Result<Samples, ReadReason> {
        let shape: Vec<usize> = self.axes.iter().map(|axis| axis.count).collect();
        let Encoding::Binary(sample_type, byte_order) = self.encoding else {
            // a number takes two bytes at least, a digit and a space
            let count = plausible_count(&shape, bytes.saturating_add(1) / 2, 1)?;
            memory.check(bytes.into())?;
            let numbers = text_numbers(source, count)?;
            let encoding = Encoding::Binary(SampleType::F32, ByteOrder::Little);
            let binary = Self { encoding, data: String::new(), axes: self.axes.clone(), ..*self };
            return binary.samples(&mut &numbers[..], numbers.len() as u64, memory);
        };
        let count = plausible_count(&shape, bytes, 1 << 10)?;
        let found = bytes / sample_type.size() as u64;
        if count as u64 > found {
            return Err(ReadReason::Truncated { expected: count as u64, found });
        }
        let Some(format) = format_of(sample_type).filter(|_| self.is_vertical) else {
            let (reserve, scale, turned) = (count, None, None);
            let layout = Layout { sample_type, byte_order, count, reserve, scale, turned, memory };
            return stream::read_samples(source, &layout);
        };
        let places: Vec<usize> = (0..count / shape[0].max(1)).collect();
        let (samples, plane) = (shape[0], places.len());
        let layout = TraceLayout {
            format,
            byte_order,
            header_bytes: 0,
            samples,
            places: &places,
            plane,
            memory,
        };
        traces::read(source, &layout)
    }

    /// The image of the samples, with its frame, units, and how the axes came about.
    fn place(&self, samples: Samples) -> Result<LoadedImage, ReadReason> {
        let mut axes: Vec<&Axis> = self.axes.iter().collect();
        if self.is_vertical {
            axes.rotate_left(1);
        }
        let name = |axis: &&Axis| axis.name();
        let notes = vec![ReadNote::Axes {
            order: axes.iter().map(name).collect(),
            is_known: self.is_known,
        }];
        let units = match axes.iter().all(|axis| axis.unit.is_empty()) {
            true => Vec::new(),
            false => axes.iter().map(|axis| axis.unit.clone()).collect(),
        };
        let image = match axes[..] {
            [x, y] => AnyImage::Flat(Image::new(frame([x, y])?, samples)?),
            [x, y, z] => AnyImage::Volume(Image::new(frame([x, y, z])?, samples)?),
            _ => return Err(wrong("n", &axes.len().to_string(), "2 or 3 axes")),
        };
        Ok(LoadedImage { image, units, notes })
    }
}

impl Axis {
    /// Whether the label or unit is one of depth or time.
    fn is_vertical(&self) -> bool {
        let (label, unit) = (self.label.to_lowercase(), self.unit.to_lowercase());
        let begins = ["depth", "time", "twt"].iter().any(|word| label.starts_with(word));
        begins || label == "z" || label == "t" || ["s", "ms", "sec"].contains(&unit.as_str())
    }

    /// Number and label, for a note.
    fn name(&self) -> String {
        let Self { number, label, .. } = self;
        if label.is_empty() { number.to_string() } else { format!("{number} ({label})") }
    }
}

/// The frame of axes along the world's; a negative spacing turns its axis.
fn frame<const D: usize>(axes: [&Axis; D]) -> Result<Frame<D>, ReadReason> {
    let direction = std::array::from_fn(|r| {
        std::array::from_fn(|c| if r == c { axes[c].spacing.signum() } else { 0.0 })
    });
    let frame = Frame::new(axes.map(|axis| axis.count))?;
    let frame = frame.with_spacing(axes.map(|axis| axis.spacing.abs()))?;
    Ok(frame.with_origin(axes.map(|axis| axis.origin))?.with_direction(direction)?)
}

/// The values of the keys; the last one of a key counts. A value may be quoted.
fn entries(text: &str) -> BTreeMap<String, String> {
    let mut entries = BTreeMap::new();
    let mut rest = text;
    while let Some(at) = rest.find('=') {
        let key = rest[..at].rsplit(|c: char| c.is_whitespace()).next().unwrap_or_default();
        let behind = &rest[at + 1..];
        let (value, after) = match behind.chars().next() {
            Some(quote @ ('"' | '\'')) => {
                let inside = &behind[1..];
                inside.split_once(quote).unwrap_or((inside, ""))
            }
            _ => behind.split_at(behind.find(char::is_whitespace).unwrap_or(behind.len())),
        };
        if !key.is_empty() {
            entries.insert(key.to_owned(), value.to_owned());
        }
        rest = after;
    }
    entries
}

/// What `data_format` names; the machine that wrote "native" numbers had the least significant byte
/// first, as all have today.
fn encoding(name: &str, element_bytes: Option<&str>) -> Result<Encoding, ReadReason> {
    let unknown = || ReadReason::Unsupported {
        format: FORMAT,
        found: format!("samples of data_format {name:?}"),
        expected: "native_, xdr_ or ascii_ float, double, int, short or uchar",
    };
    let (order, kind) = name.split_once('_').ok_or_else(unknown)?;
    let sample_type = spelling::named(kind, |own| own.rsf).ok_or_else(unknown)?;
    let size = sample_type.size().to_string();
    match (order, element_bytes) {
        ("ascii", _) => Ok(Encoding::Text),
        ("native" | "xdr", Some(bytes)) if bytes != size => {
            Err(wrong("esize", bytes, "the size that data_format has"))
        }
        ("native", _) => Ok(Encoding::Binary(sample_type, ByteOrder::Little)),
        ("xdr", _) => Ok(Encoding::Binary(sample_type, ByteOrder::Big)),
        _ => Err(unknown()),
    }
}

/// How a trace's reader calls a type.
fn format_of(sample_type: SampleType) -> Option<SampleFormat> {
    Some(match sample_type {
        SampleType::F32 => SampleFormat::F32,
        SampleType::F64 => SampleFormat::F64,
        SampleType::I32 => SampleFormat::I32,
        SampleType::I16 => SampleFormat::I16,
        SampleType::U8 => SampleFormat::U8,
        _ => return None,
    })
}

/// Reads numbers set apart by blanks, as the bytes that they have in memory.
fn text_numbers(source: &mut dyn Read, count: usize) -> Result<Vec<u8>, ReadReason> {
    let mut text = String::new();
    source.read_to_string(&mut text).map_err(|e| ReadReason::decoder(FORMAT, e))?;
    let mut bytes = Vec::new();
    // the words are not told: the file may be any that the header names
    for (k, word) in text.split_ascii_whitespace().take(count).enumerate() {
        let wrong =
            |_| wrong("sample", &format!("number {} of the file", k + 1), "a decimal number");
        let value: f32 = word.parse().map_err(wrong)?;
        bytes.extend(value.to_le_bytes());
    }
    Ok(bytes)
}

fn whole(value: &str) -> Result<usize, ReadReason> {
    value.parse().ok().filter(|&n| n > 0).ok_or_else(|| wrong("n", value, "a count of 1 or more"))
}

fn real(field: &'static str, value: &str) -> Result<f64, ReadReason> {
    value
        .parse()
        .ok()
        .filter(|v: &f64| v.is_finite())
        .ok_or_else(|| wrong(field, value, "a number"))
}

#[cfg(test)]
mod tests;
