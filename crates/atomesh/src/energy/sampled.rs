//! The sampled engine: Algorithm 1 to the letter.
//!
//! The total potential field p(x) of equation (5) is accumulated on the image's own samples from
//! tabulated potentials; P is read at the sample nearest to each atom, equation (6), and its gradient by
//! centred differences. Cost: O(N) in image samples, some 8N additions in the plane and 20N in space.
//!
//! Energy and gradient do not quite belong together: the energy is constant within a sample. Atoms count
//! as if at their nearest samples, so the error against the double sum is of first order in 1/d, d in
//! samples. In a lattice at d = 8 that of the gradient, times d, is 0.1, and half as much at d = 16; that of
//! an atom's energy is 0.004 or less, since errors of neighbouring pairs cancel in part. Atoms on the image's
//! boundary feel their own tables along its normal, where differences are one-sided.

use std::ops::Range;

use crate::parallel::prelude::*;

use crate::fields::{FieldsView, NominalDistance, centred_difference};
use crate::geometry::Point;
use crate::image::Grid;

use super::engine::{Energy, Engine};
use super::pair;

/// Nominal distances of neighbouring tables differ by this ratio.
const TABLE_RATIO: f64 = 1.02;
/// Samples, at the most but for one plane, that one thread fills at a time: what its cache holds.
const SLAB: usize = 1 << 17;
/// Rows of a table are filled up with zeros to multiples of so many samples.
const LANES: usize = 8;

/// φ(|x|/d) on samples around an atom: rows along x, each for one offset along the other axes, ordered by
/// the offset along the last axis.
struct Table<const D: usize> {
    rows: Vec<Row<D>>,
    spans: Vec<Span>,
    /// Where the rows of each offset along the last axis start.
    planes: Vec<usize>,
    values: Vec<f32>,
    /// The farthest offset along each axis, and along x that with the zeros.
    reach: [isize; D],
    padded: isize,
}

struct Row<const D: usize> {
    /// The offset of the row's first sample.
    offset: [isize; D],
    values: Range<usize>,
}

/// A row as the inner loop reads it.
struct Span {
    /// The offset of the row's first sample in memory.
    offset: isize,
    /// Its first value, and how many [`LANES`] of them there are with the zeros.
    start: u32,
    count: u32,
}

/// How far φ reaches along each axis, in samples, within an image.
fn reach<const D: usize>(distance: f64, grid: &Grid<D>) -> [isize; D] {
    let radius = pair::CUTOFF * distance;
    let within =
        |k: usize| ((radius / grid.step[k]).floor() as isize).min(grid.shape[k] as isize - 1);
    std::array::from_fn(within)
}

/// The distances that φ is tabulated for.
fn tabulated<const D: usize>(distance: &NominalDistance<D>) -> impl Iterator<Item = f64> {
    let (least, greatest) = (distance.least(), distance.greatest());
    let count = ((greatest / least).ln() / TABLE_RATIO.ln()).ceil() as usize + 1;
    (0..count).map(move |t| (least * TABLE_RATIO.powi(t as i32)).min(greatest))
}

/// About how many bytes the tables of the sampled engine take: the boxes around all.
pub(crate) fn table_bytes<const D: usize>(grid: &Grid<D>, distance: &NominalDistance<D>) -> f64 {
    let samples = |d: f64| -> f64 { reach(d, grid).iter().map(|&r| (2 * r + 1) as f64).product() };
    4.0 * tabulated(distance).map(samples).sum::<f64>()
}

impl<const D: usize> Table<D> {
    fn new(distance: f64, grid: &Grid<D>) -> Self {
        let (step, strides) = (&grid.step, grid.strides());
        let radius = pair::CUTOFF * distance;
        let reach = reach(distance, grid);
        let padded = reach[0] + LANES as isize;
        let mut table = Self {
            rows: Vec::new(),
            spans: Vec::new(),
            planes: vec![0],
            values: Vec::new(),
            reach,
            padded,
        };
        let row_count: isize = reach[1..].iter().map(|r| 2 * r + 1).product();
        let mut plane = -reach[D - 1];
        for row in 0..row_count {
            let mut offset = [0; D];
            let mut rest = row;
            for k in 1..D {
                offset[k] = rest % (2 * reach[k] + 1) - reach[k];
                rest /= 2 * reach[k] + 1;
            }
            if offset[D - 1] > plane {
                plane = offset[D - 1];
                table.planes.push(table.rows.len());
            }
            let beside: f64 = (1..D).map(|k| (offset[k] as f64 * step[k]).powi(2)).sum();
            let half = radius * radius - beside;
            if half < 0.0 {
                continue;
            }
            let half = ((half.sqrt() / step[0]).floor() as isize).min(reach[0]);
            offset[0] = -half;
            let start = table.values.len();
            table.values.extend((-half..=half).map(|i| {
                let r = (beside + (i as f64 * step[0]).powi(2)).sqrt();
                pair::energy(r / distance) as f32
            }));
            let values = start..table.values.len();
            let count = values.len().div_ceil(LANES);
            table.values.resize(start + count * LANES, 0.0);
            let linear = (0..D).map(|k| offset[k] * strides[k] as isize).sum();
            table.spans.push(Span { offset: linear, start: start as u32, count: count as u32 });
            table.rows.push(Row { offset, values });
        }
        table.planes.push(table.rows.len());
        table
    }

    /// The rows at these offsets along the last axis, as far as there are any.
    fn rows_of(&self, from: isize, to: isize) -> Range<usize> {
        let reach = self.reach[D - 1];
        let (from, to) = (from.max(-reach) + reach, to.min(reach + 1) + reach);
        if from < to { self.planes[from as usize]..self.planes[to as usize] } else { 0..0 }
    }
}

/// Atoms that one thread reads the field for at a time.
const CHUNK: usize = 2048;

/// The engine that accumulates the total potential field on the image's samples.
///
/// Source: Hale (2001), algorithm 1. Departure: the atom's own φ(0), which moves nothing, is left out.
pub struct SampledEngine<'a, const D: usize> {
    fields: FieldsView<'a, D>,
    tables: Vec<Table<D>>,
    field: Vec<f32>,
    distances: Vec<f64>,
}

impl<'a, const D: usize> SampledEngine<'a, D> {
    /// An engine for atoms in these fields; tabulates φ for the nominal distances there are.
    pub fn new(fields: FieldsView<'a, D>) -> Self {
        let FieldsView { potential, distance, .. } = fields;
        let grid = potential.grid();
        let distances: Vec<f64> = tabulated(distance).collect();
        let tables = distances.into_par_iter().map(|d| Table::new(d, grid)).collect();
        Self { fields, tables, field: Vec::new(), distances: Vec::new() }
    }

    /// The total potential field p(x) of equation (5), x fastest, as of the last evaluation: what the
    /// paper's Figures 6 and 7 show.
    pub fn field(&self) -> &[f32] {
        &self.field
    }

    fn table_of(&self, atom: &Point<D>) -> usize {
        if self.tables.len() == 1 {
            return 0;
        }
        let t =
            (self.fields.distance.at(atom) / self.fields.distance.least()).ln() / TABLE_RATIO.ln();
        (t.round() as usize).min(self.tables.len() - 1)
    }

    /// Fills one slab of the field: β b, then every atom's table rows that fall into it, in order.
    fn fill(&self, slab: &mut [f32], first_plane: usize, atoms: &Centres<D>) {
        let grid = self.fields.potential.grid();
        let plane: usize = grid.shape[..D - 1].iter().product();
        let planes = slab.len() / plane;
        let start = first_plane * plane;
        let b = &self.fields.potential.samples()[start..start + slab.len()];
        match self.fields.weight.as_constant() {
            Some(beta) => {
                slab.iter_mut().zip(b).for_each(|(p, b)| *p = beta as f32 * b);
            }
            None => {
                for (i, (p, b)) in slab.iter_mut().zip(b).enumerate() {
                    *p = self.fields.weight.at(&grid.position(start + i)) as f32 * b;
                }
            }
        }
        for atom in atoms.near(first_plane, planes) {
            let table = &self.tables[atom.table as usize];
            let from = first_plane as isize - atom.index[D - 1] as isize;
            let rows = table.rows_of(from, from + planes as isize);
            if atom.is_inside(table, &grid.shape) {
                let centre: usize =
                    (0..D).map(|k| atom.index[k] as usize * grid.strides()[k]).sum();
                let (centre, spans) = (centre as isize - start as isize, &table.spans[rows]);
                add_whole_rows(slab, centre, atom.weight, spans, &table.values);
            } else {
                for row in &table.rows[rows] {
                    self.add_row(slab, first_plane, atom, row, &table.values[row.values.clone()]);
                }
            }
        }
    }

    /// Energy and gradient of some atoms: equation (6), and centred differences.
    fn read(
        &self,
        field: &[f32],
        centres: &[Centre<D>],
        atoms: &[Point<D>],
        gradient: &mut [Point<D>],
    ) -> Energy {
        let grid = self.fields.potential.grid();
        let strides = grid.strides();
        let own = pair::SELF_ENERGY as f32;
        let mut energy = Energy::default();
        for ((centre, atom), g) in centres.iter().zip(atoms).zip(gradient) {
            let at: usize = (0..D).map(|k| centre.index[k] as usize * strides[k]).sum();
            let image =
                self.fields.weight.at(atom) * f64::from(self.fields.potential.samples()[at]);
            let atomic = f64::from(field[at]) - f64::from(centre.weight * own) - image;
            energy.image += image;
            energy.atomic += 0.5 * atomic;
            for k in 0..D {
                let index = centre.index[k] as usize;
                let slope = centred_difference(field, at, index, grid.shape[k], strides[k]);
                g[k] = slope / grid.step[k];
            }
        }
        energy
    }

    /// Adds one row of an atom's table, cut to the image and the slab.
    #[inline]
    fn add_row(
        &self,
        slab: &mut [f32],
        first_plane: usize,
        atom: &Centre<D>,
        row: &Row<D>,
        values: &[f32],
    ) {
        let grid = self.fields.potential.grid();
        let plane: usize = grid.shape[..D - 1].iter().product();
        let planes = (slab.len() / plane) as isize;
        let mut at = 0isize;
        let mut stride = grid.shape[0] as isize;
        for k in 1..D {
            let mut i = atom.index[k] as isize + row.offset[k];
            let mut count = grid.shape[k] as isize;
            if k == D - 1 {
                i -= first_plane as isize;
                count = planes;
            }
            if i < 0 || i >= count {
                return;
            }
            at += i * stride;
            stride *= grid.shape[k] as isize;
        }
        let from = atom.index[0] as isize + row.offset[0];
        let cut = (-from).max(0);
        let end = (from + values.len() as isize).min(grid.shape[0] as isize);
        if from + cut >= end {
            return;
        }
        let target = &mut slab[(at + from + cut) as usize..(at + end) as usize];
        let values = &values[cut as usize..];
        target.iter_mut().zip(values).for_each(|(p, v)| *p += atom.weight * v);
    }
}

/// Adds rows of a table around a centre: none of them leaves the image's rows, nor the slab but by zeros.
#[inline]
fn add_whole_rows(slab: &mut [f32], centre: isize, weight: f32, spans: &[Span], values: &[f32]) {
    for span in spans {
        let values = values[span.start as usize..].as_chunks::<LANES>().0;
        let target = &mut slab[(centre + span.offset) as usize..];
        let whole = target.as_chunks_mut::<LANES>().0;
        let count = span.count as usize;
        if whole.len() < count {
            // the slab's last row ends before the zeros do
            let values = values[..count].as_flattened();
            target.iter_mut().zip(values).for_each(|(p, v)| *p += weight * v);
            continue;
        }
        for (target, values) in whole[..count].iter_mut().zip(values) {
            for l in 0..LANES {
                target[l] += weight * values[l];
            }
        }
    }
}

/// An atom at its nearest sample.
#[derive(Clone, Copy)]
struct Centre<const D: usize> {
    index: [u32; D],
    table: u32,
    /// 1 − β at the atom.
    weight: f32,
}

impl<const D: usize> Centre<D> {
    /// Whether the table's rows end within the image's, but for the last axis.
    fn is_inside(&self, table: &Table<D>, shape: &[usize; D]) -> bool {
        (0..D - 1).all(|k| {
            let (at, reach) = (self.index[k] as isize, table.reach[k]);
            let beyond = if k == 0 { table.padded } else { reach };
            at >= reach && at + beyond < shape[k] as isize
        })
    }
}

/// The atoms by the plane of their nearest sample.
struct Centres<const D: usize> {
    sorted: Vec<Centre<D>>,
    /// Where each plane's atoms start.
    starts: Vec<usize>,
    reach: usize,
}

impl<const D: usize> Centres<D> {
    /// Counting sort: atoms of a plane keep their order.
    fn new(centres: &[Centre<D>], planes: usize, reach: usize) -> Self {
        let mut starts = vec![0; planes + 1];
        centres.iter().for_each(|c| starts[c.index[D - 1] as usize + 1] += 1);
        (0..planes).for_each(|plane| starts[plane + 1] += starts[plane]);
        let mut next = starts.clone();
        let mut sorted = centres.to_vec();
        for c in centres {
            let at = &mut next[c.index[D - 1] as usize];
            sorted[*at] = *c;
            *at += 1;
        }
        Self { sorted, starts, reach }
    }

    /// The atoms whose tables may reach the given planes.
    fn near(&self, first: usize, count: usize) -> &[Centre<D>] {
        let last = (first + count + self.reach).min(self.starts.len() - 1);
        &self.sorted[self.starts[first.saturating_sub(self.reach)]..self.starts[last]]
    }
}

impl<const D: usize> Engine<D> for SampledEngine<'_, D> {
    fn prepare(&mut self, atoms: &[Point<D>], _next_move: f64) -> bool {
        // The field is made again at every evaluation; only the caller's view of d is refreshed here.
        let first = self.distances.len() != atoms.len();
        let distance = self.fields.distance;
        atoms.par_iter().map(|p| distance.at(p)).collect_into_vec(&mut self.distances);
        first
    }

    fn evaluate(&mut self, atoms: &[Point<D>], gradient: &mut [Point<D>]) -> Energy {
        let grid = *self.fields.potential.grid();
        let centres: Vec<Centre<D>> = atoms
            .par_iter()
            .map(|p| Centre {
                index: std::array::from_fn(|k| {
                    ((p[k] / grid.step[k] + 0.5) as usize).min(grid.shape[k] - 1) as u32
                }),
                table: self.table_of(p) as u32,
                weight: 1.0 - self.fields.weight.at(p) as f32,
            })
            .collect();
        let reach = self.tables.iter().map(|t| t.reach[D - 1]).max().unwrap_or(0) as usize;
        let sorted = Centres::new(&centres, grid.shape[D - 1], reach);
        let mut field = std::mem::take(&mut self.field);
        field.resize(grid.sample_count(), 0.0);
        let plane: usize = grid.shape[..D - 1].iter().product();
        let planes = (SLAB / plane).max(1);
        field
            .par_chunks_mut(planes * plane)
            .enumerate()
            .for_each(|(s, slab)| self.fill(slab, s * planes, &sorted));
        let parts: Vec<Energy> = gradient
            .par_chunks_mut(CHUNK)
            .enumerate()
            .map(|(c, gradient)| {
                let members = c * CHUNK..c * CHUNK + gradient.len();
                self.read(&field, &centres[members.clone()], &atoms[members], gradient)
            })
            .collect();
        self.field = field;
        parts.into_iter().sum()
    }

    fn distances(&self) -> &[f64] {
        &self.distances
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fields::{Fields, ImageWeight, Interpolation, ScalarField};

    #[test]
    fn tables_end_where_the_image_does() {
        let grid = Grid { shape: [60, 6], step: [1.0; 2] };
        let fields = |distance: f64| {
            let potential =
                ScalarField::potential(grid, vec![0.0; 360], Interpolation::Linear).unwrap();
            let distance = NominalDistance::constant(&grid, distance).unwrap();
            Fields::new(potential, ImageWeight::constant(0.5).unwrap(), distance).unwrap()
        };
        let far = fields(1e4);
        // rows from −59 to 59, filled up to 120, at 11 offsets along y
        let engine = SampledEngine::new(far.view());
        assert_eq!(engine.tables[0].values.len(), 11 * 120);
        assert_eq!(table_bytes(&grid, far.view().distance), 4.0 * 11.0 * 119.0);
        // a table that ends within the image is as it was
        let near = fields(3.0);
        let whole = SampledEngine::new(near.view());
        assert_eq!(whole.tables[0].reach, [4, 4]);
    }
}
