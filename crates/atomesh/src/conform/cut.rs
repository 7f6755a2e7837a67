//! The cells that features pass through.

use crate::parallel::prelude::*;

use crate::crests::Pieces;
use crate::fields::NominalDistance;
use crate::mesh::Mesh;

use super::recover::{crossing_place, heights};

/// A corner within this of a piece is on it, in mean steps.
const ON: f64 = 0.1;

/// The cells that a piece passes through, ascending: they have corners farther than 0.1 sample on both sides of it, and
/// it reaches to an edge between two of these. The mesh is in lattice coordinates.
pub fn cut_cells<const D: usize>(
    mesh: &Mesh<D>,
    pieces: &Pieces<D>,
    distance: &NominalDistance<D>,
) -> Vec<u32> {
    let points = mesh.points();
    let heights = heights(points, pieces, distance);
    let on = ON * pieces.step();
    let crosses = |a: u32, b: u32| {
        let [of_a, of_b] = [a, b].map(|end| &heights[end as usize]);
        of_a.iter().any(|&(piece, first)| {
            let Some(&(_, second)) = of_b.iter().find(|(other, _)| *other == piece) else {
                return false;
            };
            let is_between = first * second < 0.0 && first.abs().min(second.abs()) > on;
            let ends = [a, b].map(|end| &points[end as usize]);
            is_between && crossing_place(ends, [first, second], piece, pieces).is_some()
        })
    };
    let is_cut = |cell: &u32| {
        let first = *cell as usize * (D + 1);
        let corners = &mesh.corners()[first..first + D + 1];
        (1..=D).any(|i| (0..i).any(|k| crosses(corners[k], corners[i])))
    };
    (0..mesh.cell_count() as u32).into_par_iter().with_min_len(1 << 8).filter(is_cut).collect()
}
