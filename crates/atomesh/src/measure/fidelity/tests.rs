//! Fidelity and homogeneity against closed forms and a fit by elimination.

use super::*;
use crate::geometry::Point;
use crate::mesh::Delaunay;
use crate::watch::Silent;

/// Squares of `size` samples, cut in two, over `count`² squares.
fn squares(count: usize, size: f64) -> Mesh<2> {
    let n = count + 1;
    let points = (0..n * n).map(|i| [(i % n) as f64 * size, (i / n) as f64 * size]).collect();
    let corners = (0..count * count).flat_map(|i| {
        let a = (i % count + n * (i / count)) as u32;
        let b = a + n as u32;
        [a, a + 1, b + 1, a, b + 1, b]
    });
    Mesh::new(points, corners.collect()).unwrap()
}

fn samples(shape: [usize; 2], value: impl Fn(&Point<2>) -> f64) -> (Frame<2>, Samples) {
    let count = shape[0] * shape[1];
    let at = |i: usize| [(i % shape[0]) as f64, (i / shape[0]) as f64];
    (Frame::new(shape).unwrap(), Samples::F64((0..count).map(|i| value(&at(i))).collect()))
}

#[test]
fn a_linear_image_is_carried_exactly_by_linear_cells() {
    let (frame, samples) = samples([25, 25], |p| 1e3 + 2.0 * p[0] - p[1]);
    let report = fidelity(&squares(3, 8.0), &frame, &samples, &mut Silent).unwrap();
    // values spread by some 16; the residual test leaves a share of 10⁻⁶ of the fit
    assert!(report.linear_rms < 1e-4, "{report:?}");
    assert!(report.converged && (report.covered - 1.0).abs() < 1e-12);
    // over a box of 24², samples weighted 0.5, 1, …, 1, 0.5: variance of x is (24² + 2) / 12
    let variance = (24.0 * 24.0 + 2.0) / 12.0 * (4.0 + 1.0);
    assert!((report.deviation - f64::sqrt(variance)).abs() < 1e-9, "{report:?}");
    assert!(report.constant_rms > 1.0 && report.constant_relative < Some(0.5));
}

#[test]
fn means_of_cells_leave_the_deviation_within_them() {
    // stripes of two columns, cells of whole squares of 8: each triangle half of either, nearly
    let (frame, samples) =
        samples([17, 17], |p| if ((p[0] / 2.0) as usize).is_multiple_of(2) { 1.0 } else { 3.0 });
    let report = fidelity(&squares(2, 8.0), &frame, &samples, &mut Silent).unwrap();
    assert!((report.deviation - 1.0).abs() < 0.01, "{report:?}");
    assert!((report.constant_rms - 1.0).abs() < 0.02 && report.linear_rms < report.deviation);
    // a constant image has no deviation to share
    let flat = Samples::U8(vec![7; 17 * 17].into());
    let report = fidelity(&squares(2, 8.0), &frame, &flat, &mut Silent).unwrap();
    assert_eq!((report.deviation, report.constant_rms, report.linear_rms), (0.0, 0.0, 0.0));
    assert_eq!(report.constant_relative, None);
}

/// A sample of a fit.
struct Weighted {
    weight: f64,
    basis: [f64; 3],
    value: f64,
}

/// The least squares of one cell with the plane through its samples, by Cramer's rule.
#[test]
fn the_fit_of_one_cell_is_the_plane_of_least_squares() {
    let value = |p: &Point<2>| (p[0] * 1.7).sin() + 0.3 * p[1] * p[1];
    let (frame, values) = samples([7, 7], value);
    let mesh = Mesh::new(vec![[0.0, 0.0], [6.0, 0.0], [0.0, 6.0]], vec![0, 1, 2]).unwrap();
    let report = fidelity(&mesh, &frame, &values, &mut Silent).unwrap();
    let (mut a, mut b) = ([[0.0; 3]; 3], [[0.0; 1]; 3]);
    let mut used = Vec::new();
    for i in 0..49 {
        let p = [(i % 7) as f64, (i / 7) as f64];
        if p[0] + p[1] <= 6.0 {
            let rim = |x: f64| if x == 0.0 || x == 6.0 { 0.5 } else { 1.0 };
            let (w, basis) = (rim(p[0]) * rim(p[1]), [1.0, p[0], p[1]]);
            for r in 0..3 {
                for c in 0..3 {
                    a[r][c] += w * basis[r] * basis[c];
                }
                b[r][0] += w * basis[r] * value(&p);
            }
            used.push(Weighted { weight: w, basis, value: value(&p) });
        }
    }
    crate::geometry::linear::solve(3, a, &mut b);
    let error = |sample: &Weighted| {
        let fitted = (0..3).map(|k| b[k][0] * sample.basis[k]).sum::<f64>();
        sample.weight * (sample.value - fitted).powi(2)
    };
    let expected = used.iter().map(error).sum::<f64>() / used.iter().map(|u| u.weight).sum::<f64>();
    assert!((report.linear_rms - expected.sqrt()).abs() < 1e-9, "{report:?} {expected}");
}

#[test]
fn homogeneity_is_one_where_interfaces_are_facets() {
    let frame = Frame::new([17, 17]).unwrap();
    // the interface between samples 8 and 9 is at 8.5; cells end at 8
    let labels = |edge: usize| {
        let samples = (0..289).map(|i| u8::from(i % 17 >= edge)).collect();
        Image::new(frame, Samples::U8(samples)).unwrap()
    };
    let pure = homogeneity(&squares(1, 16.0), &labels(17), &mut Silent).unwrap();
    assert_eq!((pure.mean, pure.min, pure.mixed, pure.without), (1.0, 1.0, 0, 0));
    let shifted = homogeneity(&squares(2, 8.0), &labels(9), &mut Silent).unwrap();
    // the right cells have the label 0 from 8 to 8.5: 4 of their area of 64 a square
    assert!((shifted.mean - (1.0 - 0.5 * 4.0 / 64.0)).abs() < 1e-12, "{shifted:?}");
    // of the triangle whose side lies on x = 8: 0.5 · (8 + 7.5)/2 of 32
    assert!((shifted.min - (1.0 - 0.5 * 7.75 / 32.0)).abs() < 1e-12);
    assert_eq!(shifted.histogram.counts.iter().sum::<u64>(), 8);
}

#[test]
fn what_covers_no_sample_or_holds_no_labels_is_refused() {
    let (frame, samples) = samples([9, 9], |p| p[0] * 0.5);
    let far = Mesh::new(vec![[20.0, 0.0], [28.0, 0.0], [20.0, 6.0]], vec![0, 1, 2]).unwrap();
    let error = fidelity(&far, &frame, &samples, &mut Silent);
    assert_eq!(error, Err(MeasureError::NoCells { points: 3 }));
    let image = Image::new(frame, samples).unwrap();
    let error = homogeneity(&squares(1, 8.0), &image, &mut Silent);
    assert!(matches!(error, Err(MeasureError::Sample(_))), "{error:?}");
}

/// Delaunay's mesh of seeded points in a box, and of the box's corners.
fn scattered<const D: usize>(
    delaunay: &Delaunay<D>,
    count: usize,
    [low, high]: [f64; 2],
    seed: u64,
) -> Mesh<D> {
    use rand::{RngExt, SeedableRng};
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let corner = |i: usize| std::array::from_fn(|k| if i >> k & 1 == 0 { low } else { high });
    let mut points: Vec<Point<D>> = (0..1 << D).map(corner).collect();
    let mut inside = || low + (high - low) * random.random::<f64>();
    points.extend((0..count).map(|_| std::array::from_fn(|_| inside())));
    delaunay.connect(&points, &mut Silent).unwrap()
}

/// Waves; with `gaps`, some samples are NaN.
fn waves<const D: usize>(shape: [usize; D], gaps: bool) -> (Frame<D>, Samples) {
    let value = |i: usize| match gaps && i % 17 == 3 {
        true => f64::NAN,
        false => {
            let at = crate::image::coordinates(i, shape);
            let phases = (0..D).map(|k| (0.3 + 0.2 * k as f64) * at[k] as f64);
            90.0 + phases.sum::<f64>().sin() * 20.0
        }
    };
    let count = shape.iter().product();
    (Frame::new(shape).unwrap(), Samples::F64((0..count).map(value).collect()))
}

/// A sample with its weight, the first cell that has it, the cell's points with the sample's barycentric coordinates, and
/// its value.
struct Held {
    weight: f64,
    cell: usize,
    shares: Vec<(usize, f64)>,
    value: f64,
}

/// The finite samples that the mesh covers, by trying all cells.
fn held<const D: usize>(mesh: &Mesh<D>, shape: [usize; D], samples: &Samples) -> Vec<Held> {
    let of = |i: usize| {
        let at = crate::image::coordinates(i, shape);
        let is_rim = |k: usize| at[k] == 0 || at[k] + 1 == shape[k];
        let weight: f64 = (0..D).map(|k| if is_rim(k) { 0.5 } else { 1.0 }).product();
        let place = at.map(|x| x as f64);
        let value = samples.get(i);
        let found = mesh.cells().enumerate().find_map(|(number, cell)| {
            let whole = mesh.simplex(cell).measure();
            let share = |k: usize| {
                let mut part = mesh.simplex(cell);
                *(if k == 0 { &mut part.first } else { &mut part.others[k - 1] }) = place;
                part.measure() / whole
            };
            let shares: Vec<(usize, f64)> = (0..=D).map(|k| (cell[k] as usize, share(k))).collect();
            shares.iter().all(|(_, share)| *share >= -1e-9).then_some((number, shares))
        });
        let (cell, shares) = found.filter(|_| value.is_finite())?;
        Some(Held { weight, cell, shares, value })
    };
    (0..samples.len()).filter_map(of).collect()
}

/// The covered share, the deviation, and the error of means, by definition.
fn by_definition<const D: usize>(mesh: &Mesh<D>, frame: &Frame<D>, samples: &Samples) -> [f64; 3] {
    let held = held(mesh, frame.shape(), samples);
    let mean_of = |of: &dyn Fn(&Held) -> bool| {
        let sums = held
            .iter()
            .filter(|h| of(h))
            .fold([0.0; 2], |[value, weight], h| [value + h.weight * h.value, weight + h.weight]);
        sums[0] / sums[1]
    };
    let mean = mean_of(&|_| true);
    let means: Vec<f64> =
        (0..mesh.cell_count()).map(|cell| mean_of(&|h: &Held| h.cell == cell)).collect();
    let (mut total, mut all, mut within) = (0.0, 0.0, 0.0);
    for h in &held {
        total += h.weight;
        all += h.weight * (h.value - mean).powi(2);
        within += h.weight * (h.value - means[h.cell]).powi(2);
    }
    let whole = frame.grid(Units::Samples).bounds().measure();
    [total / whole, (all / total).sqrt(), (within / total).sqrt()]
}

fn errors_of_means_are_those_by_definition<const D: usize>(
    delaunay: &Delaunay<D>,
    shape: [usize; D],
) {
    // within the image, up to its sides, and beyond them
    for (seed, ends) in [(0, [1.2, 7.7]), (1, [0.0, 9.0]), (2, [-2.5, 11.3])] {
        for gaps in [false, true] {
            let mesh = scattered(delaunay, 60, ends, seed);
            let (frame, samples) = waves(shape, gaps);
            let report = fidelity(&mesh, &frame, &samples, &mut Silent).unwrap();
            let [covered, deviation, constant] = by_definition(&mesh, &frame, &samples);
            // sums of some 10³ products of up to 400, whose roundings a square root may double in digits
            assert!((report.covered - covered).abs() < 1e-11, "{report:?} {covered}");
            assert!((report.deviation - deviation).abs() < 1e-8, "{report:?} {deviation}");
            assert!((report.constant_rms - constant).abs() < 1e-8, "{report:?} {constant}");
        }
    }
}

#[test]
fn errors_of_means_are_those_by_definition_in_the_plane_and_in_space() {
    errors_of_means_are_those_by_definition(&Delaunay::<2>::new(), [10, 10]);
    errors_of_means_are_those_by_definition(&Delaunay::<3>::new(), [10, 10, 10]);
}

#[test]
fn an_inverted_cell_counts_as_one_of_positive_measure() {
    let mesh = squares(2, 4.0);
    let mut corners = mesh.corners().to_vec();
    corners.swap(4, 5);
    let inverted = Mesh::new(mesh.points().to_vec(), corners).unwrap();
    let (frame, samples) = waves([9, 9], false);
    let [first, second] =
        [&mesh, &inverted].map(|mesh| fidelity(mesh, &frame, &samples, &mut Silent).unwrap());
    // sums in another order
    assert!((first.constant_rms - second.constant_rms).abs() < 1e-9, "{first:?} {second:?}");
    assert!((first.linear_rms - second.linear_rms).abs() < 1e-9 && second.covered > 0.999);
}

/// The error of the linear fit by elimination, each sample in the first cell that has it.
fn by_elimination<const D: usize>(mesh: &Mesh<D>, shape: [usize; D], samples: &Samples) -> f64 {
    const MOST: usize = 40;
    let count = mesh.points().len();
    let (mut a, mut b) = ([[0.0; MOST]; MOST], [[0.0; 1]; MOST]);
    let held = held(mesh, shape, samples);
    for Held { weight, shares, value, .. } in &held {
        for &(r, own) in shares {
            shares.iter().for_each(|&(c, other)| a[r][c] += weight * own * other);
            b[r][0] += weight * own * value;
        }
    }
    // a point without samples about it
    for (k, row) in a.iter_mut().enumerate().take(count) {
        if row[k] == 0.0 {
            row[k] = 1.0;
        }
    }
    assert!(crate::geometry::linear::solve(count, a, &mut b) != 0.0);
    let error = |h: &Held| {
        let fitted: f64 = h.shares.iter().map(|&(point, share)| share * b[point][0]).sum();
        h.weight * (h.value - fitted).powi(2)
    };
    let total: f64 = held.iter().map(|h| h.weight).sum();
    (held.iter().map(error).sum::<f64>() / total).sqrt()
}

#[test]
fn the_fit_is_that_of_elimination() {
    for (seed, gaps) in [(3, false), (4, true)] {
        let (frame, samples) = waves([10, 10], gaps);
        let mesh = scattered(&Delaunay::<2>::new(), 12, [0.0, 9.0], seed);
        let report = fidelity(&mesh, &frame, &samples, &mut Silent).unwrap();
        let exact = by_elimination(&mesh, [10, 10], &samples);
        // iterations end at a share of 10⁻⁶, of which errors have the square
        assert!((report.linear_rms - exact).abs() < 1e-6, "{report:?} {exact}");
        let (frame, samples) = waves([8, 8, 8], gaps);
        let mesh = scattered(&Delaunay::<3>::new(), 10, [0.0, 7.0], seed);
        let report = fidelity(&mesh, &frame, &samples, &mut Silent).unwrap();
        let exact = by_elimination(&mesh, [8, 8, 8], &samples);
        assert!((report.linear_rms - exact).abs() < 1e-6, "{report:?} {exact}");
    }
}

#[test]
fn fidelity_is_the_same_at_any_number_of_threads() {
    let mesh = scattered(&Delaunay::<3>::new(), 200, [-0.5, 15.0], 5);
    let (frame, samples) = waves([16, 16, 16], true);
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fidelity(&mesh, &frame, &samples, &mut Silent).unwrap())
    };
    assert_eq!(of(1), of(3));
}
