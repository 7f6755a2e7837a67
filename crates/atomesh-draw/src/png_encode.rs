//! Pictures as PNG.

use tiny_skia::{FillRule, LineCap, Paint, PathBuilder, Pixmap, Stroke, Transform};

use crate::error::DrawError;
use crate::raster::{ColorRaster, Raster};
use crate::shape::{Place, Shape};
use crate::style::Color;

/// Lines per path: the rasteriser sorts a path's edges, so short paths are faster.
const LINES_PER_PATH: usize = 2048;

/// A picture of that width and height as an RGB PNG.
pub(crate) fn encode(size: [u32; 2], shapes: &[Shape]) -> Result<Vec<u8>, DrawError> {
    let pixmap = pixels(size, shapes)?;
    let rgb: Vec<u8> =
        pixmap.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    rgb_png(size[0], size[1], png::ColorType::Rgb, &rgb)
}

/// The pixels of a picture of that width and height, on white.
pub(crate) fn pixels([width, height]: [u32; 2], shapes: &[Shape]) -> Result<Pixmap, DrawError> {
    let mut pixmap = Pixmap::new(width, height).ok_or_else(|| DrawError::Png {
        reason: format!("{width} × {height} pixels are too many"),
    })?;
    pixmap.fill(tiny_skia::Color::WHITE);
    for shape in shapes {
        draw(&mut pixmap, shape);
    }
    Ok(pixmap)
}

/// A raster as a grey PNG of its own size.
pub(crate) fn encode_raster(raster: &Raster) -> Result<Vec<u8>, DrawError> {
    rgb_png(raster.columns as u32, raster.rows as u32, png::ColorType::Grayscale, &raster.greys)
}

/// Pixels in colour as a PNG of their own size.
pub(crate) fn encode_colors(raster: &ColorRaster) -> Result<Vec<u8>, DrawError> {
    let bytes = raster.colors.as_flattened();
    rgb_png(raster.columns as u32, raster.rows as u32, png::ColorType::Rgb, bytes)
}

fn rgb_png(
    width: u32,
    height: u32,
    color: png::ColorType,
    bytes: &[u8],
) -> Result<Vec<u8>, DrawError> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::Eight);
    let written = encoder.write_header().and_then(|mut w| {
        w.write_image_data(bytes)?;
        w.finish()
    });
    written.map_err(|e| DrawError::Png { reason: e.to_string() })?;
    Ok(out)
}

fn draw(pixmap: &mut Pixmap, shape: &Shape) {
    match shape {
        Shape::Image { raster, corner, right, down } => {
            image(pixmap, raster, *corner, [*right, *down]);
        }
        Shape::Colors { raster, corner } => colors(pixmap, raster, *corner),
        Shape::Fill { rect, color } => {
            let [x, y] = rect.corner.map(|v| v as f32);
            let [w, h] = rect.size.map(|v| v as f32);
            if let Some(rect) = tiny_skia::Rect::from_xywh(x, y, w, h) {
                pixmap.fill_rect(rect, &paint(*color), Transform::identity(), None);
            }
        }
        Shape::Lines { lines, width, color } => {
            let stroke =
                Stroke { width: *width as f32, line_cap: LineCap::Round, ..Stroke::default() };
            for some in lines.chunks(LINES_PER_PATH) {
                let mut path = PathBuilder::new();
                for [a, b] in some {
                    path.move_to(a[0] as f32, a[1] as f32);
                    path.line_to(b[0] as f32, b[1] as f32);
                }
                if let Some(path) = path.finish() {
                    let paint = paint(*color);
                    pixmap.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
                }
            }
        }
        Shape::Discs { centers, radius, color } => fill(pixmap, &paint(*color), |path| {
            for c in centers {
                path.push_circle(c[0] as f32, c[1] as f32, *radius as f32);
            }
        }),
        Shape::Squares { centers, half, color } => fill(pixmap, &paint(*color), |path| {
            for c in centers {
                let [x, y] = c.map(|v| (v - half) as f32);
                let side = 2.0 * *half as f32;
                if let Some(rect) = tiny_skia::Rect::from_xywh(x, y, side, side) {
                    path.push_rect(rect);
                }
            }
        }),
        Shape::Polygons { polygons, color, smooth } => {
            let paint = Paint { anti_alias: *smooth, ..paint(*color) };
            fill_polygons(pixmap, polygons, &paint);
        }
        Shape::Tint { polygons, color: [r, g, b], opacity } => {
            let mut paint = Paint { anti_alias: false, ..Paint::default() };
            paint.set_color_rgba8(*r, *g, *b, (255.0 * opacity).round() as u8);
            fill_polygons(pixmap, polygons, &paint);
        }
    }
}

fn fill_polygons(pixmap: &mut Pixmap, polygons: &[Vec<Place>], paint: &Paint<'_>) {
    for some in polygons.chunks(LINES_PER_PATH / 8) {
        fill(pixmap, paint, |path| some.iter().for_each(|polygon| push(path, polygon)));
    }
}

/// Adds a polygon to a path.
fn push(path: &mut PathBuilder, polygon: &[Place]) {
    for (i, [x, y]) in polygon.iter().map(|p| p.map(|v| v as f32)).enumerate() {
        if i == 0 {
            path.move_to(x, y);
        } else {
            path.line_to(x, y);
        }
    }
    path.close();
}

fn fill(pixmap: &mut Pixmap, paint: &Paint<'_>, build: impl Fn(&mut PathBuilder)) {
    let mut path = PathBuilder::new();
    build(&mut path);
    if let Some(path) = path.finish() {
        let identity = Transform::identity();
        pixmap.fill_path(&path, paint, FillRule::Winding, identity, None);
    }
}

fn paint([r, g, b]: Color) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, 255);
    paint
}

/// Puts pixels in colour where they belong; those outside the picture are left out.
fn colors(pixmap: &mut Pixmap, raster: &ColorRaster, corner: Place) {
    let [left, top] = corner.map(|v| v.round() as i64);
    let (width, height) = (i64::from(pixmap.width()), i64::from(pixmap.height()));
    let pixels = pixmap.pixels_mut();
    for (at, [r, g, b]) in raster.colors.iter().enumerate() {
        let (x, y) = (left + (at % raster.columns) as i64, top + (at / raster.columns) as i64);
        if (0..width).contains(&x) && (0..height).contains(&y) {
            pixels[(y * width + x) as usize] =
                tiny_skia::ColorU8::from_rgba(*r, *g, *b, 255).premultiply();
        }
    }
}

/// Gives each pixel of the parallelogram the grey of the sample that its centre lies on.
fn image(pixmap: &mut Pixmap, raster: &Raster, corner: Place, [right, down]: [Place; 2]) {
    let area = right[0] * down[1] - right[1] * down[0];
    if area == 0.0 {
        return; // seen edge-on
    }
    let [xs, ys] = std::array::from_fn(|k| {
        let ends = [0.0, right[k], down[k], right[k] + down[k]].map(|v| v + corner[k]);
        let limit = [pixmap.width(), pixmap.height()][k] as usize;
        let min = ends.iter().copied().fold(f64::INFINITY, f64::min).max(0.0) as usize;
        let max = ends.iter().copied().fold(0.0, f64::max).ceil() as usize;
        min..max.min(limit)
    });
    let width = pixmap.width() as usize;
    let pixels = pixmap.pixels_mut();
    for y in ys {
        for x in xs.clone() {
            let (dx, dy) = (x as f64 + 0.5 - corner[0], y as f64 + 0.5 - corner[1]);
            let column = sample((dx * down[1] - dy * down[0]) / area, raster.columns);
            let row = sample((dy * right[0] - dx * right[1]) / area, raster.rows);
            if let (Some(column), Some(row)) = (column, row) {
                let grey = raster.greys[row * raster.columns + column];
                pixels[y * width + x] =
                    tiny_skia::ColorU8::from_rgba(grey, grey, grey, 255).premultiply();
            }
        }
    }
}

/// The number of the sample at a share of the side; `None` outside 0…1.
fn sample(share: f64, count: usize) -> Option<usize> {
    (0.0..1.0).contains(&share).then(|| ((share * count as f64) as usize).min(count - 1))
}
