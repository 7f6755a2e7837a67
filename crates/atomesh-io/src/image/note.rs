//! What a reader reports about an image besides the image itself.

use std::fmt;

use super::any_image::AnyImage;

/// An image, and what its file says or leaves open about it.
#[derive(Clone, Debug)]
pub struct LoadedImage {
    /// The image.
    pub image: AnyImage,
    /// The units of the axes x, y (and z), such as `m` or `ms`; empty if the file names none.
    pub units: Vec<String>,
    /// What the user should know, in the order in which it was found.
    pub notes: Vec<ReadNote>,
}

impl LoadedImage {
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
        first: i16,
        /// A trace that has another one, from 1.
        trace: usize,
        /// That trace's delay.
        other: i16,
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
        !matches!(
            self,
            Self::Traces { .. }
                | Self::Line { .. }
                | Self::Vertical { .. }
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
        )
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
            _ => Ok(()), // the others are written by their own
        }
    }
}
