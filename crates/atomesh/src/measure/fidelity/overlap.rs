//! Sums over the samples in each cell, weighted by overlap as in [`crate::sample`], from the mesh's facets.
//!
//! Let f be an image that is constant in the box of each sample and 0 outside, and G its integral along axis 0 from the
//! image's side. By Gauss's theorem the integral of f over a cell is that of G over the cell's facets, seen along axis 0.
//! So each facet is cut into slabs across axis 2 and strips across axis 1, in each of which G depends on x alone; there it
//! is linear between the sides of boxes, and is integrated in closed form over triangles. A facet serves the cells on both
//! of its sides, and the sum of squares over the whole mesh asks for nothing but its boundary.
//!
//! A triangle of the plane is the prism of height one over it, as there. Planes of samples across axis 2 are handled in
//! parallel, and added up in their order: the same at any thread count.

use super::PlacedMesh;
use crate::geometry::Point;
use crate::measure::MeasureError;
use crate::measure::faces::faces;
use crate::measure::statistics::{sum, sums};
use crate::parallel::prelude::*;
use crate::sample::Axis;
use crate::watch::{Phase, Watch, check};

/// Planes of samples between two looks at the watch.
const PLANES_PER_STEP: usize = 64;
/// Cells of which this share or less has samples have none: it may be rounding.
const ROUNDING: f64 = 1e-9;
/// The most corners of a part of a facet: four, and one more for each of four cuts.
const MOST_CORNERS: usize = 8;

/// What is integrated: the samples, their squares, and 1 where there is one.
const FIELDS: usize = 3;

/// Sums over the samples in each cell; samples count by their difference from `origin`.
pub(super) struct CellSums {
    origin: f64,
    /// Σ w v of each cell.
    values: Vec<f64>,
    /// Σ w of each cell.
    weights: Vec<f64>,
    /// Σ w v² over all.
    squares: f64,
}

impl CellSums {
    /// Sums over the samples in each cell. Cost: O(area of facets).
    pub fn new<const D: usize>(
        placed: &PlacedMesh<'_, D>,
        watch: &mut dyn Watch,
    ) -> Result<Self, MeasureError> {
        let (facets, of_cells) = facets_of_cells(placed);
        let measures: Vec<f64> = placed.mesh.simplices().map(|simplex| simplex.measure()).collect();
        let finite = finite_mean(placed);
        let needs_weights = finite.1 < placed.samples.len() || !fills_no_more(placed);
        let image = Image { placed, axes: axes(placed.shape), origin: finite.0, needs_weights };
        let sides = net_sides(facets.len(), &of_cells, &measures);
        let found = Integrals::new(&image, &facets, &sides, watch)?;
        let of_cell = |cell: usize, of_facets: &[f64]| -> f64 {
            let own = of_cells[cell * (D + 1)..(cell + 1) * (D + 1)].iter();
            let sum: f64 = own.map(|side| side.sign() * of_facets[side.facet()]).sum();
            measures[cell].signum() * sum
        };
        let cells = (0..measures.len()).into_par_iter();
        let values = cells.clone().map(|cell| of_cell(cell, &found.values)).collect();
        let weight = |cell: usize| match needs_weights {
            true => of_cell(cell, &found.weights),
            false => measures[cell].abs(),
        };
        let is_some = |weight: f64, cell: usize| weight > ROUNDING * measures[cell].abs().min(1.0);
        let weights = cells.map(|cell| {
            let weight = weight(cell);
            if is_some(weight, cell) { weight } else { 0.0 }
        });
        Ok(Self { origin: finite.0, values, weights: weights.collect(), squares: found.squares })
    }

    /// Σ w, and Σ w (v − mean of the cell)².
    pub fn total_and_error(&self) -> [f64; 2] {
        let [total, explained] = sums(0..self.values.len(), &|i| {
            let (value, weight) = (self.values[i], self.weights[i]);
            [weight, if weight > 0.0 { value * value / weight } else { 0.0 }]
        });
        [total, self.squares - explained]
    }

    /// The mean of all samples; `total` is Σ w.
    pub fn mean(&self, total: f64) -> f64 {
        self.origin + sum(0..self.values.len(), &|i| self.values[i]) / total
    }

    /// The standard deviation of all samples; `total` is Σ w.
    pub fn deviation(&self, total: f64) -> f64 {
        let offset = self.mean(total) - self.origin;
        (self.squares / total - offset * offset).max(0.0).sqrt()
    }
}

/// One side of a facet: its number, and whether its corners in ascending order run as the cell has them.
#[derive(Clone, Copy)]
struct Side(u32);

impl Side {
    fn facet(self) -> usize {
        (self.0 >> 1) as usize
    }

    fn sign(self) -> f64 {
        if self.0 & 1 == 0 { 1.0 } else { -1.0 }
    }
}

/// The distinct facets, and for each cell its D + 1 sides.
fn facets_of_cells<const D: usize>(placed: &PlacedMesh<'_, D>) -> (Vec<[u32; D]>, Vec<Side>) {
    let mesh = placed.mesh;
    let facets = faces::<D, D>(mesh);
    let mut starts = vec![0_u32; mesh.points().len() + 1];
    facets.iter().for_each(|facet| starts[facet[0] as usize + 1] += 1);
    (0..mesh.points().len()).for_each(|point| starts[point + 1] += starts[point]);
    let side = |at: usize| {
        let mut corners = mesh.facet_of(at / (D + 1), at % (D + 1));
        let swaps = (0..D).flat_map(|j| (0..j).map(move |i| (i, j)));
        let turned = swaps.filter(|&(i, j)| corners[i] > corners[j]).count() % 2;
        corners.sort_unstable();
        let first = starts[corners[0] as usize] as usize;
        let led = &facets[first..starts[corners[0] as usize + 1] as usize];
        let place = led.binary_search(&corners).expect("each facet of a cell is a facet");
        Side(((first + place) as u32) << 1 | turned as u32)
    };
    let count = mesh.cell_count() * (D + 1);
    let sides = (0..count).into_par_iter().with_min_len(1 << 10).map(side).collect();
    (facets, sides)
}

/// The mean of the finite samples, and how many there are.
fn finite_mean<const D: usize>(placed: &PlacedMesh<'_, D>) -> (f64, usize) {
    let value = |i: usize| {
        let value = placed.samples.get(i);
        if value.is_finite() { [value, 1.0] } else { [0.0; 2] }
    };
    let [total, count] = sums(0..placed.samples.len(), &value);
    (if count > 0.0 { total / count } else { 0.0 }, count as usize)
}

/// Whether all points of the mesh lie in the image's box.
fn fills_no_more<const D: usize>(placed: &PlacedMesh<'_, D>) -> bool {
    let is_within = |p: &Point<D>| {
        (0..D).all(|k| (-ROUNDING..=(placed.shape[k] - 1) as f64 + ROUNDING).contains(&p[k]))
    };
    placed.mesh.points().par_iter().all(is_within)
}

/// The boxes of samples along x, y and z.
fn axes<const D: usize>(shape: [usize; D]) -> [Axis; 3] {
    std::array::from_fn(|k| shape.get(k).map_or(Axis::single(), |&count| Axis::of_samples(count)))
}

/// How often each facet bounds the whole mesh: 0 between two cells.
fn net_sides(count: usize, of_cells: &[Side], measures: &[f64]) -> Vec<f32> {
    let mut net = vec![0.0; count];
    let each = of_cells.len() / measures.len().max(1);
    for (at, side) in of_cells.iter().enumerate() {
        net[side.facet()] += (measures[at / each].signum() * side.sign()) as f32;
    }
    net
}

/// The image that is integrated.
struct Image<'a, const D: usize> {
    placed: &'a PlacedMesh<'a, D>,
    axes: [Axis; 3],
    /// Samples count by their difference from this.
    origin: f64,
    /// Whether the weights in cells are not simply their measures.
    needs_weights: bool,
}

/// A plane of samples across axis 2, row by row.
struct Plane {
    fields: [Field; FIELDS],
}

/// The values in a plane, and G at the lower sides of all boxes and at the last side of each row.
struct Field {
    values: Vec<f64>,
    integrals: Vec<f64>,
}

impl<const D: usize> Image<'_, D> {
    /// The samples of plane `z`.
    fn plane(&self, z: usize) -> Plane {
        let (width, height) = (self.axes[0].count, self.axes[1].count);
        let mut fields: [Vec<f64>; FIELDS] = std::array::from_fn(|_| Vec::new());
        for i in z * width * height..(z + 1) * width * height {
            let value = self.placed.samples.get(i) - self.origin;
            let (value, weight) = if value.is_finite() { (value, 1.0) } else { (0.0, 0.0) };
            fields[0].push(value);
            fields[1].push(value * value);
            fields[2].push(weight);
        }
        Plane { fields: fields.map(|values| self.field(values)) }
    }

    fn field(&self, values: Vec<f64>) -> Field {
        let axis = &self.axes[0];
        let mut integrals = Vec::with_capacity(values.len() + self.axes[1].count);
        for row in values.chunks_exact(axis.count) {
            let mut sum = 0.0;
            for (i, value) in row.iter().enumerate() {
                integrals.push(sum);
                sum += value * axis.width(i);
            }
            integrals.push(sum);
        }
        Field { values, integrals }
    }

    /// A facet, or in the plane a wall on it.
    fn polygon(&self, facet: &[u32; D]) -> Polygon {
        let place = |corner: u32, z: f64| -> Point<3> {
            let p = &self.placed.mesh.points()[corner as usize];
            std::array::from_fn(|k| p.get(k).copied().unwrap_or(z))
        };
        let mut polygon = Polygon::default();
        facet.iter().for_each(|&corner| polygon.push(&place(corner, 0.0)));
        if D == 2 {
            facet.iter().rev().for_each(|&corner| polygon.push(&place(corner, 1.0)));
        }
        polygon
    }
}

/// The integrals of G over facets.
struct Integrals {
    /// Of the samples.
    values: Vec<f64>,
    /// Of 1; empty if weights are measures.
    weights: Vec<f64>,
    /// Of squares of samples, over the boundary.
    squares: f64,
}

/// What one plane adds.
#[derive(Default)]
struct Found {
    facets: Vec<u32>,
    values: Vec<f64>,
    weights: Vec<f64>,
    squares: f64,
}

impl Integrals {
    fn new<const D: usize>(
        image: &Image<'_, D>,
        facets: &[[u32; D]],
        net: &[f32],
        watch: &mut dyn Watch,
    ) -> Result<Self, MeasureError> {
        let spans = Spans::new(image, facets);
        let weights = if image.needs_weights { facets.len() } else { 0 };
        let mut sums =
            Self { values: vec![0.0; facets.len()], weights: vec![0.0; weights], squares: 0.0 };
        let count = image.axes[2].count;
        for start in (0..count).step_by(PLANES_PER_STEP) {
            check(watch, Phase::Measure, 0.5 * start as f64 / count as f64, None)?;
            let planes = start..count.min(start + PLANES_PER_STEP);
            let found = planes.into_par_iter().map(|z| of_plane(image, facets, net, &spans, z));
            let found: Vec<Found> = found.collect();
            found.iter().for_each(|found| sums.add(found));
        }
        Ok(sums)
    }

    fn add(&mut self, found: &Found) {
        for (&facet, value) in found.facets.iter().zip(&found.values) {
            self.values[facet as usize] += value;
        }
        for (&facet, weight) in found.facets.iter().zip(&found.weights) {
            self.weights[facet as usize] += weight;
        }
        self.squares += found.squares;
    }
}

/// The planes that each facet reaches.
struct Spans {
    /// The last one.
    lasts: Vec<u32>,
    /// The facets by their first plane; those of plane z from `starts[z]` on.
    facets: Vec<u32>,
    starts: Vec<u32>,
    /// How many more planes than one a facet reaches at most.
    reach: usize,
}

impl Spans {
    fn new<const D: usize>(image: &Image<'_, D>, facets: &[[u32; D]]) -> Self {
        let axis = &image.axes[2];
        let span = |facet: &[u32; D]| -> Option<[u32; 2]> {
            let ends = image.polygon(facet).ends(2);
            let is_within = ends[1] > 0.0 && ends[0] < axis.end;
            is_within.then(|| ends.map(|end| axis.holding(end) as u32))
        };
        let spans: Vec<Option<[u32; 2]>> = facets.par_iter().map(span).collect();
        let mut starts = vec![0; axis.count + 1];
        spans.iter().flatten().for_each(|span| starts[span[0] as usize + 1] += 1);
        (0..axis.count).for_each(|z| starts[z + 1] += starts[z]);
        let mut next = starts.clone();
        let mut sorted = vec![0; starts[axis.count] as usize];
        for (facet, span) in spans.iter().enumerate() {
            let Some([first, _]) = span else { continue };
            sorted[next[*first as usize] as usize] = facet as u32;
            next[*first as usize] += 1;
        }
        let reach = spans.iter().flatten().map(|[first, last]| last - first).max().unwrap_or(0);
        let lasts = spans.iter().map(|span| span.map_or(0, |[_, last]| last)).collect();
        Self { lasts, facets: sorted, starts, reach: reach as usize }
    }

    /// The facets that reach plane `z`.
    fn at(&self, z: usize) -> impl Iterator<Item = u32> + '_ {
        let first = self.starts[z.saturating_sub(self.reach)] as usize;
        let all = &self.facets[first..self.starts[z + 1] as usize];
        all.iter().copied().filter(move |&facet| self.lasts[facet as usize] as usize >= z)
    }
}

/// The integrals over the parts of facets in plane `z`.
fn of_plane<const D: usize>(
    image: &Image<'_, D>,
    facets: &[[u32; D]],
    net: &[f32],
    spans: &Spans,
    z: usize,
) -> Found {
    let plane = image.plane(z);
    let axis = &image.axes[2];
    let mut found = Found::default();
    for facet in spans.at(z) {
        let slab =
            image.polygon(&facets[facet as usize]).between(2, axis.side(z), axis.side(z + 1));
        let net = f64::from(net[facet as usize]);
        let value = match (image.needs_weights, net != 0.0) {
            (true, _) => {
                let [value, square, weight] = plane.integrals(&image.axes, &slab);
                found.weights.push(weight);
                found.squares += net * square;
                value
            }
            (false, true) => {
                let [value, square] = plane.integrals(&image.axes, &slab);
                found.squares += net * square;
                value
            }
            (false, false) => {
                let [value] = plane.integrals(&image.axes, &slab);
                value
            }
        };
        found.facets.push(facet);
        found.values.push(value);
    }
    found
}

impl Plane {
    /// The integrals of G of the first `N` fields over a polygon within the plane's slab, seen along axis 0.
    fn integrals<const N: usize>(&self, axes: &[Axis; 3], slab: &Polygon) -> [f64; N] {
        let mut sums = [0.0; N];
        let ends = slab.ends(1);
        if slab.count < 3 || ends[1] <= 0.0 || ends[0] >= axes[1].end {
            return sums;
        }
        let (first, last) = (axes[1].holding(ends[0]), axes[1].holding(ends[1]));
        let [mut rest, mut below, mut above] = [Polygon::default(); 3];
        if ends[0] < 0.0 {
            slab.cut(1, 0.0, &mut below, &mut rest);
        } else {
            rest.copy(slab);
        }
        for y in first..=last {
            let side = axes[1].side(y + 1);
            let row = Row::<N>::of(self, &axes[0], y);
            if ends[1] <= side {
                row.add(&rest, &mut sums);
                break;
            }
            rest.cut(1, side, &mut below, &mut above);
            row.add(&below, &mut sums);
            std::mem::swap(&mut rest, &mut above);
        }
        sums
    }
}

/// A row of boxes, with the values and the integrals G of some fields.
struct Row<'a, const N: usize> {
    axis: &'a Axis,
    values: [&'a [f64]; N],
    integrals: [&'a [f64]; N],
}

impl<'a, const N: usize> Row<'a, N> {
    fn of(plane: &'a Plane, axis: &'a Axis, y: usize) -> Self {
        let count = axis.count;
        let fields = &plane.fields;
        Self {
            axis,
            values: std::array::from_fn(|n| &fields[n].values[y * count..(y + 1) * count]),
            integrals: std::array::from_fn(|n| {
                &fields[n].integrals[y * (count + 1)..(y + 1) * (count + 1)]
            }),
        }
    }

    /// Adds the integrals over a polygon that lies in the row.
    #[inline]
    fn add(&self, polygon: &Polygon, sums: &mut [f64; N]) {
        for k in 2..polygon.count {
            self.add_triangle([0, k - 1, k].map(|at| &polygon.corners[at]), sums);
        }
    }

    /// Adds the integrals over a triangle. Over it G is linear in x but for a bend at each side of a box: with the mean m
    /// of x and a bend by δ at s, ∫ G = area (G's first line at m + Σ δ mean of (x − s)₊).
    #[inline]
    fn add_triangle(&self, [a, b, c]: [&Point<3>; 3], sums: &mut [f64; N]) {
        let area = 0.5 * ((b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]));
        let beyond = Beyond::new(a[0], b[0], c[0]);
        let Beyond { low, high, mean, .. } = beyond;
        if area == 0.0 || high <= 0.0 {
            return;
        }
        let axis = self.axis;
        if low >= axis.end {
            (0..N).for_each(|n| sums[n] += area * self.integrals[n][axis.count]);
            return;
        }
        let first = axis.holding(low);
        if low >= 0.0 {
            let along = mean - axis.side(first);
            for n in 0..N {
                sums[n] += area * (self.integrals[n][first] + self.values[n][first] * along);
            }
        } else {
            let share = area * beyond.mean_beyond(0.0);
            (0..N).for_each(|n| sums[n] += share * self.values[n][0]);
        }
        for i in first + 1..axis.count {
            let side = axis.side(i);
            if side >= high {
                return;
            }
            let share = area * beyond.mean_beyond(side);
            (0..N).for_each(|n| sums[n] += share * (self.values[n][i] - self.values[n][i - 1]));
        }
        if axis.end < high {
            let share = area * beyond.mean_beyond(axis.end);
            (0..N).for_each(|n| sums[n] -= share * self.values[n][axis.count - 1]);
        }
    }
}

/// How x is spread over a triangle of which the corners' x are known: linearly up to the middle one, and down again.
struct Beyond {
    low: f64,
    middle: f64,
    high: f64,
    mean: f64,
    /// 1 / (3 (high − low)), over (middle − low) and over (high − middle).
    scales: [f64; 2],
}

impl Beyond {
    #[inline]
    fn new(a: f64, b: f64, c: f64) -> Self {
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let middle = a.max(b).min(a.min(b).max(c));
        let third = 1.0 / (3.0 * (high - low));
        let scales = [third / (middle - low), third / (high - middle)];
        Self { low, middle, high, mean: (a + b + c) / 3.0, scales }
    }

    /// The mean of (x − s)₊ over the triangle, for s between low and high.
    #[inline]
    fn mean_beyond(&self, s: f64) -> f64 {
        if s < self.middle {
            self.mean - s + (s - self.low).powi(3) * self.scales[0]
        } else {
            (self.high - s).powi(3) * self.scales[1]
        }
    }
}

/// A convex polygon in space.
#[derive(Clone, Copy)]
struct Polygon {
    corners: [Point<3>; MOST_CORNERS],
    count: usize,
}

impl Default for Polygon {
    fn default() -> Self {
        Self { corners: [[0.0; 3]; MOST_CORNERS], count: 0 }
    }
}

impl Polygon {
    #[inline]
    fn push(&mut self, corner: &Point<3>) {
        self.corners[self.count] = *corner;
        self.count += 1;
    }

    /// The least and the greatest coordinate along an axis.
    #[inline]
    fn ends(&self, axis: usize) -> [f64; 2] {
        let corners = self.corners[..self.count].iter();
        corners.fold([f64::INFINITY, f64::NEG_INFINITY], |[min, max], p| {
            [min.min(p[axis]), max.max(p[axis])]
        })
    }

    /// The part between two planes across an axis.
    #[inline]
    fn between(&self, axis: usize, low: f64, high: f64) -> Self {
        let [min, max] = self.ends(axis);
        let [mut above, mut within, mut rest] = [Self::default(); 3];
        if min < low {
            self.cut(axis, low, &mut rest, &mut above);
        } else {
            above.copy(self);
        }
        if max <= high {
            return above;
        }
        above.cut(axis, high, &mut within, &mut rest);
        within
    }

    /// Makes the parts below and above a plane across an axis, each empty or closed by a side in the plane. An edge crosses the
    /// plane at the same point from whichever end it is followed.
    #[inline]
    fn cut(&self, axis: usize, at: f64, below: &mut Self, above: &mut Self) {
        (below.count, above.count) = (0, 0);
        let corners = &self.corners[..self.count];
        let Some(mut a) = corners.last() else { return };
        for b in corners {
            let (from, to) = (a[axis], b[axis]);
            if (from < at && to > at) || (from > at && to < at) {
                let (low, high) = if from < to { (a, b) } else { (b, a) };
                let share = (at - low[axis]) / (high[axis] - low[axis]);
                let mut crossing: Point<3> =
                    std::array::from_fn(|k| low[k] + share * (high[k] - low[k]));
                crossing[axis] = at;
                below.push(&crossing);
                above.push(&crossing);
            }
            if to <= at {
                below.push(b);
            }
            if to >= at {
                above.push(b);
            }
            a = b;
        }
    }

    #[inline]
    fn copy(&mut self, other: &Self) {
        self.count = other.count;
        self.corners[..other.count].copy_from_slice(&other.corners[..other.count]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_beyond_a_place_is_that_of_many_points() {
        let xs = [0.3, 2.1, 1.2];
        let beyond = Beyond::new(xs[0], xs[1], xs[2]);
        assert_eq!((beyond.low, beyond.middle, beyond.high), (0.3, 1.2, 2.1));
        let parts = 400;
        for s in [0.31, 0.9, 1.2, 1.7, 2.09] {
            let (mut sum, mut count) = (0.0, 0.0);
            for i in 0..parts {
                for j in 0..parts - i {
                    let [u, v] = [i, j].map(|n| (f64::from(n) + 1.0 / 3.0) / f64::from(parts));
                    sum += (u * xs[0] + v * xs[1] + (1.0 - u - v) * xs[2] - s).max(0.0);
                    count += 1.0;
                }
            }
            // points are 1/400 of 1.8 apart
            assert!((beyond.mean_beyond(s) - sum / count).abs() < 5e-3, "{s}");
        }
    }
}
