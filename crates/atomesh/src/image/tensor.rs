//! The structure tensor: which way an image is layered, about each sample.
//!
//! In this order:
//!
//! 1. gradients of the image, smoothed a little, plane by plane;
//! 2. their outer products, at once averaged over cells of some samples each;
//! 3. the averages smoothed by as much as is left of the wide Gaussian;
//! 4. on request, the tensor at a sample, linear between cells, and its eigenvectors.
//!
//! With σ = 12 the tensors of a volume take a tenth of the memory of the image: see `cells`.
//!
//! Source: van Vliet & Verbeek (1995) for tensors of Gaussian derivatives; Hale (2002) uses them for the
//! normals of features. Cells are ours.

use super::Grid;
use super::cells::{CellAverages, CellRow, Entries, between};
use super::stream::{Stencil, Stream};
use crate::geometry::linear::{Matrix, largest_eigenpair};
use crate::geometry::{cross, dot};
use crate::watch::{Cancelled, Watch};
use rayon::prelude::*;

/// Outer products of Gaussian gradients, smoothed: its leading eigenvector is the normal of layers and sheets.
///
/// In two or three dimensions. See the module for how it is held.
#[derive(Clone, Debug)]
pub struct StructureTensor<const D: usize> {
    shape: [usize; D],
    /// The upper triangle of the tensors, row by row; `None` of an image without samples.
    averages: Option<CellAverages<D>>,
}

/// The products of slopes.
struct Products;

impl<const D: usize> Entries<D> for Products {
    fn count(&self) -> usize {
        D * (D + 1) / 2
    }

    fn write(&self, entry: usize, _: &[f32], slopes: [&[f32]; D], out: &mut [f32]) {
        let (mut row, mut before) = (0, 0);
        while entry - before >= D - row {
            before += D - row;
            row += 1;
        }
        let (a, b) = (slopes[row], slopes[row + entry - before]);
        for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
            *out = a * b;
        }
    }
}

impl<const D: usize> StructureTensor<D> {
    /// The tensors of an image.
    ///
    /// Gradients are per lattice unit, of the image smoothed by `derivative_scale`, in least steps of the
    /// grid, as of [`gradient_magnitude`](super::gradient_magnitude). Their products are smoothed by a Gaussian of standard deviations
    /// `smooth`, in samples along each axis; 0 leaves an axis alone. Samples are mirrored about the
    /// image's edges. The values' size does not matter.
    ///
    /// Cost: O(derivative scale) per sample. Memory: D (D + 1)/2 numbers a cell, and planes.
    /// The same at any number of threads.
    ///
    /// # Errors
    /// [`Cancelled`] if the watch ends the work.
    ///
    /// # Panics
    /// If there are not as many values as the grid's shape says, or a scale is not finite, or
    /// `derivative_scale` is not above 0, or a `smooth` is below 0.
    pub fn new(
        values: &[f32],
        grid: &Grid<D>,
        derivative_scale: f64,
        smooth: [f64; D],
        watch: &mut dyn Watch,
    ) -> Result<Self, Cancelled> {
        assert_eq!(values.len(), grid.sample_count(), "samples for shape {:?}", grid.shape);
        assert!(derivative_scale.is_finite() && derivative_scale > 0.0, "σ is {derivative_scale}");
        if values.is_empty() {
            return Ok(Self { shape: grid.shape, averages: None });
        }
        let scale = unit_scale(values);
        let fill = |start: usize, out: &mut [f32]| {
            for (out, v) in out.iter_mut().zip(&values[start..]) {
                *out = v * scale;
            }
        };
        let least = grid.least_step();
        let grid = Grid { step: grid.step.map(|step| step / least), ..*grid };
        let stream = Stream::new(fill, &grid, Stencil::Gaussian(derivative_scale));
        let averages = CellAverages::new(&stream, grid.shape, smooth, &Products, watch)?;
        Ok(Self { shape: grid.shape, averages: Some(averages) })
    }

    /// The tensor at a sample, in squared lattice units, of which only the ratios mean something.
    fn at(&self, sample: [usize; D]) -> Matrix<D> {
        let Some(averages) = &self.averages else { return [[0.0; D]; D] };
        let row = averages.row(sample);
        matrix(|entry| row.at(entry, sample[0]))
    }

    /// The normals of the row, along the first axis, of a sample: for asking for many.
    pub(crate) fn row(&self, sample: [usize; D]) -> Option<NormalRow<'_, D>> {
        let row = self.averages.as_ref()?.row(sample);
        let mut cells = Vec::new();
        row.cells(&mut cells);
        Some(NormalRow { row, cells })
    }

    /// Unit normal (lattice units), sign so that its last non-zero component is positive, and how planar, 0…1.
    ///
    /// The latter is (λ₁ − λ₂)/λ₁ of the tensor's largest eigenvalues: 1 where all gradients about the sample have
    /// one direction, 0 where two directions are as good as each other. Where there is no
    /// gradient at all, the normal is along the last axis, and not planar.
    ///
    /// # Panics
    /// If there is no such sample.
    pub fn normal(&self, index: usize) -> ([f32; D], f32) {
        let mut rest = index;
        normal(&self.at(std::array::from_fn(|k| {
            let i = rest % self.shape[k];
            rest /= self.shape[k];
            i
        })))
    }
}

/// Normals along a row of samples.
pub(crate) struct NormalRow<'a, const D: usize> {
    row: CellRow<'a, D>,
    /// The tensors of the row's cells, entry by entry.
    cells: Vec<f32>,
}

impl<const D: usize> NormalRow<'_, D> {
    /// [`StructureTensor::normal`] of sample `x` of the row, to the last bit.
    pub(crate) fn normal(&self, x: usize) -> ([f32; D], f32) {
        let (here, next, share) = self.row.place(x);
        let count = self.cells.len() / (D * (D + 1) / 2);
        normal(&matrix(|entry| {
            let cells = &self.cells[entry * count..];
            between(cells[here], cells[next], share)
        }))
    }
}

/// The symmetric matrix of which `entry` gives the upper triangle, row by row.
fn matrix<const D: usize>(entry: impl Fn(usize) -> f32) -> Matrix<D> {
    let (mut matrix, mut count) = ([[0.0; D]; D], 0);
    for a in 0..D {
        for b in a..D {
            matrix[a][b] = entry(count).into();
            matrix[b][a] = matrix[a][b];
            count += 1;
        }
    }
    matrix
}

/// The leading eigenvector of a tensor, and how much it leads; see [`StructureTensor::normal`].
fn normal<const D: usize>(tensor: &Matrix<D>) -> ([f32; D], f32) {
    let (mut trace, mut squares) = (0.0, 0.0);
    for a in 0..D {
        trace += tensor[a][a];
        for b in 0..D {
            squares += tensor[a][b] * tensor[a][b];
        }
    }
    if trace <= 0.0 {
        return (std::array::from_fn(|k| if k == D - 1 { 1.0 } else { 0.0 }), 0.0);
    }
    let (largest, normal) = leading(tensor, trace);
    // the others are known by their sum and the sum of their squares
    let (sum, squares) = (trace - largest, (squares - largest * largest).max(0.0));
    let second = match D {
        2 => sum,
        _ => 0.5 * (sum + (2.0 * squares - sum * sum).max(0.0).sqrt()),
    };
    let planar = (1.0 - second / largest).clamp(0.0, 1.0);
    let last = normal.iter().rev().find(|&&n| n as f32 != 0.0);
    let sign = if last.is_some_and(|&n| n < 0.0) { -1.0 } else { 1.0 };
    (normal.map(|n| (sign * n) as f32 + 0.0), planar as f32) // no −0
}

/// Cross products of rows shorter than this share of the squared trace do not tell the direction of an eigenvector.
const LEAST_CROSS: f64 = 1e-4;

/// Newton steps for the largest eigenvalue; six are enough where it is not nearly equal to the next.
const STEPS: usize = 12;

/// The largest eigenvalue of a positive semidefinite matrix and its unit eigenvector: in closed form for
/// D = 2, for D = 3 from the characteristic polynomial, several times faster than rotations; these where eigenvalues are nearly
/// equal.
fn leading<const D: usize>(a: &Matrix<D>, trace: f64) -> (f64, [f64; D]) {
    let mut vector = [0.0; D];
    let largest = if D == 2 {
        let half = 0.5 * (a[0][0] - a[1][1]);
        let root = half.hypot(a[0][1]);
        // of two equal vectors the one that does not cancel
        (vector[0], vector[1]) =
            if half > 0.0 { (half + root, a[0][1]) } else { (a[0][1], root - half) };
        0.5 * trace + root
    } else if D == 3 {
        let largest = largest_root(a, trace);
        let minus = |r: usize| [0, 1, 2].map(|c| a[r][c] - if r == c { largest } else { 0.0 });
        let rows = [minus(0), minus(1), minus(2)];
        let crosses = [(0, 1), (0, 2), (1, 2)].map(|(r, s)| cross(&rows[r], &rows[s]));
        let longest = crosses
            .iter()
            .fold(&crosses[0], |best, c| if dot(c, c) > dot(best, best) { c } else { best });
        if dot(longest, longest).sqrt() > LEAST_CROSS * trace * trace {
            vector.copy_from_slice(longest);
        }
        largest
    } else {
        0.0
    };
    let norm = dot(&vector, &vector).sqrt();
    if norm > 0.0 { (largest, vector.map(|v| v / norm)) } else { largest_eigenpair(*a) }
}

/// The largest root of the characteristic polynomial of a positive semidefinite 3 × 3 matrix, by Newton's method from
/// above, where the polynomial is convex, so that steps never pass the root.
fn largest_root<const D: usize>(a: &Matrix<D>, trace: f64) -> f64 {
    let minor = |r: usize, s: usize| a[r][r] * a[s][s] - a[r][s] * a[r][s];
    let minors = minor(0, 1) + minor(0, 2) + minor(1, 2);
    let determinant = a[0][0] * minor(1, 2) - a[0][1] * (a[0][1] * a[2][2] - a[1][2] * a[0][2])
        + a[0][2] * (a[0][1] * a[1][2] - a[1][1] * a[0][2]);
    // the norm is no less than the root, and near it for one large eigenvalue
    let mut root = (trace * trace - 2.0 * minors).max(0.0).sqrt();
    for _ in 0..STEPS {
        let value = ((root - trace) * root + minors) * root - determinant;
        let slope = (3.0 * root - 2.0 * trace) * root + minors;
        let step = if slope > 0.0 { value / slope } else { 0.0 };
        root -= step;
        if step <= 1e-15 * trace {
            break;
        }
    }
    root
}

/// A power of two that brings the values' greatest magnitude near 1, so that squares neither overflow
/// nor vanish.
fn unit_scale(values: &[f32]) -> f32 {
    let greatest = values
        .par_chunks(1 << 16)
        .map(|part| part.iter().fold(0.0f32, |most, v| most.max(v.abs())))
        .reduce(|| 0.0, f32::max);
    if greatest < f32::MIN_POSITIVE {
        return 1.0;
    }
    f32::powi(2.0, -(greatest.log2().floor() as i32).clamp(-126, 126))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{coordinates, gaussian, gaussian_derivative};
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
        follows_waves(
            Grid { shape: [60, 60, 30], step: [1.0, 1.0, 2.0] },
            1.5,
            [8.0, 8.0, 4.0],
            12.0,
        );
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

    fn leads_as_rotations_say<const D: usize>() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        for flat in [1.0, 0.1, 1e-3, 1e-9, 0.0] {
            for _ in 0..200 {
                // a sum of products of vectors, ever nearer to one direction
                let vectors: [[f64; D]; D] = std::array::from_fn(|v| {
                    let scale = if v == 0 { 1.0 } else { flat };
                    std::array::from_fn(|_| scale * (random.random::<f64>() - 0.5))
                });
                let a: Matrix<D> = std::array::from_fn(|r| {
                    std::array::from_fn(|c| vectors.iter().map(|v| v[r] * v[c]).sum())
                });
                let trace = (0..D).map(|k| a[k][k]).sum();
                let (fast, slow) = (leading(&a, trace), largest_eigenpair(a));
                assert!((fast.0 - slow.0).abs() < 1e-10 * trace, "{} {}", fast.0, slow.0);
                let cosine = dot(&fast.1, &slow.1).abs();
                // rounding over the least gap that cross products are taken for
                assert!(cosine > 1.0 - 1e-9, "{cosine} of {a:?}");
            }
        }
    }

    #[test]
    fn closed_forms_of_eigenvectors_are_those_of_rotations() {
        leads_as_rotations_say::<2>();
        leads_as_rotations_say::<3>();
    }

    #[test]
    fn equal_eigenvalues_have_some_unit_vector() {
        for diagonal in [[1.0, 1.0, 1.0], [2.0, 2.0, 1.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]] {
            let a = std::array::from_fn(|r| {
                std::array::from_fn(|c| if r == c { diagonal[r] } else { 0.0 })
            });
            let (value, vector) = leading::<3>(&a, diagonal.iter().sum());
            assert!(
                (value - diagonal[0]).abs() < 1e-6 && (dot(&vector, &vector) - 1.0).abs() < 1e-12
            );
        }
        let (value, vector) = leading::<2>(&[[1.0, 0.0], [0.0, 1.0]], 2.0);
        assert!((value - 1.0).abs() < 1e-12 && (dot(&vector, &vector) - 1.0).abs() < 1e-12);
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
}
