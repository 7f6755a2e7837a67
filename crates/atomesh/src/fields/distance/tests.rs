use super::*;
use crate::geometry::distance_squared;
use rand::{RngExt, SeedableRng};

const SQUARE: Grid<2> = Grid { shape: [101, 81], step: [1.0, 1.0] };

/// d = 4 + |x − 50| / 10 at every sample.
fn valley() -> Vec<f32> {
    (0..SQUARE.sample_count()).map(|i| 4.0 + ((i % 101) as f32 - 50.0).abs() / 10.0).collect()
}

#[test]
fn a_constant_is_the_same_everywhere() {
    let d = NominalDistance::constant(&SQUARE, 8.1).unwrap();
    for p in [[0.0, 0.0], [33.3, 44.4], [-1e9, 1e9]] {
        assert_eq!(d.at(&p), 8.1);
    }
    assert!(d.is_constant());
    assert_eq!((d.least(), d.mean(), d.greatest()), (8.1, 8.1, 8.1));
    assert!((d.estimated_atoms(1.0) - 8000.0 / 8.1f64.powi(2)).abs() < 1e-9);
}

#[test]
fn a_field_is_interpolated_and_clamped_outside_the_box() {
    let d = NominalDistance::from_field(&SQUARE, &valley(), GRADIENT_LIMIT).unwrap();
    // nodes are every 2 samples: the least of the 3 around a node is up to a sample nearer to 50
    for x in [0.0, 13.0, 50.0, 77.7, 100.0] {
        let expected = 4.0 + (x - 50.0f64).abs() / 10.0;
        let found = d.at(&[x, 40.5]);
        assert!(found <= expected + 1e-6 && found >= expected - 0.2, "{found} at {x}");
    }
    assert_eq!(d.at(&[-5.0, 10.0]), d.at(&[0.0, 10.0]));
    assert_eq!(d.at(&[200.0, 200.0]), d.at(&[100.0, 80.0]));
    assert_eq!(d.least(), 4.0);
    assert!(!d.is_constant() && (d.mean() - 6.5).abs() < 0.2);
}

#[test]
fn interpolation_is_exact_for_ramps_and_at_nodes() {
    // d of 2 makes nodes of the samples
    let grid = Grid { shape: [9, 7, 5], step: [1.0, 1.0, 1.5] };
    let at = |p: [f64; 3]| 2.0 + 0.01 * p[0] + 0.02 * p[1] + 0.03 * p[2];
    let field: Vec<f32> = (0..grid.sample_count())
        .map(|i| at([(i % 9) as f64, (i / 9 % 7) as f64, (i / 63) as f64 * 1.5]) as f32)
        .collect();
    let d = NominalDistance::from_field(&grid, &field, 1.0).unwrap();
    for p in [[0.0, 0.0, 0.0], [8.0, 6.0, 6.0], [3.25, 4.5, 1.0], [7.99, 0.01, 5.99]] {
        assert!((d.at(&p) - at(p)).abs() < 1e-6, "{p:?}");
    }
}

#[test]
fn a_field_is_nowhere_exceeded_and_its_least_value_stays() {
    let mut field = vec![20.0f32; SQUARE.sample_count()];
    field[37 * 101 + 53] = 5.0;
    field[100] = 6.0;
    let d = NominalDistance::from_field(&SQUARE, &field, 0.2).unwrap();
    assert_eq!(d.least(), 5.0);
    for (i, &f) in field.iter().enumerate() {
        let p = [(i % 101) as f64, (i / 101) as f64];
        assert!(d.at(&p) <= f64::from(f) + 1e-5);
    }
    // along a row away from the point d rises at the limit
    let rise = d.at(&[73.0, 37.0]) - d.at(&[63.0, 37.0]);
    assert!((rise - 2.0).abs() < 0.05, "{rise}");
}

#[test]
fn anisotropic_steps_limit_the_slope_per_lattice_unit() {
    let grid = Grid { shape: [61, 31], step: [1.0, 4.0] };
    let mut field = vec![60.0f32; grid.sample_count()];
    field[15 * 61 + 30] = 4.0;
    let d = NominalDistance::from_field(&grid, &field, 0.25).unwrap();
    let (along_x, along_y) = (d.at(&[50.0, 60.0]), d.at(&[30.0, 80.0]));
    assert!((along_x - along_y).abs() < 1.0, "{along_x} {along_y}"); // a node's footprint
}

#[test]
fn dense_features_get_the_least_distance_and_bare_places_the_greatest() {
    // lines 5 apart on the left, none on the right
    let grid = Grid { shape: [200, 100], step: [1.0, 1.0] };
    let potential: Vec<f32> = (0..grid.sample_count())
        .map(|i| if i % 200 < 100 && i % 5 == 0 { -1.0 } else { 0.0 })
        .collect();
    let d = NominalDistance::from_potential(&grid, &potential, &Grading::new(6.0, 18.0)).unwrap();
    assert!((d.at(&[20.0, 50.0]) - 6.0).abs() < 0.1);
    assert!(d.at(&[190.0, 50.0]) > 17.0);
    assert!(d.least() >= 6.0 && d.greatest() <= 18.0);
    let repelling: Vec<f32> = potential.iter().map(|b| -b).collect();
    let same = NominalDistance::from_potential(&grid, &repelling, &Grading::new(6.0, 18.0));
    assert_eq!(same.unwrap(), d);
}

#[test]
fn without_features_the_distance_is_the_greatest() {
    let potential = vec![0.0; SQUARE.sample_count()];
    let d = NominalDistance::from_potential(&SQUARE, &potential, &Grading::new(6.0, 18.0)).unwrap();
    assert!(d.is_constant() && d.at(&[3.0, 4.0]) == 18.0);
}

#[test]
fn the_integral_of_the_density_is_the_number_of_atoms() {
    let d = NominalDistance::from_field(&SQUARE, &valley(), GRADIENT_LIMIT).unwrap();
    // 2 · 80 ∫ dx / (4 + x/10)² from 0 to 50, of a d that is lower by a tenth or so
    let expected = 160.0 * 10.0 * (1.0 / 4.0 - 1.0 / 9.0);
    assert!((d.estimated_atoms(1.0) / expected - 1.0).abs() < 0.05);
}

#[test]
fn what_is_no_distance_is_refused() {
    for value in [0.0, -3.0, f64::INFINITY] {
        let error = NominalDistance::constant(&SQUARE, value);
        assert_eq!(error, Err(DistanceError::NotPositive { value }));
    }
    let error = NominalDistance::constant(&SQUARE, 0.9);
    assert_eq!(error, Err(DistanceError::BelowStep { value: 0.9, step: 1.0 }));
    for value in [0.0f32, -1.0, f32::INFINITY] {
        let mut field = valley();
        field[17] = value;
        let error = NominalDistance::from_field(&SQUARE, &field, 0.25);
        assert_eq!(error, Err(DistanceError::FieldValue { index: 17, value }));
    }
    let mut field = valley();
    field[5] = f32::NAN;
    let error = NominalDistance::from_field(&SQUARE, &field, 0.25).unwrap_err();
    assert!(matches!(error, DistanceError::FieldValue { index: 5, value } if value.is_nan()));
    field[5] = 0.5;
    let error = NominalDistance::from_field(&SQUARE, &field, 0.25);
    assert_eq!(error, Err(DistanceError::BelowStep { value: 0.5, step: 1.0 }));
    let error = NominalDistance::from_field(&SQUARE, &field[1..], 0.25);
    assert_eq!(error, Err(DistanceError::FieldShape { shape: vec![101, 81], found: 8180 }));
    let error = NominalDistance::from_field(&SQUARE, &valley(), 0.0);
    assert_eq!(error, Err(DistanceError::GradientLimit { value: 0.0 }));
    let potential = vec![0.0; SQUARE.sample_count()];
    let graded = |grading| NominalDistance::from_potential(&SQUARE, &potential, &grading);
    let error = graded(Grading::new(9.0, 8.0));
    assert_eq!(error, Err(DistanceError::Order { min: 9.0, max: 8.0 }));
    let error = graded(Grading { smooth: Some(-1.0), ..Grading::new(6.0, 8.0) });
    assert_eq!(error, Err(DistanceError::Smooth { value: -1.0 }));
}

#[test]
fn the_default_is_round_and_gives_the_promised_number_of_atoms() {
    for n in [200, 256, 999, 5000] {
        let grid = Grid { shape: [n, n], step: [12.5, 12.5] };
        let d = NominalDistance::constant(&grid, default_distance(&grid)).unwrap();
        assert!((1e3..1e4).contains(&d.estimated_atoms(2.0 / 3f64.sqrt())), "{n}: {d:?}");
    }
    for n in [100, 197, 512, 1024] {
        let grid = Grid { shape: [n, n, n], step: [0.5, 0.5, 2.0] };
        let d = NominalDistance::constant(&grid, default_distance(&grid)).unwrap();
        assert!((2e4..1e5).contains(&d.estimated_atoms(0.75 * 3f64.sqrt())), "{n}: {d:?}");
    }
    // the brain at 1 mm
    assert_eq!(default_distance(&Grid { shape: [197, 233, 189], step: [1.0; 3] }), 6.0);
    assert_eq!(default_distance(&Grid { shape: [5, 1], step: [0.25, 0.5] }), 0.5);
}

#[test]
fn a_box_of_one_sample_has_a_distance() {
    let grid = Grid { shape: [1, 1, 1], step: [1.0; 3] };
    let d = NominalDistance::from_field(&grid, &[3.0], 0.25).unwrap();
    assert!(d.is_constant() && d.at(&[0.0; 3]) == 3.0);
    let row = Grid { shape: [1, 50], step: [1.0; 2] };
    let field: Vec<f32> = (0..50).map(|i| 3.0 + i as f32).collect();
    let d = NominalDistance::from_field(&row, &field, 0.25).unwrap();
    assert!((d.at(&[0.0, 40.0]) - 13.0).abs() < 1e-3);
}

#[test]
fn no_two_points_differ_by_more_than_the_greatest_slope() {
    let grid = Grid { shape: [12, 10, 8], step: [1.0, 0.8, 1.6] };
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(4);
    let field: Vec<f32> =
        (0..grid.sample_count()).map(|_| 2.0 + 3.0 * random.random::<f32>()).collect();
    let d = NominalDistance::from_field(&grid, &field, 0.4).unwrap();
    let extent = grid.bounds().extent();
    let mut steepest = 0.0f64;
    for _ in 0..20_000 {
        let p: Point<3> = std::array::from_fn(|k| extent[k] * random.random::<f64>());
        let q: Point<3> = std::array::from_fn(|k| p[k] + 0.02 * (random.random::<f64>() - 0.5));
        let slope = (d.at(&p) - d.at(&q)).abs() / distance_squared(&p, &q).sqrt();
        steepest = steepest.max(slope);
    }
    let bound = d.greatest_slope();
    assert!(steepest <= bound && steepest > 0.8 * bound, "{steepest} of {bound}");
    assert!(bound < 0.4 * 3f64.sqrt() + 1e-3, "{bound}");
    let flat = NominalDistance::constant(&grid, 3.0).unwrap();
    assert_eq!(flat.greatest_slope(), 0.0);
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let grid = Grid { shape: [60, 50, 40], step: [1.0, 1.0, 2.0] };
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(9);
    let potential: Vec<f32> =
        (0..grid.sample_count()).map(|_| -random.random::<f32>().powi(8)).collect();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let grading = Grading { smooth: Some(3.0), ..Grading::new(4.0, 40.0) };
        pool.install(|| NominalDistance::from_potential(&grid, &potential, &grading).unwrap())
    };
    assert_eq!(run(1), run(3));
}
