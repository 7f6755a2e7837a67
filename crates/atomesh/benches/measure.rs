//! Measures, in cells and samples per second: shape of cells, features, alignment, fidelity, samples in cells.

use atomesh::geometry::Point;
use atomesh::image::{Frame, Samples};
use atomesh::measure::{
    AlignmentOptions, SampledPotential, alignment, features, fidelity, shape, shapes,
};
use atomesh::mesh::Mesh;
use atomesh::sample::{SampleOptions, Statistic, sample_in_frame};
use atomesh::watch::Silent;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// Points along each axis.
const SIDE: usize = 38;
/// Samples from point to point.
const STEP: f64 = 4.0;

/// A cubic lattice whose points are off by up to a tenth of a step, each cube cut into six.
fn lattice() -> Mesh<3> {
    let place = |i: usize| [i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)];
    let off = |i: usize, k: usize| ((i * 7919 + k * 104_729) % 1000) as f64 / 5000.0 - 0.1;
    let points: Vec<Point<3>> = (0..SIDE.pow(3))
        .map(|i| std::array::from_fn(|k| STEP * (place(i)[k] as f64 + off(i, k))))
        .collect();
    let strides = [1, SIDE as u32, (SIDE * SIDE) as u32];
    let mut corners = Vec::new();
    for first in (0..SIDE.pow(3)).filter(|&i| place(i).iter().all(|&x| x + 1 < SIDE)) {
        let first = first as u32;
        for (a, b, c) in [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)] {
            let second = first + strides[a];
            let third = second + strides[b];
            corners.extend([first, second, third, third + strides[c]]);
        }
    }
    Mesh::new(points, corners).expect("a lattice is a mesh")
}

/// A potential with valleys along planes 23 samples apart.
fn valleys(side: usize) -> Vec<f32> {
    (0..side.pow(3))
        .map(|i| {
            let across = (i % side) as f32 + 0.3 * (i / side % side) as f32;
            let off = (across / 23.0 - (across / 23.0).round()) * 23.0;
            -(-0.5 * (off / 1.5).powi(2)).exp()
        })
        .collect()
}

fn measures(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("measure");
    group.sample_size(10);
    let mesh = lattice();
    group.throughput(Throughput::Elements(mesh.cell_count() as u64));
    group.bench_function("shapes", |b| b.iter(|| shapes(&mesh, &mut Silent)));
    group.bench_function("shape", |b| b.iter(|| shape(&mesh, None, &mut Silent)));

    let side = (SIDE - 1) * STEP as usize;
    let potential = valleys(side);
    group.throughput(Throughput::Elements(potential.len() as u64));
    let sampled = SampledPotential { values: &potential, shape: [side; 3] };
    group.bench_function("features", |b| {
        b.iter(|| features(sampled, STEP, &mut Silent));
    });
    let Ok(found) = features(sampled, STEP, &mut Silent) else { return };
    let options = AlignmentOptions::new(STEP);
    group.bench_function("alignment", |b| {
        b.iter(|| alignment(&mesh, &found, &options, &mut Silent));
    });

    let Ok(frame) = Frame::new([side; 3]) else { return };
    let image = Samples::F32(potential.into());
    group.bench_function("sample", |b| {
        let options = SampleOptions::new(&[Statistic::Mean, Statistic::Total]);
        b.iter(|| sample_in_frame(&mesh, &frame, &image, options, &mut Silent));
    });
    group.bench_function("fidelity", |b| {
        b.iter(|| fidelity(&mesh, &frame, &image, &mut Silent));
    });
    group.finish();
}

criterion_group!(benches, measures);
criterion_main!(benches);
