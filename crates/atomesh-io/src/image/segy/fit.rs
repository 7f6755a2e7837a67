//! Where a survey's grid lies in the world: traces' coordinates to spacing, direction and origin.
//!
//! X(i, j) = X₀ + i a + j b by least squares over all traces, i and j counted along x and y. The two
//! directions are then turned, each by as much, until they meet at right angles, since a frame is not
//! sheared. Every trace must lie within a twentieth of the lesser spacing, and one unit of the last
//! digit of the coordinates, of its place on that grid; the farthest one is named if it does not.

use super::super::note::ReadNote;
use super::COORDINATE_BYTES;
use super::survey::Survey;
use super::trace::Trace;

/// How far a trace may lie off its place, over the lesser spacing.
const TOLERANCE: f64 = 0.05;

/// A grid in the plane of the coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    /// Between places along x and y.
    pub spacing: [f64; 2],
    /// The directions of x and y, as unit vectors.
    pub axes: [[f64; 2]; 2],
    /// Where place 0 is.
    pub origin: [f64; 2],
}

type Vector = [f64; 2];

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// A quarter turn from X to Y.
fn turned([x, y]: Vector) -> Vector {
    [-y, x]
}

/// Rounded to ten digits: the coordinates are whole numbers over a scalar, and sums of them should
/// not show.
fn rounded(value: f64) -> f64 {
    format!("{value:.9e}").parse().unwrap_or(value)
}

/// Fits a grid to the traces; none if they have no coordinates, or all the same.
pub(super) fn place(
    traces: &[Trace],
    survey: &Survey,
    searched: &[[usize; 2]],
    notes: &mut Vec<ReadNote>,
) -> Option<Placement> {
    if let Some(odd) = traces.iter().find(|t| t.units > 1) {
        notes.push(ReadNote::Angles { code: odd.units });
        return None;
    }
    let searched = &searched[..searched.len().min(COORDINATE_BYTES.len())];
    let varies = |k: &usize| traces.iter().any(|t| t.places[*k] != traces[0].places[*k]);
    let fitted = (0..searched.len()).find(varies).and_then(|k| {
        let positions: Vec<Vector> = traces.iter().map(|t| t.position(k)).collect();
        Some((fit(&positions, survey)?, positions))
    });
    let Some((placement, positions)) = fitted else {
        let bytes: Vec<_> = searched.iter().map(|[x, y]| format!("{x} and {y}")).collect();
        notes.push(ReadNote::NoCoordinates { bytes: bytes.join(", ") });
        return None;
    };
    let resolution = traces.iter().map(Trace::resolution).fold(0.0, f64::max);
    notes.extend(misfit(&placement, &positions, survey, resolution));
    if survey.is_cube { Some(placement) } else { Some(along(placement, survey, notes)) }
}

/// The trace that is farthest off its place, if it is too far.
fn misfit(
    placement: &Placement,
    positions: &[Vector],
    survey: &Survey,
    resolution: f64,
) -> Option<ReadNote> {
    let spacings = &placement.spacing[..if survey.is_cube { 2 } else { 1 }];
    let least = spacings.iter().copied().fold(f64::INFINITY, f64::min);
    let tolerance = TOLERANCE * least + resolution;
    let off = positions.iter().zip(&survey.places).map(|(p, &place)| {
        let [x, y] = placement.at(indices(place, survey));
        (p[0] - x).hypot(p[1] - y)
    });
    let worst = off.enumerate().fold((0, 0.0), |w, (k, d)| if d > w.1 { (k, d) } else { w });
    let (trace, distance) = (worst.0 + 1, worst.1);
    (distance > tolerance).then_some(ReadNote::Irregular { trace, distance, tolerance })
}

/// The place's numbers along x and y.
fn indices(place: usize, survey: &Survey) -> Vector {
    [(place % survey.shape[0]) as f64, (place / survey.shape[0]) as f64]
}

impl Placement {
    fn at(&self, [i, j]: Vector) -> Vector {
        let [a, b] = self.axes;
        let (u, v) = (i * self.spacing[0], j * self.spacing[1]);
        std::array::from_fn(|k| self.origin[k] + u * a[k] + v * b[k])
    }
}

/// Least squares about the means, so that large coordinates cost no digits.
fn fit(positions: &[Vector], survey: &Survey) -> Option<Placement> {
    let count = positions.len() as f64;
    let places = || survey.places.iter().map(|&place| indices(place, survey));
    let mean = |all: &mut dyn Iterator<Item = Vector>| {
        all.fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]).map(|s| s / count)
    };
    let (middle, centre) = (mean(&mut places()), mean(&mut positions.iter().copied()));
    let (mut square, mut cross) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
    for (i, p) in places().zip(positions) {
        let i: Vector = std::array::from_fn(|k| i[k] - middle[k]);
        let p: Vector = std::array::from_fn(|k| p[k] - centre[k]);
        for r in 0..2 {
            for c in 0..2 {
                square[r][c] += i[r] * i[c];
                cross[r][c] += i[r] * p[c];
            }
        }
    }
    let [x, y] = if survey.is_cube {
        let [[xx, xy], [_, yy]] = square;
        let determinant = xx * yy - xy * xy;
        if determinant <= 1e-9 * xx * yy {
            return None; // all on one row
        }
        let x = std::array::from_fn(|c| (yy * cross[0][c] - xy * cross[1][c]) / determinant);
        [x, std::array::from_fn(|c| (xx * cross[1][c] - xy * cross[0][c]) / determinant)]
    } else {
        let x: Vector = cross[0].map(|c| c / square[0][0]);
        [x, turned(x)]
    };
    let spacing = [x, y].map(|v| rounded(v[0].hypot(v[1])));
    if spacing.iter().any(|s| !(s.is_finite() && *s > 0.0)) {
        return None;
    }
    let axes = square_up([x, y])?;
    let shift = |k: usize| {
        let [u, v] = [0, 1].map(|a| middle[a] * spacing[a] * axes[a][k]);
        rounded(centre[k] - u - v)
    };
    Some(Placement { spacing, axes, origin: [shift(0), shift(1)] })
}

/// The unit vectors at right angles that are nearest to the directions; none if those are parallel.
fn square_up([x, y]: [Vector; 2]) -> Option<[Vector; 2]> {
    let unit = |v: Vector| {
        let length = v[0].hypot(v[1]);
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

/// A line's world is the distance along it, which is X where it runs along X.
fn along(placement: Placement, survey: &Survey, notes: &mut Vec<ReadNote>) -> Placement {
    let axes = [[1.0, 0.0], [0.0, 1.0]];
    if placement.axes[0] == [1.0, 0.0] {
        return Placement { axes, origin: [placement.origin[0], 0.0], ..placement };
    }
    let last = [survey.shape[0] as f64 - 1.0, 0.0];
    let end = |at: Vector| placement.at(at).map(rounded);
    notes.push(ReadNote::Line { first: end([0.0, 0.0]), last: end(last) });
    Placement { axes, origin: [0.0, 0.0], ..placement }
}
