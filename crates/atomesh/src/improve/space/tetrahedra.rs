//! Tetrahedra of a part of a mesh that can be swapped and moved: who is beside whom, and their shapes.
//!
//! Cells lie in slots; a slot that a change leaves over is dead until another change fills it. Facet k of a cell is
//! opposite its corner k. What lies beyond the part, be it the outside or the rest of the mesh, is [`NONE`]: facets
//! there stay, unless they lie on a side of the box.

use super::shape::{Shape, shape};
use crate::geometry::Point;
use std::collections::HashSet;

/// No cell, no point.
pub(super) const NONE: u32 = u32::MAX;

/// Cells, their neighbours and their shapes.
#[derive(Clone)]
pub(super) struct Tetrahedra {
    pub points: Vec<Point<3>>,
    /// Bit k of a point: it may move along axis k.
    pub freedom: Vec<u8>,
    /// Bit k of a point: it lies where axis k is least in the box; bit 3 + k: where it is greatest.
    pub sides: Vec<u8>,
    /// Whether a point is a corner of a facet that stays within the part.
    pub is_on_held: Vec<bool>,
    /// The corners of a cell, in positive orientation; of a dead cell [`NONE`].
    pub corners: Vec<[u32; 4]>,
    pub neighbours: Vec<[u32; 4]>,
    pub shapes: Vec<Shape>,
    /// A cell of each point.
    cell_of: Vec<u32>,
    dead: Vec<u32>,
    /// The last search that saw a cell.
    seen: Vec<u32>,
    search: u32,
    /// Room for the facets around a change.
    facets: Vec<Facet>,
}

/// A facet of a cell.
#[derive(Clone, Copy)]
struct Facet {
    /// Its corners, ascending.
    key: [u32; 3],
    cell: u32,
    /// The corner opposite it.
    place: u32,
}

/// Three corners, ascending.
#[inline(always)]
fn sorted(a: u32, b: u32, c: u32) -> [u32; 3] {
    let (low, high) = (a.min(b), a.max(b));
    [low.min(c), low.max(high.min(c)), high.max(c)]
}

/// The corners of facet k of a cell, ascending.
#[inline(always)]
fn facet_key(cell: &[u32; 4], k: usize) -> [u32; 3] {
    sorted(cell[(k + 1) & 3], cell[(k + 2) & 3], cell[(k + 3) & 3])
}

impl Tetrahedra {
    /// These cells; see [`Self::freedom`] and [`Self::sides`]. The facets of `held` stay.
    pub fn new(
        points: Vec<Point<3>>,
        freedom: Vec<u8>,
        sides: Vec<u8>,
        corners: Vec<[u32; 4]>,
        held: &HashSet<[u32; 3]>,
    ) -> Self {
        let mut neighbours = neighbours_of(points.len(), &corners);
        if !held.is_empty() {
            for (corners, neighbours) in corners.iter().zip(&mut neighbours) {
                for k in (0..4).filter(|&k| held.contains(&facet_key(corners, k))) {
                    neighbours[k] = NONE;
                }
            }
        }
        let mut cell_of = vec![NONE; points.len()];
        for (cell, corners) in corners.iter().enumerate() {
            corners.iter().for_each(|&c| cell_of[c as usize] = cell as u32);
        }
        let mut is_on_held = vec![false; points.len()];
        held.iter().flatten().for_each(|&c| is_on_held[c as usize] = true);
        let mut tetrahedra = Self {
            is_on_held,
            seen: vec![0; corners.len()],
            shapes: Vec::with_capacity(corners.len()),
            points,
            freedom,
            sides,
            corners,
            neighbours,
            cell_of,
            dead: Vec::new(),
            search: 0,
            facets: Vec::new(),
        };
        tetrahedra.hold_rim();
        for cell in 0..tetrahedra.corners.len() {
            let shape = tetrahedra.shape_of(&tetrahedra.corners[cell]);
            tetrahedra.shapes.push(shape);
        }
        tetrahedra
    }

    /// Holds the corners of facets with nothing beyond, unless the facet lies on a side of the box: points slide there.
    fn hold_rim(&mut self) {
        for (corners, neighbours) in self.corners.iter().zip(&self.neighbours) {
            for k in (0..4).filter(|&k| neighbours[k] == NONE) {
                let facet = [1, 2, 3].map(|n| corners[(k + n) & 3] as usize);
                if facet.iter().fold(63, |all, &p| all & self.sides[p]) == 0 {
                    facet.iter().for_each(|&p| self.freedom[p] = 0);
                }
            }
        }
    }

    /// The shape of a cell that these corners would make.
    #[inline(always)]
    pub fn shape_of(&self, corners: &[u32; 4]) -> Shape {
        let [p, q, r, s] = corners.map(|c| self.points[c as usize]);
        shape(&p, &q, &r, &s)
    }

    /// Whether the slot holds a cell.
    #[inline(always)]
    pub fn is_alive(&self, cell: u32) -> bool {
        self.corners[cell as usize][0] != NONE
    }

    /// The number of slots, dead ones included.
    pub fn slot_count(&self) -> u32 {
        self.corners.len() as u32
    }

    /// Which corner of a cell a point is; the point must be one.
    #[inline(always)]
    pub fn place(&self, cell: u32, point: u32) -> usize {
        let corners = &self.corners[cell as usize];
        (0..3).find(|&k| corners[k] == point).unwrap_or(3)
    }

    /// Appends the cells of a point.
    pub fn star(&mut self, point: u32, cells: &mut Vec<u32>) {
        self.search += 1;
        let first = self.cell_of[point as usize];
        if first == NONE {
            return;
        }
        let mut next = cells.len();
        self.seen[first as usize] = self.search;
        cells.push(first);
        while next < cells.len() {
            let cell = cells[next] as usize;
            next += 1;
            let (corners, neighbours) = (&self.corners[cell], &self.neighbours[cell]);
            for k in 0..4 {
                let other = neighbours[k];
                if corners[k] != point && other != NONE && self.seen[other as usize] != self.search
                {
                    self.seen[other as usize] = self.search;
                    cells.push(other);
                }
            }
        }
    }

    /// Which corner of the cell beyond facet k is opposite the facet.
    #[inline(always)]
    pub fn back(&self, cell: u32, k: usize) -> usize {
        let beyond = self.neighbours[cell as usize][k];
        let neighbours = &self.neighbours[beyond as usize];
        (0..3).find(|&k| neighbours[k] == cell).unwrap_or(3)
    }

    /// A cell that has an edge: the given one, if it still does, else one of the edge's points; `None` if the edge
    /// is gone.
    pub fn cell_with(&mut self, cell: u32, a: u32, b: u32) -> Option<u32> {
        let has = |corners: &[u32; 4]| corners.contains(&a) && corners.contains(&b);
        if has(&self.corners[cell as usize]) {
            return Some(cell);
        }
        let mut star = Vec::with_capacity(40);
        self.star(a, &mut star);
        star.into_iter().find(|&cell| has(&self.corners[cell as usize]))
    }

    /// Calls `visit` once for every edge of an active point, with a cell that has it.
    pub fn each_edge(&mut self, active: &[bool], mut visit: impl FnMut(&Self, u32, u32, u32)) {
        let mut last = vec![NONE; self.points.len()];
        let mut star = Vec::with_capacity(40);
        for point in 0..self.points.len() as u32 {
            if !active[point as usize] {
                continue;
            }
            star.clear();
            self.star(point, &mut star);
            for &cell in &star {
                for other in self.corners[cell as usize] {
                    let is_first = other > point || !active[other as usize];
                    if is_first && other != point && last[other as usize] != point {
                        last[other as usize] = point;
                        visit(self, cell, point, other);
                    }
                }
            }
        }
    }

    /// Puts cells with the given corners in the place of others. Both must fill the same space.
    pub fn replace(&mut self, old: &[u32], new: &[[u32; 4]]) {
        let mut facets = std::mem::take(&mut self.facets);
        facets.clear();
        for &cell in old {
            for k in 0..4 {
                let beyond = self.neighbours[cell as usize][k];
                if beyond != NONE && !old.contains(&beyond) {
                    let key = facet_key(&self.corners[cell as usize], k);
                    let back = (0..4).find(|&k| self.neighbours[beyond as usize][k] == cell);
                    facets.push(Facet { key, cell: beyond, place: back.unwrap_or(0) as u32 });
                }
            }
            self.corners[cell as usize] = [NONE; 4];
        }
        self.dead.extend(old.iter().rev());
        for corners in new {
            let cell = self.slot();
            self.corners[cell as usize] = *corners;
            self.neighbours[cell as usize] = [NONE; 4];
            self.shapes[cell as usize] = self.shape_of(corners);
            for k in 0..4 {
                facets.push(Facet { key: facet_key(corners, k), cell, place: k as u32 });
                self.cell_of[corners[k] as usize] = cell;
            }
        }
        facets.sort_unstable_by_key(|facet| facet.key);
        for pair in facets.windows(2) {
            let (a, b) = (&pair[0], &pair[1]);
            if a.key == b.key {
                self.neighbours[a.cell as usize][a.place as usize] = b.cell;
                self.neighbours[b.cell as usize][b.place as usize] = a.cell;
            }
        }
        self.facets = facets;
    }

    /// A slot for a new cell.
    fn slot(&mut self) -> u32 {
        self.dead.pop().unwrap_or_else(|| {
            self.corners.push([NONE; 4]);
            self.neighbours.push([NONE; 4]);
            self.shapes.push(Shape { cosine: 0.0, quality: 0.0 });
            self.seen.push(0);
            self.corners.len() as u32 - 1
        })
    }

    /// Moves a point, and measures its cells again.
    pub fn move_point(&mut self, point: u32, to: Point<3>, star: &[u32]) {
        self.points[point as usize] = to;
        for &cell in star {
            self.shapes[cell as usize] = self.shape_of(&self.corners[cell as usize]);
        }
    }

    /// Forgets a point that no cell has any more.
    pub fn forget(&mut self, point: u32) {
        self.cell_of[point as usize] = NONE;
    }

    /// The cells that are alive.
    pub fn cells(&self) -> impl Iterator<Item = &[u32; 4]> {
        self.corners.iter().filter(|c| c[0] != NONE)
    }
}

/// The cell beyond each facet of each cell. Facets are dealt to their least corner and paired there.
fn neighbours_of(point_count: usize, corners: &[[u32; 4]]) -> Vec<[u32; 4]> {
    let mut starts = vec![0_u32; point_count + 1];
    for cell in corners {
        for k in 0..4 {
            starts[facet_key(cell, k)[0] as usize + 1] += 1;
        }
    }
    for point in 0..point_count {
        starts[point + 1] += starts[point];
    }
    let mut next = starts.clone();
    let mut dealt = vec![(0_u32, 0_u32, 0_u32); corners.len() * 4];
    for (cell, corners) in corners.iter().enumerate() {
        for k in 0..4 {
            let [first, second, third] = facet_key(corners, k);
            let place = &mut next[first as usize];
            dealt[*place as usize] = (second, third, (cell * 4 + k) as u32);
            *place += 1;
        }
    }
    let mut neighbours = vec![[NONE; 4]; corners.len()];
    for point in 0..point_count {
        let facets = &dealt[starts[point] as usize..starts[point + 1] as usize];
        for (i, a) in facets.iter().enumerate() {
            if let Some(b) = facets[..i].iter().find(|b| (b.0, b.1) == (a.0, a.1)) {
                neighbours[a.2 as usize / 4][a.2 as usize % 4] = b.2 / 4;
                neighbours[b.2 as usize / 4][b.2 as usize % 4] = a.2 / 4;
            }
        }
    }
    neighbours
}
