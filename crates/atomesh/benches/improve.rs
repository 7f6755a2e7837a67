//! Improving tetrahedra: the slivers of a mesh without features, and facets of one with a sphere.

use atomesh::enhance::{FeatureOptions, Features, enhance};
use atomesh::fields::FieldsView;
use atomesh::fields::NominalDistance;
use atomesh::fields::{ImageWeight, Interpolation, ScalarField};
use atomesh::image::Units;
use atomesh::improve::{Align, Held, ImproveOptions, Improver, SpaceImprover};
use atomesh::lattice::{Crystal, GrowOptions, grow};
use atomesh::mesh::Delaunay;
use atomesh::optimize::{OptimizeOptions, optimize};
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;
use criterion::{Criterion, criterion_group, criterion_main};

fn benches(criterion: &mut Criterion) {
    let image = synthesize(Scene::Sphere, &SynthOptions::new([96; 3])).expect("a sphere").image;
    let edges = FeatureOptions { features: Features::Edges, ..Default::default() };
    let b = enhance(&image, &edges, &mut Silent).expect("edges").values;
    let grid = image.frame().grid(Units::Physical);
    let potential = ScalarField::potential(grid, b, Interpolation::Linear).expect("a potential");
    let weight = ImageWeight::constant(0.45).expect("a weight");
    let distance = NominalDistance::constant(&grid, 4.0).expect("a distance");
    let fields = FieldsView { potential: &potential, weight: &weight, distance: &distance };
    let crystal = Crystal::body_centered_cubic();
    let lattice = grow(&crystal, grid.bounds(), &distance, &GrowOptions::default(), &mut Silent);
    let options = OptimizeOptions::for_dimension(3);
    let lattice = optimize(lattice.expect("a lattice"), fields, &options, &mut Silent);
    let (lattice, _) = lattice.expect("an optimized lattice").into_parts();
    let mesh = Delaunay::<3>::new().connect(lattice.atoms(), &mut Silent).expect("a mesh");
    let freedom = vec![7; mesh.points().len()];

    let mut group = criterion.benchmark_group("improve");
    group.sample_size(10);
    for align in [Align::Swaps, Align::Full] {
        let options = ImproveOptions { align, ..ImproveOptions::for_dimension(3) };
        let name = format!("{align:?}, {} cells", mesh.cell_count());
        group.bench_function(name, |bencher| {
            let improve = || {
                SpaceImprover.improve(
                    mesh.clone(),
                    Held { freedom: &freedom, facets: &[], near: None },
                    fields,
                    &options,
                    &mut Silent,
                )
            };
            bencher.iter(improve);
        });
    }
    group.finish();
}

criterion_group!(improve, benches);
criterion_main!(improve);
