//! How is a volume with unequal spacings meshed? The outline of a sphere, in millimetres.
//!
//! `cargo run --release --example volume`

use atomesh::enhance::{FeatureOptions, Features};
use atomesh::run::{Inputs, MeshOptions, Method, Size, prepare};
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // slices twice as far apart as the samples within them
    let drawn = SynthOptions { spacing: [0.5, 0.5, 1.0], ..SynthOptions::new([40, 40, 20]) };
    let sphere = synthesize(Scene::Sphere, &drawn)?;

    let options = MeshOptions {
        features: FeatureOptions { features: Features::Edges, ..Default::default() },
        size: Size::Constant(3.0), // millimetres along every axis, whatever the samples are
        ..Default::default()
    };
    let method = Method::space();
    let prepared = prepare(&method, Inputs::image(&sphere.image), options, &mut Silent)?;
    println!("expected: about {} points", prepared.estimate().atoms);

    let mesh = prepared.run(&mut Silent)?.world_mesh();
    println!("{} points, {} tetrahedra", mesh.points().len(), mesh.cell_count());
    println!("{:.3} cubic millimetres of {}", mesh.measure(), 19.5 * 19.5 * 19.0);
    Ok(())
}
