//! The shapes of a picture, in pixels, x to the right and y down.

use crate::raster::{ColorRaster, Raster};
use crate::style::Color;

/// A place in a picture, in pixels from its upper left corner.
pub(crate) type Place = [f64; 2];

/// A rectangle: its upper left corner and its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rect {
    pub corner: Place,
    pub size: Place,
}

/// Something to draw; later shapes cover earlier ones.
#[derive(Clone, Debug)]
pub(crate) enum Shape {
    /// A raster stretched over a parallelogram, each sample a parallelogram of one grey. Sample 0 is at
    /// `corner`; `right` and `down` are the sides along a row and a column.
    Image { raster: Raster, corner: Place, right: Place, down: Place },
    /// Pixels in colour, from a corner on.
    Colors { raster: ColorRaster, corner: Place },
    /// A filled rectangle.
    Fill { rect: Rect, color: Color },
    /// Straight lines, round at their ends.
    Lines { lines: Vec<[Place; 2]>, width: f64, color: Color },
    /// Filled discs of one radius.
    Discs { centers: Vec<Place>, radius: f64, color: Color },
    /// Filled squares of one half side.
    Squares { centers: Vec<Place>, half: f64, color: Color },
    /// Filled polygons of one colour, antialiased if `smooth`; else neighbours leave no seam.
    Polygons { polygons: Vec<Vec<Place>>, color: Color, smooth: bool },
    /// The same over what is below, of which 1 − `opacity` shows through; neighbours leave no seam.
    Tint { polygons: Vec<Vec<Place>>, color: Color, opacity: f64 },
}

impl Shape {
    /// A raster stretched over a rectangle.
    pub fn upright(raster: Raster, rect: Rect) -> Self {
        let ([width, height], corner) = (rect.size, rect.corner);
        Self::Image { raster, corner, right: [width, 0.0], down: [0.0, height] }
    }
}
