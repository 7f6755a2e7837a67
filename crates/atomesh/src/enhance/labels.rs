//! The interfaces of a label image as valleys of one depth and width.
//!
//! With m the share of a label around a place (a Gaussian over the label's samples), 1 − Σ m² is 0 within a
//! label and ½ on a straight interface of two. Twice that, clipped to 1, is the valley, whatever numbers the
//! labels have. Each label is smoothed in its own box, and the largest not at all: its share is the rest.

use std::collections::HashMap;

use crate::parallel::prelude::*;

use crate::crests::FeaturePoint;
use crate::geometry::{Point, dot};
use crate::image::{Grid, Image, coordinates, gaussian};
use crate::watch::{Phase, Watch, check};

use super::{EnhanceError, Enhanced, FeatureOptions};

/// Where a Gaussian ends, in standard deviations.
const REACH: f64 = 4.0;

/// The most samples in the boxes of all labels, over the image's: grey values lie all over it.
const MOST_BOXES: f64 = 500.0;

/// The potential of a label image: valleys of one depth where labels meet.
pub(super) fn labelled<const D: usize>(
    image: &Image<D>,
    options: &FeatureOptions,
    watch: &mut dyn Watch,
) -> Result<Enhanced<D>, EnhanceError> {
    let grid = image.frame().grid(options.units);
    let labels = image.samples().to_f32();
    let sigma = grid.step.map(|step| (options.edge_scale * grid.least_step() / step).max(0.7));
    let valleys = interfaces(&labels, &grid, sigma, watch)?;
    let constant = valleys.is_none();
    let mut values = valleys.unwrap_or_else(|| vec![0.0; labels.len()]);
    let sign = if options.repel { 1.0 } else { -1.0 };
    let sigma = options.sigma(&grid);
    let turn = |part: &mut [f32]| part.iter_mut().for_each(|b| *b = *b * sign + 0.0);
    turn(&mut values);
    if sigma[0] > 0.0 {
        gaussian(&mut values, grid.shape, sigma);
        values.iter_mut().for_each(|b| *b = b.clamp(-1.0, 1.0));
    }
    check(watch, Phase::Potential, 1.0, None)?;
    Ok(Enhanced { values, constant, crests: None })
}

/// A label's samples: how many, and the box that holds them.
struct Extent<const D: usize> {
    value: f32,
    count: usize,
    low: [usize; D],
    high: [usize; D],
}

impl<const D: usize> Extent<D> {
    /// The samples of the box.
    fn volume(&self) -> f64 {
        (0..D).map(|k| (self.high[k] + 1 - self.low[k]) as f64).product()
    }
}

/// The labels of an image, in the order of their first samples; labels are told apart by their bits.
fn extents<const D: usize>(labels: &[f32], grid: &Grid<D>) -> Vec<Extent<D>> {
    let mut places: HashMap<u32, usize> = HashMap::new();
    let mut found: Vec<Extent<D>> = Vec::new();
    let (mut index, mut last) = ([0; D], None);
    for &value in labels {
        let value = value + 0.0; // no −0
        let at = match last {
            Some((v, at)) if v == value => at,
            _ => *places.entry(value.to_bits()).or_insert_with(|| {
                found.push(Extent { value, count: 0, low: index, high: index });
                found.len() - 1
            }),
        };
        last = Some((value, at));
        let extent = &mut found[at];
        extent.count += 1;
        for k in 0..D {
            extent.low[k] = extent.low[k].min(index[k]);
            extent.high[k] = extent.high[k].max(index[k]);
        }
        for k in 0..D {
            index[k] += 1;
            if index[k] < grid.shape[k] {
                break;
            }
            index[k] = 0;
        }
    }
    found
}

/// The valleys, 0…1, of interfaces smoothed by `sigma` samples along each axis; `None` if there is only one label.
fn interfaces<const D: usize>(
    labels: &[f32],
    grid: &Grid<D>,
    sigma: [f64; D],
    watch: &mut dyn Watch,
) -> Result<Option<Vec<f32>>, EnhanceError> {
    if let Some(index) = labels.iter().position(|v| v.fract() != 0.0) {
        return Err(EnhanceError::Label { index, value: labels[index] }); // a NaN differs from 0 too
    }
    let extents = extents(labels, grid);
    let boxes: f64 = extents.iter().map(Extent::volume).sum();
    if boxes > MOST_BOXES * labels.len() as f64 {
        return Err(EnhanceError::Labels { count: extents.len() });
    }
    if extents.len() < 2 {
        return Ok(None);
    }
    let largest = (0..extents.len()).max_by_key(|&i| (extents[i].count, std::cmp::Reverse(i)));
    // of all labels but the largest
    let mut sums = ShareSums { first: vec![0.0; labels.len()], squares: vec![0.0; labels.len()] };
    for (i, extent) in extents.iter().enumerate().filter(|(i, _)| Some(*i) != largest) {
        check(watch, Phase::Potential, 0.1 + 0.6 * i as f64 / extents.len() as f64, None)?;
        sums.add(extent, labels, grid, sigma);
    }
    let ShareSums { first, mut squares } = sums;
    for (square, sum) in squares.iter_mut().zip(&first) {
        let rest = 1.0 - sum;
        *square = (2.0 * (1.0 - *square - rest * rest)).clamp(0.0, 1.0);
    }
    Ok(Some(squares))
}

/// Sums over labels at every sample.
struct ShareSums {
    /// Σ m.
    first: Vec<f32>,
    /// Σ m².
    squares: Vec<f32>,
}

impl ShareSums {
    /// Adds a label's share in the box that the share reaches.
    fn add<const D: usize>(
        &mut self,
        extent: &Extent<D>,
        labels: &[f32],
        grid: &Grid<D>,
        sigma: [f64; D],
    ) {
        let reach = sigma.map(|s| (REACH * s).ceil() as usize + 1);
        let low: [usize; D] = std::array::from_fn(|k| extent.low[k].saturating_sub(reach[k]));
        let high: [usize; D] =
            std::array::from_fn(|k| (extent.high[k] + reach[k]).min(grid.shape[k] - 1));
        let shape: [usize; D] = std::array::from_fn(|k| high[k] + 1 - low[k]);
        let strides = grid.strides();
        let row_start = |row: usize| {
            let (mut rest, mut start) = (row, low[0]);
            for k in 1..D {
                start += (low[k] + rest % shape[k]) * strides[k];
                rest /= shape[k];
            }
            start
        };
        let rows: usize = shape[1..].iter().product();
        let mut share = Vec::with_capacity(rows * shape[0]);
        for row in 0..rows {
            let start = row_start(row);
            let is_label = |&v: &f32| if v == extent.value { 1.0 } else { 0.0 };
            share.extend(labels[start..start + shape[0]].iter().map(is_label));
        }
        gaussian(&mut share, shape, sigma);
        for (row, shares) in share.chunks_exact(shape[0]).enumerate() {
            let start = row_start(row);
            for (i, m) in shares.iter().enumerate() {
                self.first[start + i] += m;
                self.squares[start + i] += m * m;
            }
        }
    }
}

/// Points on the interfaces of a label image: where the smoothed indicators of two labels are equal, moved outward by what
/// smoothing has drawn them inward by. Positions in samples, normals per lattice unit. Places where a third label has
/// more than either are left out, and those so near to a side of the image that the Gaussian does not fit: pieces are led on.
pub(super) fn interface_points<const D: usize>(
    image: &Image<D>,
    options: &FeatureOptions,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, EnhanceError> {
    let grid = image.frame().grid(options.units).in_least_steps();
    let labels = image.samples().to_f32();
    let window = Window::new(&labels, grid);
    let mut found = Vec::new();
    let count = labels.len();
    for start in (0..count).step_by(BATCH) {
        check(watch, Phase::Potential, start as f64 / count as f64, None)?;
        let batch = start..count.min(start + BATCH);
        let points = batch.into_par_iter().with_min_len(1 << 12).filter_map(|i| window.point(i));
        found.extend(points.collect::<Vec<_>>());
    }
    Ok(found)
}

/// Samples between two looks at the watch.
const BATCH: usize = 1 << 22;
/// The deviation of the Gaussian that smooths indicators, in least steps, and the least one in samples.
const SIGMA: f64 = 1.0;
const LEAST_SIGMA: f64 = 0.6;
/// Where the Gaussian ends, in deviations.
const END: f64 = 3.0;
/// How often a point is brought onto the interface.
const ROUNDS: usize = 4;
/// The greatest distance of a point from its sample along any axis, in samples: half a sample and some overlap.
const NEAR: f64 = 0.6;
/// The greatest share of labels other than the two: where three meet it is a third.
const OTHERS: f64 = 1.0 / 3.0;
/// The greatest shift outward, in least steps.
const GREATEST_SHIFT: f64 = 0.5;

/// Asks for the shares of labels around places.
struct Window<'a, const D: usize> {
    labels: &'a [f32],
    grid: Grid<D>,
    /// In least steps.
    sigma: [f64; D],
    /// In samples.
    reach: [usize; D],
}

/// The difference of two labels' shares at a place, and its derivatives in least steps.
#[derive(Clone, Copy)]
struct Difference<const D: usize> {
    value: f64,
    gradient: Point<D>,
    hessian: [[f64; D]; D],
    /// The share of all other labels.
    others: f64,
}

impl<'a, const D: usize> Window<'a, D> {
    fn new(labels: &'a [f32], grid: Grid<D>) -> Self {
        let sigma = grid.step.map(|step| SIGMA.max(LEAST_SIGMA * step));
        let reach = std::array::from_fn(|k| (END * sigma[k] / grid.step[k]).ceil() as usize + 1);
        Self { labels, grid, sigma, reach }
    }

    /// The point on an interface that is nearest to a sample, if it is this sample's.
    fn point(&self, index: usize) -> Option<FeaturePoint<D>> {
        let sample = coordinates(index, self.grid.shape);
        let fits =
            |k: usize| sample[k] >= self.reach[k] && sample[k] + self.reach[k] < self.grid.shape[k];
        let own = self.labels[index];
        let other = self.other(index, &sample, own)?;
        if !(0..D).all(fits) {
            return None;
        }
        let mut at: Point<D> = std::array::from_fn(|k| sample[k] as f64 * self.grid.step[k]);
        let mut found = self.difference(&sample, &at, own, other);
        for _ in 0..ROUNDS {
            let squared = dot(&found.gradient, &found.gradient);
            if squared == 0.0 {
                return None;
            }
            let length =
                (-found.value / squared).clamp(-1.0 / squared.sqrt(), 1.0 / squared.sqrt());
            (0..D).for_each(|k| at[k] += length * found.gradient[k]);
            found = self.difference(&sample, &at, own, other);
        }
        let steepness = dot(&found.gradient, &found.gradient).sqrt();
        let offset = |k: usize| at[k] / self.grid.step[k] - sample[k] as f64;
        let is_own = (0..D).all(|k| offset(k).abs() <= NEAR);
        if !is_own || found.others > OTHERS || found.value.abs() > 0.01 {
            return None;
        }
        let normal = found.gradient.map(|g| g / steepness);
        // smoothing draws a level inward by ½ σ² times the sum of its curvatures
        let along = |r: usize| dot(&found.hessian[r], &normal) * normal[r];
        let trace: f64 = (0..D).map(|k| found.hessian[k][k]).sum();
        let curvatures = (trace - (0..D).map(along).sum::<f64>()) / steepness;
        let variance: f64 = self.sigma.iter().map(|s| s * s).sum::<f64>() / D as f64;
        let shift = (0.5 * variance * curvatures).clamp(-GREATEST_SHIFT, GREATEST_SHIFT);
        let position = std::array::from_fn(|k| (at[k] + shift * normal[k]) / self.grid.step[k]);
        Some(FeaturePoint { index, position, normal, strength: 1.0 })
    }

    /// The label that is most common beside a sample, but for its own; the least of equals.
    fn other(&self, index: usize, sample: &[usize; D], own: f32) -> Option<f32> {
        let mut beside = [own; 6];
        let mut stride = 1;
        for k in 0..D {
            if sample[k] > 0 {
                beside[2 * k] = self.labels[index - stride];
            }
            if sample[k] + 1 < self.grid.shape[k] {
                beside[2 * k + 1] = self.labels[index + stride];
            }
            stride *= self.grid.shape[k];
        }
        let count = |label: f32| beside.iter().filter(|&&l| l == label).count();
        let others = beside.iter().copied().filter(|&label| label != own);
        others.max_by(|&a, &b| count(a).cmp(&count(b)).then(b.total_cmp(&a)))
    }

    /// The difference of the shares of two labels at a place near a sample.
    fn difference(
        &self,
        sample: &[usize; D],
        at: &Point<D>,
        own: f32,
        other: f32,
    ) -> Difference<D> {
        let counts: [usize; D] = self.reach.map(|reach| 2 * reach + 1);
        let strides = self.grid.strides();
        let (mut all, mut two) = (0.0, 0.0);
        let mut found =
            Difference { value: 0.0, gradient: [0.0; D], hessian: [[0.0; D]; D], others: 0.0 };
        for code in 0..counts.iter().product() {
            let (mut rest, mut index) = (code, 0);
            let (mut offset, mut exponent) = ([0.0; D], 0.0);
            for k in 0..D {
                let place = sample[k] + rest % counts[k] - self.reach[k];
                rest /= counts[k];
                index += place * strides[k];
                // over the variance
                offset[k] = (place as f64 * self.grid.step[k] - at[k]) / self.sigma[k];
                exponent += offset[k] * offset[k];
                offset[k] /= self.sigma[k];
            }
            let weight = (-0.5 * exponent).exp();
            all += weight;
            let label = self.labels[index];
            let sign = if label == own {
                1.0
            } else if label == other {
                -1.0
            } else {
                continue;
            };
            two += weight;
            let weight = sign * weight;
            found.value += weight;
            for r in 0..D {
                found.gradient[r] += weight * offset[r];
                for c in 0..D {
                    found.hessian[r][c] += weight * offset[r] * offset[c];
                }
                found.hessian[r][r] -= weight / (self.sigma[r] * self.sigma[r]);
            }
        }
        found.value /= all;
        found.gradient = found.gradient.map(|g| g / all);
        found.hessian = found.hessian.map(|row| row.map(|h| h / all));
        found.others = 1.0 - two / all;
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{difference, dot};
    use crate::image::{Frame, Samples};
    use crate::watch::Silent;

    #[test]
    fn points_on_the_interface_of_a_ball_are_where_its_surface_is() {
        // a ball of whole samples: smoothing averages the steps, and its pull inward is taken out
        let (centre, radius) = ([15.3, 14.8, 15.1], 9.4);
        let frame = Frame::new([31, 30, 32]).unwrap();
        let is_inside = |i: usize| {
            let offset = difference(&coordinates(i, frame.shape()).map(|x| x as f64), &centre);
            dot(&offset, &offset) < radius * radius
        };
        let labels = (0..frame.sample_count()).map(|i| if is_inside(i) { 7 } else { 3 });
        let image = Image::new(frame, Samples::U8(labels.collect())).unwrap();
        let options = FeatureOptions::default();
        let points = interface_points(&image, &options, &mut Silent).unwrap();
        let heights: Vec<f64> = (points.iter())
            .map(|point| {
                let offset = difference(&point.position, &centre);
                let length = dot(&offset, &offset).sqrt();
                assert!(dot(&offset, &point.normal).abs() > 0.9 * length);
                length - radius
            })
            .collect();
        let mean = heights.iter().sum::<f64>() / heights.len() as f64;
        let rms = (heights.iter().map(|h| h * h).sum::<f64>() / heights.len() as f64).sqrt();
        // without the correction the mean is −σ²/R = −0.11; steps of a sample smoothed by one leave about a tenth
        assert!(heights.len() > 900 && mean.abs() < 0.03 && rms < 0.15, "{mean} {rms}");
    }

    #[test]
    fn where_three_labels_meet_no_third_has_more() {
        let frame = Frame::new([40, 40]).unwrap();
        let label = |i: usize| {
            let [x, y] = coordinates(i, [40, 40]);
            if y < 20 { 1 } else { 2 + u8::from(x < 20) }
        };
        let labels = (0..1600).map(label).collect();
        let image = Image::new(frame, Samples::U8(labels)).unwrap();
        let points = interface_points(&image, &FeatureOptions::default(), &mut Silent).unwrap();
        assert!(points.len() > 90);
        for point in &points {
            let [x, y] = point.position;
            let off = if y < 19.0 { f64::INFINITY } else { (x - 19.5).abs() }.min((y - 19.5).abs());
            // within two samples of the meeting place the third label bends the level
            assert!(off < if (x - 19.5).hypot(y - 19.5) > 3.0 { 1e-3 } else { 0.6 }, "{x} {y}");
        }
    }

    #[test]
    fn a_valley_is_as_deep_between_any_labels_and_follows_the_error_function() {
        let grid = Grid { shape: [60, 4], step: [1.0, 1.0] };
        // interfaces at 19.5 and 39.5
        let value = |x: usize| {
            if x < 20 {
                3.0
            } else if x < 40 {
                -1.0
            } else {
                200.0
            }
        };
        let labels: Vec<f32> = (0..240).map(|i| value(i % 60)).collect();
        let sigma = 2.0;
        let valley = interfaces(&labels, &grid, [sigma; 2], &mut Silent).unwrap().unwrap();
        for (x, b) in valley[..60].iter().enumerate() {
            // the share of the left label is half of erfc(s / σ√2), summed over samples
            let share = |s: f64| {
                (-20..=20).map(f64::from).fold((0.0, 0.0), |(part, all), t| {
                    let w = (-0.5 * (t / sigma).powi(2)).exp();
                    (if t > s { part + w } else { part }, all + w)
                })
            };
            let m = [19.5, 39.5].map(|edge| {
                let (part, all) = share(edge - x as f64);
                part / all
            });
            let shares = [1.0 - m[0], m[0] - m[1], m[1]];
            let expected = 2.0 * (1.0 - shares.iter().map(|m| m * m).sum::<f64>());
            // kernels end at four standard deviations, where 6e-5 is left
            assert!((f64::from(*b) - expected).abs() < 3e-4, "{x}: {b} {expected}");
        }
        assert!((valley[19] - valley[40]).abs() < 1e-3 && valley[19] > 0.95);
        assert_eq!(interfaces(&[7.0; 240], &grid, [1.0; 2], &mut Silent), Ok(None));
    }
}
