//! Recall and precision of crests, by the truth of synthetic layers.
//!
//! A crest is right if a fault is within two samples of it: their share is the *precision*. The truth is sampled a
//! sample apart on each fault's disk, where that is inside the image; a sample is found if a crest is within two
//! samples of it, and the share found is the *recall*: of all of the surface, and of that where layers are
//! torn apart by a sample or more. At a disk's rim the throw is 0 and nothing can be seen.

use super::{FaultOptions, Faults};
use crate::crests::FeaturePoint;
use crate::geometry::{Point, dot};
use crate::synth::{Geometry, Scene, SynthOptions, Synthetic, Truth, synthesize};
use crate::watch::Silent;

/// The greatest distance of a crest from a fault that it finds, in samples.
const NEAR: f64 = 2.0;

/// Shares of what is found, and of what is right.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Score {
    /// Recall of all of the faults.
    pub all: f64,
    /// Recall where the throw is a sample or more.
    pub thrown: f64,
    /// The share of crests that are right.
    pub precision: f64,
}

/// The amplitudes of a scene with white noise of a power so many decibels below the layers' own.
pub(super) fn noisy<const D: usize>(
    scene: Scene,
    shape: [usize; D],
    seed: u64,
    decibels: f64,
) -> (Vec<f32>, Truth<D>) {
    let drawn = |noise| {
        let options = SynthOptions { seed, noise, ..SynthOptions::new(shape) };
        let Synthetic { image, truth } = synthesize(scene, &options).unwrap();
        (image.samples().to_f32(), truth)
    };
    let values = drawn(0.0).0;
    let (least, greatest) =
        values.iter().fold((f32::MAX, f32::MIN), |m, &v| (m.0.min(v), m.1.max(v)));
    let noise = deviation(&values) * 10f64.powf(-decibels / 20.0);
    drawn(noise / f64::from(greatest - least))
}

/// The standard deviation of values.
pub(super) fn deviation(values: &[f32]) -> f64 {
    let mean = |of: &dyn Fn(f64) -> f64| {
        values.iter().map(|&v| of(v.into())).sum::<f64>() / values.len() as f64
    };
    let middle = mean(&|v| v);
    mean(&|v| (v - middle).powi(2)).sqrt()
}

/// The score of the default options on a scene.
pub(super) fn score<const D: usize>(
    scene: Scene,
    shape: [usize; D],
    seed: u64,
    decibels: f64,
) -> Score {
    let (values, truth) = noisy(scene, shape, seed, decibels);
    let finder = Faults(FaultOptions::default());
    let crests = crate::enhance::thin::crests(&finder, &values, &truth.grid, &mut Silent).unwrap();
    score_of(&crests, &truth)
}

/// The score of crests.
fn score_of<const D: usize>(crests: &[FeaturePoint<D>], truth: &Truth<D>) -> Score {
    let right = |c: &&FeaturePoint<D>| truth.distance(&c.position) <= NEAR;
    let precision = crests.iter().filter(right).count() as f64 / crests.len().max(1) as f64;
    let bins = Bins::new(crests, truth.grid.shape);
    let (mut all, mut thrown) = (Found::default(), Found::default());
    for p in surface(truth) {
        let found = bins.near(&p);
        all.add(found);
        if throw(truth, &p) >= 1.0 {
            thrown.add(found);
        }
    }
    Score { all: all.share(), thrown: thrown.share(), precision }
}

/// How many samples of a surface are found.
#[derive(Default)]
struct Found {
    part: usize,
    whole: usize,
}

impl Found {
    fn add(&mut self, found: bool) {
        self.part += usize::from(found);
        self.whole += 1;
    }

    fn share(&self) -> f64 {
        self.part as f64 / self.whole.max(1) as f64
    }
}

/// By how much the age of layers jumps nearby, in samples of depth.
fn throw<const D: usize>(truth: &Truth<D>, p: &Point<D>) -> f64 {
    let layers = truth.layers.as_ref().unwrap();
    // sideways, where the nearest fault is crossed and layers go on almost level
    let beside = |h: f64| {
        let mut q = *p;
        q[0] += h;
        layers.age(&q)
    };
    (beside(1e-6) - beside(-1e-6)).abs()
}

/// Samples of the faults' disks inside the image.
fn surface<const D: usize>(truth: &Truth<D>) -> Vec<Point<D>> {
    let mut points = Vec::new();
    for feature in &truth.features {
        let Geometry::Disk { center, normal, radius } = &feature.geometry else { continue };
        let basis = tangents(normal);
        let reach = radius.ceil();
        let side = 2 * reach as usize + 1;
        for mut number in 0..side.pow(D as u32 - 1) {
            let (mut p, mut squared) = (*center, 0.0);
            for tangent in &basis {
                let s = (number % side) as f64 - reach;
                number /= side;
                squared += s * s;
                p = std::array::from_fn(|k| p[k] + s * tangent[k]);
            }
            let bounds = truth.grid.bounds();
            if squared <= radius * radius && bounds.contains(&p) {
                points.push(p);
            }
        }
    }
    points
}

/// Unit vectors at right angles to a normal and each other.
fn tangents<const D: usize>(normal: &Point<D>) -> Vec<Point<D>> {
    let mut basis: Vec<Point<D>> = vec![*normal];
    for axis in 0..D {
        let mut v: Point<D> = std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 });
        for b in &basis {
            let along = dot(&v, b);
            v = std::array::from_fn(|k| v[k] - along * b[k]);
        }
        let length = dot(&v, &v).sqrt();
        if length > 0.1 && basis.len() < D {
            basis.push(v.map(|x| x / length));
        }
    }
    basis.split_off(1)
}

/// Crests by the cells that they lie in, four samples wide.
struct Bins<'a, const D: usize> {
    counts: [usize; D],
    cells: Vec<Vec<&'a FeaturePoint<D>>>,
}

impl<'a, const D: usize> Bins<'a, D> {
    fn new(crests: &'a [FeaturePoint<D>], shape: [usize; D]) -> Self {
        let counts = shape.map(|n| n / 4 + 2);
        let mut bins = Self { counts, cells: vec![Vec::new(); counts.iter().product()] };
        for crest in crests {
            let cell = bins.cell(&crest.position.map(|x| (x.max(0.0) / 4.0) as usize));
            bins.cells[cell].push(crest);
        }
        bins
    }

    fn cell(&self, at: &[usize; D]) -> usize {
        (0..D).rev().fold(0, |index, k| index * self.counts[k] + at[k].min(self.counts[k] - 1))
    }

    fn near(&self, p: &Point<D>) -> bool {
        (0..1 << D).any(|corner: usize| {
            // the cells that the corners of a cube about the point are in
            let at = std::array::from_fn(|k| {
                let side = if corner >> k & 1 == 1 { NEAR } else { -NEAR };
                ((p[k] + side).max(0.0) / 4.0) as usize
            });
            self.cells[self.cell(&at)].iter().any(|crest| {
                let squared = |k: usize| (crest.position[k] - p[k]).powi(2);
                (0..D).map(squared).sum::<f64>() <= NEAR * NEAR
            })
        })
    }
}
