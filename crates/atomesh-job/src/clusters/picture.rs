//! Pictures of parts, in the coordinates of an image's samples where there is a frame.

use atomesh::image::{Frame, Image, Units};
use atomesh::mesh::{Mesh, PolyMesh};
use atomesh::run::lattice_mesh;
use atomesh_draw::{FlowCells, PartsPicture, Picture, Style};

use super::{ClusteredMesh, Clusters};
use crate::dimension::Dimension;
use crate::error::JobError;

/// Cells among an image's samples.
pub enum InSamples<const D: usize> {
    /// Triangles or tetrahedra.
    Simplices(Mesh<D>),
    /// Voronoi cells.
    Polytopes(Box<PolyMesh<D>>),
}

impl<const D: usize> InSamples<D> {
    /// A mesh of the world.
    pub(super) fn of_mesh(mesh: &Mesh<D>, frame: Option<&Frame<D>>) -> Self {
        Self::Simplices(match frame {
            Some(frame) => lattice_mesh(mesh, frame, Units::Samples),
            None => mesh.clone(),
        })
    }

    /// Cells of the world.
    pub(super) fn of_cells(cells: &PolyMesh<D>, frame: &Frame<D>) -> Self {
        let place = |p: &[f64; D]| frame.world_to_lattice(Units::Samples, p);
        Self::Polytopes(Box::new(cells.moved(frame.is_mirrored(), place)))
    }

    fn cells(&self) -> FlowCells<'_, D> {
        match self {
            Self::Simplices(mesh) => FlowCells::Simplices(mesh),
            Self::Polytopes(cells) => FlowCells::Polytopes(cells),
        }
    }
}

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
