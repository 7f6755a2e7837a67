//! A step of a drag: an atom moved, those within five edges relaxed, the changes known.
//!
//! The goal is 5 ms in the plane whatever the size of the image, and in space at 50,000 atoms a median of 10 ms and 30 ms
//! for 95 of 100 steps: so all steps are timed, and not their mean.

use std::hint::black_box;
use std::time::Instant;

use atomesh::image::{Frame, Image, Samples};
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;
use atomesh_io::image::write_image;
use atomesh_job::options::RunConfig;
use atomesh_studio::Session;
use atomesh_studio::gesture::Gesture;

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

/// Steps that are timed, after as many that are not.
const STEPS: usize = 200;

/// Steps an atom to and fro by a quarter of a sample.
fn drag<const D: usize>(shape: [usize; D], size: f64) {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path(), shape, size);
    let middle: Vec<f64> = shape.iter().map(|n| *n as f64 / 2.0).collect();
    session.act(Gesture::Add { at: middle.clone() }, &mut Silent).unwrap();
    let atom = session.atom_count() as u32 - 1;
    let mut times: Vec<f64> = (0..2 * STEPS)
        .map(|step| {
            let to: Vec<f64> = middle.iter().map(|x| x + 0.25 * (step % 8) as f64).collect();
            let started = Instant::now();
            black_box(session.drag(atom, &to, 5.0, &mut Silent)).unwrap();
            1e3 * started.elapsed().as_secs_f64()
        })
        .skip(STEPS)
        .collect();
    times.sort_by(f64::total_cmp);
    let (median, most) = (times[STEPS / 2], times[STEPS * 95 / 100]);
    println!("{shape:?}, {} atoms: median {median:.2} ms, 95 % {most:.2} ms", session.atom_count());
}

fn main() {
    drag([256, 256], 8.0);
    drag([2000, 2000], 8.0);
    drag([128, 128, 128], 4.0);
}
