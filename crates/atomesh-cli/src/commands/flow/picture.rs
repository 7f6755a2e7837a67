//! The picture of the flow, in the coordinates of the image's samples where there is a frame.

use atomesh::geometry::Point;
use atomesh::image::Units;
use atomesh::mesh::Mesh;
use atomesh::pipeline::lattice_mesh;
use atomesh::voronoi::PolyMesh;
use atomesh_draw::{FlowCells, FlowLine, FlowPicture, FlowStyle, FlowWell, Picture, Style};
use atomesh_flow::streamlines::Streamline;

use super::answer::Answer;
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
    let drawn = Drawn::new(answer, lines);
    let wells: Vec<FlowWell<D>> = (answer.setting.problem().wells.iter())
        .zip(&answer.solution.wells)
        .map(|(well, flow)| FlowWell { place: drawn.place(&well.place), rate: flow.rate })
        .collect();
    let barriers: Vec<u32> = (answer.setting.multipliers().iter().enumerate())
        .filter(|(_, multiplier)| **multiplier < 1.0)
        .map(|(facet, _)| facet as u32)
        .collect();
    let ways = lines.iter().zip(&drawn.lines);
    let lines: Vec<FlowLine<'_, D>> =
        ways.map(|(line, points)| FlowLine { points, times: &line.times }).collect();
    let pressures = if shows_pressure { &answer.solution.pressures[..] } else { &[] };
    let picture = FlowPicture {
        image: answer.ground.image.as_ref().filter(|_| !shows_pressure),
        barriers: &barriers,
        velocities: &drawn.velocities,
        pressures,
        wells: &wells,
        lines: &lines,
        ..FlowPicture::new(drawn.cells())
    };
    let ground = answer.ground;
    let style = Style { units: ground.units, z_up: ground.z_up, ..Style::default() };
    (dimension.draw_flow)(&picture, &style, &FlowStyle::default()).map_err(Failure::content)
}

/// What is drawn, in sample coordinates.
struct Drawn<'a, const D: usize> {
    answer: &'a Answer<'a, D>,
    mesh: Option<Mesh<D>>,
    polytopes: Option<PolyMesh<D>>,
    velocities: Vec<Point<D>>,
    lines: Vec<Vec<Point<D>>>,
}

impl<'a, const D: usize> Drawn<'a, D> {
    fn new(answer: &'a Answer<'a, D>, lines: &[Streamline<D>]) -> Self {
        let mut drawn =
            Self { answer, mesh: None, polytopes: None, velocities: Vec::new(), lines: Vec::new() };
        let frame = answer.ground.frame.as_ref();
        if let Some((cells, _)) = &answer.ground.cells {
            let mirrored = frame.is_some_and(|frame| frame.is_mirrored());
            drawn.polytopes = Some(cells.moved(mirrored, |p| drawn.place(p)));
        } else {
            let mesh = &answer.ground.mesh;
            drawn.mesh = Some(match frame {
                Some(frame) => lattice_mesh(mesh, frame, Units::Samples),
                None => mesh.clone(),
            });
        }
        let origin = drawn.place(&[0.0; D]);
        let turned = |v: &Point<D>| {
            let end = drawn.place(v);
            std::array::from_fn(|axis| end[axis] - origin[axis])
        };
        let velocities = answer.velocities.iter().map(turned).collect();
        let placed = |line: &Streamline<D>| line.points.iter().map(|p| drawn.place(p)).collect();
        let lines = lines.iter().map(placed).collect();
        Self { velocities, lines, ..drawn }
    }

    /// A place of the world among the samples.
    fn place(&self, p: &Point<D>) -> Point<D> {
        match &self.answer.ground.frame {
            Some(frame) => frame.world_to_lattice(Units::Samples, p),
            None => *p,
        }
    }

    fn cells(&self) -> FlowCells<'_, D> {
        match (&self.mesh, &self.polytopes) {
            (_, Some(cells)) => FlowCells::Polytopes(cells),
            (Some(mesh), None) => FlowCells::Simplices(mesh),
            (None, None) => FlowCells::Simplices(&self.answer.ground.mesh),
        }
    }
}
