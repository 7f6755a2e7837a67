//! What a field promises between its samples and beyond, whatever the interpolation.

use super::*;
use crate::geometry::Point;
use crate::image::Grid;

fn sampled<const D: usize>(
    shape: [usize; D],
    step: [f64; D],
    b: impl Fn(&Point<D>) -> f64,
    interpolation: Interpolation,
) -> ScalarField<D> {
    let grid = Grid { shape, step };
    let samples = (0..grid.sample_count()).map(|i| b(&grid.position(i)) as f32).collect();
    ScalarField::new(grid, samples, interpolation).unwrap()
}

/// A value and gradient that agree with a plane, wherever they are read.
fn plane_is_exact<const D: usize>(interpolation: Interpolation) {
    let step = std::array::from_fn(|k| 0.5 + k as f64);
    let slope: [f64; D] = std::array::from_fn(|k| 0.004 * (k as f64 + 1.0));
    let potential = sampled(
        [25; D],
        step,
        |p| -0.9 + (0..D).map(|k| slope[k] * p[k]).sum::<f64>(),
        interpolation,
    );
    // The spline mirrors the plane at the ends, which bends it there; the bend falls by 0.27 a
    // sample, so that 12 samples away 1e-7 of it is left.
    let p = std::array::from_fn(|k| 12.25 * step[k]);
    let mut gradient = [0.0; D];
    let value = potential.value_and_gradient(&p, &mut gradient);
    let expected = -0.9 + (0..D).map(|k| slope[k] * p[k]).sum::<f64>();
    let tolerance = 1e-6; // some roundings of samples in single precision, 6e-8 each
    assert!((value - expected).abs() < tolerance, "{value} {expected}");
    for k in 0..D {
        assert!((gradient[k] - slope[k]).abs() < 5.0 * tolerance, "{gradient:?} {slope:?}");
    }
}

#[test]
fn a_plane_is_read_exactly_between_samples() {
    plane_is_exact::<2>(Interpolation::Linear);
    plane_is_exact::<3>(Interpolation::Linear);
    plane_is_exact::<2>(Interpolation::Spline);
    plane_is_exact::<3>(Interpolation::Spline);
}

fn wave<const D: usize>(p: &Point<D>) -> f64 {
    p.iter().enumerate().map(|(k, x)| (0.7 * x + k as f64).sin()).product::<f64>() * 0.9
}

fn gradient_is_slope<const D: usize>(interpolation: Interpolation) {
    let potential =
        sampled([12; D], [1.0, 0.75, 1.5][..D].try_into().unwrap(), wave, interpolation);
    for trial in 0..50 {
        // off the samples, where the linear gradient jumps
        let p: Point<D> =
            std::array::from_fn(|k| 1.13 + 0.131 * f64::from(trial) + 0.21 * k as f64);
        let mut gradient = [0.0; D];
        potential.value_and_gradient(&p, &mut gradient);
        for k in 0..D {
            let h = 1e-5;
            let (mut low, mut high) = (p, p);
            low[k] -= h;
            high[k] += h;
            let slope = (potential.value(&high) - potential.value(&low)) / (2.0 * h);
            assert!((slope - gradient[k]).abs() < 1e-6, "{interpolation:?} {p:?} axis {k}");
        }
    }
}

#[test]
fn gradients_are_the_slopes_of_the_values() {
    for interpolation in [Interpolation::Linear, Interpolation::Spline] {
        gradient_is_slope::<2>(interpolation);
        gradient_is_slope::<3>(interpolation);
    }
}

#[test]
fn every_way_passes_through_the_samples() {
    for interpolation in [Interpolation::Nearest, Interpolation::Linear, Interpolation::Spline] {
        let potential = sampled([7, 5], [2.0, 0.5], wave, interpolation);
        for j in 0..5 {
            for i in 0..7 {
                let p = [2.0 * i as f64, 0.5 * j as f64];
                let b = f64::from(potential.samples()[i + 7 * j]);
                assert!((potential.value(&p) - b).abs() < 2e-6, "{interpolation:?} {i} {j}");
            }
        }
    }
}

#[test]
fn thin_images_and_points_outside_are_read_without_a_panic() {
    for interpolation in [Interpolation::Nearest, Interpolation::Linear, Interpolation::Spline] {
        let potential = sampled([1, 4], [1.0, 1.0], |_| -0.5, interpolation);
        for p in [[-3.0, -9.0], [0.0, 1.5], [99.0, 99.0], [f64::NAN, 0.0]] {
            let value = potential.value(&p);
            assert!(
                value.is_nan() || (value + 0.5).abs() < 1e-6,
                "{interpolation:?} {p:?} {value}"
            );
        }
    }
}

#[test]
fn values_outside_the_range_are_refused_with_their_place() {
    let grid = Grid { shape: [2, 2], step: [1.0; 2] };
    let potential = |samples: Vec<f32>| {
        let field = ScalarField::potential(grid, samples, Interpolation::Linear);
        field.map(|_| ()).map_err(|error| error.to_string())
    };
    assert_eq!(
        potential(vec![0.0, -1.5, 0.0, 0.0]),
        Err("sample 1 is -1.5; a potential lies in [-1, 1]".into())
    );
    assert!(potential(vec![0.0, 0.0, f32::NAN, 0.0]).unwrap_err().starts_with("sample 2 is NaN"));
    assert!(potential(vec![0.0; 3]).is_err());
}

#[test]
fn a_field_may_have_any_finite_value() {
    let grid = Grid { shape: [2, 2], step: [1.0; 2] };
    let field = |samples| ScalarField::new(grid, samples, Interpolation::Linear);
    assert_eq!(field(vec![0.0, -7.5, f32::MAX, 3.0]).unwrap().range(), (-7.5, f32::MAX));
    let error = field(vec![0.0, 0.0, 0.0, f32::INFINITY]).unwrap_err();
    assert_eq!(error, FieldError::NotFinite { index: 3, value: f32::INFINITY });
    assert!(matches!(field(vec![0.0; 5]), Err(FieldError::SampleCount { found: 5, expected: 4 })));
}

#[test]
fn fields_lie_over_one_box() {
    let grid = Grid { shape: [5, 4], step: [1.0; 2] };
    let wide = Grid { shape: [6, 4], step: [1.0; 2] };
    let potential = |grid: Grid<2>| {
        ScalarField::potential(grid, vec![0.0; grid.sample_count()], Interpolation::Linear).unwrap()
    };
    let weight = ImageWeight::field(grid, vec![0.5; 20]).unwrap();
    let distance = NominalDistance::constant(&grid, 2.0).unwrap();
    assert!(Fields::new(potential(grid), weight.clone(), distance.clone()).is_ok());
    let error = Fields::new(potential(wide), weight, distance.clone()).unwrap_err();
    assert!(matches!(error, FieldError::Domain { field: "weight", .. }), "{error}");
    let even = ImageWeight::constant(0.5).unwrap();
    let error = Fields::new(potential(wide), even, distance).unwrap_err();
    assert!(matches!(error, FieldError::Domain { field: "nominal distance", .. }), "{error}");
}
