//! A step of a drag: an atom moved, those within five edges relaxed, the changes known.
//!
//! The goal is 5 ms in the plane whatever the size of the image, and 10 ms in space at 50,000 atoms.

use std::hint::black_box;

use atomesh::image::{Frame, Image, Samples};
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;
use atomesh_io::image::write_image;
use atomesh_job::options::RunConfig;
use atomesh_studio::Session;
use criterion::{Criterion, criterion_group, criterion_main};

/// A session on faults, or on layers cut by them, with about so many atoms.
fn session<const D: usize>(folder: &std::path::Path, shape: [usize; D], size: f64) -> Session {
    let scene = if D == 2 { Scene::Faults } else { Scene::LayersFaults };
    let image: Image<D> = synthesize(scene, &SynthOptions::new(shape)).unwrap().image;
    let path = folder.join("image.npy");
    let frame = Frame::new(shape).unwrap();
    let image = Image::new(frame, Samples::F32(image.samples().to_f32().into())).unwrap();
    write_image(&path, &image, &mut Silent).unwrap();
    let mut session = Session::open(&folder.join("session"), &mut Silent).unwrap();
    let mut run = RunConfig::parse(&format!("[lattice]\nsize = {size:.1}")).unwrap();
    run.input.image = Some(path);
    session.open_file(run, &mut Silent).unwrap();
    session
}

/// Steps a pixel to and fro.
fn drag<const D: usize>(name: &str, criterion: &mut Criterion, shape: [usize; D], size: f64) {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path(), shape, size);
    let middle: Vec<f64> = shape.iter().map(|n| *n as f64 / 2.0).collect();
    session.act(atomesh_studio::gesture::Gesture::Add { at: middle.clone() }, &mut Silent).unwrap();
    let atom = session.atom_count() as u32 - 1;
    let mut step = 0;
    criterion.bench_function(name, |bencher| {
        bencher.iter(|| {
            step = (step + 1) % 8;
            let to: Vec<f64> = middle.iter().map(|x| x + 0.25 * f64::from(step)).collect();
            black_box(session.drag(atom, &to, 5.0, &mut Silent)).unwrap();
        });
    });
    eprintln!("{name}: {} atoms", session.atom_count());
}

fn drags(criterion: &mut Criterion) {
    drag("drag, 256 x 256", criterion, [256, 256], 8.0);
    drag("drag, 2000 x 2000", criterion, [2000, 2000], 8.0);
    drag("drag, 128 x 128 x 128", criterion, [128, 128, 128], 4.0);
}

criterion_group!(benches, drags);
criterion_main!(benches);
