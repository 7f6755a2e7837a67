//! Improving triangles: their edges turn onto the valleys of b, and no angle stays below the floor.
//!
//! Delaunay's rule gives a mesh whose points lie on valleys and whose edges need not. Here every valley
//! point ([`guides`]) asks for an edge that passes near it and along it, and every cell for a good shape:
//!
//! E = Σ over cells of w (0.9 − q) + Σ over guides of pull · (1 − how well an edge of its cell follows it)
//!
//! which counts what the alignment measure counts, smoothed so that descent feels it from afar. An edge gains
//! nothing from a valley that another follows already, and valleys of any depth pull alike. The sum of b along
//! edges has neither property and reaches less at equal shape. A guide looks at the three edges of its own
//! cell alone, so E is a sum over cells. What a swap or a move changes is known from the two cells, or the *star*
//! (the cells around a point), that it touches.
//!
//! Rounds, each of swaps ([`swaps`]) and then moves ([`moves`]), lower E until nothing helps. In the first
//! rounds shape weighs more: cells below the floor are raised before features hold them. In some rounds points
//! are taken away where they crowd and added where they are missing ([`density`]).

mod density;
mod energy;
mod guides;
mod moves;
mod star;
mod swaps;
#[cfg(test)]
mod tests;
mod triangles;

use super::{Align, Held, ImproveError, ImproveOptions, ImproveReport, Improver};
use crate::fields::{FieldsView, NominalDistance};
use crate::mesh::Mesh;
use crate::watch::{Cancelled, Phase, Watch, check};

use energy::Energy;
use guides::find_guides;
use moves::Mover;
use triangles::Triangles;

/// The most rounds. On the paper's fault image at d = 8 the tenth lowers E by less than a hundredth.
const ROUNDS: usize = 10;
/// The first rounds, in which shape weighs more.
const EARLY_ROUNDS: usize = 2;
/// The weight of shape in the first rounds.
const EARLY_SHAPE_WEIGHT: f64 = 5.0;
/// The rounds in which points are taken away and added: after shape has been mended and features are followed
/// where they can be.
const DENSITY_ROUNDS: std::ops::Range<usize> = 2..6;

/// Improves triangles.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlaneImprover;

impl Improver<2> for PlaneImprover {
    fn improve(
        &self,
        mesh: Mesh<2>,
        held: Held<'_, 2>,
        fields: FieldsView<'_, 2>,
        options: &ImproveOptions,
        watch: &mut dyn Watch,
    ) -> Result<(Mesh<2>, ImproveReport), ImproveError> {
        options.validate(2)?;
        let sine_floor = options.min_angle.to_radians().sin();
        let before = MeshAngles::of(&mesh, sine_floor);
        if options.align == Align::Off {
            return Ok((mesh, before.report(before)));
        }
        let guides = find_guides(fields, watch)?;
        if guides.is_empty() && before.below == 0 {
            return Ok((mesh, before.report(before)));
        }
        let energy = Energy::new(&guides, sine_floor);
        let mut triangles = Triangles::new(mesh, &guides, held.facets);
        let mover = Mover::new(&triangles, held.freedom, fields.distance, &energy);
        let mut rounds = Rounds { energy, mover, distance: fields.distance, align: options.align };
        let report = rounds.run(&mut triangles, watch)?;
        let mesh = triangles.into_mesh()?;
        let after = MeshAngles::of(&mesh, sine_floor);
        let ImproveReport { angle_before, angle_after, below, floor_held, .. } =
            before.report(after);
        Ok((mesh, ImproveReport { angle_before, angle_after, below, floor_held, ..report }))
    }
}

/// What the rounds work with.
struct Rounds<'a> {
    energy: Energy<'a>,
    mover: Mover,
    distance: &'a NominalDistance<2>,
    align: Align,
}

impl Rounds<'_> {
    /// Swaps, and, but with [`Align::Swaps`], moves, takes away and adds points, until nothing helps. Reports how often.
    fn run(
        &mut self,
        triangles: &mut Triangles,
        watch: &mut dyn Watch,
    ) -> Result<ImproveReport, Cancelled> {
        let Self { energy, mover, distance, align } = self;
        let is_full = align.moves();
        let mut report = ImproveReport::default();
        for round in 0..ROUNDS {
            check(watch, Phase::Improve, round as f64 / ROUNDS as f64, None)?;
            energy.shape_weight = if round < EARLY_ROUNDS { EARLY_SHAPE_WEIGHT } else { 1.0 };
            let swaps = swaps::swap_all(triangles, energy, mover);
            if is_full && DENSITY_ROUNDS.contains(&round) {
                report.removed += density::thin_out(triangles, energy, mover);
                report.added += density::fill_gaps(triangles, energy, mover, distance);
            }
            let moves = if is_full { mover.move_all(triangles, energy) } else { 0 };
            report.rounds += 1;
            report.swaps += swaps;
            report.moves += moves;
            if swaps + moves == 0 && round >= EARLY_ROUNDS {
                break;
            }
        }
        check(watch, Phase::Improve, 1.0, None)?;
        Ok(report)
    }
}

/// The angles of a mesh.
#[derive(Clone, Copy)]
struct MeshAngles {
    /// The sine of the least.
    least_sine: f64,
    /// Cells below the floor.
    below: usize,
}

impl MeshAngles {
    fn of(mesh: &Mesh<2>, sine_floor: f64) -> Self {
        let sines = mesh.simplices().map(|s| energy::least_sine(s.first, s.others[0], s.others[1]));
        let start = Self { least_sine: 1.0, below: 0 };
        sines.fold(start, |angles, sine| Self {
            least_sine: angles.least_sine.min(sine),
            below: angles.below + usize::from(sine < sine_floor),
        })
    }

    /// What is reported of a mesh with these angles, improved to others.
    fn report(self, after: Self) -> ImproveReport {
        let degrees = |sine: f64| sine.clamp(-1.0, 1.0).asin().to_degrees();
        ImproveReport {
            angle_before: degrees(self.least_sine),
            angle_after: degrees(after.least_sine),
            below: after.below,
            floor_held: after.below == 0,
            ..Default::default()
        }
    }
}
