//! Which trace belongs where: numbers in trace headers, or else coordinates, to places on a grid.

use super::super::error::ReadReason;
use super::super::note::ReadNote;
use super::super::options::Duplicates;
use super::super::traces::NOWHERE;
use super::coordinates::Coordinates;
use super::grid::Grid;
use super::trace::Trace;
use super::{Places, TRACE_BYTES};

/// The most places for each trace that is there. A survey of irregular outline fills a third of its
/// grid or more; fewer traces than this say that the numbers are not what they are taken for.
const MOST_PLACES: usize = 16;

/// The places of the traces.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Survey {
    /// Places along x (the crosslines, or the line) and along y (the inlines; 1 for a line).
    pub shape: [usize; 2],
    /// Whether inlines and crosslines both vary.
    pub is_cube: bool,
    /// The place of each trace, x + nx · y; [`NOWHERE`] if a dead one has none.
    pub places: Vec<usize>,
    /// Whether nothing but its traces' order or ensembles says that this is a line.
    pub is_guess: bool,
}

/// Numbers that a survey counts by: from `least` on in equal steps.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Numbers {
    least: i64,
    step: i64,
    count: usize,
}

impl Numbers {
    /// The sparsest numbers that hold all these, of which there is one at least.
    fn of(numbers: impl Iterator<Item = i32> + Clone) -> Self {
        let numbers = numbers.map(i64::from);
        let (least, greatest) =
            numbers.clone().fold((i64::MAX, i64::MIN), |(a, b), n| (a.min(n), b.max(n)));
        let step = numbers.fold(0, |step, n| common_divisor(step, n - least)).max(1);
        Self { least, step, count: ((greatest - least) / step + 1) as usize }
    }

    fn index(&self, number: i32) -> usize {
        ((i64::from(number) - self.least) / self.step) as usize
    }

    fn number(&self, index: usize) -> i64 {
        self.least + self.step * index as i64
    }

    fn text(&self) -> String {
        let by = if self.step == 1 { String::new() } else { format!(" by {}", self.step) };
        format!("{} to {}{by}", self.least, self.number(self.count - 1))
    }
}

fn common_divisor(a: i64, b: i64) -> i64 {
    if b == 0 { a } else { common_divisor(b, a % b) }
}

/// What a line's traces are numbered by.
#[derive(Clone, Copy)]
struct Numbering {
    /// As in `inlines`.
    plural: &'static str,
    of: fn(&Trace) -> i32,
}

/// In the order in which they are tried.
const NUMBERINGS: [Numbering; 3] = [
    Numbering { plural: "crosslines", of: |t| t.crossline },
    Numbering { plural: "inlines", of: |t| t.inline },
    Numbering { plural: "ensembles", of: |t| t.ensemble },
];

impl Survey {
    /// The number of places.
    pub fn trace_places(&self) -> usize {
        self.shape[0] * self.shape[1]
    }

    /// Arranges traces: by inline and crossline where both vary, by coordinates where neither does and those
    /// make a grid, else as a line.
    pub fn arrange(
        traces: &[Trace],
        of: &Places<'_>,
        coordinates: Option<&Coordinates>,
        notes: &mut Vec<ReadNote>,
    ) -> Result<Self, ReadReason> {
        let numbers = |of: fn(&Trace) -> i32| Numbers::of(traces.iter().map(of));
        let (x, y) = (numbers(|t| t.crossline), numbers(|t| t.inline));
        let [inline, crossline] = of.numbers.unwrap_or(TRACE_BYTES);
        if x.count > 1 && y.count > 1 && inline != crossline {
            return Self::cube(traces, [x, y], of.duplicates, notes);
        }
        let is_guess = x.count == 1 && y.count == 1 && inline != crossline;
        if is_guess && let Some(grid) = coordinates.and_then(Grid::of) {
            return Self::by_position(traces, grid, of.duplicates, notes);
        }
        let mut numbered = NUMBERINGS.iter().map(|&numbering| (numbering, numbers(numbering.of)));
        let line = match numbered.find(|(_, numbers)| numbers.count > 1) {
            Some((numbering, numbers)) => {
                Self::line(traces, (numbering, numbers), of.duplicates, notes)?
            }
            None => {
                let numbers = "not numbered, a line in the order of the file".into();
                notes.push(ReadNote::Traces { count: traces.len(), numbers });
                let places = (0..traces.len()).collect();
                Self { shape: [traces.len(), 1], is_cube: false, places, is_guess }
            }
        };
        Ok(Self { is_guess, ..line })
    }

    /// A grid that coordinates tell.
    fn by_position(
        traces: &[Trace],
        grid: Grid,
        duplicates: Option<Duplicates>,
        notes: &mut Vec<ReadNote>,
    ) -> Result<Self, ReadReason> {
        let (shape, trace_count) = (grid.shape, traces.len());
        notes.push(ReadNote::TracesByPosition { count: trace_count, shape });
        let mut places = vec![NOWHERE; trace_count];
        grid.places.iter().for_each(|&(trace, place)| places[trace] = place);
        let name = |place: usize| {
            format!("row {}, column {} by X and Y", place / shape[0], place % shape[0])
        };
        Self { shape, is_cube: true, places, is_guess: false }
            .checked(traces, name, duplicates, notes)
    }

    /// Crosslines along x, inlines along y.
    fn cube(
        traces: &[Trace],
        [x, y]: [Numbers; 2],
        duplicates: Option<Duplicates>,
        notes: &mut Vec<ReadNote>,
    ) -> Result<Self, ReadReason> {
        let shape = [x.count, y.count];
        let text = format!("inlines {}, crosslines {}", y.text(), x.text());
        notes.push(ReadNote::Traces { count: traces.len(), numbers: text.clone() });
        check_filled(shape, traces.len(), text)?;
        let place = |t: &Trace| y.index(t.inline) * x.count + x.index(t.crossline);
        let name = |place: usize| {
            let (inline, crossline) = (y.number(place / x.count), x.number(place % x.count));
            format!("inline {inline}, crossline {crossline}")
        };
        let places = traces.iter().map(place).collect();
        Self { shape, is_cube: true, places, is_guess: false }
            .checked(traces, name, duplicates, notes)
    }

    /// Numbered traces along x.
    fn line(
        traces: &[Trace],
        (numbering, numbers): (Numbering, Numbers),
        duplicates: Option<Duplicates>,
        notes: &mut Vec<ReadNote>,
    ) -> Result<Self, ReadReason> {
        let Numbering { plural, of } = numbering;
        let shape = [numbers.count, 1];
        let text = format!("{plural} {}", numbers.text());
        notes.push(ReadNote::Traces { count: traces.len(), numbers: text.clone() });
        check_filled(shape, traces.len(), text)?;
        let name = |place: usize| {
            let singular = plural.trim_end_matches('s');
            format!("{singular} {}", numbers.number(place))
        };
        let places = traces.iter().map(|t| numbers.index(of(t))).collect();
        Self { shape, is_cube: false, places, is_guess: false }
            .checked(traces, name, duplicates, notes)
    }

    /// The same if no two traces have one place, or with one trace at each; says which places have none. A dead
    /// trace gives way to another.
    fn checked(
        mut self,
        all: &[Trace],
        name: impl Fn(usize) -> String,
        duplicates: Option<Duplicates>,
        notes: &mut Vec<ReadNote>,
    ) -> Result<Self, ReadReason> {
        const FREE: usize = usize::MAX;
        let mut traces = vec![FREE; self.trace_places()];
        let mut left_out = Vec::new();
        for (trace, &place) in
            self.places.iter().enumerate().filter(|(_, place)| **place != NOWHERE)
        {
            let before = std::mem::replace(&mut traces[place], trace);
            if before == FREE {
                continue;
            }
            let Some(duplicates) = duplicates else {
                let (first, second) = (before + 1, trace + 1);
                return Err(ReadReason::DuplicateTraces { first, second, number: name(place) });
            };
            let keeps_last = match (all[before].is_dead, all[trace].is_dead) {
                (false, true) => false,
                (true, false) => true,
                _ => duplicates == Duplicates::Last,
            };
            if !keeps_last {
                traces[place] = before;
            }
            left_out.push(if keeps_last { before } else { trace });
        }
        left_out.iter().for_each(|&trace| self.places[trace] = NOWHERE);
        if let Some(first) = left_out.iter().min() {
            let (count, is_last) = (left_out.len(), duplicates == Some(Duplicates::Last));
            notes.push(ReadNote::DuplicateTraces { count, is_last, trace: first + 1 });
        }
        let missing = traces.iter().filter(|&&t| t == FREE).count();
        if let Some(first) = traces.iter().position(|&t| t == FREE) {
            let expected = traces.len();
            notes.push(ReadNote::MissingTraces { missing, expected, first: name(first) });
        }
        Ok(self)
    }
}

/// Whether enough places have a trace for the numbers to be what they are taken for.
fn check_filled(shape: [usize; 2], traces: usize, numbers: String) -> Result<(), ReadReason> {
    let [nx, ny] = shape.map(|n| n as u128);
    match nx * ny <= (traces * MOST_PLACES) as u128 {
        true => Ok(()),
        false => Err(ReadReason::SparseTraces { traces, places: nx * ny, numbers }),
    }
}
