//! Pictures as SVG. Coordinates have two decimals, a hundredth of a pixel.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::error::DrawError;
use crate::png_encode;
use crate::raster::{ColorRaster, Raster};
use crate::shape::{Place, Shape};
use crate::style::Color;

/// A picture of that width and height as SVG.
pub(crate) fn encode([w, h]: [u32; 2], shapes: &[Shape]) -> Result<Vec<u8>, DrawError> {
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\">\n\
         <path fill=\"#ffffff\" d=\"M0 0H{w}V{h}H0Z\"/>\n"
    );
    for shape in shapes {
        draw(&mut out, shape)?;
    }
    out.push_str("</svg>\n");
    Ok(out.into_bytes())
}

fn draw(out: &mut String, shape: &Shape) -> Result<(), DrawError> {
    match shape {
        Shape::Image { raster, corner, right, down } => {
            image(out, raster, *corner, [*right, *down])?;
        }
        Shape::Colors { raster, corner } => colors(out, raster, *corner)?,
        Shape::Fill { rect, color } => {
            let [[x, y], [w, h]] = [rect.corner, rect.size].map(|p| p.map(number));
            let color = hex(*color);
            line(
                out,
                format_args!(
                    "<rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" fill=\"{color}\"/>"
                ),
            );
        }
        Shape::Lines { lines, width, color } => strokes(out, lines, *width, *color),
        Shape::Discs { centers, radius, color } => dots(out, centers, *radius, "round", *color),
        Shape::Squares { centers, half, color } => dots(out, centers, *half, "square", *color),
        Shape::Polygons { polygons, color, smooth } => {
            let color = hex(*color);
            let edges = if *smooth { "" } else { " shape-rendering=\"crispEdges\"" };
            let d = outlines(polygons);
            line(out, format_args!("<path fill=\"{color}\"{edges} d=\"{d}\"/>"));
        }
        Shape::Tint { polygons, color, opacity } => {
            let (color, opacity, d) = (hex(*color), number(*opacity), outlines(polygons));
            line(
                out,
                format_args!(
                    "<path fill=\"{color}\" fill-opacity=\"{opacity}\" shape-rendering=\"crispEdges\" d=\"{d}\"/>"
                ),
            );
        }
    }
    Ok(())
}

/// A raster stretched over a parallelogram.
fn image(
    out: &mut String,
    raster: &Raster,
    corner: Place,
    [right, down]: [Place; 2],
) -> Result<(), DrawError> {
    let png = STANDARD.encode(png_encode::encode_raster(raster)?);
    let (w, h) = (raster.columns, raster.rows);
    let [a, b] = right.map(|v| v / w as f64);
    let [c, d] = down.map(|v| v / h as f64);
    let [e, f] = corner.map(number);
    line(
        out,
        format_args!(
            "<image width=\"{w}\" height=\"{h}\" \
             transform=\"matrix({a:.6} {b:.6} {c:.6} {d:.6} {e} {f})\" \
             style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{png}\"/>"
        ),
    );
    Ok(())
}

/// Pixels in colour.
fn colors(out: &mut String, raster: &ColorRaster, corner: Place) -> Result<(), DrawError> {
    let png = STANDARD.encode(png_encode::encode_colors(raster)?);
    let (w, h) = (raster.columns, raster.rows);
    let [x, y] = corner.map(number);
    line(
        out,
        format_args!(
            "<image x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" href=\"data:image/png;base64,{png}\"/>"
        ),
    );
    Ok(())
}

/// Polygons as a path.
fn outlines(polygons: &[Vec<Place>]) -> String {
    let mut d = String::new();
    for polygon in polygons {
        for (i, corner) in polygon.iter().enumerate() {
            point(&mut d, if i == 0 { 'M' } else { 'L' }, *corner);
        }
        d.push('Z');
    }
    d
}

/// Lines; one that begins where the one before it ends is joined to it.
fn strokes(out: &mut String, lines: &[[Place; 2]], width: f64, color: Color) {
    let (color, width) = (hex(color), number(width));
    let mut d = String::new();
    for (i, [a, b]) in lines.iter().enumerate() {
        if i == 0 || lines[i - 1][1] != *a {
            point(&mut d, 'M', *a);
        }
        point(&mut d, 'L', *b);
    }
    line(
        out,
        format_args!(
            "<path fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\" \
             stroke-linecap=\"round\" stroke-linejoin=\"round\" d=\"{d}\"/>"
        ),
    );
}

/// Discs or squares, as the caps of lines without length.
fn dots(out: &mut String, centers: &[Place], half: f64, cap: &str, color: Color) {
    let (color, width) = (hex(color), number(2.0 * half));
    let mut d = String::new();
    for c in centers {
        point(&mut d, 'M', *c);
        d.push_str("h0");
    }
    line(
        out,
        format_args!(
            "<path fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\" \
             stroke-linecap=\"{cap}\" d=\"{d}\"/>"
        ),
    );
}

fn line(out: &mut String, text: std::fmt::Arguments) {
    out.write_fmt(text).expect("a String takes all text");
    out.push('\n');
}

fn point(d: &mut String, command: char, [x, y]: Place) {
    write!(d, "{command}{} {}", number(x), number(y)).expect("a String takes all text");
}

/// A number with at most two decimals.
fn number(x: f64) -> String {
    let text = format!("{x:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

fn hex([r, g, b]: Color) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}
