//! The file's header: 3200 bytes of text, 400 of numbers, and what stands before the first trace.

use std::io::{Read, Seek, SeekFrom};

use super::super::error::ReadReason;
use super::super::note::ReadNote;
use super::super::options::SegyOptions;
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
    /// What there is to note.
    pub notes: Vec<ReadNote>,
}

impl Header {
    /// Bytes of a trace with its headers.
    pub fn trace_bytes(&self) -> usize {
        self.trace_header + self.samples * self.format.size()
    }

    /// Reads the header, and the first trace's where that must help. Where revisions count what stands before and in
    /// front of traces in other ways, that counts with which traces fill the file.
    pub fn read<R: Read + Seek>(
        source: &mut R,
        file_bytes: u64,
        options: &SegyOptions,
    ) -> Result<Self, ReadReason> {
        let given = options.sample_format;
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
        let starts = starts(source, &view, major)?;
        let (extras, own_extra) = extras(&view, [major, bytes[3502 - 3201]])?;
        let mut own = None;
        for start in &starts {
            for extra in &extras {
                let header = Self::at(source, &view, (format, major), *start, *extra);
                let is_whole = header.as_ref().is_ok_and(|header| header.fits(file_bytes));
                match &own {
                    None => own = Some(header),
                    Some(Ok(own)) if own.fits(file_bytes) => {}
                    Some(_) if !is_whole => {}
                    Some(_) => own = Some(header),
                }
            }
        }
        let past = || {
            let value = format!("past the end: the file has {file_bytes} bytes");
            wrong("first trace", value, "a trace header of 240 bytes")
        };
        let mut header = own.unwrap_or_else(|| Err(past()))?;
        if header.start != starts[0] {
            let count = ((header.start - TEXT - BINARY as u64) / TEXT) as usize;
            header.notes.push(ReadNote::CountedTexts { count });
        }
        let count = header.trace_header / TRACE_HEADER - 1;
        if count as i64 != own_extra {
            header.notes.push(ReadNote::OtherRevision { count });
        }
        let stated = if major >= 2 { view.u64(3513) } else { 0 };
        header.count_traces(file_bytes, stated, options.truncated)?;
        Ok(header)
    }

    /// What the header says if traces begin at a place, each with so many additional headers.
    fn at<R: Read + Seek>(
        source: &mut R,
        view: &Fields<'_>,
        (format, major): (SampleFormat, u8),
        start: u64,
        extra: usize,
    ) -> Result<Self, ReadReason> {
        let byte_order = view.byte_order;
        let mut first = [0; TRACE_HEADER];
        source.seek(SeekFrom::Start(start)).map_err(ReadReason::Io)?;
        if stream::fill(source, &mut first)? < TRACE_HEADER {
            let value = format!("past the end of the file, at {start}");
            return Err(wrong("first trace", value, "a trace header of 240 bytes"));
        }
        let trace = Fields { bytes: &first, first: 1, byte_order };
        Ok(Self {
            byte_order,
            format,
            samples: samples(view, &trace, major)?,
            intervals: (wide_interval(view, major), view.u16(3217)),
            is_in_feet: view.i16(3255) == 2,
            start,
            trace_header: TRACE_HEADER * (1 + extra),
            traces: 0,
            notes: Vec::new(),
        })
    }

    /// Whether whole traces fill the file.
    pub fn fits(&self, file_bytes: u64) -> bool {
        let room = file_bytes.saturating_sub(self.start);
        room > 0 && room.is_multiple_of(self.trace_bytes() as u64)
    }

    /// Counts traces, from the file's size; those that are stated if something may follow them.
    ///
    /// # Errors
    /// [`ReadReason::TruncatedTraces`] if the last is cut short or some are missing, unless the whole ones are wanted.
    pub fn count_traces(
        &mut self,
        file_bytes: u64,
        stated: u64,
        is_truncated: bool,
    ) -> Result<(), ReadReason> {
        let each = self.trace_bytes() as u64;
        let room = file_bytes.saturating_sub(self.start);
        let (found, rest) = (room / each, room % each);
        let samples = self.samples;
        self.traces = match stated {
            0 => found,
            stated => stated.min(found),
        } as usize;
        if found == 0 {
            let value = format!("{samples}, with which {found} traces leave {rest} bytes over");
            return Err(wrong("samples per trace", value, "whole traces, all of one length"));
        }
        if stated > found || stated == 0 && rest > 0 {
            let promised = (stated > 0).then_some(stated);
            if !is_truncated {
                return Err(ReadReason::TruncatedTraces { found, promised, samples, rest });
            }
            self.notes.push(ReadNote::TruncatedTraces { found, promised, rest });
        }
        Ok(())
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

/// Where the first trace may begin, the place that the revision says first.
fn starts<R: Read + Seek>(
    source: &mut R,
    view: &Fields<'_>,
    major: u8,
) -> Result<Vec<u64>, ReadReason> {
    let least = TEXT + BINARY as u64;
    let stated = if major >= 2 { view.u64(3521) } else { 0 };
    if stated > 0 {
        let fits = stated >= least && stated <= i64::MAX as u64;
        return match fits {
            true => Ok(vec![stated]),
            false => Err(wrong("first trace's offset", stated.to_string(), "3600 or more")),
        };
    }
    let after = |count: i16| least + TEXT * u64::from(count.unsigned_abs());
    match view.i16(3505) {
        // revision 0 knows of none, but some programs write them
        count @ 1.. if major == 0 => Ok(vec![least, after(count)]),
        _ if major == 0 => Ok(vec![least]),
        count @ 0.. => Ok(vec![after(count)]),
        -1 => Ok(vec![end_of_texts(source)?]),
        odd => Err(wrong("extended textual headers", odd.to_string(), "a count, or -1")),
    }
}

/// The end of the textual headers where words say which is the last.
fn end_of_texts<R: Read + Seek>(source: &mut R) -> Result<u64, ReadReason> {
    let least = TEXT + BINARY as u64;
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

/// How many additional headers a trace may have, the number by the file's own revision first: 2.0 has it in four bytes,
/// 2.1 in the first two of them; and what that one says.
fn extras(view: &Fields<'_>, [major, minor]: [u8; 2]) -> Result<(Vec<usize>, i64), ReadReason> {
    if major < 2 {
        return Ok((vec![0], 0));
    }
    let mut counts = [view.i32(3507), view.i16(3507).into()];
    if minor > 0 {
        counts.reverse();
    }
    let all = counts.iter().filter_map(|&n| usize::try_from(n).ok().filter(|n| *n <= 100));
    let mut all: Vec<usize> = all.collect();
    all.dedup();
    if all.is_empty() {
        return Err(wrong(
            "additional trace headers",
            counts[0].to_string(),
            "a count from 0 to 100",
        ));
    }
    Ok((all, counts[0].into()))
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
