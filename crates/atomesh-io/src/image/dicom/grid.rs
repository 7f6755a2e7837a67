//! Where the samples of a series are: the grid of slices that stand straight, and what puts others onto one.
//!
//! Slices of a tilted gantry stand beside each other: each is sampled anew where the grid at right angles has its samples,
//! linearly along x and y. Slices that stand nearly evenly are then sampled anew at even places, linearly between
//! neighbours. Labels take the nearest sample instead. What no slice covers has no data.

use atomesh::geometry::dot;

use super::super::affine::Affine;
use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::super::note::ReadNote;
use super::super::options::GivenFrame;
use super::super::scan_note::ScanNote;
use super::series::{Series, normal};

/// The greatest lean of slices that gives way to the nearest axes at right angles, 0.1 degrees.
const STRAIGHT: f64 = 1.75e-3;

/// The greatest displacement in samples that is left as it is.
const BESIDE: f64 = 0.5;

/// The same of slices that are not in line with the others.
const OUT_OF_LINE: f64 = 0.1;

/// The greatest lean that is resampled, 45 degrees: gantries tilt by 30.
const STEEPEST: f64 = 1.0;

/// The most samples that the grid may have along an axis for each sample of a slice.
const WIDEST: f64 = 8.0;

/// The grid of a series.
pub(super) struct Grid {
    /// Sample indices to the world of the file.
    pub affine: Affine,
    /// Samples along x, y and z.
    pub shape: [usize; 3],
    /// How slices are put onto it, if they do not stand on it.
    pub resampling: Option<Resampling>,
    pub note: Option<ReadNote>,
}

impl Grid {
    /// The grid of slices of a shape. A spacing or directions that the caller gives are left to the caller.
    pub fn of(
        series: &Series,
        [nx, ny]: [usize; 2],
        given: GivenFrame,
    ) -> Result<Self, ReadReason> {
        let head = &series.slices[0].plane;
        let count = series.rungs.as_ref().map_or(series.slices.len(), |(_, count)| *count);
        let [sx, sy] = head.spacing.unwrap_or([1.0; 2]);
        let [x, y] = series.axes.unwrap_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let matrix = |x: [f64; 3], y: [f64; 3], step: [f64; 3]| {
            std::array::from_fn(|r| [x[r] * sx, y[r] * sy, step[r]])
        };
        let origin = head.position.unwrap_or_default();
        let straight = Self {
            affine: Affine { matrix: matrix(x, y, series.step), origin },
            shape: [nx, ny, count],
            resampling: None,
            note: None,
        };
        let is_placed = series.slices.iter().all(|slice| slice.plane.position.is_some());
        let is_known = head.spacing.is_some() && series.axes.is_some() && is_placed;
        if !is_known || given.direction {
            return Ok(straight.evened(series, [nx, ny]));
        }
        let normal = normal([x, y]);
        let across = cross(normal, x);
        let places: Vec<[f64; 2]> = series
            .slices
            .iter()
            .map(|slice| {
                let position = slice.plane.position.unwrap_or_default();
                let from: [f64; 3] = std::array::from_fn(|r| position[r] - origin[r]);
                [dot(&from, &x) / sx, dot(&from, &across) / sy]
            })
            .collect();
        let (first, last) = (series.heights[0], series.heights[series.heights.len() - 1]);
        let end = places[places.len() - 1];
        let lean = (end[0] * sx).hypot(end[1] * sy) / (last - first);
        let most = places.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        let beside = places.iter().zip(&series.heights).fold(0.0, |m: f64, (place, height)| {
            let share = (height - first) / (last - first);
            m.max((place[0] - share * end[0]).abs()).max((place[1] - share * end[1]).abs())
        });
        if lean <= STRAIGHT && most <= BESIDE && beside <= OUT_OF_LINE {
            return Ok(straight.evened(series, [nx, ny]));
        }
        let steep = ReadReason::Sheared {
            first: if end[0].abs() > end[1].abs() { 0 } else { 1 },
            second: 2,
            degrees: 90.0 - lean.atan().to_degrees(),
        };
        let mut resampling = Resampling::new(series, [nx, ny], places);
        let [mx, my] = resampling.shape;
        if lean.is_nan()
            || lean > STEEPEST
            || series.rungs.is_some()
            || resampling.is_wider_than(WIDEST)
        {
            return Err(steep);
        }
        let [i, j] = resampling.first;
        let step = normal.map(|n| n * (last - first) / (count - 1) as f64);
        let origin = std::array::from_fn(|r| origin[r] + i * sx * x[r] + j * sy * across[r]);
        resampling.is_even = !series.is_uneven;
        let note = match beside <= OUT_OF_LINE {
            true => ScanNote::GantryTilt {
                degrees: lean.atan().to_degrees(),
                before: [nx, ny],
                after: [mx, my],
            },
            false => ScanNote::Shifted { most },
        };
        Ok(Self {
            affine: Affine { matrix: matrix(x, across, step), origin },
            shape: [mx, my, count],
            resampling: Some(resampling),
            note: Some(note.into()),
        })
    }

    /// The same with slices at even places.
    fn evened(self, series: &Series, shape: [usize; 2]) -> Self {
        let places = || vec![[0.0; 2]; series.slices.len()];
        let resampling = series.is_uneven.then(|| Resampling::new(series, shape, places()));
        Self { resampling, ..self }
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// How slices are put onto a grid.
pub(super) struct Resampling {
    /// Samples along x and y of a slice as it is stored.
    before: [usize; 2],
    /// The same on the grid.
    pub shape: [usize; 2],
    /// The grid's first sample, in samples from that of the first slice.
    pub first: [f64; 2],
    /// The first sample of each slice, counted so.
    places: Vec<[f64; 2]>,
    /// The place of each slice along the normal.
    heights: Vec<f64>,
    /// Whether these are even.
    is_even: bool,
    /// Whether values are labels, of which there is nothing in between.
    pub is_nearest: bool,
}

impl Resampling {
    fn new(series: &Series, before: [usize; 2], places: Vec<[f64; 2]>) -> Self {
        let least = |k: usize| places.iter().fold(0.0, |m: f64, place| m.min(place[k])).floor();
        let greatest = |k: usize| places.iter().fold(0.0, |m: f64, place| m.max(place[k])).ceil();
        let first = [0, 1].map(least);
        let shape = [0, 1].map(|k| {
            let more = greatest(k) - first[k];
            before[k].saturating_add(more as usize)
        });
        let heights = series.heights.clone();
        Self { before, shape, first, places, heights, is_even: false, is_nearest: false }
    }

    fn is_wider_than(&self, ratio: f64) -> bool {
        (0..2).any(|k| self.shape[k] as f64 > ratio * (self.before[k] as f64 + 8.0))
    }

    /// The samples of all slices on the grid, NaN where there is none. `slice` gives those of a slice.
    pub fn resample(
        &self,
        slice: &mut dyn FnMut(usize) -> Result<Vec<f32>, ReadReason>,
        memory: Memory,
    ) -> Result<Vec<f32>, ReadReason> {
        let count = self.shape[0].saturating_mul(self.shape[1]);
        let slices = self.heights.len();
        let mut samples = Vec::new();
        memory.reserve(&mut samples, count.saturating_mul(slices))?;
        if self.is_even {
            for k in 0..slices {
                samples.extend(self.put(k, &slice(k)?, memory)?);
            }
            return Ok(samples);
        }
        // slices are nearly even, so that two are enough at a time
        let (first, last) = (self.heights[0], self.heights[slices - 1]);
        let mut held: Vec<(usize, Vec<f32>)> = Vec::new();
        for k in 0..slices {
            let height = first + (last - first) * k as f64 / (slices - 1) as f64;
            let after = self.heights.partition_point(|&h| h < height).clamp(1, slices - 1);
            let before = after - 1;
            let gap = self.heights[after] - self.heights[before];
            let share = ((height - self.heights[before]) / gap).clamp(0.0, 1.0) as f32;
            held.retain(|(which, _)| (before..=after).contains(which));
            for which in before..=after {
                if held.iter().all(|(held, _)| *held != which) {
                    held.push((which, self.put(which, &slice(which)?, memory)?));
                }
            }
            held.sort_by_key(|(which, _)| *which);
            let [(_, below), (_, above)] = &held[..] else { continue };
            let between = below.iter().zip(above).map(|(a, b)| match (share, self.is_nearest) {
                (0.0, _) => *a,
                (1.0, _) => *b,
                (_, true) => *if share < 0.5 { a } else { b },
                (_, false) => a + share * (b - a),
            });
            samples.extend(between);
        }
        Ok(samples)
    }

    /// A slice on the grid.
    fn put(&self, k: usize, slice: &[f32], memory: Memory) -> Result<Vec<f32>, ReadReason> {
        let [mx, my] = self.shape;
        let mut out = Vec::new();
        memory.reserve(&mut out, mx * my)?;
        let along: [Vec<Option<Between>>; 2] = [0, 1].map(|axis| {
            let place = |index| index as f64 + self.first[axis] - self.places[k][axis];
            let between = |index| Between::of(place(index), self.before[axis], self.is_nearest);
            (0..self.shape[axis]).map(between).collect()
        });
        for row in &along[1] {
            for column in &along[0] {
                out.push(match (column, row) {
                    (Some(column), Some(row)) => {
                        let in_row = |y: usize| column.value(|x| slice[x + self.before[0] * y]);
                        row.value(in_row)
                    }
                    _ => f32::NAN,
                });
            }
        }
        Ok(out)
    }
}

/// A place between two samples.
#[derive(Clone, Copy)]
struct Between {
    before: usize,
    /// How much of the sample after it counts, below 1.
    share: f32,
}

impl Between {
    /// A place among so many samples, if it is there.
    fn of(place: f64, count: usize, is_nearest: bool) -> Option<Self> {
        // as far as rounding of positions goes
        let nearest = place.round();
        let place = if is_nearest || (place - nearest).abs() < 1e-3 { nearest } else { place };
        if !(0.0..=(count - 1) as f64).contains(&place) {
            return None;
        }
        let before = place.floor();
        Some(Self { before: before as usize, share: (place - before) as f32 })
    }

    fn value(self, sample: impl Fn(usize) -> f32) -> f32 {
        let value = sample(self.before);
        if self.share == 0.0 {
            value
        } else {
            value + self.share * (sample(self.before + 1) - value)
        }
    }
}
