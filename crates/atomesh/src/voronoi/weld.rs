//! Merging the ends of short edges, and numbering points and faces.

use crate::parallel::prelude::*;

use super::clip::{Cut, of_side, side_of};
use super::dual::{Domain, NONE};
use crate::geometry::{Point, Sets, distance_squared};
use crate::mesh::{PolyFault, PolyMesh, PolyParts};

/// Loops that one task looks at.
const BLOCK: usize = 1 << 12;

/// A face before it is numbered: its cells, as in [`super::dual::Loops`], and the range of its corners.
struct Face {
    cells: [u32; 2],
    start: usize,
    end: usize,
}

/// Faces, and the corners that they name.
#[derive(Default)]
struct Faces {
    corners: Vec<u32>,
    faces: Vec<Face>,
}

impl Faces {
    fn push(&mut self, corners: &[u32], cells: [u32; 2]) {
        let start = self.corners.len();
        self.corners.extend_from_slice(corners);
        self.faces.push(Face { cells, start, end: self.corners.len() });
    }
}

/// The mesh of the complex within the box.
///
/// # Errors
/// [`PolyFault`] if a cell is not closed or has no measure.
pub(super) fn weld<const D: usize>(
    cut: Cut<D>,
    sites: &[Point<D>],
    domain: &Domain<D>,
) -> Result<PolyMesh<D>, PolyFault> {
    let mut loops: Vec<(&[u32], [u32; 2])> = cut.inner.iter().collect();
    loops.extend(cut.rim.iter().map(|rim| (rim.corners.as_slice(), rim.cells)));
    let mut points = cut.points;
    let mut sides = cut.sides;
    let vertex_of = merge_short_edges(&mut points, &mut sides, &loops, domain);
    let mut whole = Faces::default();
    let mut parts = Vec::new();
    for (corners, cells) in loops {
        parts.clear();
        simple_loops(corners.iter().map(|&c| vertex_of[c as usize]).collect(), &mut parts);
        parts.iter().for_each(|corners| whole.push(corners, cells));
    }
    let faces = if D == 2 { edges_of_polygons::<D>(&whole, &sides)? } else { whole };
    if let Some(face) = faces.faces.iter().find(|f| f.cells[0] as usize >= sites.len()) {
        return Err(PolyFault::Open { cell: face.cells[1] as usize });
    }
    into_mesh(faces, &points, sites)
}

/// Merges the ends of edges shorter than the tolerance; returns the point that each point became. Of merged points the
/// one on most sides of the box stays, and is put on the sides of all.
fn merge_short_edges<const D: usize>(
    points: &mut [Point<D>],
    sides: &mut [u8],
    loops: &[(&[u32], [u32; 2])],
    domain: &Domain<D>,
) -> Vec<u32> {
    let limit = domain.tolerance.powi(2);
    let short = |corners: &[u32]| -> Vec<[u32; 2]> {
        let edges = (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]]);
        edges
            .filter(|[a, b]| distance_squared(&points[*a as usize], &points[*b as usize]) <= limit)
            .collect()
    };
    let found: Vec<Vec<[u32; 2]>> = loops
        .par_chunks(BLOCK)
        .map(|part| part.iter().flat_map(|(corners, _)| short(corners)).collect())
        .collect();
    let mut sets = Sets::new(points.len());
    for [a, b] in found.into_iter().flatten() {
        sets.join(a, b);
    }
    let mut keeper: Vec<u32> = (0..points.len() as u32).collect();
    let mut moved = Vec::new();
    for point in 0..points.len() as u32 {
        let root = sets.root(point);
        if root != point {
            moved.push((root, point));
            let known = &mut keeper[root as usize];
            if sides[point as usize].count_ones() > sides[*known as usize].count_ones() {
                *known = point;
            }
        }
    }
    for &(root, point) in &moved {
        for member in [root, point] {
            let (kept, on) = (keeper[root as usize] as usize, sides[member as usize]);
            for side in (0..2 * D).filter(|s| on & !sides[kept] & 1 << s != 0) {
                points[kept][side / 2] = points[member as usize][side / 2];
            }
            sides[kept] |= on;
        }
    }
    let mut vertex_of = keeper.clone();
    for (root, point) in moved {
        vertex_of[point as usize] = keeper[root as usize];
    }
    vertex_of
}

/// Appends the simple loops of three corners or more within a loop. Edges run through in both directions cancel.
fn simple_loops(mut corners: Vec<u32>, found: &mut Vec<Vec<u32>>) {
    let mut kept: Vec<u32> = Vec::with_capacity(corners.len());
    for corner in corners.drain(..) {
        if kept.last() == Some(&corner) {
            continue;
        }
        if kept.len() > 1 && kept[kept.len() - 2] == corner {
            kept.pop();
            continue;
        }
        kept.push(corner);
    }
    let (mut start, mut end) = (0, kept.len());
    while end - start > 1 {
        if kept[start] == kept[end - 1] {
            end -= 1;
        } else if end - start > 2 && kept[start + 1] == kept[end - 1] {
            start += 1;
        } else if end - start > 2 && kept[start] == kept[end - 2] {
            end -= 1;
        } else {
            break;
        }
    }
    let kept = &kept[start..end];
    if kept.len() < 3 {
        return;
    }
    for (at, corner) in kept.iter().enumerate() {
        if let Some(gap) = kept[at + 1..].iter().position(|c| c == corner) {
            simple_loops(kept[at..=at + gap].to_vec(), found);
            simple_loops([&kept[..at], &kept[at + gap + 1..]].concat(), found);
            return;
        }
    }
    found.push(kept.to_vec());
}

/// The edges of polygons (2-D), as faces between them.
fn edges_of_polygons<const D: usize>(polygons: &Faces, sides: &[u8]) -> Result<Faces, PolyFault> {
    // ends ascending, then the cell, then whether the cell's loop runs from the higher to the lower
    let mut all: Vec<(u32, u32, u32, bool)> = Vec::with_capacity(polygons.corners.len());
    for face in &polygons.faces {
        let corners = &polygons.corners[face.start..face.end];
        for at in 0..corners.len() {
            let (a, b) = (corners[at], corners[(at + 1) % corners.len()]);
            all.push((a.min(b), a.max(b), face.cells[0], a > b));
        }
    }
    all.par_sort_unstable();
    let mut faces = Faces::default();
    for edge in all.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let (low, high, cell, down) = edge[0];
        let corners = if down { [high, low] } else { [low, high] };
        let both = sides[low as usize] & sides[high as usize];
        let other = match edge {
            [_] if both != 0 => of_side(both.trailing_zeros() as usize),
            [a, b] if a.3 != b.3 => b.2,
            _ => return Err(PolyFault::Open { cell: cell as usize }),
        };
        if cell != other {
            faces.push(&corners, [cell, other]);
        }
    }
    Ok(faces)
}

/// The mesh of these faces. Points are numbered by their first face; faces inside come first, by owner and neighbour,
/// then those of side after side.
fn into_mesh<const D: usize>(
    faces: Faces,
    points: &[Point<D>],
    sites: &[Point<D>],
) -> Result<PolyMesh<D>, PolyFault> {
    let Faces { corners, mut faces } = faces;
    let key = |face: &Face| match side_of::<D>(face.cells[1]) {
        Some(side) => (side as u32 + 1, face.cells[0], 0),
        None => (0, face.cells[0], face.cells[1]),
    };
    faces.par_sort_by_key(key);
    let mut parts = PolyParts { sites: Some(sites.to_vec()), ..PolyParts::default() };
    let mut new_number = vec![NONE; points.len()];
    for face in &faces {
        for &corner in &corners[face.start..face.end] {
            let number = &mut new_number[corner as usize];
            if *number == NONE {
                *number = parts.points.len() as u32;
                parts.points.push(points[corner as usize]);
            }
            parts.corners.push(*number);
        }
        parts.ends.push(parts.corners.len());
        parts.owners.push(face.cells[0]);
        match side_of::<D>(face.cells[1]) {
            Some(side) => parts.side_counts[side] += 1,
            None if (face.cells[1] as usize) < sites.len() => parts.neighbours.push(face.cells[1]),
            None => return Err(PolyFault::Open { cell: face.cells[0] as usize }),
        }
    }
    PolyMesh::new(parts)
}
