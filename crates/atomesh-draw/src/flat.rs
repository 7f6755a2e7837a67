//! A triangular mesh over its image.

use atomesh::geometry::{Point, difference, dot};
use atomesh::image::Image;
use atomesh::mesh::{Mesh, PolyMesh};

use crate::picture::{Picture, Place, Rect, Shape};
use crate::raster::Ramp;
use crate::{DrawError, Style};

/// Draws a mesh over an image, as in figure 2 of Hale (2001): greys from black at the least to
/// [`Style::brightness`] at the greatest sample, edges and, if wanted, atoms on top.
///
/// The image may be any field on the grid: the image itself, b, or d as in figure 5. The mesh is in
/// sample coordinates. Cost: O(pixels + samples + cells log cells).
///
/// # Errors
/// [`DrawError::Style`] if a number of the style has no meaning.
pub fn draw_flat(image: &Image<2>, mesh: &Mesh<2>, style: &Style) -> Result<Picture, DrawError> {
    let edge = typical_length(mesh, &image.frame().grid(style.units).step);
    let lines = Net { points: mesh.points(), edges: edges(mesh), atoms: mesh.points(), edge };
    draw(image, &lines, style)
}

/// Draws polygons over an image, their sites as atoms; otherwise as [`draw_flat`].
///
/// # Errors
/// As [`draw_flat`].
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
    let edge =
        median(edges.iter().step_by(edges.len().div_ceil(LOOKS).max(1)).map(length).collect());
    draw(image, &Net { points: mesh.points(), edges, atoms: mesh.centers(), edge }, style)
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

/// Cells looked at to find the typical length of edges.
pub(crate) const LOOKS: usize = 1 << 14;

/// The median length of the edges of cells spread over the mesh, of samples with sides `step`; `None`
/// without cells.
pub(crate) fn typical_length<const D: usize>(mesh: &Mesh<D>, step: &[f64; D]) -> Option<f64> {
    let points = mesh.points();
    let mut lengths = Vec::new();
    for cell in mesh.cells().step_by(mesh.cell_count().div_ceil(LOOKS).max(1)) {
        for (i, &a) in cell.iter().enumerate() {
            for &b in &cell[i + 1..] {
                let edge = difference(&points[b as usize], &points[a as usize]);
                let edge: Point<D> = std::array::from_fn(|k| edge[k] * step[k]);
                lengths.push(dot(&edge, &edge).sqrt());
            }
        }
    }
    median(lengths)
}

/// The middle one; `None` of none.
pub(crate) fn median(mut lengths: Vec<f64>) -> Option<f64> {
    let middle = lengths.len() / 2;
    (!lengths.is_empty()).then(|| *lengths.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Pixels to a unit of length, so that an edge of the given length is as long as the style wants it,
/// or else the picture of that extent as large as it may be.
pub(crate) fn scale(edge: Option<f64>, extent: &[f64; 2], style: &Style) -> f64 {
    let largest = style.max_side / extent[0].max(extent[1]);
    match edge {
        Some(edge) if edge > 0.0 => largest.min(style.edge_pixels / edge),
        _ => largest,
    }
}
