//! The scale of a picture, from the typical length of edges.

use atomesh::geometry::{Point, difference, dot};
use atomesh::mesh::Mesh;

use crate::style::Style;

/// The most cells, faces or edges whose lengths the typical one is the median of.
pub(crate) const EDGE_SAMPLES: usize = 1 << 14;

/// The median length of the edges of up to [`EDGE_SAMPLES`] cells spread over the mesh, for samples with sides `step`;
/// `None` without cells.
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

/// Pixels per unit of length: an edge of the given length gets [`Style::edge_pixels`], unless the picture of that extent
/// would be too large or there is no edge; then the picture is as large as allowed.
pub(crate) fn scale(edge: Option<f64>, extent: &[f64; 2], style: &Style) -> f64 {
    let largest = style.max_side / extent[0].max(extent[1]);
    match edge {
        Some(edge) if edge > 0.0 => largest.min(style.edge_pixels / edge),
        _ => largest,
    }
}
