//! How large a picture is: an edge of typical length is as long as the style says.

use atomesh::geometry::{Point, difference, dot};
use atomesh::mesh::Mesh;

use crate::style::Style;

/// The most cells, faces or edges whose lengths the typical one is the median of.
pub(crate) const EDGE_SAMPLES: usize = 1 << 14;

/// The median length of the edges of cells spread over the mesh, of samples with sides `step`; `None`
/// without cells.
pub(crate) fn typical_length<const D: usize>(mesh: &Mesh<D>, step: &[f64; D]) -> Option<f64> {
    let points = mesh.points();
    let mut lengths = Vec::new();
    for cell in mesh.cells().step_by(mesh.cell_count().div_ceil(EDGE_SAMPLES).max(1)) {
        for (i, &a) in cell.iter().enumerate() {
            for &b in &cell[i + 1..] {
                let edge = difference(&points[b as usize], &points[a as usize]);
                let edge: Point<D> = std::array::from_fn(|k| edge[k] * step[k]);
                lengths.push(dot(&edge, &edge).sqrt());
            }
        }
    }
    median(lengths)
}

/// The median; `None` without lengths.
pub(crate) fn median(mut lengths: Vec<f64>) -> Option<f64> {
    let middle = lengths.len() / 2;
    (!lengths.is_empty()).then(|| *lengths.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Pixels to a unit of length, so that an edge of the given length is as long as the style wants it,
/// or else the picture of that extent as large as it may be.
pub(crate) fn scale(edge: Option<f64>, extent: &[f64; 2], style: &Style) -> f64 {
    let largest = style.max_side / extent[0].max(extent[1]);
    match edge {
        Some(edge) if edge > 0.0 => largest.min(style.edge_pixels / edge),
        _ => largest,
    }
}
