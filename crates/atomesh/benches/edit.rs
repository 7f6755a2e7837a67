//! One gesture of an editor: an atom is moved, those around it are relaxed, and the changes are at hand.
//!
//! In the plane 72,000 atoms, in space 50,000; the reach is five nominal distances. A `drag` moves the atom by a
//! fifth of d and relaxes without a perturbation, as an editor does; `defaults` are the optimizer's own.

use atomesh::edit::{AtomId, Editor};
use atomesh::fields::{FieldsView, ImageWeight, Interpolation, NominalDistance, ScalarField};
use atomesh::geometry::{Point, distance_squared};
use atomesh::image::Grid;
use atomesh::lattice::{Crystal, GrowOptions, grow};
use atomesh::mesh::Delaunay;
use atomesh::optimize::{OptimizeOptions, optimize};
use atomesh::watch::Silent;
use criterion::{Criterion, criterion_group, criterion_main};

/// Nominal distance, in samples.
const DISTANCE: f64 = 5.0;

fn gesture<const D: usize>(
    criterion: &mut Criterion,
    crystal: &Crystal<D>,
    delaunay: Delaunay<D>,
    shape: [usize; D],
) {
    let grid = Grid { shape, step: [1.0; D] };
    // sheets across x, 25 samples apart
    let b = |i: usize| -(-((((i % shape[0]) % 25) as f32 - 12.3) / 2.0).powi(2)).exp();
    let samples = (0..grid.sample_count()).map(b).collect();
    let potential = ScalarField::new(grid, samples, Interpolation::Linear).expect("a potential");
    let weight = ImageWeight::constant(0.45).expect("a weight");
    let distance = NominalDistance::constant(&grid, DISTANCE).expect("a distance");
    let fields = FieldsView { potential: &potential, weight: &weight, distance: &distance };
    let lattice = grow(crystal, grid.bounds(), &distance, &GrowOptions::default(), &mut Silent);
    let options = OptimizeOptions::for_dimension(D);
    let lattice = optimize(lattice.expect("a lattice"), fields, &options, &mut Silent);
    let (lattice, _) = lattice.expect("an optimized lattice").into_parts();
    let mut editor = Editor::new(lattice, delaunay, &mut Silent).expect("a mesh");
    let middle = grid.bounds().max.map(|x| 0.47 * x);
    let far = |p: &Point<D>| distance_squared(p, &middle);
    let nearest = editor.atoms().min_by(|a, b| far(&a.1).total_cmp(&far(&b.1)));
    let atom = nearest.expect("atoms").0;

    let mut group = criterion.benchmark_group("edit");
    let count = editor.atoms().count();
    let mut way = 0.2 * DISTANCE;
    group.bench_function(format!("{D} axes, {count} atoms, move"), |bencher| {
        bencher.iter(|| moved(&mut editor, atom, &mut way));
    });
    let still = OptimizeOptions { perturbation: 0.0, ..options.clone() };
    for (name, options) in [("drag", still), ("defaults", options)] {
        group.bench_function(format!("{D} axes, {count} atoms, {name}"), |bencher| {
            bencher.iter(|| {
                let at = moved(&mut editor, atom, &mut way);
                let relaxed = editor.relax(&at, 5.0 * DISTANCE, fields, &options, &mut Silent);
                relaxed.expect("a relaxed lattice").1.moves().len()
            });
        });
    }
    group.finish();
}

/// Moves an atom to and fro; gives where it is.
fn moved<const D: usize>(editor: &mut Editor<D>, atom: AtomId, way: &mut f64) -> Point<D> {
    let mut at = editor.place(atom).expect("an atom");
    at[1] += *way;
    *way = -*way;
    editor.move_to(atom, at).expect("a free place");
    at
}

fn benches(criterion: &mut Criterion) {
    gesture(criterion, &Crystal::hexagonal(), Delaunay::<2>::new(), [1250, 1250]);
    gesture(criterion, &Crystal::body_centered_cubic(), Delaunay::<3>::new(), [165; 3]);
}

criterion_group!(edit, benches);
criterion_main!(edit);
