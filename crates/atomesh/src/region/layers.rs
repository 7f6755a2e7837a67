//! What becomes of an image's labels in a mesh: labels that no cell has, and layers too thin for the edges asked for.
//!
//! A layer is *thin* at a sample if a line through it, of those along axes and diagonals, leaves the label on both
//! sides within less than d. Flat, slanted and round layers of two to six samples all came out in one part where d was
//! at most their thickness; those of four and more, whose sides atoms conform to, also where d was 1.3 times as long.
//! Across thinner ones cells of other labels may reach: such a layer comes out broken, in more parts than the image
//! has, or with less than its measure. Only then is it told. Cost: O(samples), and for labels that come out broken or
//! smaller O(their runs of samples along x).

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use crate::parallel::prelude::*;

use crate::fields::NominalDistance;
use crate::geometry::Sets;
use crate::image::{Grid, Samples, coordinates, neighbour};
use crate::mesh::Mesh;

/// The share of a label's measure that is notable.
const NOTABLE: f64 = 0.1;
/// The measure of a speck, over d² or d³: about that of two cells. Smaller parts do not count.
const SPECK: f64 = 0.3;
/// The most samples of a label at which its thickness is measured.
const PROBES: usize = 4096;
/// Rows of samples that a thread takes at once.
const ROWS_PER_TASK: usize = 1 << 10;

/// A label with a layer that is too thin for the edges asked for.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct ThinLayer {
    /// The label.
    pub label: i32,
    /// The median thickness where it is thin, in lattice units. A nominal distance of at most as much keeps it whole.
    pub thickness: f64,
}

/// An image of labels in lattice space. A value that is not an integer, such as NaN outside of a mask, is no label.
#[derive(Clone, Copy)]
pub(crate) struct LabelImage<'a, const D: usize> {
    /// Where the samples are.
    pub grid: &'a Grid<D>,
    /// The labels.
    pub samples: &'a Samples,
}

/// How many of the samples around one come before it, in 2-D and 3-D: the codes of [`neighbour`] below this. The code
/// of the sample opposite is twice this, less the code.
const HALF: [usize; 2] = [4, 13];

/// Samples of one label along x.
struct Run {
    row: usize,
    /// The first sample and the one after the last, counted in the row.
    range: Range<usize>,
    label: i32,
}

impl<const D: usize> LabelImage<'_, D> {
    fn label(&self, index: usize) -> Option<i32> {
        let value = self.samples.get(index);
        let label = value as i32;
        (f64::from(label) == value).then_some(label)
    }

    fn rows(&self) -> usize {
        self.grid.sample_count() / self.grid.shape[0]
    }

    /// The runs of a row, by ascending samples.
    fn runs_of(&self, row: usize, runs: &mut Vec<Run>) {
        let count = self.grid.shape[0];
        let (mut start, mut label) = (0, self.label(row * count));
        for i in 1..=count {
            let next = if i < count { self.label(row * count + i) } else { None };
            if i == count || next != label {
                runs.extend(label.map(|label| Run { row, range: start..i, label }));
                (start, label) = (i, next);
            }
        }
    }

    /// The part of the image's box that is about a run of samples: half a sample's width at the sides of the box.
    fn measure_of(&self, run: &Run) -> f64 {
        let (shape, step) = (self.grid.shape, self.grid.step);
        let half = |is_at_side: bool| if is_at_side { 0.5 } else { 0.0 };
        let ends = half(run.range.start == 0) + half(run.range.end == shape[0]);
        let place = coordinates(run.row * shape[0], shape);
        let widths =
            (1..D).map(|k| (1.0 - half(place[k] == 0) - half(place[k] + 1 == shape[k])) * step[k]);
        (run.range.len() as f64 - ends) * step[0] * widths.product::<f64>()
    }

    /// The measure of each label's samples, in lattice units.
    pub fn measures(&self) -> BTreeMap<i32, f64> {
        let tasks = self.rows().div_ceil(ROWS_PER_TASK);
        let of_task = |task: usize| {
            let mut measures = BTreeMap::new();
            let mut runs = Vec::new();
            for row in task * ROWS_PER_TASK..self.rows().min((task + 1) * ROWS_PER_TASK) {
                runs.clear();
                self.runs_of(row, &mut runs);
                for run in &runs {
                    *measures.entry(run.label).or_insert(0.0) += self.measure_of(run);
                }
            }
            measures
        };
        let parts: Vec<BTreeMap<i32, f64>> = (0..tasks).into_par_iter().map(of_task).collect();
        let mut measures = BTreeMap::new();
        for (label, measure) in parts.into_iter().flatten() {
            *measures.entry(label).or_insert(0.0) += measure;
        }
        measures
    }

    /// The runs of some labels in the order of their rows.
    fn runs(&self, labels: &BTreeSet<i32>) -> Vec<Run> {
        let mut runs = Vec::new();
        for row in 0..self.rows() {
            let start = runs.len();
            self.runs_of(row, &mut runs);
            let found: Vec<Run> = runs.drain(start..).collect();
            runs.extend(found.into_iter().filter(|run| labels.contains(&run.label)));
        }
        runs
    }

    /// How many parts of at least `speck` the samples of each label are in; samples that share a corner are of one part.
    fn parts(&self, runs: &[Run], speck: f64) -> BTreeMap<i32, usize> {
        let mut starts = vec![0_usize; self.rows() + 1];
        runs.iter().for_each(|run| starts[run.row + 1] += 1);
        (0..self.rows()).for_each(|row| starts[row + 1] += starts[row]);
        let mut sets = Sets::new(runs.len());
        for row in 0..self.rows() {
            for other in self.rows_before(row) {
                let (own, others) =
                    (starts[row]..starts[row + 1], starts[other]..starts[other + 1]);
                join_touching(runs, own, others, &mut sets);
            }
        }
        let measures = runs.iter().map(|run| self.measure_of(run)).collect::<Vec<_>>();
        counts(&mut sets, &measures, |run| runs[run].label, speck)
    }

    /// The rows that share a side or an edge with a row and have lower numbers.
    fn rows_before(&self, row: usize) -> impl Iterator<Item = usize> {
        let shape = self.grid.shape;
        let place = coordinates(row * shape[0], shape);
        // the codes whose step along x is 0
        let codes = (1..HALF[D - 2]).step_by(3);
        codes.filter_map(move |code| Some(neighbour(place, shape, code)? / shape[0]))
    }

    /// The least length of a line through a sample on which all samples have its label, if it is less than `limit`: of
    /// the lines along axes and diagonals.
    fn thickness(&self, index: usize, limit: f64) -> Option<f64> {
        let lengths = (0..HALF[D - 2]).map(|code| {
            let ahead = self.reach(index, code, limit);
            ahead + self.reach(index, 2 * HALF[D - 2] - code, limit - ahead)
        });
        Some(lengths.fold(f64::INFINITY, f64::min)).filter(|&length| length < limit)
    }

    /// How far the label of a sample reaches toward the neighbour of that code, up to about `limit`: to half-way to the
    /// first sample of another label, or along an axis to the side of the box. A diagonal that ends at a side tells
    /// nothing of layers that end there too.
    fn reach(&self, index: usize, code: usize, limit: f64) -> f64 {
        let (shape, label) = (self.grid.shape, self.label(index));
        let along =
            |k: usize| ((code / 3_usize.pow(k as u32) % 3) as f64 - 1.0) * self.grid.step[k];
        let step = (0..D).map(|k| along(k).powi(2)).sum::<f64>().sqrt();
        let is_axis = (0..D).filter(|&k| along(k) != 0.0).count() == 1;
        let (mut place, mut reach) = (coordinates(index, shape), 0.0);
        while reach < limit {
            let Some(next) = neighbour(place, shape, code) else {
                return if is_axis { reach } else { f64::INFINITY };
            };
            if self.label(next) != label {
                return reach + 0.5 * step;
            }
            place = coordinates(next, shape);
            reach += step;
        }
        reach
    }
}

/// Joins the runs of two rows that are of one label and share a side, edge or corner.
fn join_touching(runs: &[Run], own: Range<usize>, others: Range<usize>, sets: &mut Sets) {
    let mut first = others.start;
    for at in own {
        let run = &runs[at];
        while first < others.end && runs[first].range.end < run.range.start {
            first += 1;
        }
        let touching = (first..others.end).take_while(|&o| runs[o].range.start <= run.range.end);
        for other in touching.filter(|&other| runs[other].label == run.label) {
            sets.join(at as u32, other as u32);
        }
    }
}

/// How many sets of a measure of at least `least` each label has.
fn counts(
    sets: &mut Sets,
    measures: &[f64],
    label: impl Fn(usize) -> i32,
    least: f64,
) -> BTreeMap<i32, usize> {
    let roots = sets.roots();
    let mut sums = vec![0.0; measures.len()];
    roots.iter().zip(measures).for_each(|(&root, measure)| sums[root as usize] += measure);
    let mut counts = BTreeMap::new();
    for (at, sum) in sums.into_iter().enumerate() {
        if roots[at] as usize == at && sum >= least {
            *counts.entry(label(at)).or_insert(0) += 1;
        }
    }
    counts
}

/// What cells have of a label.
#[derive(Clone, Copy, Default)]
struct InCells {
    measure: f64,
    /// How many parts are larger than a speck.
    parts: usize,
}

fn in_cells<const D: usize>(mesh: &Mesh<D>, labels: &[i32], speck: f64) -> BTreeMap<i32, InCells> {
    let mut sets = Sets::new(labels.len());
    for facet in mesh.facets() {
        if let Some(other) = facet.neighbour
            && labels[other as usize] == labels[facet.cell as usize]
        {
            sets.join(facet.cell, other);
        }
    }
    let measures: Vec<f64> = mesh.simplices().map(|cell| cell.measure().abs()).collect();
    let mut found: BTreeMap<i32, InCells> = BTreeMap::new();
    for (&label, measure) in labels.iter().zip(&measures) {
        found.entry(label).or_default().measure += measure;
    }
    for (label, parts) in counts(&mut sets, &measures, |cell| labels[cell], speck) {
        found.entry(label).or_default().parts = parts;
    }
    found
}

/// The labels of an image that come out broken or smaller in the cells of a mesh, because layers of theirs are too thin
/// for its nominal distance; those that no cell has are left out. `measures` are those of the image's labels.
pub(crate) fn thin_layers<const D: usize>(
    mesh: &Mesh<D>,
    labels: &[i32],
    image: LabelImage<'_, D>,
    measures: &BTreeMap<i32, f64>,
    distance: &NominalDistance<D>,
) -> Vec<ThinLayer> {
    let speck = SPECK * distance.mean().powi(D as i32);
    let cells = in_cells(mesh, labels, speck);
    let is_smaller =
        |label: &i32| cells[label].measure < (1.0 - NOTABLE) * measures.get(label).unwrap_or(&0.0);
    let suspect = |label: &i32| is_smaller(label) || cells[label].parts > 1;
    let suspects: BTreeSet<i32> =
        measures.keys().copied().filter(|l| cells.contains_key(l) && suspect(l)).collect();
    if suspects.is_empty() {
        return Vec::new();
    }
    let runs = image.runs(&suspects);
    let parts = image.parts(&runs, speck);
    let is_broken =
        |label: &i32| cells[label].parts > parts.get(label).copied().unwrap_or(0).max(1);
    let mut lost: BTreeMap<i32, Vec<&Run>> = BTreeMap::new();
    for run in runs.iter().filter(|run| is_smaller(&run.label) || is_broken(&run.label)) {
        lost.entry(run.label).or_default().push(run);
    }
    let layer = |(label, runs): (i32, Vec<&Run>)| {
        let thickness = thin_thickness(image, &runs, distance)?;
        Some(ThinLayer { label, thickness })
    };
    lost.into_iter().filter_map(layer).collect()
}

/// The median thickness of runs of samples where they are thin, if a notable share is.
fn thin_thickness<const D: usize>(
    image: LabelImage<'_, D>,
    runs: &[&Run],
    distance: &NominalDistance<D>,
) -> Option<f64> {
    let row = image.grid.shape[0];
    let samples = runs.iter().flat_map(|run| run.range.clone().map(|i| run.row * row + i));
    let every = runs.iter().map(|run| run.range.len()).sum::<usize>().div_ceil(PROBES);
    let probes: Vec<usize> = samples.step_by(every.max(1)).collect();
    let thickness =
        |&index: &usize| image.thickness(index, distance.at(&image.grid.position(index)));
    let mut thin: Vec<f64> = probes.iter().filter_map(thickness).collect();
    thin.sort_by(f64::total_cmp);
    let is_notable = thin.len() as f64 >= NOTABLE * probes.len() as f64;
    thin.get(thin.len() / 2).copied().filter(|_| is_notable)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image drawn in rows of digits, the labels; blanks have none.
    fn drawn(rows: &[&str]) -> (Grid<2>, Samples) {
        let shape = [rows[0].len(), rows.len()];
        let label = |c: char| c.to_digit(10).map_or(f64::NAN, f64::from);
        let samples = rows.iter().flat_map(|row| row.chars().map(label)).collect();
        (Grid { shape, step: [1.0, 2.0] }, Samples::F64(samples))
    }

    #[test]
    fn samples_measure_what_lies_in_the_box() {
        let (grid, samples) = drawn(&["1122", "1 22", "1333"]);
        let image = LabelImage { grid: &grid, samples: &samples };
        // columns ½, 1, 1 and ½ wide, rows 1, 2 and 1 high
        let expected = BTreeMap::from([(1, 0.5 + 1.0 + 1.0 + 0.5), (2, 1.5 + 3.0), (3, 2.5)]);
        assert_eq!(image.measures(), expected);
        let whole = Samples::I32(vec![7; 3 * 4 * 5].into());
        let grid = Grid { shape: [3, 4, 5], step: [1.0, 2.0, 0.5] };
        let image = LabelImage { grid: &grid, samples: &whole };
        assert_eq!(image.measures(), BTreeMap::from([(7, 2.0 * 6.0 * 2.0)]));
    }

    #[test]
    fn parts_touch_at_corners_and_specks_do_not_count() {
        let rows = ["1000010", "0100010", "0010010", "0001010", "1000000"];
        let (grid, samples) = drawn(&rows);
        let image = LabelImage { grid: &grid, samples: &samples };
        let runs = image.runs(&BTreeSet::from([0, 1]));
        // a slanted line, across whose corners 0 hangs together, an upright one, and a quarter of a sample, which measures ½
        assert_eq!(image.parts(&runs, 0.0), BTreeMap::from([(0, 1), (1, 3)]));
        assert_eq!(image.parts(&runs, 0.6), BTreeMap::from([(0, 1), (1, 2)]));
    }

    #[test]
    fn the_parts_of_a_volume_are_those_of_a_search() {
        let shape = [7, 6, 5];
        let grid = Grid { shape, step: [1.0; 3] };
        for seed in 0..20_u32 {
            let label =
                |i: u32| ((i + 1000 * seed).wrapping_mul(2_654_435_761) >> 20) as i32 % 7 / 5;
            let labels: Vec<i32> = (0..210).map(label).collect();
            let samples = Samples::I32(labels.clone().into());
            let image = LabelImage { grid: &grid, samples: &samples };
            let runs = image.runs(&BTreeSet::from([0, 1]));
            let mut expected = BTreeMap::new();
            let mut seen = [false; 210];
            for start in 0..210 {
                let mut open = vec![start];
                *expected.entry(labels[start]).or_insert(0) += usize::from(!seen[start]);
                while let Some(at) = open.pop() {
                    if !std::mem::replace(&mut seen[at], true) {
                        let place = coordinates(at, shape);
                        let around = (0..27).filter_map(|code| neighbour(place, shape, code));
                        open.extend(around.filter(|&other| labels[other] == labels[at]));
                    }
                }
            }
            assert_eq!(image.parts(&runs, 0.0), expected, "seed {seed}");
        }
    }

    #[test]
    fn a_layer_is_as_thick_as_the_shortest_line_across() {
        let rows = ["000000000", "111111111", "111111111", "000000000", "000000000"];
        let (grid, samples) = drawn(&rows);
        let image = LabelImage { grid: &grid, samples: &samples };
        // two rows, each 2 high; below them one and a half
        assert_eq!(image.thickness(2 * 9 + 4, 9.0), Some(4.0));
        assert_eq!(image.thickness(2 * 9, 9.0), Some(4.0));
        assert_eq!(image.thickness(2 * 9 + 4, 4.0), None);
        assert_eq!(image.thickness(4 * 9 + 4, 9.0), Some(3.0));
        let rows = ["100000", "010000", "001000", "000100"];
        let (grid, samples) = drawn(&rows);
        let image = LabelImage { grid: &Grid { step: [1.0; 2], ..grid }, samples: &samples };
        assert_eq!(image.thickness(6 + 1, 9.0), Some(1.0));
    }
}
