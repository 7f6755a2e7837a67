//! Triangles or polygons over their image.

use atomesh::geometry::{Point, difference};
use atomesh::image::Image;
use atomesh::mesh::{Mesh, PolyMesh};

use crate::error::DrawError;
use crate::picture::Picture;
use crate::raster::Ramp;
use crate::scale::{EDGE_SAMPLES, median, scale, typical_length};
use crate::shape::{Place, Rect, Shape};
use crate::style::Style;

/// Draws a mesh over an image, as in figure 2 of Hale (2001): greys from black at the least to
/// [`Style::brightness`] at the greatest sample, with edges and, optionally, atoms on top.
///
/// The image may be any field on the grid: the image itself, b, or d as in figure 5. The mesh is in
/// sample coordinates. Cost: O(pixels + samples + cells log cells).
///
/// # Errors
/// [`DrawError::Style`] if a number of the style is out of range.
pub fn draw_triangles(
    image: &Image<2>,
    mesh: &Mesh<2>,
    style: &Style,
) -> Result<Picture, DrawError> {
    let edge = typical_length(mesh, &image.frame().grid(style.units).step);
    let lines = Net { points: mesh.points(), edges: edges(mesh), atoms: mesh.points(), edge };
    draw(image, &lines, style)
}

/// Draws polygons over an image, their sites as atoms; otherwise as [`draw_triangles`].
///
/// # Errors
/// As [`draw_triangles`].
pub fn draw_polygons(
    image: &Image<2>,
    mesh: &PolyMesh<2>,
    style: &Style,
) -> Result<Picture, DrawError> {
    let edges: Vec<[u32; 2]> =
        (0..mesh.face_count()).flat_map(|face| mesh.face_parts(face)).collect();
    let step = image.frame().grid(style.units).step;
    let length = |e: &[u32; 2]| {
        let edge = difference(&mesh.points()[e[1] as usize], &mesh.points()[e[0] as usize]);
        (edge[0] * step[0]).hypot(edge[1] * step[1])
    };
    let edge = median(
        edges.iter().step_by(edges.len().div_ceil(EDGE_SAMPLES).max(1)).map(length).collect(),
    );
    draw(image, &Net { points: mesh.points(), edges, atoms: mesh.centers(), edge }, style)
}

/// Draws atoms alone over an image, in sample coordinates; the picture is as large as allowed.
///
/// # Errors
/// As [`draw_triangles`].
pub fn draw_atoms(
    image: &Image<2>,
    atoms: &[Point<2>],
    style: &Style,
) -> Result<Picture, DrawError> {
    let style = Style { edges: false, atoms: true, ..style.clone() };
    draw(image, &Net { points: &[], edges: Vec::new(), atoms, edge: None }, &style)
}

/// What is drawn over an image.
struct Net<'a> {
    points: &'a [Point<2>],
    edges: Vec<[u32; 2]>,
    atoms: &'a [Point<2>],
    /// The typical length of an edge.
    edge: Option<f64>,
}

fn draw(image: &Image<2>, net: &Net, style: &Style) -> Result<Picture, DrawError> {
    let style = style.checked()?;
    let frame = image.frame();
    let [columns, rows] = frame.shape();
    let step = frame.grid(style.units).step;
    let extent = [columns as f64 * step[0], rows as f64 * step[1]];
    let scale = scale(net.edge, &extent, style);
    let pixels: Place = std::array::from_fn(|k| step[k] * scale);
    let place = |p: &[f64; 2]| -> Place { std::array::from_fn(|k| (p[k] + 0.5) * pixels[k]) };

    let mut picture = Picture::new(extent.map(|e| e * scale));
    let ramp = Ramp::robust(image.samples(), style.brightness);
    let raster = ramp.raster(image.samples(), columns, rows, |i, j| i + columns * j);
    let rect = Rect { corner: [0.0; 2], size: extent.map(|e| e * scale) };
    picture.shapes.push(Shape::upright(raster, rect));
    if style.edges {
        let lines = net.edges.iter().map(|e| e.map(|i| place(&net.points[i as usize]))).collect();
        let (width, color) = (style.edge_width, style.edge_color);
        picture.shapes.push(Shape::Lines { lines, width, color });
    }
    if style.atoms {
        let centers = net.atoms.iter().map(place).collect();
        let (radius, color) = (1.6 * style.edge_width, style.atom_color);
        picture.shapes.push(Shape::Discs { centers, radius, color });
    }
    Ok(picture)
}

/// The edges of all cells, each once, lesser point first, in order.
fn edges<const D: usize>(mesh: &Mesh<D>) -> Vec<[u32; 2]> {
    let mut edges = Vec::new();
    for cell in mesh.cells() {
        for (i, &a) in cell.iter().enumerate() {
            edges.extend(cell[i + 1..].iter().map(|&b| [a.min(b), a.max(b)]));
        }
    }
    edges.sort_unstable();
    edges.dedup();
    edges
}
