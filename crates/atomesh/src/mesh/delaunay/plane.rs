//! Triangles, by the crate `spade`.
//!
//! Points are inserted one by one, as in 3-D, rather than by its bulk loading, which no watch could
//! end; each is looked for from the one before, so the order makes up for it.

use super::prepare::Prepared;
use super::{STRIDE, canonical, rounds};
use crate::watch::{Cancelled, Phase, Watch, check};
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
    let cells: Vec<[u32; 3]> = triangulation
        .inner_faces()
        .map(|face| face.vertices().map(|vertex| order[vertex.fix().index()]))
        .collect();
    Ok((!cells.is_empty()).then(|| canonical::arrange(&[cells], &prepared.order)))
}
