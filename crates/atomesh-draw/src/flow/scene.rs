//! What the panels of a picture of flow in space share: the box, where the slices meet, and the scale.

use atomesh::geometry::{Point, difference};
use atomesh::image::Image;

use super::picture::{FlowCells, FlowPicture};
use crate::error::DrawError;
use crate::scale::{EDGE_SAMPLES, median, scale, typical_length};
use crate::style::Style;

/// What all panels show.
pub(super) struct Scene<'a> {
    pub flow: &'a FlowPicture<'a, 3>,
    pub style: &'a Style,
    /// The facets' corners.
    pub facets: Vec<Vec<u32>>,
    /// Where the slices meet.
    pub at: Point<3>,
    /// The box: its least sample coordinates and its extent.
    pub first: Point<3>,
    pub extent: Point<3>,
    /// Pixels per sample along each axis.
    pub pixels: Point<3>,
    /// The length of a typical edge in pixels.
    pub edge_pixels: f64,
}

impl<'a> Scene<'a> {
    pub fn new(
        flow: &'a FlowPicture<'a, 3>,
        at: Option<Point<3>>,
        style: &'a Style,
    ) -> Result<Self, DrawError> {
        let (first, extent) = flow.cells.shown_box(flow.image);
        let middle = match flow.image {
            Some(image) => image.frame().shape().map(|n| (n / 2) as f64),
            None => std::array::from_fn(|k| first[k] + 0.5 * extent[k]),
        };
        let at = at.unwrap_or(middle);
        for axis in 0..3 {
            if !(first[axis]..=first[axis] + extent[axis]).contains(&at[axis]) {
                let (at, count) = (at[axis].max(0.0) as usize, extent[axis] as usize);
                return Err(DrawError::Slice { axis, at, count });
            }
        }
        let step = flow.image.map_or([1.0; 3], |image| image.frame().grid(style.units).step);
        let sides: Point<3> = std::array::from_fn(|k| extent[k] * step[k]);
        let edge = typical_edge(&flow.cells, &step);
        let larger = Style { edge_pixels: LARGER * style.edge_pixels, ..style.clone() };
        let scale = scale(edge, &[sides[1] + sides[0], sides[1] + sides[2]], &larger);
        let edge_pixels = edge.map_or(style.edge_pixels, |edge| edge * scale);
        let (facets, pixels) = (flow.cells.facets(), step.map(|s| s * scale));
        Ok(Self { flow, style, facets, at, first, extent, pixels, edge_pixels })
    }

    /// The sample nearest to where the slices meet.
    pub fn sample(&self, image: &Image<3>) -> [usize; 3] {
        let shape = image.frame().shape();
        std::array::from_fn(|k| (self.at[k].round().max(0.0) as usize).min(shape[k] - 1))
    }

    pub fn in_pixels(&self, v: &Point<3>) -> Point<3> {
        std::array::from_fn(|k| v[k] * self.pixels[k])
    }

    pub fn corners(&self, numbers: &[u32]) -> Vec<Point<3>> {
        numbers.iter().map(|&c| self.flow.cells.points()[c as usize]).collect()
    }
}

/// The factor by which edges are longer than the style says, so that there is room for a vector in each part of a cell
/// that a slice shows.
pub(super) const LARGER: f64 = 1.5;

/// The median length of tetrahedra's edges, or distance between neighbouring sites of Voronoi cells.
fn typical_edge(cells: &FlowCells<3>, step: &Point<3>) -> Option<f64> {
    match cells {
        FlowCells::Simplices(mesh) => typical_length(mesh, step),
        FlowCells::Polytopes(mesh) => {
            let stride = mesh.inner_face_count().div_ceil(EDGE_SAMPLES).max(1);
            let pairs = mesh.owners().iter().zip(mesh.neighbours()).step_by(stride);
            let length = |(&a, &b): (&u32, &u32)| {
                let way = difference(&mesh.centers()[a as usize], &mesh.centers()[b as usize]);
                (0..3).map(|k| (way[k] * step[k]).powi(2)).sum::<f64>().sqrt()
            };
            median(pairs.map(length).collect())
        }
    }
}
