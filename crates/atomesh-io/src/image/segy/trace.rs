//! The traces' own headers: numbers, coordinates, delay.

use std::io::{Read, Seek, SeekFrom};

use super::super::error::ReadReason;
use super::super::options::SegyOptions;
use super::super::sample_type::ByteOrder;
use super::super::stream;
use super::COORDINATE_BYTES;
use super::header::{Fields, Header, TRACE_HEADER};

/// What a trace says of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Trace {
    pub inline: i32,
    pub crossline: i32,
    /// The number of the common midpoint, or of another ensemble.
    pub ensemble: i32,
    /// X and Y as stored, from each place where they may be.
    pub places: [[i32; 2]; COORDINATE_BYTES.len()],
    /// What coordinates are multiplied by, or if negative divided by.
    pub scalar: i16,
    /// 2 and above: the coordinates are angles.
    pub units: i16,
    /// The time of the first sample in milliseconds.
    pub delay: i16,
    /// Whether the header says that there are no data.
    pub is_dead: bool,
}

/// The codes of trace identification for dead traces and for dummies.
const DEAD: [i16; 2] = [2, 3];

impl Trace {
    fn parse(bytes: &[u8; TRACE_HEADER], byte_order: ByteOrder, options: &SegyOptions) -> Self {
        let view = Fields { bytes, first: 1, byte_order };
        let [inline, crossline] = options.trace_bytes();
        let mut places = [[0; 2]; COORDINATE_BYTES.len()];
        for (place, [x, y]) in places.iter_mut().zip(options.coordinate_bytes()) {
            *place = [view.i32(*x), view.i32(*y)];
        }
        Self {
            inline: view.i32(inline),
            crossline: view.i32(crossline),
            ensemble: view.i32(21),
            places,
            scalar: view.i16(71),
            units: view.i16(89),
            delay: view.i16(109),
            is_dead: DEAD.contains(&view.i16(29)),
        }
    }

    /// X and Y from one of the places, in world units.
    pub fn position(&self, place: usize) -> [f64; 2] {
        let scaled = |v: i32| match self.scalar {
            0 => f64::from(v),
            s @ 1.. => f64::from(v) * f64::from(s),
            s => f64::from(v) / -f64::from(s),
        };
        self.places[place].map(scaled)
    }

    /// World units from one coordinate that can be written to the next.
    pub fn resolution(&self) -> f64 {
        match self.scalar {
            0 => 1.0,
            s @ 1.. => f64::from(s),
            s => -1.0 / f64::from(s),
        }
    }
}

/// Reads all trace headers and skips what is between.
pub(super) fn read_headers<R: Read + Seek>(
    source: &mut R,
    header: &Header,
    options: &SegyOptions,
) -> Result<Vec<Trace>, ReadReason> {
    let mut traces = Vec::new();
    let mut bytes = [0; TRACE_HEADER];
    for k in 0..header.traces {
        let at = header.start + k as u64 * header.trace_bytes() as u64;
        source.seek(SeekFrom::Start(at)).map_err(ReadReason::Io)?;
        if stream::fill(source, &mut bytes)? < bytes.len() {
            return Err(cut_short(header, k));
        }
        stream::grow(&mut traces, 1, header.traces)?;
        traces.push(Trace::parse(&bytes, header.byte_order, options));
    }
    Ok(traces)
}

fn cut_short(header: &Header, found: usize) -> ReadReason {
    let count = |traces: usize| (traces * header.samples) as u64;
    ReadReason::Truncated { expected: count(header.traces), found: count(found) }
}
