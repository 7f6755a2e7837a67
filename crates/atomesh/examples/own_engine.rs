//! What if atoms should feel something else? An engine of one's own, in which they only repel each other, passes
//! the conformance suite and moves atoms to a dark line. `cargo run --release --example own_engine`

use atomesh::energy::{Energy, Engine, conformance};
use atomesh::fields::{Fields, FieldsView, ImageWeight, NominalDistance, ScalarField};
use atomesh::geometry::{Point, distance_squared};
use atomesh::lattice::{Crystal, grow};
use atomesh::optimize::optimize_with;
use atomesh::{image::Grid, mesh::Delaunay, watch::Silent};

/// φ(u) = (1 − u²/2)³ for u = r/d below √2, else 0; d and β of a pair are the means of its atoms'.
struct Repulsion<'a>(FieldsView<'a, 2>, /* d */ Vec<f64>, /* β */ Vec<f64>);

impl Engine<2> for Repulsion<'_> {
    fn prepare(&mut self, atoms: &[Point<2>], _next_move: f64) -> bool {
        let d: Vec<f64> = atoms.iter().map(|p| self.0.distance.at(p)).collect();
        let beta: Vec<f64> = atoms.iter().map(|p| self.0.weight.at(p)).collect();
        let before = std::mem::replace(self, Self(self.0, d, beta));
        before.1 != self.1 || before.2 != self.2
    }

    fn evaluate(&mut self, atoms: &[Point<2>], gradient: &mut [Point<2>]) -> Energy {
        let (Self(fields, d, beta), mut energy) = (self, Energy::default());
        for (i, (p, g)) in atoms.iter().zip(gradient).enumerate() {
            energy.image += beta[i] * fields.potential.value_and_gradient(p, g);
            *g = g.map(|g| beta[i] * g);
            for (j, q) in atoms.iter().enumerate().filter(|(j, _)| *j != i) {
                let (weight, d) = (1.0 - 0.5 * (beta[i] + beta[j]), 0.5 * (d[i] + d[j]));
                let rest = (1.0 - 0.5 * distance_squared(p, q) / (d * d)).max(0.0);
                energy.atomic += 0.5 * weight * rest.powi(3); // the other half is the other atom's
                let slope = weight * 3.0 * rest.powi(2) / (d * d);
                (0..2).for_each(|k| g[k] -= slope * (p[k] - q[k]));
            }
        }
        energy
    }

    fn distances(&self) -> &[f64] {
        &self.1
    }
}

fn repulsion(fields: FieldsView<'_, 2>) -> Box<dyn Engine<2> + '_> {
    Box::new(Repulsion(fields, Vec::new(), Vec::new()))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    conformance::check(&repulsion, &conformance::Claims { direct: None, ..Default::default() })?;
    let grid = Grid { shape: [60, 50], step: [1.0; 2] };
    let b = (0..3000).map(|i| -(-0.5 * (grid.position(i)[0] - 27.3).powi(2)).exp() as f32);
    let potential = ScalarField::potential(grid, b.collect(), Default::default())?;
    let distance = NominalDistance::constant(&grid, 5.0)?;
    let fields = Fields::new(potential, ImageWeight::constant(0.4)?, distance)?;
    let (crystal, bounds, how) = (Crystal::hexagonal(), grid.bounds(), Default::default());
    let lattice = grow(&crystal, bounds, fields.distance(), &how, &mut Silent)?;
    let done = optimize_with(lattice, fields.view(), &repulsion, &Default::default(), &mut Silent)?;
    let mesh = Delaunay::<2>::new().connect(done.lattice().atoms(), &mut Silent)?;
    println!("{} triangles after {} evaluations", mesh.cell_count(), done.report().evaluations);
    Ok(())
}
