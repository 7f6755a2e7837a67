//! Improving triangles: their edges turn onto the valleys of b, and no angle stays below the floor.
//!
//! Delaunay's rule gives a mesh whose points lie on valleys and whose edges need not. Here every valley
//! point ([`guides`]) asks for an edge that passes near it and along it, and every cell for a good shape:
//!
//! E = Σ over cells of w (0.9 − q) + Σ over guides of pull · (1 − how well an edge of its cell follows it)
//!
//! which counts what the alignment measure counts, smoothed so that descent feels it from afar. An edge gains
//! nothing from a valley that another follows already, and valleys of any depth pull alike: the sum of b along
//! edges, which has neither property, reaches less at equal shape. A guide looks at the three edges of its own
//! cell alone, so E is a sum over cells: what a swap or a move changes is known from the two cells or the star
//! that it touches.
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

use super::{Align, ImproveError, ImproveOptions, ImproveReport, Improver};
use crate::fields::FieldsView;
use crate::mesh::Mesh;
use crate::watch::{Phase, Watch, check};

use energy::Energy;
use guides::guides;
use moves::Mover;
use triangles::Triangles;

/// Rounds, at most. On the paper's fault image at d = 8 the tenth lowers E by less than a hundredth.
const ROUNDS: usize = 10;
/// The first rounds, in which shape weighs more, and how much more.
const EARLY: (usize, f64) = (2, 5.0);
/// The rounds in which points are taken away and added: after shape has been mended and features are followed
/// where they can be.
const CROWDS: std::ops::Range<usize> = 2..6;

/// Improves triangles.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlaneImprover;

impl Improver<2> for PlaneImprover {
    fn improve(
        &self,
        mesh: Mesh<2>,
        freedom: &[u8],
        fields: FieldsView<'_, 2>,
        options: &ImproveOptions,
        watch: &mut dyn Watch,
    ) -> Result<(Mesh<2>, ImproveReport), ImproveError> {
        options.validate(2)?;
        let sine_floor = options.min_angle.to_radians().sin();
        let before = Shape::of(&mesh, sine_floor);
        if options.align == Align::Off {
            return Ok((mesh, before.report(before)));
        }
        let guides = guides(fields, watch)?;
        if guides.is_empty() && before.below == 0 {
            return Ok((mesh, before.report(before)));
        }
        let mut triangles = Triangles::new(mesh, &guides);
        let mut energy = Energy::new(&guides, sine_floor);
        let is_full = options.align == Align::Full;
        let mut mover = Mover::new(&triangles, freedom, fields.distance, &energy);
        let mut report = ImproveReport::default();
        for round in 0..ROUNDS {
            check(watch, Phase::Improve, round as f64 / ROUNDS as f64, None)?;
            energy.shape_weight = if round < EARLY.0 { EARLY.1 } else { 1.0 };
            let swaps = swaps::swap_all(&mut triangles, &energy, &mut mover);
            if is_full && CROWDS.contains(&round) {
                report.removed += density::thin_out(&mut triangles, &energy, &mut mover);
                let distance = fields.distance;
                report.added += density::fill_up(&mut triangles, &energy, &mut mover, distance);
            }
            let moves = if is_full { mover.move_all(&mut triangles, &energy) } else { 0 };
            report.rounds += 1;
            report.swaps += swaps;
            report.moves += moves;
            if swaps + moves == 0 && round >= EARLY.0 {
                break;
            }
        }
        check(watch, Phase::Improve, 1.0, None)?;
        let mesh = triangles.into_mesh()?;
        let after = Shape::of(&mesh, sine_floor);
        let ImproveReport { angle_before, angle_after, below, floor_held, .. } =
            before.report(after);
        Ok((mesh, ImproveReport { angle_before, angle_after, below, floor_held, ..report }))
    }
}

/// The angles of a mesh.
#[derive(Clone, Copy)]
struct Shape {
    /// The sine of the least.
    least: f64,
    /// Cells below the floor.
    below: usize,
}

impl Shape {
    fn of(mesh: &Mesh<2>, sine_floor: f64) -> Self {
        let sines = mesh.simplices().map(|s| energy::least_sine(s.first, s.others[0], s.others[1]));
        let start = Self { least: 1.0, below: 0 };
        sines.fold(start, |shape, sine| Self {
            least: shape.least.min(sine),
            below: shape.below + usize::from(sine < sine_floor),
        })
    }

    /// What a mesh of this shape, improved to another, reports.
    fn report(self, after: Self) -> ImproveReport {
        let degrees = |sine: f64| sine.clamp(-1.0, 1.0).asin().to_degrees();
        ImproveReport {
            angle_before: degrees(self.least),
            angle_after: degrees(after.least),
            below: after.below,
            floor_held: after.below == 0,
            ..Default::default()
        }
    }
}
