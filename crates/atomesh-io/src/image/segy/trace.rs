//! The traces' own headers: numbers, coordinates, delay.

use std::io::{Read, Seek, SeekFrom};

use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::super::sample_type::ByteOrder;
use super::super::stream;
use super::header::{Fields, Header, TRACE_HEADER};
use super::{COORDINATE_BYTES, Places};

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
    /// The time of the first sample as stored.
    pub delay: i16,
    /// What times are multiplied by, or if negative divided by, to give milliseconds.
    pub time_scalar: i16,
    /// The sample interval as stored, 0 if the trace has none of its own.
    pub interval: u16,
    /// The samples that the trace says that it has.
    pub samples: u16,
    /// Whether the header says that there are no data.
    pub is_dead: bool,
}

/// The codes of trace identification for dead traces and for dummies.
const DEAD: [i16; 2] = [2, 3];

impl Trace {
    fn parse(bytes: &[u8; TRACE_HEADER], byte_order: ByteOrder, of: &Places<'_>) -> Self {
        let view = Fields { bytes, first: 1, byte_order };
        let [inline, crossline] = of.numbers.map_or([0; 2], |at| at.map(|at| view.i32(at)));
        let mut places = [[0; 2]; COORDINATE_BYTES.len()];
        for (place, [x, y]) in places.iter_mut().zip(of.coordinates) {
            *place = [view.i32(*x), view.i32(*y)];
        }
        Self {
            inline,
            crossline,
            ensemble: view.i32(21),
            places,
            scalar: view.i16(71),
            units: view.i16(89),
            delay: view.i16(109),
            time_scalar: if of.has_time_scalar { view.i16(215) } else { 0 },
            interval: view.u16(117),
            samples: view.u16(115),
            is_dead: DEAD.contains(&view.i16(29)),
        }
    }

    /// X and Y from one of the places, in world units.
    pub fn position(&self, place: usize) -> [f64; 2] {
        self.places[place].map(|v| scaled(v.into(), self.scalar))
    }

    /// The time of the first sample in milliseconds; as stored, if its scalar is none.
    pub fn start(&self) -> f64 {
        scaled(self.delay.into(), if self.has_time_scalar() { self.time_scalar } else { 1 })
    }

    /// Whether the scalar of times is one that the standard knows. Before revision 1 its bytes could hold
    /// anything.
    pub fn has_time_scalar(&self) -> bool {
        [0, 1, 10, 100, 1000, 10_000].contains(&self.time_scalar.unsigned_abs())
    }

    /// World units from one coordinate that can be written to the next.
    pub fn resolution(&self) -> f64 {
        scaled(1.0, self.scalar)
    }
}

/// A value times a scalar of the trace header; 0 stands for 1, a negative one divides.
fn scaled(value: f64, scalar: i16) -> f64 {
    match scalar {
        0 => value,
        s @ 1.. => value * f64::from(s),
        s => value / -f64::from(s),
    }
}

/// Reads all trace headers and skips what is between.
pub(super) fn read_headers<R: Read + Seek>(
    source: &mut R,
    header: &Header,
    places: &Places<'_>,
    memory: Memory,
) -> Result<Vec<Trace>, ReadReason> {
    let mut traces = Vec::new();
    let mut bytes = [0; TRACE_HEADER];
    for k in 0..header.traces {
        let at = header.start + k as u64 * header.trace_bytes() as u64;
        source.seek(SeekFrom::Start(at)).map_err(ReadReason::Io)?;
        if stream::fill(source, &mut bytes)? < bytes.len() {
            return Err(cut_short(header, k));
        }
        memory.grow(&mut traces, 1, header.traces)?;
        traces.push(Trace::parse(&bytes, header.byte_order, places));
    }
    Ok(traces)
}

fn cut_short(header: &Header, found: usize) -> ReadReason {
    let count = |traces: usize| (traces * header.samples) as u64;
    ReadReason::Truncated { expected: count(header.traces), found: count(found) }
}
