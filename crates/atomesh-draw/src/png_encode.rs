//! Pictures as PNG.

use tiny_skia::{FillRule, LineCap, Paint, PathBuilder, Pixmap, Stroke, Transform};

use crate::picture::{Picture, Rect, Shape};
use crate::raster::Raster;
use crate::{Color, DrawError};

/// Lines in one path: the rasteriser sorts a path's edges, so short paths are faster.
const LINES_PER_PATH: usize = 2048;

/// The picture as an RGB PNG.
pub(crate) fn encode(picture: &Picture) -> Result<Vec<u8>, DrawError> {
    let (width, height) = (picture.width, picture.height);
    let mut pixmap = Pixmap::new(width, height).ok_or_else(|| DrawError::Png {
        reason: format!("{width} × {height} pixels are too many"),
    })?;
    pixmap.fill(tiny_skia::Color::WHITE);
    for shape in &picture.shapes {
        draw(&mut pixmap, shape);
    }
    let rgb: Vec<u8> =
        pixmap.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    rgb_png(width, height, png::ColorType::Rgb, &rgb)
}

/// A raster as a grey PNG of its own size.
pub(crate) fn encode_raster(raster: &Raster) -> Result<Vec<u8>, DrawError> {
    rgb_png(raster.columns as u32, raster.rows as u32, png::ColorType::Grayscale, &raster.greys)
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
        Shape::Image { raster, rect } => image(pixmap, raster, rect),
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
        Shape::Discs { centers, radius, color } => fill(pixmap, *color, |path| {
            for c in centers {
                path.push_circle(c[0] as f32, c[1] as f32, *radius as f32);
            }
        }),
        Shape::Squares { centers, half, color } => fill(pixmap, *color, |path| {
            for c in centers {
                let [x, y] = c.map(|v| (v - half) as f32);
                let side = 2.0 * *half as f32;
                if let Some(rect) = tiny_skia::Rect::from_xywh(x, y, side, side) {
                    path.push_rect(rect);
                }
            }
        }),
    }
}

fn fill(pixmap: &mut Pixmap, color: Color, build: impl Fn(&mut PathBuilder)) {
    let mut path = PathBuilder::new();
    build(&mut path);
    if let Some(path) = path.finish() {
        let identity = Transform::identity();
        pixmap.fill_path(&path, &paint(color), FillRule::Winding, identity, None);
    }
}

fn paint([r, g, b]: Color) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, 255);
    paint
}

/// Gives each pixel of the rectangle the grey of the sample that its centre lies on.
fn image(pixmap: &mut Pixmap, raster: &Raster, rect: &Rect) {
    let columns = covering(rect.corner[0], rect.size[0], raster.columns, pixmap.width());
    let rows = covering(rect.corner[1], rect.size[1], raster.rows, pixmap.height());
    let width = pixmap.width() as usize;
    let pixels = pixmap.pixels_mut();
    for &(y, row) in &rows {
        for &(x, column) in &columns {
            let grey = raster.greys[row * raster.columns + column];
            pixels[y * width + x] =
                tiny_skia::ColorU8::from_rgba(grey, grey, grey, 255).premultiply();
        }
    }
}

/// The pixels whose centres lie in `start..start + length`, each with the sample it lies on, of
/// `count` samples that share the length.
fn covering(start: f64, length: f64, count: usize, pixels: u32) -> Vec<(usize, usize)> {
    (0..pixels as usize)
        .filter_map(|pixel| {
            let share = (pixel as f64 + 0.5 - start) / length;
            let inside = (0.0..1.0).contains(&share);
            inside.then(|| (pixel, ((share * count as f64) as usize).min(count - 1)))
        })
        .collect()
}
