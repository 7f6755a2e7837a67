//! The style of pictures.

use atomesh::image::Units;

use crate::error::DrawError;

/// An opaque colour: red, green and blue.
pub type Color = [u8; 3];

/// The style of a picture. The defaults are the paper's: white on an image whose brightest sample is a
/// middle grey, so that thin edges stand out everywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Style {
    /// Whether the mesh's edges are drawn. Default true.
    pub edges: bool,
    /// The colour of edges. Default white.
    pub edge_color: Color,
    /// The width of edges in pixels. Default 1.2.
    pub edge_width: f64,
    /// Whether atoms are drawn: in the plane all, as dots; in slices those within one sample, as squares. Default false;
    /// [`Drawing::space`](crate::Drawing::space) draws them always.
    pub atoms: bool,
    /// The colour of atoms. Default white.
    pub atom_color: Color,
    /// The grey of the brightest sample, in (0, 1]. Default 0.6, about that of the paper's figures.
    pub brightness: f64,
    /// The median length of edges in pixels, unless the picture would be too large. Default 20.
    pub edge_pixels: f64,
    /// The longest side of a picture in pixels. Default 1600.
    pub max_side: f64,
    /// Whether samples have the proportions of the image's spacing (`Physical`, the default) or are
    /// squares (`Samples`).
    pub units: Units,
    /// Whether z grows upward in slices that show it. Default false: the paper's z is depth.
    pub z_up: bool,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            edges: true,
            edge_color: [255; 3],
            edge_width: 1.2,
            atoms: false,
            atom_color: [255; 3],
            brightness: 0.6,
            edge_pixels: 20.0,
            max_side: 1600.0,
            units: Units::Physical,
            z_up: false,
        }
    }
}

impl Style {
    /// The style, if its numbers are in range.
    pub(crate) fn checked(&self) -> Result<&Self, DrawError> {
        for (name, value, limit) in [
            ("edge_width", self.edge_width, Some(100.0)),
            ("brightness", self.brightness, Some(1.0)),
            ("edge_pixels", self.edge_pixels, Some(1000.0)),
            ("max_side", self.max_side, Some(20_000.0)),
        ] {
            if !(value > 0.0 && limit.is_none_or(|l| value <= l)) {
                return Err(DrawError::Style { name, value, limit });
            }
        }
        Ok(self)
    }
}
