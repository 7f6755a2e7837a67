//! Which faces lie on features of the image.

use rayon::prelude::*;

use super::poly_mesh::PolyMesh;
use crate::geometry::{Point, Sets, difference, dot};
use crate::potential::ImagePotential;

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

/// Finds the faces inside the box on which |b| is `least` or more in the mean, grouped by shared edges (2-D:
/// points). |b|, since b is negated where atoms are to line up alongside features and faces to fall on them.
/// Groups smaller than `least_area` are left out. The mesh is in lattice coordinates. The mean is taken at points
/// at most a sample apart.
pub fn feature_faces<const D: usize>(
    mesh: &PolyMesh<D>,
    potential: &ImagePotential<D>,
    least: f64,
    least_area: f64,
) -> FeatureFaces {
    let step = potential.grid().least_step();
    let faces = (0..mesh.inner_face_count()).into_par_iter().with_min_len(BLOCK);
    let strengths: Vec<f32> = faces.map(|face| strength(mesh, potential, face, step)).collect();
    let chosen: Vec<usize> =
        (0..strengths.len()).filter(|&face| f64::from(strengths[face]) >= least).collect();
    let mut ridges: Vec<(u32, u32, u32)> = Vec::new();
    for (index, &face) in chosen.iter().enumerate() {
        let corners = mesh.face(face);
        for at in 0..corners.len() {
            let a = corners[at];
            let b = if D == 2 { a } else { corners[(at + 1) % corners.len()] };
            ridges.push((a.min(b), a.max(b), index as u32));
        }
    }
    ridges.sort_unstable();
    let mut sets = Sets::new(chosen.len());
    for ridge in ridges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        ridge.windows(2).for_each(|pair| sets.join(pair[0].2, pair[1].2));
    }
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

/// The mean of |b| over a face.
fn strength<const D: usize>(
    mesh: &PolyMesh<D>,
    potential: &ImagePotential<D>,
    face: usize,
    step: f64,
) -> f32 {
    let (mut sum, mut total) = (0.0, 0.0);
    for simplex in mesh.simplices(face) {
        let part = super::poly_mesh::area_vector(&simplex);
        let area = dot(&part, &part).sqrt();
        sum += area * mean(potential, &simplex, step);
        total += area;
    }
    if total > 0.0 { (sum / total) as f32 } else { 0.0 }
}

/// The mean of |b| over a segment or triangle, at the middles of equal parts.
fn mean<const D: usize>(potential: &ImagePotential<D>, simplex: &[Point<D>; D], step: f64) -> f64 {
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
