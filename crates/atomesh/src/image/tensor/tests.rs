//! Normals against plane waves; tensors against their definition.

use super::*;
use crate::image::{gaussian, gaussian_derivative};
use crate::watch::Silent;
use rand::{RngExt, SeedableRng};

/// A plane wave along `direction`, in lattice units, one period every `length` of them.
fn wave<const D: usize>(grid: &Grid<D>, direction: [f64; D], length: f64) -> Vec<f32> {
    let phase = |i| -> f64 {
        let at = coordinates(i, grid.shape);
        (0..D).map(|k| direction[k] * at[k] as f64 * grid.step[k]).sum()
    };
    let turn = std::f64::consts::TAU / length;
    (0..grid.sample_count()).map(|i| (turn * phase(i)).sin() as f32).collect()
}

fn noise(count: usize) -> Vec<f32> {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(5);
    (0..count).map(|_| random.random::<f32>()).collect()
}

fn unit<const D: usize>(v: [f64; D]) -> [f64; D] {
    let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / norm)
}

fn angle<const D: usize>(a: [f64; D], b: [f32; D]) -> f64 {
    let cosine: f64 = (0..D).map(|k| a[k] * f64::from(b[k])).sum();
    cosine.abs().min(1.0).acos().to_degrees()
}

fn follows_waves<const D: usize>(grid: Grid<D>, scale: f64, smooth: [f64; D], length: f64) {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(9);
    for _ in 0..12 {
        let direction = unit(std::array::from_fn(|_| random.random::<f64>() - 0.5));
        let values = wave(&grid, direction, length);
        let tensor = StructureTensor::new(&values, &grid, scale, smooth, &mut Silent).unwrap();
        let middle = grid.shape.map(|n| n / 2);
        let (normal, planar) = normal(&tensor.at(middle));
        // kernels are cut at 4σ, smoothing leaves a little of the products' own waves
        let off = angle(direction, normal);
        assert!(off < 0.3, "{off}° from {direction:?}: {normal:?}");
        assert!(planar > 0.98, "{planar}");
        let last = normal.iter().rev().find(|&&n| n != 0.0);
        assert!(last.is_some_and(|&n| n > 0.0), "{normal:?}");
    }
}

#[test]
fn normals_are_those_of_plane_waves() {
    follows_waves(Grid { shape: [90, 101], step: [1.0; 2] }, 1.5, [9.0; 2], 12.0);
    follows_waves(Grid { shape: [90, 80], step: [1.0, 2.0] }, 2.0, [12.0, 6.0], 20.0);
    follows_waves(Grid { shape: [51, 47, 55], step: [1.0; 3] }, 1.0, [6.0; 3], 9.0);
    follows_waves(Grid { shape: [60, 60, 30], step: [1.0, 1.0, 2.0] }, 1.5, [8.0, 8.0, 4.0], 12.0);
}

/// The tensors by the definition, at every sample.
fn direct<const D: usize>(
    values: &[f32],
    shape: [usize; D],
    scale: f64,
    smooth: [f64; D],
) -> Vec<Vec<f32>> {
    let slope = |k| {
        let order = std::array::from_fn(|axis| u8::from(axis == k));
        gaussian_derivative(values, shape, [scale; D], order)
    };
    let slopes: [Vec<f32>; D] = std::array::from_fn(slope);
    let mut entries = Vec::new();
    for a in 0..D {
        for b in a..D {
            let mut entry: Vec<f32> =
                slopes[a].iter().zip(&slopes[b]).map(|(x, y)| x * y).collect();
            gaussian(&mut entry, shape, smooth);
            entries.push(entry);
        }
    }
    entries
}

fn equals_direct<const D: usize>(shape: [usize; D], smooth: [f64; D], tolerance: f64) {
    let values = noise(shape.iter().product());
    let grid = Grid { shape, step: [1.0; D] };
    let tensor = StructureTensor::new(&values, &grid, 1.5, smooth, &mut Silent).unwrap();
    let entries = direct(&values, shape, 1.5, smooth);
    // the values, below 1, were brought near 1 first
    let scale = f64::from(unit_scale(&values)).powi(2);
    let trace: f64 = (0..D)
        .map(|k| (0..D - k).map(|j| D - j).sum::<usize>())
        .map(|end| {
            let entry = &entries[entries.len() - end];
            entry.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
        })
        .sum();
    for i in 0..values.len() {
        let found = tensor.at(coordinates(i, shape));
        let mut expected = entries.iter();
        for a in 0..D {
            for b in a..D {
                let slow = f64::from(expected.next().unwrap()[i]);
                let error = (found[a][b] / scale - slow).abs();
                assert!(error < tolerance * trace, "{error} of {trace} at {i} of {shape:?}");
            }
        }
    }
}

#[test]
fn cells_of_one_sample_are_the_definition() {
    for smooth in [[0.0, 0.0], [2.0, 1.0]] {
        equals_direct([37, 22], smooth, 1e-5);
    }
    equals_direct([17, 12, 21], [1.0, 0.0, 2.5], 1e-5);
    equals_direct([1, 9, 3], [1.0; 3], 1e-5);
}

#[test]
fn wide_cells_are_the_definition_to_a_few_percent_of_the_trace() {
    // of a bend, what is linear between cells loses a share of 1/8 (width/σ)², or 1.4 %, along each axis; twice that at the edges
    equals_direct([121, 90], [12.0, 12.0], 0.04);
    equals_direct([121, 90], [12.0, 0.0], 0.1);
    equals_direct([50, 43, 61], [9.0, 7.0, 12.0], 0.02);
}

#[test]
fn a_turned_image_has_turned_normals() {
    let (shape, smooth) = ([23, 31, 18], [7.0, 3.0, 5.0]);
    let values = noise(shape.iter().product());
    let of = |values: &[f32], shape, smooth| {
        let grid = Grid { shape, step: [1.0; 3] };
        StructureTensor::new(values, &grid, 1.0, smooth, &mut Silent).unwrap()
    };
    let tensor = of(&values, shape, smooth);
    let backwards: Vec<f32> = values.iter().rev().copied().collect();
    let turned = of(&backwards, shape, smooth);
    let count = values.len();
    // axes in the order z, x, y
    let swapped_shape = [shape[2], shape[0], shape[1]];
    let place = |at: [usize; 3]| at[2] + shape[2] * (at[0] + shape[0] * at[1]);
    let mut swapped = vec![0.0; count];
    (0..count).for_each(|i| swapped[place(coordinates(i, shape))] = values[i]);
    let swapped = of(&swapped, swapped_shape, [smooth[2], smooth[0], smooth[1]]);
    for i in 0..count {
        let here = tensor.at(coordinates(i, shape));
        let there = turned.at(coordinates(count - 1 - i, shape));
        let at = coordinates(i, shape);
        let exchanged = swapped.at([at[2], at[0], at[1]]);
        let trace = here[0][0] + here[1][1] + here[2][2];
        for a in 0..3 {
            for b in 0..3 {
                // rounding alone
                assert!((here[a][b] - there[a][b]).abs() < 1e-5 * trace);
                let (c, d) = ((a + 1) % 3, (b + 1) % 3);
                assert!((here[a][b] - exchanged[c][d]).abs() < 1e-5 * trace);
            }
        }
    }
}

#[test]
fn normals_along_a_row_are_those_of_its_samples() {
    let grid = Grid { shape: [30, 9, 14], step: [1.0; 3] };
    let values = noise(grid.sample_count());
    let tensor = StructureTensor::new(&values, &grid, 1.0, [4.0; 3], &mut Silent).unwrap();
    let row = tensor.row([0, 5, 8]).unwrap();
    (0..30).for_each(|x| assert_eq!(row.normal(x), tensor.normal(x + 30 * (5 + 9 * 8))));
}

#[test]
fn constant_images_and_thin_ones_have_a_normal() {
    for value in [0.0, 3.5, -1e30] {
        let grid = Grid { shape: [9, 8, 1], step: [1.0; 3] };
        let tensor =
            StructureTensor::new(&[value; 72], &grid, 3.0, [12.0; 3], &mut Silent).unwrap();
        let (normal, planar) = tensor.normal(40);
        let norm: f32 = normal.iter().map(|n| n * n).sum();
        assert!((norm - 1.0).abs() < 1e-5 && (0.0..=1.0).contains(&planar));
    }
    let grid = Grid { shape: [4, 4], step: [1.0; 2] };
    let flat = StructureTensor::new(&[0.0; 16], &grid, 1.0, [0.0; 2], &mut Silent).unwrap();
    assert_eq!(flat.normal(5), ([0.0, 1.0], 0.0));
}

#[test]
fn the_size_of_values_does_not_matter() {
    let grid = Grid { shape: [30, 30], step: [1.0; 2] };
    let plain = wave(&grid, unit([1.0, 2.0]), 8.0);
    let of = |factor: f32| {
        let values: Vec<f32> = plain.iter().map(|v| v * factor).collect();
        StructureTensor::new(&values, &grid, 1.0, [4.0; 2], &mut Silent).unwrap().normal(465)
    };
    for factor in [f32::powi(2.0, 120), f32::powi(2.0, -100)] {
        assert_eq!(of(factor), of(1.0));
    }
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let grid = Grid { shape: [33, 29, 61], step: [1.0; 3] };
    let values = noise(grid.sample_count());
    for smooth in [[0.0; 3], [5.0; 3]] {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let make = || StructureTensor::new(&values, &grid, 1.0, smooth, &mut Silent);
            let tensor = pool.install(make).unwrap();
            (0..values.len()).map(|i| tensor.normal(i)).collect::<Vec<_>>()
        };
        assert!(run(1) == run(3) && run(1) == run(7));
    }
}
