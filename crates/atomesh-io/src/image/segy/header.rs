//! The file's header: 3200 bytes of text, 400 of numbers, and what stands before the first trace.

use std::io::{Read, Seek, SeekFrom};

use super::super::error::ReadReason;
use super::super::sample_type::ByteOrder;
use super::super::stream;
use super::super::traces::SampleFormat;
use super::wrong;

/// Bytes of a textual header; the binary one follows the first.
const TEXT: u64 = 3200;
/// Bytes of the binary header.
const BINARY: usize = 400;
/// Bytes of a trace header.
pub(super) const TRACE_HEADER: usize = 240;
/// The most textual headers that are looked through for the last.
const MOST_TEXTS: u64 = 1000;
/// `SEG: EndText`, which closes the last textual header, in ASCII and in EBCDIC.
const END: [&[u8]; 2] = [b"SEG: EndText", b"\xe2\xc5\xc7\x7a\x40\xc5\x95\x84\xe3\x85\xa7\xa3"];

/// What the header says, checked against the size of the file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub byte_order: ByteOrder,
    /// How a sample is written.
    pub format: SampleFormat,
    /// Samples of every trace.
    pub samples: usize,
    /// The sample interval of revision 2 and the one before: µs, or for depths thousandths of the unit of
    /// length; 0 where it is not stated.
    pub intervals: (f64, u16),
    /// Whether lengths are in feet.
    pub is_in_feet: bool,
    /// Bytes before the first trace.
    pub start: u64,
    /// Bytes of a trace's headers.
    pub trace_header: usize,
    /// The traces in the file.
    pub traces: usize,
}

impl Header {
    /// Bytes of a trace with its headers.
    pub fn trace_bytes(&self) -> usize {
        self.trace_header + self.samples * self.format.size()
    }

    /// Reads the header, and the first trace's where that must help. A `given` format goes before the code's.
    pub fn read<R: Read + Seek>(
        source: &mut R,
        file_bytes: u64,
        given: Option<SampleFormat>,
    ) -> Result<Self, ReadReason> {
        let mut bytes = [0; BINARY];
        source.seek(SeekFrom::Start(TEXT)).map_err(ReadReason::Io)?;
        if stream::fill(source, &mut bytes)? < BINARY {
            let value = format!("cut short: the file has {file_bytes} bytes");
            return Err(wrong("binary header", value, "3600 bytes of headers"));
        }
        let byte_order = byte_order(&bytes, given.is_some())?;
        let view = Fields { bytes: &bytes, first: 3201, byte_order };
        let major = bytes[3501 - 3201];
        let format = given.map_or_else(|| format(view.i16(3225)), Ok)?;
        let start = start(source, &view, major)?;
        let extra = if major >= 2 { view.i32(3507) } else { 0 };
        let extra = usize::try_from(extra).ok().filter(|&n| n <= 100).ok_or_else(|| {
            wrong("additional trace headers", extra.to_string(), "a count from 0 to 100")
        })?;

        let mut first = [0; TRACE_HEADER];
        source.seek(SeekFrom::Start(start)).map_err(ReadReason::Io)?;
        if stream::fill(source, &mut first)? < TRACE_HEADER {
            let value = format!("past the end: the file has {file_bytes} bytes");
            return Err(wrong("first trace", value, "a trace header of 240 bytes"));
        }
        let trace = Fields { bytes: &first, first: 1, byte_order };
        let mut header = Self {
            byte_order,
            format,
            samples: samples(&view, &trace, major)?,
            intervals: (wide_interval(&view, major), view.u16(3217)),
            is_in_feet: view.i16(3255) == 2,
            start,
            trace_header: TRACE_HEADER * (1 + extra),
            traces: 0,
        };
        let stated = if major >= 2 { view.u64(3513) } else { 0 };
        header.traces = header.count(file_bytes, stated)?;
        Ok(header)
    }

    /// The number of traces, from the file's size; the one stated if something may follow them.
    fn count(&self, file_bytes: u64, stated: u64) -> Result<usize, ReadReason> {
        let each = self.trace_bytes() as u64;
        let room = file_bytes.saturating_sub(self.start);
        let (found, rest) = (room / each, room % each);
        if stated > found {
            let samples = self.samples as u64;
            let expected = stated.saturating_mul(samples);
            return Err(ReadReason::Truncated { expected, found: found * samples });
        }
        if stated > 0 {
            return Ok(stated as usize);
        }
        if rest > 0 || found == 0 {
            let value =
                format!("{}, with which {found} traces leave {rest} bytes over", self.samples);
            return Err(wrong("samples per trace", value, "whole traces, all of one length"));
        }
        Ok(found as usize)
    }
}

/// Revision 2 states the byte order; before, only the format code can tell. If the format `is_given`, a code that
/// tells nothing leaves the usual order, most significant byte first.
fn byte_order(bytes: &[u8; BINARY], is_given: bool) -> Result<ByteOrder, ReadReason> {
    let at = |first: usize| [bytes[first - 3201], bytes[first - 3200]];
    match bytes[3297 - 3201..3301 - 3201] {
        [1, 2, 3, 4] => return Ok(ByteOrder::Big),
        [4, 3, 2, 1] => return Ok(ByteOrder::Little),
        _ => {}
    }
    let code = at(3225);
    let is_code = |code: u16| (1..=16).contains(&code);
    let is_little = is_code(u16::from_le_bytes(code));
    if is_code(u16::from_be_bytes(code)) || (is_given && !is_little) {
        Ok(ByteOrder::Big)
    } else if is_little {
        Ok(ByteOrder::Little)
    } else {
        Err(ReadReason::TraceFormat { code: i16::from_be_bytes(code) })
    }
}

/// Where the first trace begins.
fn start<R: Read + Seek>(source: &mut R, view: &Fields<'_>, major: u8) -> Result<u64, ReadReason> {
    let least = TEXT + BINARY as u64;
    let stated = if major >= 2 { view.u64(3521) } else { 0 };
    if stated > 0 {
        let value = || stated.to_string();
        let expected = "3600 or more";
        let fits = stated >= least && stated <= i64::MAX as u64;
        return if fits {
            Ok(stated)
        } else {
            Err(wrong("first trace's offset", value(), expected))
        };
    }
    match if major >= 1 { view.i16(3505) } else { 0 } {
        count @ 0.. => Ok(least + TEXT * count as u64),
        -1 => {
            source.seek(SeekFrom::Start(least)).map_err(ReadReason::Io)?;
            let mut text = vec![0; TEXT as usize];
            for count in 1..=MOST_TEXTS {
                let is_whole = stream::fill(source, &mut text)? == text.len();
                if END.iter().any(|end| text.windows(end.len()).any(|at| at == *end)) {
                    return Ok(least + TEXT * count);
                }
                if !is_whole {
                    break;
                }
            }
            Err(wrong("extended textual headers", "without an end".into(), "((SEG: EndText))"))
        }
        odd => Err(wrong("extended textual headers", odd.to_string(), "a count, or -1")),
    }
}

/// Samples of a trace: revision 2's wide count, else the narrow one, else the first trace's.
fn samples(view: &Fields<'_>, trace: &Fields<'_>, major: u8) -> Result<usize, ReadReason> {
    let wide = if major >= 2 { view.i32(3269) } else { 0 };
    let counts = [i64::from(wide), view.u16(3221).into(), trace.u16(115).into()];
    match counts.into_iter().find(|&n| n != 0) {
        Some(n @ 1..) => Ok(n as usize),
        found => {
            let value = found.unwrap_or(0).to_string();
            Err(wrong("samples per trace (bytes 3221-3222)", value, "1 or more"))
        }
    }
}

/// The sample interval of revision 2.
fn wide_interval(view: &Fields<'_>, major: u8) -> f64 {
    if major >= 2 { f64::from_bits(view.u64(3273)) } else { 0.0 }
}

/// Numbers at places that are counted from `first`, as the standard counts them.
pub(super) struct Fields<'a> {
    pub bytes: &'a [u8],
    pub first: usize,
    pub byte_order: ByteOrder,
}

impl Fields<'_> {
    fn take<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut bytes = [0; N];
        bytes.copy_from_slice(&self.bytes[at - self.first..][..N]);
        if self.byte_order == ByteOrder::Little {
            bytes.reverse();
        }
        bytes
    }

    pub fn i16(&self, at: usize) -> i16 {
        i16::from_be_bytes(self.take(at))
    }

    pub fn u16(&self, at: usize) -> u16 {
        u16::from_be_bytes(self.take(at))
    }

    pub fn i32(&self, at: usize) -> i32 {
        i32::from_be_bytes(self.take(at))
    }

    fn u64(&self, at: usize) -> u64 {
        u64::from_be_bytes(self.take(at))
    }
}

/// The type that a format code names.
fn format(code: i16) -> Result<SampleFormat, ReadReason> {
    Ok(match code {
        1 => SampleFormat::Ibm,
        2 => SampleFormat::I32,
        3 => SampleFormat::I16,
        5 => SampleFormat::F32,
        6 => SampleFormat::F64,
        8 => SampleFormat::I8,
        10 => SampleFormat::U32,
        11 => SampleFormat::U16,
        16 => SampleFormat::U8,
        _ => return Err(ReadReason::TraceFormat { code }),
    })
}
