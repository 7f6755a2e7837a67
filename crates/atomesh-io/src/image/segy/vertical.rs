//! The vertical axis: which of the sample intervals and delays that headers state is taken.

use super::super::note::{IntervalSource, ReadNote};
use super::super::options::SegyOptions;
use super::header::Header;
use super::trace::Trace;

/// Spacing and origin along the last axis.
pub(super) fn vertical(
    header: &Header,
    traces: &[Trace],
    options: &SegyOptions,
    notes: &mut Vec<ReadNote>,
) -> [f64; 2] {
    let interval = interval(header, traces, notes);
    match interval {
        Some(interval) => {
            let (spacing, is_known) = (interval / 1000.0, options.vertical.is_some());
            notes.push(ReadNote::Vertical { interval, spacing, is_known });
        }
        None => notes.push(ReadNote::NoInterval),
    }
    [interval.map_or(1.0, |interval| interval / 1000.0), start(traces, notes)]
}

/// The sample interval: the binary header's, which is that of the whole file, else the first trace's. Numbers
/// of 16 bits are read without a sign only if no other is above 0.
fn interval(header: &Header, traces: &[Trace], notes: &mut Vec<ReadNote>) -> Option<f64> {
    use IntervalSource::{BinaryHeader, FirstTrace};
    let (wide, narrow) = header.intervals;
    let first = traces.first().map_or(0, |t| t.interval);
    let signed = |interval: u16| f64::from(interval.cast_signed());
    let candidates = [
        (BinaryHeader, wide),
        (BinaryHeader, signed(narrow)),
        (FirstTrace, signed(first)),
        (BinaryHeader, narrow.into()),
        (FirstTrace, first.into()),
    ];
    let is_interval = |value: f64| value.is_finite() && value > 0.0;
    let (source, taken) = candidates.into_iter().find(|c| is_interval(c.1))?;
    let odd = candidates.into_iter().take(3).find(|c| c.1 != 0.0 && !is_interval(c.1));
    if let Some((of, stated)) = odd {
        notes.push(ReadNote::NegativeInterval { of, stated, source, taken });
    }
    // intervals of traces are whole numbers
    let differs = |t: &&Trace| t.interval != 0 && (f64::from(t.interval) - taken).abs() >= 1.0;
    if let Some(trace) = traces.iter().position(|t| differs(&t)) {
        let other = signed(traces[trace].interval);
        let count = traces.iter().filter(differs).count();
        notes.push(ReadNote::IntervalsDiffer { source, taken, trace: trace + 1, other, count });
    }
    Some(taken)
}

/// The time of the first sample, of the first trace with data.
fn start(traces: &[Trace], notes: &mut Vec<ReadNote>) -> f64 {
    let live = || traces.iter().enumerate().filter(|(_, t)| !t.is_dead);
    let first = live().next().map_or(0.0, |(_, t)| t.start());
    if let Some((trace, odd)) = live().find(|(_, t)| t.delay != 0 && !t.has_time_scalar()) {
        notes.push(ReadNote::TimeScalar { trace: trace + 1, scalar: odd.time_scalar });
    }
    if let Some((trace, odd)) = live().find(|(_, t)| t.start() != first) {
        notes.push(ReadNote::Delays { first, trace: trace + 1, other: odd.start() });
    }
    first
}
