//! A mesh in parts that are worked on in parallel.
//!
//! Points are halved again and again across their longest side, so that parts depend on places and not on threads. A
//! cell belongs to the lowest-numbered part of its corners. A point with cells in other parts is held, and facets
//! between parts stay. The next pass, which cuts elsewhere, does what was left undone there, and looks at the
//! neighbourhood of held points alone.

use super::shape::shape;
use super::tetrahedra::{NONE, Tetrahedra};
use crate::geometry::{Bounds, Point};
use crate::parallel::prelude::*;
use std::collections::HashSet;

/// The points of a part, about: enough that few are held, few enough for all cores and for a cache. Tests cut small meshes too.
const PART: usize = if cfg!(test) { 60 } else { 12_000 };

/// Cells that one task measures.
const BLOCK: usize = 1 << 13;

/// Where each pass cuts: the share of the points before the cut.
pub(super) const CUTS: [f64; 3] = [0.5, 0.3, 0.64];

/// How many edges from held points the next pass looks.
const LAYERS: usize = 1;

/// The mesh between passes.
pub(super) struct WholeMesh<'a> {
    /// Facets that stay.
    facets: &'a [[u32; 3]],
    /// Whether a point is a corner of one.
    is_on_facet: Vec<bool>,
    pub points: Vec<Point<3>>,
    /// As in [`Tetrahedra`].
    freedom: Vec<u8>,
    sides: Vec<u8>,
    pub corners: Vec<[u32; 4]>,
}

/// A part of the mesh. Its points are numbered anew.
pub(super) struct Part {
    pub tetrahedra: Tetrahedra,
    /// The mesh's number of each point.
    pub points: Vec<u32>,
    /// The points with cells in other parts.
    pub held: Vec<u32>,
    /// Whether every earlier pass has held the point.
    pub is_pending: Vec<bool>,
}

/// The dihedral angles of a mesh.
pub(super) struct Angles {
    /// The greatest cosine.
    worst_cosine: f64,
    /// Cells with a cosine above the limit.
    pub below: usize,
}

impl Angles {
    /// The least angle, in degrees; 0 if a cell is inverted.
    pub fn least(&self) -> f64 {
        self.worst_cosine.clamp(-1.0, 1.0).acos().to_degrees()
    }
}

/// The part of each point, and how many parts there are.
fn parts_of(points: &[Point<3>], cut: f64) -> (Vec<u32>, usize) {
    let levels = (points.len() / PART).checked_ilog2().map_or(0, |l| l + 1);
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let mut part = vec![0; points.len()];
    let mut slices: Vec<&mut [u32]> = vec![&mut order];
    for _ in 0..levels {
        slices = slices.into_iter().flat_map(|slice| halves(points, slice, cut)).collect();
    }
    for (number, slice) in slices.iter().enumerate() {
        slice.iter().for_each(|&i| part[i as usize] = number as u32);
    }
    (part, slices.len())
}

/// Points on the two sides of a cut across their longest side.
fn halves<'a>(points: &[Point<3>], slice: &'a mut [u32], cut: f64) -> [&'a mut [u32]; 2] {
    let mut bounds = Bounds { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };
    slice.iter().for_each(|&i| bounds.include(&points[i as usize]));
    let axis = bounds.longest_axis();
    let middle = (slice.len() as f64 * cut) as usize;
    if middle > 0 && middle < slice.len() {
        slice.select_nth_unstable_by(middle, |&a, &b| {
            points[a as usize][axis].total_cmp(&points[b as usize][axis]).then(a.cmp(&b))
        });
    }
    let (low, high) = slice.split_at_mut(middle);
    [low, high]
}

impl<'a> WholeMesh<'a> {
    /// The mesh as it is given.
    pub fn new(
        points: Vec<Point<3>>,
        freedom: &[u8],
        corners: &[u32],
        bounds: &Bounds<3>,
        facets: &'a [[u32; 3]],
    ) -> Self {
        let mut is_on_facet = vec![false; points.len()];
        facets.iter().flatten().for_each(|&c| is_on_facet[c as usize] = true);
        let sides: Vec<u8> = points.iter().map(|p| bounds.sides(p, 0.0)).collect();
        // whatever the lattice says, a point on a side stays on it
        let freedom = freedom.iter().zip(&points).map(|(f, p)| f & bounds.freedom(p)).collect();
        let corners = corners.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect();
        Self { facets, is_on_facet, points, freedom, sides, corners }
    }

    /// Drops points that no cell has any more.
    pub fn drop_loose_points(&mut self) {
        let mut number = vec![NONE; self.points.len()];
        self.corners.iter().flatten().for_each(|&c| number[c as usize] = 0);
        if !number.contains(&NONE) {
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

    /// The angles of all cells.
    pub fn angles(&self, cosine_limit: f64) -> Angles {
        let of = |cells: &[[u32; 4]]| {
            let mut angles = Angles { worst_cosine: -1.0, below: 0 };
            for cell in cells {
                let [p, q, r, s] = cell.map(|c| self.points[c as usize]);
                let cosine = shape(&p, &q, &r, &s).cosine;
                angles.worst_cosine = angles.worst_cosine.max(cosine);
                angles.below += usize::from(cosine > cosine_limit);
            }
            angles
        };
        let blocks = self.corners.par_chunks(BLOCK).map(of);
        let none = || Angles { worst_cosine: -1.0, below: 0 };
        blocks.reduce(none, |a, b| Angles {
            worst_cosine: a.worst_cosine.max(b.worst_cosine),
            below: a.below + b.below,
        })
    }

    /// The cells of each part, by their numbers; with `pending`, only those within some layers of its points.
    pub fn divide(&self, cut: f64, pending: Option<&[bool]>) -> Vec<Vec<u32>> {
        let (part, count) = parts_of(&self.points, cut);
        let mut cells = vec![Vec::new(); count];
        let near = pending.map(|pending| self.near(pending, LAYERS));
        for (number, corners) in self.corners.iter().enumerate() {
            if near.as_ref().is_none_or(|near| corners.iter().any(|&c| near[c as usize])) {
                let least = corners.iter().map(|&c| part[c as usize]).min().unwrap_or(0);
                cells[least as usize].push(number as u32);
            }
        }
        cells
    }

    /// Points within some edges of the marked ones.
    fn near(&self, marked: &[bool], layers: usize) -> Vec<bool> {
        let mut near = marked.to_vec();
        for _ in 0..layers {
            let before = near.clone();
            for corners in &self.corners {
                if corners.iter().any(|&c| before[c as usize]) {
                    corners.iter().for_each(|&c| near[c as usize] = true);
                }
            }
        }
        near
    }

    /// How many cells each point has.
    pub fn valences(&self) -> Vec<u32> {
        let mut valences = vec![0; self.points.len()];
        self.corners.iter().flatten().for_each(|&c| valences[c as usize] += 1);
        valences
    }

    /// The part made of some cells. A point with fewer cells here than `valences` says is held. `local` has
    /// [`NONE`] for every point, before and after.
    pub fn part(
        &self,
        cells: &[u32],
        valences: &[u32],
        pending: Option<&[bool]>,
        local: &mut [u32],
    ) -> Part {
        let mut points = Vec::new();
        let corners: Vec<[u32; 4]> = (cells.iter())
            .map(|&cell| {
                self.corners[cell as usize].map(|corner| {
                    let number = &mut local[corner as usize];
                    if *number == NONE {
                        *number = points.len() as u32;
                        points.push(corner);
                    }
                    *number
                })
            })
            .collect();
        let held_facets = self.held_facets(cells, local);
        points.iter().for_each(|&point| local[point as usize] = NONE);
        let mut missing: Vec<u32> = points.iter().map(|&p| valences[p as usize]).collect();
        corners.iter().flatten().for_each(|&c| missing[c as usize] -= 1);
        let mut freedom: Vec<u8> = points.iter().map(|&p| self.freedom[p as usize]).collect();
        let mut held = Vec::new();
        for (point, &missing) in missing.iter().enumerate() {
            if missing > 0 {
                freedom[point] = 0;
                held.push(point as u32);
            }
        }
        let at = points.iter().map(|&p| self.points[p as usize]).collect();
        let sides = points.iter().map(|&p| self.sides[p as usize]).collect();
        let was_held = |&p: &u32| pending.is_none_or(|pending| pending[p as usize]);
        let is_pending = points.iter().map(was_held).collect();
        Part {
            tetrahedra: Tetrahedra::new(at, freedom, sides, corners, &held_facets),
            points,
            held,
            is_pending,
        }
    }

    /// The facets of some cells that stay, by the numbers of a part, corners ascending.
    fn held_facets(&self, cells: &[u32], local: &[u32]) -> HashSet<[u32; 3]> {
        let mut found = HashSet::new();
        if self.facets.is_empty() {
            return found;
        }
        for &cell in cells {
            let corners = &self.corners[cell as usize];
            for k in 0..4 {
                let mut facet = [1, 2, 3].map(|n| corners[(k + n) & 3]);
                if facet.iter().all(|&c| self.is_on_facet[c as usize]) {
                    facet.sort_unstable();
                    if self.facets.binary_search(&facet).is_ok() {
                        let mut own = facet.map(|c| local[c as usize]);
                        own.sort_unstable();
                        found.insert(own);
                    }
                }
            }
        }
        found
    }

    /// Takes the cells and points of parts back, in place of the cells that they were made of.
    pub fn take_back(&mut self, parts: &[Part], divided: &[Vec<u32>]) {
        divided.iter().flatten().for_each(|&cell| self.corners[cell as usize][0] = NONE);
        let mut dead = divided.iter().flatten().copied();
        for part in parts {
            for (&point, at) in part.points.iter().zip(&part.tetrahedra.points) {
                self.points[point as usize] = *at;
            }
            for cell in part.tetrahedra.cells() {
                let corners = cell.map(|c| part.points[c as usize]);
                match dead.next() {
                    Some(slot) => self.corners[slot as usize] = corners,
                    None => self.corners.push(corners),
                }
            }
        }
        self.corners.retain(|c| c[0] != NONE);
    }
}
