//! Flow on a mesh: vectors, wells, streamlines and pressures, as in figure 8 of Hale (2001).
//!
//! A [`FlowPicture`] is all that there is to see, in sample coordinates. It becomes sheets: one in 2-D, three
//! slices in 3-D, each a rectangle with cells as polygons, lines, and what flows; a sheet becomes shapes, the
//! lowest first: image or pressures, edges, barriers, streamlines, vectors, wells. Nothing leaves its sheet.

mod arrow;
mod clip;
mod flat;
mod sheet;
mod slices;
mod space;

use atomesh::geometry::Point;
use atomesh::image::Image;
use atomesh::mesh::{Mesh, PolyMesh};

use crate::DrawError;

pub use flat::draw_flow;
pub use slices::draw_flow_slices;

/// The cells on which something flows.
#[derive(Clone, Copy, Debug)]
pub enum FlowCells<'a, const D: usize> {
    /// Triangles or tetrahedra; facets are those of [`Mesh::facets`].
    Simplices(&'a Mesh<D>),
    /// Voronoi cells; facets are the mesh's faces.
    Polytopes(&'a PolyMesh<D>),
}

impl<const D: usize> FlowCells<'_, D> {
    fn cell_count(&self) -> usize {
        match self {
            Self::Simplices(mesh) => mesh.cell_count(),
            Self::Polytopes(mesh) => mesh.cell_count(),
        }
    }

    fn points(&self) -> &[Point<D>] {
        match self {
            Self::Simplices(mesh) => mesh.points(),
            Self::Polytopes(mesh) => mesh.points(),
        }
    }

    /// The facets' corners.
    fn facets(&self) -> Vec<Vec<u32>> {
        match self {
            Self::Simplices(mesh) => {
                mesh.facets().iter().map(|facet| facet.corners.to_vec()).collect()
            }
            Self::Polytopes(mesh) => {
                (0..mesh.face_count()).map(|face| mesh.face(face).to_vec()).collect()
            }
        }
    }
}

/// Where something flows into the mesh or out of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowWell<const D: usize> {
    /// The place.
    pub place: Point<D>,
    /// What it brings in a unit of time; below 0 what it takes. Only the sign is drawn.
    pub rate: f64,
}

/// A line along which something flows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowLine<'a, const D: usize> {
    /// The places along it.
    pub points: &'a [Point<D>],
    /// The time of flight at each of them, in any unit.
    pub times: &'a [f64],
}

/// What there is to see of flow on a mesh. Whatever is empty is not drawn.
///
/// Points are in sample coordinates, and velocities are in samples in a unit of time, so that a velocity
/// is drawn as what it does to a point. Of a velocity in the world, that is the difference between where
/// [`Frame::world_to_lattice`](atomesh::image::Frame::world_to_lattice) puts two points that it parts.
#[derive(Clone, Copy, Debug)]
pub struct FlowPicture<'a, const D: usize> {
    /// The mesh.
    pub cells: FlowCells<'a, D>,
    /// What lies beneath, in grey. Without one, the picture ends where the mesh does, and samples are squares
    /// or cubes.
    pub image: Option<&'a Image<D>>,
    /// The numbers of facets that little or nothing passes: drawn bold.
    pub barriers: &'a [u32],
    /// A velocity for each cell, drawn where its middle is.
    pub velocities: &'a [Point<D>],
    /// A pressure for each cell, drawn as its colour in place of the image, from dark blue by green to yellow
    /// at the highest.
    pub pressures: &'a [f64],
    /// Wells: discs with a ring, red where something flows in, blue where it flows out.
    pub wells: &'a [FlowWell<D>],
    /// Streamlines, coloured by time from violet by red to yellow at the longest.
    pub lines: &'a [FlowLine<'a, D>],
}

impl<'a, const D: usize> FlowPicture<'a, D> {
    /// Cells alone.
    pub fn new(cells: FlowCells<'a, D>) -> Self {
        Self {
            cells,
            image: None,
            barriers: &[],
            velocities: &[],
            pressures: &[],
            wells: &[],
            lines: &[],
        }
    }

    fn check(&self) -> Result<(), DrawError> {
        let (cells, facets) = (self.cells.cell_count(), self.facet_count());
        for (what, found) in
            [("velocities", self.velocities.len()), ("pressures", self.pressures.len())]
        {
            if found != 0 && found != cells {
                return Err(DrawError::Count { what, found, expected: cells });
            }
        }
        if let Some(line) = self.lines.iter().find(|line| line.points.len() != line.times.len()) {
            let (found, expected) = (line.times.len(), line.points.len());
            return Err(DrawError::Count { what: "times of a streamline", found, expected });
        }
        match self.barriers.iter().find(|&&facet| facet as usize >= facets) {
            Some(&facet) => Err(DrawError::Facet { facet, count: facets }),
            None => Ok(()),
        }
    }

    fn facet_count(&self) -> usize {
        match self.cells {
            _ if self.barriers.is_empty() => 0,
            FlowCells::Simplices(mesh) => mesh.facets().len(),
            FlowCells::Polytopes(mesh) => mesh.face_count(),
        }
    }
}

/// How flow is drawn, besides [`Style`](crate::Style). The defaults were chosen by looking.
#[derive(Clone, Debug, PartialEq)]
pub struct FlowStyle {
    /// The width of barriers in pixels. Default 4.
    pub barrier_width: f64,
    /// How long the vector of a brisk flow is, faster than nine cells of ten that flow at all, over the typical
    /// edge. Default 1; shorter ones have lengths in proportion.
    pub vector_length: f64,
    /// How much longer than that a vector may be: beside wells flow is too fast to be drawn. Default 1.5.
    pub longest_vector: f64,
    /// The least distance in pixels between two vectors' middles: of cells nearer to each other the larger ones'
    /// are drawn. Default 7.
    pub vector_spacing: f64,
    /// Whether bars to the right say what colours stand for. Default true.
    pub legend: bool,
}

impl Default for FlowStyle {
    fn default() -> Self {
        Self {
            barrier_width: 4.0,
            vector_length: 1.0,
            longest_vector: 1.5,
            vector_spacing: 7.0,
            legend: true,
        }
    }
}

impl FlowStyle {
    /// The style, if its numbers have a meaning.
    fn checked(&self) -> Result<&Self, DrawError> {
        for (name, value, limit) in [
            ("barrier_width", self.barrier_width, Some(100.0)),
            ("vector_length", self.vector_length, Some(100.0)),
            ("longest_vector", self.longest_vector, Some(100.0)),
            ("vector_spacing", self.vector_spacing, Some(1000.0)),
        ] {
            if !(value > 0.0 && limit.is_none_or(|l| value <= l)) {
                return Err(DrawError::Style { name, value, limit });
            }
        }
        Ok(self)
    }
}
