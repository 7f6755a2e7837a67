//! Images show what their truth says; options do what they say.

use super::*;
use crate::geometry::{difference, dot};
use crate::image::Samples;
use proptest::prelude::*;

fn scene_count(dimension: usize) -> usize {
    SCENES.iter().filter(|s| s.2 == dimension).count()
}

fn made<const D: usize>(scene: Scene, options: &SynthOptions<D>) -> (Vec<f32>, Truth<D>) {
    let Synthetic { image, truth } = synthesize(scene, options).unwrap();
    (image.samples().to_f32(), truth)
}

fn world<const D: usize>(options: &SynthOptions<D>, mut index: usize) -> Point<D> {
    std::array::from_fn(|k| {
        let i = index % options.shape[k];
        index /= options.shape[k];
        i as f64 * options.spacing[k]
    })
}

/// The mean of `values` at the samples whose distance to the truth `keep` accepts.
fn mean_at<const D: usize>(
    values: &[f32],
    truth: &Truth<D>,
    options: &SynthOptions<D>,
    keep: impl Fn(f64) -> bool,
) -> f64 {
    let kept: Vec<f64> = (0..values.len())
        .filter(|&i| keep(truth.distance(&world(options, i))))
        .map(|i| values[i].into())
        .collect();
    assert!(kept.len() > 20, "{} samples of {}", kept.len(), truth.scene);
    kept.iter().sum::<f64>() / kept.len() as f64
}

#[test]
fn names_are_those_of_the_scenes() {
    for (i, name) in Scene::NAMES.iter().enumerate() {
        let scene: Scene = name.parse().unwrap();
        assert_eq!(scene as usize, i, "the table is out of order");
        assert_eq!(scene.to_string(), *name);
        assert_eq!(serde_json::to_string(&scene).unwrap(), format!("\"{name}\""));
    }
    assert_eq!(scene_count(2) + scene_count(3), Scene::NAMES.len());
    let error = "fault".parse::<Scene>().unwrap_err().to_string();
    assert!(error.starts_with("no scene is named \"fault\"; expected one of faults, disc,"));
}

#[test]
fn dark_features_are_where_the_truth_says() {
    fn holds<const D: usize>(scene: Scene, options: &SynthOptions<D>) {
        let (values, truth) = made(scene, options);
        let near = mean_at(&values, &truth, options, |d| d <= 0.5);
        let far = mean_at(&values, &truth, options, |d| d >= 6.0);
        // a line is 0.97 dark on average within half a sample; the weakest traces have strength 0.6
        assert!(near < 0.45 * grey::BACKGROUND, "{scene} {}: {near}", options.seed);
        assert!((far - grey::BACKGROUND).abs() < 0.1, "{scene} {}: {far}", options.seed);
    }
    for seed in 0..5 {
        let plane = SynthOptions { seed, ..SynthOptions::new([96, 80]) };
        for scene in [Scene::Faults, Scene::Slit, Scene::SectionFaults] {
            holds(scene, &plane);
        }
        holds(Scene::LayersFaults, &SynthOptions { seed, ..SynthOptions::new([48, 40, 44]) });
    }
}

#[test]
fn the_grey_of_faults_is_a_gaussian_of_their_distance() {
    fn holds<const D: usize>(scene: Scene, options: &SynthOptions<D>) {
        let (values, truth) = made(scene, options);
        let step = options.spacing.into_iter().fold(0.0, f64::max);
        for (i, &value) in values.iter().enumerate() {
            let u = truth.distance(&world(options, i)) / (1.25 * step);
            // to the last bit, though far faults are passed over
            let grey = grey::BACKGROUND + (grey::DARK - grey::BACKGROUND) * (-0.5 * u * u).exp();
            assert_eq!(value, grey as f32, "{scene} {i}");
        }
    }
    holds(Scene::SectionFaults, &SynthOptions { seed: 7, ..SynthOptions::new([96, 80]) });
    let spacing = [1.0, 2.0, 1.5];
    holds(Scene::LayersFaults, &SynthOptions { spacing, ..SynthOptions::new([48, 40, 44]) });
}

#[test]
fn edges_are_where_the_truth_says() {
    /// |Δ| along x over two samples: large on edges only.
    fn holds<const D: usize>(scene: Scene, options: &SynthOptions<D>) {
        let (values, truth) = made(scene, options);
        let n = options.shape[0];
        let steps: Vec<f32> = (0..values.len())
            .map(|i| {
                let inside = i % n > 0 && i % n + 1 < n;
                if inside { (values[i + 1] - values[i - 1]).abs() } else { 0.0 }
            })
            .collect();
        let near = mean_at(&steps, &truth, options, |d| d <= 0.5);
        // two samples and the half over which an edge is mixed, along any diagonal
        let far = mean_at(&steps, &truth, options, |d| d >= 2.0);
        assert!(near > 15.0, "{scene} {}: {near}", options.seed);
        assert_eq!(far, 0.0, "{scene} {}", options.seed);
    }
    for seed in 0..5 {
        let plane = SynthOptions { seed, ..SynthOptions::new([64, 72]) };
        holds(Scene::Disc, &plane);
        holds(Scene::Grains, &plane);
        let space = SynthOptions { seed, ..SynthOptions::new([32, 36, 40]) };
        holds(Scene::Sphere, &space);
        holds(Scene::Grains3, &space);
    }
}

#[test]
fn layers_break_at_faults_and_nowhere_else() {
    let options = SynthOptions { seed: 3, ..SynthOptions::new([64, 64, 64]) };
    let (_, truth) = made(Scene::Layers, &options);
    let layers = truth.layers.as_ref().unwrap();
    let throws = serde_json::to_value(layers).unwrap()["throws"].clone();
    for (i, feature) in truth.features.iter().enumerate() {
        let Geometry::Disk { center, normal, radius } = feature.geometry else { unreachable!() };
        let throw = throws[i].as_f64().unwrap();
        let beside = |p: &Point<3>, h: f64| std::array::from_fn(|k| p[k] + h * normal[k]);
        let jump = |p: &Point<3>| layers.age(&beside(p, 1e-9)) - layers.age(&beside(p, -1e-9));
        // the other faults do not jump here unless their disks cross at this very point
        assert!((jump(&center) + throw).abs() < 1e-6, "{} {throw}", jump(&center));
        // a horizontal direction within the disk
        let across = [-normal[1], normal[0], 0.0];
        let across = across.map(|x| x / dot(&across, &across).sqrt());
        let rim: Point<3> = std::array::from_fn(|k| center[k] + 1.001 * radius * across[k]);
        assert!(jump(&rim).abs() < 1e-6);
    }
    // a depth of one sample is never 5 samples of age where no fault lies between
    let mut smooth = 0;
    for index in (0..64 * 64 * 64).step_by(97) {
        let p = world(&options, index);
        let below = [p[0], p[1], p[2] + 0.5];
        if truth.distance(&p) > 1.0 {
            let slope = (layers.age(&below) - layers.age(&p)) / 0.5;
            assert!((slope - 1.0).abs() < 0.8, "{slope} at {p:?}");
            smooth += 1;
        }
    }
    assert!(smooth > 1000);
}

#[test]
fn a_ball_has_its_measure() {
    fn holds<const D: usize>(scene: Scene, shape: [usize; D], unit_ball: f64) {
        let options = SynthOptions { seed: 7, ..SynthOptions::new(shape) };
        let (values, truth) = made(scene, &options);
        let Geometry::Sphere { radius, .. } = truth.features[0].geometry else { unreachable!() };
        let middle = ((grey::INSIDE + grey::OUTSIDE) / 2.0) as f32;
        let count = values.iter().filter(|&&v| v > middle).count() as f64;
        let expected = unit_ball * radius.powi(D as i32);
        // counting errs by far less than one sample in thickness over the whole surface
        let surface = D as f64 * expected / radius;
        assert!((count - expected).abs() < 0.2 * surface, "{count} {expected}");
    }
    use std::f64::consts::PI;
    holds(Scene::Disc, [90, 80], PI);
    holds(Scene::Sphere, [50, 60, 48], 4.0 / 3.0 * PI);
}

#[test]
fn noise_has_the_deviation_asked_for_and_leaves_the_rest_alone() {
    let quiet = SynthOptions { seed: 5, ..SynthOptions::new([200, 150]) };
    let noisy = SynthOptions { noise: 0.2, ..quiet };
    let (before, truth) = made(Scene::Disc, &quiet);
    let (after, same) = made(Scene::Disc, &noisy);
    assert_eq!(truth, same);
    let n = before.len() as f64;
    let added: Vec<f64> = before.iter().zip(&after).map(|(a, b)| f64::from(b - a)).collect();
    let mean = added.iter().sum::<f64>() / n;
    let deviation = (added.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
    let expected = 0.2 * (grey::INSIDE - grey::OUTSIDE);
    // five standard errors of a mean and of a deviation
    assert!(mean.abs() < 5.0 * expected / n.sqrt(), "{mean}");
    assert!((deviation - expected).abs() < 5.0 * expected / (2.0 * n).sqrt(), "{deviation}");
    // white: neighbours do not know of each other
    let product: f64 = added.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum();
    assert!((product / n).abs() < 5.0 * expected * expected / n.sqrt());
}

#[test]
fn blur_keeps_the_mean_and_lowers_the_contrast() {
    let sharp = SynthOptions { seed: 1, ..SynthOptions::new([64, 64]) };
    let (a, _) = made(Scene::Slit, &sharp);
    let (b, _) = made(Scene::Slit, &SynthOptions { blur: 2.0, ..sharp });
    let mean = |v: &[f32]| v.iter().map(|&x| f64::from(x)).sum::<f64>() / v.len() as f64;
    // mirrored edges keep the sum, to single precision
    assert!((mean(&a) - mean(&b)).abs() < 1e-3);
    // a line of deviation 1.25 blurred by 2 keeps 1.25/√(1.25² + 2²) = 0.53 of its depth
    let least = |v: &[f32]| v.iter().copied().fold(f32::INFINITY, f32::min);
    let kept = (grey::BACKGROUND as f32 - least(&b)) / (grey::BACKGROUND as f32 - least(&a));
    assert!((kept - 0.53).abs() < 0.03, "{kept}");
}

#[test]
fn the_same_options_give_the_same_bytes_at_any_thread_count() {
    fn bytes<const D: usize>(options: &SynthOptions<D>, threads: usize) -> Vec<Vec<f32>> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let scenes = SCENES.iter().filter(|s| s.2 == D).map(|s| s.0);
        pool.install(|| scenes.map(|scene| made(scene, options).0).collect())
    }
    let plane = SynthOptions { noise: 0.1, blur: 0.7, ..SynthOptions::new([97, 81]) };
    let space = SynthOptions { noise: 0.1, blur: 0.7, ..SynthOptions::new([31, 27, 23]) };
    assert_eq!(bytes(&plane, 1), bytes(&plane, 3));
    assert_eq!(bytes(&space, 1), bytes(&space, 3));
    for (a, b) in bytes(&plane, 1).iter().zip(bytes(&SynthOptions { seed: 1, ..plane }, 1)) {
        assert_ne!(*a, b);
    }
}

#[test]
fn words_are_those_of_pcg_64_and_pieces_of_noise_join() {
    // the first output of the reference pcg64 seeded as below, from the PCG paper's demo program
    use rand::Rng;
    let mut reference = rand_pcg::Pcg64::new(42, 54);
    assert_eq!(reference.next_u64(), 0x86b1_da1d_7206_2b68);
    let mut later = random::Random::noise(9, 5);
    let mut whole = random::Random::noise(9, 0);
    let skipped = (0..5).map(|_| whole.unit()).collect::<Vec<f64>>();
    assert!(!skipped.contains(&later.unit()));
    let mut later = random::Random::noise(9, 5);
    assert_eq!(later.unit(), whole.unit());
}

#[test]
fn bytes_are_the_rounded_samples() {
    let options = SynthOptions { noise: 0.5, ..SynthOptions::new([40, 30]) };
    let (floats, _) = made(Scene::Faults, &options);
    let image = synthesize(Scene::Faults, &SynthOptions { bytes: true, ..options }).unwrap().image;
    let Samples::U8(bytes) = image.samples() else { panic!("{}", image.samples().type_name()) };
    for (&byte, &float) in bytes.iter().zip(&floats) {
        assert!((f32::from(byte) - float.clamp(0.0, 255.0)).abs() <= 0.5);
    }
    assert!(bytes.contains(&0) && bytes.contains(&255));
}

#[test]
fn spacing_stretches_the_world() {
    let options = SynthOptions { spacing: [1.0, 1.0, 4.0], ..SynthOptions::new([40, 40, 11]) };
    let Synthetic { image, truth } = synthesize(Scene::Sphere, &options).unwrap();
    assert_eq!(image.frame().spacing(), [1.0, 1.0, 4.0]);
    let Geometry::Sphere { center, radius } = truth.features[0].geometry else { unreachable!() };
    assert!(radius > 0.28 * 39.0 && (center[2] - 20.0).abs() < 0.04 * 40.0);
    let inside = image.samples().to_f32().iter().filter(|&&v| v > 130.0).count() as f64;
    let expected = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3) / 4.0;
    assert!((inside / expected - 1.0).abs() < 0.1);
}

#[test]
fn distances_are_the_least_over_the_feature() {
    let options = SynthOptions { seed: 11, ..SynthOptions::new([64, 64]) };
    let (_, truth) = made(Scene::Faults, &options);
    let Geometry::Path { points } = &truth.features[0].geometry else { unreachable!() };
    for index in (0..64 * 64).step_by(61) {
        let p = world(&options, index);
        let dense = points.windows(2).flat_map(|s| {
            let edge = difference(&s[1], &s[0]);
            (0..=100).map(move |t| {
                let q: Point<2> = std::array::from_fn(|k| s[0][k] + 0.01 * f64::from(t) * edge[k]);
                crate::geometry::distance_squared(&p, &q).sqrt()
            })
        });
        let slow = dense.fold(f64::INFINITY, f64::min);
        let fast = truth.features[0].geometry.distance(&p);
        // a hundredth of a segment of half a sample
        assert!(fast <= slow + 1e-12 && slow - fast < 0.005, "{fast} {slow}");
        assert!(truth.distance(&p) <= fast);
    }
}

#[test]
fn no_grain_boundary_is_nearer_than_the_distance() {
    let options = SynthOptions { seed: 2, ..SynthOptions::new([64, 64]) };
    let (_, truth) = made(Scene::Grains, &options);
    let Geometry::Grains { centers } = &truth.features[0].geometry else { unreachable!() };
    let grain = |p: &Point<2>| {
        let remote = |i: &usize| crate::geometry::distance_squared(p, &centers[*i]);
        (0..centers.len()).min_by(|a, b| remote(a).total_cmp(&remote(b))).unwrap()
    };
    for index in (0..64 * 64).step_by(61) {
        let p = world(&options, index);
        let distance = truth.distance(&p);
        let around = |r: f64| {
            (0..720).map(move |t| {
                let (s, c) = (f64::from(t) * std::f64::consts::TAU / 720.0).sin_cos();
                [p[0] + r * c, p[1] + r * s]
            })
        };
        assert!(around(0.999 * distance).all(|q| grain(&q) == grain(&p)));
        assert!(around(1.001 * distance + 1e-9).any(|q| grain(&q) != grain(&p)));
    }
}

#[test]
fn the_description_holds_the_geometry() {
    let (_, truth) = made(Scene::Disc, &SynthOptions::new([20, 30]));
    let json = serde_json::to_value(&truth).unwrap();
    assert_eq!(json["scene"], "disc");
    assert_eq!(json["shape"], serde_json::json!([20, 30]));
    assert_eq!(json["features"][0]["role"], "outline");
    let Geometry::Sphere { center, radius } = truth.features[0].geometry else { unreachable!() };
    assert_eq!(json["features"][0]["center"], serde_json::json!(center));
    assert_eq!(json["features"][0]["radius"], radius);
    assert!(json["layers"].is_null());
}

#[test]
fn unsound_options_are_refused_by_name() {
    let good = SynthOptions::new([16, 16]);
    let message = |scene, options: SynthOptions<2>| {
        synthesize(scene, &options).err().map(|e| e.to_string()).unwrap_or_default()
    };
    assert_eq!(
        message(Scene::Sphere, good),
        "the scene sphere is 3-dimensional; the shape has 2 axes"
    );
    assert_eq!(
        message(Scene::Disc, SynthOptions { shape: [16, 7], ..good }),
        "7 samples along axis 1; expected at least 8"
    );
    assert_eq!(
        message(Scene::Disc, SynthOptions { noise: f64::NAN, ..good }),
        "noise NaN; expected a share of the contrast, at least 0 and at most 100"
    );
    assert_eq!(
        message(Scene::Disc, SynthOptions { blur: -1.0, ..good }),
        "blur -1 samples; expected at least 0 and at most 1000"
    );
    assert!(
        message(Scene::Disc, SynthOptions { spacing: [1.0, 0.0], ..good }).contains("spacing 0")
    );
    assert_eq!(
        message(Scene::Disc, SynthOptions { spacing: [1.0, 25.0], ..good }),
        "the image is 15 thin and its samples up to 25 apart; expected at least 7 times as much"
    );
    let huge = SynthOptions::new([1 << 28, 1 << 28]);
    assert!(message(Scene::Disc, huge).starts_with("no memory for an image of shape"));
    let absurd = SynthOptions::new([usize::MAX, usize::MAX]);
    assert!(message(Scene::Disc, absurd).contains("too many to address"));
}

/// An image with finite samples and features in it, or a refusal.
fn sound<const D: usize>(scene: Scene, options: &SynthOptions<D>) {
    match synthesize(scene, options) {
        Ok(Synthetic { image, truth }) => {
            assert_eq!(image.frame().shape(), options.shape);
            let range = image.samples().range();
            assert_eq!(range.nan_count + range.infinite_count, 0);
            assert!(range.max > range.min, "{scene} is constant for {options:?}");
            assert!(!truth.features.is_empty());
            let middle = std::array::from_fn(|k| 0.5 * options.shape[k] as f64);
            assert!(truth.distance(&middle).is_finite());
        }
        Err(error) => {
            let few = options.shape.iter().any(|&n| n < LEAST_COUNT);
            let uneven = options.spacing != [options.spacing[0]; D];
            match error {
                SynthError::Count { .. } => assert!(few, "{options:?}"),
                SynthError::Thin { .. } => assert!(uneven, "{options:?}"),
                _ => panic!("{error} for {options:?}"),
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn every_shape_gives_an_image_or_a_refusal(
        shape in prop::array::uniform3(0usize..28),
        spacing in prop::array::uniform3(prop::sample::select(vec![1.0, 0.25, 25.0])),
        seed in any::<u64>(),
        noise in prop::sample::select(vec![0.0, 0.3]),
        blur in prop::sample::select(vec![0.0, 0.5, 40.0]),
        bytes in any::<bool>(),
    ) {
        let shape2 = [2 * shape[0], shape[1]];
        let plane = SynthOptions { shape: shape2, spacing: [spacing[0], spacing[1]], seed, noise, blur, bytes: false };
        let space = SynthOptions { shape, spacing, seed, noise, blur: blur.min(2.0), bytes };
        for &(scene, _, dimension) in &SCENES {
            if dimension == 2 { sound(scene, &plane) } else { sound(scene, &space) }
        }
    }
}
