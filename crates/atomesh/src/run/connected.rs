//! The fourth stage: Delaunay's mesh of the atoms.

use std::collections::HashSet;

use crate::parallel::prelude::*;

use crate::conform::feature_facets;
use crate::crests::Pieces;
use crate::improve::{Align, Held, ImproveOptions, ImproveReport, Improver};
use crate::measure::cell_shape;
use crate::mesh::Mesh;
use crate::mirror::MirrorReport;
use crate::optimize::OptimizeReport;
use crate::watch::Watch;

use super::error::RunError;
use super::improved::Improved;
use super::prepared::{Parts, Prepared};

/// Delaunay's mesh of the atoms, as it is before facets are turned onto features.
#[derive(Clone, Debug)]
pub struct Connected<const D: usize> {
    pub(super) run: Prepared<D>,
    pub(super) mesh: Mesh<D>,
    /// The axes along which each point may move, as bits.
    pub(super) freedom: Vec<u8>,
    pub(super) report: OptimizeReport,
    pub(super) mirror_report: Option<MirrorReport>,
}

impl<const D: usize> Connected<D> {
    /// What the run was prepared from.
    pub fn run(&self) -> &Prepared<D> {
        &self.run
    }

    /// The mesh in lattice coordinates.
    pub fn mesh(&self) -> &Mesh<D> {
        &self.mesh
    }

    /// Turns facets onto features and mends badly shaped cells, as
    /// [`MeshOptions::improve`](super::MeshOptions::improve) asks; with [`Align::Off`] the mesh stays as it is.
    ///
    /// # Errors
    /// [`RunError::Improve`], also when cancelled.
    pub fn improve(self, watch: &mut dyn Watch) -> Result<Improved<D>, RunError> {
        (self.run.parts().method.stages().improve)(self, watch)
    }

    /// The mesh as it is, as the next stage.
    pub(super) fn unimproved(self) -> Improved<D> {
        let Self { run, mesh, report, mirror_report, .. } = self;
        Improved { run, mesh, report, mirror_report, improve_report: None }
    }
}

/// [`Connected::improve`].
pub(super) fn improve<const D: usize>(
    connected: Connected<D>,
    watch: &mut dyn Watch,
) -> Result<Improved<D>, RunError> {
    let Parts { method, options, .. } = connected.run.parts();
    let (Some(improver), false) = (method.improver(), options.improve.align == Align::Off) else {
        return Ok(connected.unimproved());
    };
    let Connected { run, mesh, freedom, report, mirror_report } = connected;
    let options = &run.options().improve;
    let Some(pieces) = run.pieces() else {
        let held = Held { freedom: &freedom, facets: &[], near: None };
        let (mesh, improved) = improver.improve(mesh, held, run.fields(), options, watch)?;
        return Ok(Improved { run, mesh, report, mirror_report, improve_report: Some(improved) });
    };
    let (mesh, improved) = improve_around(pieces, mesh, freedom, &run, improver, watch)?;
    Ok(Improved { run, mesh, report, mirror_report, improve_report: Some(improved) })
}

/// The floor of angles that is tried for around features, in the plane and in space, in degrees: rows of atoms leave room
/// for it. What must be held is what was asked for.
const TRIED_ANGLE: [f64; 2] = [25.0, 15.0];

/// How far from bad cells what is held is given free, time after time, in rings of cells around them.
const RELEASES: [usize; 3] = [0, 1, 3];

/// How many rings of cells more are improved then.
const AROUND: usize = 2;

/// Improves a mesh around its facets on features. Where cells stay below the floor of angles, the floor wins: facets
/// and points of features at such cells are given free, and the mesh is improved once more.
fn improve_around<const D: usize>(
    pieces: &Pieces<D>,
    mesh: Mesh<D>,
    mut freedom: Vec<u8>,
    run: &Prepared<D>,
    improver: &dyn Improver<D>,
    watch: &mut dyn Watch,
) -> Result<(Mesh<D>, ImproveReport), RunError> {
    let (options, bounds, fields) = (&run.options().improve, run.bounds(), run.fields());
    let fixed: HashSet<[u64; D]> = match run.options().seed_points.is_empty() {
        true => HashSet::new(),
        false => (freedom.iter().zip(mesh.points()))
            .filter(|(freedom, _)| **freedom == 0)
            .map(|(_, p)| p.map(f64::to_bits))
            .collect(),
    };
    let facets = |mesh: &Mesh<D>| -> Vec<[u32; D]> {
        let found = feature_facets(mesh, pieces, run.distance());
        found.iter().map(|facet| facet.corners).collect()
    };
    let min_angle = options.min_angle.max(TRIED_ANGLE[D - 2]);
    let tried = ImproveOptions { min_angle, ..*options };
    let held = facets(&mesh);
    let held = Held { freedom: &freedom, facets: &held, near: None };
    let (mut mesh, mut report) = improver.improve(mesh, held, fields, &tried, watch)?;
    for rings in RELEASES {
        let (is_bad, count) = corners_of_bad_cells(&mesh, options.min_angle);
        (report.below, report.floor_held) = (count, count == 0);
        // a floor that was given up without features near is out of reach without them too
        if count == 0 || report.gave_up && min_angle == options.min_angle {
            break;
        }
        let is_released = widened(&mesh, is_bad, rings);
        let near = widened(&mesh, is_released.clone(), AROUND);
        let mut held = facets(&mesh);
        held.retain(|facet| !facet.iter().any(|&corner| is_released[corner as usize]));
        let mut is_held = vec![false; mesh.points().len()];
        held.iter().flatten().for_each(|&corner| is_held[corner as usize] = true);
        freedom = (mesh.points().iter().zip(&is_held))
            .map(|(p, is_held)| match *is_held || fixed.contains(&p.map(f64::to_bits)) {
                true => 0,
                false => bounds.freedom(p),
            })
            .collect();
        let held = Held { freedom: &freedom, facets: &held, near: Some(&near) };
        let (better, next) = improver.improve(mesh, held, fields, options, watch)?;
        (mesh, report) = (better, report.and(next));
    }
    Ok((mesh, report))
}

/// The corners of cells with an angle below the floor, and how many such cells there are.
fn corners_of_bad_cells<const D: usize>(mesh: &Mesh<D>, floor: f64) -> (Vec<bool>, usize) {
    let is_bad = |cell: &[u32]| cell_shape(&mesh.simplex(cell).edges()).least_angle < floor;
    let mut is_near = vec![false; mesh.points().len()];
    let count = mark(mesh, &mut is_near, |_, cell| is_bad(cell));
    (is_near, count)
}

/// The marked points and, `rings` times, the corners of the cells around them.
fn widened<const D: usize>(mesh: &Mesh<D>, mut marks: Vec<bool>, rings: usize) -> Vec<bool> {
    for _ in 0..rings {
        let has_mark = |marks: &[bool], cell: &[u32]| cell.iter().any(|&c| marks[c as usize]);
        mark(mesh, &mut marks, has_mark);
    }
    marks
}

/// Marks the corners of some cells, and says how many cells they are.
fn mark<const D: usize>(
    mesh: &Mesh<D>,
    marks: &mut [bool],
    is_wanted: impl Fn(&[bool], &[u32]) -> bool + Sync,
) -> usize {
    let cells = mesh.corners().par_chunks_exact(D + 1).with_min_len(1 << 10);
    let found: Vec<&[u32]> = cells.filter(|cell| is_wanted(marks, cell)).collect();
    found.iter().copied().flatten().for_each(|&corner| marks[corner as usize] = true);
    found.len()
}
