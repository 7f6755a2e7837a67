//! How does an image become a mesh? Dark fault traces on grey, as in Hale (2001), Fig. 1.
//!
//! `cargo run --release --example image_to_mesh`

use atomesh::run::{Inputs, MeshOptions, Method, Size, prepare};
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let faults = synthesize(Scene::Faults, &SynthOptions::new([128, 128]))?;

    let options = MeshOptions { size: Size::Constant(8.0), ..Default::default() };
    let method = Method::plane();
    let outcome =
        prepare(&method, Inputs::image(&faults.image), options, &mut Silent)?.run(&mut Silent)?;

    let mesh = outcome.mesh();
    println!("{} points, {} triangles", mesh.points().len(), mesh.cell_count());

    let report = outcome.report(&mut Silent)?;
    println!("shape: {:?}", report.shape);
    println!("alignment: {:?}", report.alignment);
    Ok(())
}
