//! How does a program show progress, and end the work early? By a `Watch` of its own.
//!
//! `cargo run --release --example progress_and_cancel`

use std::ops::ControlFlow;

use atomesh::run::{Inputs, MeshOptions, Method, prepare};
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::{Phase, Watch};

/// Prints the start of every phase, and ends the work after a number of optimizer's steps.
struct Patience {
    last: Option<Phase>,
    steps_left: usize,
}

impl Watch for Patience {
    fn step(&mut self, phase: Phase, done: f64, energy: Option<f64>) -> ControlFlow<()> {
        if self.last.replace(phase) != Some(phase) {
            println!("{}", phase.name());
        }
        if let Some(energy) = energy {
            println!("  {:3.0} %, energy {energy:.3}", 100.0 * done);
            if self.steps_left == 0 {
                return ControlFlow::Break(());
            }
            self.steps_left -= 1;
        }
        ControlFlow::Continue(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let faults = synthesize(Scene::Faults, &SynthOptions::new([96, 96]))?;
    let method = Method::plane();
    let mut watch = Patience { last: None, steps_left: 3 };
    let run = prepare(&method, Inputs::image(&faults.image), MeshOptions::default(), &mut watch)
        .and_then(|prepared| prepared.run(&mut watch));
    match run {
        Err(error) if error.is_cancelled() => println!("ended early, as asked"),
        Err(error) => return Err(error.into()),
        Ok(outcome) => println!("{} triangles", outcome.mesh().cell_count()),
    }
    Ok(())
}
