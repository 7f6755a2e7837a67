//! How do cells become small near features and large elsewhere? Distances from 4 to 16 samples.
//!
//! `cargo run --release --example graded`

use atomesh::run::{Inputs, MeshOptions, Method, Size, prepare};
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let faults = synthesize(Scene::Faults, &SynthOptions::new([160, 120]))?;

    for size in [Size::Constant(4.0), Size::Range { min: 4.0, max: 16.0 }, Size::Constant(16.0)] {
        let options = MeshOptions { size, ..Default::default() };
        let method = Method::plane();
        let outcome = prepare(&method, Inputs::image(&faults.image), options, &mut Silent)?
            .run(&mut Silent)?;
        let d = outcome.distance();
        println!(
            "{size:?}: d from {:.1} to {:.1}, mean {:.1}: {} triangles",
            d.least(),
            d.greatest(),
            d.mean(),
            outcome.mesh().cell_count()
        );
    }
    Ok(())
}
