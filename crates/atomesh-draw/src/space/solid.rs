//! Cells, those nearest to the eye cut away: the facets that are then outside.

use atomesh::geometry::Point;

use super::depth::DepthCanvas;
use super::{Scene, between, lit};
use crate::color_map::color_of_part;
use crate::flow::FlowCells;

/// Where cells are cut, between the side of the box that is nearest to the eye and the farthest one.
const CUT: f64 = 0.5;

/// The cells that are left.
pub(super) struct Solid<'a> {
    scene: &'a Scene<'a>,
    is_left: Vec<bool>,
}

impl<'a> Solid<'a> {
    pub fn new(scene: &'a Scene<'a>) -> Self {
        let (at, away) = (scene.between(CUT), scene.camera.away);
        let is_near = |p: &Point<3>, k: usize| {
            if away[k] > 0.0 { p[k] < at[k] } else { p[k] > at[k] }
        };
        let is_left = |p: &Point<3>| !(0..3).all(|k| is_near(p, k));
        let is_left = match scene.contents.cells {
            FlowCells::Simplices(mesh) => {
                let points = mesh.points();
                let middle = |cell: &[u32]| -> Point<3> {
                    let mean = |k| cell.iter().map(|&c| points[c as usize][k]).sum::<f64>() / 4.0;
                    std::array::from_fn(mean)
                };
                mesh.cells().map(|cell| is_left(&middle(cell))).collect()
            }
            FlowCells::Polytopes(mesh) => mesh.centers().iter().map(is_left).collect(),
        };
        Self { scene, is_left }
    }

    pub fn paint(&self, canvas: &mut DepthCanvas) {
        self.scene.contents.cells.each_facet(|corners, cell, beyond| {
            if let Some(cell) = self.shown(cell, beyond) {
                self.facet(corners, cell, canvas);
            }
        });
    }

    /// The cell of which a facet is seen: the one that is left on one side alone.
    fn shown(&self, cell: u32, neighbour: Option<u32>) -> Option<u32> {
        let is_left = |cell: u32| self.is_left[cell as usize];
        match neighbour {
            None => is_left(cell).then_some(cell),
            Some(other) if is_left(cell) != is_left(other) => {
                Some(if is_left(cell) { cell } else { other })
            }
            Some(_) => None,
        }
    }

    /// Paints a polygon as triangles from its first corner; lines are its own edges alone.
    fn facet(&self, numbers: &[u32], cell: u32, canvas: &mut DepthCanvas) {
        let scene = self.scene;
        let points = scene.contents.cells.points();
        let color = scene.contents.parts.get(cell as usize).map(|&part| color_of_part(part));
        let last = numbers.len() - 2;
        for i in 1..=last {
            let corners = [numbers[0], numbers[i], numbers[i + 1]].map(|c| points[c as usize]);
            let light = scene.light(&corners);
            // opposite the first corner is an edge of the polygon, of the others only at its two ends
            let edges = [true, i == last, i == 1];
            let middle = color.unwrap_or_else(|| scene.grey(&between(&corners, [1.0 / 3.0; 3])));
            let outline = scene.outline(lit(middle, light), edges);
            canvas.triangle(corners.map(|p| scene.seen(&p)), outline, |shares| {
                lit(color.unwrap_or_else(|| scene.grey(&between(&corners, shares))), light)
            });
        }
    }
}
