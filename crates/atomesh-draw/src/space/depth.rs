//! A canvas that knows how far away what it shows is: the nearer hides the farther.

use crate::raster::ColorRaster;
use crate::style::Color;

/// Samples of the canvas along each side of a pixel: their mean is the pixel.
const FINE: usize = 3;

/// A corner of a triangle: its place in pixels, and its distance from the eye in any unit.
pub(super) type Corner = [f64; 3];

/// How a triangle's edges are drawn: which of them, each by the corner opposite; and their width in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    pub edges: [bool; 3],
    pub width: f64,
    pub color: Color,
}

/// Colours and distances, [`FINE`] × [`FINE`] a pixel.
pub(super) struct DepthCanvas {
    /// Pixels.
    size: [usize; 2],
    depth: Vec<f32>,
    colors: Vec<Color>,
}

impl DepthCanvas {
    /// A canvas of so many pixels, infinitely far away.
    pub fn new(size: [usize; 2], background: Color) -> Self {
        let count = size[0] * size[1] * FINE * FINE;
        Self { size, depth: vec![f32::INFINITY; count], colors: vec![background; count] }
    }

    /// Paints a triangle where it is nearer than what is there. `paint` gives the colour at a place by the corners' shares
    /// of it.
    pub fn triangle(
        &mut self,
        corners: [Corner; 3],
        outline: Option<Outline>,
        paint: impl Fn([f64; 3]) -> Color,
    ) {
        let fine = corners.map(|[x, y, z]| [x * FINE as f64, y * FINE as f64, z]);
        let across = |a: Corner, b: Corner, x: f64, y: f64| {
            (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
        };
        let [a, b, c] = fine;
        let area = across(a, b, c[0], c[1]);
        if area == 0.0 || !area.is_finite() {
            return; // seen edge-on
        }
        // how far a corner is from the edge opposite, in samples of the canvas
        let height = |i: usize| {
            let [p, q] = [fine[(i + 1) % 3], fine[(i + 2) % 3]];
            area.abs() / (q[0] - p[0]).hypot(q[1] - p[1])
        };
        let heights = [0, 1, 2].map(height);
        let width = self.size[0] * FINE;
        let [columns, rows] = [0, 1].map(|k| {
            let ends = fine.map(|p| p[k]);
            let least = ends.into_iter().fold(f64::INFINITY, f64::min).floor().max(0.0) as usize;
            let most = ends.into_iter().fold(0.0, f64::max).ceil() as usize;
            least..most.min(self.size[k] * FINE)
        });
        for row in rows {
            for column in columns.clone() {
                let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
                let shares =
                    [across(b, c, x, y), across(c, a, x, y), across(a, b, x, y)].map(|s| s / area);
                if shares.iter().any(|&share| share < 0.0) {
                    continue;
                }
                let depth = (0..3).map(|i| shares[i] * fine[i][2]).sum::<f64>() as f32;
                let at = row * width + column;
                if depth < self.depth[at] {
                    self.depth[at] = depth;
                    let is_edge = |outline: &Outline| {
                        let half = 0.5 * outline.width * FINE as f64;
                        (0..3).any(|i| outline.edges[i] && shares[i] * heights[i] < half)
                    };
                    self.colors[at] = match outline.filter(is_edge) {
                        Some(outline) => outline.color,
                        None => paint(shares),
                    };
                }
            }
        }
    }

    /// Paints a straight line of a width in pixels where it is nearer than what is there.
    pub fn line(&mut self, ends: [Corner; 2], width: f64, color: Color) {
        let [a, b] = ends;
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        if length == 0.0 {
            return;
        }
        let aside = [(a[1] - b[1]), (b[0] - a[0])].map(|s| 0.5 * width * s / length);
        let moved = |p: Corner, sign: f64| [p[0] + sign * aside[0], p[1] + sign * aside[1], p[2]];
        let sides = [moved(a, 1.0), moved(b, 1.0), moved(b, -1.0), moved(a, -1.0)];
        self.triangle([sides[0], sides[1], sides[2]], None, |_| color);
        self.triangle([sides[0], sides[2], sides[3]], None, |_| color);
    }

    /// The pixels.
    pub fn pixels(&self) -> ColorRaster {
        let width = self.size[0] * FINE;
        let pixel = |at: usize| -> Color {
            let (x, y) = (at % self.size[0] * FINE, at / self.size[0] * FINE);
            let parts = (0..FINE * FINE).map(|i| (y + i / FINE) * width + x + i % FINE);
            let sums = parts.fold([0_u32; 3], |sum, at| {
                std::array::from_fn(|k| sum[k] + u32::from(self.colors[at][k]))
            });
            let count = (FINE * FINE) as u32;
            sums.map(|sum| ((sum + count / 2) / count) as u8)
        };
        let colors = (0..self.size[0] * self.size[1]).map(pixel).collect();
        ColorRaster { columns: self.size[0], rows: self.size[1], colors }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: Color = [255; 3];
    const BLACK: Color = [0; 3];

    /// The colour of each pixel as a letter: white, black, or grey between.
    fn shown(canvas: &DepthCanvas) -> Vec<String> {
        let pixels = canvas.pixels();
        let letter = |color: &Color| match color[0] {
            0 => 'b',
            255 => 'w',
            _ => '-',
        };
        pixels.colors.chunks(pixels.columns).map(|row| row.iter().map(letter).collect()).collect()
    }

    #[test]
    fn two_halves_of_a_square_leave_no_seam_whichever_way_they_turn() {
        let [a, b, c, d] =
            [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]].map(|[x, y]| [x, y, 1.0]);
        for halves in [[[a, b, c], [a, c, d]], [[c, b, a], [d, c, a]]] {
            let mut canvas = DepthCanvas::new([5, 3], BLACK);
            halves.into_iter().for_each(|half| canvas.triangle(half, None, |_| WHITE));
            assert_eq!(shown(&canvas), ["wwwwb"; 3]);
        }
    }

    #[test]
    fn two_triangles_that_pass_through_each_other_hide_each_other_by_halves() {
        // the first falls away to the right, the second to the left: equally far at x = 3
        let falling = |[x, y]: [f64; 2], sign: f64| [x, y, sign * (x - 3.0)];
        let square = [[0.0, 0.0], [6.0, 0.0], [6.0, 2.0], [0.0, 2.0]];
        for order in [[1.0, -1.0], [-1.0, 1.0]] {
            let mut canvas = DepthCanvas::new([6, 2], WHITE);
            for sign in order {
                let [a, b, c, d] = square.map(|p| falling(p, sign));
                let color = if sign > 0.0 { WHITE } else { BLACK };
                canvas.triangle([a, b, c], None, |_| color);
                canvas.triangle([a, c, d], None, |_| color);
            }
            assert_eq!(shown(&canvas), ["wwwbbb"; 2]);
        }
    }

    #[test]
    fn outlines_are_as_wide_within_as_half_of_what_they_say_and_only_where_they_are_asked_for() {
        let corners = [[0.0, 0.0, 0.0], [0.0, 6.0, 0.0], [60.0, 6.0, 0.0]];
        let outline = Outline { edges: [true, false, false], width: 4.0, color: BLACK };
        let mut canvas = DepthCanvas::new([60, 6], WHITE);
        canvas.triangle(corners, Some(outline), |_| WHITE);
        // the edge opposite the first corner is the lowest
        assert_eq!(shown(&canvas)[3][..20], *"wwwwwwwwwwwwwwwwwwww");
        assert_eq!(shown(&canvas)[4][..20], *"bbbbbbbbbbbbbbbbbbbb");
    }

    #[test]
    fn shares_are_those_of_the_place() {
        // red grows to the right as the share of the second corner, which is what is left of x
        let mut canvas = DepthCanvas::new([10, 10], BLACK);
        let corners = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0]];
        canvas.triangle(corners, None, |shares| [(255.0 * shares[1]).round() as u8, 0, 0]);
        let pixels = canvas.pixels();
        for x in 0..9 {
            let expected = 255.0 * (x as f64 + 0.5) / 10.0;
            assert!((f64::from(pixels.colors[x][0]) - expected).abs() < 1.0, "{x}");
        }
    }

    #[test]
    fn what_is_out_of_sight_or_no_number_is_left_out() {
        let mut canvas = DepthCanvas::new([2, 2], WHITE);
        for corners in [
            [[-5.0, -5.0, 0.0], [-1.0, -5.0, 0.0], [-1.0, -1.0, 0.0]],
            [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [2.0, 2.0, 0.0]],
            [[f64::NAN, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0]],
        ] {
            canvas.triangle(corners, None, |_| BLACK);
        }
        canvas.line([[1.0, 1.0, 0.0]; 2], 1.0, BLACK);
        assert_eq!(shown(&canvas), ["ww"; 2]);
    }
}
