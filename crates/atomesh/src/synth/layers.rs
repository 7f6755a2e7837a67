//! Folded layers cut by faults, as a seismic amplitude image or as an image of the faults.
//!
//! Depth is the last axis. Every point has an *age*: the depth at which its layer was laid down.
//! Folds and the faults' throws change depth into age; reflectors, thin spikes in age, are seen
//! through a Ricker wavelet. A fault is a flat disk in whose ball the layers slip, on its two sides
//! in opposite ways, most at its centre and not at all at its rim, so that age jumps on the disk
//! and nowhere else.

use super::random::Random;
use super::truth::{Geometry, Role, TrueFeature};
use super::{Canvas, Sketch, grey};
use crate::geometry::{Point, difference, dot};
use serde::ser::{Serialize, SerializeStruct, Serializer};
use std::f64::consts::{PI, TAU};

/// Faults in a scene.
const FAULT_COUNT: usize = 4;
/// Folds in a scene.
const FOLD_COUNT: usize = 3;
/// Depth between reflectors, in samples.
const LAYER_SAMPLES: (f64, f64) = (5.0, 11.0);
/// The wavelength of the Ricker wavelet at its peak frequency, in samples.
const WAVELENGTH_SAMPLES: f64 = 9.0;
/// Entries of the table of amplitudes for each sample of depth.
const TABLE_PER_SAMPLE: f64 = 8.0;

/// A wave by which layers are folded: depth changes by `amplitude · sin(wave · x + phase)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fold<const D: usize> {
    /// The greatest change of depth, in world units.
    pub amplitude: f64,
    /// The wave vector, in radians a world unit; horizontal.
    pub wave: Point<D>,
    /// The phase at the world's origin, in radians.
    pub phase: f64,
}

/// A fault by which layers slip: a disk, and how far they are torn apart at its centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slip<const D: usize> {
    center: Point<D>,
    normal: Point<D>,
    radius: f64,
    throw: f64,
}

/// The layers of a scene: where each horizon is, exactly.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers<const D: usize> {
    /// The folds.
    pub folds: Vec<Fold<D>>,
    /// The ages of the horizons, ascending: the depths at which they would be without folds and
    /// faults, in world units.
    pub horizons: Vec<f64>,
    /// In the order of the fault features; serialised as `throws`, the jumps of age at their centres.
    slips: Vec<Slip<D>>,
}

impl<const D: usize> Layers<D> {
    /// The age of the layer at a point: its depth without folds and faults. A horizon is the set
    /// of points whose age is its own.
    pub fn age(&self, p: &Point<D>) -> f64 {
        let folded: f64 =
            self.folds.iter().map(|f| f.amplitude * (dot(&f.wave, p) + f.phase).sin()).sum();
        let slipped: f64 = self.slips.iter().map(|s| s.shift(p)).sum();
        p[D - 1] - folded - slipped
    }
}

impl<const D: usize> Slip<D> {
    /// How much deeper the fault has put the layer at `p`.
    fn shift(&self, p: &Point<D>) -> f64 {
        let v = difference(p, &self.center);
        let inside = 1.0 - dot(&v, &v) / (self.radius * self.radius);
        if inside <= 0.0 {
            return 0.0;
        }
        0.5 * self.throw * inside * inside * dot(&v, &self.normal).signum()
    }
}

/// Folds, faults and horizons from the seed.
fn layers<const D: usize>(canvas: &Canvas<D>, random: &mut Random) -> Layers<D> {
    let extent = canvas.bounds.extent();
    let depth = extent[D - 1];
    let folds = (0..FOLD_COUNT).map(|_| fold(canvas, random)).collect();
    let slips = (0..FAULT_COUNT).map(|i| slip(canvas, i, random)).collect();
    // folds and throws bring layers up from below the box and down from above it
    let mut horizons = Vec::new();
    let mut age = -0.5 * depth;
    while age < 1.5 * depth {
        horizons.push(age);
        age += canvas.depth_step * random.between(LAYER_SAMPLES.0, LAYER_SAMPLES.1);
    }
    Layers { folds, horizons, slips }
}

/// A fold of up to 4 % of the depth, of one to two and a half waves across the box.
fn fold<const D: usize>(canvas: &Canvas<D>, random: &mut Random) -> Fold<D> {
    let extent = canvas.bounds.extent();
    let mut wave = [0.0; D];
    for k in 0..D - 1 {
        wave[k] = random.sign() * TAU * random.between(0.4, 1.6) / extent[k];
    }
    Fold {
        amplitude: random.between(0.015, 0.04) * extent[D - 1],
        wave,
        phase: random.between(0.0, TAU),
    }
}

/// Fault `i`: dipping by 55° to 75°, its throw 4 % to 9 % of the depth.
fn slip<const D: usize>(canvas: &Canvas<D>, i: usize, random: &mut Random) -> Slip<D> {
    let extent = canvas.bounds.extent();
    let mut shares: Point<D> = std::array::from_fn(|_| random.between(0.3, 0.7));
    shares[0] = (i as f64 + random.between(0.3, 0.7)) / FAULT_COUNT as f64;
    let dip = random.between(55.0, 75.0) * PI / 180.0;
    let mut normal = [0.0; D];
    normal[0] = random.sign() * dip.sin();
    normal[D - 1] = dip.cos();
    if D > 2 {
        // strike: turn the horizontal part of the normal
        let (sine, cosine) = random.between(-0.4, 0.4).sin_cos();
        (normal[0], normal[1]) = (normal[0] * cosine, normal[0] * sine);
    }
    Slip {
        center: canvas.at(&shares),
        normal,
        radius: random.between(0.4, 0.6) * extent[D - 1].max(canvas.least_extent()),
        throw: random.sign() * random.between(0.04, 0.09) * extent[D - 1],
    }
}

/// The faults of the layers as features.
fn features<const D: usize>(layers: &Layers<D>) -> Vec<TrueFeature<D>> {
    layers
        .slips
        .iter()
        .map(|&Slip { center, normal, radius, .. }| TrueFeature {
            role: Role::Fault,
            geometry: Geometry::Disk { center, normal, radius },
        })
        .collect()
}

/// The layers as seismic amplitudes.
pub(super) fn amplitudes<const D: usize>(canvas: &Canvas<D>, random: &mut Random) -> Sketch<D> {
    let layers = layers(canvas, random);
    let table = Table::new(&layers.horizons, canvas.depth_step, random);
    let seen = layers.clone();
    Sketch {
        features: features(&layers),
        layers: Some(layers),
        shade: Box::new(move |p| grey::ZERO + grey::AMPLITUDE * table.at(seen.age(p))),
    }
}

/// The faults alone, as dark sheets.
pub(super) fn faults<const D: usize>(canvas: &Canvas<D>, random: &mut Random) -> Sketch<D> {
    let layers = layers(canvas, random);
    let features = features(&layers);
    let drawn = features.clone();
    let canvas = *canvas;
    let shade = move |p: &Point<D>| {
        let nearest = drawn.iter().fold(canvas.line_reach(), |nearest, f| {
            // what is farther than another need not be known
            let Geometry::Disk { center, normal, .. } = &f.geometry else { return nearest };
            let height = dot(&difference(p, center), normal).abs();
            if height < nearest { nearest.min(f.geometry.distance(p)) } else { nearest }
        });
        canvas.line(nearest)
    };
    Sketch { features, layers: Some(layers), shade: Box::new(shade) }
}

/// Amplitudes by age, in −1…1.
struct Table {
    start: f64,
    step: f64,
    values: Vec<f64>,
}

impl Table {
    /// Reflectors of random strength and sign at the horizons, seen through a Ricker wavelet.
    fn new(horizons: &[f64], sample: f64, random: &mut Random) -> Self {
        let step = sample / TABLE_PER_SAMPLE;
        let wavelength = WAVELENGTH_SAMPLES * sample;
        let (first, last) =
            (horizons.first().copied().unwrap_or(0.0), horizons.last().copied().unwrap_or(0.0));
        let count = ((last - first) / step) as usize + 2;
        let mut values = vec![0.0f64; count];
        // the wavelet has died away two wavelengths from its middle
        let reach = (2.0 * wavelength / step) as usize;
        for &age in horizons {
            let strength = random.sign() * random.between(0.3, 1.0);
            let middle = (age - first) / step;
            let from = (middle as usize).saturating_sub(reach);
            for i in from..count.min(middle as usize + reach) {
                values[i] += strength * ricker((i as f64 - middle) * step / wavelength);
            }
        }
        let greatest = values.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
        values.iter_mut().for_each(|v| *v /= greatest);
        Self { start: first, step, values }
    }

    /// The amplitude at an age, linear between entries; beyond the table its end's.
    fn at(&self, age: f64) -> f64 {
        let last = self.values.len() - 1;
        let u = ((age - self.start) / self.step).clamp(0.0, last as f64);
        let i = (u as usize).min(last - 1);
        self.values[i] + (u - i as f64) * (self.values[i + 1] - self.values[i])
    }
}

/// The Ricker wavelet at a distance from its middle, in wavelengths of its peak frequency.
fn ricker(t: f64) -> f64 {
    let a = (PI * t).powi(2);
    (1.0 - 2.0 * a) * (-a).exp()
}

impl<const D: usize> Serialize for Fold<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut out = serializer.serialize_struct("Fold", 3)?;
        out.serialize_field("amplitude", &self.amplitude)?;
        out.serialize_field("wave", self.wave.as_slice())?;
        out.serialize_field("phase", &self.phase)?;
        out.end()
    }
}

impl<const D: usize> Serialize for Layers<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut out = serializer.serialize_struct("Layers", 3)?;
        out.serialize_field("folds", &self.folds)?;
        out.serialize_field("horizons", &self.horizons)?;
        let throws: Vec<f64> = self.slips.iter().map(|s| s.throw).collect();
        out.serialize_field("throws", &throws)?;
        out.end()
    }
}
