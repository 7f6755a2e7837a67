//! Seismic Unix, `.su`: traces as SEG-Y has them and nothing before, in single precision, in the order of bytes of the
//! machine that wrote them.
//!
//! The samples of a trace (ns) and their interval (dt) stand in every trace header, at the places of SEG-Y's. Which
//! byte comes first no header says: it is the order in which whole traces fill the file. There is no place for inline
//! and crossline numbers, so that X and Y, or else ensembles (cdp), arrange the traces.

use std::io::{Read, Seek, SeekFrom};

use super::super::codec::{Codec, Source};
use super::super::error::ReadReason;
use super::super::format::ImageFormat;
use super::super::note::LoadedImage;
use super::super::sample_type::ByteOrder;
use super::super::stream;
use super::super::traces::SampleFormat;
use super::header::{Fields, Header, TRACE_HEADER};
use super::{COORDINATE_BYTES, Places, image, trace};

const FORMAT: ImageFormat = ImageFormat::named("Seismic Unix");

pub(in super::super) const CODEC: Codec =
    Codec { endings: &[".su"], has_frame: true, ..Codec::reading(FORMAT, read) };

fn wrong(field: &'static str, value: String, expected: &'static str) -> ReadReason {
    ReadReason::Header { format: FORMAT, field, value, expected }
}

/// Reads a line or a cube.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let options = &source.options.segy;
    let Source { bytes: mut source, length: file_bytes, memory, .. } = source;
    let mut places = Places::of(options)?;
    if options.trace_bytes.is_none() {
        places.numbers = None;
    }
    if options.coordinate_bytes.is_none() {
        // the first of SEG-Y's places is another number here
        places.coordinates = &COORDINATE_BYTES[1..];
    }
    places.has_time_scalar = false;
    let mut header = header(&mut source, file_bytes)?;
    header.format = options.sample_format.unwrap_or(header.format);
    header.count_traces(file_bytes, 0, options.truncated)?;
    let heads = trace::read_headers(&mut source, &header, &places, memory)?;
    if let Some(odd) = heads.iter().position(|trace| usize::from(trace.samples) != header.samples) {
        let value = format!("{} in trace {}", heads[odd].samples, odd + 1);
        return Err(wrong("ns (bytes 115-116)", value, "the same in all traces"));
    }
    image(&mut source, (header, heads), (options, &places), None, memory)
}

/// What the first trace says of all, in the order of bytes that fits.
fn header<R: Read + Seek>(source: &mut R, file_bytes: u64) -> Result<Header, ReadReason> {
    let mut first = [0; TRACE_HEADER];
    source.rewind().map_err(ReadReason::Io)?;
    if stream::fill(source, &mut first)? < TRACE_HEADER {
        let value = format!("cut short: the file has {file_bytes} bytes");
        return Err(wrong("first trace", value, "a trace header of 240 bytes"));
    }
    let of = |byte_order: ByteOrder| {
        let samples = Fields { bytes: &first, first: 1, byte_order }.u16(115).into();
        Header {
            byte_order,
            format: SampleFormat::F32,
            samples,
            intervals: (0.0, 0),
            is_in_feet: false,
            start: 0,
            trace_header: TRACE_HEADER,
            traces: 0,
            notes: Vec::new(),
        }
    };
    let orders = [of(ByteOrder::Little), of(ByteOrder::Big)];
    if orders[0].samples == 0 {
        return Err(wrong("ns (bytes 115-116)", "0".into(), "1 or more"));
    }
    let mut best = (0, orders[0].clone());
    for header in orders {
        let goes_on = has_second(source, &header, file_bytes)?;
        let score = 2 * u8::from(header.fits(file_bytes)) + u8::from(goes_on);
        if score > best.0 {
            best = (score, header);
        }
    }
    Ok(best.1)
}

/// Whether a second trace has as many samples as the first, or there is none.
fn has_second<R: Read + Seek>(
    source: &mut R,
    header: &Header,
    file_bytes: u64,
) -> Result<bool, ReadReason> {
    let at = header.trace_bytes() as u64;
    if at >= file_bytes {
        return Ok(at == file_bytes);
    }
    let mut bytes = [0; TRACE_HEADER];
    source.seek(SeekFrom::Start(at)).map_err(ReadReason::Io)?;
    let filled = stream::fill(source, &mut bytes)?;
    let view = Fields { bytes: &bytes, first: 1, byte_order: header.byte_order };
    Ok(filled == TRACE_HEADER && usize::from(view.u16(115)) == header.samples)
}
