//! The names of axes and of surfaces in a picture in space.

use atomesh::geometry::Point;

use super::Scene;
use crate::label::lettering;
use crate::shape::{Place, Rect, Shape};
use crate::style::Color;
use crate::view::box_edges;

/// The height of letters, the width of their strokes, and their colour.
const LETTER: f64 = 12.0;
const STROKE: f64 = 1.5;
const COLOR: Color = [235; 3];

/// From the box to the name of an axis.
const OFF: f64 = 12.0;

/// The most names of a legend, and what is around it.
const MOST: usize = 24;
const MARGIN: f64 = 12.0;

/// X, Y and Z, each outside the middle of the lowest edge of the box along its axis.
pub(super) fn of_axes(scene: &Scene<'_>) -> Shape {
    let middle: Place = scene.size.map(|side| 0.5 * side);
    let seen = |p: Point<3>| {
        let [x, y, _] = scene.seen(&p);
        [x, y]
    };
    let ends = box_edges(&scene.first, &scene.extent);
    let ends: Vec<[Place; 2]> = ends.map(|(_, ends)| ends.map(seen)).collect();
    let mut lines = Vec::new();
    for (axis, name) in ["X", "Y", "Z"].into_iter().enumerate() {
        let edges = &ends[4 * axis..4 * axis + 4];
        let place = |[a, b]: &[Place; 2]| [0, 1].map(|k| 0.5 * (a[k] + b[k]));
        let from_middle = |p: &Place| (p[0] - middle[0]).hypot(p[1] - middle[1]);
        // of the edges on the outline, which are the farthest from the middle, the lowest or leftmost
        let score = |p: &Place| from_middle(p) + 0.01 * (p[1] - p[0]);
        let Some(at) = edges.iter().map(place).max_by(|a, b| score(a).total_cmp(&score(b))) else {
            continue;
        };
        let far = from_middle(&at).max(f64::MIN_POSITIVE);
        let at = [0, 1].map(|k| at[k] + OFF * (at[k] - middle[k]) / far);
        let corner = [at[0] - 0.25 * LETTER, at[1] - 0.5 * LETTER];
        let corner = [0, 1].map(|k| corner[k].clamp(2.0, (scene.size[k] - LETTER - 2.0).max(2.0)));
        lines.extend(lettering(name, corner, LETTER));
    }
    Shape::Lines { lines, width: STROKE, color: COLOR }
}

/// Names with their colours, one below the other in the upper left corner; the first that there is room for, and then how
/// many more there are.
pub(super) fn legend(named: Vec<(&str, Color)>, size: Place) -> Vec<Shape> {
    let height = 1.7 * LETTER;
    let room = (((size[1] - 2.0 * MARGIN) / height) as usize).min(MOST);
    let is_cut = named.len() > room;
    let shown = if is_cut { room.saturating_sub(1) } else { named.len() };
    let mut shapes = Vec::new();
    let mut lines = Vec::new();
    for (i, (name, color)) in named.iter().take(shown).enumerate() {
        let corner = [MARGIN, MARGIN + i as f64 * height];
        let rect = Rect { corner, size: [LETTER; 2] };
        shapes.push(Shape::Fill { rect, color: *color });
        let corner = [corner[0] + 1.6 * LETTER, corner[1]];
        lines.extend(lettering(&name.to_uppercase(), corner, LETTER));
    }
    if is_cut && room > 0 {
        let text = format!("{} MORE", named.len() - shown);
        lines.extend(lettering(&text, [MARGIN, MARGIN + shown as f64 * height], LETTER));
    }
    if !lines.is_empty() {
        shapes.push(Shape::Lines { lines, width: STROKE, color: COLOR });
    }
    shapes
}
