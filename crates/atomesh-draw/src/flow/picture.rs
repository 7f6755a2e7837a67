//! The contents of a picture of flow, and its style.

use atomesh::geometry::{Bounds, Point};
use atomesh::image::Image;
use atomesh::mesh::{Mesh, PolyMesh};

use crate::error::DrawError;

/// The cells of the flow.
#[derive(Clone, Copy, Debug)]
pub enum FlowCells<'a, const D: usize> {
    /// Triangles or tetrahedra; facets are those of [`Mesh::facets`].
    Simplices(&'a Mesh<D>),
    /// Voronoi cells; facets are the mesh's faces.
    Polytopes(&'a PolyMesh<D>),
}

impl<const D: usize> FlowCells<'_, D> {
    pub(crate) fn cell_count(&self) -> usize {
        match self {
            Self::Simplices(mesh) => mesh.cell_count(),
            Self::Polytopes(mesh) => mesh.cell_count(),
        }
    }

    pub(crate) fn points(&self) -> &[Point<D>] {
        match self {
            Self::Simplices(mesh) => mesh.points(),
            Self::Polytopes(mesh) => mesh.points(),
        }
    }

    /// The box of a picture: its least sample coordinates and its extent, those of the image or else of the mesh.
    pub(crate) fn shown_box(&self, image: Option<&Image<D>>) -> (Point<D>, Point<D>) {
        match image {
            Some(image) => ([-0.5; D], image.frame().shape().map(|n| n as f64)),
            None => {
                let none = Bounds { min: [0.0; D], max: [1.0; D] };
                let bounds = Bounds::of(self.points()).unwrap_or(none);
                (bounds.min, bounds.extent().map(|x| x.max(f64::MIN_POSITIVE)))
            }
        }
    }

    /// Visits the facets in their order: their corners, their cell, and the cell beyond them if there is one.
    pub(crate) fn each_facet(&self, mut visit: impl FnMut(&[u32], u32, Option<u32>)) {
        match self {
            Self::Simplices(mesh) => {
                for facet in mesh.facets() {
                    visit(&facet.corners, facet.cell, facet.neighbour);
                }
            }
            Self::Polytopes(mesh) => {
                for (face, &owner) in mesh.owners().iter().enumerate() {
                    visit(mesh.face(face), owner, mesh.neighbours().get(face).copied());
                }
            }
        }
    }

    /// The facets' corners.
    pub(super) fn facets(&self) -> Vec<Vec<u32>> {
        let mut facets = Vec::new();
        self.each_facet(|corners, _, _| facets.push(corners.to_vec()));
        facets
    }
}

/// A well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowWell<const D: usize> {
    /// The place.
    pub place: Point<D>,
    /// The inflow per unit of time; below 0 outflow. Only the sign is drawn.
    pub rate: f64,
}

/// A streamline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowLine<'a, const D: usize> {
    /// The places along it.
    pub points: &'a [Point<D>],
    /// The time of flight at each of them, in any unit.
    pub times: &'a [f64],
}

/// The contents of a picture of flow on a mesh. Whatever is empty is not drawn.
///
/// Points are in sample coordinates, velocities in samples per unit of time. To convert a velocity v of the world, take
/// f(x + v) − f(x) with f = [`Frame::world_to_lattice`](atomesh::image::Frame::world_to_lattice) in samples.
#[derive(Clone, Copy, Debug)]
pub struct FlowPicture<'a, const D: usize> {
    /// The mesh.
    pub cells: FlowCells<'a, D>,
    /// The image behind the mesh, in grey. Without one, the picture ends where the mesh does, and samples are squares
    /// or cubes.
    pub image: Option<&'a Image<D>>,
    /// The numbers of facets that are barriers, drawn bold.
    pub barriers: &'a [u32],
    /// The velocity of each cell, drawn at its centre.
    pub velocities: &'a [Point<D>],
    /// The pressure of each cell, drawn as its colour in place of the image, from dark blue through green to yellow
    /// at the highest.
    pub pressures: &'a [f64],
    /// The part of each cell, from 1 on, drawn as its colour over the image: a few that are unlike, again and again.
    pub parts: &'a [i32],
    /// Wells: discs with a ring, red where something flows in, blue where it flows out.
    pub wells: &'a [FlowWell<D>],
    /// Streamlines, coloured by time from violet through red to yellow at the longest.
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
            parts: &[],
            wells: &[],
            lines: &[],
        }
    }

    pub(super) fn check(&self) -> Result<(), DrawError> {
        let (cells, facets) = (self.cells.cell_count(), self.facet_count());
        for (what, found) in [
            ("velocities", self.velocities.len()),
            ("pressures", self.pressures.len()),
            ("parts", self.parts.len()),
        ] {
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

/// The style of flow, besides [`Style`](crate::Style). The defaults were chosen by eye.
#[derive(Clone, Debug, PartialEq)]
pub struct FlowStyle {
    /// The width of barriers in pixels. Default 4.
    pub barrier_width: f64,
    /// The length of the vector of a brisk flow, the 90th percentile of the cells that flow, relative to the typical
    /// edge. Default 1; other vectors have lengths in proportion.
    pub vector_length: f64,
    /// The longest vector, relative to that of a brisk flow; beside wells flow is faster. Default 1.5.
    pub longest_vector: f64,
    /// The least distance in pixels between the middles of two vectors; of nearer cells the largest ones' are drawn.
    /// Default 7.
    pub vector_spacing: f64,
    /// Whether there is a legend of colours to the right. Default true.
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
    /// The style, if its numbers are in range.
    pub(super) fn checked(&self) -> Result<&Self, DrawError> {
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
