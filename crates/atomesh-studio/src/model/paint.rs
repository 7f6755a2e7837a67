//! Painting d(x) and β(x) (Hale 2001: d painted "using a computer program for painting images").
//!
//! Paint has a value and an opacity at each sample. A stroke lays paint over what there is: c = 1 − s²(3 − 2s) at the
//! distance s, in radii, from the path; the opacity becomes α + c(1 − α), and the values mix accordingly. Where the
//! opacity is α, the field is d = d₀^(1 − α) v^α, with d₀ the automatic one, and β = (1 − α) β₀ + α v. Erasing takes the
//! share c of the opacity away.

use std::sync::Arc;

use atomesh::geometry::{Point, distance_squared};
use atomesh::image::Grid;
use atomesh_job::JobError;

use super::Model;
use crate::gesture::PaintedField;

/// Paint on a field, a value and an opacity for each sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Paint {
    value: Vec<f32>,
    opacity: Vec<f32>,
}

impl Paint {
    fn none(count: usize) -> Self {
        Self { value: vec![0.0; count], opacity: vec![0.0; count] }
    }

    /// Lays paint along a path, or takes it away. Cost: O(samples of the path's box).
    fn stroke<const D: usize>(
        &mut self,
        grid: &Grid<D>,
        path: &[Point<D>],
        radius: f64,
        value: Option<f64>,
    ) {
        let mut cover = vec![0.0_f32; if path.is_empty() { 0 } else { self.value.len() }];
        let mut touched = Vec::new();
        for (from, to) in segments(path) {
            each_near(grid, &from, &to, radius, |sample, s| {
                let c = (1.0 - s * s * (3.0 - 2.0 * s)) as f32;
                if cover[sample] == 0.0 && c > 0.0 {
                    touched.push(sample);
                }
                cover[sample] = cover[sample].max(c);
            });
        }
        for sample in touched {
            let (c, opacity) = (cover[sample], self.opacity[sample]);
            let left = opacity * (1.0 - c);
            match value {
                Some(value) => {
                    let all = left + c;
                    self.value[sample] = (self.value[sample] * left + value as f32 * c) / all;
                    self.opacity[sample] = all.min(1.0);
                }
                None => self.opacity[sample] = left,
            }
        }
    }

    /// Whether there is any.
    fn is_any(&self) -> bool {
        self.opacity.iter().any(|a| *a > 0.0)
    }

    /// d(x) with the paint over the automatic one.
    pub fn over_size(&self, automatic: &[f32]) -> Vec<f32> {
        let mix = |(v, a): (f32, f32), d: f32| match a {
            0.0 => d,
            _ => d.powf(1.0 - a) * v.powf(a),
        };
        self.samples().zip(automatic).map(|(paint, d)| mix(paint, *d)).collect()
    }

    /// β(x) with the paint over a constant.
    pub fn over_weight(&self, automatic: f32) -> Vec<f32> {
        let mix = |(v, a): (f32, f32)| ((1.0 - a) * automatic + a * v).clamp(0.0, 1.0);
        self.samples().map(mix).collect()
    }

    fn samples(&self) -> impl Iterator<Item = (f32, f32)> {
        self.value.iter().copied().zip(self.opacity.iter().copied())
    }
}

/// The segments of a path; of one place the place itself.
fn segments<const D: usize>(path: &[Point<D>]) -> Vec<(Point<D>, Point<D>)> {
    match path {
        [at] => vec![(*at, *at)],
        _ => path.windows(2).map(|pair| (pair[0], pair[1])).collect(),
    }
}

/// Visits the samples nearer to a segment than the radius, with their distance over it.
fn each_near<const D: usize>(
    grid: &Grid<D>,
    from: &Point<D>,
    to: &Point<D>,
    radius: f64,
    mut visit: impl FnMut(usize, f64),
) {
    let low: [usize; D] = std::array::from_fn(|k| {
        ((from[k].min(to[k]) - radius) / grid.step[k]).ceil().max(0.0) as usize
    });
    let high: [usize; D] = std::array::from_fn(|k| {
        let high = ((from[k].max(to[k]) + radius) / grid.step[k]).floor();
        (high.max(-1.0) + 1.0).min(grid.shape[k] as f64) as usize
    });
    if (0..D).any(|k| low[k] >= high[k]) {
        return;
    }
    let strides = grid.strides();
    let mut index = low;
    loop {
        let p: Point<D> = std::array::from_fn(|k| index[k] as f64 * grid.step[k]);
        let s = distance_to_segment(&p, from, to) / radius;
        if s < 1.0 {
            visit((0..D).map(|k| index[k] * strides[k]).sum(), s);
        }
        let Some(axis) = (0..D).find(|&k| index[k] + 1 < high[k]) else { return };
        index[axis] += 1;
        index[..axis].copy_from_slice(&low[..axis]);
    }
}

pub(super) fn distance_to_segment<const D: usize>(
    p: &Point<D>,
    from: &Point<D>,
    to: &Point<D>,
) -> f64 {
    let squared = distance_squared(from, to);
    let along: f64 = (0..D).map(|k| (p[k] - from[k]) * (to[k] - from[k])).sum();
    let t = if squared > 0.0 { (along / squared).clamp(0.0, 1.0) } else { 0.0 };
    let foot: Point<D> = std::array::from_fn(|k| from[k] + t * (to[k] - from[k]));
    distance_squared(p, &foot).sqrt()
}

impl<const D: usize> Model<D> {
    pub(super) fn paint(
        &mut self,
        field: PaintedField,
        value: Option<f64>,
        radius: f64,
        path: &[Point<D>],
    ) -> Result<(), JobError> {
        if radius.is_nan() || radius <= 0.0 {
            let message = format!("a brush of radius {radius}; expected a length above 0");
            return Err(JobError::misuse(message));
        }
        let range = match field {
            PaintedField::Size => f64::MIN_POSITIVE..=1e9,
            PaintedField::Weight => 0.0..=1.0,
        };
        if let Some(odd) = value.filter(|value| !range.contains(value)) {
            let expected = match field {
                PaintedField::Size => "a length above 0",
                PaintedField::Weight => "0 to 1",
            };
            return Err(JobError::misuse(format!("paint of {odd}; expected {expected}")));
        }
        let grid = self.grid();
        let count = grid.sample_count();
        let place = self.paint_of(field);
        if value.is_none() && place.is_none() {
            return Ok(());
        }
        let paint = Arc::make_mut(place.get_or_insert_with(|| Arc::new(Paint::none(count))));
        paint.stroke(&grid, path, radius, value);
        if !paint.is_any() {
            *self.paint_of(field) = None;
        }
        self.touch_paint(field);
        Ok(())
    }

    pub(super) fn paint_of(&mut self, field: PaintedField) -> &mut Option<Arc<Paint>> {
        match field {
            PaintedField::Size => &mut self.size_paint,
            PaintedField::Weight => &mut self.weight_paint,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid<2> = Grid { shape: [20, 10], step: [1.0, 2.0] };

    #[test]
    fn a_stroke_is_full_on_its_path_and_ends_at_the_radius() {
        let mut paint = Paint::none(200);
        paint.stroke(&GRID, &[[5.0, 8.0], [15.0, 8.0]], 4.0, Some(3.0));
        let at = |x: usize, y: usize| paint.opacity[y * 20 + x];
        assert_eq!(at(5, 4), 1.0);
        assert_eq!(at(12, 4), 1.0);
        assert!((at(10, 5) - 0.5).abs() < 1e-6, "half a radius off: 1 − s²(3 − 2s) = 1/2");
        assert_eq!((at(10, 6), at(1, 4), at(19, 4)), (0.0, 0.0, 0.0));
        let d = paint.over_size(&[12.0; 200]);
        assert_eq!((d[4 * 20 + 10], d[0]), (3.0, 12.0));
        assert!((d[5 * 20 + 10] - 6.0).abs() < 1e-5, "the geometric mean at half opacity");
    }

    #[test]
    fn paint_covers_paint_and_is_erased() {
        let mut paint = Paint::none(200);
        paint.stroke(&GRID, &[[5.0, 8.0]], 4.0, Some(3.0));
        paint.stroke(&GRID, &[[5.0, 8.0]], 4.0, Some(0.5));
        let weight = paint.over_weight(0.45);
        assert_eq!((weight[4 * 20 + 5], weight[199]), (0.5, 0.45));
        paint.stroke(&GRID, &[[5.0, 8.0]], 4.0, None);
        assert_eq!(paint.opacity[4 * 20 + 5], 0.0);
        paint.stroke(&GRID, &[[5.0, 8.0]], 50.0, None);
        assert_eq!(paint.opacity.iter().filter(|a| **a > 0.2).count(), 0);
    }

    #[test]
    fn strokes_beyond_the_box_touch_nothing() {
        let mut paint = Paint::none(200);
        paint.stroke(&GRID, &[[-50.0, 8.0], [-40.0, 8.0]], 4.0, Some(3.0));
        paint.stroke(&GRID, &[], 4.0, Some(3.0));
        assert!(!paint.is_any());
    }
}
