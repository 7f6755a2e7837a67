//! Flow on a mesh: vectors, wells, streamlines and pressures, as in figure 8 of Hale (2001).
//!
//! A [`FlowPicture`] is all that there is to see, in sample coordinates. It becomes canvases: one in the plane, three
//! slices in space. A canvas is a rectangle with cells as polygons, lines, and what flows. It becomes shapes, the
//! lowest first: image or pressures, edges, barriers, streamlines, vectors, wells. Nothing leaves its canvas.

mod arrow;
mod canvas;
mod clip;
mod picture;
mod plane;
mod scene;
mod slices;
mod space;

pub use picture::{FlowCells, FlowLine, FlowPicture, FlowStyle, FlowWell};
pub use plane::draw_flow;
pub use slices::draw_flow_slices;
