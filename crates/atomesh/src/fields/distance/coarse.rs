//! Bringing samples to a coarser grid over the same box.

use crate::image::Grid;
use crate::parallel::prelude::*;

/// What a node takes from the samples around it, up to the next nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Take {
    /// The mean of their magnitudes, weighted by how near they are as linear interpolation does.
    Magnitude,
    /// The least. Linear interpolation between the nodes is then nowhere above the samples.
    Least,
}

/// The grid over the same box whose nodes are about `spacing` apart, and no closer than samples.
pub(super) fn coarse_grid<const D: usize>(grid: &Grid<D>, spacing: f64) -> Grid<D> {
    let extent = grid.bounds().extent();
    let shape = std::array::from_fn(|k| {
        let intervals = (extent[k] / spacing - 1e-9).ceil().max(0.0) as usize;
        intervals.min(grid.shape[k] - 1) + 1
    });
    let step = std::array::from_fn(|k| {
        if shape[k] > 1 { extent[k] / (shape[k] - 1) as f64 } else { grid.step[k] }
    });
    Grid { shape, step }
}

/// Brings `values`, x fastest, from grid `from` to the nodes of `to`, which spans the same box.
pub(super) fn reduce<const D: usize>(
    values: &[f32],
    from: &Grid<D>,
    to: &Grid<D>,
    take: Take,
) -> Vec<f32> {
    let mut shape = from.shape;
    let mut reduced: Option<Vec<f32>> = None;
    for turn in 0..D {
        // the least is the same in any order: the axis with the greatest stride goes first, so that samples
        // are read in the order of memory and few are left for the other axes
        let axis = if take == Take::Least { D - 1 - turn } else { turn };
        if to.shape[axis] < shape[axis] {
            let source = reduced.as_deref().unwrap_or(values);
            let footprints = footprints(shape[axis], to.shape[axis]);
            let inner = shape[..axis].iter().product();
            reduced = Some(reduce_axis(source, inner, shape[axis], &footprints, take));
            shape[axis] = to.shape[axis];
        }
    }
    reduced.unwrap_or_else(|| values.to_vec())
}

/// Of a node along one axis: its first sample and the weights from there on, which sum to 1.
struct Footprint {
    first: usize,
    weights: Vec<f32>,
}

/// The footprints of `nodes` nodes over `samples` samples.
fn footprints(samples: usize, nodes: usize) -> Vec<Footprint> {
    if nodes == 1 {
        let weights = vec![1.0 / samples as f32; samples];
        return vec![Footprint { first: 0, weights }];
    }
    let reach = (samples - 1) as f64 / (nodes - 1) as f64; // from node to node, in samples
    let footprint = |node: usize| {
        let centre = node as f64 * reach;
        // a sample on the next node, give or take rounding, is the next node's
        let first = ((centre - reach + 1e-6).ceil().max(0.0)) as usize;
        let last = ((centre + reach - 1e-6).floor() as usize).min(samples - 1);
        let raw = || (first..=last).map(|i| 1.0 - (i as f64 - centre).abs() / reach);
        let sum: f64 = raw().sum();
        Footprint { first, weights: raw().map(|w| (w / sum) as f32).collect() }
    };
    (0..nodes).map(footprint).collect()
}

/// Reduces one axis of `n` samples, each a line of `inner` values.
fn reduce_axis(
    values: &[f32],
    inner: usize,
    n: usize,
    footprints: &[Footprint],
    take: Take,
) -> Vec<f32> {
    let nodes = footprints.len();
    let mut out = vec![0.0; values.len() / n * nodes];
    if inner == 1 {
        let rows = values.par_chunks_exact(n);
        out.par_chunks_exact_mut(nodes).zip(rows).for_each(|(out, row)| {
            for (out, footprint) in out.iter_mut().zip(footprints) {
                *out = footprint.of(row, take);
            }
        });
        return out;
    }
    out.par_chunks_exact_mut(inner).enumerate().for_each(|(line, out)| {
        let block = &values[line / nodes * n * inner..][..n * inner];
        let footprint = &footprints[line % nodes];
        let lines = block.chunks_exact(inner).skip(footprint.first).zip(&footprint.weights);
        match take {
            Take::Magnitude => lines.for_each(|(line, &w)| {
                out.iter_mut().zip(line).for_each(|(o, v)| *o += w * v.abs());
            }),
            Take::Least => {
                out.fill(f32::INFINITY);
                lines.for_each(|(line, _)| {
                    out.iter_mut().zip(line).for_each(|(o, &v)| *o = if v < *o { v } else { *o });
                });
            }
        }
    });
    out
}

impl Footprint {
    /// The node's value from a row of samples.
    fn of(&self, row: &[f32], take: Take) -> f32 {
        let samples = &row[self.first..self.first + self.weights.len()];
        match take {
            Take::Magnitude => {
                samples.iter().zip(&self.weights).fold(0.0, |sum, (v, w)| sum + w * v.abs())
            }
            Take::Least => {
                samples.iter().fold(f32::INFINITY, |least, &v| if v < least { v } else { least })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_span_the_box_and_are_no_closer_than_samples() {
        let grid = Grid { shape: [101, 7, 1], step: [1.0, 2.0, 5.0] };
        let coarse = coarse_grid(&grid, 3.0);
        assert_eq!(coarse.shape, [35, 5, 1]);
        assert_eq!(coarse.bounds(), grid.bounds());
        assert_eq!(coarse_grid(&grid, 0.01), grid);
        assert_eq!(coarse_grid(&grid, 1e9).shape, [2, 2, 1]);
    }

    #[test]
    fn the_same_grid_gives_the_same_values() {
        let grid = Grid { shape: [11, 7, 3], step: [0.1, 0.7, 3.0] };
        let values: Vec<f32> = (0..231).map(|i| (i * 37 % 101) as f32).collect();
        for take in [Take::Magnitude, Take::Least] {
            assert_eq!(reduce(&values, &grid, &coarse_grid(&grid, 0.05), take), values);
        }
    }

    #[test]
    fn means_keep_ramps_and_minima_keep_the_least() {
        let grid = Grid { shape: [41, 21], step: [1.0, 1.0] };
        let coarse = coarse_grid(&grid, 4.0);
        assert_eq!(coarse.shape, [11, 6]);
        let ramp: Vec<f32> = (0..861).map(|i| (i % 41 + 2 * (i / 41)) as f32).collect();
        let mean = reduce(&ramp, &grid, &coarse, Take::Magnitude);
        for y in 1..5 {
            for x in 1..10 {
                // footprints are symmetric away from the edges
                assert!((mean[y * 11 + x] - (4 * x + 8 * y) as f32).abs() < 1e-4);
            }
        }
        let mut field = vec![9.0; 861];
        field[10 * 41 + 17] = 1.0;
        let least = reduce(&field, &grid, &coarse, Take::Least);
        // the sample lies between nodes 4 and 5, and 2 and 3: all four hold its value
        let holders: Vec<_> = (0..66).filter(|&i| least[i] == 1.0).collect();
        assert_eq!(holders, [26, 27, 37, 38]);
    }
}
