//! Improving tetrahedra: no slivers, and facets that follow features.
//!
//! In this order, in every part of the mesh:
//!
//! 1. cells below the floor are swapped away, or their points moved ([`heal`]);
//! 2. swaps, then moves, bring facets onto valleys of b, and keep cells above the floor ([`align`]);
//! 3. cells that are still below it are tried again;
//! 4. points that are left beside a valley get another try, on a copy of what is around them ([`stray`]).
//!
//! Parts are worked on side by side; what lies between two parts is done in a second and a third pass, which cut
//! elsewhere ([`parts`]). No cell is ever inverted, points on a side of the box stay on it, and cells on the hull are
//! swapped only within one side, so the cells go on filling the box exactly.
//!
//! Cost: O(n) in cells; about half of what connecting them takes, of which aligning is two thirds.

mod align;
mod heal;
mod moves;
mod parts;
mod patch;
mod ring;
mod shape;
mod smooth;
mod stray;

#[cfg(test)]
mod tests;
mod valley;

use super::{Align, ImproveError, ImproveOptions, ImproveReport, Improver};
use crate::fields::FieldsView;
use crate::geometry::{Bounds, Point};
use crate::mesh::Mesh;
use crate::watch::{Phase, Watch, check};
use align::Aligner;
use heal::{Effort, heal};
use parts::{CUTS, Part, Whole};
use rayon::prelude::*;
use valley::Valley;

/// Improves tetrahedral meshes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Space;

/// By how many degrees the floor is kept, so that rounding in other coordinates does not break it.
const MARGIN: f64 = 0.01;
/// The most rounds of swapping and moving bad cells away; two or three do nearly always.
const ROUNDS: usize = 6;
/// Cells that one task judges at the end.
const BLOCK: usize = 1 << 13;

/// What all parts are worked on by.
struct Work<'a> {
    valley: Option<Valley<'a>>,
    fields: FieldsView<'a, 3>,
    align: Align,
    /// The greatest cosine of a dihedral angle.
    floor: f64,
}

impl Improver<3> for Space {
    fn improve(
        &self,
        mesh: Mesh<3>,
        freedom: &[u8],
        fields: FieldsView<'_, 3>,
        options: &ImproveOptions,
        watch: &mut dyn Watch,
    ) -> Result<(Mesh<3>, ImproveReport), ImproveError> {
        options.validate(3)?;
        let (points, corners) = mesh.into_parts();
        let Some(bounds) = Bounds::of(&points) else {
            let report = ImproveReport { floor_held: true, ..Default::default() };
            return Ok((Mesh::new(points, corners)?, report));
        };
        let is_drawn = fields.weight.as_constant() != Some(0.0);
        let work = Work {
            valley: is_drawn.then(|| Valley::new(fields.potential)),
            fields,
            align: options.align,
            floor: (options.min_angle + MARGIN).to_radians().cos(),
        };
        let freedom = if options.align == Align::Full { freedom } else { &vec![0; points.len()] };
        let mut whole = Whole::new(points, freedom, &corners, &bounds);
        let mut report =
            ImproveReport { angle_before: angle(whole.judge(1.0).0), ..Default::default() };
        if options.align != Align::Off {
            improve_parts(&mut whole, &work, &mut report, watch)?;
        }
        let (worst, below) = whole.judge(options.min_angle.to_radians().cos());
        report.angle_after = angle(worst);
        report.below = below;
        report.floor_held = below == 0;
        whole.drop_loose_points();
        Ok((Mesh::new(whole.points, whole.corners.into_flattened())?, report))
    }
}

/// All passes over all parts.
fn improve_parts(
    whole: &mut Whole,
    work: &Work<'_>,
    report: &mut ImproveReport,
    watch: &mut dyn Watch,
) -> Result<(), ImproveError> {
    let mut pending: Option<Vec<bool>> = None;
    for (pass, &cut) in CUTS.iter().enumerate() {
        check(watch, Phase::Improve, pass as f64 / CUTS.len() as f64, None)?;
        let divided = whole.divide(cut, pending.as_deref());
        let valences = whole.valences();
        let improved = |local: &mut Vec<u32>, cells: &Vec<u32>| {
            let mut part = whole.part(cells, &valences, pending.as_deref(), local);
            let effort = work.improve(&mut part);
            (part, effort)
        };
        let local = || vec![patch::NONE; whole.points.len()];
        let done: Vec<(Part, Effort)> = divided.par_iter().map_init(local, improved).collect();
        let mut held = vec![false; whole.points.len()];
        for (part, effort) in &done {
            report.swaps += effort.swaps;
            report.moves += effort.moves;
            report.rounds = report.rounds.max(effort.rounds);
            for &point in &part.held {
                let point = part.points[point as usize] as usize;
                held[point] = pending.as_ref().is_none_or(|p| p[point]);
            }
        }
        let parts: Vec<Part> = done.into_iter().map(|(part, _)| part).collect();
        whole.take_back(&parts, &divided);
        if !held.contains(&true) {
            break;
        }
        pending = Some(held);
    }
    Ok(())
}

impl Work<'_> {
    /// Improves one part.
    fn improve(&self, part: &mut Part) -> Effort {
        let mut effort = Effort::default();
        let patch = &mut part.patch;
        heal(patch, self.floor, ROUNDS, &mut effort);
        let Some(valley) = &self.valley else { return effort };
        let is_drawn = |p: &Point<3>| self.fields.weight.at(p) > 0.0;
        let open: Vec<bool> =
            part.open.iter().zip(&patch.points).map(|(&open, p)| open && is_drawn(p)).collect();
        let mut aligner = Aligner::new(valley, self.floor, patch);
        aligner.swap(patch, &open, &mut effort);
        if self.align == Align::Full {
            aligner.moves(patch, &open, &mut effort);
        }
        heal(patch, self.floor, ROUNDS, &mut effort);
        if self.align == Align::Full {
            aligner.gather_strays(patch, &open, self.fields.distance, &mut effort);
        }
        effort
    }
}

/// The angle of a cosine, in degrees; 0 of a cell that is no cell.
fn angle(cosine: f64) -> f64 {
    cosine.clamp(-1.0, 1.0).acos().to_degrees()
}

impl Whole {
    /// The mesh as it is given.
    fn new(points: Vec<Point<3>>, freedom: &[u8], corners: &[u32], bounds: &Bounds<3>) -> Self {
        let sides: Vec<u8> = points.iter().map(|p| bounds.sides(p, 0.0)).collect();
        // whatever the lattice says, a point on a side stays on it
        let freedom = freedom.iter().zip(&points).map(|(f, p)| f & bounds.freedom(p)).collect();
        let corners = corners.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect();
        Self { points, freedom, sides, corners }
    }

    /// Drops points that no cell has any more.
    fn drop_loose_points(&mut self) {
        let mut number = vec![patch::NONE; self.points.len()];
        self.corners.iter().flatten().for_each(|&c| number[c as usize] = 0);
        if !number.contains(&patch::NONE) {
            return;
        }
        let mut count = 0;
        for (number, point) in number.iter_mut().zip(0..).filter(|(n, _)| **n == 0) {
            self.points[count as usize] = self.points[point];
            *number = count;
            count += 1;
        }
        self.points.truncate(count as usize);
        self.corners.iter_mut().flatten().for_each(|c| *c = number[*c as usize]);
    }

    /// The greatest cosine of a cell, and how many are above `floor`.
    fn judge(&self, floor: f64) -> (f64, usize) {
        let of = |cells: &[[u32; 4]]| {
            let cosines = cells.iter().map(|cell| {
                let [p, q, r, s] = cell.map(|c| self.points[c as usize]);
                shape::shape(&p, &q, &r, &s).cosine
            });
            cosines.fold((-1.0_f64, 0), |(worst, below), cosine| {
                (worst.max(cosine), below + usize::from(cosine > floor))
            })
        };
        let blocks = self.corners.par_chunks(BLOCK).map(of);
        blocks.reduce(|| (-1.0, 0), |a, b| (a.0.max(b.0), a.1 + b.1))
    }
}
