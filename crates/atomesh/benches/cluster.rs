//! Cells into 20 parts: a mesh like that of Fig. 1 of Hale (2001), and one of 50,000 cells. `graph` weighs the facets,
//! `tree` cuts, `split` cuts the largest part in two between marks.

use atomesh::cluster::{CellGraph, ClusterOptions, ClusterTree, shared_facets, split_part};
use atomesh::features::FacetField;
use atomesh::fields::{Interpolation, ScalarField};
use atomesh::image::Grid;
use atomesh::mesh::{Delaunay, Mesh};
use atomesh::watch::Silent;
use criterion::{Criterion, criterion_group, criterion_main};

/// Nominal distance, in samples.
const DISTANCE: f64 = 8.0;

/// Triangles over a square image of that side: rows of atoms in a hexagonal lattice.
fn mesh(side: usize) -> Mesh<2> {
    let rows = (side as f64 / (DISTANCE * 0.75_f64.sqrt())) as usize;
    let columns = (side as f64 / DISTANCE) as usize;
    let place = |i: usize| {
        let (row, column) = (i / columns, i % columns);
        let shift = if row % 2 == 0 { 0.0 } else { 0.5 };
        [DISTANCE * (column as f64 + shift), DISTANCE * 0.75_f64.sqrt() * row as f64]
    };
    let points: Vec<[f64; 2]> = (0..rows * columns).map(place).collect();
    Delaunay::<2>::new().connect(&points, &mut Silent).expect("a mesh")
}

/// Two sets of faults, every sixth of the image one, each with gaps.
fn potential(side: usize) -> ScalarField<2> {
    let wave = |across: f64, along: f64| {
        let off = (across / 43.0 - (across / 43.0).round()) * 43.0;
        let gap = if (along / 61.0).sin() > 0.9 { 0.0 } else { 1.0 };
        gap * (-0.5 * (off / 1.5).powi(2)).exp()
    };
    let b = |i: usize| {
        let (x, y) = ((i % side) as f64, (i / side) as f64);
        -wave(x + 0.4 * y, y).max(wave(y - 0.3 * x, x)) as f32
    };
    let grid = Grid { shape: [side; 2], step: [1.0; 2] };
    let samples = (0..side * side).map(b).collect();
    ScalarField::potential(grid, samples, Interpolation::Linear).expect("a potential")
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("cluster");
    group.sample_size(10);
    for side in [256, 1200] {
        let (mesh, b) = (mesh(side), potential(side));
        let cells = mesh.cell_count();
        let graph = || {
            let field = FacetField::along(&mesh, &b, &mut Silent).expect("facets");
            let facets = shared_facets(&mesh, Some(&field), &[]);
            CellGraph::of_facets(cells, &facets, 0.2).expect("a graph")
        };
        let weighed = graph();
        let options = ClusterOptions::default();
        let grow = || ClusterTree::grow(&weighed, &options, &mut Silent).expect("a tree");
        let parts = grow().parts(20);
        let own: Vec<u32> = (0..cells as u32).filter(|&cell| parts[cell as usize] == 1).collect();
        let marks = [&own[..3], &own[own.len() - 3..]];
        group.bench_function(format!("{cells} cells, graph"), |b| b.iter(graph));
        group.bench_function(format!("{cells} cells, tree"), |b| b.iter(grow));
        group.bench_function(format!("{cells} cells, split"), |b| {
            b.iter(|| split_part(&weighed, &mut parts.clone(), 1, marks).expect("two parts"));
        });
    }
    group.finish();
}

criterion_group!(cluster, benches);
criterion_main!(cluster);
