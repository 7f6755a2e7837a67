//! Sparse equations of two-point flux: factors in the plane, multigrid in space.

use atomesh::geometry::Point;
use atomesh::watch::Silent;
use atomesh_flow::solve::{SolveMethod, SolveOptions, Sparse, System, solve};
use criterion::{Criterion, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Two-point flux between n^D cubes whose permeabilities span four decades, pressure fixed where x begins.
fn cubes<const D: usize>(n: usize) -> (Sparse, Vec<f64>, Vec<Point<D>>) {
    let count = n.pow(D as u32);
    let mut random = Pcg64::seed_from_u64(1);
    let k: Vec<f64> = (0..count).map(|_| 10.0_f64.powf(4.0 * random.random::<f64>())).collect();
    let (mut entries, mut places) = (Vec::new(), Vec::new());
    for cell in 0..count {
        let at: [usize; D] = std::array::from_fn(|axis| cell / n.pow(axis as u32) % n);
        places.push(at.map(|x| x as f64));
        if at[0] == 0 {
            entries.push((cell as u32, cell as u32, 2.0 * k[cell]));
        }
        for axis in (0..D).filter(|&axis| at[axis] + 1 < n) {
            let other = cell + n.pow(axis as u32);
            let (i, j, t) = (cell as u32, other as u32, 2.0 / (1.0 / k[cell] + 1.0 / k[other]));
            entries.extend([(i, i, t), (j, j, t), (i, j, -t), (j, i, -t)]);
        }
    }
    let mut rhs = vec![0.0; count];
    rhs[count - 1] = 1.0;
    (Sparse::from_entries(count, count, &entries), rhs, places)
}

fn run<const D: usize>(criterion: &mut Criterion, name: &str, n: usize, method: SolveMethod) {
    let (matrix, rhs, places) = cubes::<D>(n);
    let system = System {
        matrix: &matrix,
        rhs: &rhs,
        is_symmetric: true,
        block: 1,
        places: &places,
        coarse: None,
    };
    let options = SolveOptions { method, ..Default::default() };
    let mut group = criterion.benchmark_group("solve");
    group.sample_size(10);
    group.bench_function(name, |bencher| {
        bencher.iter(|| solve(&system, &options, &mut Silent).expect("definite equations"));
    });
    group.finish();
}

fn benches(criterion: &mut Criterion) {
    run::<2>(criterion, "factors, 300 x 300", 300, SolveMethod::Direct);
    run::<3>(criterion, "multigrid, 50 x 50 x 50", 50, SolveMethod::Iterative);
}

criterion_group!(solving, benches);
criterion_main!(solving);
