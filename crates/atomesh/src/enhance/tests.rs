use super::*;
use crate::image::Frame;
use crate::image::Units;
use crate::watch::{Cancelled, Silent};
use std::ops::ControlFlow;

fn image<const D: usize>(shape: [usize; D], samples: Samples) -> Image<D> {
    Image::new(Frame::new(shape).unwrap(), samples).unwrap()
}

fn run<const D: usize>(image: &Image<D>, options: FeatureOptions) -> Enhanced<D> {
    enhance(image, &options, &mut Silent).unwrap()
}

fn with(features: Features) -> FeatureOptions {
    FeatureOptions { features, smooth: Some(0.0), ..Default::default() }
}

/// A background of 153 ± 3, a dark line of 10 ± 3 in every 40th column, and one sample of 255.
fn lines() -> Vec<u8> {
    let mut grey: Vec<u8> = (0..200 * 100)
        .map(|i| if i % 40 == 20 { 10 } else { 153 } + (i * 7919 % 7) as u8 - 3)
        .collect();
    grey[77] = 255;
    grey
}

#[test]
fn dark_features_are_at_minus_one_and_the_background_at_zero() {
    let b = run(&image([200, 100], Samples::U8(lines().into())), with(Features::Dark)).values;
    for (i, &b) in b.iter().enumerate() {
        // the noise is ±3 of a contrast of 143
        let expected = if i % 40 == 20 { -1.0 } else { 0.0 };
        assert!((b - expected).abs() <= 7.0 / 143.0 && (-1.0..=0.0).contains(&b), "{b} at {i}");
    }
}

#[test]
fn dark_features_are_rounded_off_unless_sharp_ones_are_asked_for() {
    let mut grey = vec![200u8; 41 * 41];
    (0..41).for_each(|y| grey[20 + 41 * y] = 0);
    let b = run(&image([41, 41], Samples::U8(grey.into())), FeatureOptions::default()).values;
    // A line of one sample under the sampled Gaussian of σ = 1, cut at 4 σ: its middle weight.
    let weight = |k: f64| f64::exp(-0.5 * k * k);
    let middle = 1.0 / (1.0 + 2.0 * (weight(1.0) + weight(2.0) + weight(3.0) + weight(4.0)));
    assert!((f64::from(b[20 + 41 * 20]) + middle).abs() < 1e-6, "{} {middle}", b[20 + 41 * 20]);
}

#[test]
fn bright_is_dark_of_the_negative() {
    let grey = lines();
    let negative = grey.iter().map(|g| 255 - g).collect();
    let dark = run(&image([200, 100], Samples::U8(grey.into())), with(Features::Dark));
    let bright = run(&image([200, 100], Samples::U8(negative)), with(Features::Bright));
    for (d, b) in dark.values.iter().zip(&bright.values) {
        assert!((d - b).abs() < 1e-6);
    }
}

#[test]
fn the_unit_of_the_samples_does_not_matter() {
    let of = |scale: f64, offset: f64, features| {
        let samples = lines().iter().map(|&g| f64::from(g) * scale + offset).collect();
        run(&image([200, 100], Samples::F64(samples)), with(features)).values
    };
    for features in [Features::Dark, Features::Bright, Features::Edges] {
        let plain = of(1.0, 0.0, features);
        for (scale, offset) in [(1e-300, 0.0), (1e300, 0.0), (1e-3, 1e6), (7e305, -9e307)] {
            for (a, b) in plain.iter().zip(of(scale, offset, features)) {
                assert!((a - b).abs() < 1e-4, "{a} {b} at scale {scale}, offset {offset}");
            }
        }
    }
}

#[test]
fn samples_of_any_type_give_the_same_potential_to_the_last_bit() {
    let bytes = lines();
    // counted by value, looked up, or neither: offsets of small whole numbers round nowhere
    let kinds = [
        Samples::I8(bytes.iter().map(|&s| (i16::from(s) - 128) as i8).collect()),
        Samples::U16(bytes.iter().map(|&s| 40_000 + u16::from(s)).collect()),
        Samples::I16(bytes.iter().map(|&s| i16::from(s) - 300).collect()),
        Samples::I32(bytes.iter().map(|&s| i32::from(s) - 1000).collect()),
        Samples::F32(bytes.iter().map(|&s| f32::from(s)).collect()),
        Samples::F64(bytes.iter().map(|&s| f64::from(s) + 7.0).collect()),
    ];
    for features in [Features::Dark, Features::Bright, Features::Edges] {
        let options = FeatureOptions { features, ..Default::default() };
        let expected = run(&image([200, 100], Samples::U8(bytes.clone().into())), options).values;
        for samples in &kinds {
            let found = run(&image([200, 100], samples.clone()), options).values;
            assert!(found == expected, "{features:?} {}", samples.type_name());
        }
    }
}

#[test]
fn sparse_features_on_a_flat_background_are_found() {
    let mut likelihood = vec![0.0f32; 100 * 100];
    likelihood[5000..5020].fill(0.8);
    let b = run(&image([100, 100], Samples::F32(likelihood.into())), with(Features::Bright)).values;
    assert!(b[5000..5020].iter().all(|&b| b == -1.0));
    assert_eq!(b.iter().filter(|&&b| b == 0.0).count(), 9980);
}

#[test]
fn features_that_fill_most_of_the_image_take_the_whole_range() {
    let grey = (0..1000).map(|i| if i % 10 < 7 { 20 } else { 200 }).collect();
    let b = run(&image([100, 10], Samples::U8(grey)), with(Features::Dark)).values;
    assert!(b.iter().enumerate().all(|(i, &b)| b == if i % 10 < 7 { -1.0 } else { 0.0 }));
}

#[test]
fn edges_are_valleys_at_the_steps_in_both_operators() {
    let steps = Samples::U8((0..60 * 20 * 20).map(|i| (i % 60 / 20 * 50) as u8).collect());
    for edge_operator in [EdgeOperator::Gaussian, EdgeOperator::Prewitt] {
        let options = FeatureOptions { edge_operator, ..with(Features::Edges) };
        let b = run(&image([60, 20, 20], steps.clone()), options).values;
        let row = &b[7800..7860];
        for at in [19, 20, 39, 40] {
            assert!(row[at] < -0.99, "{row:?}");
        }
        assert!(row[0] > -1e-3 && row[29] > -0.01 && row[59] > -1e-3, "{row:?}");
    }
}

#[test]
fn a_single_edge_in_a_large_image_is_an_edge() {
    let mut grey = vec![0u8; 200 * 200];
    grey[20_100] = 9;
    let options = FeatureOptions { edge_operator: EdgeOperator::Prewitt, ..with(Features::Edges) };
    let b = run(&image([200, 200], Samples::U8(grey.into())), options);
    assert!(!b.constant && b.values[20_099] < -0.6);
}

#[test]
fn constant_images_have_no_features_and_say_so() {
    for features in [Features::Dark, Features::Bright, Features::Edges, Features::None] {
        for samples in [Samples::U8(vec![7; 60].into()), Samples::F32(vec![-1e30; 60].into())] {
            let found = run(&image([20, 3], samples), with(features));
            assert!(found.values.iter().all(|&b| b == 0.0));
            assert_eq!(found.constant, features != Features::None);
        }
    }
}

#[test]
fn images_of_one_sample_or_one_row_are_images() {
    for features in [Features::Dark, Features::Bright, Features::Edges] {
        assert!(run(&image([1, 1, 1], Samples::I16(vec![-5].into())), with(features)).constant);
        let row: Vec<i32> = (0..50).map(|i| i32::from(i > 30) * 1000).collect();
        let b = run(&image([1, 50], Samples::I32(row.into())), with(features)).values;
        assert!(b.iter().any(|&b| b < -0.9) && b.iter().any(|&b| b > -0.1), "{b:?}");
    }
}

#[test]
fn smoothing_is_in_lattice_units() {
    let mut grey = vec![200u8; 41 * 41];
    grey[20 * 41 + 20] = 0;
    let frame = Frame::new([41, 41]).unwrap().with_spacing([1.0, 4.0]).unwrap();
    let image = Image::new(frame, Samples::U8(grey.into())).unwrap();
    let options = FeatureOptions { smooth: Some(4.0), ..Default::default() };
    let physical = run(&image, options).values;
    // a distance of 4 units is one row, or four columns
    assert!((physical[21 * 41 + 20] / physical[20 * 41 + 24] - 1.0).abs() < 1e-3);
    let samples = run(&image, FeatureOptions { units: Units::Samples, ..options }).values;
    assert!((samples[24 * 41 + 20] / samples[20 * 41 + 24] - 1.0).abs() < 1e-5);
}

#[test]
fn repelling_negates() {
    let image = image([200, 100], Samples::U8(lines().into()));
    let attract = run(&image, with(Features::Dark)).values;
    let repel = run(&image, FeatureOptions { repel: true, ..with(Features::Dark) }).values;
    assert!(attract.iter().zip(&repel).all(|(a, r)| -a == *r && r.is_sign_positive()));
}

#[test]
fn samples_that_are_not_finite_are_counted_and_named() {
    let mut samples = vec![1.0f32; 30];
    samples[7] = f32::INFINITY;
    samples[11] = f32::NAN;
    let error = enhance(
        &image([10, 3], Samples::F32(samples.into())),
        &FeatureOptions::default(),
        &mut Silent,
    );
    let value = f64::INFINITY;
    assert_eq!(error, Err(EnhanceError::NotFinite { count: 2, first: 7, value }));
}

#[test]
fn bad_options_are_refused() {
    let image = image([10, 3], Samples::U8(vec![0; 30].into()));
    for value in [0.0, 0.29, -1.0, f64::NAN, f64::INFINITY] {
        let options = FeatureOptions { edge_scale: value, ..Default::default() };
        let error = enhance(&image, &options, &mut Silent).unwrap_err();
        assert!(matches!(error, EnhanceError::EdgeScale { .. }));
    }
    for value in [-1.0, f64::NAN, f64::INFINITY] {
        let options = FeatureOptions { smooth: Some(value), ..Default::default() };
        let error = enhance(&image, &options, &mut Silent).unwrap_err();
        assert!(matches!(error, EnhanceError::Smooth { .. }));
    }
}

#[test]
fn a_watch_can_end_it() {
    struct Impatient(u32);
    impl Watch for Impatient {
        fn step(&mut self, phase: Phase, done: f64, _: Option<f64>) -> ControlFlow<()> {
            assert!(phase == Phase::Potential && (0.0..=1.0).contains(&done));
            self.0 -= 1;
            if self.0 == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
    }
    let image = image([200, 100], Samples::U8(lines().into()));
    for steps in 1..=4 {
        let found = enhance(&image, &with(Features::Edges), &mut Impatient(steps));
        assert_eq!(found, Err(EnhanceError::Cancelled(Cancelled)));
    }
}

#[test]
fn given_potentials_are_checked_and_never_rescaled() {
    let kept = given_potential(Samples::F32(vec![-1.0, 0.25, 1.0].into())).unwrap();
    assert_eq!(kept, [-1.0, 0.25, 1.0]);
    let error = given_potential(Samples::U8(vec![1, 0, 255].into()));
    assert_eq!(error, Err(EnhanceError::OutOfRange { index: 2, value: 255.0 }));
    let error = given_potential(Samples::F64(vec![0.0, f64::NAN].into()));
    assert!(matches!(error, Err(EnhanceError::OutOfRange { index: 1, value }) if value.is_nan()));
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let samples = (0..70 * 60 * 50u64).map(|i| (i * i % 251) as u8).collect();
    let image = image([70, 60, 50], Samples::U8(samples));
    let at = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = FeatureOptions { smooth: Some(1.0), ..with(Features::Edges) };
        pool.install(|| enhance(&image, &options, &mut Silent).unwrap())
    };
    assert_eq!(at(1), at(3));
}

/// Layers that dip along x, without a fault; zeros where `absent` is true.
fn dipping_layers(shape: [usize; 3], absent: &[bool]) -> Samples {
    let value = |i: usize| {
        let [x, y, z] = crate::image::coordinates(i, shape).map(|x| x as f64);
        let depth = z - 0.3 * x - 0.1 * y;
        if absent[i] { 0.0 } else { (0.7 * depth).sin() + (1.13 * depth + 1.0).sin() }
    };
    Samples::F64((0..absent.len()).map(value).collect())
}

#[test]
fn the_rim_of_what_is_absent_is_no_feature() {
    let shape = [30, 28, 26];
    let count = shape.iter().product();
    // a corner beyond a slanted rim, and one column within
    let absent: Vec<bool> = (0..count)
        .map(|i| {
            let [x, y, _] = crate::image::coordinates(i, shape);
            x + y > 40 || (x, y) == (9, 12)
        })
        .collect();
    let zeros = image(shape, dipping_layers(shape, &absent));
    let faults = FeatureOptions { features: Features::Faults, ..Default::default() };
    // taken as samples, the zeros are a fault
    assert!(!run(&zeros, faults).constant);
    let missing = zeros.with_absent(absent.clone()).unwrap();
    assert!(run(&missing, faults).constant);
    assert_eq!(feature_points(&missing, &faults, &mut Silent).unwrap().unwrap().len(), 0);
}

#[test]
fn features_end_where_data_do_and_stay_as_they_are_elsewhere() {
    let shape = [40, 40];
    let grey: Vec<u8> = (0..1600).map(|i| if i % 40 < 20 { 40 } else { 200 }).collect();
    let absent: Vec<bool> = (0..1600).map(|i| i / 40 < 12).collect();
    let mut cut = grey.clone();
    cut[..12 * 40].fill(255);
    let whole = image(shape, Samples::U8(grey.into()));
    let part = image(shape, Samples::U8(cut.into())).with_absent(absent).unwrap();
    for features in [Features::Edges, Features::Dark] {
        let (whole, part) = (run(&whole, with(features)), run(&part, with(features)));
        assert!(part.values[..12 * 40].iter().all(|&b| b == 0.0), "{features:?}");
        // the image is the same in all rows, so that mirrored rows are as those that are missing
        let same = whole.values[12 * 40..].iter().zip(&part.values[12 * 40..]);
        same.for_each(|(a, b)| assert!((a - b).abs() < 1e-6, "{features:?}: {a} {b}"));
    }
    let points = feature_points(&part, &with(Features::Edges), &mut Silent).unwrap().unwrap();
    assert!(!points.is_empty() && points.iter().all(|p| p.position[1] > 11.0), "{points:?}");
    // where none are asked for, none are missed
    assert!(!run(&part, with(Features::None)).constant);
}
