//! What if the features are known by a formula? A potential b(x) of one's own: −1 on a circle.
//!
//! `cargo run --release --example own_potential`

use atomesh::image::{Frame, Image, Samples};
use atomesh::run::{Inputs, MeshOptions, Method, Size, prepare};
use atomesh::watch::Silent;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (n, radius) = (81, 25.0f32);
    let from_circle = |i: usize| {
        let (x, y) = ((i % n) as f32 - 40.0, (i / n) as f32 - 40.0);
        x.hypot(y) - radius
    };
    // a valley of depth 1, two samples wide
    let b = (0..n * n).map(|i| -(-0.5 * (from_circle(i) / 1.5).powi(2)).exp()).collect();
    let image = Image::new(Frame::new([n, n])?, Samples::F32(b))?;

    let inputs = Inputs { is_potential: true, ..Inputs::image(&image) };
    let options = MeshOptions { size: Size::Constant(6.0), ..Default::default() };
    let outcome = prepare(&Method::plane(), inputs, options, &mut Silent)?.run(&mut Silent)?;

    let b = outcome.potential_at_points();
    let on_circle = b.iter().filter(|b| **b < -0.8).count();
    println!("{on_circle} of {} points are within a sample of the circle", b.len());
    Ok(())
}
