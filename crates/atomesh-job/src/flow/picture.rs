//! The picture of the flow, in the coordinates of the image's samples where there is a frame.

use atomesh::geometry::Point;
use atomesh::image::Units;
use atomesh_draw::{FlowLine, FlowPicture, FlowStyle, FlowWell, Picture, Style};
use atomesh_flow::streamlines::Streamline;
use atomesh_flow::{Setting, WellFlow};

use super::answer::FlowAnswer;
use super::flow_mesh::{FlowMesh, FlowMeshCells};
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::in_samples::InSamples;

/// What a picture shows of an answer.
#[derive(Clone, Copy, Debug)]
pub struct FlowPictureOptions<'a, const D: usize> {
    /// Whether pressures are shown behind the mesh, in place of the image.
    pub shows_pressure: bool,
    /// Streamlines that are drawn too.
    pub lines: &'a [Streamline<D>],
    /// The longest side in pixels.
    pub max_side: f64,
}

impl<const D: usize> Default for FlowPictureOptions<'_, D> {
    fn default() -> Self {
        Self { shows_pressure: false, lines: &[], max_side: Style::default().max_side }
    }
}

/// An answer to be drawn.
pub(super) struct FlowDrawing<'a, const D: usize> {
    pub answer: &'a FlowAnswer<D>,
    pub setting: &'a Setting<'a, D>,
    pub shown: &'a FlowPictureOptions<'a, D>,
}

impl<const D: usize> FlowDrawing<'_, D> {
    /// Draws the answer.
    ///
    /// # Errors
    /// [`JobError`] if it cannot be drawn.
    pub fn picture(&self, dimension: &Dimension<D>) -> Result<Picture, JobError> {
        let Self { answer, setting, shown } = *self;
        let FlowPictureOptions { shows_pressure, lines, max_side } = *shown;
        let mesh = &answer.mesh;
        let shape = in_samples(mesh);
        let turn = |v: &Point<D>| turned(mesh, v);
        let velocities: Vec<Point<D>> = answer.velocities.iter().map(turn).collect();
        let wells: Vec<FlowWell<D>> = (answer.problem.wells.iter())
            .zip(&answer.solution.wells)
            .map(|(well, flow)| FlowWell { place: place(mesh, &well.place), rate: flow.rate })
            .collect();
        let barriers: Vec<u32> = (setting.multipliers().iter().enumerate())
            .filter(|(_, multiplier)| **multiplier < 1.0)
            .map(|(facet, _)| facet as u32)
            .collect();
        let placed = |line: &Streamline<D>| line.points.iter().map(|p| place(mesh, p)).collect();
        let ways: Vec<Vec<Point<D>>> = lines.iter().map(placed).collect();
        let lines: Vec<FlowLine<'_, D>> = (lines.iter().zip(&ways))
            .map(|(line, points)| FlowLine { points, times: &line.times })
            .collect();
        let pressures = if shows_pressure { self.shown_pressures() } else { Vec::new() };
        let picture = FlowPicture {
            image: mesh.image.as_ref().filter(|_| !shows_pressure),
            barriers: &barriers,
            velocities: &velocities,
            pressures: &pressures,
            wells: &wells,
            lines: &lines,
            ..FlowPicture::new(shape.cells())
        };
        let style = Style { units: mesh.units, z_up: mesh.z_up, max_side, ..Style::default() };
        (dimension.drawing.flow)(&picture, &style, &FlowStyle::default()).map_err(JobError::content)
    }

    /// The pressures, NaN where nothing flows in a compartment of unknown pressure: those would stretch the colours.
    fn shown_pressures(&self) -> Vec<f64> {
        let solution = &self.answer.solution;
        let still = |number: u32| {
            let has_well = |well: &WellFlow| well.compartment == number as usize + 1;
            solution.pinned.contains(&(number as usize + 1)) && !solution.wells.iter().any(has_well)
        };
        let of_cells = self.setting.compartment_of().iter().zip(&solution.pressures);
        of_cells.map(|(&number, &p)| if still(number) { f64::NAN } else { p }).collect()
    }
}

/// The cells in sample coordinates.
fn in_samples<const D: usize>(mesh: &FlowMesh<D>) -> InSamples<D> {
    let frame = mesh.frame.as_ref();
    match &mesh.cells {
        FlowMeshCells::Voronoi { cells, .. } => InSamples::of_cells(cells, frame),
        FlowMeshCells::Simplices { mesh, .. } => InSamples::of_mesh(mesh, frame),
    }
}

/// A place of the world among the samples.
fn place<const D: usize>(mesh: &FlowMesh<D>, p: &Point<D>) -> Point<D> {
    match &mesh.frame {
        Some(frame) => frame.world_to_lattice(Units::Samples, p),
        None => *p,
    }
}

/// A vector of the world in samples.
fn turned<const D: usize>(mesh: &FlowMesh<D>, vector: &Point<D>) -> Point<D> {
    let (origin, end) = (place(mesh, &[0.0; D]), place(mesh, vector));
    std::array::from_fn(|axis| end[axis] - origin[axis])
}
