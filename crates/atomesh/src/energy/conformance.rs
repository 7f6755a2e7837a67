//! What every engine must satisfy, as a test that any engine can take.
//!
//! [`check`] sets atoms at random into boxes with a wavy potential, weights of 0, between, 1, and varying,
//! and nominal distances constant and varying, asks for an engine for each, and holds it to what
//! [`Engine`] promises and to the laws of any potential energy. Seeded: the same test every time.
//!
//! ```
//! use atomesh::energy::conformance::{Claims, check};
//! use atomesh::energy::PairsEngine;
//! check::<2>(&|fields| Box::new(PairsEngine::new(fields)), &Claims::default())?;
//! # Ok::<(), atomesh::energy::conformance::Breach>(())
//! ```

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::fields::{Fields, ImageWeight, Interpolation, NominalDistance, ScalarField};
use crate::geometry::Point;
use crate::image::Grid;

use super::{Energy, Engine, MakeEngine, direct_energy};

/// What an engine claims of its energy, beyond what all must satisfy; each a tolerance over the greatest
/// value compared, or 1 if that is less. `None`: it claims nothing.
///
/// The defaults are for an engine that sums the pair potential of [`super::pair`] itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Claims {
    /// Energy and gradient are those of [`direct_energy`]. Default 10⁻¹²: the same terms in another order,
    /// some thousand of them, rounded by 10⁻¹⁶ each.
    pub direct: Option<f64>,
    /// The gradient is the slope of the energy, by central differences over 10⁻⁵. Default 10⁻⁶: at the
    /// cut-off φ″ jumps by 1.3/d², which costs a quarter of the step times that.
    pub slope: Option<f64>,
    /// The energy is the same in any order of the atoms and, without image and with a constant d, wherever
    /// they are; the gradient goes with them. Default 10⁻¹², as above.
    pub symmetry: Option<f64>,
}

impl Default for Claims {
    fn default() -> Self {
        Self { direct: Some(1e-12), slope: Some(1e-6), symmetry: Some(1e-12) }
    }
}

/// What an engine can break.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Law {
    /// The first call of [`Engine::prepare`], and the first with another number of atoms, changes the
    /// energy; one with the same atoms does not.
    Prepare,
    /// [`Engine::distances`] are d at the atoms.
    Distances,
    /// Energy and every entry of the gradient are finite numbers.
    Finite,
    /// See [`Claims::direct`].
    Direct,
    /// See [`Claims::slope`].
    Slope,
    /// See [`Claims::symmetry`].
    Order,
    /// See [`Claims::symmetry`].
    Translation,
    /// The bits do not depend on the number of threads.
    Threads,
}

impl std::fmt::Display for Law {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Prepare => "what prepare returns",
            Self::Distances => "nominal distances at the atoms",
            Self::Finite => "finite numbers",
            Self::Direct => "the direct double sum",
            Self::Slope => "the gradient as the energy's slope",
            Self::Order => "atoms in another order",
            Self::Translation => "atoms elsewhere",
            Self::Threads => "bits on three threads, not one",
        })
    }
}

/// A law that an engine broke.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{law}: {quantity} is {found}; expected {expected} within {tolerance:e} ({case})")]
pub struct Breach {
    /// The law.
    pub law: Law,
    /// The fields and atoms.
    pub case: String,
    /// What is wrong: "energy", or the gradient of which variable.
    pub quantity: String,
    /// What it is.
    pub found: f64,
    /// What it should be.
    pub expected: f64,
    /// By how much it may differ.
    pub tolerance: f64,
}

/// Tests engines: `make` is asked for one for each case.
///
/// # Errors
/// The first [`Breach`] of a law.
pub fn check<const D: usize>(make: &MakeEngine<'_, D>, claims: &Claims) -> Result<(), Breach> {
    const WEIGHTS: [Option<f64>; 4] = [Some(0.0), Some(0.4), Some(1.0), None];
    for (seed, weight) in WEIGHTS.into_iter().enumerate() {
        for is_graded in [false, true] {
            let case = Case::<D>::new(weight, is_graded, seed as u64);
            case.contract(make)?;
            if let Some(tolerance) = claims.direct {
                case.equals_direct(make, tolerance)?;
            }
            if let Some(tolerance) = claims.slope {
                case.gradient_is_slope(make, tolerance)?;
            }
            if let Some(tolerance) = claims.symmetry {
                case.keeps_order(make, tolerance)?;
                if weight == Some(0.0) && !is_graded {
                    case.keeps_places(make, tolerance)?;
                }
            }
        }
    }
    Ok(())
}

/// Energy and gradient.
struct Found<const D: usize> {
    energy: Energy,
    gradient: Vec<Point<D>>,
}

/// Evaluates into a gradient whose entries are no numbers, so that each must be written.
fn evaluate<const D: usize>(engine: &mut dyn Engine<D>, atoms: &[Point<D>]) -> Found<D> {
    let mut gradient = vec![[f64::NAN; D]; atoms.len()];
    let energy = engine.evaluate(atoms, &mut gradient);
    Found { energy, gradient }
}

/// Fields, and atoms in them.
struct Case<const D: usize> {
    name: String,
    fields: Fields<D>,
    atoms: Vec<Point<D>>,
}

/// The edges of a case's box, about.
const EXTENT: f64 = 24.0;

impl<const D: usize> Case<D> {
    /// d of 3 or 2.5…4.3, β as given or varying, and atoms at random in the middle of the box, some of them
    /// very near each other.
    fn new(weight: Option<f64>, is_graded: bool, seed: u64) -> Self {
        let step: [f64; D] = std::array::from_fn(|k| [1.0, 0.8, 1.25][k]);
        let grid = Grid { shape: step.map(|step| (EXTENT / step) as usize + 1), step };
        let sample = |f: &dyn Fn(Point<D>) -> f64| -> Vec<f32> {
            (0..grid.sample_count()).map(|i| f(grid.position(i)) as f32).collect()
        };
        let wave =
            |p: Point<D>| 0.9 * (0..D).map(|k| (0.5 * p[k] + k as f64).sin()).product::<f64>();
        let potential = ScalarField::potential(grid, sample(&wave), Interpolation::Spline);
        let weights = match weight {
            Some(weight) => ImageWeight::constant(weight),
            None => ImageWeight::field(grid, sample(&|p| 0.5 + 0.4 * (0.3 * p[0]).sin())),
        };
        let distance = if is_graded {
            NominalDistance::from_field(&grid, &sample(&|p| 2.5 + 0.075 * p[0]), 0.25)
        } else {
            NominalDistance::constant(&grid, 3.0)
        };
        let (potential, weights) = (potential.expect("|b| ≤ 0.9"), weights.expect("β in 0…1"));
        let fields = Fields::new(potential, weights, distance.expect("d of 2.5 and more"));
        let mut random = Pcg64::seed_from_u64(seed);
        let mut at = || (0.2 + 0.6 * random.random::<f64>()) * EXTENT;
        let atoms = (0..if D == 2 { 60 } else { 240 }).map(|_| std::array::from_fn(|_| at()));
        let weight = weight.map_or("β varying".into(), |weight| format!("β = {weight}"));
        Self {
            name: format!(
                "{D} axes, {weight}, d {}",
                if is_graded { "varying" } else { "constant" }
            ),
            fields: fields.expect("one grid"),
            atoms: atoms.collect(),
        }
    }

    /// An engine made ready for these atoms.
    fn engine<'a>(
        &'a self,
        make: &MakeEngine<'_, D>,
        atoms: &[Point<D>],
    ) -> Box<dyn Engine<D> + 'a> {
        let mut engine = make(self.fields.view());
        engine.prepare(atoms, 0.1);
        engine
    }

    fn breach(&self, law: Law, quantity: impl Into<String>, found: f64, expected: f64) -> Breach {
        let (case, quantity) = (self.name.clone(), quantity.into());
        Breach { law, case, quantity, found, expected, tolerance: 0.0 }
    }

    /// What every engine must satisfy.
    fn contract(&self, make: &MakeEngine<'_, D>) -> Result<(), Breach> {
        let mut engine = make(self.fields.view());
        let fewer = &self.atoms[1..];
        let calls = [
            ("the answer to the first call", &self.atoms[..], true),
            ("the answer to a second call with the same atoms", &self.atoms[..], false),
            ("the answer to a call with fewer atoms", fewer, true),
        ];
        for (quantity, atoms, expected) in calls {
            let found = engine.prepare(atoms, 0.0);
            if found != expected {
                let (found, expected) = (f64::from(u8::from(found)), f64::from(u8::from(expected)));
                return Err(self.breach(Law::Prepare, quantity, found, expected));
            }
            self.distances_are_read(&*engine, atoms)?;
            self.is_finite(&evaluate(&mut *engine, atoms))?;
        }
        let bits = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads")
                .install(|| evaluate(&mut *self.engine(make, &self.atoms), &self.atoms))
        };
        self.compare(Law::Threads, &bits(3), &bits(1), 0.0)
    }

    fn distances_are_read(&self, engine: &dyn Engine<D>, atoms: &[Point<D>]) -> Result<(), Breach> {
        let found = engine.distances();
        if found.len() != atoms.len() {
            let (found, expected) = (found.len() as f64, atoms.len() as f64);
            return Err(self.breach(Law::Distances, "their number", found, expected));
        }
        for (i, (&found, p)) in found.iter().zip(atoms).enumerate() {
            let expected = self.fields.distance().at(p);
            if found != expected {
                return Err(self.breach(Law::Distances, format!("d of atom {i}"), found, expected));
            }
        }
        Ok(())
    }

    fn is_finite(&self, found: &Found<D>) -> Result<(), Breach> {
        let energy = found.energy.total();
        let entries = found.gradient.as_flattened().iter().copied();
        match std::iter::once(energy).chain(entries).position(|x| !x.is_finite()) {
            None => Ok(()),
            Some(0) => Err(self.breach(Law::Finite, "energy", energy, 0.0)),
            Some(v) => {
                let found = found.gradient.as_flattened()[v - 1];
                Err(self.breach(Law::Finite, format!("gradient of variable {}", v - 1), found, 0.0))
            }
        }
    }

    fn equals_direct(&self, make: &MakeEngine<'_, D>, tolerance: f64) -> Result<(), Breach> {
        let mut engine = self.engine(make, &self.atoms);
        let (distance, weight) = (self.fields.distance(), self.fields.weight());
        let distances: Vec<f64> = self.atoms.iter().map(|p| distance.at(p)).collect();
        let weights: Vec<f64> = self.atoms.iter().map(|p| weight.at(p)).collect();
        // a move that was announced, d and β staying those of the old places
        let moved: Vec<Point<D>> = (self.atoms.iter().zip(&distances).zip(0..))
            .map(|((p, d), i)| p.map(|x| x + 0.09 * d * f64::from(i % 3 - 1) / (D as f64).sqrt()))
            .collect();
        for atoms in [&self.atoms, &moved] {
            let mut gradient = vec![[0.0; D]; atoms.len()];
            let potential = self.fields.potential();
            let energy = direct_energy(atoms, &distances, &weights, potential, &mut gradient);
            let found = evaluate(&mut *engine, atoms);
            self.compare(Law::Direct, &found, &Found { energy, gradient }, tolerance)?;
        }
        Ok(())
    }

    fn gradient_is_slope(&self, make: &MakeEngine<'_, D>, tolerance: f64) -> Result<(), Breach> {
        const STEP: f64 = 1e-5;
        let mut engine = self.engine(make, &self.atoms);
        let found = evaluate(&mut *engine, &self.atoms);
        let mut atoms = self.atoms.clone();
        for i in (0..atoms.len()).step_by(17) {
            for k in 0..D {
                let mut energy_at = |x: f64| {
                    atoms[i][k] = self.atoms[i][k] + x;
                    evaluate(&mut *engine, &atoms).energy.total()
                };
                let expected = (energy_at(STEP) - energy_at(-STEP)) / (2.0 * STEP);
                atoms[i][k] = self.atoms[i][k];
                let found = found.gradient[i][k];
                let tolerance = tolerance * expected.abs().max(1.0);
                if (found - expected).abs() > tolerance {
                    let quantity = format!("gradient of atom {i} along axis {k}");
                    let breach = self.breach(Law::Slope, quantity, found, expected);
                    return Err(Breach { tolerance, ..breach });
                }
            }
        }
        Ok(())
    }

    fn keeps_order(&self, make: &MakeEngine<'_, D>, tolerance: f64) -> Result<(), Breach> {
        let Found { energy, gradient } =
            evaluate(&mut *self.engine(make, &self.atoms), &self.atoms);
        let n = self.atoms.len();
        let order: Vec<usize> = (0..n).map(|i| (i * 7 + 5) % n).collect(); // 7 divides neither 60 nor 240
        let atoms: Vec<Point<D>> = order.iter().map(|&i| self.atoms[i]).collect();
        let expected = Found { energy, gradient: order.iter().map(|&i| gradient[i]).collect() };
        let found = evaluate(&mut *self.engine(make, &atoms), &atoms);
        self.compare(Law::Order, &found, &expected, tolerance)
    }

    fn keeps_places(&self, make: &MakeEngine<'_, D>, tolerance: f64) -> Result<(), Breach> {
        let expected = evaluate(&mut *self.engine(make, &self.atoms), &self.atoms);
        // by whole samples, so that an engine that works on samples sees the same
        let step = self.fields.potential().grid().step;
        let atoms: Vec<Point<D>> = (self.atoms.iter())
            .map(|p| std::array::from_fn(|k| p[k] + step[k] * [3.0, -2.0, 1.0][k]))
            .collect();
        let found = evaluate(&mut *self.engine(make, &atoms), &atoms);
        self.compare(Law::Translation, &found, &expected, tolerance)
    }

    /// Whether energies and gradients are alike to a share of the greatest of each, or of 1.
    fn compare(
        &self,
        law: Law,
        found: &Found<D>,
        expected: &Found<D>,
        share: f64,
    ) -> Result<(), Breach> {
        let steepest = |found: &Found<D>| {
            found.gradient.as_flattened().iter().fold(1.0f64, |most, g| most.max(g.abs()))
        };
        let [a, b] = [found.energy, expected.energy];
        let energies =
            [("the pairs' energy", a.atomic, b.atomic), ("the image's energy", a.image, b.image)];
        for (quantity, found, expected) in energies {
            let tolerance = share * expected.abs().max(1.0);
            if !agree(found, expected, tolerance) {
                let breach = self.breach(law, quantity, found, expected);
                return Err(Breach { tolerance, ..breach });
            }
        }
        let tolerance = share * steepest(expected);
        let entries = found.gradient.as_flattened().iter().zip(expected.gradient.as_flattened());
        for (v, (&found, &expected)) in entries.enumerate() {
            if !agree(found, expected, tolerance) {
                let breach = self.breach(law, format!("gradient of variable {v}"), found, expected);
                return Err(Breach { tolerance, ..breach });
            }
        }
        Ok(())
    }
}

/// Whether two numbers agree to a tolerance; NaN agrees with nothing.
fn agree(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() <= tolerance
}
