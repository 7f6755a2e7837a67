//! Where a line lies: x is the distance along it.
//!
//! Traces that stand evenly on a straight line give its spacing by least squares. Others are followed step by
//! step: the spacing is the sum of the steps over their number. Coordinates are rounded, which lengthens short
//! steps; so the way goes only over traces that are ten units of the last digit apart, which leaves an
//! error below a thousandth.

use super::super::error::ReadReason;
use super::super::note::ReadNote;
use super::coordinates::{Coordinates, Vector, difference, length, rounded};
use super::fit::{Lattice, Located, Placement, tolerance};
use super::survey::Survey;

/// Steps of the way, over the resolution of coordinates.
const LEAST_STEP: f64 = 10.0;

/// The longest step from trace to trace, over the median, of what is still a line if no number says so.
const LONGEST_STEP: f64 = 10.0;

/// The world's axes.
const STRAIGHT: [Vector; 2] = [[1.0, 0.0], [0.0, 1.0]];

/// Places a line; none if its coordinates do not tell how.
///
/// # Errors
/// If traces that no number arranges are no line by their coordinates.
pub(super) fn place(
    coordinates: &Coordinates,
    survey: &Survey,
    notes: &mut Vec<ReadNote>,
) -> Result<Option<Placement>, ReadReason> {
    let mut traces = Located::all(coordinates, survey);
    traces.sort_by(|a, b| a.indices[0].total_cmp(&b.indices[0]));
    let straight = Lattice::fit(&traces, true).and_then(|lattice| lattice.squared(&traces));
    if let Some(straight) = straight
        && straight.lattice().worst(&traces).1 <= tolerance(straight.spacing[0], coordinates)
    {
        return Ok(Some(along(straight, survey, notes)));
    }
    if survey.is_guess {
        check_steps(&traces)?;
    }
    Ok(follow(&traces, coordinates, notes))
}

/// A straight line's world is the distance along it, which is X where it runs along X.
fn along(placement: Placement, survey: &Survey, notes: &mut Vec<ReadNote>) -> Placement {
    if placement.axes[0] == STRAIGHT[0] {
        return Placement { axes: STRAIGHT, origin: [placement.origin[0], 0.0], ..placement };
    }
    let last = [survey.shape[0] as f64 - 1.0, 0.0];
    let end = |at: Vector| placement.lattice().at(at).map(rounded);
    notes.push(ReadNote::Line { first: end([0.0, 0.0]), last: end(last) });
    Placement { axes: STRAIGHT, origin: [0.0, 0.0], ..placement }
}

/// Refuses traces that jump about: rows of a cube one after another, or places in no order.
fn check_steps(traces: &[Located]) -> Result<(), ReadReason> {
    let mut steps: Vec<f64> = traces.windows(2).map(|w| step(&w[0], &w[1])).collect();
    steps.sort_by(f64::total_cmp);
    let (median, longest) = match steps.as_slice() {
        [.., longest] => (steps[steps.len() / 2], *longest),
        [] => return Ok(()),
    };
    if median > 0.0 && longest > LONGEST_STEP * median {
        let traces = traces.len();
        return Err(ReadReason::NoLine { traces, median, longest });
    }
    Ok(())
}

/// The step between two traces, over the number of places between them.
fn step(a: &Located, b: &Located) -> f64 {
    length(difference(b.position, a.position)) / (b.indices[0] - a.indices[0]).max(1.0)
}

/// The distance of each trace from the first, along the line.
fn distances(traces: &[Located], resolution: f64) -> Vec<f64> {
    let mut start = (0.0, traces.first().map_or([0.0; 2], |t| t.position));
    let mut distances = Vec::new();
    for trace in traces {
        let step = length(difference(trace.position, start.1));
        let distance = start.0 + step;
        if step >= LEAST_STEP * resolution {
            start = (distance, trace.position);
        }
        distances.push(distance);
    }
    distances
}

/// The spacing of a crooked or uneven line, and what it leaves out.
fn follow(
    traces: &[Located],
    coordinates: &Coordinates,
    notes: &mut Vec<ReadNote>,
) -> Option<Placement> {
    let (first, last) = (traces.first()?, traces.last()?);
    let distances = distances(traces, coordinates.resolution);
    let (whole, places) = (*distances.last()?, last.indices[0] - first.indices[0]);
    let spacing = rounded(whole / places);
    if !(spacing.is_finite() && spacing > 0.0) {
        return None;
    }
    let ends = [first, last].map(|t| t.position.map(rounded));
    notes.push(ReadNote::CrookedLine { first: ends[0], last: ends[1], length: rounded(whole) });
    let off = |(trace, distance): (&Located, &f64)| {
        let even = (trace.indices[0] - first.indices[0]) * spacing;
        (trace.trace + 1, (distance - even).abs())
    };
    let off = traces.iter().zip(&distances).map(off);
    let (trace, distance) = off.fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
    let tolerance = tolerance(spacing, coordinates);
    if distance > tolerance {
        notes.push(ReadNote::UnevenLine { trace, distance, tolerance });
    }
    Some(Placement { spacing: [spacing; 2], axes: STRAIGHT, origin: [0.0, 0.0] })
}
