//! A picture: a size, and shapes in pixels.

use std::path::Path;

use crate::error::DrawError;
use crate::shape::{Place, Shape};
use crate::{png_encode, svg};

/// The kinds of picture files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PictureFormat {
    /// Portable Network Graphics, 8 bits a colour.
    Png,
    /// Scalable Vector Graphics, with the image embedded.
    Svg,
}

impl PictureFormat {
    /// The kind of a file by its extension, in upper or lower case.
    ///
    /// # Errors
    /// [`DrawError::Format`] unless the extension is png or svg.
    pub fn of(path: &Path) -> Result<Self, DrawError> {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        match extension.to_str() {
            Some("png") => Ok(Self::Png),
            Some("svg") => Ok(Self::Svg),
            _ => Err(DrawError::Format { path: path.into() }),
        }
    }
}

/// A picture, ready to be encoded.
#[derive(Clone, Debug)]
pub struct Picture {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) shapes: Vec<Shape>,
}

impl Picture {
    /// A white picture large enough for `size`.
    pub(crate) fn new(size: Place) -> Self {
        let whole = |s: f64| s.ceil().max(1.0) as u32;
        Self { width: whole(size[0]), height: whole(size[1]), shapes: vec![] }
    }

    /// The width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// The height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The number of lines, dots and other parts, which decides how large it is as SVG.
    pub(crate) fn shape_count(&self) -> usize {
        let count = |shape: &Shape| match shape {
            Shape::Image { .. } | Shape::Colors { .. } | Shape::Fill { .. } => 1,
            Shape::Lines { lines, .. } => lines.len(),
            Shape::Discs { centers, .. } | Shape::Squares { centers, .. } => centers.len(),
            Shape::Polygons { polygons, .. } | Shape::Tint { polygons, .. } => polygons.len(),
        };
        self.shapes.iter().map(count).sum()
    }

    /// The bytes of a file of that kind; the same for the same picture.
    ///
    /// # Errors
    /// [`DrawError::Png`] if the PNG encoder fails, as it may for lack of memory.
    pub fn encode(&self, format: PictureFormat) -> Result<Vec<u8>, DrawError> {
        match format {
            PictureFormat::Png => png_encode::encode([self.width, self.height], &self.shapes),
            PictureFormat::Svg => svg::encode([self.width, self.height], &self.shapes),
        }
    }
}
