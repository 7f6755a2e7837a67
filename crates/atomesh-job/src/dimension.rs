//! What differs between the plane and space in a job, as values.

use atomesh::image::Image;
use atomesh::run::{Method, Tools};
use atomesh_draw::Drawing;
use atomesh_flow::FlowMethod;
use atomesh_io::MeshFiles;
use atomesh_io::image::AnyImage;

/// How images of `D` axes are meshed, solved on and shown. What takes long to compile is compiled where it is
/// written, once.
#[derive(Clone)]
pub struct Dimension<const D: usize> {
    /// How they are meshed.
    pub method: Method<D>,
    /// What else is done with them and their meshes.
    pub tools: &'static Tools<D>,
    /// How flow on their meshes is computed.
    pub flow: FlowMethod<D>,
    /// How files of theirs are written.
    pub files: MeshFiles<D>,
    /// How they are drawn, in space by the three slices through the middle.
    pub drawing: Drawing<D>,
    /// The image if it has `D` axes.
    pub image: fn(AnyImage) -> Option<Image<D>>,
    /// What the cells are called, more than one of them.
    pub cells: &'static str,
    /// What Voronoi cells are called, more than one of them.
    pub voronoi_cells: &'static str,
}

impl Dimension<2> {
    /// Images of two axes.
    pub fn plane() -> Self {
        Self {
            method: Method::plane(),
            tools: Tools::plane(),
            flow: FlowMethod::plane(),
            files: MeshFiles::plane(),
            drawing: Drawing::plane(),
            image: |any| match any {
                AnyImage::Flat(image) => Some(image),
                AnyImage::Volume(_) => None,
            },
            cells: "triangles",
            voronoi_cells: "polygons",
        }
    }
}

impl Dimension<3> {
    /// Images of three axes.
    pub fn space() -> Self {
        Self {
            method: Method::space(),
            tools: Tools::space(),
            flow: FlowMethod::space(),
            files: MeshFiles::space(),
            drawing: Drawing::space(),
            image: |any| match any {
                AnyImage::Volume(image) => Some(image),
                AnyImage::Flat(_) => None,
            },
            cells: "tetrahedra",
            voronoi_cells: "polyhedra",
        }
    }
}
