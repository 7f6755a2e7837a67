//! Pictures of meshes over images, as PNG and SVG, without fonts.
//!
//! [`draw_triangles`] lays a triangular mesh over its image, as in figure 2 of Hale (2001), or atoms over a
//! field, as in his figure 5; [`draw_slices`] lays the cuts of a tetrahedral mesh over the three
//! orthogonal slices of its image, as in his figure 9; [`draw_polygons`] and [`draw_polyhedra`] do the same for
//! Voronoi cells, [`draw_curves`] plots functions, as in his figure 3. [`draw_flow`] and [`draw_flow_slices`] show what
//! flows on a mesh, [`draw_parts`] and [`draw_parts_slices`] parts of its cells, [`draw_space`] surfaces and cells in space, as
//! in his figure 10. [`Drawing`] holds them for callers
//! that are generic over the dimension. All return a [`Picture`], a list of what to draw and where, which becomes PNG
//! or SVG; [`encode_movie`] makes an animated PNG of several; [`ReportPage`] is a report with its pictures as one HTML file. The same input gives the same bytes.
//!
//! Meshes are given in *sample coordinates*: lattice coordinates divided by the grid's step. Row 0 is
//! at the top, x grows to the right. A sample covers the square around its centre, so a picture reaches
//! half a sample beyond the mesh.

mod color_map;
mod curves;
mod cut;
mod drawing;
mod error;
mod flow;
mod label;
mod legend;
mod movie;
mod page;
mod panel;
mod parts;
mod picture;
mod plane;
mod png_encode;
mod raster;
mod scale;
mod shape;
mod slices;
mod space;
mod style;
mod svg;
mod ticks;
mod view;

pub use curves::{Curve, draw_curves};
pub use drawing::Drawing;
pub use error::DrawError;
pub use flow::{
    FlowCells, FlowLine, FlowPicture, FlowStyle, FlowWell, draw_flow, draw_flow_slices,
};
pub use movie::{MovieFrame, encode_movie};
pub use page::ReportPage;
pub use parts::{PartsPicture, draw_parts, draw_parts_slices};
pub use picture::{Picture, PictureFormat};
pub use plane::{draw_atoms, draw_polygons, draw_triangles};
pub use slices::{draw_atoms_slices, draw_polyhedra, draw_slices};
pub use space::{Sheet, SpacePicture, draw_space};
pub use style::{Color, Style};
