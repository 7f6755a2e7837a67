//! Triangles, by the crate `spade`.
//!
//! Points are inserted one by one, as in 3-D, rather than by its bulk loading, which no watch could
//! end; each is looked for from the one before, so the order makes up for it.

use super::{STRIDE, rounds};
use crate::geometry::Point;
use crate::watch::{Cancelled, Phase, Watch, check};
use spade::{DelaunayTriangulation, Point2, Triangulation};

/// See [`super::Connector`].
pub(super) fn connect(
    points: &[Point<2>],
    watch: &mut dyn Watch,
) -> Result<Option<Vec<u32>>, Cancelled> {
    let order = rounds::order(points.len());
    let mut triangulation = DelaunayTriangulation::<Point2<f64>>::new();
    for (chunk, ranks) in order.chunks(STRIDE).enumerate() {
        check(watch, Phase::Connect, (chunk * STRIDE) as f64 / order.len() as f64, None)?;
        for &rank in ranks {
            let [x, y] = points[rank as usize];
            triangulation
                .insert(Point2::new(x, y))
                .expect("prepared coordinates are within spade's range");
        }
    }
    // A vertex's index is the number of distinct points inserted before it.
    let corners: Vec<u32> = triangulation
        .inner_faces()
        .flat_map(|face| face.vertices().map(|vertex| order[vertex.fix().index()]))
        .collect();
    Ok((!corners.is_empty()).then_some(corners))
}
