//! Improving tetrahedra: no slivers, and facets that follow features.
//!
//! In this order, in every part of the mesh:
//!
//! 1. cells below the floor are swapped away, or their points moved ([`slivers`]);
//! 2. swaps, then moves, bring facets onto valleys of b, and keep cells above the floor ([`align`], [`moves`]);
//! 3. cells that are still below it are tried again;
//! 4. points that are left beside a valley get another try, on a copy of what is around them ([`strays`]).
//!
//! Parts are worked on in parallel. What lies between two parts is done in a second and a third pass, which cut
//! elsewhere ([`parts`]). No cell is ever inverted, points on a side of the box stay on it, and cells on the hull are
//! swapped only within one side, so the cells go on filling the box exactly.
//!
//! The floor on dihedral angles is held as a limit on their cosines: the smaller an angle, the greater its cosine.
//!
//! Cost: O(n) in cells; about half of what connecting them takes, of which aligning is two thirds.

mod align;
mod depth;
mod edge_ring;
mod fit;
mod moves;
mod parts;
mod shape;
mod slivers;
mod smooth;
mod strays;
#[cfg(test)]
mod tests;
mod tetrahedra;

use super::{Align, Held, ImproveError, ImproveOptions, ImproveReport, Improver};
use crate::fields::FieldsView;
use crate::geometry::{Bounds, Point};
use crate::mesh::Mesh;
use crate::parallel::prelude::*;
use crate::watch::{Phase, Watch, check};
use align::Aligner;
use depth::DepthField;
use parts::{CUTS, Part, WholeMesh};
use slivers::{Effort, remove_slivers};

/// Improves tetrahedra.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpaceImprover;

/// By how many degrees cells are kept above the floor, so that rounding in other coordinates does not break it.
const MARGIN: f64 = 0.01;
/// The most rounds of swapping and moving bad cells away; two or three do nearly always.
const ROUNDS: usize = 6;

/// What the work on all parts shares.
struct Work<'a> {
    /// −b; `None` where β is 0 everywhere, and facets have nothing to follow.
    field: Option<DepthField<'a>>,
    fields: FieldsView<'a, 3>,
    align: Align,
    /// The greatest cosine of a dihedral angle.
    cosine_limit: f64,
}

impl Improver<3> for SpaceImprover {
    fn improve(
        &self,
        mesh: Mesh<3>,
        held: Held<'_, 3>,
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
        let is_weighted = fields.weight.as_constant() != Some(0.0);
        let work = Work {
            field: (is_weighted && options.align != Align::Conform)
                .then(|| DepthField::new(fields.potential)),
            fields,
            align: options.align,
            cosine_limit: (options.min_angle + MARGIN).to_radians().cos(),
        };
        let moves = options.align.moves();
        let freedom = if moves { held.freedom } else { &vec![0; points.len()] };
        let mut whole = WholeMesh::new(points, freedom, &corners, &bounds, held.facets);
        let mut report =
            ImproveReport { angle_before: whole.angles(1.0).least(), ..Default::default() };
        if options.align != Align::Off {
            improve_parts(&mut whole, &work, held.near, &mut report, watch)?;
        }
        let angles = whole.angles(options.min_angle.to_radians().cos());
        report.angle_after = angles.least();
        report.below = angles.below;
        report.floor_held = angles.below == 0;
        whole.drop_loose_points();
        Ok((Mesh::new(whole.points, whole.corners.into_flattened())?, report))
    }
}

/// All passes over all parts, or over what of them is near some points.
fn improve_parts(
    whole: &mut WholeMesh<'_>,
    work: &Work<'_>,
    near: Option<&[bool]>,
    report: &mut ImproveReport,
    watch: &mut dyn Watch,
) -> Result<(), ImproveError> {
    let mut pending = near.map(<[bool]>::to_vec);
    for (pass, &cut) in CUTS.iter().enumerate() {
        check(watch, Phase::Improve, pass as f64 / CUTS.len() as f64, None)?;
        let divided = whole.divide(cut, pending.as_deref());
        let valences = whole.valences();
        let improved = |local: &mut Vec<u32>, cells: &Vec<u32>| {
            let mut part = whole.part(cells, &valences, pending.as_deref(), local);
            let effort = work.improve(&mut part);
            (part, effort)
        };
        let local = || vec![tetrahedra::NONE; whole.points.len()];
        let done: Vec<(Part, Effort)> = divided.par_iter().map_init(local, improved).collect();
        let mut held = vec![false; whole.points.len()];
        for (part, effort) in &done {
            report.swaps += effort.swaps;
            report.moves += effort.moves;
            report.rounds = report.rounds.max(effort.rounds);
            report.gave_up |= effort.gave_up;
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
        let tetrahedra = &mut part.tetrahedra;
        remove_slivers(tetrahedra, self.cosine_limit, ROUNDS, &mut effort);
        let Some(field) = &self.field else { return effort };
        let is_weighted = |p: &Point<3>| self.fields.weight.at(p) > 0.0;
        let pending = part.is_pending.iter().zip(&tetrahedra.points);
        let active: Vec<bool> =
            pending.map(|(&is_pending, p)| is_pending && is_weighted(p)).collect();
        let mut aligner = Aligner::new(field, self.cosine_limit, tetrahedra);
        aligner.swap(tetrahedra, &active, &mut effort);
        if self.align.moves() {
            aligner.moves(tetrahedra, &active, &mut effort);
        }
        remove_slivers(tetrahedra, self.cosine_limit, ROUNDS, &mut effort);
        if self.align.moves() {
            aligner.bring_strays(tetrahedra, &active, self.fields.distance, &mut effort);
        }
        effort
    }
}
