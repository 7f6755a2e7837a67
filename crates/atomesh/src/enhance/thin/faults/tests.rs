//! Faults are found where they were drawn, and only there.

use super::score::{Score, deviation, noisy, score};
use super::*;
use crate::image::coordinates;
use crate::synth::Scene;
use crate::watch::{Cancelled, Silent};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rayon::ThreadPoolBuilder;

/// Amplitudes of layers, each sample's by the age of its place.
fn layers<const D: usize>(shape: [usize; D], age: impl Fn([f64; D]) -> f64) -> Vec<f32> {
    let amplitude = |age: f64| {
        // four waves whose lengths have no common multiple nearby: no layer looks like another
        let waves = [(8.3, 0.4), (11.1, 2.0), (14.7, 4.1), (23.9, 5.5)];
        waves
            .iter()
            .map(|(length, phase)| (std::f64::consts::TAU * age / length + phase).sin())
            .sum()
    };
    let count = shape.iter().product();
    let sum = |i| -> f64 { amplitude(age(coordinates(i, shape).map(|x| x as f64))) };
    (0..count).map(|i| sum(i) as f32).collect()
}

/// The same with white noise so many decibels below.
fn with_noise(mut values: Vec<f32>, decibels: f64, seed: u64) -> Vec<f32> {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    let scale = deviation(&values) * 10f64.powf(-decibels / 20.0);
    for value in &mut values {
        // twelve uniform numbers have the variance 1
        let normal = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        *value += (scale * normal) as f32;
    }
    values
}

fn unit<const D: usize>(shape: [usize; D]) -> Grid<D> {
    Grid { shape, step: [1.0; D] }
}

fn found<const D: usize>(values: &[f32], shape: [usize; D]) -> Vec<FeaturePoint<D>> {
    faults(values, &unit(shape), FaultOptions::default(), &mut Silent).unwrap()
}

fn faults<const D: usize>(
    values: &[f32],
    grid: &Grid<D>,
    options: FaultOptions,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, EnhanceError> {
    crate::enhance::thin::crests(&Faults(options), values, grid, watch)
}

/// The worst and the mean of some seeds.
fn scores<const D: usize>(
    scene: Scene,
    shape: [usize; D],
    seeds: u64,
    decibels: f64,
) -> (Score, Score) {
    let mut worst = Score { all: 1.0, thrown: 1.0, precision: 1.0 };
    let mut mean = Score::default();
    for seed in 0..seeds {
        let score = score(scene, shape, seed, decibels);
        println!("{scene} {shape:?}, {decibels} dB, seed {seed}: {score:.3?}");
        let fields = |s: &mut Score, by: &dyn Fn(f64, f64) -> f64| {
            s.all = by(s.all, score.all);
            s.thrown = by(s.thrown, score.thrown);
            s.precision = by(s.precision, score.precision);
        };
        fields(&mut worst, &f64::min);
        fields(&mut mean, &|sum, x| sum + x / seeds as f64);
    }
    println!("{scene} {shape:?}, {decibels} dB, mean: {mean:.3?}");
    (worst, mean)
}

/// Every seed's recall, where layers are torn by a sample or more, and the mean precision are at least those.
fn reaches<const D: usize>(scene: Scene, shape: [usize; D], seeds: u64) {
    for (decibels, recall, precision) in [(10.0, 0.85, 0.8), (3.0, 0.7, 0.65)] {
        let (worst, mean) = scores(scene, shape, seeds, decibels);
        assert!(worst.thrown >= recall, "{scene} {shape:?}, {decibels} dB: {worst:?}");
        assert!(mean.precision >= precision, "{scene} {shape:?}, {decibels} dB: {mean:?}");
    }
}

#[test]
fn faults_of_noisy_sections_are_found_and_little_else() {
    reaches(Scene::Section, [128, 128], 6);
}

#[test]
fn faults_of_a_noisy_volume_are_found_and_little_else() {
    reaches(Scene::Layers, [64; 3], 1);
}

/// The figures of larger images, and of all of the faults, also where they tear nothing.
///
/// `cargo test --profile quick -p atomesh --lib faults -- --ignored --nocapture`
#[test]
#[ignore = "minutes: volumes of 128³"]
fn the_figures_of_large_images() {
    reaches(Scene::Section, [256, 256], 10);
    reaches(Scene::Layers, [64; 3], 5);
    reaches(Scene::Layers, [128; 3], 5);
    for (decibels, recall) in [(10.0, 0.85), (3.0, 0.7)] {
        let (_, section) = scores(Scene::Section, [128, 128], 10, decibels);
        let (_, volume) = scores(Scene::Layers, [128; 3], 5, decibels);
        assert!(section.all >= recall && volume.all >= recall, "{section:?} {volume:?}");
    }
}

/// A plane through the middle, where layers are thrown by 4 samples: its crests are on it, and in every row.
fn plane_is_found<const D: usize>(shape: [usize; D], normal: [f64; D]) {
    let norm = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
    let distance = |p: [f64; D]| -> f64 {
        (0..D).map(|k| (p[k] - 0.5 * shape[k] as f64 + 0.3) * normal[k] / norm).sum()
    };
    let age = |p: [f64; D]| p[D - 1] - 0.1 * p[0] + if distance(p) > 0.0 { 4.0 } else { 0.0 };
    let crests = found(&layers(shape, age), shape);
    let inner = |p: &[f64; D]| (0..D).all(|k| (10.0..shape[k] as f64 - 11.0).contains(&p[k]));
    let (mut count, mut off) = (0, 0.0);
    for crest in crests.iter().filter(|c| inner(&c.position)) {
        let error = distance(crest.position);
        // the two samples at a jump are alike to within half a sample, and windows may tilt
        assert!(error.abs() < 1.0, "{error} at {:?} of {normal:?}", crest.position);
        let cosine: f64 = (0..D).map(|k| crest.normal[k] * normal[k] / norm).sum();
        // half a step of strike and two of dip, as windows end at the border
        assert!(cosine.abs() > 12f64.to_radians().cos(), "{:?} for {normal:?}", crest.normal);
        count += 1;
        off += error * error;
    }
    // one in each row across the plane that does not begin or end within the border
    let rows = (0..shape.iter().product::<usize>() / shape[0]).filter(|&row| {
        let mut p = [0.0; D];
        let rest = coordinates(row * shape[0], shape);
        p[1..].copy_from_slice(&rest[1..].iter().map(|&i| i as f64).collect::<Vec<_>>());
        p[0] = -distance(p) * norm / normal[0];
        inner(&p)
    });
    let rows = rows.count();
    assert!(rows > 30 && count as f64 > 0.97 * rows as f64, "{count} of {rows} for {normal:?}");
    assert!((off / count as f64).sqrt() < 0.4, "{} for {normal:?}", (off / count as f64).sqrt());
}

#[test]
fn a_plane_is_found_between_samples_with_its_normal() {
    for normal in [[1.0, 0.0], [1.0, 0.3], [1.0, -0.55], [-1.0, 0.9]] {
        plane_is_found([96, 80], normal);
    }
    for normal in [[1.0, 0.0, 0.0], [1.0, 0.35, -0.4], [-1.0, 0.7, 0.2]] {
        plane_is_found([52, 48, 56], normal);
    }
}

#[test]
fn a_tall_section_has_no_seams() {
    // three slabs; a crest in every row of depth
    let age = |p: [f64; 2]| p[1] + if p[0] > 30.3 { 3.0 } else { 0.0 };
    let crests = found(&layers([60, 600], age), [60, 600]);
    assert_eq!(crests.len(), 600);
    assert!(crests.iter().enumerate().all(|(row, crest)| crest.index / 60 == row));
}

#[test]
fn folded_layers_without_faults_have_none() {
    let folded = |p: &[f64]| 3.0 * (0.07 * p[0]).sin() + 2.0 * (0.11 * p[0] + 1.0).cos();
    let section = layers([160, 120], |p| p[1] - folded(&p) - 0.2 * p[0]);
    let volume = layers([56, 52, 60], |p| p[2] - folded(&p) - 2.0 * (0.08 * p[1]).sin());
    assert_eq!(found(&section, [160, 120]), []);
    assert_eq!(found(&volume, [56, 52, 60]), []);
    // in noise some groups may pass for a fault; one through the whole section has 120 crests
    let count =
        |decibels, seed| found(&with_noise(section.clone(), decibels, seed), [160, 120]).len();
    let quiet: Vec<usize> = (0..6).map(|seed| count(10.0, seed)).collect();
    let loud: Vec<usize> = (0..6).map(|seed| count(3.0, seed)).collect();
    println!("crests without faults: {quiet:?} at 10 dB, {loud:?} at 3 dB");
    assert!(quiet.iter().all(|&n| n <= 60) && loud.iter().all(|&n| n <= 120), "{quiet:?} {loud:?}");
    assert_eq!(found(&with_noise(volume, 3.0, 0), [56, 52, 60]), []);
}

#[test]
fn images_without_layers_have_no_faults() {
    for value in [0.0, 7.5, -1e30] {
        assert_eq!(found(&[value; 40 * 30], [40, 30]), []);
        assert_eq!(found(&[value; 12 * 10 * 11], [12, 10, 11]), []);
    }
}

#[test]
fn amplitudes_count_by_their_ratios() {
    let age = |p: [f64; 2]| p[1] + if p[0] > 30.3 + 0.4 * p[1] { 3.0 } else { 0.0 };
    let values = layers([90, 70], age);
    let plain = found(&values, [90, 70]);
    assert!(plain.len() > 50);
    // a power of two changes no rounding
    let scaled: Vec<f32> = values.iter().map(|v| v * 2f32.powi(40)).collect();
    let tiny: Vec<f32> = values.iter().map(|v| v * 2f32.powi(-40)).collect();
    assert_eq!(found(&scaled, [90, 70]), plain);
    assert_eq!(found(&tiny, [90, 70]), plain);
    // unsigned bytes have their zero elsewhere, and are rounded
    let bytes: Vec<f32> = values.iter().map(|v| (128.0 + 30.0 * v).round()).collect();
    let bytes = found(&bytes, [90, 70]);
    assert!(alike(&plain, &bytes, 0.2) > 0.97);
}

/// The share of crests of `a` with one of `b` so near, in samples.
fn alike<const D: usize>(a: &[FeaturePoint<D>], b: &[FeaturePoint<D>], near: f64) -> f64 {
    let close = |c: &&FeaturePoint<D>| {
        let squared = |o: &FeaturePoint<D>| {
            (0..D).map(|k| (c.position[k] - o.position[k]).powi(2)).sum::<f64>()
        };
        b.iter().any(|o| squared(o) < near * near)
    };
    a.iter().filter(close).count() as f64 / a.len().max(1) as f64
}

#[test]
fn mirrored_layers_have_mirrored_faults() {
    let shape = [128, 128];
    let (values, _) = noisy(Scene::Section, shape, 1, 10.0);
    let crests = found(&values, shape);
    let mirrored: Vec<f32> = values.chunks(128).flat_map(|row| row.iter().rev().copied()).collect();
    let mut back = found(&mirrored, shape);
    for crest in &mut back {
        crest.position[0] = 127.0 - crest.position[0];
        crest.normal[0] = -crest.normal[0];
    }
    // only ties and roundings know left from right; a weak end may be in one and not in the other
    assert!(crests.len() > 200);
    let alike = [alike(&crests, &back, 0.05), alike(&back, &crests, 0.05)];
    assert!(alike.iter().all(|&share| share > 0.98), "{alike:?}");
}

#[test]
fn axes_of_a_volume_are_alike() {
    let shape = [40, 44, 48];
    let age = |p: [f64; 3]| p[2] + if p[0] + 0.3 * p[1] + 0.2 * p[2] > 33.2 { 3.0 } else { 0.0 };
    let crests = found(&layers(shape, age), shape);
    let turned = found(&layers([44, 40, 48], |p| age([p[1], p[0], p[2]])), [44, 40, 48]);
    let turned: Vec<FeaturePoint<3>> = turned
        .into_iter()
        .map(|c| FeaturePoint { position: [c.position[1], c.position[0], c.position[2]], ..c })
        .collect();
    assert!(crests.len() > 1000);
    assert!(alike(&crests, &turned, 0.02) > 0.99 && alike(&turned, &crests, 0.02) > 0.99);
}

#[test]
fn spacing_turns_normals_and_nothing_else() {
    let shape = [90, 70];
    let slope = 0.4;
    let age = |p: [f64; 2]| p[1] + if p[0] > 30.3 + slope * p[1] { 3.0 } else { 0.0 };
    let values = layers(shape, age);
    let plain = found(&values, shape);
    let grid = Grid { shape, step: [25.0, 4.0] }; // metres and milliseconds
    let spaced = faults(&values, &grid, FaultOptions::default(), &mut Silent).unwrap();
    assert_eq!(plain.len(), spaced.len());
    for (a, b) in plain.iter().zip(&spaced) {
        assert_eq!((a.index, a.position, a.strength), (b.index, b.position, b.strength));
        // what lies on the fault in samples lies on it in lattice units
        let along = [-a.normal[1] * 25.0, a.normal[0] * 4.0];
        let across = along[0] * b.normal[0] + along[1] * b.normal[1];
        assert!(across.abs() < 1e-5, "{across}");
        assert!((b.normal[0].hypot(b.normal[1]) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    fn same<const D: usize>(scene: Scene, shape: [usize; D]) {
        let (values, _) = noisy(scene, shape, 2, 3.0);
        let run = |threads| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| found(&values, shape))
        };
        let one = run(1);
        assert!(!one.is_empty());
        assert_eq!(one, run(3));
    }
    same(Scene::Section, [120, 300]);
    same(Scene::Layers, [48, 40, 44]);
}

/// Counts steps, and breaks after some.
struct After {
    left: usize,
    last: f64,
}

impl Watch for After {
    fn step(&mut self, _: Phase, done: f64, _: Option<f64>) -> ControlFlow<()> {
        assert!((self.last..=1.0).contains(&done), "{done} after {}", self.last);
        self.last = done;
        if self.left == 0 {
            return ControlFlow::Break(());
        }
        self.left -= 1;
        ControlFlow::Continue(())
    }
}

#[test]
fn progress_ascends_and_work_may_be_cancelled_at_any_step() {
    let shape = [30, 28, 26];
    let values = layers(shape, |p| p[2] + if p[0] > 14.5 { 3.0 } else { 0.0 });
    let run = |left| {
        let mut watch = After { left, last: 0.0 };
        let result = faults(&values, &unit(shape), FaultOptions::default(), &mut watch);
        (result, 1000 - watch.left.min(1000), watch.last)
    };
    let (result, steps, last) = run(1000);
    assert!(result.is_ok() && last == 1.0 && steps > 8, "{steps} {last}");
    for left in [0, 1, steps / 2, steps - 1] {
        assert_eq!(run(left).0, Err(EnhanceError::Cancelled(Cancelled)));
    }
}

#[test]
fn options_out_of_range_are_refused_by_name() {
    let refused = |options: FaultOptions| {
        let result = faults(&[0.0, 1.0], &unit([2, 1]), options, &mut Silent);
        result.unwrap_err().to_string()
    };
    let good = FaultOptions::default();
    assert_eq!(
        refused(FaultOptions { least_dip: 5.0, ..good }),
        "least-dip of faults is 5; expected 20 to 85"
    );
    assert_eq!(
        refused(FaultOptions { layer_reach: f64::NAN, ..good }),
        "layer-reach of faults is NaN; expected 1 to 1000"
    );
    assert_eq!(
        refused(FaultOptions { crests: CrestOptions { low: Some(1.5), ..good.crests }, ..good }),
        "low of faults is 1.5; expected 0 to 1"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn any_amplitudes_give_crests_at_their_samples(
        shape in prop::array::uniform3(1usize..9),
        seed in 0u64..1000,
        flat in any::<bool>(),
    ) {
        fn hold<const D: usize>(shape: [usize; D], seed: u64) {
            let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
            let magnitude = [1.0, 1e-38, 1e18, f32::MAX / 4.0][(seed % 4) as usize];
            let count: usize = shape.iter().product();
            let values: Vec<f32> =
                (0..count).map(|_| magnitude * (random.random::<f32>() - 0.5)).collect();
            let crests = CrestOptions {
                low: Some(0.0),
                high: Some(0.0),
                least_length: Some(0.0),
                ..Default::default()
            };
            let options = FaultOptions { crests, ..Default::default() };
            for crest in faults(&values, &unit(shape), options, &mut Silent).unwrap() {
                let sample = coordinates(crest.index, shape);
                assert!((0..D).all(|k| (crest.position[k] - sample[k] as f64).abs() <= 0.5));
                let norm: f64 = crest.normal.iter().map(|n| n * n).sum();
                assert!((norm - 1.0).abs() < 1e-5 && (0.0..=1.0).contains(&crest.strength));
            }
        }
        if flat {
            hold([shape[0], shape[1]], seed);
        } else {
            hold(shape, seed);
        }
    }
}
