//! Features first, step by step, on a volume of faults: pieces linked of points, atoms put on them, the atoms connected.

use atomesh::conform::{conform, connect};
use atomesh::crests::Pieces;
use atomesh::enhance::{FeatureOptions, enhance, valley_points};
use atomesh::fields::{FieldsView, ImageWeight, Interpolation, NominalDistance, ScalarField};
use atomesh::image::Units;
use atomesh::lattice::{Crystal, GrowOptions, Scatterer, grow};
use atomesh::mesh::Delaunay;
use atomesh::optimize::OptimizeOptions;
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;
use criterion::{Criterion, criterion_group, criterion_main};

const VALID: &str = "faults in a box with room for atoms";

fn benches(criterion: &mut Criterion) {
    let options = SynthOptions { bytes: true, ..SynthOptions::new([128; 3]) };
    let image = synthesize(Scene::LayersFaults, &options).expect(VALID).image;
    let grid = image.frame().grid(Units::Physical);
    let b = enhance(&image, &FeatureOptions::default(), &mut Silent).expect(VALID).values;
    let potential = ScalarField::potential(grid, b, Interpolation::Linear).expect(VALID);
    let weight = ImageWeight::constant(0.45).expect(VALID);
    let distance = NominalDistance::constant(&grid, 8.0).expect(VALID);
    let fields = FieldsView { potential: &potential, weight: &weight, distance: &distance };
    let crystal = Crystal::body_centered_cubic();
    let grown = grow(&crystal, grid.bounds(), &distance, &GrowOptions::default(), &mut Silent);
    let grown = grown.expect(VALID);
    let (scatterer, optimize) = (Scatterer::<3>::new(), OptimizeOptions::for_dimension(3));

    let points = || valley_points(potential.samples(), &grid, 0.9, 0.05, &mut Silent);
    let found = points().expect(VALID);
    let pieces = Pieces::new(found.clone(), &grid, 400);
    let conformed = || conform(grown.clone(), &pieces, fields, &scatterer, &optimize, &mut Silent);
    let (lattice, _) = conformed().expect(VALID);
    let connected =
        || connect(lattice.clone(), &pieces, &distance, &Delaunay::<3>::new(), &mut Silent);

    let mut group = criterion.benchmark_group(format!("conform, {} points", found.len()));
    group.sample_size(10);
    group.bench_function("points", |b| b.iter(points));
    group.bench_function("pieces", |b| b.iter(|| Pieces::new(found.clone(), &grid, 400)));
    group.bench_function("atoms", |b| b.iter(conformed));
    group.bench_function("connect", |b| b.iter(connected));
    group.finish();
}

criterion_group!(conform_benches, benches);
criterion_main!(conform_benches);
