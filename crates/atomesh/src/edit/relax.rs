//! Optimizing the atoms around a place again.

use super::{Changes, EditError, Editor};
use crate::energy::pair;
use crate::fields::FieldsView;
use crate::geometry::{Point, distance_squared};
use crate::lattice::Lattice;
use crate::mesh::AtomEdit;
use crate::optimize::{OptimizeOptions, OptimizeReport, optimize};
use crate::watch::Watch;

/// How far beyond the reach frozen atoms are felt, over the farthest that two atoms feel each other: atoms move
/// less the nearer they are to the reach, and not at all there.
const ROOM: f64 = 1.25;

impl<const D: usize> Editor<D> {
    /// Optimizes the atoms around a place again. With s = r/reach at a distance r, an atom's own temperature is
    /// multiplied by 1 − 3s² + 2s³, which falls smoothly from 1 to 0 at `reach` (Hale 2002). Atoms beyond it, and
    /// pinned ones, stay where they are; those near enough are felt.
    ///
    /// `options.smoothing_steps` is ignored: an edit starts near its minimum, and a smoothed b(x) would take the
    /// whole image. A `perturbation` of 0 keeps atoms that were at rest from stirring, as suits a drag by hand.
    ///
    /// Cost: that of the atoms within reach.
    ///
    /// # Errors
    /// [`EditError`] if the reach is no length, an option is out of range, or the watch ends the work.
    pub fn relax(
        &mut self,
        around: &Point<D>,
        reach: f64,
        fields: FieldsView<'_, D>,
        options: &OptimizeOptions,
        watch: &mut dyn Watch,
    ) -> Result<(OptimizeReport, Changes<D>), EditError> {
        if !(reach > 0.0 && reach.is_finite()) {
            return Err(EditError::Reach { value: reach });
        }
        let felt = reach + ROOM * self.farthest_felt(around, reach, fields);
        let atoms = self.within(around, felt);
        let mut part = Lattice::empty(self.bounds);
        for &atom in &atoms {
            let (p, state) = (self.points[atom as usize], &self.states[atom as usize]);
            let s = (distance_squared(&p, around).sqrt() / reach).min(1.0);
            let share = (1.0 - s * s * (3.0 - 2.0 * s)).clamp(0.0, 1.0) as f32;
            part.push(p, state.freedom, share * state.temperature_now());
        }
        let options = OptimizeOptions { smoothing_steps: 0, ..options.clone() };
        let (part, report) = optimize(part, fields, &options, watch)?.into_parts();
        let to = atoms.iter().zip(part.atoms());
        let edits: Vec<AtomEdit<D>> = to
            .filter(|(atom, to)| self.points[**atom as usize] != **to)
            .map(|(&atom, &to)| AtomEdit { atom, to: Some(to) })
            .collect();
        let changes = self.make(&edits)?;
        Ok((report, changes))
    }

    /// The farthest from which an atom within reach feels another: with dᵢ and dⱼ at the two,
    /// r < c (dᵢ + dⱼ)/2, where dⱼ ≤ dᵢ + r times the greatest slope of d.
    fn farthest_felt(&self, around: &Point<D>, reach: f64, fields: FieldsView<'_, D>) -> f64 {
        let distance = fields.distance;
        let mut greatest = distance.at(around);
        for atom in self.within(around, reach) {
            greatest = distance.at(&self.points[atom as usize]).max(greatest);
        }
        let growth = 1.0 - 0.5 * pair::CUTOFF * distance.greatest_slope();
        let felt = if growth > 0.0 { greatest / growth } else { f64::INFINITY };
        pair::CUTOFF * felt.min(distance.greatest())
    }
}
