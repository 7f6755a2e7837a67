//! What flow is drawn on: the plane of a mesh of triangles or polygons, or one slice of a mesh in space.

use std::f64::consts::TAU;

use super::arrow::{Vector, outline, thinned};
use super::clip;
use super::picture::{FlowPicture, FlowStyle};
use crate::color_map::{PLASMA, Range, VIRIDIS, color_of_part};
use crate::legend::Bar;
use crate::shape::{Place, Rect, Shape};
use crate::style::{Color, Style};

/// The colours of vectors and of their halos, which set them off from dark ground.
const VECTOR: Color = [0; 3];
const HALO: Color = [190; 3];

/// The colour behind flow without an image: a middle grey, since edges are white.
pub(super) const NO_IMAGE: Color = [140; 3];

/// The width in pixels of the casing of barriers and streamlines, on each side.
const CASING: f64 = 1.0;
const CASING_COLOR: Color = [30; 3];

/// The width of streamlines in pixels.
const LINE: f64 = 2.0;

/// The colours of wells and their rings, and their radius in pixels.
const SOURCE: Color = [214, 40, 30];
const SINK: Color = [20, 80, 200];
const RING: Color = [255; 3];
const WELL: f64 = 5.5;

/// Vectors shorter than this many pixels are dots.
const SHORTEST: f64 = 1.5;

/// A cell, or the part of one that a slice shows.
pub(super) struct Tile {
    pub cell: usize,
    pub polygon: Vec<Place>,
}

/// A well on a canvas.
pub(super) struct Mark {
    pub place: Place,
    pub is_source: bool,
    /// Whether it lies on the canvas, or nearly; else before or behind it.
    pub is_near: bool,
}

/// What a canvas shows.
pub(super) struct Canvas {
    pub rect: Rect,
    pub tiles: Vec<Tile>,
    pub edges: Vec<[Place; 2]>,
    pub barriers: Vec<[Place; 2]>,
    pub marks: Vec<Mark>,
    /// Pieces of streamlines.
    pub lines: Vec<Segment>,
}

/// A piece of a streamline.
#[derive(Clone, Copy)]
pub(super) struct Segment {
    /// The time of flight to its middle.
    pub time: f64,
    pub ends: [Place; 2],
}

/// What all canvases of a picture share.
pub(super) struct Appearance<'a> {
    pub style: &'a Style,
    pub flow: &'a FlowStyle,
    /// Pressures of all cells, and their range.
    pub pressures: &'a [f64],
    /// The part of each cell.
    pub parts: &'a [i32],
    /// Whether an image is behind the cells.
    pub has_image: bool,
    pub pressure: Option<Range>,
    /// The range of times of flight.
    pub time: Option<Range>,
    /// The longest vector in pixels.
    pub longest: f64,
}

impl<'a> Appearance<'a> {
    /// The appearance of a picture in which the vector of a brisk flow is `length` pixels long.
    pub fn new<const D: usize>(
        flow: &FlowPicture<'a, D>,
        style: &'a Style,
        flow_style: &'a FlowStyle,
        length: f64,
    ) -> Self {
        let times = flow.lines.iter().flat_map(|line| line.times).copied();
        Self {
            style,
            flow: flow_style,
            pressures: flow.pressures,
            parts: flow.parts,
            has_image: flow.image.is_some(),
            pressure: Range::robust(flow.pressures.iter().copied(), PRESSURE_CUT),
            time: Range::robust(times, TIME_CUT),
            longest: length * flow_style.longest_vector,
        }
    }

    /// The bars of the legend.
    pub fn bars(&self) -> Vec<Bar> {
        let pressure = self.pressure.map(|range| Bar { name: "PRESSURE", map: VIRIDIS, range });
        let time = self.time.map(|range| Bar { name: "TIME", map: PLASMA, range });
        let bars = [pressure, time].into_iter().flatten();
        bars.filter(|_| self.flow.legend).collect()
    }
}

/// How much of an image the colours of parts cover.
const TINT: f64 = 0.45;

/// The share of cells beyond each end of the colours of pressures: those at wells are extreme.
const PRESSURE_CUT: [f64; 2] = [0.005; 2];

/// The share of points of streamlines beyond the last colour of times: where flow is slow, times are extreme.
const TIME_CUT: [f64; 2] = [0.0, 0.05];

impl Canvas {
    /// The shapes, without the background. `along` is a cell's vector in pixels, if it has one.
    pub fn shapes(&self, look: &Appearance, along: &dyn Fn(usize) -> Option<Place>) -> Vec<Shape> {
        let mut shapes = Vec::new();
        if let Some(range) = look.pressure {
            let tiles = self
                .tiles
                .iter()
                .map(|tile| (look.pressures[tile.cell], clip::polygon(&tile.polygon, &self.rect)));
            let groups = range.grouped(VIRIDIS, tiles).into_iter();
            shapes.extend(groups.map(|(color, polygons)| Shape::Polygons {
                polygons,
                color,
                smooth: false,
            }));
        }
        self.push_parts(look, &mut shapes);
        if look.style.edges {
            let (width, color) = (look.style.edge_width, look.style.edge_color);
            shapes.push(Shape::Lines { lines: self.within(&self.edges), width, color });
        }
        self.push_barriers(look, &mut shapes);
        self.push_lines(look, &mut shapes);
        self.push_vectors(look, along, &mut shapes);
        shapes.extend(self.marks.iter().flat_map(|mark| mark_shapes(mark, &self.rect)));
        shapes
    }

    fn push_parts(&self, look: &Appearance, shapes: &mut Vec<Shape>) {
        let mut tiles: Vec<(i32, &Tile)> = (self.tiles.iter())
            .filter_map(|tile| Some((*look.parts.get(tile.cell)?, tile)))
            .collect();
        tiles.sort_by_key(|(part, _)| *part); // stable
        shapes.extend(tiles.chunk_by(|a, b| a.0 == b.0).map(|tiles| Shape::Tint {
            polygons:
                tiles.iter().map(|(_, tile)| clip::polygon(&tile.polygon, &self.rect)).collect(),
            color: color_of_part(tiles[0].0),
            opacity: if look.has_image { TINT } else { 1.0 },
        }));
    }

    fn within(&self, lines: &[[Place; 2]]) -> Vec<[Place; 2]> {
        lines.iter().filter_map(|&line| clip::line(line, &self.rect)).collect()
    }

    fn push_barriers(&self, look: &Appearance, shapes: &mut Vec<Shape>) {
        let lines = self.within(&self.barriers);
        if lines.is_empty() {
            return;
        }
        let (width, color) = (look.flow.barrier_width, look.style.edge_color);
        let casing =
            Shape::Lines { lines: lines.clone(), width: width + 2.0 * CASING, color: CASING_COLOR };
        shapes.extend([casing, Shape::Lines { lines, width, color }]);
    }

    fn push_lines(&self, look: &Appearance, shapes: &mut Vec<Shape>) {
        let Some(range) = look.time else { return };
        let clipped = |segment: &Segment| {
            clip::line(segment.ends, &self.rect).map(|line| (segment.time, line))
        };
        let lines: Vec<(f64, [Place; 2])> = self.lines.iter().filter_map(clipped).collect();
        if lines.is_empty() {
            return;
        }
        shapes.push(Shape::Lines {
            lines: lines.iter().map(|(_, line)| *line).collect(),
            width: LINE + 2.0 * CASING,
            color: CASING_COLOR,
        });
        for (color, lines) in range.grouped(PLASMA, lines.into_iter()) {
            shapes.push(Shape::Lines { lines, width: LINE, color });
        }
    }

    fn push_vectors(
        &self,
        look: &Appearance,
        along: &dyn Fn(usize) -> Option<Place>,
        shapes: &mut Vec<Shape>,
    ) {
        let vector = |tile: &Tile| {
            let (middle, weight) = middle(&tile.polygon)?;
            let along = along(tile.cell)?;
            let length = along[0].hypot(along[1]);
            let share = if length > look.longest { look.longest / length } else { 1.0 };
            Some(Vector { middle, along: along.map(|x| x * share), weight })
        };
        let vectors = self.tiles.iter().filter_map(vector).collect();
        let vectors = thinned(vectors, look.flow.vector_spacing);
        let is_long = |vector: &&Vector| vector.along[0].hypot(vector.along[1]) >= SHORTEST;
        for (halo, color) in [(1.0, HALO), (0.0, VECTOR)] {
            let outlines = vectors.iter().filter(is_long).map(|vector| outline(vector, halo));
            let polygons = outlines.map(|outline| clip::polygon(&outline, &self.rect));
            let polygons: Vec<Vec<Place>> = polygons.filter(|polygon| polygon.len() > 2).collect();
            if !polygons.is_empty() {
                shapes.push(Shape::Polygons { polygons, color, smooth: true });
            }
        }
        let dots = vectors.iter().filter(|vector| !is_long(vector)).map(|vector| vector.middle);
        let centers: Vec<Place> = dots.collect();
        if !centers.is_empty() {
            shapes.push(Shape::Discs { centers, radius: 0.5 * SHORTEST, color: VECTOR });
        }
    }
}

/// A well as a disc with a ring.
pub(super) fn mark_shapes(mark: &Mark, rect: &Rect) -> Vec<Shape> {
    let radius = if mark.is_near { WELL } else { 0.6 * WELL };
    let fill = if mark.is_source { SOURCE } else { SINK };
    let discs = [(radius + 2.5, CASING_COLOR), (radius + 1.5, RING), (radius, fill)];
    let clipped = discs.map(|(radius, color)| {
        let polygons = vec![clip::polygon(&disc(&mark.place, radius), rect)];
        Shape::Polygons { polygons, color, smooth: true }
    });
    clipped.to_vec()
}

/// A disc as a polygon, to be clipped.
fn disc(center: &Place, radius: f64) -> Vec<Place> {
    let corner = |i: u32| {
        let (sin, cos) = (TAU * f64::from(i) / 32.0).sin_cos();
        [center[0] + radius * cos, center[1] + radius * sin]
    };
    (0..32).map(corner).collect()
}

/// The centroid of a polygon and its area; `None` without one.
fn middle(polygon: &[Place]) -> Option<(Place, f64)> {
    let first = polygon.first()?;
    let (mut twice, mut moment) = (0.0, [0.0; 2]);
    for pair in polygon[1..].windows(2) {
        let [a, b] = [0, 1].map(|i| [pair[i][0] - first[0], pair[i][1] - first[1]]);
        let cross = a[0] * b[1] - a[1] * b[0];
        twice += cross;
        (0..2).for_each(|k| moment[k] += cross * (a[k] + b[k]));
    }
    if twice == 0.0 || !twice.is_finite() {
        return None;
    }
    Some((std::array::from_fn(|k| first[k] + moment[k] / (3.0 * twice)), 0.5 * twice.abs()))
}
