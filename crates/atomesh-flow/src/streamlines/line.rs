//! What a streamline is.

use atomesh::geometry::Point;

/// Why a streamline ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum End {
    /// At a well.
    Well,
    /// On the boundary, where something flows out.
    Boundary,
    /// Where nothing flows out of a cell, or around a corner without end.
    Stagnation,
    /// After as many segments as allowed.
    Limit,
}

/// The way of a particle.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Streamline<const D: usize> {
    /// Its points, from the start on. Two points of a line are apart.
    #[serde(serialize_with = "as_vectors")]
    pub points: Vec<Point<D>>,
    /// The time of flight from the start to each point.
    pub times: Vec<f64>,
    /// The cell of each segment between two points.
    pub cells: Vec<u32>,
    /// The well that it comes from, by its number in the problem; `None` from the boundary.
    pub from: Option<usize>,
    /// The well that it goes to.
    pub to: Option<usize>,
    /// Why it ends.
    pub end: End,
}

fn as_vectors<const D: usize, S: serde::Serializer>(
    points: &[Point<D>],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(points.iter().map(|point| point.as_slice()))
}
