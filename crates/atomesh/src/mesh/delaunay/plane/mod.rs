//! Triangles, by the crate `spade`.
//!
//! Points are inserted one by one, as in 3-D, since a watch could not end `spade`'s bulk loading. Each is located from
//! the one before, so that the order along a curve keeps this fast. Where four points or more lie on one circle with no
//! point inside, their cells depend on the order of insertion; [`ties`] makes them depend only on the points.

mod ties;

use super::prepare::Prepared;
use super::{STRIDE, canonical, rounds};
use crate::geometry::Simplex;
use crate::parallel::prelude::*;
use crate::watch::{Cancelled, Phase, Watch, check};
use spade::handles::FixedUndirectedEdgeHandle;
use spade::{DelaunayTriangulation, Point2, Triangulation};

/// See [`super::Connector`].
pub(super) fn connect(
    prepared: &Prepared<2>,
    watch: &mut dyn Watch,
) -> Result<Option<Vec<u32>>, Cancelled> {
    let order = rounds::order(prepared.points.len());
    let mut triangulation = DelaunayTriangulation::<Point2<f64>>::new();
    for (chunk, ranks) in order.chunks(STRIDE).enumerate() {
        check(watch, Phase::Connect, (chunk * STRIDE) as f64 / order.len() as f64, None)?;
        for &rank in ranks {
            let [x, y] = prepared.points[rank as usize];
            triangulation
                .insert(Point2::new(x, y))
                .expect("prepared coordinates are within spade's range");
        }
    }
    // A vertex's index is the number of distinct points inserted before it.
    let mut cells: Vec<[u32; 3]> = triangulation
        .inner_faces()
        .map(|face| face.vertices().map(|vertex| order[vertex.fix().index()]))
        .collect();
    ties::settle(&mut cells, &tied(&triangulation), &prepared.points);
    Ok((!cells.is_empty()).then(|| canonical::arrange(&[cells], &prepared.order)))
}

/// The pairs of cells, by their places among the inner faces, that share an edge and a circumcircle.
fn tied(triangulation: &DelaunayTriangulation<Point2<f64>>) -> Vec<[u32; 2]> {
    let pair = |edge: FixedUndirectedEdgeHandle| {
        let edge = triangulation.undirected_edge(edge).as_directed();
        let (left, right) = (edge.face().as_inner()?, edge.rev().face().as_inner()?);
        let [first, others @ ..] = left.positions().map(|p| [p.x, p.y]);
        let opposite = edge.rev().opposite_position()?;
        let place = Simplex { first, others }.in_sphere(&[opposite.x, opposite.y]);
        // the outer face is number 0
        let cell = |face: usize| face as u32 - 1;
        (place == 0.0).then(|| [left.fix().index(), right.fix().index()].map(cell))
    };
    let edges: Vec<FixedUndirectedEdgeHandle> = triangulation.fixed_undirected_edges().collect();
    edges.into_par_iter().with_min_len(1 << 12).filter_map(pair).collect()
}
