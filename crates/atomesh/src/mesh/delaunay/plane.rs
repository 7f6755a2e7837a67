//! Triangles, by the crate `spade`.

use crate::geometry::Point;
use crate::watch::{Cancelled, Watch};
use spade::{DelaunayTriangulation, Point2, Triangulation};

/// See [`super::Connector`].
pub(super) fn connect(
    points: &[Point<2>],
    _watch: &mut dyn Watch,
) -> Result<Option<Vec<u32>>, Cancelled> {
    let vertices = points.iter().map(|p| Point2::new(p[0], p[1])).collect();
    let triangulation = DelaunayTriangulation::<Point2<f64>>::bulk_load_stable(vertices)
        .expect("prepared coordinates are within spade's range");
    let corners: Vec<u32> = triangulation
        .inner_faces()
        .flat_map(|face| face.vertices().map(|v| v.fix().index() as u32))
        .collect();
    Ok((!corners.is_empty()).then_some(corners))
}
