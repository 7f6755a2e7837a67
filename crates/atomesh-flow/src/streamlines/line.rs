//! A streamline and its end.

use atomesh::geometry::Point;

/// Why a streamline ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum End {
    /// It reaches a well.
    Well,
    /// It leaves through the boundary.
    Boundary,
    /// Nothing flows out of its cell, or it circles around a corner.
    Stagnation,
    /// It has as many segments as allowed.
    Limit,
}

/// The path of a particle.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Streamline<const D: usize> {
    /// Its points, from the start on; consecutive points differ.
    #[serde(serialize_with = "as_vectors")]
    pub points: Vec<Point<D>>,
    /// The time of flight from the start to each point.
    pub times: Vec<f64>,
    /// The cell of each segment between two points.
    pub cells: Vec<u32>,
    /// The problem's number of the well that it comes from; `None` if from the boundary.
    pub from: Option<usize>,
    /// The problem's number of the well that it ends at.
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
