//! Pictures of meshes in space.

use atomesh::mesh::{FacetGroup, MASK_NAME, side_name};
use atomesh_draw::{Picture, Sheet, SpacePicture, Style};

use crate::dimension::Dimension;
use crate::error::JobError;

/// The groups of facets that are shown as surfaces: all but the sides of the box; and the outline of a mask only if there is
/// no other, which it would hide.
pub(crate) fn sheets<const D: usize>(groups: Vec<FacetGroup<D>>) -> Vec<Sheet<D>> {
    let is_side = |name: &str| (0..2 * D).any(|side| side_name(side) == name);
    let shown =
        groups.into_iter().filter(|group| !group.facets.is_empty() && !is_side(&group.name));
    let (masks, others): (Vec<_>, Vec<_>) = shown.partition(|group| group.name == MASK_NAME);
    let shown = if others.is_empty() { masks } else { others };
    shown.into_iter().map(|FacetGroup { name, facets, .. }| Sheet { name, facets }).collect()
}

/// Draws what is in space.
///
/// # Errors
/// [`JobError`] of what is flat, or cannot be drawn.
pub(crate) fn draw_in_space<const D: usize>(
    contents: &SpacePicture<'_, D>,
    style: &Style,
    dimension: &Dimension<D>,
) -> Result<Picture, JobError> {
    let draw = dimension
        .drawing
        .space
        .ok_or_else(|| JobError::content("what is flat has no view in space"))?;
    draw(contents, style).map_err(JobError::content)
}
