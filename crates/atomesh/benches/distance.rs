//! Making d(x) from a field and limiting its slope, samples per second.

use atomesh::fields::NominalDistance;
use atomesh::image::Grid;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// Of 2 at about 60 samples, 64 elsewhere: the limit changes every node but those.
fn points(count: usize) -> Vec<f32> {
    let mut field = vec![64.0; count];
    let mut random = 7_u64;
    for _ in 0..60 {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        field[(random >> 20) as usize % count] = 2.0;
    }
    field
}

/// Ramps within the limit: nothing changes.
fn ramps(count: usize, side: usize) -> Vec<f32> {
    (0..count).map(|i| 4.0 + 0.1 * (i % side) as f32).collect()
}

fn bench<const D: usize>(criterion: &mut Criterion, name: &str, shape: [usize; D], field: &[f32]) {
    let grid = Grid { shape, step: [1.0; D] };
    let mut group = criterion.benchmark_group("distance");
    group.sample_size(10).throughput(Throughput::Elements(field.len() as u64));
    group.bench_function(name, |b| b.iter(|| NominalDistance::from_field(&grid, field, 0.25)));
    group.finish();
}

fn benches(criterion: &mut Criterion) {
    let (plane, space) = ([3000, 2000], [128; 3]);
    bench(criterion, "plane/points", plane, &points(6_000_000));
    bench(criterion, "plane/ramps", plane, &ramps(6_000_000, 3000));
    bench(criterion, "space/points", space, &points(1 << 21));
    bench(criterion, "space/ramps", space, &ramps(1 << 21, 128));
}

criterion_group!(distance, benches);
criterion_main!(distance);
