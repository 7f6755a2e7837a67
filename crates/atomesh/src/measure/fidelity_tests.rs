//! Fidelity and homogeneity against closed forms and a fit by elimination.

use super::fidelity::{fidelity, homogeneity};
use super::*;
use crate::geometry::Point;
use crate::image::{Frame, Image, Samples};
use crate::mesh::Mesh;
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
    let flat = Samples::U8(vec![7; 17 * 17]);
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
