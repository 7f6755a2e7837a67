//! Nodes: what is smooth along an axis is held at every second or third sample, and linear between them.
//!
//! A node stands for some samples and is in their middle. Means over many samples begin with the sums of each node's
//! samples, so that no sample is left out and noise is averaged as well as by a mean over all of them.

use super::FaultOptions;
use super::facing::Facing;
use std::ops::Range;

/// The most samples that a node stands for.
const MOST: usize = 3;

/// How far apart nodes along the strike may be, over the deviation of the mean along it: a Gaussian.
const ALONG: f64 = 0.75;

/// How far apart nodes down may be, over the deviation of the mean along the dip: exponentials have a point. Every second
/// sample, by default, finds more faults of sections than every third and fewer false ones: no row of samples is at a node,
/// so that all are smoothed alike.
const DOWN: f64 = 0.17;

/// The nodes of a scan: each upright plane of nodes has rows of all samples along u.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coarse {
    pub facing: Facing,
    /// Along v.
    pub along: Nodes,
    /// Along z.
    pub down: Nodes,
}

impl Coarse {
    pub fn new(facing: &Facing, options: &FaultOptions) -> Self {
        Self {
            facing: *facing,
            along: Nodes::new(facing.along, ALONG * options.strike_reach),
            down: Nodes::new(facing.depth, DOWN * options.dip_reach),
        }
    }

    /// The samples along u of all nodes of an upright plane.
    pub fn plane(&self) -> usize {
        self.facing.across * self.down.count
    }

    /// The same of all planes.
    pub fn count(&self) -> usize {
        self.plane() * self.along.count
    }

    /// Values of a row of nodes.
    pub fn row<'a, T>(&self, values: &'a [T], along: usize, down: usize) -> &'a [T] {
        &values[(along * self.down.count + down) * self.facing.across..][..self.facing.across]
    }
}

/// The nodes along an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nodes {
    /// The samples of a node; the last may have fewer, but is as far from the one before it as any.
    pub step: usize,
    /// Nodes.
    pub count: usize,
    samples: usize,
}

impl Nodes {
    /// Nodes of so many samples that they are at most `farthest` samples apart, for an axis of `samples`.
    pub fn new(samples: usize, farthest: f64) -> Self {
        let step = (farthest as usize).clamp(1, MOST.min(samples.max(1)));
        Self { step, count: samples.div_ceil(step), samples }
    }

    /// The samples of a node.
    pub fn samples(&self, node: usize) -> Range<usize> {
        node * self.step..((node + 1) * self.step).min(self.samples)
    }

    /// The samples of some nodes.
    pub fn samples_of(&self, nodes: &Range<usize>) -> Range<usize> {
        nodes.start * self.step..(nodes.end * self.step).min(self.samples)
    }

    /// Where a node is, in samples.
    pub fn place(&self, node: usize) -> f64 {
        (node * self.step) as f64 + 0.5 * (self.step - 1) as f64
    }

    /// The standard deviation, in nodes, that together with the sums over each node's samples makes `deviation`, in
    /// samples: of independent distances, the variances add.
    pub fn deviation(&self, deviation: f64) -> f64 {
        let step = self.step as f64;
        (deviation * deviation - (step * step - 1.0) / 12.0).max(0.0).sqrt() / step
    }

    /// The two nodes that a sample is between, and the share of the second. Beyond the first and last node both are the
    /// same.
    pub fn around(&self, sample: usize) -> ([usize; 2], f32) {
        let at = (sample as f64 - self.place(0)) / self.step as f64;
        let low = at.max(0.0).floor();
        let node = low as usize;
        ([node, (node + 1).min(self.count - 1)], (at - low).max(0.0) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_in_the_middle_of_their_samples() {
        for (samples, farthest) in [(1, 3.0), (2, 9.0), (7, 1.5), (7, 2.0), (9, 3.2), (10, 3.0)] {
            let nodes = Nodes::new(samples, farthest);
            let all: Vec<usize> = (0..nodes.count).flat_map(|node| nodes.samples(node)).collect();
            assert_eq!(all, (0..samples).collect::<Vec<_>>());
            let full = (0..nodes.count).filter(|&node| nodes.samples(node).len() == nodes.step);
            for node in full {
                let own = nodes.samples(node);
                assert_eq!(nodes.place(node), 0.5 * (own.start + own.end - 1) as f64);
            }
            for sample in 0..samples {
                let ([low, high], share) = nodes.around(sample);
                let place =
                    nodes.place(low) + f64::from(share) * (nodes.place(high) - nodes.place(low));
                let inside =
                    (nodes.place(0)..=nodes.place(nodes.count - 1)).contains(&(sample as f64));
                assert!(!inside || (place - sample as f64).abs() < 1e-6, "{sample} of {samples}");
            }
        }
    }
}
