//! Slices in their order: what tells that they are one volume, and where it is.
//!
//! Order and spacing come from the slices' positions, projected on the normal of their plane; what a
//! header says of slice thickness or numbers is no place and is not looked at.

use std::collections::BTreeMap;

use atomesh::geometry::dot;

use super::super::options::GivenFrame;
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
    /// Whether they have no places, and are in the order of their numbers.
    pub is_by_number: bool,
}

impl Series {
    /// Puts slices in order. A single one needs no place, and none needs what the caller gives.
    pub fn new(
        mut slices: Vec<(String, Slice)>,
        others: usize,
        given: GivenFrame,
    ) -> Result<Self, SeriesError> {
        slices.sort_by(|a, b| a.0.cmp(&b.0));
        let Some((first, head)) = slices.first().cloned() else {
            return Err(SeriesError::NoImages { others });
        };
        one_series(&slices)?;
        for (file, slice) in &slices {
            same(&first, &head, file, slice)?;
        }
        if slices.len() == 1 {
            return Ok(Self { slices, step: [0.0; 3], is_by_number: false });
        }
        let lacks = |lacks: fn(&Slice) -> bool| slices.iter().find(|(_, slice)| lacks(slice));
        let missing = |(file, _): &(String, Slice), entry| {
            Err(SeriesError::Missing { file: file.clone(), entry })
        };
        if let Some(odd) = lacks(|s| s.spacing.is_none()).filter(|_| !given.spacing) {
            return missing(odd, "pixel spacing");
        }
        let has_axes = head.axes.is_some();
        match lacks(|s| s.position.is_none()) {
            Some(_) if given.spacing && lacks(|s| s.instance.is_none()).is_none() => {
                return Self::by_number(slices);
            }
            Some(odd) => return missing(odd, "image position"),
            None if !(has_axes || given.spacing && given.direction) => {
                return missing(&slices[0], "image orientation");
            }
            None => {}
        }
        let normal = match head.axes {
            Some(axes) => normal(axes).ok_or(SeriesError::Axes { file: first, axes })?,
            None => widest(&slices),
        };
        Self::by_place(slices, normal, has_axes)
    }

    /// Slices in the order of their places along a normal; a step along z if their axes are not known.
    fn by_place(
        slices: Vec<(String, Slice)>,
        normal: [f64; 3],
        has_axes: bool,
    ) -> Result<Self, SeriesError> {
        let place = |slice: &Slice| slice.position.map_or(0.0, |p| dot(&p, &normal));
        let mut placed: Vec<_> = slices.into_iter().map(|(f, s)| (place(&s), f, s)).collect();
        placed.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
        let places: Vec<_> =
            placed.iter().map(|(place, file, _)| (*place, file.as_str())).collect();
        even(&places)?;
        let at = |k: usize| placed[k].2.position.unwrap_or_default();
        let (from, to) = (at(0), at(placed.len() - 1));
        let gaps = (placed.len() - 1) as f64;
        let mut step = std::array::from_fn(|r| (to[r] - from[r]) / gaps);
        if !has_axes {
            step = [0.0, 0.0, dot(&step, &step).sqrt()];
        }
        let slices = placed.into_iter().map(|(_, file, slice)| (file, slice)).collect();
        Ok(Self { slices, step, is_by_number: false })
    }

    /// Slices in the order of their numbers, 1 apart.
    fn by_number(mut slices: Vec<(String, Slice)>) -> Result<Self, SeriesError> {
        let number = |slice: &Slice| slice.instance.unwrap_or_default();
        slices.sort_by(|a, b| number(&a.1).total_cmp(&number(&b.1)));
        let twice = slices.windows(2).find(|pair| number(&pair[0].1) == number(&pair[1].1));
        if let Some([first, second]) = twice {
            let number = number(&first.1);
            let (first, second) = (first.0.clone(), second.0.clone());
            return Err(SeriesError::SameNumber { first, second, number });
        }
        let normal = slices[0].1.axes.and_then(normal);
        // the first may be placed without the others
        slices.iter_mut().for_each(|(_, slice)| slice.position = None);
        Ok(Self { slices, step: normal.unwrap_or([0.0, 0.0, 1.0]), is_by_number: true })
    }
}

/// The world's axis along which slices are farthest apart.
fn widest(slices: &[(String, Slice)]) -> [f64; 3] {
    let spread = |k: usize| {
        let places = || slices.iter().filter_map(|(_, slice)| Some(slice.position?[k]));
        places().fold(f64::MIN, f64::max) - places().fold(f64::MAX, f64::min)
    };
    let mut normal = [0.0; 3];
    let widest = (1..3).fold(0, |best, k| if spread(k) > spread(best) { k } else { best });
    normal[widest] = 1.0;
    normal
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
