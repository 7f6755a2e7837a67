//! Where a survey's grid lies in the world: traces' coordinates to spacing, direction and origin.
//!
//! X(i, j) = X₀ + i a + j b by least squares over all traces with data, i and j counted along x and y. The two
//! directions are then turned, each by as much, until they meet at right angles, since a frame is not
//! sheared. Every trace must lie within a twentieth of the lesser spacing, and one unit of the last
//! digit of the coordinates, of its place on that grid. Where it would but for the turning, the survey is
//! sheared and refused; else the farthest trace is named.

use super::super::error::ReadReason;
use super::super::note::ReadNote;
use super::super::traces::NOWHERE;
use super::coordinates::{Coordinates, Vector, difference, dot, length, rounded, turned};
use super::survey::Survey;

/// How far a trace may lie off its place, over the lesser spacing.
pub(super) const TOLERANCE: f64 = 0.05;

/// A grid in the plane of the coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    /// Between places along x and y.
    pub spacing: [f64; 2],
    /// The directions of x and y, as unit vectors.
    pub axes: [Vector; 2],
    /// Where place 0 is.
    pub origin: Vector,
}

/// A trace on a grid: its number from 0, its indices along x and y, and where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Located {
    pub trace: usize,
    pub indices: Vector,
    pub position: Vector,
}

impl Located {
    /// The traces that have coordinates, on a survey's grid.
    pub fn all(coordinates: &Coordinates, survey: &Survey) -> Vec<Self> {
        let located = |&(trace, position): &(usize, Vector)| {
            let (place, nx) = (survey.places[trace], survey.shape[0]);
            Self { trace, indices: [(place % nx) as f64, (place / nx) as f64], position }
        };
        let has_place = |(trace, _): &&(usize, Vector)| survey.places[*trace] != NOWHERE;
        coordinates.traces.iter().filter(has_place).map(located).collect()
    }
}

/// Two steps and the place where they begin, whatever their angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    pub steps: [Vector; 2],
    pub origin: Vector,
}

impl Lattice {
    /// Least squares about the means, so that large coordinates cost no digits. On a line (`is_line`) the
    /// second step is the first turned by a quarter.
    ///
    /// None if the traces do not tell the steps.
    pub fn fit(traces: &[Located], is_line: bool) -> Option<Self> {
        let (middle, centre) = (mean(traces, |t| t.indices), mean(traces, |t| t.position));
        let (mut square, mut cross) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
        for trace in traces {
            let i = difference(trace.indices, middle);
            let p = difference(trace.position, centre);
            for r in 0..2 {
                for c in 0..2 {
                    square[r][c] += i[r] * i[c];
                    cross[r][c] += i[r] * p[c];
                }
            }
        }
        let [[xx, xy], [_, yy]] = square;
        let steps = if is_line {
            let x = cross[0].map(|c| c / xx);
            [x, turned(x)]
        } else {
            let determinant = xx * yy - xy * xy;
            if determinant <= 1e-9 * xx * yy {
                return None; // all on one row
            }
            let x = std::array::from_fn(|c| (yy * cross[0][c] - xy * cross[1][c]) / determinant);
            [x, std::array::from_fn(|c| (xx * cross[1][c] - xy * cross[0][c]) / determinant)]
        };
        let is_step = |v: Vector| length(v).is_finite() && length(v) > 0.0;
        let shift = |k: usize| centre[k] - middle[0] * steps[0][k] - middle[1] * steps[1][k];
        steps.into_iter().all(is_step).then(|| Self { steps, origin: [shift(0), shift(1)] })
    }

    /// Where the place of some indices is.
    pub fn at(&self, [i, j]: Vector) -> Vector {
        let [a, b] = self.steps;
        std::array::from_fn(|k| self.origin[k] + i * a[k] + j * b[k])
    }

    /// The trace that is farthest off its place, and how far it is off.
    pub fn worst(&self, traces: &[Located]) -> (usize, f64) {
        let off = |t: &Located| (t.trace, length(difference(t.position, self.at(t.indices))));
        let farthest = traces.iter().map(off).max_by(|a, b| a.1.total_cmp(&b.1));
        farthest.unwrap_or((0, 0.0))
    }

    /// The angle between the steps, in degrees.
    fn degrees(&self) -> f64 {
        let [a, b] = self.steps;
        (dot(a, b) / (length(a) * length(b))).clamp(-1.0, 1.0).acos().to_degrees()
    }

    /// The grid with steps at right angles that is nearest, about the middle of the traces; none if they are
    /// less than 30 degrees apart.
    pub fn squared(&self, traces: &[Located]) -> Option<Placement> {
        let axes = square_up(self.steps)?;
        let spacing = self.steps.map(|v| rounded(length(v)));
        let (middle, centre) = (mean(traces, |t| t.indices), mean(traces, |t| t.position));
        let shift = |k: usize| {
            let [u, v] = [0, 1].map(|a| middle[a] * spacing[a] * axes[a][k]);
            rounded(centre[k] - u - v)
        };
        Some(Placement { spacing, axes, origin: [shift(0), shift(1)] })
    }
}

impl Placement {
    /// The same grid by its steps.
    pub fn lattice(&self) -> Lattice {
        let step = |k: usize| self.axes[k].map(|c| c * self.spacing[k]);
        Lattice { steps: [step(0), step(1)], origin: self.origin }
    }
}

fn mean(traces: &[Located], of: impl Fn(&Located) -> Vector) -> Vector {
    let sum = traces.iter().map(of).fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
    sum.map(|s| s / traces.len() as f64)
}

/// How far traces may be off their places.
pub(super) fn tolerance(spacing: f64, coordinates: &Coordinates) -> f64 {
    TOLERANCE * spacing + coordinates.resolution
}

/// Fits a grid to the traces of a cube; none if their coordinates do not tell one.
///
/// # Errors
/// If inlines and crosslines are not at right angles.
pub(super) fn place(
    coordinates: &Coordinates,
    survey: &Survey,
    notes: &mut Vec<ReadNote>,
) -> Result<Option<Placement>, ReadReason> {
    let traces = Located::all(coordinates, survey);
    let Some(lattice) = Lattice::fit(&traces, false) else { return Ok(None) };
    let [x, y] = lattice.steps.map(length);
    let tolerance = tolerance(x.min(y), coordinates);
    let degrees = lattice.degrees();
    let Some(placement) = lattice.squared(&traces) else {
        return Err(ReadReason::ShearedTraces { degrees });
    };
    let (trace, distance) = placement.lattice().worst(&traces);
    if distance > tolerance && lattice.worst(&traces).1 <= tolerance {
        return Err(ReadReason::ShearedTraces { degrees });
    }
    if distance > tolerance {
        notes.push(ReadNote::Irregular { trace: trace + 1, distance, tolerance });
    }
    Ok(Some(placement))
}

/// The unit vectors at right angles that are nearest to the directions; none if those are parallel.
fn square_up([x, y]: [Vector; 2]) -> Option<[Vector; 2]> {
    let unit = |v: Vector| {
        let length = length(v);
        v.map(|c| c / length)
    };
    let (x, y) = (unit(x), unit(y));
    let side = dot(turned(x), y).signum();
    let back = turned(y).map(|c| -side * c);
    let sum: Vector = std::array::from_fn(|k| x[k] + back[k]);
    if dot(sum, sum) < 1.0 {
        return None; // less than 30 degrees apart
    }
    let x = unit(sum).map(|c| if c.abs() < 1e-9 { 0.0 } else { c });
    Some([x, turned(x).map(|c| side * c)])
}
