//! The parts of a mesh in their colours.

use atomesh::image::Image;

use crate::error::DrawError;
use crate::flow::{FlowCells, FlowPicture, FlowStyle, draw_flow, draw_flow_slices};
use crate::picture::Picture;
use crate::style::Style;

/// The width of the borders of parts in pixels.
const BORDER: f64 = 2.0;

/// Cells, and the part that each of them is of.
#[derive(Clone, Copy, Debug)]
pub struct PartsPicture<'a, const D: usize> {
    /// The cells, in sample coordinates.
    pub cells: FlowCells<'a, D>,
    /// The image behind them. Without one, the picture ends where the mesh does.
    pub image: Option<&'a Image<D>>,
    /// The part of each cell.
    pub parts: &'a [i32],
}

impl<const D: usize> PartsPicture<'_, D> {
    /// The facets between two parts.
    fn borders(&self) -> Vec<u32> {
        let (mut borders, mut facet) = (Vec::new(), 0);
        let part = |cell: u32| self.parts[cell as usize];
        self.cells.each_facet(|_, cell, beyond| {
            if beyond.is_some_and(|beyond| part(cell) != part(beyond)) {
                borders.push(facet);
            }
            facet += 1;
        });
        borders
    }

    fn flow<'a>(&'a self, borders: &'a [u32]) -> FlowPicture<'a, D> {
        let Self { cells, image, parts } = *self;
        FlowPicture { image, parts, barriers: borders, ..FlowPicture::new(cells) }
    }

    fn check(&self) -> Result<(), DrawError> {
        let (found, expected) = (self.parts.len(), self.cells.cell_count());
        match found == expected {
            true => Ok(()),
            false => Err(DrawError::Count { what: "parts", found, expected }),
        }
    }
}

fn style_of_borders() -> FlowStyle {
    FlowStyle { barrier_width: BORDER, legend: false, ..FlowStyle::default() }
}

/// Draws the parts of triangles or polygons over their image, each in its colour, their borders bold.
///
/// # Errors
/// [`DrawError::Style`] if a number of the style is out of range, [`DrawError::Count`] if there is not one part for each
/// cell.
pub fn draw_parts(parts: &PartsPicture<'_, 2>, style: &Style) -> Result<Picture, DrawError> {
    parts.check()?;
    draw_flow(&parts.flow(&parts.borders()), style, &style_of_borders())
}

/// Draws the parts of tetrahedra or polyhedra in three slices through the middle of the image, or of the mesh without one.
/// The upper left panel shows their borders in space.
///
/// # Errors
/// As [`draw_parts`].
pub fn draw_parts_slices(parts: &PartsPicture<'_, 3>, style: &Style) -> Result<Picture, DrawError> {
    parts.check()?;
    draw_flow_slices(&parts.flow(&parts.borders()), None, style, &style_of_borders())
}
