//! Every way to solve gives the right answer or an error.

mod order;
mod sparse;

use std::ops::ControlFlow;

use atomesh::geometry::Point;
use atomesh::watch::{Phase, Silent, Watch};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::vector::norm;
use super::*;

/// Equations that own their parts.
struct Owned<const D: usize> {
    matrix: Sparse,
    rhs: Vec<f64>,
    block: usize,
    places: Vec<Point<D>>,
    coarse: Option<Sparse>,
}

impl<const D: usize> Owned<D> {
    fn system(&self, is_symmetric: bool) -> System<'_, D> {
        System {
            matrix: &self.matrix,
            rhs: &self.rhs,
            is_symmetric,
            block: self.block,
            places: &self.places,
            coarse: self.coarse.as_ref(),
        }
    }

    fn answer(
        &self,
        method: SolveMethod,
        is_symmetric: bool,
    ) -> Result<(Vec<f64>, SolveReport), SolveError> {
        let options = SolveOptions { method, ..Default::default() };
        solve(&self.system(is_symmetric), &options, &mut Silent)
    }
}

/// All ways to solve symmetric equations.
const WAYS: [(SolveMethod, bool); 4] = [
    (SolveMethod::Direct, true),
    (SolveMethod::Iterative, true),
    (SolveMethod::Direct, false),
    (SolveMethod::Iterative, false),
];

/// Two-point flux on n^D unit cubes of permeability k, pressure 0 at a distance of one beyond both ends of each axis.
fn cubes<const D: usize>(n: usize, k: impl Fn(usize) -> f64) -> Owned<D> {
    let count = n.pow(D as u32);
    let (mut entries, mut places) = (Vec::new(), Vec::new());
    for cell in 0..count {
        let at: [usize; D] = std::array::from_fn(|axis| cell / n.pow(axis as u32) % n);
        places.push(at.map(|x| x as f64));
        for axis in 0..D {
            let other = cell + n.pow(axis as u32);
            let (i, j) = (cell as u32, other as u32);
            let ends = usize::from(at[axis] == 0) + usize::from(at[axis] + 1 == n);
            entries.push((i, i, ends as f64 * k(cell)));
            if at[axis] + 1 < n {
                let t = 2.0 / (1.0 / k(cell) + 1.0 / k(other));
                entries.extend([(i, i, t), (j, j, t), (i, j, -t), (j, i, -t)]);
            }
        }
    }
    let matrix = Sparse::from_entries(count, count, &entries);
    Owned { matrix, rhs: vec![0.0; count], block: 1, places, coarse: None }
}

fn random(seed: u64, count: usize) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(seed);
    (0..count).map(|_| random.random::<f64>()).collect()
}

fn farthest(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

/// Sines are the eigenvectors of the discrete Laplacian: Σ 4 sin²(π m / 2(n + 1)) their values.
fn sines_are_divided_by_their_eigenvalues<const D: usize>(n: usize) {
    let mut own = cubes::<D>(n, |_| 1.0);
    let turn = std::f64::consts::PI / (n as f64 + 1.0);
    let waves = [1.0, 3.0, 2.0];
    let value = |place: &Point<D>| {
        (0..D).map(|axis| (turn * waves[axis] * (place[axis] + 1.0)).sin()).product::<f64>()
    };
    own.rhs = own.places.iter().map(value).collect();
    let eigenvalue: f64 = (0..D).map(|axis| 4.0 * (0.5 * turn * waves[axis]).sin().powi(2)).sum();
    let exact: Vec<f64> = own.rhs.iter().map(|x| x / eigenvalue).collect();
    for (method, is_symmetric) in WAYS {
        let (x, report) = own.answer(method, is_symmetric).unwrap();
        // the residual is 10⁻¹², the condition number below 10³
        let error = farthest(&x, &exact);
        assert!(error < 1e-9, "{report:?}: {error}");
        assert!(report.residual <= 1e-12, "{report:?}");
        assert_eq!(report.iterations > 0, method == SolveMethod::Iterative);
    }
}

#[test]
fn sines_are_divided_by_their_eigenvalues_in_the_plane() {
    sines_are_divided_by_their_eigenvalues::<2>(40);
}

#[test]
fn sines_are_divided_by_their_eigenvalues_in_space() {
    sines_are_divided_by_their_eigenvalues::<3>(12);
}

/// Gaussian elimination with row pivots; `None` if a pivot is 0.
fn dense_answer(matrix: &Sparse, rhs: &[f64]) -> Option<Vec<f64>> {
    let n = rhs.len();
    let mut rows: Vec<Vec<f64>> = vec![vec![0.0; n + 1]; n];
    matrix.entries().for_each(|(i, j, v)| rows[i][j] = v);
    (0..n).for_each(|i| rows[i][n] = rhs[i]);
    for pivot in 0..n {
        let best =
            (pivot..n).max_by(|&a, &b| rows[a][pivot].abs().total_cmp(&rows[b][pivot].abs()))?;
        rows.swap(pivot, best);
        if rows[pivot][pivot] == 0.0 {
            return None;
        }
        let top = rows[pivot].clone();
        for row in &mut rows[pivot + 1..] {
            let factor = row[pivot] / top[pivot];
            (pivot..=n).for_each(|j| row[j] -= factor * top[j]);
        }
    }
    for pivot in (0..n).rev() {
        let sum: f64 = (pivot + 1..n).map(|j| rows[pivot][j] * rows[j][n]).sum();
        rows[pivot][n] = (rows[pivot][n] - sum) / rows[pivot][pivot];
    }
    Some(rows.iter().map(|row| row[n]).collect())
}

/// Random entries, made diagonally dominant; symmetric if asked.
fn dominant(count: usize, block: usize, seed: u64, is_symmetric: bool) -> Owned<2> {
    let mut random = Pcg64::seed_from_u64(seed);
    let n = count * block;
    let mut entries = Vec::new();
    let mut sums = vec![0.0; n];
    for _ in 0..4 * n {
        let (i, j) = (random.random_range(0..n), random.random_range(0..n));
        let value = random.random::<f64>() - 0.7;
        if i == j {
            continue;
        }
        entries.push((i as u32, j as u32, value));
        sums[i] += value.abs();
        if is_symmetric {
            entries.push((j as u32, i as u32, value));
            sums[j] += value.abs();
        }
    }
    entries.extend(sums.iter().enumerate().map(|(i, s)| (i as u32, i as u32, 1.1 * s + 0.1)));
    let matrix = Sparse::from_entries(n, n, &entries);
    let rhs = (0..n).map(|_| random.random::<f64>() - 0.5).collect();
    let places = (0..count).map(|_| [random.random(), random.random()]).collect();
    Owned { matrix, rhs, block, places, coarse: None }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn every_way_answers_as_dense_elimination(
        count in 1_usize..40, block in 1_usize..4, seed: u64, is_symmetric: bool,
    ) {
        let own = dominant(count, block, seed, is_symmetric);
        let exact = dense_answer(&own.matrix, &own.rhs).unwrap();
        let size = exact.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for method in [SolveMethod::Direct, SolveMethod::Iterative, SolveMethod::Auto] {
            let (x, report) = own.answer(method, is_symmetric).unwrap();
            // dominant by a tenth: a condition number of some 10² beside a residual of 10⁻¹²
            prop_assert!(farthest(&x, &exact) <= 1e-9 * size, "{:?}", report);
        }
    }

    #[test]
    fn any_matrix_gives_an_answer_or_an_error(
        entries in prop::collection::vec((0_u32..6, 0_u32..6, -2_i8..3), 0..30),
        rhs in prop::collection::vec(-2_i8..3, 6), block in 1_usize..4, is_symmetric: bool,
    ) {
        let entries: Vec<_> = entries.iter().map(|&(i, j, v)| (i, j, f64::from(v))).collect();
        let matrix = Sparse::from_entries(6, 6, &entries);
        let rhs: Vec<f64> = rhs.into_iter().map(f64::from).collect();
        let places = (0..6 / block).map(|at| [at as f64, 0.0]).collect();
        let own = Owned::<2> { matrix, rhs, block, places, coarse: None };
        for method in [SolveMethod::Direct, SolveMethod::Iterative, SolveMethod::Auto] {
            if let Ok((x, report)) = own.answer(method, is_symmetric) {
                let mut rest = vec![0.0; 6];
                own.matrix.residual(&own.rhs, &x, &mut rest);
                prop_assert!(norm(&rest) <= 1e-8 * norm(&own.rhs), "{:?}", report);
            }
        }
    }
}

#[test]
fn permeability_over_eight_decades_is_solved_alike_by_all_ways() {
    let decades = random(7, 15 * 15 * 15);
    let k = |cell: usize| 10.0_f64.powf(8.0 * decades[cell]);
    let mut own = cubes::<3>(15, k);
    own.rhs[7 + 15 * (7 + 15 * 7)] = 1.0;
    let (reference, _) = own.answer(SolveMethod::Direct, true).unwrap();
    let size = reference.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    for (method, is_symmetric) in WAYS {
        let (x, report) = own.answer(method, is_symmetric).unwrap();
        // 10⁸ units of rounding
        assert!(farthest(&x, &reference) < 1e-7 * size, "{report:?}");
        assert!(report.iterations < 60, "multigrid sees the strong couplings: {report:?}");
    }
}

#[test]
fn iterations_hardly_grow_with_the_mesh() {
    let iterations = |n: usize| {
        let mut own = cubes::<2>(n, |_| 1.0);
        own.rhs = random(1, n * n);
        own.answer(SolveMethod::Iterative, true).unwrap().1.iterations
    };
    let (few, many) = (iterations(40), iterations(160));
    assert!(many <= few + few / 2, "{few}, {many}: a Krylov method alone takes four times as many");
}

/// Square cells with a value at each of their four corners: the energy is the sum over the sides of cells of squared
/// differences, and of squared jumps between cells.
fn broken_squares(n: usize) -> Owned<2> {
    let unknown = |x: usize, y: usize, corner: usize| (4 * (x + n * y) + corner) as u32;
    let mut entries = Vec::new();
    let mut spring = |i: u32, j: u32, k: f64| {
        entries.extend([(i, i, k), (j, j, k), (i, j, -k), (j, i, -k)]);
    };
    let (mut coarse, mut places) = (Vec::new(), Vec::new());
    for y in 0..n {
        for x in 0..n {
            places.push([x as f64, y as f64]);
            for (a, b) in [(0, 1), (2, 3), (0, 2), (1, 3)] {
                spring(unknown(x, y, a), unknown(x, y, b), 1.0);
            }
            for (a, b) in [(1, 0), (3, 2)] {
                if x + 1 < n {
                    spring(unknown(x, y, a), unknown(x + 1, y, b), 5.0);
                }
            }
            for (a, b) in [(2, 0), (3, 1)] {
                if y + 1 < n {
                    spring(unknown(x, y, a), unknown(x, y + 1, b), 5.0);
                }
            }
            for corner in 0..4 {
                let node = x + corner % 2 + (n + 1) * (y + corner / 2);
                coarse.push((unknown(x, y, corner), node as u32, 1.0));
            }
        }
    }
    entries.push((0, 0, 1.0));
    let count = 4 * n * n;
    let matrix = Sparse::from_entries(count, count, &entries);
    let coarse = Some(Sparse::from_entries(count, (n + 1) * (n + 1), &coarse));
    let mut rhs = vec![0.0; count];
    rhs[count - 1] = 1.0;
    Owned { matrix, rhs, block: 4, places, coarse }
}

#[test]
fn a_coarse_space_keeps_iterations_few() {
    let iterations = |n: usize, has_coarse: bool| {
        let mut own = broken_squares(n);
        own.coarse = own.coarse.filter(|_| has_coarse);
        let reference = own.answer(SolveMethod::Direct, true).unwrap().0;
        let counts = [true, false].map(|is_symmetric| {
            let (x, report) = own.answer(SolveMethod::Iterative, is_symmetric).unwrap();
            assert!(farthest(&x, &reference) < 1e-8, "{report:?}");
            report.iterations
        });
        counts[0]
    };
    let (few, many) = (iterations(8, true), iterations(48, true));
    assert!(many <= few + few / 2, "{few}, {many}");
    assert!(iterations(48, false) > 3 * many);
}

#[test]
fn equations_without_an_answer_are_errors() {
    // no pressure fixed anywhere, and what flows in does not flow out
    let entries = [(0, 0, 1.0), (1, 1, 1.0), (0, 1, -1.0), (1, 0, -1.0)];
    for (block, places) in [(1, vec![[0.0], [1.0]]), (2, vec![[0.0]])] {
        let matrix = Sparse::from_entries(2, 2, &entries);
        let own = Owned { matrix, rhs: vec![1.0, 1.0], block, places, coarse: None };
        for (method, is_symmetric) in WAYS {
            let error = own.answer(method, is_symmetric).unwrap_err();
            assert!(
                matches!(error, SolveError::Singular { .. } | SolveError::NotConverged { .. }),
                "{error:?}"
            );
        }
    }
    let matrix = Sparse::from_entries(2, 2, &[(0, 0, 1.0)]);
    let places = vec![[0.0], [1.0]];
    let empty_row = Owned { matrix, rhs: vec![1.0, 1.0], block: 1, places, coarse: None };
    for (method, is_symmetric) in WAYS {
        assert!(empty_row.answer(method, is_symmetric).is_err());
    }
}

#[test]
fn what_is_not_finite_is_named() {
    let mut own = cubes::<2>(3, |_| 1.0);
    own.rhs[4] = f64::NAN;
    let error = own.answer(SolveMethod::Auto, true).unwrap_err();
    assert!(matches!(error, SolveError::NotFinite { equation: 4, .. }));
}

#[test]
fn one_unknown_none_and_nothing_that_flows() {
    for (method, is_symmetric) in WAYS {
        let matrix = Sparse::from_entries(1, 1, &[(0, 0, 4.0)]);
        let own = Owned { matrix, rhs: vec![2.0], block: 1, places: vec![[0.0]], coarse: None };
        assert!((own.answer(method, is_symmetric).unwrap().0[0] - 0.5).abs() < 1e-15);
        let none = Owned::<2> {
            matrix: Sparse::default(),
            rhs: vec![],
            block: 1,
            places: vec![],
            coarse: None,
        };
        assert_eq!(none.answer(method, is_symmetric).unwrap().0, []);
        let still = cubes::<2>(3, |_| 1.0);
        let (x, report) = still.answer(method, is_symmetric).unwrap();
        assert_eq!((x, report.residual), (vec![0.0; 9], 0.0));
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    // more than the rows and terms that threads share
    let mut own = cubes::<3>(24, |cell| 1.0 + (cell % 7) as f64);
    own.rhs = random(3, own.rhs.len());
    let broken = broken_squares(64);
    let answers = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let bits = |x: Vec<f64>| x.into_iter().map(f64::to_bits).collect::<Vec<_>>();
            let scalar = WAYS.map(|(method, symmetric)| own.answer(method, symmetric).unwrap().0);
            let blocks = broken.answer(SolveMethod::Iterative, true).unwrap().0;
            (scalar.map(bits), bits(blocks))
        })
    };
    assert_eq!(answers(1), answers(2));
}

/// Ends the work at a call.
struct Ends(usize, Vec<f64>);

impl Watch for Ends {
    fn step(&mut self, phase: Phase, done: f64, _: Option<f64>) -> ControlFlow<()> {
        assert_eq!(phase, Phase::Solve);
        self.1.push(done);
        if self.1.len() > self.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn the_watch_hears_of_progress_and_ends_the_work() {
    let mut own = cubes::<2>(30, |_| 1.0);
    own.rhs = random(2, 900);
    for (method, is_symmetric) in WAYS {
        let options = SolveOptions { method, ..Default::default() };
        for calls in 0..3 {
            let error = solve(&own.system(is_symmetric), &options, &mut Ends(calls, vec![]));
            assert!(matches!(error, Err(SolveError::Cancelled(_))));
        }
        let mut all = Ends(usize::MAX, vec![]);
        solve(&own.system(is_symmetric), &options, &mut all).unwrap();
        assert!(all.1.is_sorted() && all.1.iter().all(|done| (0.0..=1.0).contains(done)));
    }
}

#[test]
fn factors_larger_than_memory_are_an_error_and_auto_goes_on() {
    let mut own = cubes::<2>(30, |_| 1.0);
    own.rhs[0] = 1.0;
    let options = |method| SolveOptions { method, memory: 1000, ..Default::default() };
    let error = solve(&own.system(true), &options(SolveMethod::Direct), &mut Silent).unwrap_err();
    assert_eq!(error, SolveError::Memory { unknowns: 900 });
    let (_, report) = solve(&own.system(true), &options(SolveMethod::Auto), &mut Silent).unwrap();
    assert!(report.iterations > 0);
}

#[test]
fn iteration_that_may_not_end_is_an_error() {
    let mut own = cubes::<2>(40, |_| 1.0);
    own.rhs[0] = 1.0;
    let options = SolveOptions { method: SolveMethod::Iterative, limit: 2, ..Default::default() };
    let error = solve(&own.system(true), &options, &mut Silent).map(|found| found.1).unwrap_err();
    assert!(matches!(error, SolveError::NotConverged { iterations: 2, .. }), "{error}");
}
