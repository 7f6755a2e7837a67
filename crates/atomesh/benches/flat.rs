//! From a field of wave velocities, 5395 × 1911 samples, to a graded mesh, step by step and whole:
//! vertices per second of the whole. Quality is shown by the example `velocity_model`.

use std::f64::consts::TAU;

use atomesh::fields::NominalDistance;
use atomesh::image::Grid;
use atomesh::lattice::{Crystal, GrowOptions, Lattice, Scatterer, fill_holes, grow, settle};
use atomesh::mesh::{Delaunay, Mesh};
use atomesh::watch::Silent;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const GRID: Grid<2> = Grid { shape: [5395, 1911], step: [12.5, 6.25] };

/// d(x) in metres: water, sediments faster with depth, a body of salt; 4 Hz, 5 points per wavelength.
fn field() -> Vec<f32> {
    let d = |i: usize| {
        let (x, z) = ((i % 5395) as f64 / 5394.0, (i / 5395) as f64 / 1910.0);
        let wave = |turns: f64, height: f64| height * (TAU * turns * (x + height)).sin();
        let sea_floor = 0.12 + wave(1.3, 0.03) + wave(4.1, 0.01);
        let top = 0.38 + 2.2 * (x - 0.45).powi(2) + wave(3.7, 0.05) + wave(9.1, 0.02);
        let base = 0.72 - 2.0 * (x - 0.5).powi(2) + wave(2.9, 0.04);
        let velocity = if z < sea_floor {
            1500.0
        } else if z > top && z < base {
            4500.0
        } else {
            let layer = (((z + wave(2.3, 0.02)) * 40.0).floor() * 12.9898).sin();
            (1650.0 + 3800.0 * (z - sea_floor) + 150.0 * layer).clamp(1500.0, 4400.0)
        };
        (velocity / 20.0) as f32
    };
    (0..GRID.sample_count()).map(d).collect()
}

const VALID: &str = "a field of lengths and a box with room for atoms";

fn distance(field: &[f32]) -> NominalDistance<2> {
    NominalDistance::from_field(&GRID, field, 0.2).expect(VALID)
}

fn grown(distance: &NominalDistance<2>) -> Lattice<2> {
    let (crystal, options) = (Crystal::hexagonal(), GrowOptions::default());
    grow(&crystal, GRID.bounds(), distance, &options, &mut Silent).expect(VALID).along_curve()
}

fn filled(lattice: Lattice<2>, distance: &NominalDistance<2>) -> Lattice<2> {
    let scatterer = Scatterer::<2>::new();
    fill_holes(&scatterer, lattice, distance, 2, &mut Silent).expect(VALID).along_curve()
}

fn settled(lattice: Lattice<2>, distance: &NominalDistance<2>) -> Lattice<2> {
    settle(&Scatterer::<2>::new(), lattice, distance, 3, &mut Silent).expect(VALID)
}

fn connected(lattice: &Lattice<2>) -> Mesh<2> {
    Delaunay::<2>::new().connect(lattice.atoms(), &mut Silent).expect(VALID)
}

fn benches(criterion: &mut Criterion) {
    let field = field();
    let distance_of_field = distance(&field);
    let d = &distance_of_field;
    let (lattice, full) = (grown(d), filled(grown(d), d));
    let even = settled(full.clone(), d);
    let mut group = criterion.benchmark_group("flat");
    group.sample_size(10).throughput(Throughput::Elements(even.len() as u64));
    group.bench_function("distance", |b| b.iter(|| distance(&field)));
    group.bench_function("grow", |b| b.iter(|| grown(d)));
    group.bench_function("fill", |b| b.iter(|| filled(lattice.clone(), d)));
    group.bench_function("settle", |b| b.iter(|| settled(full.clone(), d)));
    group.bench_function("connect", |b| b.iter(|| connected(&even)));
    group.bench_function("whole", |b| {
        b.iter(|| {
            let d = distance(&field);
            connected(&settled(filled(grown(&d), &d), &d))
        });
    });
    group.finish();
}

criterion_group!(flat, benches);
criterion_main!(flat);
