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
    /// A byte for each sample, in the samples' order: 1 where the file has no data (missing and dead traces),
    /// where the sample is 0; none if all samples have data.
    pub absent: Option<Vec<u8>>,
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
        Self { image, units: Vec::new(), absent: None, notes: Vec::new() }
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
}

impl ReadNote {
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
        }
    }
}
