//! Where traces are in the world: X and Y of those that have data.

use super::super::note::ReadNote;
use super::COORDINATE_BYTES;
use super::trace::Trace;

/// A place, or a step from one to another, along X and Y.
pub(super) type Vector = [f64; 2];

pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

pub(super) fn length(a: Vector) -> f64 {
    a[0].hypot(a[1])
}

pub(super) fn difference(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1]]
}

/// A quarter turn from X to Y.
pub(super) fn turned([x, y]: Vector) -> Vector {
    [-y, x]
}

/// Rounded to ten digits: the coordinates are whole numbers over a scalar, and sums of them should
/// not show.
pub(super) fn rounded(value: f64) -> f64 {
    format!("{value:.9e}").parse().unwrap_or(value)
}

/// The coordinates of traces.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Coordinates {
    /// The numbers of traces with data, from 0, in the order of the file, and where each is.
    pub traces: Vec<(usize, Vector)>,
    /// World units from one coordinate that can be written to the next, of the coarsest trace.
    pub resolution: f64,
}

impl Coordinates {
    /// Takes X and Y from the first of the places where they vary.
    ///
    /// # Errors
    /// A note, if they are angles or vary nowhere.
    pub fn of(traces: &[Trace], searched: &[[usize; 2]]) -> Result<Self, ReadNote> {
        if let Some(odd) = traces.iter().find(|t| t.units > 1) {
            return Err(ReadNote::Angles { code: odd.units });
        }
        let live: Vec<usize> = (0..traces.len()).filter(|&k| !traces[k].is_dead).collect();
        let searched = &searched[..searched.len().min(COORDINATE_BYTES.len())];
        let varies = |at: &usize| {
            let places = || live.iter().map(|&k| traces[k].places[*at]);
            places().zip(places().skip(1)).any(|(a, b)| a != b)
        };
        let Some(at) = (0..searched.len()).find(varies) else { return Err(nowhere(searched)) };
        let resolution = live.iter().map(|&k| traces[k].resolution()).fold(0.0, f64::max);
        let traces = live.into_iter().map(|k| (k, traces[k].position(at))).collect();
        Ok(Self { traces, resolution })
    }
}

/// The note that no trace says where it is.
pub(super) fn nowhere(searched: &[[usize; 2]]) -> ReadNote {
    let bytes: Vec<_> = searched.iter().map(|[x, y]| format!("{x} and {y}")).collect();
    ReadNote::NoCoordinates { bytes: bytes.join(", ") }
}
