//! How does a program look into a run, and change it? By its stages: it watches the atoms while they settle, moves
//! one with an editor, and goes on to the mesh.
//!
//! `cargo run --release --example stages`

use std::ops::ControlFlow;

use atomesh::edit::Editor;
use atomesh::run::{Inputs, MeshOptions, Method, Size, prepare};
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::{AtomsView, Phase, Silent, Watch};

/// Follows the atoms from one iteration to the next, and prints the longest way that one of them went.
#[derive(Default)]
struct Follow {
    before: Vec<f64>,
}

impl Watch for Follow {
    fn step(&mut self, _: Phase, _: f64, _: Option<f64>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn atoms(&mut self, _: Phase, atoms: AtomsView<'_>) {
        let way = |(x, y): (&f64, &f64)| (x - y).abs();
        let longest = atoms.coordinates.iter().zip(&self.before).map(way).fold(0.0, f64::max);
        let energy = atoms.energy_atomic + atoms.energy_image;
        println!("{} atoms, energy {energy:.3}, moved {longest:.3}", atoms.distances.len());
        self.before = atoms.coordinates.to_vec();
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let faults = synthesize(Scene::Faults, &SynthOptions::new([96, 96]))?;
    let options = MeshOptions { size: Size::Constant(8.0), ..Default::default() };
    let method = Method::plane();
    let prepared = prepare(&method, Inputs::image(&faults.image), options, &mut Silent)?;
    let filled = prepared.fill(&mut Silent)?;
    let settled = filled.settle(&mut Follow::default())?;

    let lattice = settled.lattice().clone();
    let mut editor = Editor::new(lattice, *method.delaunay(), &mut Silent)?;
    let near = |p: &[f64; 2]| (p[0] - 48.0).powi(2) + (p[1] - 48.0).powi(2);
    let nearest = editor.atoms().min_by(|(_, p), (_, q)| near(p).total_cmp(&near(q)));
    let (atom, _) = nearest.ok_or("no atoms")?;
    let changes = editor.move_to(atom, [48.0, 48.0])?;
    println!("{} atom moved, {} cells added", changes.moves().len(), changes.cells_added().len());
    editor.pin(atom)?;

    // the stage as it was, and the edited one, both go on
    for settled in [prepared.with_settled(editor.lattice())?, settled] {
        let connected = settled.connect(&mut Silent)?;
        let outcome = connected.improve(&mut Silent)?.finish(&mut Silent)?;
        let held = outcome.mesh().points().contains(&[48.0, 48.0]);
        println!("{} triangles, a corner at (48, 48): {held}", outcome.mesh().cell_count());
    }
    Ok(())
}
