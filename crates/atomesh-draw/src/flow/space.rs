//! Flow in space, seen from above: the box, barriers, streamlines and wells.
//!
//! The parallel projection is that of the slices in space. Pieces are painted from the farthest to the nearest.

use atomesh::geometry::{Point, difference, dot};

use super::canvas::{Appearance, Mark, mark_shapes};
use super::scene::Scene;
use crate::color_map::PLASMA;
use crate::shape::{Place, Rect, Shape};
use crate::style::Color;
use crate::view::{BACKGROUND, Camera, Fit, OUTLINE, box_edges, view};

/// The width of streamlines in pixels.
const LINE: f64 = 1.6;

/// The greys of barriers seen edge-on and from the front.
const BARRIER: [f64; 2] = [110.0, 225.0];

/// The panel: barriers, streamlines and wells, or the slices of the image if there are none.
pub(super) fn in_space(scene: &Scene, look: &Appearance, rect: Rect) -> Vec<Shape> {
    let flow = scene.flow;
    let is_empty = flow.barriers.is_empty() && flow.lines.is_empty() && flow.wells.is_empty();
    if let (Some(image), true) = (flow.image, is_empty) {
        return view(image, scene.sample(image), scene.style, rect);
    }
    let eye = Eye::new(scene, &rect);
    let mut shapes = vec![Shape::Fill { rect, color: BACKGROUND }];
    let [behind, before] = eye.frame();
    shapes.push(Shape::Lines { lines: behind, width: 1.0, color: OUTLINE });
    let mut pieces: Vec<(f64, Color, Piece)> = Vec::new();
    for &facet in flow.barriers {
        let corners = scene.corners(&scene.facets[facet as usize]);
        let depth = eye.depth(&corners);
        let places = corners.iter().map(|p| eye.place(p)).collect();
        pieces.push((depth, eye.shade(&corners), Piece::Facet(places)));
    }
    if let Some(range) = look.time {
        for line in flow.lines {
            for (ends, times) in line.points.windows(2).zip(line.times.windows(2)) {
                let color = PLASMA.at(range.share(0.5 * (times[0] + times[1])));
                let places = [eye.place(&ends[0]), eye.place(&ends[1])];
                pieces.push((eye.depth(ends), color, Piece::Line(places)));
            }
        }
    }
    pieces.sort_by(|a, b| b.0.total_cmp(&a.0));
    shapes.extend(painted(pieces));
    shapes.push(Shape::Lines { lines: before, width: 1.0, color: OUTLINE });
    let marks = flow.wells.iter().map(|well| Mark {
        place: eye.place(&well.place),
        is_source: well.rate > 0.0,
        is_near: true,
    });
    shapes.extend(marks.flat_map(|mark| mark_shapes(&mark, &rect)));
    shapes
}

/// Something to paint.
enum Piece {
    Facet(Vec<Place>),
    Line([Place; 2]),
}

/// The shapes of pieces in their order; consecutive pieces of one kind and colour are one shape.
fn painted(pieces: Vec<(f64, Color, Piece)>) -> Vec<Shape> {
    let mut shapes: Vec<Shape> = Vec::new();
    for (_, own, piece) in pieces {
        match (piece, shapes.last_mut()) {
            (Piece::Line(line), Some(Shape::Lines { lines, color, .. })) if *color == own => {
                lines.push(line);
            }
            (Piece::Facet(facet), Some(Shape::Polygons { polygons, color, .. }))
                if *color == own =>
            {
                polygons.push(facet);
            }
            (Piece::Line(line), _) => {
                shapes.push(Shape::Lines { lines: vec![line], width: LINE, color: own });
            }
            (Piece::Facet(facet), _) => {
                shapes.push(Shape::Polygons { polygons: vec![facet], color: own, smooth: false });
            }
        }
    }
    shapes
}

/// The camera, and what fits its picture into the panel.
struct Eye<'a> {
    scene: &'a Scene<'a>,
    camera: Camera,
    fit: Fit,
}

impl<'a> Eye<'a> {
    fn new(scene: &'a Scene<'a>, rect: &Rect) -> Self {
        let camera = Camera::new(scene.style.z_up);
        let fit = camera.fit(&scene.in_pixels(&scene.extent), rect);
        Self { scene, camera, fit }
    }

    /// The point relative to the box's least corner, in pixels.
    fn in_box(&self, p: &Point<3>) -> Point<3> {
        self.scene.in_pixels(&difference(p, &self.scene.first))
    }

    fn place(&self, p: &Point<3>) -> Place {
        self.fit.place(self.camera.project(&self.in_box(p)))
    }

    /// The distance from the eye of the mean of some points.
    fn depth(&self, points: &[Point<3>]) -> f64 {
        let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64;
        dot(&self.in_box(&std::array::from_fn(mean)), &self.camera.away)
    }

    /// The grey of a facet, lighter the more it faces the eye.
    fn shade(&self, corners: &[Point<3>]) -> Color {
        let share = self.camera.facing(&[0, 1, 2].map(|i| self.in_box(&corners[i])));
        let [least, most] = BARRIER;
        [(least + share * (most - least)).round() as u8; 3]
    }

    /// The edges of the box: those behind its contents, and those in front.
    fn frame(&self) -> [Vec<[Place; 2]>; 2] {
        let nearest =
            (0..3).fold(0, |at, k| if self.camera.away[k] < 0.0 { at | 1 << k } else { at });
        let mut edges = [Vec::new(), Vec::new()];
        for (corners, ends) in box_edges(&self.scene.first, &self.scene.extent) {
            let is_before = corners.contains(&nearest);
            edges[usize::from(is_before)].push(ends.map(|p| self.place(&p)));
        }
        edges
    }
}
