//! What a reader reports about an image besides the image itself.

use std::fmt;
use std::path::PathBuf;

use super::any_image::AnyImage;
use super::scan_note::ScanNote;
use super::traces::SampleFormat;
use crate::mesh::{Standing, World};

mod parts;

/// An image, and what its file says or leaves open about it.
#[derive(Clone, Debug)]
pub struct LoadedImage {
    /// The image; samples for which the file has no data (missing and dead traces) are 0 and absent.
    pub image: AnyImage,
    /// The units of the axes x, y (and z), such as `m` or `ms`; empty if the file names none.
    pub units: Vec<String>,
    /// What the user should know, in the order in which it was found.
    pub notes: Vec<ReadNote>,
}

impl LoadedImage {
    /// What is known of the image's world beside its frame.
    pub fn world(&self) -> World {
        let standing = self.notes.iter().find_map(|note| match note {
            ReadNote::LevelSlice { z } => Some(Standing::level(*z)),
            ReadNote::ObliqueSlice { origin, axes } => Some(Standing::along(*origin, *axes)),
            _ => None,
        });
        World { units: self.units.clone(), standing }
    }

    /// The same with one note more, if there is one.
    pub(super) fn noting(mut self, note: impl Into<Option<ReadNote>>) -> Self {
        self.notes.extend(note.into());
        self
    }
}

impl From<AnyImage> for LoadedImage {
    fn from(image: AnyImage) -> Self {
        Self { image, units: Vec::new(), notes: Vec::new() }
    }
}

/// Something that a reader found, took for granted or put right.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ReadNote {
    /// How the traces of a seismic file were arranged.
    Traces {
        /// The traces in the file.
        count: usize,
        /// How they are numbered, as in `inlines 100 to 199, crosslines 300 to 498 by 2`.
        numbers: String,
    },
    /// Traces that a regular survey would have are not there; their samples are 0.
    MissingTraces {
        /// How many are missing.
        missing: usize,
        /// How many there would be.
        expected: usize,
        /// The number of the first.
        first: String,
    },
    /// Traces are marked as dead or as dummies: they are taken as missing, their samples are 0.
    DeadTraces {
        /// How many there are.
        dead: usize,
        /// The traces in the file.
        count: usize,
        /// The first of them, from 1.
        first: usize,
    },
    /// All traces are marked as dead or as dummies; the marks are ignored.
    AllDead {
        /// The traces in the file.
        count: usize,
    },
    /// Traces without inline and crossline numbers are arranged by their coordinates.
    TracesByPosition {
        /// The traces in the file.
        count: usize,
        /// Places along x and y.
        shape: [usize; 2],
    },
    /// No trace says where it is.
    NoCoordinates {
        /// The places in the trace header that were looked at, as in `181 and 185`.
        bytes: String,
    },
    /// The coordinates are angles, which have no spacing in metres.
    Angles {
        /// The code of coordinate units in the trace header.
        code: i16,
    },
    /// The coordinates do not lie on a regular grid.
    Irregular {
        /// The number of the trace that is farthest off, from 1.
        trace: usize,
        /// How far it is from its place on the grid that fits best, in world units.
        distance: f64,
        /// How far it may be.
        tolerance: f64,
    },
    /// A line whose x axis is the distance along it, with its first and last trace.
    Line {
        /// The world coordinates of the first trace.
        first: [f64; 2],
        /// The world coordinates of the last trace.
        last: [f64; 2],
    },
    /// A line that bends, or whose traces stand unevenly; x is the distance along it, by the mean step.
    CrookedLine {
        /// The world coordinates of the first trace.
        first: [f64; 2],
        /// The world coordinates of the last trace.
        last: [f64; 2],
        /// The sum of the steps from trace to trace.
        length: f64,
    },
    /// Traces of a line stand unevenly; x has them at even steps.
    UnevenLine {
        /// The number of the trace that is farthest off, from 1.
        trace: usize,
        /// How far it is off along the line, in world units.
        distance: f64,
        /// How far it may be.
        tolerance: f64,
    },
    /// A header states a sample interval that is not above 0.
    NegativeInterval {
        /// Where it stands.
        of: IntervalSource,
        /// The interval.
        stated: f64,
        /// Where the interval that is taken stands.
        source: IntervalSource,
        /// The interval that is taken.
        taken: f64,
    },
    /// Trace headers state another sample interval than the one that is taken.
    IntervalsDiffer {
        /// Where the interval that is taken stands.
        source: IntervalSource,
        /// That interval.
        taken: f64,
        /// The first trace with another one, from 1.
        trace: usize,
        /// That trace's.
        other: f64,
        /// How many traces have another one.
        count: usize,
    },
    /// Samples seem to be of another kind than the header's format code says.
    SampleFormat {
        /// What the header says, which is taken.
        stated: SampleFormat,
        /// The least and the greatest size of samples so, zeros left out, of some traces.
        range: [f64; 2],
        /// What they seem to be.
        other: SampleFormat,
        /// The least and the greatest size so.
        other_range: [f64; 2],
        /// Whether their bits tell; else nothing but their size speaks against what the header says.
        is_told: bool,
    },
    /// The scalar of a trace's times is none of the standard's; times are taken as stored.
    TimeScalar {
        /// The trace, from 1.
        trace: usize,
        /// Its scalar.
        scalar: i16,
    },
    /// The spacing along the vertical axis, which means time or depth.
    Vertical {
        /// The sample interval in the header.
        interval: f64,
        /// Its thousandth.
        spacing: f64,
        /// Whether the caller said what it means.
        is_known: bool,
    },
    /// No header has a sample interval; the vertical spacing is 1.
    NoInterval,
    /// The header says that lengths are in feet; they are kept as they are.
    Feet,
    /// Traces begin at different times; all are taken to begin at the first one's.
    Delays {
        /// The first trace's delay in milliseconds.
        first: f64,
        /// A trace that has another one, from 1.
        trace: usize,
        /// That trace's delay.
        other: f64,
    },
    /// The file of samples that a header names is read from beside the header.
    DataBeside {
        /// The file, as the header names it.
        named: PathBuf,
    },
    /// Which axis of an array became which of ours.
    Axes {
        /// The file's labels or numbers of what became x, y (and z).
        order: Vec<String>,
        /// Whether a label said which axis is vertical.
        is_known: bool,
    },
    /// World coordinates of a body are turned to RAS.
    Turned {
        /// What they are in the file, as in `LPS`.
        from: &'static str,
    },
    /// Values are those of cells; the samples are their middles.
    Cells,
    /// The indices of a palette are taken as values.
    PaletteIndices {
        /// Whether a mask is not what is seen: index 0, outside, is no black, and another index is.
        is_black_elsewhere: bool,
    },
    /// Three colour channels are the same everywhere, and taken as one.
    EqualChannels,
    /// Each colour became a label.
    ColourLabels {
        /// The first labels with their colours as in `0 #000000`, ascending.
        labels: Vec<(u32, String)>,
        /// How many labels there are.
        count: usize,
    },
    /// Labels by colour were asked for, and there are no colours.
    NoColours,
    /// The format's compression changes values.
    Lossy,
    /// 0 stands for white, and values are as they are stored.
    WhiteIsZero,
    /// The file says how large its samples are.
    SampleSize {
        /// World units from one sample to the next along each axis.
        spacing: Vec<f64>,
        /// The unit, empty if the file names none.
        unit: String,
        /// Where the file says it, as in `the ImageJ description`.
        source: &'static str,
    },
    /// The file does not say how far apart its planes are.
    NoPlaneSpacing {
        /// What is taken.
        spacing: f64,
        /// The unit, empty if the file names none.
        unit: String,
    },
    /// The resolution is one that software writes without having measured anything.
    UsualResolution {
        /// Samples an inch.
        per_inch: f64,
    },
    /// Samples are not square, and the resolution has no unit.
    OblongSamples {
        /// Samples along x and y in the same length.
        resolution: [f64; 2],
    },
    /// A channel or time was asked for, where there is one.
    OnePlane {
        /// `channel` or `time`.
        axis: &'static str,
        /// The number that was asked for.
        wanted: usize,
    },
    /// One of several channels or times was read.
    Chosen {
        /// `channel` or `time`.
        axis: &'static str,
        /// Its number, from 1.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// A description promises other planes than there are; all pages are taken as the planes of a volume.
    PageCount {
        /// The planes that are promised.
        promised: usize,
        /// The pages that there are.
        found: usize,
        /// Who promises, as in `the ImageJ description`.
        source: &'static str,
    },
    /// The description of a stack cannot be understood; it does not count.
    Description {
        /// Which, as in `the OME-XML`.
        source: &'static str,
        /// What is wrong with it.
        fault: String,
    },
    /// The spacing of a radiograph is that at the detector: the body was nearer to the source.
    AtDetector {
        /// The spacing along x and y.
        spacing: [f64; 2],
    },
    /// The file says nothing of its spacing, as its format should; it is 1.
    NoSpacing,
    /// Slices have no position and were put in order by their numbers.
    ByNumber {
        /// Which numbers, as in `instance numbers`.
        numbers: &'static str,
    },
    /// Axes that are hardly sheared gave way to the nearest ones at right angles.
    Sheared {
        /// The first axis of the worst pair, 0 for x.
        first: usize,
        /// The second axis of the pair.
        second: usize,
        /// The angle between the two in the file.
        degrees: f64,
        /// How far samples are moved at most, in world units.
        distance: f64,
    },
    /// A single slice across z is flat, without the z of its place.
    LevelSlice {
        /// Its place.
        z: f64,
    },
    /// A single slice is flat, in its own plane: x along its first axis, from its first sample.
    ObliqueSlice {
        /// The world coordinates of its first sample.
        origin: [f64; 3],
        /// The world directions of its axes.
        axes: [[f64; 3]; 2],
    },
    /// A matrix of zeros in the header says nothing of the frame.
    NoMatrix {
        /// What is taken.
        taken: &'static str,
    },
    /// The header says nothing valid of its frame; what its format takes then is taken.
    UsualFrame {
        /// What is wrong with the header's.
        fault: &'static str,
        /// What is taken.
        usual: &'static str,
    },
    /// A file is or is not packed by gzip, unlike what its name says.
    Gzip {
        /// Whether it is.
        is_packed: bool,
    },
    /// Colours were read as their luminance.
    Luminance,
    /// Colours of a palette were read as their luminance.
    PaletteLuminance,
    /// The last axis of an array was taken for colour channels.
    ColourAxis {
        /// The shape of the array as NumPy has it.
        shape: Vec<usize>,
    },
    /// Axes of length 1 are left out.
    UnitAxes {
        /// The shape of the array as NumPy has it.
        shape: Vec<usize>,
    },
    /// One of several arrays was read.
    OneArray {
        /// Its name.
        name: String,
        /// The names of the others.
        others: Vec<String>,
        /// Whether the caller named it.
        is_chosen: bool,
    },
    /// An array was asked for by its name in a file that has no names of arrays.
    NoArrays {
        /// The name that was asked for.
        wanted: String,
    },
    /// The slices of a volume are files in a folder.
    Slices {
        /// The name of the first.
        first: String,
        /// The name of the last.
        last: String,
        /// How many there are.
        count: usize,
    },
    /// Numbers in the names of slices do not follow each other in even steps; the slices are taken to.
    SliceNumbers {
        /// The name before the gap.
        before: String,
        /// The name after it.
        after: String,
    },
    /// Files in the folder are no slices and left out.
    OtherFiles {
        /// How many.
        count: usize,
        /// The name of the first.
        first: String,
    },
    /// Pages of a TIFF that are smaller or marked as copies of others are left out.
    SmallPages {
        /// The pages that are left out.
        left_out: usize,
        /// All pages.
        count: usize,
        /// Shape and type of the first that is left out.
        found: String,
    },
    /// A segment of a segmentation was read: 1 inside, 0 outside.
    Segment {
        /// Its name.
        name: String,
        /// Its number, from 1.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// A segment was asked for in a file that names none.
    NoSegments {
        /// What was asked for.
        wanted: String,
    },
    /// Traces that have the numbers of another one are left out.
    DuplicateTraces {
        /// How many are left out.
        count: usize,
        /// Whether the last ones count, not the first ones.
        is_last: bool,
        /// The number of the first that is left out, from 1.
        trace: usize,
    },
    /// The file ends inside of a trace or before those that it promises; the whole ones are read.
    TruncatedTraces {
        /// The whole traces.
        found: u64,
        /// The traces promised, if it is known.
        promised: Option<u64>,
        /// The bytes behind the last whole trace.
        rest: u64,
    },
    /// A file of revision 0 has textual headers as later revisions count them.
    CountedTexts {
        /// How many.
        count: usize,
    },
    /// The header's additional trace headers are counted as another revision does, with which the file's size fits.
    OtherRevision {
        /// The count taken.
        count: usize,
    },
    /// What became of the slices of a scan.
    Scan(ScanNote),
}

/// Where a sample interval stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntervalSource {
    /// The header of the file.
    BinaryHeader,
    /// The header of the first trace.
    FirstTrace,
}

impl IntervalSource {
    /// Why it is taken.
    fn reason(self) -> &'static str {
        match self {
            Self::BinaryHeader => "it is that of the whole file",
            Self::FirstTrace => "the binary header has none",
        }
    }
}

impl fmt::Display for IntervalSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::BinaryHeader => "the binary header",
            Self::FirstTrace => "the first trace",
        })
    }
}

impl ReadNote {
    /// Whether it is about the spacing of the file, or its unit.
    pub(super) fn is_about_spacing(&self) -> bool {
        matches!(
            self,
            Self::SampleSize { .. }
                | Self::NoPlaneSpacing { .. }
                | Self::UsualResolution { .. }
                | Self::OblongSamples { .. }
                | Self::AtDetector { .. }
                | Self::NoSpacing
        )
    }

    /// Whether the image may be other than the user thinks: a warning, not a remark.
    pub fn is_warning(&self) -> bool {
        if let Self::Scan(note) = self {
            return note.is_warning();
        }
        !matches!(
            self,
            Self::Traces { .. }
                | Self::TracesByPosition { .. }
                | Self::Line { .. }
                | Self::CrookedLine { .. }
                | Self::Vertical { .. }
                | Self::DataBeside { .. }
                | Self::Axes { .. }
                | Self::Turned { .. }
                | Self::Cells
                | Self::PaletteIndices { is_black_elsewhere: false }
                | Self::EqualChannels
                | Self::ColourLabels { .. }
                | Self::NoColours
                | Self::WhiteIsZero
                | Self::SampleSize { .. }
                | Self::UsualResolution { .. }
                | Self::Chosen { .. }
                | Self::AtDetector { .. }
        ) && self.parts_are_a_warning()
    }

    /// Whether it only tells what was read: nothing was guessed, filled, left out or changed.
    pub fn is_remark(&self) -> bool {
        match self {
            Self::Traces { .. } | Self::Line { .. } | Self::Turned { .. } | Self::Cells => true,
            Self::Vertical { is_known, .. } | Self::Axes { is_known, .. } => *is_known,
            Self::Slices { .. } | Self::Segment { .. } => true,
            Self::OneArray { is_chosen, .. } => *is_chosen,
            Self::Scan(note) => note.is_remark(),
            _ => false,
        }
    }
}

impl fmt::Display for ReadNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Traces { count, numbers } => write!(f, "{count} traces: {numbers}"),
            Self::MissingTraces { missing, expected, first } => write!(
                f,
                "{missing} of {expected} traces are missing, the first of them {first}; their \
                 samples are 0"
            ),
            Self::DeadTraces { dead, count, first } => write!(
                f,
                "{dead} of {count} traces are marked as dead or dummy (identification codes 2 and 3), \
                 the first of them trace {first}; they are taken as missing, and their samples are 0"
            ),
            Self::AllDead { count } => write!(
                f,
                "all {count} traces are marked as dead or dummy (identification codes 2 and 3); their \
                 samples are taken as they are"
            ),
            Self::TracesByPosition { count, shape: [nx, ny] } => write!(
                f,
                "{count} traces without inline and crossline numbers; by X and Y they are a grid of \
                 {nx} × {ny}"
            ),
            Self::NoCoordinates { bytes } => write!(
                f,
                "no trace has coordinates at bytes {bytes}; traces are taken to be 1 apart"
            ),
            Self::Angles { code } => write!(
                f,
                "coordinates are angles (unit code {code}); traces are taken to be 1 apart"
            ),
            Self::Irregular { trace, distance, tolerance } => write!(
                f,
                "coordinates fit no regular grid: trace {trace} is {distance:.4} from its place on \
                 the best one; expected at most {tolerance:.4}"
            ),
            Self::Line { first: [x0, y0], last: [x1, y1] } => {
                write!(f, "x is the distance along the line from ({x0}, {y0}) to ({x1}, {y1})")
            }
            Self::CrookedLine { first: [x0, y0], last: [x1, y1], length } => write!(
                f,
                "x is the distance along the line, {length} from ({x0}, {y0}) to ({x1}, {y1}), in \
                 even steps"
            ),
            Self::UnevenLine { trace, distance, tolerance } => write!(
                f,
                "the traces stand unevenly along the line: trace {trace} is {distance:.4} from its \
                 place by even steps; expected at most {tolerance:.4}"
            ),
            Self::NegativeInterval { of, stated, source, taken } => write!(
                f,
                "the sample interval of {of} is {stated}; expected a number above 0: {taken} of \
                 {source} is taken"
            ),
            Self::IntervalsDiffer { source, taken, trace, other, count } => write!(
                f,
                "{count} traces have another sample interval than {source}, {taken}; the first of them is \
                 trace {trace}, {other}: that of {source} is taken, since {}",
                source.reason()
            ),
            Self::SampleFormat { stated, range, other, other_range, is_told } => {
                let ([least, most], [other_least, other_most]) = (range, other_range);
                write!(
                    f,
                    "by the format code samples are {stated} numbers, of sizes from {least} to {most}; "
                )?;
                match is_told {
                    true => write!(f, "their bits are those of {other} numbers")?,
                    false => write!(f, "their bits may be those of {other} numbers too")?,
                }
                write!(f, ", of sizes from {other_least} to {other_most}")
            }
            Self::TimeScalar { trace, scalar } => write!(
                f,
                "the scalar of times of trace {trace} is {scalar}; expected 1, 10, 100, 1000 or 10000, \
                 or one of these negative: times are taken as stored"
            ),
            Self::Vertical { interval, spacing, is_known } => {
                write!(
                    f,
                    "the sample interval {interval} is taken as {spacing} along the vertical"
                )?;
                if *is_known {
                    Ok(())
                } else {
                    write!(f, ": milliseconds if time, metres if depth")
                }
            }
            Self::NoInterval => {
                write!(f, "no header has a sample interval; samples are taken to be 1 apart")
            }
            Self::Feet => write!(f, "the header says that lengths are in feet; none is changed"),
            Self::Delays { first, trace, other } => write!(
                f,
                "trace {trace} begins at {other} ms, the first at {first} ms; all are taken to begin \
                 with the first"
            ),
            Self::DataBeside { named } => write!(
                f,
                "samples are those of the file beside the header that has the name of {}",
                named.display()
            ),
            Self::Axes { order, is_known } => {
                write!(f, "x, y (and z) are the file's axes {}", order.join(", "))?;
                let guess = ", in its order since no label says depth or time";
                if *is_known { Ok(()) } else { f.write_str(guess) }
            }
            Self::Turned { from } => write!(f, "coordinates are turned from {from} to RAS"),
            Self::Cells => f.write_str(
                "values are those of cells; samples sit in their middles, half a step on",
            ),
            Self::PaletteIndices { .. }
            | Self::EqualChannels
            | Self::ColourLabels { .. }
            | Self::NoColours
            | Self::Lossy
            | Self::WhiteIsZero => self.write_values(f),
            Self::AtDetector { spacing: [x, y] } => write!(
                f,
                "the spacing {x},{y} is that at the detector (imager pixel spacing); the body was nearer to \
                 the source, and its parts are smaller by the magnification"
            ),
            Self::NoSpacing => f.write_str("the file says no spacing; it is taken to be 1"),
            Self::ByNumber { numbers } => write!(
                f,
                "slices have no position; they are in the order of their {numbers}, evenly spaced"
            ),
            Self::Scan(note) => note.fmt(f),
            _ => self.write_stack(f),
        }
    }
}

impl ReadNote {
    /// What became of values.
    fn write_values(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PaletteIndices { is_black_elsewhere } => {
                f.write_str("values are the palette's indices; its colours do not count")?;
                let warning = ": index 0, outside of the mask, is not black, and another index is";
                if *is_black_elsewhere { f.write_str(warning) } else { Ok(()) }
            }
            Self::EqualChannels => {
                f.write_str("red, green and blue are the same everywhere; they are taken as one value")
            }
            Self::ColourLabels { labels, count } => {
                let text = |(label, colour): &(u32, String)| format!("{label} {colour}");
                let listed = labels.iter().map(text).collect::<Vec<_>>().join(", ");
                write!(f, "labels by colour: {listed}")?;
                match count - labels.len() {
                    0 => Ok(()),
                    more => write!(f, " and {more} more"),
                }
            }
            Self::NoColours => f.write_str("there are no colours; values are the labels"),
            Self::Lossy => f.write_str(
                "JPEG changes values, most of all where they jump; a PNG or TIFF keeps labels and masks",
            ),
            _ => f.write_str("0 is white in the file; values are as they are stored"),
        }
    }

    /// What a stack says about its planes.
    fn write_stack(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SampleSize { spacing, unit, source } => {
                let numbers = spacing.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
                let unit = if unit.is_empty() { "" } else { &format!(" {unit}") };
                write!(f, "the spacing {numbers}{unit} is that of {source}")
            }
            Self::NoPlaneSpacing { spacing, unit } => {
                let unit = if unit.is_empty() { "" } else { &format!(" {unit}") };
                write!(
                    f,
                    "the file does not say how far apart its planes are; they are taken to be \
                     {spacing}{unit} apart"
                )
            }
            Self::UsualResolution { per_inch } => write!(
                f,
                "the resolution of {per_inch} an inch is one that software writes unasked; the spacing is 1"
            ),
            Self::OblongSamples { resolution: [x, y] } => write!(
                f,
                "resolutions {x} and {y} without a unit say that samples are not square; the spacing is 1"
            ),
            Self::OnePlane { axis, wanted } => {
                write!(f, "{axis} {wanted} was asked for; there is one {axis}, which is read")
            }
            Self::Chosen { axis, number, count } => write!(f, "{axis} {number} of {count}"),
            Self::PageCount { promised, found, source } => write!(
                f,
                "{source} promises {promised} planes, and there are {found}; they are taken as those of a \
                 volume"
            ),
            Self::Description { source, fault } => write!(f, "{source} does not count: {fault}"),
            _ => self.write_parts(f),
        }
    }
}
