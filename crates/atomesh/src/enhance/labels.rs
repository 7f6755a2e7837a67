//! The interfaces of a label image as valleys of one depth and width.
//!
//! With m the share of a label around a place (a Gaussian over the label's samples), 1 − Σ m² is 0 within a
//! label and ½ on a straight interface of two. Twice that, clipped to 1, is the valley, whatever numbers the
//! labels have. Each label is smoothed in its own box, and the largest not at all: its share is the rest.

use std::collections::HashMap;

use crate::image::{Grid, Image, gaussian};
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
) -> Result<Enhanced, EnhanceError> {
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
    Ok(Enhanced { values, constant })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::watch::Silent;

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
