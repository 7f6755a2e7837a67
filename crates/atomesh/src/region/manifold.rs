//! Dropping cells of a part of a mesh until its boundary is a manifold.
//!
//! A boundary is pinched where more than two of its facets meet in a ridge (a point in 2-D, an edge in 3-D), or, in
//! 3-D, where its facets around a point make more than one fan. Of the cells around a pinch only the largest group
//! connected by facets stays. If there is but one group, a gap between two outsides that meet there is widened: the
//! least cell is dropped, cells whose corners are all on the outline first. Each round only drops cells, so the rounds
//! end.

use std::collections::HashMap;

use crate::mesh::{CellsOfPoints, Mesh};

use super::regularity::regularity;

/// No cell.
const NONE: u32 = u32::MAX;

/// Cells of less [`regularity`] whose corners are all on the outline are dropped where the boundary stays of the same
/// kind without them.
const SLIVER: f64 = 0.25;

/// Which of the `kept` cells of a mesh stay so that their boundary is a manifold. `peelable` cells, with all corners on
/// the outline and no facet on a side of the box, go first.
pub(super) fn until_manifold<const D: usize>(
    mesh: &Mesh<D>,
    peelable: Vec<bool>,
    kept: Vec<bool>,
) -> Vec<bool> {
    let mut part = Part::new(mesh, peelable, kept);
    loop {
        part.drop_slivers();
        if !part.open_pinches() {
            return part.kept;
        }
    }
}

/// A mesh of which some cells are kept.
struct Part<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    /// Whether all corners of a cell are on the outline, and none of its facets on a side of the box.
    peelable: Vec<bool>,
    kept: Vec<bool>,
    measures: Vec<f64>,
    /// The cell opposite each corner of each cell, or `NONE`.
    neighbours: Vec<u32>,
    cells: CellsOfPoints,
}

impl<'a, const D: usize> Part<'a, D> {
    fn new(mesh: &'a Mesh<D>, peelable: Vec<bool>, kept: Vec<bool>) -> Self {
        let mut neighbours = vec![NONE; mesh.corners().len()];
        for facet in mesh.facets() {
            let Some(other) = facet.neighbour else { continue };
            for (cell, beyond) in [(facet.cell, other), (other, facet.cell)] {
                let at = cell as usize * (D + 1);
                let corners = &mesh.corners()[at..at + D + 1];
                if let Some(apex) = corners.iter().position(|c| !facet.corners.contains(c)) {
                    neighbours[at + apex] = beyond;
                }
            }
        }
        let measures = mesh.simplices().map(|s| s.measure()).collect();
        Self { mesh, peelable, kept, measures, neighbours, cells: mesh.cells_of_points() }
    }

    fn corners(&self, cell: u32) -> &'a [u32] {
        let at = cell as usize * (D + 1);
        &self.mesh.corners()[at..at + D + 1]
    }

    /// Whether the facet of a kept cell opposite a corner is bare, that is, on the boundary.
    fn is_bare(&self, cell: u32, apex: usize) -> bool {
        let beyond = self.neighbours[cell as usize * (D + 1) + apex];
        beyond == NONE || !self.kept[beyond as usize]
    }

    /// The facets of the boundary, each with its cell.
    fn boundary(&self) -> Vec<[u32; D]> {
        let mut facets = Vec::new();
        for cell in (0..self.kept.len() as u32).filter(|&c| self.kept[c as usize]) {
            for apex in (0..=D).filter(|&apex| self.is_bare(cell, apex)) {
                facets.push(self.mesh.facet_of(cell as usize, apex));
            }
        }
        facets
    }

    /// Drops flat cells whose corners are all on the outline, where that changes the boundary's facets but not its
    /// kind: what the cell shares with the boundary is just its bare facets.
    fn drop_slivers(&mut self) {
        let mut around = FacetCounts::default();
        for facet in self.boundary() {
            around.add(&facet, 1);
        }
        for cell in 0..self.kept.len() as u32 {
            let i = cell as usize;
            if !(self.kept[i] && self.peelable[i]) || self.quality(cell) >= SLIVER {
                continue;
            }
            let corners = self.corners(cell);
            let bare: Vec<usize> = (0..=D).filter(|&a| self.is_bare(cell, a)).collect();
            if bare.is_empty() || bare.len() == D + 1 || !around.only_bare::<D>(corners, &bare) {
                continue;
            }
            self.kept[i] = false;
            for apex in 0..=D {
                let facet = self.mesh.facet_of(i, apex);
                around.add(&facet, if bare.contains(&apex) { -1 } else { 1 });
            }
        }
    }

    fn quality(&self, cell: u32) -> f64 {
        regularity(&self.mesh.simplex(self.corners(cell)))
    }

    /// Drops cells at pinches; says whether there were any.
    fn open_pinches(&mut self) -> bool {
        let boundary = self.boundary();
        let mut ridges: Vec<Vec<u32>> = Vec::new();
        for facet in &boundary {
            for skip in 0..D {
                let mut ridge: Vec<u32> = (0..D).filter(|&k| k != skip).map(|k| facet[k]).collect();
                ridge.sort_unstable();
                ridges.push(ridge);
            }
        }
        ridges.sort_unstable();
        let pinched: Vec<&[u32]> =
            ridges.chunk_by(|a, b| a == b).filter(|g| g.len() > 2).map(|g| &g[0][..]).collect();
        for ridge in &pinched {
            self.open_pinch(ridge);
        }
        if !pinched.is_empty() || D == 2 {
            return !pinched.is_empty();
        }
        let points = pinched_points(&boundary);
        for &p in &points {
            self.open_pinch(&[p]);
        }
        !points.is_empty()
    }

    /// Keeps only the largest group of the kept cells around a face, a ridge or point; if there is but one group, drops
    /// its least cell.
    fn open_pinch(&mut self, face: &[u32]) {
        let mut groups = self.groups(face);
        if groups.len() < 2 {
            let all = groups.concat();
            let order = |a: &u32, b: &u32| {
                let key = |c: u32| (!self.peelable[c as usize], self.measures[c as usize]);
                let (a, b) = (key(*a), key(*b));
                a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
            };
            if let Some(&least) = all.iter().min_by(|a, b| order(a, b)) {
                self.kept[least as usize] = false;
            }
            return;
        }
        let weight = |group: &Vec<u32>| -> (bool, f64) {
            let inside = group.iter().any(|&c| !self.peelable[c as usize]);
            (inside, group.iter().map(|&c| self.measures[c as usize]).sum())
        };
        groups.sort_by(|a, b| {
            let (a, b) = (weight(a), weight(b));
            b.0.cmp(&a.0).then(b.1.total_cmp(&a.1))
        });
        for cell in groups[1..].iter().flatten() {
            self.kept[*cell as usize] = false;
        }
    }

    /// The kept cells around a face, in groups connected by facets that have the face.
    fn groups(&self, face: &[u32]) -> Vec<Vec<u32>> {
        let around = self.cells.of(face[0]);
        let has = |cell: u32| face.iter().all(|f| self.corners(cell).contains(f));
        let mut rest: Vec<u32> =
            around.iter().copied().filter(|&c| self.kept[c as usize] && has(c)).collect();
        let mut groups = Vec::new();
        while let Some(first) = rest.pop() {
            let mut group = vec![first];
            let mut at = 0;
            while at < group.len() {
                let cell = group[at];
                for (apex, corner) in self.corners(cell).iter().enumerate() {
                    let beyond = self.neighbours[cell as usize * (D + 1) + apex];
                    if !face.contains(corner)
                        && let Some(i) = rest.iter().position(|&c| c == beyond)
                    {
                        group.push(rest.swap_remove(i));
                    }
                }
                at += 1;
            }
            group.sort_unstable();
            groups.push(group);
        }
        groups
    }
}

fn ascending(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// How many facets of the boundary have each edge and each point.
#[derive(Default)]
struct FacetCounts {
    of_edges: HashMap<[u32; 2], u32>,
    of_points: HashMap<u32, u32>,
}

impl FacetCounts {
    /// Counts a facet in (`change` 1) or out (−1).
    fn add<const D: usize>(&mut self, facet: &[u32; D], change: i32) {
        for (i, &a) in facet.iter().enumerate() {
            let n = self.of_points.entry(a).or_default();
            *n = n.wrapping_add_signed(change);
            for &b in &facet[i + 1..] {
                let n = self.of_edges.entry(ascending(a, b)).or_default();
                *n = n.wrapping_add_signed(change);
            }
        }
    }

    /// Whether all corners and edges of a cell that are on the boundary belong to its bare facets, those opposite the
    /// corners `bare`.
    fn only_bare<const D: usize>(&self, corners: &[u32], bare: &[usize]) -> bool {
        // a corner is in the facet opposite any other
        let covered = |set: &[usize]| bare.iter().any(|apex| !set.contains(apex));
        let has_point = |i: usize| self.of_points.get(&corners[i]).is_some_and(|&n| n > 0);
        let has_edge = |i: usize, j: usize| {
            self.of_edges.get(&ascending(corners[i], corners[j])).is_some_and(|&n| n > 0)
        };
        (0..=D).all(|i| {
            (covered(&[i]) || !has_point(i))
                && (D == 2 || (i + 1..=D).all(|j| covered(&[i, j]) || !has_edge(i, j)))
        })
    }
}

/// The points around which the facets of a boundary whose ridges all have two make more than one fan.
fn pinched_points<const D: usize>(boundary: &[[u32; D]]) -> Vec<u32> {
    let mut at: Vec<(u32, u32)> = (0..boundary.len() as u32)
        .flat_map(|f| boundary[f as usize].iter().map(move |&p| (p, f)))
        .collect();
    at.sort_unstable();
    let mut pinched = Vec::new();
    for group in at.chunk_by(|a, b| a.0 == b.0) {
        let p = group[0].0;
        let mut rest: Vec<u32> = group.iter().map(|g| g.1).collect();
        let mut fan = vec![rest.remove(0)];
        while let Some(facet) = fan.pop() {
            let corners = boundary[facet as usize];
            // facets around p that share another point with this one follow it
            let mut i = 0;
            while i < rest.len() {
                let shares =
                    boundary[rest[i] as usize].iter().any(|c| *c != p && corners.contains(c));
                if shares { fan.push(rest.swap_remove(i)) } else { i += 1 }
            }
        }
        if !rest.is_empty() {
            pinched.push(p);
        }
    }
    pinched
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two pairs of triangles that meet in the middle point of a square of four: a pinch.
    #[test]
    fn a_pinch_is_opened() {
        let points = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [1.0, 1.1]];
        let mesh = Mesh::new(points, vec![0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4]).unwrap();
        let kept = until_manifold(&mesh, vec![false; 4], vec![true, false, true, false]);
        // the larger of the two stays
        assert_eq!(kept, [true, false, false, false]);
    }
}
