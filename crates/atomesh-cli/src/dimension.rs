//! What differs between flat images and volumes, as values.

use atomesh::image::Image;
use atomesh::mesh::{Mesh, PolyMesh};
use atomesh::run::Method;
use atomesh_draw::{
    DrawError, FlowPicture, FlowStyle, Picture, Style, draw_flat, draw_flow, draw_flow_slices,
    draw_polygons, draw_polyhedra, draw_slices,
};
use atomesh_io::image::AnyImage;

/// How images of `D` axes are meshed and shown.
pub struct Dimension<const D: usize> {
    /// How they are meshed.
    pub method: Method<D>,
    /// Draws a mesh in sample coordinates over its image.
    pub draw: fn(&Image<D>, &Mesh<D>, &Style) -> Result<Picture, DrawError>,
    /// Draws Voronoi cells in sample coordinates over their image.
    pub draw_cells: fn(&Image<D>, &PolyMesh<D>, &Style) -> Result<Picture, DrawError>,
    /// Draws flow in sample coordinates.
    pub draw_flow: fn(&FlowPicture<'_, D>, &Style, &FlowStyle) -> Result<Picture, DrawError>,
    /// The image if it has `D` axes.
    pub image: fn(AnyImage) -> Option<Image<D>>,
    /// What the cells are called, more than one of them.
    pub cells: &'static str,
    /// What Voronoi cells are called, more than one of them.
    pub voronoi_cells: &'static str,
}

impl Dimension<2> {
    /// Images of two axes.
    pub fn flat() -> Self {
        Self {
            method: Method::plane(),
            draw: draw_flat,
            draw_cells: draw_polygons,
            draw_flow: |flow, style, flow_style| draw_flow(flow, style, flow_style),
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
    /// Images of three axes; pictures show the three slices through the middle.
    pub fn volume() -> Self {
        Self {
            method: Method::space(),
            draw: |image, mesh, style| {
                let style = Style { atoms: true, ..style.clone() };
                draw_slices(image, mesh, image.frame().shape().map(|n| n / 2), &style)
            },
            draw_cells: |image, mesh, style| {
                let style = Style { atoms: true, ..style.clone() };
                draw_polyhedra(image, mesh, image.frame().shape().map(|n| n / 2), &style)
            },
            draw_flow: |flow, style, flow_style| draw_flow_slices(flow, None, style, flow_style),
            image: |any| match any {
                AnyImage::Volume(image) => Some(image),
                AnyImage::Flat(_) => None,
            },
            cells: "tetrahedra",
            voronoi_cells: "polyhedra",
        }
    }
}
