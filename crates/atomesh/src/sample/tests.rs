//! Overlaps against a slow reference, statistics against closed forms, totals against sums.

use super::*;
use crate::geometry::{Bounds, Simplex, difference};
use crate::mesh::{Delaunay, Mesh};
use crate::watch::Silent;
use proptest::prelude::*;
use std::ops::ControlFlow;

/// The part of a simplex below `at` along an axis, as simplices: an edge that crosses the plane cuts the simplex
/// in two, over and over until none does.
fn below<const D: usize>(
    simplex: &[Point<D>],
    axis: usize,
    at: f64,
    parts: &mut Vec<Vec<Point<D>>>,
) {
    for i in 0..simplex.len() {
        for j in 0..simplex.len() {
            let (low, high) = (simplex[i], simplex[j]);
            if low[axis] < at && high[axis] > at {
                let share = (at - low[axis]) / (high[axis] - low[axis]);
                let mut middle: Point<D> =
                    std::array::from_fn(|k| low[k] + share * (high[k] - low[k]));
                middle[axis] = at;
                for end in [i, j] {
                    let mut part = simplex.to_vec();
                    part[end] = middle;
                    below(&part, axis, at, parts);
                }
                return;
            }
        }
    }
    if simplex.iter().all(|p| p[axis] <= at) {
        parts.push(simplex.to_vec());
    }
}

/// The simplices that fill the part of a simplex in a box: the reference, clipped by one side after another.
fn clipped<const D: usize>(simplex: &[Point<D>], bounds: &Bounds<D>) -> Vec<Vec<Point<D>>> {
    let mut parts = vec![simplex.to_vec()];
    for k in 0..D {
        let mirror = |parts: Vec<Vec<Point<D>>>| -> Vec<Vec<Point<D>>> {
            let turn = |p: &Point<D>| std::array::from_fn(|j| if j == k { -p[j] } else { p[j] });
            parts.iter().map(|part| part.iter().map(turn).collect()).collect()
        };
        for at in [bounds.max[k], -bounds.min[k]] {
            let mut kept = Vec::new();
            parts.iter().for_each(|part| below(part, k, at, &mut kept));
            parts = mirror(kept);
        }
    }
    parts
}

fn measure<const D: usize>(simplex: &[Point<D>]) -> f64 {
    Simplex { first: simplex[0], others: std::array::from_fn(|k| simplex[k + 1]) }.measure().abs()
}

/// The box of a sample.
fn sample_box<const D: usize>(index: usize, shape: [usize; D]) -> Bounds<D> {
    let mut rest = index;
    let at = shape.map(|n| {
        let i = rest % n;
        rest /= n;
        i as f64
    });
    let last = |k: usize| (shape[k] - 1) as f64;
    Bounds {
        min: std::array::from_fn(|k| (at[k] - 0.5).max(0.0)),
        max: std::array::from_fn(|k| (at[k] + 0.5).min(last(k))),
    }
}

/// The overlap of a cell with each sample of an image, from the totals of images that are 1 at one sample.
fn overlaps<const D: usize>(mesh: &Mesh<D>, shape: [usize; D]) -> Vec<f64> {
    let frame = Frame::new(shape).unwrap();
    (0..frame.sample_count())
        .map(|i| {
            let mut samples = vec![0.0; frame.sample_count()];
            samples[i] = 1.0;
            let options = SampleOptions::new(&[Statistic::Total]);
            let samples = Samples::F64(samples.into());
            sample_in_frame(mesh, &frame, &samples, options, &mut Silent).unwrap().values[0][0]
        })
        .collect()
}

fn overlaps_are_those_of_clipped_simplices<const D: usize>(
    corners: &[Point<D>],
    shape: [usize; D],
) {
    let mesh = Mesh::new(corners.to_vec(), (0..=D as u32).collect()).unwrap();
    let found = overlaps(&mesh, shape);
    for (i, overlap) in found.iter().enumerate() {
        let expected: f64 =
            clipped(corners, &sample_box(i, shape)).iter().map(|part| measure(part)).sum();
        // coordinates below 8 are cut with errors of 10⁻¹⁵, and sums of some ten such make an overlap
        assert!((overlap - expected).abs() < 1e-13, "{i}: {overlap}, not {expected}");
    }
}

/// Coordinates that are often on the sides of boxes, on samples, or equal.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![4 => -2.0..6.0f64, 1 => (-3..12i32).prop_map(|i| 0.5 * f64::from(i))]
}

proptest! {
    #[test]
    fn overlaps_with_boxes_are_exact(
        triangle in prop::array::uniform3(prop::array::uniform2(coordinate())),
        tetrahedron in prop::array::uniform4(prop::array::uniform3(coordinate())),
    ) {
        overlaps_are_those_of_clipped_simplices(&triangle, [5, 4]);
        overlaps_are_those_of_clipped_simplices(&tetrahedron, [4, 3, 5]);
    }

    #[test]
    fn totals_are_conserved_by_any_mesh_of_the_box(seed in 0u64..1000) {
        total_of_cells_is_total_of_samples([7, 9], seed);
        total_of_cells_is_total_of_samples([5, 6, 4], seed);
    }
}

/// Seeded samples.
fn noise(count: usize, seed: u64) -> Vec<f32> {
    use rand::{RngExt, SeedableRng};
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    (0..count).map(|_| random.random::<f32>() - 0.3).collect()
}

/// A Delaunay mesh of the box's corners and some points inside it.
fn mesh_of_box<const D: usize>(extent: Point<D>, seed: u64) -> Mesh<D>
where
    Delaunay<D>: Default,
{
    let mut points: Vec<Point<D>> = (0..1 << D)
        .map(|i: usize| std::array::from_fn(|k| if i >> k & 1 == 1 { extent[k] } else { 0.0 }))
        .collect();
    let inside = noise(30 * D, seed);
    points.extend(inside.chunks_exact(D).map(|unit| {
        std::array::from_fn(|k| extent[k] * (f64::from(unit[k]) + 0.3).clamp(0.01, 0.99))
    }));
    Delaunay::<D>::default().connect(&points, &mut Silent).unwrap()
}

fn total_of_cells_is_total_of_samples<const D: usize>(shape: [usize; D], seed: u64)
where
    Delaunay<D>: Default,
{
    // a turned frame with unequal spacing; the first two axes are turned by 30°
    let (sin, cos) = 30f64.to_radians().sin_cos();
    let direction = std::array::from_fn(|r| {
        std::array::from_fn(|c| match (r, c) {
            (0, 0) | (1, 1) => cos,
            (0, 1) => -sin,
            (1, 0) => sin,
            _ => f64::from(u8::from(r == c)),
        })
    });
    let frame = Frame::new(shape).unwrap().with_origin([-31.0; D]).unwrap();
    let frame = frame.with_spacing(std::array::from_fn(|k| 0.5 + k as f64)).unwrap();
    let frame = frame.with_direction(direction).unwrap();
    let extent = frame.grid(Units::Physical).bounds().max;
    let (points, corners) = mesh_of_box(extent, seed).into_parts();
    let points = points.iter().map(|p| frame.lattice_to_world(Units::Physical, p)).collect();
    let mesh = Mesh::new(points, corners).unwrap();

    let values = noise(frame.sample_count(), seed + 1);
    let unit: f64 = frame.spacing().iter().product();
    let terms = values
        .iter()
        .enumerate()
        .map(|(i, &v)| f64::from(v) * unit * sample_box(i, shape).measure());
    let (expected, size) = terms.fold((0.0, 0.0), |(sum, size), t: f64| (sum + t, size + t.abs()));
    let image = Image::new(frame, Samples::F32(values.into())).unwrap();
    let options = SampleOptions::new(&[Statistic::Total]);
    let found = sample(&mesh, &image, options, &mut Silent).unwrap();
    let total: f64 = found.values[0].iter().sum();
    assert!((total - expected).abs() <= 1e-12 * size, "{total}, not {expected}");
    let measure: f64 = found.measures.iter().sum();
    assert!((measure / extent.iter().product::<f64>() - 1.0).abs() < 1e-12);
    assert!(found.coverage.iter().all(|&part| part == 1.0), "{:?}", found.coverage);
}

/// The mean of a linear image is its mean over the overlaps' centroids, each sample's value being that at its
/// own centre; where the cell is a union of boxes it is the value at the cell's centroid.
#[test]
fn the_mean_of_a_linear_image_is_the_value_at_the_centroid() {
    let shape = [6, 7];
    let frame = Frame::new(shape).unwrap();
    let value = |p: &Point<2>| 3.0 + 2.0 * p[0] - 0.5 * p[1];
    let samples = (0..42).map(|i| value(&[(i % 6) as f64, (i / 6) as f64])).collect();
    let image = Image::new(frame, Samples::F64(samples)).unwrap();
    // boxes of samples (1..=3, 2..=5), cut along a diagonal of its 4 × 3 boxes
    let points = vec![[0.5, 1.5], [3.5, 1.5], [3.5, 5.5], [0.5, 5.5]];
    let mesh = Mesh::new(points, vec![0, 1, 2, 0, 2, 3]).unwrap();
    let kinds = [Statistic::Mean, Statistic::Total, Statistic::Min, Statistic::Max];
    let found = sample(&mesh, &image, SampleOptions::new(&kinds), &mut Silent).unwrap();
    let total: f64 = found.values[1].iter().sum();
    assert!((total - 12.0 * value(&[2.0, 3.5])).abs() < 1e-12);
    for (cell, mean) in found.values[0].iter().enumerate() {
        let corners: Vec<Point<2>> =
            mesh.cells().nth(cell).unwrap().iter().map(|&c| mesh.points()[c as usize]).collect();
        let (mut weight, mut sum) = (0.0, 0.0);
        for i in 0..42 {
            for part in clipped(&corners, &sample_box(i, shape)) {
                weight += measure(&part);
                sum += measure(&part) * value(&[(i % 6) as f64, (i / 6) as f64]);
            }
        }
        assert!((mean - sum / weight).abs() < 1e-13);
    }
    // the extremes are those of the boxes that the cell reaches
    assert_eq!(found.values[2][0].min(found.values[2][1]), value(&[1.0, 5.0]));
    assert_eq!(found.values[3][0].max(found.values[3][1]), value(&[3.0, 2.0]));
}

/// A box as a cell: six facets, which simplices have not.
struct Box3(Bounds<3>);

impl CellSurfaces<3> for Box3 {
    fn cell_count(&self) -> usize {
        1
    }

    fn visit_facets(&self, _: usize, visit: &mut dyn FnMut(&[Point<3>])) {
        let ends = [self.0.min, self.0.max];
        for axis in 0..3 {
            for (end, at) in ends.iter().enumerate() {
                let corner = |u: usize, v: usize| {
                    let mut p = *at;
                    p[(axis + 1) % 3] = ends[u][(axis + 1) % 3];
                    p[(axis + 2) % 3] = ends[v][(axis + 2) % 3];
                    p
                };
                let mut facet = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                if end == 0 {
                    facet.reverse();
                }
                visit(&facet);
            }
        }
    }
}

#[test]
fn polyhedra_are_sampled_as_simplices_are_and_only_where_the_image_is() {
    let frame = Frame::new([3, 3, 3]).unwrap();
    let image = Image::new(frame, Samples::U8((1..=27).collect())).unwrap();
    let of = |min: Point<3>, max: Point<3>| {
        let options = SampleOptions {
            fill: -1.0,
            ..SampleOptions::new(&[Statistic::Mean, Statistic::Total])
        };
        let found = sample(&Box3(Bounds { min, max }), &image, options, &mut Silent).unwrap();
        (found.values[0][0], found.values[1][0], found.coverage[0], found.partial_count())
    };
    assert_eq!(of([0.5; 3], [1.5; 3]), (14.0, 14.0, 1.0, 0));
    let (mean, total, coverage, partial) = of([0.0; 3], [2.0; 3]);
    assert!((mean - 14.0).abs() < 1e-14 && (total - 112.0).abs() < 1e-13);
    assert_eq!((coverage, partial), (1.0, 0));
    // half of it is beyond the image along x, the other half in samples 2 and 11 alone
    let (mean, total, coverage, partial) = of([1.5, 0.0, 0.25], [2.5, 0.5, 0.75]);
    assert!((mean - 7.5).abs() < 1e-14 && (total - 7.5 * 0.125).abs() < 1e-15);
    assert_eq!((coverage, partial), (0.5, 1));
    assert_eq!(of([2.5; 3], [3.5; 3]), (-1.0, 0.0, 0.0, 1));
}

#[test]
fn orientation_does_not_matter_and_mirrored_frames_neither() {
    let points = vec![[0.2, 0.1], [4.0, 1.0], [1.0, 3.7]];
    let samples = || Samples::F32(noise(30, 3).into());
    let frame = Frame::new([6, 5]).unwrap();
    let means = |corners: Vec<u32>, points: Vec<Point<2>>, frame| {
        let image = Image::new(frame, samples()).unwrap();
        let mesh = Mesh::new(points, corners).unwrap();
        let kinds = [Statistic::Mean, Statistic::Std];
        sample(&mesh, &image, SampleOptions::new(&kinds), &mut Silent).unwrap()
    };
    let upright = means(vec![0, 1, 2], points.clone(), frame);
    let turned = means(vec![1, 0, 2], points.clone(), frame);
    let mirror = frame.with_direction([[-1.0, 0.0], [0.0, 1.0]]).unwrap();
    let mirrored = means(vec![0, 1, 2], points.iter().map(|p| [-p[0], p[1]]).collect(), mirror);
    for other in [turned, mirrored] {
        for k in 0..2 {
            assert!((upright.values[k][0] - other.values[k][0]).abs() < 1e-13);
        }
        assert!((upright.measures[0] - other.measures[0]).abs() < 1e-13);
    }
}

#[test]
fn samples_that_are_missing_leave_a_part_uncovered() {
    let frame = Frame::new([3, 2]).unwrap();
    let samples = Samples::F32(vec![1.0, f32::NAN, 3.0, 1.0, f32::NAN, 3.0].into());
    let image = Image::new(frame, samples).unwrap();
    let points = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
    let mesh = Mesh::new(points, vec![0, 1, 2, 0, 2, 3]).unwrap();
    let options = SampleOptions::new(&[Statistic::Total]);
    let found = sample(&mesh, &image, options, &mut Silent).unwrap();
    assert!((found.values[0].iter().sum::<f64>() - 2.0).abs() < 1e-14);
    assert!((found.coverage.iter().sum::<f64>() - 1.0).abs() < 1e-14);
}

#[test]
fn the_result_is_the_same_at_any_thread_count() {
    let mesh = mesh_of_box([30.0, 20.0, 25.0], 5);
    let image = Image::new(
        Frame::new([31, 21, 26]).unwrap(),
        Samples::U16((0..31 * 21 * 26).map(|i| (i * 7 % 11) as u16).collect()),
    );
    let image = image.unwrap();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = SampleOptions::new(&Statistic::ALL);
        pool.install(|| sample(&mesh, &image, options, &mut Silent).unwrap())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn wrong_samples_are_refused() {
    let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
    let mesh = Mesh::new(points, vec![0, 1, 2]).unwrap();
    let error = |shape: [usize; 2], samples: Vec<f32>, statistic| {
        let frame = Frame::new(shape).unwrap();
        let kinds = [statistic];
        let (samples, options) = (Samples::F32(samples.into()), SampleOptions::new(&kinds));
        sample_in_frame(&mesh, &frame, &samples, options, &mut Silent).err()
    };
    assert_eq!(error([2, 2], vec![0.0; 4], Statistic::Mean), None);
    assert_eq!(error([4, 1], vec![0.0; 4], Statistic::Mean), Some(SampleError::Thin { axis: 1 }));
    let count = SampleError::SampleCount { expected: 4, found: 3 };
    assert_eq!(error([2, 2], vec![0.0; 3], Statistic::Mean), Some(count));
    let negative = vec![1.0, 2.0, -0.5, 1.0];
    let expected = SampleError::Negative { statistic: Statistic::Harmonic, index: 2, value: -0.5 };
    assert_eq!(error([2, 2], negative.clone(), Statistic::Harmonic), Some(expected));
    let expected = SampleError::Label { statistic: Statistic::Majority, index: 2, value: -0.5 };
    assert_eq!(error([2, 2], negative, Statistic::Majority), Some(expected));
    struct Stop;
    impl Watch for Stop {
        fn step(&mut self, _: Phase, _: f64, _: Option<f64>) -> ControlFlow<()> {
            ControlFlow::Break(())
        }
    }
    let image = Image::new(Frame::new([2, 2]).unwrap(), Samples::U8(vec![0; 4].into())).unwrap();
    let options = SampleOptions::new(&[Statistic::Mean]);
    let stopped = sample(&mesh, &image, options, &mut Stop);
    assert_eq!(stopped, Err(SampleError::Cancelled(Cancelled)));
}

#[test]
fn facets_of_simplices_look_outward() {
    let points = vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 1.0]];
    let mesh = Mesh::new(points, vec![0, 1, 2, 3]).unwrap();
    let inside = [0.1, 0.1, 0.1];
    let mut count = 0;
    mesh.visit_facets(0, &mut |facet| {
        let simplex = Simplex { first: facet[0], others: [facet[1], facet[2], inside] };
        assert!(simplex.measure() < 0.0, "{facet:?}");
        count += 1;
    });
    assert_eq!(count, 4);
    let flat = Mesh::new(vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], vec![0, 1, 2]).unwrap();
    flat.visit_facets(0, &mut |facet| {
        let (u, v) = (difference(&facet[1], &facet[0]), difference(&[0.2, 0.2], &facet[0]));
        assert!(u[0] * v[1] - u[1] * v[0] > 0.0, "{facet:?}");
    });
}
