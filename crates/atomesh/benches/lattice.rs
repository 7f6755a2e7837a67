//! Growing lattices, atoms per second, and putting them along a curve.

use atomesh::fields::NominalDistance;
use atomesh::geometry::hilbert_order;
use atomesh::image::Grid;
use atomesh::lattice::{Crystal, GrowOptions, grow};
use atomesh::watch::Silent;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// d of `least`, growing along x by `slope` a unit.
fn distance<const D: usize>(grid: &Grid<D>, least: f64, slope: f64) -> NominalDistance<D> {
    let field: Vec<f32> = (0..grid.sample_count())
        .map(|i| (least + slope * (i % grid.shape[0]) as f64) as f32)
        .collect();
    NominalDistance::from_field(grid, &field, 0.25).expect("lengths above a sample's step")
}

fn growth<const D: usize>(
    criterion: &mut Criterion,
    crystal: &Crystal<D>,
    shape: [usize; D],
    least: f64,
    slope: f64,
) {
    let grid = Grid { shape, step: [1.0; D] };
    let distance = distance(&grid, least, slope);
    let options = GrowOptions::default();
    let run = || grow(crystal, grid.bounds(), &distance, &options, &mut Silent);
    let atoms = run().expect("a box with room for atoms").len();
    let mut group = criterion.benchmark_group("grow");
    group.sample_size(10).throughput(Throughput::Elements(atoms as u64));
    let kind = if slope == 0.0 { "constant" } else { "graded" };
    group.bench_function(format!("{}/{kind}", crystal.kind().name()), |b| b.iter(run));
    group.finish();
}

fn benches(criterion: &mut Criterion) {
    growth(criterion, &Crystal::hexagonal(), [2000, 1000], 6.0, 0.0);
    growth(criterion, &Crystal::hexagonal(), [2000, 1000], 3.0, 0.01);
    for crystal in [Crystal::body_centered_cubic(), Crystal::face_centered_cubic()] {
        // a brain's box
        growth(criterion, &crystal, [197, 233, 189], 6.0, 0.0);
        growth(criterion, &crystal, [200; 3], 3.0, 0.05);
    }
    let grid = Grid { shape: [197, 233, 189], step: [1.0; 3] };
    let distance = NominalDistance::constant(&grid, 6.0).expect("a length above a sample's step");
    let crystal = Crystal::body_centered_cubic();
    let lattice = grow(&crystal, grid.bounds(), &distance, &GrowOptions::default(), &mut Silent);
    let atoms = lattice.expect("a box with room for atoms").atoms().to_vec();
    let mut group = criterion.benchmark_group("order");
    group.throughput(Throughput::Elements(atoms.len() as u64));
    group.bench_function("hilbert", |b| b.iter(|| hilbert_order(&atoms)));
    group.finish();
}

criterion_group!(lattice, benches);
criterion_main!(lattice);
