//! Flow in space, in three slices.

use atomesh::geometry::{Point, dot};

use super::arrow::brisk;
use super::canvas::{Appearance, Canvas, Mark, NO_IMAGE, Tile};
use super::picture::{FlowCells, FlowPicture, FlowStyle, FlowWell};
use super::scene::{LARGER, Scene};
use super::space::in_space;
use crate::cut::{Level, unique};
use crate::error::DrawError;
use crate::label::label;
use crate::legend::put_beside;
use crate::panel::{GAP, Panel};
use crate::picture::Picture;
use crate::raster::Ramp;
use crate::shape::{Place, Rect, Shape};
use crate::style::Style;

/// Draws flow on tetrahedra or polyhedra in three slices through `at`, a place in sample coordinates. `None` is the
/// middle of the image, or of the mesh without an image. Vectors are velocities projected to the slice; edges are 1.5
/// times as long as [`Style::edge_pixels`]. Wells farther from a slice than an edge is long are drawn small. The upper
/// left panel shows barriers, streamlines and wells in space, or the image if there are none.
///
/// Cost: O(pixels + samples of the slices + cells log cells).
///
/// # Errors
/// As [`draw_flow`](super::draw_flow); [`DrawError::Slice`] if `at` is outside the image.
pub fn draw_flow_slices(
    flow: &FlowPicture<'_, 3>,
    at: Option<Point<3>>,
    style: &Style,
    flow_style: &FlowStyle,
) -> Result<Picture, DrawError> {
    let (style, flow_style) = (style.checked()?, flow_style.checked()?);
    flow.check()?;
    let scene = Scene::new(flow, at, style)?;
    let speed = |v: &Point<3>| {
        let v = scene.in_pixels(v);
        dot(&v, &v).sqrt()
    };
    let brisk = brisk(flow.velocities.iter().map(speed));
    let length = flow_style.vector_length * scene.edge_pixels / LARGER;
    let share = if brisk > 0.0 { length / brisk } else { 0.0 };
    let look = Appearance::new(flow, style, flow_style, length);
    let sides: Point<3> = std::array::from_fn(|k| scene.extent[k] * scene.pixels[k]);
    let mut picture = Picture::new([sides[0] + sides[1] + GAP, sides[1] + sides[2] + GAP]);
    let corner = Rect { corner: [0.0; 2], size: [sides[1]; 2] };
    picture.shapes.extend(in_space(&scene, &look, corner));
    let ramp = flow.image.map(|image| Ramp::robust(image.samples(), style.brightness));
    for panel in Panel::all(scene.first, sides, scene.pixels, style.z_up) {
        let slice = FlowSlice { scene: &scene, panel };
        picture.shapes.push(slice.background(ramp.as_ref()));
        let along = |cell: usize| slice.along(cell, share);
        picture.shapes.extend(slice.canvas().shapes(&look, &along));
        picture.shapes.push(panel.cross_hair(&scene.at));
        picture.shapes.extend(label(panel.slice.name, &panel.rect));
    }
    put_beside(&mut picture, &look.bars());
    Ok(picture)
}

/// One slice of the flow.
struct FlowSlice<'a> {
    scene: &'a Scene<'a>,
    panel: Panel,
}

impl FlowSlice<'_> {
    /// A cell's velocity, projected along the normal, in pixels, times `share`.
    fn along(&self, cell: usize, share: f64) -> Option<Place> {
        let v = self.scene.flow.velocities.get(cell).filter(|v| v.iter().all(|x| x.is_finite()))?;
        let v = self.scene.in_pixels(v);
        let down = if self.panel.is_flipped { -share } else { share };
        Some([v[self.panel.slice.right] * share, v[self.panel.slice.down] * down])
    }

    fn background(&self, ramp: Option<&Ramp>) -> Shape {
        let Scene { flow, style, .. } = self.scene;
        match (flow.image, ramp) {
            (Some(image), Some(ramp)) if flow.pressures.is_empty() => {
                self.panel.image(image, self.scene.sample(image), style.units, ramp)
            }
            _ => Shape::Fill { rect: self.panel.rect, color: NO_IMAGE },
        }
    }

    fn canvas(&self) -> Canvas {
        let Scene { flow, facets, pixels, edge_pixels, .. } = self.scene;
        let normal = self.panel.slice.normal;
        let level = self.level();
        let cut = |facet: &Vec<u32>| {
            let ends = level.cut(normal, &self.scene.corners(facet))?;
            Some(ends.map(|p| self.panel.place(&p)))
        };
        let mark = |well: &FlowWell<3>| Mark {
            place: self.panel.place(&well.place),
            is_source: well.rate > 0.0,
            is_near: (well.place[normal] - level.value).abs() * pixels[normal] <= *edge_pixels,
        };
        Canvas {
            rect: self.panel.rect,
            tiles: self.tiles(level),
            edges: unique(facets.iter().filter_map(cut)),
            barriers: unique(flow.barriers.iter().filter_map(|&f| cut(&facets[f as usize]))),
            marks: flow.wells.iter().map(mark).collect(),
            lines: Vec::new(),
        }
    }

    fn level(&self) -> Level {
        let (value, normal) = (self.scene.at[self.panel.slice.normal], self.panel.slice.normal);
        let least =
            self.scene.first[normal] + if self.scene.flow.image.is_some() { 0.5 } else { 0.0 };
        Level { value, own_is_above: value > least }
    }

    /// The parts of cells that the slice shows.
    fn tiles(&self, level: Level) -> Vec<Tile> {
        let cut = |faces: &mut dyn Iterator<Item = Vec<Point<3>>>| -> Vec<Place> {
            let ends = faces.filter_map(|face| level.cut(self.panel.slice.normal, &face)).flatten();
            around(ends.map(|p| self.panel.place(&p)).collect())
        };
        let polygon = |cell: usize| match self.scene.flow.cells {
            FlowCells::Simplices(mesh) => {
                let corners: [Point<3>; 4] =
                    [0, 1, 2, 3].map(|k| mesh.points()[mesh.corners()[4 * cell + k] as usize]);
                let below = corners.map(|p| level.is_below(p[self.panel.slice.normal]));
                if below == [below[0]; 4] {
                    return Vec::new(); // as most cells
                }
                cut(&mut (0..4).map(|off| [1, 2, 3].map(|k| corners[(off + k) % 4]).to_vec()))
            }
            FlowCells::Polytopes(mesh) => {
                let faces = mesh.faces_of(cell).map(|(face, _)| mesh.face(face));
                cut(&mut faces.map(|face| self.scene.corners(face)))
            }
        };
        let tiles = (0..self.scene.flow.cells.cell_count())
            .map(|cell| Tile { cell, polygon: polygon(cell) });
        tiles.filter(|tile| tile.polygon.len() > 2).collect()
    }
}

/// Orders the corners of a convex polygon around it; they may be repeated.
fn around(mut corners: Vec<Place>) -> Vec<Place> {
    let count = corners.len() as f64;
    let mean: Place = std::array::from_fn(|k| corners.iter().map(|p| p[k]).sum::<f64>() / count);
    let angle = |p: &Place| (p[1] - mean[1]).atan2(p[0] - mean[0]);
    corners.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    corners.dedup();
    corners
}
