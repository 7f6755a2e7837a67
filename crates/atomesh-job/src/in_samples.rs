//! Cells of the world among an image's samples, as pictures want them.

use atomesh::image::{Frame, Units};
use atomesh::mesh::{Mesh, PolyMesh};
use atomesh::run::lattice_mesh;
use atomesh_draw::FlowCells;

/// Cells among an image's samples; without a frame, where they are.
pub enum InSamples<const D: usize> {
    /// Triangles or tetrahedra.
    Simplices(Mesh<D>),
    /// Voronoi cells.
    Polytopes(Box<PolyMesh<D>>),
}

impl<const D: usize> InSamples<D> {
    /// A mesh of the world.
    pub(crate) fn of_mesh(mesh: &Mesh<D>, frame: Option<&Frame<D>>) -> Self {
        Self::Simplices(match frame {
            Some(frame) => lattice_mesh(mesh, frame, Units::Samples),
            None => mesh.clone(),
        })
    }

    /// Cells of the world.
    pub(crate) fn of_cells(cells: &PolyMesh<D>, frame: Option<&Frame<D>>) -> Self {
        Self::Polytopes(Box::new(match frame {
            Some(frame) => {
                let place = |p: &[f64; D]| frame.world_to_lattice(Units::Samples, p);
                cells.moved(frame.is_mirrored(), place)
            }
            None => cells.clone(),
        }))
    }

    /// The cells as pictures take them.
    pub(crate) fn cells(&self) -> FlowCells<'_, D> {
        match self {
            Self::Simplices(mesh) => FlowCells::Simplices(mesh),
            Self::Polytopes(cells) => FlowCells::Polytopes(cells),
        }
    }
}
