//! Triangles graded by a velocity model: so many points a wavelength, nothing else in the image.

use std::path::PathBuf;

use atomesh::fields::{GRADIENT_LIMIT, NominalDistance};
use atomesh::image::Grid;
use atomesh::lattice::{Crystal, GrowOptions, Scatterer, fill_holes, grow, settle};
use atomesh::mesh::{Delaunay, Mesh};
use atomesh::watch::Silent;
use clap::Args;
use serde_json::Value;

use crate::Failure;
use crate::clock::Clock;
use crate::raw::{read_samples, write_mesh};

/// Meshes a velocity model.
#[derive(Debug, Args)]
pub struct Graded {
    /// Velocities as raw f32, x fastest.
    velocity: PathBuf,
    /// Samples along x and z.
    #[arg(long, num_args = 2)]
    shape: Vec<usize>,
    /// Metres from sample to sample along x and z.
    #[arg(long, num_args = 2)]
    spacing: Vec<f64>,
    /// d = velocity / rate: frequency times points per wavelength, 1/s.
    #[arg(long)]
    rate: f32,
    /// Where the mesh goes.
    #[arg(long)]
    mesh: Option<PathBuf>,
}

impl Graded {
    /// From the array in memory to the mesh.
    pub fn run(&self) -> Result<Value, Failure> {
        let grid = Grid {
            shape: std::array::from_fn(|k| self.shape[k]),
            step: std::array::from_fn(|k| self.spacing[k]),
        };
        let velocity = read_samples(&self.velocity, grid.sample_count())?;
        let clock = Clock::start();
        let (mesh, phases) = self.mesh_of(&velocity, grid)?;
        let mut answer = clock.stop();
        answer["points"] = mesh.points().len().into();
        answer["cells"] = mesh.cell_count().into();
        answer["phases"] = phases;
        write_mesh(self.mesh.as_deref(), &mesh)?;
        Ok(answer)
    }

    fn mesh_of(&self, velocity: &[f32], grid: Grid<2>) -> Result<(Mesh<2>, Value), Failure> {
        let start = Clock::start();
        let field: Vec<f32> = velocity.iter().map(|v| v / self.rate).collect();
        let distance = NominalDistance::from_field(&grid, &field, GRADIENT_LIMIT)?;
        drop(field);
        let limited = start.stop();
        let bounds = grid.bounds();
        let crystal = Crystal::hexagonal();
        let lattice =
            grow(&crystal, bounds, &distance, &GrowOptions::default(), &mut Silent)?.along_curve();
        let grown = start.stop();
        // as the pipeline does where d varies and nothing pulls
        let scatterer = Scatterer::<2>::new();
        let mut lattice = fill_holes(&scatterer, lattice, &distance, 2, &mut Silent)?.along_curve();
        for _ in 0..3 {
            lattice = settle(&scatterer, lattice, &distance, 4, &mut Silent)?;
        }
        let settled = start.stop();
        let mesh = Delaunay::<2>::new().connect(lattice.atoms(), &mut Silent)?;
        let connected = start.stop();
        let phases = [limited, grown, settled, connected].map(|clock| clock["wall"].clone());
        Ok((mesh, phases.to_vec().into()))
    }
}
