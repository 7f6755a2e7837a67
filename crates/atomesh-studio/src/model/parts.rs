//! The cells in parts that end at features, and parts changed by hand: what regions are painted with.
//!
//! A tree of parts is grown once for a mesh; its levels differ by one part each. Parts that were merged or split by hand are
//! kept by the strokes that did it, in their order, and are changed at whatever level is looked at, as far as they apply
//! there: so they outlive a mesh, as barriers do.

use std::sync::Arc;

use atomesh::cluster::{CellGraph, ClusterTree, merge_parts, split_part};
use atomesh::geometry::Point;
use atomesh::region::CellFinder;
use atomesh::watch::Watch;
use atomesh_job::clusters::{
    ClusteredMesh, ClustersRequest, clusters_of_facets, facets_of_outcome,
};
use atomesh_job::mesh::MadeMesh;
use atomesh_job::{JobError, Session};

use super::Model;

/// Parts of the finest level, at most.
pub const MOST_PARTS: usize = 512;

/// The multiplier of the weights of features' facets, in place of the command's 0: where a gap in a feature lets cells on its
/// two sides hang together, walls would part all but these, and leave no parts to cut them apart.
const WALL: f64 = 0.02;

/// Places along a stroke at which cells are looked at, over the least nominal distance.
const STEP: f64 = 0.25;

/// A mesh's cells in parts.
#[derive(Clone, Debug)]
pub struct Clustered {
    tree: ClusterTree,
    graph: CellGraph,
}

impl Clustered {
    /// Parts of the finest level.
    pub fn most(&self) -> usize {
        self.tree.part_count()
    }
}

/// Parts changed by hand, by strokes in lattice units.
#[derive(Clone, Debug, PartialEq)]
pub enum PartEdit<const D: usize> {
    /// The parts along a stroke become one.
    Merge(Vec<Point<D>>),
    /// The part in which the first stroke begins falls in two, between the strokes.
    Split([Vec<Point<D>>; 2]),
}

impl<const D: usize> Model<D> {
    /// The cells in parts, made if they are not there.
    ///
    /// # Errors
    /// [`JobError`], also if the watch ends the work.
    pub fn clustered(&mut self, watch: &mut dyn Watch) -> Result<Arc<Clustered>, JobError> {
        if let Some(clustered) = self.stages.clustered() {
            return Ok(clustered);
        }
        let outcome = self.refresh(watch)?;
        let images = self.images(watch)?;
        let made = MadeMesh {
            run: &self.run,
            outcome: &outcome,
            image: None,
            world: &images.world,
            properties: &[],
            regions: None,
        };
        let request =
            ClustersRequest { parts: MOST_PARTS, multiplier: WALL, ..ClustersRequest::default() };
        let mut session = Session::new(watch);
        let dimension = &self.axes.dimension;
        let facets = match made.loaded_cells() {
            Some(cells) => cells.facets(&request, None, dimension, &mut session)?,
            None => {
                let own = (&*outcome, &made.loaded()?);
                facets_of_outcome(&request, own, dimension, &mut session)?
            }
        };
        let cells = outcome.cells().map_or(outcome.mesh().cell_count(), |c| c.cell_count());
        let graph = CellGraph::of_facets(cells, &facets, request.contrast)?;
        let tree = clusters_of_facets(&request, cells, &facets, true, &mut session)?.tree;
        Ok(self.stages.keep_clustered(Clustered { tree, graph }))
    }

    /// The part of each cell at the level of so many parts, with what was changed by hand.
    ///
    /// # Errors
    /// [`JobError`], also if the watch ends the work.
    pub fn parts(&mut self, level: usize, watch: &mut dyn Watch) -> Result<Vec<i32>, JobError> {
        let clustered = self.clustered(watch)?;
        let finder = self.finder(watch)?;
        let step = self.stroke_step();
        let mut parts = clustered.tree.parts(level);
        for edit in &self.regions.part_edits {
            change(&mut parts, &clustered.graph, &finder, edit, step);
        }
        Ok(parts)
    }

    /// Changes parts as a hand does at a level, and in all others as far as it applies.
    pub(super) fn edit_parts(
        &mut self,
        edit: PartEdit<D>,
        level: usize,
        watch: &mut dyn Watch,
    ) -> Result<(), JobError> {
        let mut parts = self.parts(level, watch)?;
        let clustered = self.clustered(watch)?;
        let finder = self.finder(watch)?;
        if !change(&mut parts, &clustered.graph, &finder, &edit, self.stroke_step()) {
            return Err(JobError::misuse(match edit {
                PartEdit::Merge(_) => "the stroke lies in one part; expected one across several",
                PartEdit::Split(_) => {
                    "the two strokes do not mark two sides of one part; expected cells of one part under both"
                }
            }));
        }
        self.regions.part_edits.push(edit);
        Ok(())
    }

    /// How far apart places along a stroke are, in lattice units.
    pub(super) fn stroke_step(&self) -> f64 {
        let least = self.stages.prepared().map_or(1.0, |prepared| prepared.distance().least());
        STEP * least
    }
}

/// Changes parts; whether anything has changed.
fn change<const D: usize>(
    parts: &mut [i32],
    graph: &CellGraph,
    finder: &CellFinder<D>,
    edit: &PartEdit<D>,
    step: f64,
) -> bool {
    match edit {
        PartEdit::Merge(path) => {
            let cells = finder.along(path, step);
            let mut touched: Vec<i32> = cells.iter().map(|&cell| parts[cell as usize]).collect();
            touched.sort_unstable();
            touched.dedup();
            let Some((&kept, taken)) = touched.split_first() else { return false };
            taken.iter().all(|&part| merge_parts(parts, kept, part).is_ok()) && !taken.is_empty()
        }
        PartEdit::Split(sides) => {
            let first = sides[0].first().and_then(|p| finder.cell_at(p));
            let Some(part) = first.map(|cell| parts[cell as usize]) else { return false };
            let mut marks = sides.each_ref().map(|path| finder.along(path, step));
            marks.iter_mut().for_each(|m| m.retain(|&cell| parts[cell as usize] == part));
            // what both strokes cross is on neither side
            let both: Vec<u32> =
                marks[0].iter().filter(|cell| marks[1].contains(cell)).copied().collect();
            marks.iter_mut().for_each(|m| m.retain(|cell| !both.contains(cell)));
            split_part(graph, parts, part, [&marks[0], &marks[1]]).is_ok()
        }
    }
}
