//! Traces without numbers on a regular grid: their coordinates tell rows and columns.
//!
//! The shortest step from a trace to another, and the shortest across it, are those of the grid, but for the
//! rounding of coordinates. Their sums would go astray over many steps. So a lattice is fitted to the
//! surroundings of one trace, then to twice as wide ones, until it spans all: each fit tells indices twice as
//! far out. Cost: O(n log n).

use super::coordinates::{Coordinates, Vector, difference, dot, length, turned};
use super::fit::{Lattice, Located, tolerance};

/// Traces from which the shortest steps are looked for.
const SEEDS: usize = 16;

/// The share of its meshes by which a grid is told; a line with a bend has none.
const LEAST_SHARE: f64 = 0.25;

/// The sine of the least angle, 30 degrees, between two steps.
const LEAST_SINE: f64 = 0.5;

/// Rows and columns of traces.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grid {
    /// Places along x, in the direction in which the file goes from trace to trace, and along y.
    pub shape: [usize; 2],
    /// The trace's number and the place, x + nx · y, of each trace with coordinates.
    pub places: Vec<(usize, usize)>,
}

impl Grid {
    /// The grid on which all traces are, if there is one of more than a row.
    pub fn of(coordinates: &Coordinates) -> Option<Self> {
        let positions: Vec<Vector> = coordinates.traces.iter().map(|t| t.1).collect();
        let lattice = turned_as_file(lattice(&positions)?, &positions)?;
        let traces = located(coordinates, &lattice);
        let [x, y] = lattice.steps.map(length);
        // steps that are parallel give no number
        let fits = lattice.worst(&traces).1 <= tolerance(x.min(y), coordinates);
        let bounds = |axis: usize| {
            let indices = || traces.iter().map(|t| t.indices[axis]);
            (indices().fold(f64::INFINITY, f64::min), indices().fold(f64::NEG_INFINITY, f64::max))
        };
        let [(left, right), (low, high)] = [bounds(0), bounds(1)];
        let shape = [right - left, high - low].map(|n| (n as usize).saturating_add(1));
        if !fits || !is_told(shape, traces.len()) {
            return None;
        }
        let place = |t: &Located| {
            let [i, j] = [t.indices[0] - left, t.indices[1] - low].map(|n| n as usize);
            (t.trace, i + shape[0] * j)
        };
        Some(Self { shape, places: traces.iter().map(place).collect() })
    }
}

/// Whether traces tell a grid: so many that they go round its meshes, and do not only branch.
fn is_told([nx, ny]: [usize; 2], traces: usize) -> bool {
    let (x, y) = (nx as f64, ny as f64);
    // as many as in a tree of rows and columns tell nothing
    let round = traces as f64 - (x + y - 1.0);
    round >= 1.0 && round >= LEAST_SHARE * (x - 1.0) * (y - 1.0)
}

/// The traces with the indices that are nearest on a lattice.
fn located(coordinates: &Coordinates, lattice: &Lattice) -> Vec<Located> {
    let located = |&(trace, position): &(usize, Vector)| {
        let indices = indices(lattice, position).map(f64::round);
        Located { trace, indices, position }
    };
    coordinates.traces.iter().map(located).collect()
}

/// Indices, not rounded, of a position.
fn indices(lattice: &Lattice, position: Vector) -> Vector {
    let ([a, b], d) = (lattice.steps, difference(position, lattice.origin));
    let area = dot(turned(a), b);
    [-dot(turned(b), d) / area, dot(turned(a), d) / area]
}

/// The lattice of the positions about one of them.
fn lattice(positions: &[Vector]) -> Option<Lattice> {
    let seeds: Vec<Vector> =
        positions.iter().step_by(positions.len().div_ceil(SEEDS).max(1)).copied().collect();
    let (origin, a) = shortest(&seeds, positions, |_| true)?;
    let is_across = |d: Vector| dot(turned(a), d).abs() >= LEAST_SINE * length(a) * length(d);
    let (_, b) = shortest(&seeds, positions, is_across)?;
    let mut lattice = Lattice { steps: [a, b], origin };
    let reach = positions.iter().map(|&p| length(difference(p, origin))).fold(0.0, f64::max);
    let mut radius = 1.5 * length(a).max(length(b));
    // 64 times twice as far is beyond any file
    for _ in 0..64 {
        let near = positions.iter().filter(|&&p| length(difference(p, origin)) <= radius);
        let near: Vec<Located> = near
            .map(|&position| Located {
                trace: 0,
                indices: indices(&lattice, position).map(f64::round),
                position,
            })
            .collect();
        // too few on a rim tell nothing yet
        lattice = Lattice::fit(&near, false).unwrap_or(lattice);
        if radius > reach {
            break;
        }
        radius *= 2.0;
    }
    Some(lattice)
}

/// The shortest step that is wanted from one of the seeds to a position, and the seed.
fn shortest(
    seeds: &[Vector],
    positions: &[Vector],
    is_wanted: impl Fn(Vector) -> bool,
) -> Option<(Vector, Vector)> {
    let steps = seeds.iter().flat_map(|&seed| {
        positions.iter().map(move |&p| (seed, difference(p, seed))).filter(|s| length(s.1) > 0.0)
    });
    steps.filter(|s| is_wanted(s.1)).min_by(|a, b| length(a.1).total_cmp(&length(b.1)))
}

/// The same lattice with x along the file's first step, and the last trace not below the first.
fn turned_as_file(lattice: Lattice, positions: &[Vector]) -> Option<Lattice> {
    let (first, last) = (*positions.first()?, *positions.last()?);
    let along = |d: Vector| {
        let [i, j] = indices(&Lattice { origin: [0.0; 2], ..lattice }, d);
        [i, j]
    };
    let step = along(difference(*positions.get(1)?, first));
    let [mut x, mut y] = lattice.steps;
    let mut whole = along(difference(last, first));
    let mut forward = step[0];
    if step[1].abs() > step[0].abs() {
        (x, y, forward) = (y, x, step[1]);
        whole.reverse();
    }
    if forward < 0.0 {
        x = x.map(|c| -c);
    }
    if whole[1] < 0.0 {
        y = y.map(|c| -c);
    }
    Some(Lattice { steps: [x, y], ..lattice })
}
