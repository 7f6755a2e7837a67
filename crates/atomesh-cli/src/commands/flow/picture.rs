//! The picture of the flow, in the coordinates of the image's samples where there is a frame.

use atomesh::geometry::Point;
use atomesh::image::Units;
use atomesh::mesh::{Mesh, PolyMesh};
use atomesh::run::lattice_mesh;
use atomesh_draw::{FlowCells, FlowLine, FlowPicture, FlowStyle, FlowWell, Picture, Style};
use atomesh_flow::streamlines::Streamline;

use super::answer::Answer;
use super::ground::{Body, Ground};
use crate::dimension::Dimension;
use crate::failure::Failure;

/// Draws the answer.
///
/// # Errors
/// [`Failure`] if it cannot be drawn.
pub fn picture<const D: usize>(
    answer: &Answer<'_, D>,
    shows_pressure: bool,
    lines: &[Streamline<D>],
    dimension: &Dimension<D>,
) -> Result<Picture, Failure> {
    let ground = answer.ground;
    let shape = Shape::new(ground);
    let turn = |v: &Point<D>| turned(ground, v);
    let velocities: Vec<Point<D>> = answer.velocities.iter().map(turn).collect();
    let wells: Vec<FlowWell<D>> = (answer.setting.problem().wells.iter())
        .zip(&answer.solution.wells)
        .map(|(well, flow)| FlowWell { place: place(ground, &well.place), rate: flow.rate })
        .collect();
    let barriers: Vec<u32> = (answer.setting.multipliers().iter().enumerate())
        .filter(|(_, multiplier)| **multiplier < 1.0)
        .map(|(facet, _)| facet as u32)
        .collect();
    let placed = |line: &Streamline<D>| line.points.iter().map(|p| place(ground, p)).collect();
    let ways: Vec<Vec<Point<D>>> = lines.iter().map(placed).collect();
    let lines: Vec<FlowLine<'_, D>> = (lines.iter().zip(&ways))
        .map(|(line, points)| FlowLine { points, times: &line.times })
        .collect();
    let pressures = if shows_pressure { shown_pressures(answer) } else { Vec::new() };
    let picture = FlowPicture {
        image: ground.image.as_ref().filter(|_| !shows_pressure),
        barriers: &barriers,
        velocities: &velocities,
        pressures: &pressures,
        wells: &wells,
        lines: &lines,
        ..FlowPicture::new(shape.cells())
    };
    let style = Style { units: ground.units, z_up: ground.z_up, ..Style::default() };
    (dimension.draw_flow)(&picture, &style, &FlowStyle::default()).map_err(Failure::content)
}

/// The cells in sample coordinates.
enum Shape<const D: usize> {
    Simplices(Mesh<D>),
    Polytopes(Box<PolyMesh<D>>),
}

impl<const D: usize> Shape<D> {
    fn new(ground: &Ground<D>) -> Self {
        let frame = ground.frame.as_ref();
        match &ground.body {
            Body::Polytopes(cells, _) => {
                let mirrored = frame.is_some_and(|frame| frame.is_mirrored());
                Self::Polytopes(Box::new(cells.moved(mirrored, |p| place(ground, p))))
            }
            Body::Simplices(mesh, _) => Self::Simplices(match frame {
                Some(frame) => lattice_mesh(mesh, frame, Units::Samples),
                None => mesh.clone(),
            }),
        }
    }

    fn cells(&self) -> FlowCells<'_, D> {
        match self {
            Self::Simplices(mesh) => FlowCells::Simplices(mesh),
            Self::Polytopes(cells) => FlowCells::Polytopes(cells),
        }
    }
}

/// A place of the world among the samples.
fn place<const D: usize>(ground: &Ground<D>, p: &Point<D>) -> Point<D> {
    match &ground.frame {
        Some(frame) => frame.world_to_lattice(Units::Samples, p),
        None => *p,
    }
}

/// A vector of the world in samples.
fn turned<const D: usize>(ground: &Ground<D>, vector: &Point<D>) -> Point<D> {
    let (origin, end) = (place(ground, &[0.0; D]), place(ground, vector));
    std::array::from_fn(|axis| end[axis] - origin[axis])
}

/// The pressures, NaN where nothing flows in a compartment of unknown pressure: those would stretch the colours.
fn shown_pressures<const D: usize>(answer: &Answer<'_, D>) -> Vec<f64> {
    let (setting, solution) = (answer.setting, &answer.solution);
    let still = |number: u32| {
        let has_well = |well: &atomesh_flow::WellFlow| well.compartment == number as usize + 1;
        solution.pinned.contains(&(number as usize + 1)) && !solution.wells.iter().any(has_well)
    };
    let of_cells = setting.compartment_of().iter().zip(&solution.pressures);
    of_cells.map(|(&number, &p)| if still(number) { f64::NAN } else { p }).collect()
}
