//! One energy and gradient, in atoms per second: the pairs engine with lists in hand and made anew, the
//! sampled engine, and the steps of a minimization around them.
//!
//! ```console
//! $ RAYON_NUM_THREADS=1 cargo bench -p atomesh --bench energy
//! ```

use atomesh::energy::{Engine, PairsEngine, SampledEngine};
use atomesh::fields::{FieldsView, ImageWeight, Interpolation, NominalDistance, ScalarField};
use atomesh::geometry::{Point, compact_order};
use atomesh::image::Grid;
use atomesh::minimize::{Lbfgs, LbfgsOptions, Objective};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// Nominal distance, in samples.
const DISTANCE: f64 = 8.0;

/// A face-centred cubic lattice in a cube of so many samples a side, in a compact order.
fn crystal(side: usize) -> Vec<Point<3>> {
    let edge = DISTANCE * 2f64.sqrt();
    let cells = (side as f64 / edge) as usize + 1;
    let mut atoms = Vec::new();
    for i in 0..cells.pow(3) {
        let corner = [i % cells, i / cells % cells, i / cells / cells].map(|i| i as f64);
        for basis in [[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]] {
            let p: Point<3> = std::array::from_fn(|k| edge * (corner[k] + basis[k]));
            if p.iter().all(|x| *x <= (side - 1) as f64) {
                atoms.push(p);
            }
        }
    }
    compact_order(&atoms).iter().map(|&i| atoms[i as usize]).collect()
}

fn engines(criterion: &mut Criterion) {
    let grid = Grid { shape: [256; 3], step: [1.0; 3] };
    let samples = (0..grid.sample_count()).map(|i| -((i * 31 % 101) as f32) / 101.0).collect();
    let Ok(potential) = ScalarField::potential(grid, samples, Interpolation::Linear) else {
        return;
    };
    let Ok(distance) = NominalDistance::constant(&grid, DISTANCE) else { return };
    let Ok(weight) = ImageWeight::constant(0.5) else { return };
    let fields = FieldsView { potential: &potential, weight: &weight, distance: &distance };
    let atoms = crystal(256);
    let mut gradient = vec![[0.0; 3]; atoms.len()];
    let mut group = criterion.benchmark_group("energy");
    group.sample_size(20).throughput(Throughput::Elements(atoms.len() as u64));

    let mut pairs = PairsEngine::new(fields);
    pairs.prepare(&atoms, 0.1);
    group.bench_function("pairs", |b| b.iter(|| pairs.evaluate(&atoms, &mut gradient)));
    group.bench_function("lists", |b| b.iter(|| pairs.prepare(&atoms, f64::INFINITY)));
    group.bench_function("lists_and_pairs", |b| {
        b.iter(|| {
            pairs.prepare(&atoms, f64::INFINITY);
            pairs.evaluate(&atoms, &mut gradient)
        });
    });
    let mut sampled = SampledEngine::new(fields);
    sampled.prepare(&atoms, 0.1);
    group.bench_function("sampled", |b| b.iter(|| sampled.evaluate(&atoms, &mut gradient)));
    group.bench_function("order", |b| b.iter(|| compact_order(&atoms)));
    group.finish();

    let Ok(none) = ImageWeight::constant(0.0) else { return };
    let atoms = crystal(708);
    let mut gradient = vec![[0.0; 3]; atoms.len()];
    let fields = FieldsView { weight: &none, ..fields };
    let mut pairs = PairsEngine::new(fields);
    pairs.prepare(&atoms, 0.1);
    let mut group = criterion.benchmark_group("million");
    group.sample_size(10).throughput(Throughput::Elements(atoms.len() as u64));
    group.bench_function("pairs", |b| b.iter(|| pairs.evaluate(&atoms, &mut gradient)));
    group.bench_function("lists", |b| b.iter(|| pairs.prepare(&atoms, f64::INFINITY)));
}

/// A bowl that costs next to nothing, so that what is left is the minimizer's own work.
struct Bowl;

impl Objective for Bowl {
    fn evaluate(&mut self, x: &[f64], gradient: &mut [f64]) -> f64 {
        // stiffer from variable to variable, so that the minimizer does not arrive at once
        for (i, (g, x)) in gradient.iter_mut().zip(x).enumerate() {
            *g = x * (1.0 + (i % 1000) as f64);
        }
        x.iter().zip(&*gradient).map(|(x, g)| 0.5 * x * g).sum()
    }
}

fn minimizer(criterion: &mut Criterion) {
    let count = 150_000;
    let mut group = criterion.benchmark_group("minimize");
    group.sample_size(10).throughput(Throughput::Elements(count));
    group.bench_function("lbfgs_20_iterations", |b| {
        b.iter(|| {
            let mut lbfgs = Lbfgs::new(vec![1.0; count as usize], LbfgsOptions::default());
            lbfgs.restart(&mut Bowl);
            for _ in 0..20 {
                lbfgs.iterate(&mut Bowl);
            }
            lbfgs.value()
        });
    });
}

criterion_group!(benches, engines, minimizer);
criterion_main!(benches);
