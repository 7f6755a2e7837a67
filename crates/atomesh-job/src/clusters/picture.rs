//! Pictures of parts, in the coordinates of an image's samples where there is a frame.

use atomesh::image::Image;
use atomesh_draw::{PartsPicture, Picture, Style};

use super::{ClusteredMesh, Clusters};
use crate::dimension::Dimension;
use crate::error::JobError;

/// Draws the parts of a mesh, over an image if there is one.
///
/// # Errors
/// [`JobError`] if they cannot be drawn.
pub(super) fn picture<const D: usize>(
    loaded: &impl ClusteredMesh<D>,
    found: &Clusters,
    image: Option<&Image<D>>,
    style: &Style,
    dimension: &Dimension<D>,
) -> Result<Picture, JobError> {
    let frame = image.map(Image::frame).or(loaded.frame());
    let shape = loaded.in_samples(frame);
    let parts = PartsPicture { cells: shape.cells(), image, parts: &found.parts };
    (dimension.drawing.parts)(&parts, style).map_err(JobError::content)
}
