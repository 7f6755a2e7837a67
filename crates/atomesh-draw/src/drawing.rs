//! Pictures of the plane or of space, as a value: what callers that are generic over the dimension call.
//!
//! The functions behind it are compiled in this crate, once for each dimension.

use atomesh::geometry::Point;
use atomesh::image::Image;
use atomesh::mesh::{Mesh, PolyMesh};

use crate::error::DrawError;
use crate::flow::{FlowPicture, FlowStyle, draw_flow, draw_flow_slices};
use crate::parts::{PartsPicture, draw_parts, draw_parts_slices};
use crate::picture::Picture;
use crate::plane::{draw_atoms, draw_polygons, draw_triangles};
use crate::slices::{draw_atoms_slices, draw_polyhedra, draw_slices};
use crate::space::{SpacePicture, draw_space};
use crate::style::Style;

type DrawAtoms<const D: usize> =
    fn(&Image<D>, &[Vec<Point<D>>; D], &Style) -> Result<Picture, DrawError>;

type DrawSpace<const D: usize> = fn(&SpacePicture<'_, D>, &Style) -> Result<Picture, DrawError>;

/// How meshes of `D` dimensions, in sample coordinates, are drawn.
#[derive(Clone, Copy, Debug)]
pub struct Drawing<const D: usize> {
    /// Draws triangles or tetrahedra over their image.
    pub mesh: fn(&Image<D>, &Mesh<D>, &Style) -> Result<Picture, DrawError>,
    /// Draws Voronoi cells over their image.
    pub cells: fn(&Image<D>, &PolyMesh<D>, &Style) -> Result<Picture, DrawError>,
    /// Draws atoms alone: in the plane those of the first list, in space those of the list of each slice, by its normal.
    pub atoms: DrawAtoms<D>,
    /// Draws parts of cells.
    pub parts: fn(&PartsPicture<'_, D>, &Style) -> Result<Picture, DrawError>,
    /// Draws surfaces and cells in space; `None` in the plane.
    pub space: Option<DrawSpace<D>>,
    /// Draws flow.
    pub flow: fn(&FlowPicture<'_, D>, &Style, &FlowStyle) -> Result<Picture, DrawError>,
}

impl Drawing<2> {
    /// [`draw_triangles`], [`draw_polygons`], [`draw_parts`] and [`draw_flow`].
    #[inline(never)] // inlined elsewhere, it would have all functions compiled there
    pub fn plane() -> Self {
        Self {
            mesh: draw_triangles,
            cells: draw_polygons,
            atoms: |image, [atoms, _], style| draw_atoms(image, atoms, style),
            parts: draw_parts,
            space: None,
            flow: draw_flow,
        }
    }
}

impl Drawing<3> {
    /// [`draw_slices`], [`draw_polyhedra`], [`draw_parts_slices`] and [`draw_flow_slices`], through the middle of the image, atoms drawn.
    #[inline(never)]
    pub fn space() -> Self {
        Self {
            mesh: |image, mesh, style| draw_slices(image, mesh, middle(image), &with_atoms(style)),
            cells: |image, mesh, style| {
                draw_polyhedra(image, mesh, middle(image), &with_atoms(style))
            },
            atoms: |image, atoms, style| {
                draw_atoms_slices(image, atoms.each_ref().map(Vec::as_slice), middle(image), style)
            },
            parts: draw_parts_slices,
            space: Some(draw_space),
            flow: |flow, style, flow_style| draw_flow_slices(flow, None, style, flow_style),
        }
    }
}

fn middle(image: &Image<3>) -> [usize; 3] {
    image.frame().shape().map(|n| n / 2)
}

fn with_atoms(style: &Style) -> Style {
    Style { atoms: true, ..style.clone() }
}
