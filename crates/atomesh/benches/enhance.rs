//! Features of raw images: how long it takes to find them, in samples per second. Volumes are synthetic layers with noise.

use atomesh::enhance::{DenoiseOptions, FeatureOptions, Features, denoise, feature_points};
use atomesh::image::{Image, Samples};
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

const VALID: &str = "a synthetic volume is finite";

fn layers(side: usize) -> Image<3> {
    let options = SynthOptions { noise: 0.1, seed: 1, ..SynthOptions::new([side; 3]) };
    synthesize(Scene::Layers, &options).expect(VALID).image
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("enhance");
    group.sample_size(10);
    for side in [96, 128] {
        let image = layers(side);
        group.throughput(Throughput::Elements(side.pow(3) as u64));
        for features in [Features::Faults, Features::Horizons, Features::Ridges] {
            let options = FeatureOptions { features, ..Default::default() };
            group.bench_function(BenchmarkId::new(format!("{features:?}"), side), |b| {
                b.iter(|| feature_points(&image, &options, &mut Silent).expect(VALID));
            });
        }
        let values = Samples::to_f32(image.samples());
        let (grid, options) =
            (image.frame().grid(Default::default()), DenoiseOptions::for_dimension(3));
        group.bench_function(BenchmarkId::new("Denoise", side), |b| {
            b.iter(|| denoise(&values, &grid, &options, &mut Silent).expect(VALID));
        });
    }
    group.finish();
}

criterion_group!(enhance, benches);
criterion_main!(enhance);
