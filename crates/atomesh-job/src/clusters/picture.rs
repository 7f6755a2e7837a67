//! Pictures of parts, in the coordinates of an image's samples where there is a frame.

use atomesh::image::Image;
use atomesh_draw::{FlowCells, PartsPicture, Picture, Sheet, SpacePicture, Style};

use super::ClusteredMesh;
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::in_space::draw_in_space;
use crate::options::View;

/// What is shown of the cells of a mesh.
pub(super) struct Shown<'a, const D: usize> {
    /// The part of each of them, from 1 on.
    pub parts: &'a [i32],
    /// The image behind them.
    pub image: Option<&'a Image<D>>,
    /// How volumes are shown.
    pub view: View,
}

/// Draws the parts of a mesh, over an image if there is one.
///
/// # Errors
/// [`JobError`] if they cannot be drawn.
pub(super) fn picture<const D: usize>(
    loaded: &impl ClusteredMesh<D>,
    shown: &Shown<'_, D>,
    style: &Style,
    dimension: &Dimension<D>,
) -> Result<Picture, JobError> {
    let Shown { parts, image, view } = *shown;
    let frame = image.map(Image::frame).or(loaded.frame());
    let shape = loaded.in_samples(frame);
    let cells = shape.cells();
    if view == View::Slices {
        let parts = PartsPicture { cells, image, parts };
        return (dimension.drawing.parts)(&parts, style).map_err(JobError::content);
    }
    let cells_cut_away = view == View::CutAway;
    let sheets = if cells_cut_away { Vec::new() } else { borders(&cells, parts) };
    let contents = SpacePicture { cells, image, sheets: &sheets, parts, cells_cut_away };
    draw_in_space(&contents, style, dimension)
}

/// The facets between parts, each as one of the part of the lesser number.
fn borders<const D: usize>(cells: &FlowCells<'_, D>, parts: &[i32]) -> Vec<Sheet<D>> {
    let count = parts.iter().max().map_or(0, |greatest| *greatest as usize);
    let sheet = |number| Sheet { name: format!("part-{number}"), facets: Vec::new() };
    let mut sheets: Vec<Sheet<D>> = (1..=count).map(sheet).collect();
    let mut add = |a: u32, b: u32, facet: &mut dyn Iterator<Item = [u32; D]>| {
        let [a, b] = [a, b].map(|cell| parts[cell as usize]);
        if a != b {
            sheets[a.min(b) as usize - 1].facets.extend(facet);
        }
    };
    match cells {
        FlowCells::Simplices(mesh) => {
            for facet in mesh.facets() {
                if let Some(other) = facet.neighbour {
                    add(facet.cell, other, &mut std::iter::once(facet.corners));
                }
            }
        }
        FlowCells::Polytopes(mesh) => {
            for (face, (&a, &b)) in mesh.owners().iter().zip(mesh.neighbours()).enumerate() {
                add(a, b, &mut mesh.face_parts(face));
            }
        }
    }
    sheets
}
