//! Flow on triangles or polygons.

use atomesh::geometry::{Bounds, Point, difference};

use super::arrow::brisk;
use super::canvas::{Appearance, Canvas, Mark, NO_IMAGE, Segment, Tile};
use super::picture::{FlowCells, FlowPicture, FlowStyle, FlowWell};
use crate::error::DrawError;
use crate::legend::put_beside;
use crate::picture::Picture;
use crate::raster::Ramp;
use crate::scale::{median, scale};
use crate::shape::{Place, Rect, Shape};
use crate::style::Style;

/// The margin around a mesh without an image, in pixels.
const MARGIN: f64 = 10.0;

/// Draws flow on triangles or polygons, as in figure 8 of Hale (2001): thin edges, bold barriers, a vector in
/// each cell, wells as dots.
///
/// Cost: O(pixels + samples + cells log cells).
///
/// # Errors
/// [`DrawError::Style`] if a number of a style is out of range; [`DrawError::Count`] if the number of velocities,
/// pressures or times is not that of cells or points; [`DrawError::Facet`] if a barrier is not a facet.
pub fn draw_flow(
    flow: &FlowPicture<'_, 2>,
    style: &Style,
    flow_style: &FlowStyle,
) -> Result<Picture, DrawError> {
    let (style, flow_style) = (style.checked()?, flow_style.checked()?);
    flow.check()?;
    let layout = Layout::new(flow, style);
    let mut picture = Picture::new(layout.rect.size);
    if let (Some(image), true) = (flow.image, flow.pressures.is_empty()) {
        let [columns, rows] = image.frame().shape();
        let ramp = Ramp::robust(image.samples(), style.brightness);
        let raster = ramp.raster(image.samples(), columns, rows, |i, j| i + columns * j);
        picture.shapes.push(Shape::upright(raster, layout.rect));
    } else {
        picture.shapes.push(Shape::Fill { rect: layout.rect, color: NO_IMAGE });
    }
    let in_pixels = |v: &Point<2>| -> Place { [v[0] * layout.pixels[0], v[1] * layout.pixels[1]] };
    let speed = |v: &Point<2>| in_pixels(v)[0].hypot(in_pixels(v)[1]);
    let brisk = brisk(flow.velocities.iter().map(speed));
    let length = flow_style.vector_length * layout.edge_pixels;
    let along = |cell: usize| {
        let v = flow.velocities.get(cell).filter(|v| v.iter().all(|x| x.is_finite()))?;
        let share = if brisk > 0.0 { length / brisk } else { 0.0 };
        Some(in_pixels(v).map(|x| x * share))
    };
    let look = Appearance::new(flow, style, flow_style, length);
    picture.shapes.extend(layout.canvas(flow).shapes(&look, &along));
    put_beside(&mut picture, &look.bars());
    Ok(picture)
}

/// The map from the mesh to the picture.
struct Layout {
    rect: Rect,
    /// Pixels per sample.
    pixels: Place,
    /// Where sample coordinates 0, 0 are.
    origin: Place,
    /// The length of a typical edge in pixels.
    edge_pixels: f64,
}

impl Layout {
    fn new(flow: &FlowPicture<2>, style: &Style) -> Self {
        let step = flow.image.map_or([1.0; 2], |image| image.frame().grid(style.units).step);
        let points = flow.cells.points();
        let edge = median(edge_lengths(&flow.cells, &step));
        let (first, extent, margin) = match flow.image {
            Some(image) => {
                let shape = image.frame().shape();
                ([-0.5; 2], std::array::from_fn(|k| shape[k] as f64 * step[k]), 0.0)
            }
            None => {
                let none = Bounds { min: [0.0; 2], max: [1.0; 2] };
                let bounds = Bounds::of(points).unwrap_or(none);
                (bounds.min, bounds.extent().map(|x| x.max(f64::MIN_POSITIVE)), MARGIN)
            }
        };
        let scale = scale(edge, &extent, style);
        let pixels: Place = step.map(|s| s * scale);
        Self {
            rect: Rect { corner: [0.0; 2], size: extent.map(|e| e * scale + 2.0 * margin) },
            pixels,
            origin: std::array::from_fn(|k| margin - first[k] * pixels[k]),
            edge_pixels: edge.map_or(style.edge_pixels, |edge| edge * scale),
        }
    }

    fn place(&self, p: &Point<2>) -> Place {
        std::array::from_fn(|k| self.origin[k] + p[k] * self.pixels[k])
    }

    fn canvas(&self, flow: &FlowPicture<2>) -> Canvas {
        let points = flow.cells.points();
        let corner = |&c: &u32| self.place(&points[c as usize]);
        let facets = flow.cells.facets();
        let pieces = |facet: &Vec<u32>| -> Vec<[Place; 2]> {
            facet.windows(2).map(|ends| [corner(&ends[0]), corner(&ends[1])]).collect()
        };
        let polygon = |cell: usize| -> Vec<Place> {
            match flow.cells {
                FlowCells::Simplices(mesh) => {
                    mesh.corners()[3 * cell..3 * cell + 3].iter().map(corner).collect()
                }
                FlowCells::Polytopes(mesh) => mesh.polygon(cell).iter().map(corner).collect(),
            }
        };
        let mark = |well: &FlowWell<2>| Mark {
            place: self.place(&well.place),
            is_source: well.rate > 0.0,
            is_near: true,
        };
        let lines = flow.lines.iter().flat_map(|line| {
            let pieces = line.points.windows(2).zip(line.times.windows(2));
            pieces.map(|(p, t)| Segment {
                time: 0.5 * (t[0] + t[1]),
                ends: [self.place(&p[0]), self.place(&p[1])],
            })
        });
        Canvas {
            rect: self.rect,
            tiles: (0..flow.cells.cell_count())
                .map(|cell| Tile { cell, polygon: polygon(cell) })
                .collect(),
            edges: facets.iter().flat_map(pieces).collect(),
            barriers: flow.barriers.iter().flat_map(|&f| pieces(&facets[f as usize])).collect(),
            marks: flow.wells.iter().map(mark).collect(),
            lines: lines.collect(),
        }
    }
}

/// The lengths of triangles' edges, or the distances between the sites of neighbouring Voronoi cells, which compare with
/// them, of samples with sides `step`.
fn edge_lengths(cells: &FlowCells<2>, step: &Point<2>) -> Vec<f64> {
    let length = |a: &Point<2>, b: &Point<2>| {
        let way = difference(a, b);
        (way[0] * step[0]).hypot(way[1] * step[1])
    };
    match cells {
        FlowCells::Simplices(mesh) => (mesh.facets().iter())
            .map(|facet| {
                let [a, b] = facet.corners.map(|c| &mesh.points()[c as usize]);
                length(a, b)
            })
            .collect(),
        FlowCells::Polytopes(mesh) => (mesh.owners().iter().zip(mesh.neighbours()))
            .map(|(&a, &b)| length(&mesh.centers()[a as usize], &mesh.centers()[b as usize]))
            .collect(),
    }
}
