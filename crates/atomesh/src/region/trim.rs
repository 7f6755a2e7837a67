//! Dropping what lies outside of a mask's outline.
//!
//! Assumes a mesh whose points near the outline are on it. Edges that still cross it are split there: each
//! cell splits its longest crossing edge first, then those of its parts, so that neighbours split their
//! common facets alike. Then no cell has corners on both sides: cells with a corner inside stay, those with one
//! outside go, and those with all corners on the outline stay if their centroid is inside. Last, cells are dropped
//! until the boundary is a manifold ([`super::manifold`]). Cost: O(cells).

use crate::parallel::prelude::*;

use crate::geometry::{Bounds, Point, distance_squared};
use crate::mesh::Mesh;
use crate::watch::{Phase, Watch, check};

use super::manifold::until_manifold;
use super::{Outline, RegionError};

/// A point counts as on the outline if an edge from it crosses the outline within this share of its length.
const AT_END: f64 = 0.1;

/// The part of a mesh inside of an outline.
#[derive(Clone, Debug, PartialEq)]
pub struct Trimmed<const D: usize> {
    /// The cells, and the points that they need.
    pub mesh: Mesh<D>,
    /// The axes along which the box lets each point move, as bits.
    pub freedom: Vec<u8>,
    /// The facets on the outline, in the order of their cells, normals outward (see [`Mesh::facet_of`]); those
    /// on the box's sides are left out.
    pub facets: Vec<[u32; D]>,
}

impl<const D: usize> Trimmed<D> {
    /// For each point, whether it is a corner of a facet on the outline.
    pub fn on_outline(&self) -> Vec<bool> {
        let mut on = vec![false; self.mesh.points().len()];
        self.facets.iter().flatten().for_each(|&p| on[p as usize] = true);
        on
    }
}

/// The part of a mesh inside of `outline`. `on_outline` says which points are on it; `freedom` along which axes the
/// box lets each point move, as bits.
///
/// # Errors
/// [`RegionError::SmallMask`] if no cell is inside, [`RegionError::Cancelled`].
pub fn trim_to_outline<const D: usize>(
    mesh: Mesh<D>,
    on_outline: &[bool],
    freedom: &[u8],
    outline: &Outline<D>,
    watch: &mut dyn Watch,
) -> Result<Trimmed<D>, RegionError> {
    check(watch, Phase::Connect, 0.5, None)?;
    let place = mesh.points().par_iter().zip(on_outline);
    let place = place.map(|(p, &on)| match (on, outline.is_inside(p)) {
        (true, _) => Place::On,
        (false, true) => Place::Inside,
        (false, false) => Place::Outside,
    });
    let (place, freedom) = (place.collect(), freedom.to_vec());
    let (points, corners) = mesh.into_parts();
    let mut cutting = Cutting { points, place, freedom };
    let corners = cutting.cut(corners, outline);
    check(watch, Phase::Connect, 0.7, None)?;
    let Cutting { points, place, freedom } = cutting;
    let candidates = corners.chunks_exact(D + 1).filter(|cell| {
        let at = |c: &u32| place[*c as usize];
        cell.iter().all(|c| at(c) != Place::Outside)
    });
    let corners: Vec<u32> = candidates.flatten().copied().collect();
    let mesh = Mesh::new(points, corners)?;
    let on: Vec<bool> = mesh.cells().map(|c| all_on(c, &place)).collect();
    let peelable = (mesh.cells().zip(&on))
        .map(|(cell, &on)| on && !has_facet_on_side(&mesh, cell, outline.bounds()))
        .collect();
    let kept: Vec<bool> = (mesh.cells().zip(&on))
        .map(|(cell, on)| !on || outline.is_inside(&centroid(&mesh, cell)))
        .collect();
    if !kept.contains(&true) {
        return Err(RegionError::SmallMask { distance: outline.least_distance() });
    }
    let kept = until_manifold(&mesh, peelable, kept);
    compact(&mesh, &freedom, &kept, outline.bounds())
        .ok_or(RegionError::SmallMask { distance: outline.least_distance() })
}

fn all_on(cell: &[u32], place: &[Place]) -> bool {
    cell.iter().all(|&c| place[c as usize] == Place::On)
}

fn centroid<const D: usize>(mesh: &Mesh<D>, cell: &[u32]) -> Point<D> {
    std::array::from_fn(|k| {
        cell.iter().map(|&c| mesh.points()[c as usize][k]).sum::<f64>() / (D + 1) as f64
    })
}

/// Whether points lie on one side of the box.
fn is_on_side<const D: usize>(mesh: &Mesh<D>, points: &[u32], bounds: &Bounds<D>) -> bool {
    let sides = points.iter().map(|&c| bounds.sides(&mesh.points()[c as usize], 0.0));
    sides.fold(!0, |shared, sides| shared & sides) != 0
}

fn has_facet_on_side<const D: usize>(mesh: &Mesh<D>, cell: &[u32], bounds: &Bounds<D>) -> bool {
    (0..cell.len()).any(|skip| {
        let facet: [u32; D] = std::array::from_fn(|k| cell[k + usize::from(k >= skip)]);
        is_on_side(mesh, &facet, bounds)
    })
}

/// Where a point is, seen from the outline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Inside,
    On,
    Outside,
}

/// A mesh whose edges are cut at the outline.
struct Cutting<const D: usize> {
    points: Vec<Point<D>>,
    place: Vec<Place>,
    freedom: Vec<u8>,
}

/// An edge that crosses the outline: its ends, ascending; its rank, longest first; its new point.
struct Cut {
    ends: [u32; 2],
    rank: u32,
    point: u32,
}

impl<const D: usize> Cutting<D> {
    /// Splits all cells so that none has corners on both sides.
    fn cut(&mut self, corners: Vec<u32>, outline: &Outline<D>) -> Vec<u32> {
        let found = self.crossing_edges(&corners);
        let crossings = self.crossings(&found, outline);
        for ([a, b], p) in found.iter().zip(&crossings) {
            for end in [*a, *b] {
                let from = &self.points[end as usize];
                let whole = distance_squared(&self.points[*a as usize], &self.points[*b as usize]);
                if distance_squared(from, p) < AT_END * AT_END * whole {
                    self.place[end as usize] = Place::On;
                }
            }
        }
        let cuts = self.cuts(&found, &crossings);
        let mut parts = Vec::with_capacity(corners.len() + corners.len() / 4);
        for cell in corners.chunks_exact(D + 1) {
            split(cell, &cuts, &mut parts);
        }
        parts
    }

    /// The edges with one end inside and one outside, ascending.
    fn crossing_edges(&self, corners: &[u32]) -> Vec<[u32; 2]> {
        let mut edges = Vec::new();
        for cell in corners.chunks_exact(D + 1) {
            for (i, &a) in cell.iter().enumerate() {
                for &b in &cell[i + 1..] {
                    if self.crosses([a, b]) {
                        edges.push([a.min(b), a.max(b)]);
                    }
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    fn crosses(&self, [a, b]: [u32; 2]) -> bool {
        let (a, b) = (self.place[a as usize], self.place[b as usize]);
        a != b && a != Place::On && b != Place::On
    }

    fn crossings(&self, edges: &[[u32; 2]], outline: &Outline<D>) -> Vec<Point<D>> {
        let crossing = |&[a, b]: &[u32; 2]| {
            let inside = self.place[a as usize] == Place::Inside;
            let (p, q) = if inside { (a, b) } else { (b, a) };
            outline.crossing(&self.points[p as usize], &self.points[q as usize])
        };
        edges.par_iter().map(crossing).collect()
    }

    /// The edges that still cross, with a new point on each.
    fn cuts(&mut self, edges: &[[u32; 2]], crossings: &[Point<D>]) -> Vec<Cut> {
        let mut cuts = Vec::new();
        let mut lengths = Vec::new();
        for (&ends, p) in edges.iter().zip(crossings) {
            if !self.crosses(ends) {
                continue;
            }
            let [a, b] = ends.map(|e| e as usize);
            lengths.push(distance_squared(&self.points[a], &self.points[b]));
            cuts.push(Cut { ends, rank: 0, point: self.points.len() as u32 });
            self.points.push(*p);
            self.place.push(Place::On);
            let ends = [&self.points[a], &self.points[b]];
            let free = free_axes(ends, [self.freedom[a], self.freedom[b]]);
            self.freedom.push(free);
        }
        let mut order: Vec<usize> = (0..cuts.len()).collect();
        order.sort_by(|&a, &b| lengths[b].total_cmp(&lengths[a]).then(a.cmp(&b)));
        for (rank, &cut) in order.iter().enumerate() {
            cuts[cut].rank = rank as u32;
        }
        cuts
    }
}

/// The axes, as bits, along which a point between two others may move: all but those along which the box holds both
/// at one place.
pub(crate) fn free_axes<const D: usize>(ends: [&Point<D>; 2], freedom: [u8; 2]) -> u8 {
    (0..D)
        .filter(|k| (freedom[0] | freedom[1]) >> k & 1 == 1 || ends[0][*k] != ends[1][*k])
        .map(|k| 1 << k)
        .sum()
}

/// Appends the parts into which its cut edges divide a cell, the cut of least rank made first.
fn split(cell: &[u32], cuts: &[Cut], parts: &mut Vec<u32>) {
    let mut first: Option<(&Cut, usize, usize)> = None;
    for i in 0..cell.len() {
        for j in i + 1..cell.len() {
            let ends = [cell[i].min(cell[j]), cell[i].max(cell[j])];
            if let Ok(at) = cuts.binary_search_by(|cut| cut.ends.cmp(&ends))
                && first.is_none_or(|(cut, ..)| cuts[at].rank < cut.rank)
            {
                first = Some((&cuts[at], i, j));
            }
        }
    }
    let Some((cut, i, j)) = first else {
        parts.extend_from_slice(cell);
        return;
    };
    for end in [i, j] {
        let mut part = [0; 4];
        let part = &mut part[..cell.len()];
        part.copy_from_slice(cell);
        part[end] = cut.point;
        split(part, cuts, parts);
    }
}

/// The kept cells with the points that they need, and the facets that are on no side of the box; `None` if no cell
/// is kept.
fn compact<const D: usize>(
    mesh: &Mesh<D>,
    freedom: &[u8],
    kept: &[bool],
    bounds: &Bounds<D>,
) -> Option<Trimmed<D>> {
    let cells: Vec<u32> = (mesh.cells().zip(kept))
        .filter(|(_, kept)| **kept)
        .flat_map(|(cell, _)| cell.iter().copied())
        .collect();
    let mut used = vec![false; mesh.points().len()];
    cells.iter().for_each(|&c| used[c as usize] = true);
    let mut number = vec![u32::MAX; used.len()];
    let (mut points, mut free) = (Vec::new(), Vec::new());
    for i in (0..used.len()).filter(|&i| used[i]) {
        number[i] = points.len() as u32;
        points.push(mesh.points()[i]);
        free.push(freedom[i]);
    }
    let corners: Vec<u32> = cells.iter().map(|&c| number[c as usize]).collect();
    let mesh = Mesh::new(points, corners).ok().filter(|mesh| mesh.cell_count() > 0)?;
    let facets = outline_facets(&mesh, bounds);
    Some(Trimmed { mesh, freedom: free, facets })
}

/// The facets on a mask's outline: those of the hull that are on no side of the box (which [`Tags::sides`] groups), in
/// the order of their cells, normals outward (see [`Mesh::facet_of`]).
///
/// [`Tags::sides`]: crate::mesh::Tags::sides
pub fn outline_facets<const D: usize>(mesh: &Mesh<D>, bounds: &Bounds<D>) -> Vec<[u32; D]> {
    let mut found: Vec<(u32, [u32; D])> = Vec::new();
    for facet in mesh.facets().iter().filter(|facet| facet.neighbour.is_none()) {
        if !is_on_side(mesh, &facet.corners, bounds)
            && let Some(outward) = mesh.facet_out_of(facet.cell, &facet.corners)
        {
            found.push((facet.cell, outward));
        }
    }
    found.sort_unstable();
    found.into_iter().map(|(_, corners)| corners).collect()
}
