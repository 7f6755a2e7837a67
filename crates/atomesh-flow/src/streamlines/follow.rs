//! Following a line from piece to piece.

use atomesh::geometry::Point;

use super::line::{End, Streamline};
use super::options::{Porosity, TraceOptions};
use super::pieces::{FluxField, Neighbour, Piece};
use super::simplex::{Corners, exit};
use super::starts::Start;
use super::wells::WellExchange;
use crate::setting::Setting;

/// Steps without moving after which a line is taken to circle around a corner.
const STILL: usize = 1000;

/// A well that ends lines: it takes all that flows into its cells.
struct Sink<const D: usize> {
    well: usize,
    place: Point<D>,
    /// The time from the boundary of its cells to its place.
    time: f64,
}

/// Follows lines in a field.
pub struct Tracer<'a, const D: usize> {
    field: &'a FluxField<'a, D>,
    porosity: Porosity<'a>,
    limit: usize,
    sinks: Vec<Sink<D>>,
    /// The number of each cell's sink, from 1; 0 without one.
    sink_of: Vec<u32>,
}

impl<'a, const D: usize> Tracer<'a, D> {
    pub fn new(
        field: &'a FluxField<'a, D>,
        setting: &Setting<'_, D>,
        options: &TraceOptions<'a>,
    ) -> Self {
        let mut sinks = Vec::new();
        let mut sink_of = vec![0; field.grid.cell_count()];
        for placed in setting.wells() {
            let around = WellExchange::new(field, &placed.cells, &options.porosity);
            let takes = field.solution.wells[placed.well].rate < 0.0;
            if !takes || around.inward <= 0.0 || around.outward > 1e-9 * around.inward {
                continue;
            }
            let place = setting.problem().wells[placed.well].place;
            sinks.push(Sink { well: placed.well, place, time: around.pores / around.inward });
            placed.cells.iter().for_each(|&cell| sink_of[cell as usize] = sinks.len() as u32);
        }
        Self { field, porosity: options.porosity, limit: options.limit, sinks, sink_of }
    }

    /// Follows a line to its end.
    pub fn follow(&self, start: &Start<D>) -> Streamline<D> {
        let mut line = Streamline {
            points: vec![start.place],
            times: vec![0.0],
            cells: Vec::new(),
            from: start.from,
            to: None,
            end: End::Boundary,
        };
        if let Some(lead) = &start.lead {
            line.points[0] = lead.place;
            push(&mut line, start.place, lead.time, lead.cell);
        }
        let mut at = At { numbers: start.numbers, weights: start.weights };
        let mut into = (start.facet, start.into);
        let mut still = 0;
        while let (facet, Some(cell)) = into {
            if let Some(sink) =
                self.sinks.get((self.sink_of[cell as usize] as usize).wrapping_sub(1))
            {
                push(&mut line, sink.place, sink.time, cell);
                (line.to, line.end) = (Some(sink.well), End::Well);
                break;
            }
            let before = line.points.len();
            match self.cross(cell, facet, &mut at, &mut line) {
                Ok(next) => into = (next, self.field.beyond(cell as usize, next as usize)),
                Err(end) => {
                    line.end = end;
                    break;
                }
            }
            still = if line.points.len() > before { 0 } else { still + 1 };
            if still > STILL {
                line.end = End::Stagnation;
                break;
            }
        }
        line
    }

    /// Crosses a cell, entered through a facet; returns the facet through which the line leaves.
    fn cross(
        &self,
        cell: u32,
        facet: u32,
        at: &mut At,
        line: &mut Streamline<D>,
    ) -> Result<u32, End> {
        let pieces = self.field.pieces(cell as usize);
        let holds = |piece: &Piece<D>| {
            piece.beyond.contains(&Neighbour::Facet(facet)) && at.is_in(&piece.numbers[..=D])
        };
        let mut own = pieces.iter().position(holds).ok_or(End::Stagnation)?;
        for _ in 0..STILL {
            if line.cells.len() >= self.limit {
                return Err(End::Limit);
            }
            let piece = &pieces[own];
            let weights = at.seen_from(&piece.numbers);
            let exit = exit(&piece.fluxes, &weights, D + 1).ok_or(End::Stagnation)?;
            let time = exit.time * D as f64 * piece.measure * self.porosity.of(cell as usize);
            push(line, piece.place(&exit.weights), time, cell);
            *at = At { numbers: piece.numbers, weights: exit.weights };
            match piece.beyond[exit.opposite] {
                Neighbour::Facet(facet) => return Ok(facet),
                Neighbour::Piece(next) => own = next as usize,
                Neighbour::Nothing => return Err(End::Stagnation),
            }
        }
        Err(End::Stagnation)
    }
}

/// A place by barycentric coordinates of numbered corners.
struct At {
    numbers: [u32; 4],
    weights: Corners,
}

impl At {
    /// Whether all corners with a weight above 0 are among the numbers.
    fn is_in(&self, numbers: &[u32]) -> bool {
        let corners = self.numbers.iter().zip(&self.weights);
        corners.filter(|(_, weight)| **weight > 0.0).all(|(number, _)| numbers.contains(number))
    }

    /// The coordinates for the corners of another piece that holds the place.
    fn seen_from(&self, numbers: &[u32; 4]) -> Corners {
        let weight = |number: u32| {
            let at = self.numbers.iter().position(|&own| own == number);
            at.map_or(0.0, |at| self.weights[at])
        };
        numbers.map(weight)
    }
}

/// Adds a point, unless the line is there already.
fn push<const D: usize>(line: &mut Streamline<D>, point: Point<D>, time: f64, cell: u32) {
    let last = line.times.len() - 1;
    if line.points[last] == point {
        line.times[last] += time;
        return;
    }
    line.times.push(line.times[last] + time);
    line.points.push(point);
    line.cells.push(cell);
}
