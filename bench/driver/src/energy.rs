//! One energy and gradient of a face-centred cubic lattice, by each engine.

use std::f64::consts::SQRT_2;

use atomesh::energy::{Engine, PairsEngine, SampledEngine};
use atomesh::fields::{FieldsView, ImageWeight, Interpolation, NominalDistance, ScalarField};
use atomesh::geometry::{Point, compact_order};
use atomesh::image::Grid;
use atomesh::lattice::{Crystal, GrowOptions, grow};
use atomesh::watch::Silent;
use clap::{Args, ValueEnum};
use serde_json::Value;

use crate::Failure;
use crate::clock::Clock;

/// The lattice.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Scene {
    /// Grown at d = 8 in an image of 256³ samples with features, β = ½.
    Image,
    /// A million sites of a perfect crystal, d = 1; b = 0 and β = 0, so that pairs alone count.
    Crystal,
}

/// The engine, and what it does before each evaluation.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Engines {
    /// Pairs, with neighbour lists in hand.
    InHand,
    /// Pairs, with the lists rebuilt before each evaluation.
    Rebuilt,
    /// Algorithm 1.
    Sampled,
}

/// Evaluates energy and gradient.
#[derive(Debug, Args)]
pub struct Energy {
    /// The lattice.
    #[arg(value_enum)]
    scene: Scene,
    /// The engine.
    #[arg(value_enum)]
    engine: Engines,
    /// Evaluations to measure, after one that is not.
    #[arg(long, default_value_t = 10)]
    evaluations: usize,
    /// Unit cells along each side of the crystal.
    #[arg(long, default_value_t = 63)]
    side: usize,
}

/// What an engine is made of.
struct Scenery {
    potential: ScalarField<3>,
    weight: ImageWeight<3>,
    distance: NominalDistance<3>,
    /// In a compact order, as a run has them.
    atoms: Vec<Point<3>>,
}

impl Energy {
    /// Evaluates `evaluations` times.
    pub fn run(&self) -> Result<Value, Failure> {
        let Scenery { potential, weight, distance, atoms } = match self.scene {
            Scene::Image => image()?,
            Scene::Crystal => crystal(self.side)?,
        };
        let fields = FieldsView { potential: &potential, weight: &weight, distance: &distance };
        match self.engine {
            Engines::Sampled => self.evaluate(SampledEngine::new(fields), &atoms),
            _ => self.evaluate(PairsEngine::new(fields), &atoms),
        }
    }

    fn evaluate(&self, mut engine: impl Engine<3>, atoms: &[Point<3>]) -> Result<Value, Failure> {
        let mut gradient = vec![[0.0; 3]; atoms.len()];
        engine.prepare(atoms, 0.0);
        let mut energy = engine.evaluate(atoms, &mut gradient);
        let clock = Clock::start();
        for _ in 0..self.evaluations {
            if matches!(self.engine, Engines::Rebuilt) {
                engine.prepare(atoms, f64::INFINITY); // farther than any list reaches
            }
            energy = engine.evaluate(atoms, &mut gradient);
        }
        let mut answer = clock.stop();
        answer["atoms"] = atoms.len().into();
        answer["evaluations"] = self.evaluations.into();
        answer["energy"] = energy.total().into();
        Ok(answer)
    }
}

/// Wavy sheets 40 samples apart, so that neighbouring samples differ as in a real image.
fn image() -> Result<Scenery, Failure> {
    const SIDE: usize = 256;
    let grid = Grid { shape: [SIDE; 3], step: [1.0; 3] };
    let wave = |i: usize| {
        let [x, y, z] = [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(|k| k as f32);
        let phase = (z + 8.0 * (x / 30.0).sin() + 5.0 * (y / 20.0).cos()) / 40.0;
        let away = phase - phase.round();
        -(-away * away * 200.0).exp()
    };
    let samples = (0..grid.sample_count()).map(wave).collect();
    let distance = NominalDistance::constant(&grid, 8.0)?;
    let crystal = Crystal::face_centered_cubic();
    let lattice = grow(&crystal, grid.bounds(), &distance, &GrowOptions::default(), &mut Silent)?;
    Ok(Scenery {
        potential: ScalarField::new(grid, samples, Interpolation::Linear)?,
        weight: ImageWeight::constant(0.5)?,
        distance,
        atoms: sorted(lattice.atoms()),
    })
}

/// `4 side³` sites of a face-centred cubic crystal with nearest neighbours 1 apart.
fn crystal(side: usize) -> Result<Scenery, Failure> {
    let samples = (side as f64 * SQRT_2).ceil() as usize + 1;
    let grid = Grid { shape: [samples; 3], step: [1.0; 3] };
    let sites = [[0.0; 3], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];
    let cells = (0..side.pow(3)).map(|c| [c % side, c / side % side, c / side / side]);
    let atoms: Vec<Point<3>> = cells
        .flat_map(|cell| {
            sites.map(|site| std::array::from_fn(|k| SQRT_2 * (cell[k] as f64 + site[k])))
        })
        .collect();
    Ok(Scenery {
        potential: ScalarField::new(grid, vec![0.0; grid.sample_count()], Interpolation::Linear)?,
        weight: ImageWeight::constant(0.0)?,
        distance: NominalDistance::constant(&grid, 1.0)?,
        atoms: sorted(&atoms),
    })
}

fn sorted(atoms: &[Point<3>]) -> Vec<Point<3>> {
    compact_order(atoms).iter().map(|&i| atoms[i as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inner_atom_of_the_crystal_has_eighteen_neighbours_within_the_cut_off() {
        let atoms = crystal(4).unwrap().atoms;
        assert_eq!(atoms.len(), 4 * 64);
        let middle = [2.0 * SQRT_2; 3];
        let squared = |p: &Point<3>| (0..3).map(|k| (p[k] - middle[k]).powi(2)).sum::<f64>();
        let near = atoms.iter().filter(|p| squared(p) < 1.5 * 1.5).count();
        assert_eq!(near, 1 + 18); // itself, 12 at distance 1, 6 at √2
    }
}
