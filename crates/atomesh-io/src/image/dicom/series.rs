//! Slices in their order: what tells that they are one volume, and where it is.
//!
//! Order and spacing come from the slices' positions, projected on the normal of their plane; what a
//! header says of slice thickness or numbers is no place and is not looked at.

use std::collections::BTreeMap;

use atomesh::geometry::dot;

use super::super::series_error::SeriesError;
use super::slice::Slice;

/// How far apart two orientations or spacings of one series may be, relative to 1: they are rounded
/// to five digits or so.
const SAME: f64 = 1e-4;

/// How far a slice may be from its place, in gaps: positions are rounded to tenths of a millimetre at
/// worst, gaps are several of these.
const EVEN: f64 = 0.02;

/// Slices that are nearer than this are at one place, in world units.
const LEAST_GAP: f64 = 1e-4;

/// The most names in a message.
const NAMED: usize = 4;

/// The slices of one series in the order of their places, and the step from one to the next in the
/// world of the files.
#[derive(Debug)]
pub(super) struct Series {
    /// Each with the name of its file.
    pub slices: Vec<(String, Slice)>,
    pub step: [f64; 3],
}

impl Series {
    /// Puts slices in order. A single one needs no place.
    pub fn new(mut slices: Vec<(String, Slice)>, others: usize) -> Result<Self, SeriesError> {
        slices.sort_by(|a, b| a.0.cmp(&b.0));
        let Some((first, head)) = slices.first().cloned() else {
            return Err(SeriesError::NoImages { others });
        };
        one_series(&slices)?;
        for (file, slice) in &slices {
            same(&first, &head, file, slice)?;
        }
        if slices.len() == 1 {
            return Ok(Self { slices, step: [0.0; 3] });
        }
        let missing = |file: &str, entry| SeriesError::Missing { file: file.into(), entry };
        let axes = head.axes.ok_or_else(|| missing(&first, "image orientation"))?;
        let normal = normal(axes).ok_or(SeriesError::Axes { file: first, axes })?;
        let mut placed = Vec::new();
        for (file, slice) in slices {
            let position = slice.position.ok_or_else(|| missing(&file, "image position"))?;
            slice.spacing.ok_or_else(|| missing(&file, "pixel spacing"))?;
            placed.push((dot(&position, &normal), position, file, slice));
        }
        placed.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.2.cmp(&b.2)));
        let places: Vec<_> =
            placed.iter().map(|(place, _, file, _)| (*place, file.as_str())).collect();
        even(&places)?;
        let (from, to) = (placed[0].1, placed[placed.len() - 1].1);
        let gaps = (placed.len() - 1) as f64;
        let step = std::array::from_fn(|r| (to[r] - from[r]) / gaps);
        Ok(Self {
            slices: placed.into_iter().map(|(_, _, file, slice)| (file, slice)).collect(),
            step,
        })
    }
}

/// The unit normal of two unit vectors at right angles.
fn normal([x, y]: [[f64; 3]; 2]) -> Option<[f64; 3]> {
    let is_unit = |v: &[f64; 3]| (dot(v, v) - 1.0).abs() <= 2.0 * SAME;
    if !(is_unit(&x) && is_unit(&y) && dot(&x, &y).abs() <= SAME) {
        return None;
    }
    Some([x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]])
}

/// Checks that all slices are of one series.
fn one_series(slices: &[(String, Slice)]) -> Result<(), SeriesError> {
    let mut series = BTreeMap::new();
    for (file, slice) in slices {
        let (count, _) = series.entry(slice.series.as_str()).or_insert((0, file));
        *count += 1;
    }
    if series.len() == 1 {
        return Ok(());
    }
    let text = |(uid, (count, file)): (&&str, &(usize, &String))| {
        format!("{uid} ({count} files, such as {file})")
    };
    let mut texts: Vec<_> = series.iter().take(NAMED).map(text).collect();
    if series.len() > NAMED {
        texts.push(format!("{} more", series.len() - NAMED));
    }
    Err(SeriesError::SeveralSeries { series: texts.join(", ") })
}

/// Checks that a slice agrees with the first one.
fn same(first: &str, head: &Slice, file: &str, slice: &Slice) -> Result<(), SeriesError> {
    let near = |a: &[f64], b: &[f64]| {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME * a.abs().max(b.abs()).max(1.0))
    };
    let differs = |entry, found: String, expected: String| {
        let (file, first) = (file.into(), first.into());
        Err(SeriesError::Differs { file, entry, found, expected, first })
    };
    let ([nx, ny], [mx, my]) = (slice.pixels.shape, head.pixels.shape);
    if (nx, ny) != (mx, my) {
        return differs("the shape", format!("{nx} × {ny}"), format!("{mx} × {my}"));
    }
    if slice.pixels != head.pixels {
        return differs("samples of", slice.pixels.text(), head.pixels.text());
    }
    let axes = |slice: &Slice| slice.axes.unwrap_or_default();
    if !near(axes(slice).as_flattened(), axes(head).as_flattened()) {
        let text = |slice: &Slice| format!("{:?}", slice.axes.unwrap_or_default());
        return differs("the orientation", text(slice), text(head));
    }
    let spacing = |slice: &Slice| slice.spacing.unwrap_or_default();
    let ([a, b], [c, d]) = (spacing(slice), spacing(head));
    if (a - c).abs() > SAME * c || (b - d).abs() > SAME * d {
        return differs("the spacing", format!("{a}, {b}"), format!("{c}, {d}"));
    }
    Ok(())
}

/// Checks that slices, given by their places in growing order and their files, are evenly spaced.
fn even(places: &[(f64, &str)]) -> Result<(), SeriesError> {
    // rounded as positions are, for messages
    let short = |x: f64| (x * 1e4).round() / 1e4;
    let pairs = || places.windows(2).map(|w| (w[1].0 - w[0].0, w[0], w[1].1));
    let mut gaps: Vec<f64> = pairs().map(|(gap, ..)| gap).collect();
    gaps.sort_by(f64::total_cmp);
    // of two in the middle the lesser, since a gap with a slice missing is the greater one
    let median = gaps[(gaps.len() - 1) / 2];
    let uneven = |gap: f64| (gap - median).abs() > EVEN * median;
    let double = |gap: f64| gap <= EVEN * median || gap < LEAST_GAP;
    if let Some((_, (place, first), second)) = pairs().find(|(gap, ..)| double(*gap)) {
        let (first, second) = (first.to_owned(), second.to_owned());
        return Err(SeriesError::Duplicate { first, second, place: short(place) });
    }
    if let Some((gap, (place, first), second)) = pairs().find(|(gap, ..)| uneven(*gap)) {
        let (first, second) = (first.to_owned(), second.to_owned());
        let (place, gap, expected) = (short(place), short(gap), short(median));
        return Err(SeriesError::Gap { first, second, place, gap, expected });
    }
    Ok(())
}
