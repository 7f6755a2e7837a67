//! Flow in space, in three slices.

use atomesh::geometry::{Bounds, Point, difference, dot};

use super::arrow::brisk;
use super::flat::GROUND;
use super::sheet::{Looks, Mark, PRESSURE_CUT, Sheet, TIME_CUT, Tile};
use super::space::in_space;
use super::{FlowCells, FlowPicture, FlowStyle};
use crate::color_map::Range;
use crate::flat::{LOOKS, median, scale, typical_length};
use crate::label::label;
use crate::legend::put_beside;
use crate::picture::{Picture, Place, Rect, Shape};
use crate::raster::Ramp;
use crate::slices::{CROSS_HAIR, GAP, Level, PLANES, Plane, unique};
use crate::{DrawError, Style};

/// Draws flow on tetrahedra or polyhedra in three slices through `at`, a place in sample coordinates; through
/// the middle of the image, or of the mesh if there is none, where it is `None`. Vectors are velocities as they
/// are seen along a slice's normal; edges are half as long again as [`Style::edge_pixels`] says. Wells farther from a slice than an edge is long are drawn small. The panel
/// upper left shows barriers, streamlines and wells in space; the image where there are none.
///
/// Cost: O(pixels + samples of the slices + cells log cells).
///
/// # Errors
/// As [`draw_flow`](super::draw_flow); [`DrawError::Slice`] if `at` is outside the image.
pub fn draw_flow_slices(
    flow: &FlowPicture<3>,
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
    let times = flow.lines.iter().flat_map(|line| line.times).copied();
    let looks = Looks {
        style,
        flow: flow_style,
        pressures: flow.pressures,
        pressure: Range::robust(flow.pressures.iter().copied(), PRESSURE_CUT),
        time: Range::robust(times, TIME_CUT),
        longest: length * flow_style.longest_vector,
    };
    let sides: Point<3> = std::array::from_fn(|k| scene.extent[k] * scene.pixels[k]);
    let mut picture = Picture::new([sides[0] + sides[1] + GAP, sides[1] + sides[2] + GAP]);
    let corner = Rect { corner: [0.0; 2], size: [sides[1]; 2] };
    picture.shapes.extend(in_space(&scene, &looks, corner));
    let ramp = flow.image.map(|image| Ramp::robust(image.samples(), style.brightness));
    for (plane, [column, row]) in &PLANES {
        let corner = [*column, *row].map(|step| step as f64 * (sides[1] + GAP));
        let size = [plane.right, plane.down].map(|k| sides[k]);
        let panel = Panel { scene: &scene, plane, rect: Rect { corner, size } };
        picture.shapes.push(panel.background(ramp.as_ref()));
        let along = |cell: usize| panel.along(cell, share);
        picture.shapes.extend(panel.sheet().shapes(&looks, &along));
        picture.shapes.extend(panel.cross_hair());
        picture.shapes.extend(label(plane.name, &panel.rect));
    }
    put_beside(&mut picture, &looks.bars());
    Ok(picture)
}

/// What all panels show.
pub(super) struct Scene<'a> {
    pub flow: &'a FlowPicture<'a, 3>,
    pub style: &'a Style,
    /// The facets' corners.
    pub facets: Vec<Vec<u32>>,
    /// Where the slices meet.
    pub at: Point<3>,
    /// The least sample coordinates, and how far they go on.
    pub first: Point<3>,
    pub extent: Point<3>,
    /// Pixels to a sample along each axis.
    pub pixels: Point<3>,
    /// The length of a typical edge in pixels.
    pub edge_pixels: f64,
}

impl<'a> Scene<'a> {
    fn new(
        flow: &'a FlowPicture<'a, 3>,
        at: Option<Point<3>>,
        style: &'a Style,
    ) -> Result<Self, DrawError> {
        let (first, extent, middle) = match flow.image {
            Some(image) => {
                let shape = image.frame().shape();
                ([-0.5; 3], shape.map(|n| n as f64), shape.map(|n| (n / 2) as f64))
            }
            None => {
                let none = Bounds { min: [0.0; 3], max: [1.0; 3] };
                let bounds = Bounds::of(flow.cells.points()).unwrap_or(none);
                let extent = bounds.extent().map(|x| x.max(f64::MIN_POSITIVE));
                let middle = std::array::from_fn(|k| bounds.min[k] + 0.5 * extent[k]);
                (bounds.min, extent, middle)
            }
        };
        let at = at.unwrap_or(middle);
        for axis in 0..3 {
            if !(first[axis]..=first[axis] + extent[axis]).contains(&at[axis]) {
                let (at, count) = (at[axis].max(0.0) as usize, extent[axis] as usize);
                return Err(DrawError::Slice { axis, at, count });
            }
        }
        let step = flow.image.map_or([1.0; 3], |image| image.frame().grid(style.units).step);
        let sides: Point<3> = std::array::from_fn(|k| extent[k] * step[k]);
        let edge = typical_edge(&flow.cells, &step);
        let larger = Style { edge_pixels: LARGER * style.edge_pixels, ..style.clone() };
        let scale = scale(edge, &[sides[1] + sides[0], sides[1] + sides[2]], &larger);
        let edge_pixels = edge.map_or(style.edge_pixels, |edge| edge * scale);
        let (facets, pixels) = (flow.cells.facets(), step.map(|s| s * scale));
        Ok(Self { flow, style, facets, at, first, extent, pixels, edge_pixels })
    }

    pub fn in_pixels(&self, v: &Point<3>) -> Point<3> {
        std::array::from_fn(|k| v[k] * self.pixels[k])
    }

    pub fn corners(&self, numbers: &[u32]) -> Vec<Point<3>> {
        numbers.iter().map(|&c| self.flow.cells.points()[c as usize]).collect()
    }
}

/// How much larger cells are drawn than the style says, and their parts in slices smaller than cells: there is a
/// vector in each part.
const LARGER: f64 = 1.5;

/// The median length of edges of tetrahedra, or from site to site of Voronoi cells.
fn typical_edge(cells: &FlowCells<3>, step: &Point<3>) -> Option<f64> {
    match cells {
        FlowCells::Simplices(mesh) => typical_length(mesh, step),
        FlowCells::Polytopes(mesh) => {
            let stride = mesh.inner_face_count().div_ceil(LOOKS).max(1);
            let pairs = mesh.owners().iter().zip(mesh.neighbours()).step_by(stride);
            let length = |(&a, &b): (&u32, &u32)| {
                let way = difference(&mesh.centers()[a as usize], &mesh.centers()[b as usize]);
                (0..3).map(|k| (way[k] * step[k]).powi(2)).sum::<f64>().sqrt()
            };
            median(pairs.map(length).collect())
        }
    }
}

/// One slice in its place.
struct Panel<'a> {
    scene: &'a Scene<'a>,
    plane: &'a Plane,
    rect: Rect,
}

impl Panel<'_> {
    /// Whether the axis drawn downward is shown from its end.
    fn flipped(&self) -> bool {
        self.scene.style.z_up && self.plane.down == 2
    }

    /// Where a point, seen along the normal, is in the picture.
    fn place(&self, p: &Point<3>) -> Place {
        let Scene { first, pixels, .. } = self.scene;
        let [x, y] = [self.plane.right, self.plane.down].map(|k| (p[k] - first[k]) * pixels[k]);
        let y = if self.flipped() { self.rect.size[1] - y } else { y };
        [self.rect.corner[0] + x, self.rect.corner[1] + y]
    }

    /// A cell's velocity as seen along the normal, in pixels, times `share`.
    fn along(&self, cell: usize, share: f64) -> Option<Place> {
        let v = self.scene.flow.velocities.get(cell).filter(|v| v.iter().all(|x| x.is_finite()))?;
        let v = self.scene.in_pixels(v);
        let down = if self.flipped() { -share } else { share };
        Some([v[self.plane.right] * share, v[self.plane.down] * down])
    }

    fn background(&self, ramp: Option<&Ramp>) -> Shape {
        let rect = self.rect;
        let (Some(image), Some(ramp), true) =
            (self.scene.flow.image, ramp, self.scene.flow.pressures.is_empty())
        else {
            return Shape::Fill { rect, color: GROUND };
        };
        let Plane { normal, right, down, .. } = *self.plane;
        let grid = image.frame().grid(self.scene.style.units);
        let (shape, strides) = (grid.shape, grid.strides());
        let at = (self.scene.at[normal].round().max(0.0) as usize).min(shape[normal] - 1);
        let start = at * strides[normal];
        let raster = ramp.raster(image.samples(), shape[right], shape[down], |i, j| {
            let j = if self.flipped() { shape[down] - 1 - j } else { j };
            start + i * strides[right] + j * strides[down]
        });
        Shape::upright(raster, rect)
    }

    fn sheet(&self) -> Sheet {
        let Scene { flow, facets, pixels, edge_pixels, .. } = self.scene;
        let normal = self.plane.normal;
        let level = self.level();
        let cut = |facet: &Vec<u32>| {
            let ends = level.cut(normal, &self.scene.corners(facet))?;
            Some(ends.map(|p| self.place(&p)))
        };
        let mark = |well: &super::FlowWell<3>| Mark {
            place: self.place(&well.place),
            is_source: well.rate > 0.0,
            is_near: (well.place[normal] - level.value).abs() * pixels[normal] <= *edge_pixels,
        };
        Sheet {
            rect: self.rect,
            tiles: self.tiles(level),
            edges: unique(facets.iter().filter_map(cut)),
            barriers: unique(flow.barriers.iter().filter_map(|&f| cut(&facets[f as usize]))),
            marks: flow.wells.iter().map(mark).collect(),
            lines: Vec::new(),
        }
    }

    fn level(&self) -> Level {
        let (value, normal) = (self.scene.at[self.plane.normal], self.plane.normal);
        let least =
            self.scene.first[normal] + if self.scene.flow.image.is_some() { 0.5 } else { 0.0 };
        Level { value, own_is_above: value > least }
    }

    /// The parts of cells that the slice shows.
    fn tiles(&self, level: Level) -> Vec<Tile> {
        let cut = |faces: &mut dyn Iterator<Item = Vec<Point<3>>>| -> Vec<Place> {
            let ends = faces.filter_map(|face| level.cut(self.plane.normal, &face)).flatten();
            around(ends.map(|p| self.place(&p)).collect())
        };
        let polygon = |cell: usize| match self.scene.flow.cells {
            FlowCells::Simplices(mesh) => {
                let corners: [Point<3>; 4] =
                    [0, 1, 2, 3].map(|k| mesh.points()[mesh.corners()[4 * cell + k] as usize]);
                let below = corners.map(|p| level.is_below(p[self.plane.normal]));
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

    /// Where the other slices pass.
    fn cross_hair(&self) -> Option<Shape> {
        let Rect { corner, size } = self.rect;
        let [x, y] = self.place(&self.scene.at);
        let end = [corner[0] + size[0], corner[1] + size[1]];
        let lines = vec![[[corner[0], y], [end[0], y]], [[x, corner[1]], [x, end[1]]]];
        Some(Shape::Lines { lines, width: 1.0, color: CROSS_HAIR })
    }
}

/// The corners of a convex polygon, in any order and more than once, in the order around it.
fn around(mut corners: Vec<Place>) -> Vec<Place> {
    let count = corners.len() as f64;
    let mean: Place = std::array::from_fn(|k| corners.iter().map(|p| p[k]).sum::<f64>() / count);
    let angle = |p: &Place| (p[1] - mean[1]).atan2(p[0] - mean[0]);
    corners.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    corners.dedup();
    corners
}
