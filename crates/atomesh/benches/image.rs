//! Image work, in samples per second: Gaussian, gradients, potentials.

use atomesh::enhance::{DenoiseOptions, FeatureOptions, Features, denoise, enhance};
use atomesh::image::{
    Frame, Grid, Image, Samples, StructureTensor, gaussian, gradient_magnitude, prewitt_magnitude,
};
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const SIDE: usize = 256;
const SHAPE: [usize; 3] = [SIDE; 3];

/// Layers with some texture, as bytes.
fn layers() -> Vec<u8> {
    (0..SIDE * SIDE * SIDE).map(|i| ((i >> 19) * 16 + i * 31 % 13) as u8).collect()
}

fn image_work(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("image");
    group.sample_size(10).throughput(Throughput::Elements((SIDE * SIDE * SIDE) as u64));

    let mut values: Vec<f32> = layers().iter().map(|&v| v.into()).collect();
    for (axis, name) in ["gaussian_x", "gaussian_y", "gaussian_z"].into_iter().enumerate() {
        let sigma = std::array::from_fn(|k| if k == axis { 2.0 } else { 0.0 });
        group.bench_function(name, |b| b.iter(|| gaussian(&mut values, SHAPE, sigma)));
    }
    group.bench_function("gaussian", |b| b.iter(|| gaussian(&mut values, SHAPE, [2.0; 3])));

    // a slab, since each sample is compared with 342 others
    let slab = Grid { shape: [SIDE, SIDE, 8], step: [1.0; 3] };
    let options = DenoiseOptions::for_dimension(3);
    group.throughput(Throughput::Elements(slab.sample_count() as u64));
    group.bench_function("denoise", |b| {
        b.iter(|| denoise(&values[..slab.sample_count()], &slab, &options, &mut Silent));
    });
    group.throughput(Throughput::Elements((SIDE * SIDE * SIDE) as u64));

    let single = Samples::F32(values.into());
    group.bench_function("range_f32", |b| b.iter(|| single.range()));

    let samples = Samples::U8(layers().into());
    let grid = Grid { shape: SHAPE, step: [1.0; 3] };
    group.bench_function("gradient_gaussian", |b| {
        b.iter(|| gradient_magnitude(&samples, &grid, 1.5));
    });
    group.bench_function("gradient_prewitt", |b| b.iter(|| prewitt_magnitude(&samples, &grid)));

    let layered: Vec<f32> = layers().iter().map(|&v| v.into()).collect();
    group.bench_function("tensor", |b| {
        b.iter(|| StructureTensor::new(&layered, &grid, 3.0, [12.0; 3], &mut Silent));
    });

    let Ok(frame) = Frame::new(SHAPE) else { return };
    let Ok(image) = Image::new(frame, samples) else { return };
    for (features, name) in [(Features::Dark, "enhance_dark"), (Features::Edges, "enhance_edges")] {
        let options = FeatureOptions { features, ..Default::default() };
        group.bench_function(name, |b| b.iter(|| enhance(&image, &options, &mut Silent)));
    }
    let Ok(image) = Image::new(frame, single) else { return };
    let options = FeatureOptions { features: Features::Dark, ..Default::default() };
    group.bench_function("enhance_dark_f32", |b| {
        b.iter(|| enhance(&image, &options, &mut Silent));
    });

    // amplitudes: what the search for lines and sheets is for
    let side = SIDE / 2;
    group.throughput(Throughput::Elements((side * side * side) as u64));
    let drawing = SynthOptions { noise: 0.1, ..SynthOptions::new([side; 3]) };
    let Ok(drawn) = synthesize(Scene::Layers, &drawing) else { return };
    let kinds = [Features::Ridges, Features::Horizons, Features::Faults];
    for (features, name) in kinds.into_iter().zip(["ridges", "horizons", "faults"]) {
        let options = FeatureOptions { features, ..Default::default() };
        group.bench_function(name, |b| b.iter(|| enhance(&drawn.image, &options, &mut Silent)));
    }
    group.finish();
}

criterion_group!(benches, image_work);
criterion_main!(benches);
