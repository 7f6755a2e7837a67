//! Frames of what is seen: atoms and a drag under way, and in the plane the mesh, facets and flow.

use std::collections::BTreeSet;

use atomesh::edit::{AtomId, Changes};
use atomesh::image::Grid;
use atomesh::run::Outcome;

use crate::model::{Edited, Flow};
use crate::protocol::{Arrays, Kind};

/// The axes seen in the plane.
const AXES: [usize; 2] = [0, 1];

/// Added to a feature's number where it lets everything through.
const OPEN: u32 = 1 << 16;

/// The mesh: its points and edges; of Voronoi cells those.
pub fn mesh<const D: usize>(outcome: &Outcome<D>, revision: u32) -> Vec<u8> {
    let grid = outcome.potential().grid();
    let (points, edges) = match outcome.cells() {
        Some(cells) => {
            let faces = 0..cells.face_count();
            (
                cells.points(),
                faces.flat_map(|face| loop_edges(cells.face(face))).collect::<BTreeSet<_>>(),
            )
        }
        None => {
            let cells = outcome.mesh().cells();
            (outcome.mesh().points(), cells.flat_map(loop_edges).collect())
        }
    };
    let mut arrays = Arrays::new(Kind::Mesh, 2, revision, [points.len(), edges.len()]);
    points.iter().for_each(|p| arrays.place(p, grid, AXES));
    arrays.numbers(edges.into_iter().flatten());
    arrays.into_bytes()
}

/// The edges of a loop of corners, of two corners the one between them.
fn loop_edges(corners: &[u32]) -> Vec<[u32; 2]> {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| [*a.min(b), *a.max(b)]).collect()
}

/// The atoms and, in the plane, the cells between them.
pub fn atoms<const D: usize>(edited: &Edited<D>, grid: &Grid<D>, revision: u32) -> Vec<u8> {
    let cells = if D == 2 { edited.cells() } else { Vec::new() };
    let counts = [edited.atoms().len(), cells.len() / (D + 1)];
    let mut arrays = Arrays::new(Kind::Atoms, D, revision, counts);
    for atom in edited.atoms() {
        arrays.whole_place(&atom.map_or([0.0; D], |(place, _)| place), grid);
        arrays.numbers([match atom {
            Some((_, is_pinned)) => u32::from(is_pinned),
            None => 2,
        }]);
    }
    arrays.numbers(cells);
    arrays.into_bytes()
}

/// What a drag has changed since it began.
#[derive(Debug, Default)]
pub struct Dragged {
    moved: BTreeSet<AtomId>,
    removed: BTreeSet<Vec<AtomId>>,
    added: BTreeSet<Vec<AtomId>>,
}

impl Dragged {
    /// Adds what a step has changed.
    pub fn add<const D: usize>(&mut self, changes: &Changes<D>) {
        self.moved.extend(changes.moves().iter().map(|moved| moved.atom));
        if D != 2 {
            return;
        }
        for cell in changes.cells_removed() {
            if !self.added.remove(cell) {
                self.removed.insert(cell.to_vec());
            }
        }
        for cell in changes.cells_added() {
            if !self.removed.remove(cell) {
                self.added.insert(cell.to_vec());
            }
        }
    }

    /// The frame.
    pub fn frame<const D: usize>(
        &self,
        edited: &Edited<D>,
        grid: &Grid<D>,
        revision: u32,
    ) -> Vec<u8> {
        let corners = self.removed.iter().chain(&self.added).flatten();
        let numbers: Vec<u32> = corners.map(|name| edited.number(*name)).collect();
        let counts = [self.moved.len(), 1 + numbers.len()];
        let mut arrays = Arrays::new(Kind::Drag, D, revision, counts);
        for name in &self.moved {
            let number = edited.number(*name);
            arrays.numbers([number]);
            arrays.whole_place(&edited.place(number).unwrap_or([0.0; D]), grid);
        }
        arrays.numbers([self.removed.len() as u32]);
        arrays.numbers(numbers);
        arrays.into_bytes()
    }
}

/// The facets of features and other barriers.
pub fn facets<const D: usize>(flow: &Flow<D>, grid: &Grid<D>, revision: u32) -> Vec<u8> {
    let mut arrays = Arrays::new(Kind::Facets, 2, revision, [flow.facets.len(), 0]);
    for facet in &flow.facets {
        for corner in &facet.corners[..2] {
            arrays.place(corner, grid, AXES);
        }
        arrays.numbers([facet.feature + if facet.multiplier < 1.0 { 0 } else { OPEN }]);
    }
    arrays.into_bytes()
}

/// The streamlines.
pub fn flow<const D: usize>(flow: &Flow<D>, grid: &Grid<D>, revision: u32) -> Vec<u8> {
    let count = flow.lines.iter().map(Vec::len).sum();
    let mut arrays = Arrays::new(Kind::Flow, 2, revision, [count, flow.lines.len()]);
    flow.lines.iter().flatten().for_each(|p| arrays.place(p, grid, AXES));
    arrays.numbers(flow.lines.iter().map(|line| line.len() as u32));
    arrays.into_bytes()
}
