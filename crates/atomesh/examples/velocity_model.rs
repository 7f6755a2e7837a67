//! How does a mesh follow the wavelength of waves? Edges of v / (frequency · points per wavelength).
//!
//! Water over sediments that grow faster with depth, and a body of salt. By default every fourth sample
//! of a model of the proportions of BP 2004; `1` takes all 10.3 million.
//!
//! `cargo run --release --example velocity_model -- 1`

use std::f64::consts::TAU;
use std::time::Instant;

use atomesh::fields::NominalDistance;
use atomesh::image::Grid;
use atomesh::lattice::{Crystal, GrowOptions, Scatterer, fill_holes, grow, settle};
use atomesh::measure::shape;
use atomesh::mesh::Delaunay;
use atomesh::watch::Silent;

/// Frequency in hertz, times points per wavelength.
const RATE: f64 = 4.0 * 5.0;

/// Metres per second at x and z, shares of the model's 67 × 12 km.
fn velocity(x: f64, z: f64) -> f64 {
    let wave = |turns: f64, height: f64| height * (TAU * turns * (x + height)).sin();
    let sea_floor = 0.12 + wave(1.3, 0.03) + wave(4.1, 0.01);
    let top = 0.38 + 2.2 * (x - 0.45).powi(2) + wave(3.7, 0.05) + wave(9.1, 0.02);
    let base = 0.72 - 2.0 * (x - 0.5).powi(2) + wave(2.9, 0.04);
    if z < sea_floor {
        1500.0
    } else if z > top && z < base {
        4500.0
    } else {
        let layer = (((z + wave(2.3, 0.02)) * 40.0).floor() * 12.9898).sin();
        (1650.0 + 3800.0 * (z - sea_floor) + 150.0 * layer).clamp(1500.0, 4400.0)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let every: usize = std::env::args().nth(1).map_or(Ok(4), |n| n.parse())?;
    let [nx, nz] = [5394 / every + 1, 1910 / every + 1];
    let grid = Grid { shape: [nx, nz], step: [12.5 * every as f64, 6.25 * every as f64] };
    let d = |x: usize, z: usize| velocity(x as f64 / nx as f64, z as f64 / nz as f64) / RATE;
    let field: Vec<f32> = (0..nx * nz).map(|i| d(i % nx, i / nx) as f32).collect();

    let start = Instant::now();
    let distance = NominalDistance::from_field(&grid, &field, 0.2)?;
    let (crystal, scatterer) = (Crystal::hexagonal(), Scatterer::<2>::new());
    let options = GrowOptions::default();
    let lattice = grow(&crystal, grid.bounds(), &distance, &options, &mut Silent)?.along_curve();
    let mut lattice = fill_holes(&scatterer, lattice, &distance, 2, &mut Silent)?.along_curve();
    for _ in 0..3 {
        lattice = settle(&scatterer, lattice, &distance, 4, &mut Silent)?;
    }
    let mesh = Delaunay::<2>::new().connect(lattice.atoms(), &mut Silent)?;
    let seconds = start.elapsed().as_secs_f64();

    let report = shape(&mesh, Some(&grid.bounds()), &mut Silent)?;
    println!("{} vertices, {:.0} a second", report.points, report.points as f64 / seconds);
    println!("quality: mean {:.3}, least {:.3}", report.q_mean, report.q_min);
    Ok(())
}
