//! What every engine promises, and the double sum that they are checked against.

use crate::fields::{FieldsView, ScalarField};
use crate::geometry::{Point, difference, dot};

use super::pair;

/// The two parts of the total potential energy P, without unit, as they enter it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// (1 − β) A, the pairs' part.
    pub atomic: f64,
    /// β B, the image's part.
    pub image: f64,
}

impl Energy {
    /// P, their sum: equation (4).
    pub fn total(&self) -> f64 {
        self.atomic + self.image
    }
}

impl std::iter::Sum for Energy {
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::default(), |sum, part| Self {
            atomic: sum.atomic + part.atomic,
            image: sum.image + part.image,
        })
    }
}

/// Computes the total potential energy of atoms and its gradient.
///
/// `energy::conformance`, behind the cargo feature of that name, tests these promises.
pub trait Engine<const D: usize>: Sync {
    /// Makes ready for atoms at or near `atoms`: reads d(x) and β(x) there, builds lists. To be called
    /// before the first evaluation and then between iterations; it does only what is due. `next_move` is
    /// the farthest any atom may go before the next call, over its nominal distance.
    ///
    /// Returns whether the energy is another function than before, so that the minimizer must forget its
    /// curvature: always true of the first call, and of one with another number of atoms.
    fn prepare(&mut self, atoms: &[Point<D>], next_move: f64) -> bool;

    /// The energy, and ∂P/∂x of every atom, written to `gradient`: the same bits at any number of threads.
    fn evaluate(&mut self, atoms: &[Point<D>], gradient: &mut [Point<D>]) -> Energy;

    /// The nominal distance of every atom, as last read by [`Engine::prepare`].
    fn distances(&self) -> &[f64];
}

impl<E: Engine<D> + ?Sized, const D: usize> Engine<D> for Box<E> {
    fn prepare(&mut self, atoms: &[Point<D>], next_move: f64) -> bool {
        (**self).prepare(atoms, next_move)
    }

    fn evaluate(&mut self, atoms: &[Point<D>], gradient: &mut [Point<D>]) -> Energy {
        (**self).evaluate(atoms, gradient)
    }

    fn distances(&self) -> &[f64] {
        (**self).distances()
    }
}

/// Makes an engine for atoms in some fields.
pub type MakeEngine<'m, const D: usize> =
    dyn for<'a> Fn(FieldsView<'a, D>) -> Box<dyn Engine<D> + 'a> + Sync + 'm;

/// The total potential energy by the double sum of equation (1), and its gradient. O(n²): the reference.
///
/// `distances` and `weights` are d and β at the atoms. A pair's nominal distance is the mean of its
/// atoms', which is the paper's for a constant d and its d(xⱼ) to first order otherwise.
pub fn direct_energy<const D: usize>(
    atoms: &[Point<D>],
    distances: &[f64],
    weights: &[f64],
    potential: &ScalarField<D>,
    gradient: &mut [Point<D>],
) -> Energy {
    let mut energy = Energy::default();
    for i in 0..atoms.len() {
        let mut image_gradient = [0.0; D];
        energy.image += weights[i] * potential.value_and_gradient(&atoms[i], &mut image_gradient);
        gradient[i] = image_gradient.map(|g| g * weights[i]);
        for j in (0..atoms.len()).filter(|&j| j != i) {
            let v = difference(&atoms[i], &atoms[j]);
            let r = dot(&v, &v).sqrt();
            let d = 0.5 * (distances[i] + distances[j]);
            let weight = 1.0 - 0.5 * (weights[i] + weights[j]);
            energy.atomic += 0.5 * weight * pair::energy(r / d);
            if r > 0.0 {
                let slope = -weight * pair::force(r / d) / (d * r);
                (0..D).for_each(|k| gradient[i][k] += slope * v[k]);
            }
        }
    }
    energy
}
