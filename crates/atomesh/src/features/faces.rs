//! The faces of polygons and polyhedra that lie on features of the image.
//!
//! Where features are known as pieces of crests ([`faces_of_pieces`]), those of a piece are the faces between cells whose
//! centres lie on its two sides: a sheet that ends only where the piece does. Else they are those along which |b| is
//! large ([`feature_faces`]).

use crate::parallel::prelude::*;

use super::across::{Between, across};
use crate::crests::Pieces;
use crate::fields::{NominalDistance, ScalarField};
use crate::geometry::{Point, Sets, difference, dot};
use crate::mesh::{PolyMesh, area_vector};

/// Faces that one task looks at.
const BLOCK: usize = 1 << 10;

/// Faces on features, in connected groups.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FeatureFaces {
    /// For each face the number of its feature, from 1 on in the order of falling area, or 0.
    pub of_faces: Vec<u32>,
    /// The mean of |b| over each face.
    pub strengths: Vec<f32>,
    /// The area of each feature's faces, from feature 1 on.
    pub areas: Vec<f64>,
}

/// A face lies along a feature if, halfway to the centres of the two cells, the mean of |b| falls to this share.
const FALL: f64 = 0.9;

/// Finds the faces inside the box that lie along features, in groups that share edges (2-D: points).
///
/// The mean of |b| over such a face is `least` or more, and it falls where the face is moved toward its two cells'
/// centres: a face across a feature is none. Faces of as much |b| that close a gap between others are added. |b| counts
/// because b is negated where faces, rather than atoms, are to lie on features. Groups smaller than `least_area` are
/// left out. The mesh is in lattice coordinates. Means are taken at points at most a sample apart.
pub fn feature_faces<const D: usize>(
    mesh: &PolyMesh<D>,
    potential: &ScalarField<D>,
    least: f64,
    least_area: f64,
) -> FeatureFaces {
    let step = potential.grid().least_step();
    let faces = (0..mesh.inner_face_count()).into_par_iter().with_min_len(BLOCK);
    let (strengths, mut along): (Vec<f32>, Vec<bool>) = faces
        .map(|face| {
            let strength = strength(mesh, potential, face, [0.0; D], step);
            (strength as f32, strength >= least && is_along(mesh, potential, face, strength, step))
        })
        .unzip();
    let is_strong = |face: usize| f64::from(strengths[face]) >= least;
    close_gaps(mesh, &mut along, is_strong);
    let chosen: Vec<usize> = (0..along.len()).filter(|&face| along[face]).collect();
    let mut sets = connected(mesh, &chosen);
    let mut area_of = vec![0.0; chosen.len()];
    for (index, &face) in chosen.iter().enumerate() {
        let vector = mesh.area_vector(face);
        area_of[sets.root(index as u32) as usize] += dot(&vector, &vector).sqrt();
    }
    let mut roots: Vec<usize> = (0..chosen.len())
        .filter(|&index| sets.root(index as u32) as usize == index && area_of[index] >= least_area)
        .collect();
    roots.sort_by(|&a, &b| area_of[b].total_cmp(&area_of[a]).then(a.cmp(&b)));
    let mut number = vec![0; chosen.len()];
    roots.iter().enumerate().for_each(|(n, &root)| number[root] = n as u32 + 1);
    let mut of_faces = vec![0; mesh.face_count()];
    for (index, &face) in chosen.iter().enumerate() {
        of_faces[face] = number[sets.root(index as u32) as usize];
    }
    let areas = roots.iter().map(|&root| area_of[root]).collect();
    FeatureFaces { of_faces, strengths, areas }
}

/// The faces between two cells.
pub fn between_cells<const D: usize>(mesh: &PolyMesh<D>) -> Vec<Between<D>> {
    let of = |face: usize| Between {
        cells: [mesh.owners()[face], mesh.neighbours()[face]],
        middle: mesh.face_centroid(face),
    };
    (0..mesh.inner_face_count()).map(of).collect()
}

/// Finds the faces inside the box between cells whose centres lie on two sides of a piece, within the piece.
///
/// Each piece is a feature; a face of several is the strongest's. `potential` serves for [`FeatureFaces::strengths`]
/// alone. Mesh and pieces are in lattice coordinates.
pub fn faces_of_pieces<const D: usize>(
    mesh: &PolyMesh<D>,
    pieces: &Pieces<D>,
    distance: &NominalDistance<D>,
    potential: &ScalarField<D>,
) -> FeatureFaces {
    let facets = between_cells(mesh);
    let of_faces = across(mesh.centers(), &facets, pieces, distance);
    let of_faces: Vec<Option<u32>> =
        of_faces.into_iter().map(|across| across.map(|across| across.piece)).collect();
    let step = potential.grid().least_step();
    let faces = (0..mesh.inner_face_count()).into_par_iter().with_min_len(BLOCK);
    let strengths = faces.map(|face| strength(mesh, potential, face, [0.0; D], step) as f32);
    let mut area_of = vec![0.0; pieces.len()];
    for (face, piece) in of_faces.iter().enumerate() {
        let vector = mesh.area_vector(face);
        if let Some(piece) = piece {
            area_of[*piece as usize] += dot(&vector, &vector).sqrt();
        }
    }
    let mut order: Vec<usize> = (0..pieces.len()).filter(|&piece| area_of[piece] > 0.0).collect();
    order.sort_by(|&a, &b| area_of[b].total_cmp(&area_of[a])); // stable
    let mut number = vec![0; pieces.len()];
    order.iter().zip(1..).for_each(|(&piece, n)| number[piece] = n);
    let mut numbers: Vec<u32> =
        of_faces.iter().map(|piece| piece.map_or(0, |piece| number[piece as usize])).collect();
    numbers.resize(mesh.face_count(), 0);
    FeatureFaces {
        of_faces: numbers,
        strengths: strengths.collect(),
        areas: order.into_iter().map(|piece| area_of[piece]).collect(),
    }
}

/// The chosen faces in sets that share edges, each by its place among them.
fn connected<const D: usize>(mesh: &PolyMesh<D>, chosen: &[usize]) -> Sets {
    // an edge of a chosen face by its ends, and the face's place among the chosen
    let mut ridges: Vec<(u32, u32, u32)> = Vec::new();
    for (index, &face) in chosen.iter().enumerate() {
        ridges.extend(ridges_of(mesh, face).map(|(a, b)| (a, b, index as u32)));
    }
    ridges.sort_unstable();
    let mut sets = Sets::new(chosen.len());
    for ridge in ridges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        ridge.windows(2).for_each(|pair| sets.join(pair[0].2, pair[1].2));
    }
    sets
}

/// The edges of a face by their ends, the lesser first (2-D: its two points, each twice).
fn ridges_of<const D: usize>(
    mesh: &PolyMesh<D>,
    face: usize,
) -> impl ExactSizeIterator<Item = (u32, u32)> + '_ {
    let corners = mesh.face(face);
    (0..corners.len()).map(move |at| {
        let a = corners[at];
        let b = if D == 2 { a } else { corners[(at + 1) % corners.len()] };
        (a.min(b), a.max(b))
    })
}

/// Also chooses strong faces of which half the edges, at least two (2-D: both ends), are edges of chosen faces. A face
/// across a feature has only one there.
fn close_gaps<const D: usize>(
    mesh: &PolyMesh<D>,
    chosen: &mut [bool],
    is_strong: impl Fn(usize) -> bool,
) {
    let faces = |wanted: bool, chosen: &[bool]| -> Vec<usize> {
        (0..chosen.len()).filter(|&face| chosen[face] == wanted).collect()
    };
    let mut ridges: Vec<(u32, u32)> =
        faces(true, chosen).iter().flat_map(|&face| ridges_of(mesh, face)).collect();
    ridges.sort_unstable();
    for face in faces(false, chosen).into_iter().filter(|&face| is_strong(face)) {
        let edges = ridges_of(mesh, face);
        let (count, held) =
            (edges.len(), edges.filter(|e| ridges.binary_search(e).is_ok()).count());
        chosen[face] = held >= count.div_ceil(2).max(2);
    }
}

/// Whether |b| falls from the face toward the two cells.
fn is_along<const D: usize>(
    mesh: &PolyMesh<D>,
    potential: &ScalarField<D>,
    face: usize,
    strength: f64,
    step: f64,
) -> bool {
    let [owner, neighbour] =
        [mesh.owners()[face], mesh.neighbours()[face]].map(|cell| mesh.centers()[cell as usize]);
    let half = difference(&neighbour, &owner).map(|x| 0.5 * x);
    let moved = |shift: Point<D>| self::strength(mesh, potential, face, shift, step);
    0.5 * (moved(half) + moved(half.map(|x| -x))) <= FALL * strength
}

/// The mean of |b| over a face that is moved by `shift`; values outside the image are those at its border.
fn strength<const D: usize>(
    mesh: &PolyMesh<D>,
    potential: &ScalarField<D>,
    face: usize,
    shift: Point<D>,
    step: f64,
) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for mut simplex in mesh.face_simplices(face) {
        simplex.iter_mut().flatten().zip(shift.iter().cycle()).for_each(|(x, w)| *x += w);
        let part = area_vector(&simplex);
        let area = dot(&part, &part).sqrt();
        sum += area * mean(potential, &simplex, step);
        total += area;
    }
    if total > 0.0 { sum / total } else { 0.0 }
}

/// The mean of |b| over a segment or triangle, at the middles of equal parts.
fn mean<const D: usize>(potential: &ScalarField<D>, simplex: &[Point<D>; D], step: f64) -> f64 {
    let side = |k: usize| {
        let v = difference(&simplex[k], &simplex[0]);
        dot(&v, &v).sqrt()
    };
    let longest = (1..D).map(side).fold(0.0, f64::max);
    let parts = ((longest / step).ceil() as usize).clamp(1, 64);
    let at = |shares: [f64; 2]| {
        let p = std::array::from_fn(|k| {
            let along = |n: usize| shares[n - 1] * (simplex[n][k] - simplex[0][k]);
            simplex[0][k] + (1..D).map(along).sum::<f64>()
        });
        potential.value(&p).abs()
    };
    let cells = parts as f64;
    if D == 2 {
        return (0..parts).map(|i| at([(i as f64 + 0.5) / cells, 0.0])).sum::<f64>() / cells;
    }
    let mut sum = 0.0;
    for i in 0..parts {
        for j in 0..parts - i {
            let middle = |n: usize, third: f64| (n as f64 + third) / cells;
            sum += at([middle(i, 1.0 / 3.0), middle(j, 1.0 / 3.0)]);
            if i + j + 1 < parts {
                sum += at([middle(i, 2.0 / 3.0), middle(j, 2.0 / 3.0)]);
            }
        }
    }
    sum / (cells * cells)
}
