//! Slices in their order: what tells that they are one volume, and where it is.
//!
//! Order and spacing come from the slices' positions, projected on the normal of their plane; what a
//! header says of slice thickness or numbers is no place and is not looked at.

use atomesh::geometry::dot;

use super::super::note::ReadNote;
use super::super::options::GivenFrame;
use super::super::scan_note::ScanNote;
use super::super::series_error::SeriesError;
use super::header::{Header, Plane};
use super::segments::rungs;

/// How far apart two orientations or spacings of one series may be, relative to 1: they are rounded
/// to three digits at worst.
const SAME: f64 = 1e-3;

/// How far axes may be from unit vectors at right angles: those of three digits are a thousandth off.
const SQUARE: f64 = 5e-3;

/// How far a slice may be from its even place, in gaps, before it is resampled: positions are rounded to tenths of a
/// millimetre at worst, gaps are several of these.
const EVEN: f64 = 0.02;

/// The same before the series is refused.
const UNEVEN: f64 = 0.05;

/// Slices that are nearer than this are at one place, in world units.
const LEAST_GAP: f64 = 1e-4;

/// One slice of a volume.
#[derive(Clone, Debug)]
pub(super) struct Slice {
    /// The file, and its frame if it has several, for messages.
    pub name: String,
    /// The number of the file among those read, and of the frame in it.
    pub source: (usize, usize),
    pub plane: Plane,
}

/// The slices of files, each a header with the file's name.
pub(super) fn slices(files: &[(String, Header)]) -> Vec<Slice> {
    let of_file = |(file, (name, header)): (usize, &(String, Header))| {
        let frames = header.planes.len();
        let named = |(frame, plane): (usize, &Plane)| Slice {
            name: if frames == 1 { name.clone() } else { frame_name(name, frame) },
            source: (file, frame),
            plane: plane.clone(),
        };
        header.planes.iter().enumerate().map(named).collect::<Vec<_>>()
    };
    files.iter().enumerate().flat_map(of_file).collect()
}

fn frame_name(file: &str, frame: usize) -> String {
    match file {
        "" => format!("frame {}", frame + 1),
        _ => format!("{file}, frame {},", frame + 1),
    }
}

/// The slices of one series in the order of their places.
#[derive(Debug)]
pub(super) struct Series {
    pub slices: Vec<Slice>,
    /// The world directions of x and y, orthonormal as nearly as the files say; none if they say nothing.
    pub axes: Option<[[f64; 3]; 2]>,
    /// The place of each slice along the normal.
    pub heights: Vec<f64>,
    /// The step from one slice to the next in the world of the files.
    pub step: [f64; 3],
    /// Whether slices are to be moved to even places.
    pub is_uneven: bool,
    /// Which slices of the volume these are, and how many it has, if some are missing.
    pub rungs: Option<(Vec<usize>, usize)>,
    pub notes: Vec<ReadNote>,
}

impl Series {
    /// Puts slices in order. A single one needs no place, and none needs what the caller gives. Slices may be missing
    /// where `has_gaps`.
    pub fn new(
        mut slices: Vec<Slice>,
        given: GivenFrame,
        has_gaps: bool,
    ) -> Result<Self, SeriesError> {
        slices.sort_by(|a, b| a.name.cmp(&b.name).then(a.source.cmp(&b.source)));
        let head = slices[0].clone();
        for slice in &slices {
            same(&head, slice, given)?;
        }
        let axes = head.plane.axes.and_then(unit_axes);
        if slices.len() == 1 {
            return Ok(Self::ordered(slices, axes, vec![0.0], [0.0; 3]));
        }
        if let Some(bad) = head.plane.axes.filter(|_| axes.is_none() && !given.direction) {
            return Err(SeriesError::Axes { file: head.name, axes: bad });
        }
        let lacks = |lacks: fn(&Plane) -> bool| slices.iter().find(|slice| lacks(&slice.plane));
        let missing =
            |slice: &Slice, entry| Err(SeriesError::Missing { file: slice.name.clone(), entry });
        if let Some(odd) = lacks(|s| s.spacing.is_none()).filter(|_| !given.spacing) {
            return missing(odd, "pixel spacing");
        }
        match lacks(|s| s.position.is_none()) {
            Some(_) if given.spacing => Self::by_number(slices, axes),
            Some(odd) => missing(odd, "image position"),
            None if axes.is_none() && !given.direction => missing(&head, "image orientation"),
            None => Self::by_place(slices, axes, given, has_gaps),
        }
    }

    fn ordered(
        slices: Vec<Slice>,
        axes: Option<[[f64; 3]; 2]>,
        heights: Vec<f64>,
        step: [f64; 3],
    ) -> Self {
        let (is_uneven, rungs, notes) = (false, None, Vec::new());
        Self { slices, axes, heights, step, is_uneven, rungs, notes }
    }

    /// Slices in the order of their places along a normal; a step along z if their axes are not known.
    fn by_place(
        slices: Vec<Slice>,
        axes: Option<[[f64; 3]; 2]>,
        given: GivenFrame,
        has_gaps: bool,
    ) -> Result<Self, SeriesError> {
        let normal = axes.map_or_else(|| widest(&slices), normal);
        let place = |slice: &Slice| slice.plane.position.map_or(0.0, |p| dot(&p, &normal));
        let mut placed: Vec<_> = slices.into_iter().map(|s| (place(&s), s)).collect();
        placed.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.name.cmp(&b.1.name)));
        let heights: Vec<f64> = placed.iter().map(|(place, _)| *place).collect();
        let slices: Vec<Slice> = placed.into_iter().map(|(_, slice)| slice).collect();
        let rungs = if has_gaps { rungs(&heights) } else { None };
        let found = match rungs {
            Some(_) => Evenness::Even,
            None => even(&heights, &slices, given.spacing)?,
        };
        let at = |k: usize| slices[k].plane.position.unwrap_or_default();
        let (from, to) = (at(0), at(slices.len() - 1));
        let count = rungs.as_ref().map_or(slices.len(), |(_, count)| *count);
        let gaps = (count - 1) as f64;
        let mut step = std::array::from_fn(|r| (to[r] - from[r]) / gaps);
        if axes.is_none() {
            step = [0.0, 0.0, dot(&step, &step).sqrt()];
        }
        let mut series = Self::ordered(slices, axes, heights, step);
        series.is_uneven = matches!(found, Evenness::Uneven { .. });
        match found {
            Evenness::Even => {}
            Evenness::Uneven { most } => series.notes.push(ScanNote::Uneven { most }.into()),
            Evenness::Given { least, greatest } => {
                series.notes.push(ScanNote::GivenGaps { least, greatest }.into());
            }
        }
        series.rungs = rungs.filter(|(rungs, count)| rungs.len() < *count);
        if let Some((rungs, count)) = &series.rungs {
            let note = ScanNote::EmptySlices { empty: count - rungs.len(), count: *count };
            series.notes.push(note.into());
        }
        Ok(series)
    }

    /// Slices in the order of their numbers, or of their files' names if they have none, 1 apart.
    fn by_number(mut slices: Vec<Slice>, axes: Option<[[f64; 3]; 2]>) -> Result<Self, SeriesError> {
        let number = |slice: &Slice| slice.plane.instance.unwrap_or_default();
        let is_numbered = slices.iter().all(|slice| slice.plane.instance.is_some());
        if is_numbered {
            slices.sort_by(|a, b| number(a).total_cmp(&number(b)));
            let twice = slices.windows(2).find(|pair| number(&pair[0]) == number(&pair[1]));
            if let Some([first, second]) = twice {
                let number = number(first);
                let (first, second) = (first.name.clone(), second.name.clone());
                return Err(SeriesError::SameNumber { first, second, number });
            }
        }
        // the first may be placed without the others
        slices.iter_mut().for_each(|slice| slice.plane.position = None);
        let step = axes.map_or([0.0, 0.0, 1.0], normal);
        let heights = (0..slices.len()).map(|k| k as f64).collect();
        let mut series = Self::ordered(slices, axes, heights, step);
        let is_of_frames = series.slices.iter().any(|slice| slice.source.1 > 0);
        let numbers = match (is_of_frames, is_numbered) {
            (true, _) => "numbers of frames",
            (false, true) => "instance numbers",
            (false, false) => "files' names",
        };
        series.notes.push(ReadNote::ByNumber { numbers });
        Ok(series)
    }
}

/// The world's axis along which slices are farthest apart.
fn widest(slices: &[Slice]) -> [f64; 3] {
    let spread = |k: usize| {
        let places = || slices.iter().filter_map(|slice| Some(slice.plane.position?[k]));
        places().fold(f64::MIN, f64::max) - places().fold(f64::MAX, f64::min)
    };
    let mut normal = [0.0; 3];
    let widest = (1..3).fold(0, |best, k| if spread(k) > spread(best) { k } else { best });
    normal[widest] = 1.0;
    normal
}

/// Two axes as unit vectors, if they are nearly so and nearly at right angles. The angle stays, and is noted with the frame.
pub(super) fn unit_axes(axes: [[f64; 3]; 2]) -> Option<[[f64; 3]; 2]> {
    let lengths = axes.map(|v| dot(&v, &v).sqrt());
    let is_unit = lengths.iter().all(|length| (length - 1.0).abs() <= SQUARE);
    let cosine = dot(&axes[0], &axes[1]);
    if !(is_unit && cosine.abs() <= SQUARE) {
        return None;
    }
    Some([axes[0].map(|a| a / lengths[0]), axes[1].map(|a| a / lengths[1])])
}

/// The unit normal of two axes.
pub(super) fn normal([x, y]: [[f64; 3]; 2]) -> [f64; 3] {
    let normal = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
    let length = dot(&normal, &normal).sqrt();
    normal.map(|n| n / length)
}

/// Checks that a slice lies and is spaced as the first one.
fn same(head: &Slice, slice: &Slice, given: GivenFrame) -> Result<(), SeriesError> {
    let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME);
    let differs = |entry, found: String, expected: String| {
        let (file, first) = (slice.name.clone(), head.name.clone());
        Err(SeriesError::Differs { file, entry, found, expected, first })
    };
    let axes = |slice: &Slice| slice.plane.axes.unwrap_or_default();
    if !given.direction && !near(axes(slice).as_flattened(), axes(head).as_flattened()) {
        let text = |slice: &Slice| format!("{:?}", axes(slice));
        return differs("the orientation", text(slice), text(head));
    }
    let spacing = |slice: &Slice| slice.plane.spacing.unwrap_or_default();
    let ([a, b], [c, d]) = (spacing(slice), spacing(head));
    if !given.spacing && ((a - c).abs() > SAME * c || (b - d).abs() > SAME * d) {
        return differs("the spacing", format!("{a}, {b}"), format!("{c}, {d}"));
    }
    Ok(())
}

/// How evenly slices stand.
enum Evenness {
    /// As rounding leaves them.
    Even,
    /// Not quite: the farthest from its even place, in gaps.
    Uneven { most: f64 },
    /// At gaps that the caller's take the place of.
    Given { least: f64, greatest: f64 },
}

/// Looks at the gaps between slices, given by their places in growing order.
fn even(heights: &[f64], slices: &[Slice], is_given: bool) -> Result<Evenness, SeriesError> {
    // rounded as positions are, for messages
    let short = |x: f64| (x * 1e4).round() / 1e4;
    let pairs =
        || heights.windows(2).enumerate().map(|(k, w)| (w[1] - w[0], w[0], &slices[k..k + 2]));
    let names = |pair: &[Slice]| (pair[0].name.clone(), pair[1].name.clone());
    let mut gaps: Vec<f64> = pairs().map(|(gap, ..)| gap).collect();
    gaps.sort_by(f64::total_cmp);
    // of two in the middle the lesser, since a gap with a slice missing is the greater one
    let median = gaps[(gaps.len() - 1) / 2];
    let double = |gap: f64| gap <= EVEN * median || gap < LEAST_GAP;
    if let Some((_, place, pair)) = pairs().find(|(gap, ..)| double(*gap)) {
        let (first, second) = names(pair);
        return Err(SeriesError::Duplicate { first, second, place: short(place) });
    }
    let mean = (heights[heights.len() - 1] - heights[0]) / (heights.len() - 1) as f64;
    let off = |(k, height): (usize, &f64)| ((height - heights[0]) / mean - k as f64).abs();
    let most = heights.iter().enumerate().map(off).fold(0.0, f64::max);
    let is_near = |gap: f64| (gap - median).abs() <= UNEVEN * median;
    if most <= EVEN {
        return Ok(Evenness::Even);
    }
    if most <= UNEVEN || gaps.iter().all(|&gap| is_near(gap)) {
        return Ok(Evenness::Uneven { most });
    }
    if is_given {
        let (least, greatest) = (short(gaps[0]), short(gaps[gaps.len() - 1]));
        return Ok(Evenness::Given { least, greatest });
    }
    let farthest = pairs().find(|(gap, ..)| !is_near(*gap));
    let Some((gap, place, pair)) = farthest else { return Ok(Evenness::Uneven { most }) };
    let (first, second) = names(pair);
    let (place, gap, expected) = (short(place), short(gap), short(median));
    Err(SeriesError::Gap { first, second, place, gap, expected })
}
