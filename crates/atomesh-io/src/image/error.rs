//! What can go wrong with an image file.

use std::error::Error;
use std::io;
use std::path::PathBuf;

use atomesh::image::FrameError;
use atomesh::watch::Cancelled;

use super::format::ImageFormat;
use super::sample_type::SampleType;
use super::series_error::SeriesError;

/// An image could not be read; the message names the file and the reason.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", path.display())]
#[non_exhaustive]
pub struct ReadError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub reason: ReadReason,
}

/// Why an image could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadReason {
    /// The watch ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The system refused to open or read the file.
    #[error("cannot be read: {0}")]
    Io(io::Error),
    /// A file that the header names as that of its samples cannot be read.
    #[error("its data file {} cannot be read: {error}", path.display())]
    DataFile {
        /// The file, as the header names it.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// A header names a file of samples that it may not.
    #[error(
        "its data file {} is outside of the header's folder; expected one beside the header or below it",
        path.display()
    )]
    DataOutside {
        /// The file, as the header names it.
        path: PathBuf,
    },
    /// A header names a file of samples more than once.
    #[error("its data file {} is named {times} times; expected a file of its own for each part", path.display())]
    DataTwice {
        /// The file, as the header names it.
        path: PathBuf,
        /// How often it is named.
        times: usize,
    },
    /// The file's name ends like no format that is known.
    #[error(
        "no image format is known by the ending {extension:?}; known are {known}, and any file as raw \
         samples when shape and type are given"
    )]
    UnknownExtension {
        /// The ending found, empty if there is none.
        extension: String,
        /// The endings that are known, parted by blanks.
        known: String,
    },
    /// The name ends in `.raw`, and no layout was given.
    #[error("raw samples say neither their shape nor their type: both must be given")]
    NoRawLayout,
    /// There are no bytes in the file.
    #[error("the file is empty; expected {format}")]
    Empty {
        /// The format that the name promises.
        format: ImageFormat,
    },
    /// The file does not begin as its format does.
    #[error("begins with {}, unlike {format}{}", beginning(found), hint(found, *.like))]
    Magic {
        /// The format that the name promises.
        format: ImageFormat,
        /// The first bytes found.
        found: Vec<u8>,
        /// The format whose files begin with these bytes, if there is one.
        like: Option<ImageFormat>,
    },
    /// The samples end early.
    #[error("the file is cut short: {found} of {expected} samples are there")]
    Truncated {
        /// The samples that the header promises.
        expected: u64,
        /// The whole samples found.
        found: u64,
    },
    /// A header states something impossible.
    #[error("{format} header: {field} is {value}; expected {expected}")]
    Header {
        /// The format whose header it is.
        format: ImageFormat,
        /// The name of the entry, as the format's definition spells it.
        field: &'static str,
        /// The value found.
        value: String,
        /// What would have been right.
        expected: &'static str,
    },
    /// The file is sound and holds something that has no reader here.
    #[error("{format} file holds {found}; supported is {expected}")]
    Unsupported {
        /// The format of the file.
        format: ImageFormat,
        /// What it holds.
        found: String,
        /// What can be read.
        expected: &'static str,
    },
    /// A header promises more samples than so short a file can hold, even compressed.
    #[error("the header promises {shape} samples, more than a file of {file_bytes} bytes can hold")]
    TooLarge {
        /// The samples along each axis, as in `640 × 480`.
        shape: String,
        /// The size of the file.
        file_bytes: u64,
    },
    /// More than one volume in a file, and none of them was chosen, or one that is not there.
    #[error("holds {count} volumes of {shape} samples; expected one{}", not("volume", *.wanted))]
    Volumes {
        /// The number of volumes.
        count: u64,
        /// The samples of each along x, y (and z), as in `640 × 480`.
        shape: String,
        /// The volume asked for, from 1.
        wanted: Option<usize>,
    },
    /// A file holds several arrays, and none of them was chosen, or one that is not there.
    #[error("holds the arrays {found}; expected one{}", not_named(wanted.as_deref()))]
    Arrays {
        /// The arrays with their shapes as NumPy has them, as in `a (3, 4), b (5, 6)`.
        found: String,
        /// The name asked for.
        wanted: Option<String>,
    },
    /// Segments overlap and none was chosen, or one was asked for that is not there.
    #[error("holds the segments {found}{}; expected one{}", overlap(*.layers), not_named(wanted.as_deref()))]
    Segments {
        /// The segments with their numbers, as in `1 bone, 2 skin`.
        found: String,
        /// The layers in which they are, 1 if they do not overlap.
        layers: usize,
        /// What was asked for.
        wanted: Option<String>,
    },
    /// A slice in a folder is unlike the others.
    #[error("{file} holds {found}; expected {expected}")]
    OtherSlice {
        /// The slice's name.
        file: String,
        /// Its shape and type.
        found: String,
        /// The first slice's, with its name.
        expected: String,
    },
    /// A folder has slices of more than one kind.
    #[error("holds {found}; expected slices of one kind")]
    MixedSlices {
        /// How many there are of each kind, as in `7 of PNG, 3 of TIFF`.
        found: String,
    },
    /// Colours are to be labels.
    #[error(
        "{format} file holds colours; expected labels, as grey values or the indices of a palette"
    )]
    ColourLabels {
        /// The format of the file.
        format: ImageFormat,
    },
    /// A stack has several channels or times, and none of them was chosen, or one that is not there.
    #[error(
        "holds {channels} channels and {times} times of {shape} samples; expected one{}",
        chosen(*.channel, *.time)
    )]
    Stack {
        /// The channels.
        channels: usize,
        /// The points of time.
        times: usize,
        /// The samples of each along x, y (and z), as in `640 × 480`.
        shape: String,
        /// The channel asked for, from 1.
        channel: Option<usize>,
        /// The time asked for, from 1.
        time: Option<usize>,
    },
    /// A description of a stack promises other planes than there are.
    #[error("{source_text} promises {promised}; there are {found}")]
    Planes {
        /// The planes promised.
        promised: String,
        /// The planes that there are.
        found: usize,
        /// Which description, as in `the OME-XML`.
        source_text: &'static str,
    },
    /// The axes of the header's affine matrix are not at right angles.
    #[error(
        "the header's axes {first} and {second} meet at {degrees:.3} degrees; expected 90, since a \
         sheared grid has no frame"
    )]
    Sheared {
        /// The first axis of the pair, 0 for x.
        first: usize,
        /// The second axis of the pair.
        second: usize,
        /// The angle between the two.
        degrees: f64,
    },
    /// The pages of a file differ.
    #[error("page {page} is {found}; expected {expected}, as page 1 is")]
    Page {
        /// The number of the page, from 1.
        page: usize,
        /// Shape and type of that page.
        found: String,
        /// Shape and type of page 1.
        expected: String,
    },
    /// The size of a raw file is not that of its samples.
    #[error(
        "holds {found} bytes; expected {expected}, for {shape:?} {sample_type} samples after \
         {offset} bytes"
    )]
    RawSize {
        /// The size of the file.
        found: u64,
        /// The size that the layout asks for.
        expected: u128,
        /// Samples along x, y (and z).
        shape: Vec<usize>,
        /// The type of the samples.
        sample_type: SampleType,
        /// The bytes before the first sample.
        offset: u64,
    },
    /// A raw layout has neither two nor three axes.
    #[error("raw shape {shape:?} has {} axes; expected 2 or 3", shape.len())]
    RawShape {
        /// Samples along the axes given.
        shape: Vec<usize>,
    },
    /// The files of a folder are not one volume.
    #[error(transparent)]
    Series(Box<SeriesError>),
    /// A file of a folder cannot be read.
    #[error("{file}: {reason}")]
    Slice {
        /// The file's name.
        file: String,
        /// What is wrong with it.
        reason: Box<ReadReason>,
    },
    /// Two traces of a seismic file have the same numbers.
    #[error("traces {first} and {second} both are {number}; expected one trace for each")]
    DuplicateTraces {
        /// The first of the two, from 1.
        first: usize,
        /// The second.
        second: usize,
        /// What they both are, as in `inline 12, crossline 34`.
        number: String,
    },
    /// A seismic file ends inside of a trace, or before those that it promises.
    #[error(
        "with {samples} samples per trace, {found} traces{} are whole and {rest} bytes are left over; expected whole \
         traces: the file is cut short, or the header is wrong about their length or number",
        promised.map_or_else(String::new, |promised| format!(" of {promised}"))
    )]
    TruncatedTraces {
        /// The whole traces.
        found: u64,
        /// The traces promised, if it is known.
        promised: Option<u64>,
        /// The samples of a trace, as the header says.
        samples: usize,
        /// The bytes behind the last whole trace.
        rest: u64,
    },
    /// The numbers of traces span a grid that is nearly empty.
    #[error(
        "{traces} traces have {numbers}, a grid of {places} places; expected a trace at every 16th \
         or more"
    )]
    SparseTraces {
        /// The traces in the file.
        traces: usize,
        /// The places of the grid.
        places: u128,
        /// Their numbers, as in `inlines 1 to 100, crosslines 1 to 100`.
        numbers: String,
    },
    /// The grid of a seismic survey is sheared.
    #[error(
        "inlines and crosslines meet at {degrees:.3} degrees; expected 90, since a sheared grid has no \
         frame: bin the traces anew, in rows and columns at right angles"
    )]
    ShearedTraces {
        /// The angle between the two.
        degrees: f64,
    },
    /// Traces that no inline and crossline numbers arrange are neither a grid nor a line.
    #[error(
        "{traces} traces have neither inline nor crossline numbers, and by X and Y they form neither a \
         regular grid nor a line: steps from trace to trace are {median:.4} mostly, {longest:.4} at most"
    )]
    NoLine {
        /// The traces with coordinates.
        traces: usize,
        /// The median of the steps from trace to trace.
        median: f64,
        /// The longest step.
        longest: f64,
    },
    /// A SEG-Y header names no sample format that is read.
    #[error(
        "the sample format code (bytes 3225-3226) is {code}; expected 1 (IBM), 5, 6 (IEEE), 2, 3, 8, 10, \
         11 or 16 (integers)"
    )]
    TraceFormat {
        /// The code.
        code: i16,
    },
    /// A place in a trace header lies outside of it.
    #[error("byte {byte} of a trace header; expected 1 to 237, where numbers of 4 bytes can begin")]
    TraceByte {
        /// The place given, from 1.
        byte: usize,
    },
    /// The samples do not fit into memory.
    #[error("{bytes} bytes of samples do not fit into memory{}", left(*.limit))]
    Memory {
        /// The bytes asked for.
        bytes: u128,
        /// The bytes that there are, if it is known.
        limit: Option<u64>,
    },
    /// The header's frame is impossible.
    #[error("{0}")]
    Frame(#[from] FrameError),
    /// The format's decoder gave up.
    #[error("not a valid {format} file: {error}")]
    Decoder {
        /// The format that was decoded.
        format: ImageFormat,
        /// What the decoder said.
        error: Box<dyn Error + Send + Sync>,
    },
}

impl From<SeriesError> for ReadReason {
    fn from(error: SeriesError) -> Self {
        Self::Series(Box::new(error))
    }
}

impl ReadReason {
    /// The reason that a decoder's error stands for.
    pub(super) fn decoder(
        format: ImageFormat,
        error: impl Into<Box<dyn Error + Send + Sync>>,
    ) -> Self {
        Self::Decoder { format, error: error.into() }
    }
}

/// The first bytes, unless they are text: that may be anyone's.
fn beginning(head: &[u8]) -> String {
    let is_text = head.iter().all(|b| b.is_ascii_graphic() || b.is_ascii_whitespace());
    if is_text { "text".into() } else { format!("the bytes {head:02x?}") }
}

/// What there is of memory.
fn left(limit: Option<u64>) -> String {
    limit.map_or_else(String::new, |limit| format!(", of which {limit} are left"))
}

/// The number that was asked for, in a message.
fn not(name: &str, number: Option<usize>) -> String {
    number.map_or_else(String::new, |number| format!(", not {name} {number}"))
}

/// The name that was asked for, in a message.
fn not_named(name: Option<&str>) -> String {
    name.map_or_else(String::new, |name| format!(", not {name:?}"))
}

/// That segments overlap.
fn overlap(layers: usize) -> &'static str {
    if layers > 1 { ", which overlap" } else { "" }
}

/// What was asked for, in the message of a stack.
fn chosen(channel: Option<usize>, time: Option<usize>) -> String {
    let part = |name: &str, number: Option<usize>| number.map(|n| format!("{name} {n}"));
    let parts: Vec<_> =
        [part("channel", channel), part("time", time)].into_iter().flatten().collect();
    if parts.is_empty() { String::new() } else { format!(", not {}", parts.join(", ")) }
}

/// What the first bytes say about a file with the wrong name.
fn hint(head: &[u8], like: Option<ImageFormat>) -> String {
    match (head, like) {
        ([0x1f, 0x8b, ..], _) => ": compressed by gzip, so a name in .nii.gz might be right".into(),
        (_, Some(format)) => format!(": like {format}"),
        ([0x89, b'H', b'D', b'F', ..], _) => ": like HDF5".into(),
        ([b'P', b'K', 3, 4, ..], _) => ": like ZIP or NPZ".into(),
        _ => String::new(),
    }
}

/// An image could not be written; the message names the file and the reason.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", path.display())]
#[non_exhaustive]
pub struct WriteError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong.
    pub reason: WriteReason,
}

/// Why an image could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteReason {
    /// The watch ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The system refused to create or write the file.
    #[error("cannot be written: {0}")]
    Io(#[from] io::Error),
    /// The file's name ends like no format that can be written.
    #[error("no image can be written by the ending {extension:?}; writable are {known}")]
    UnknownExtension {
        /// The ending found, empty if there is none.
        extension: String,
        /// The endings that can be written, parted by blanks.
        known: String,
    },
    /// The format has no room for samples of this type.
    #[error("{format} does not hold {sample_type} samples, only {expected}")]
    SampleType {
        /// The format wanted.
        format: ImageFormat,
        /// The type of the image's samples.
        sample_type: &'static str,
        /// The types that can be written, and where others can go.
        expected: &'static str,
    },
    /// The format has no room for this many axes or samples.
    #[error("{format} does not hold {shape:?} samples, only {expected}")]
    Shape {
        /// The format wanted.
        format: ImageFormat,
        /// Samples along x, y (and z).
        shape: Vec<usize>,
        /// What can be written, and where others can go.
        expected: &'static str,
    },
    /// The format keeps a number in single precision, which cannot hold it.
    #[error("{format} cannot hold the {quantity} {value}; expected {expected}")]
    Frame {
        /// The format wanted.
        format: ImageFormat,
        /// `spacing` or `origin`.
        quantity: &'static str,
        /// The value along one of the axes.
        value: f64,
        /// What can be written.
        expected: &'static str,
    },
    /// The format's encoder gave up.
    #[error("{format} cannot be encoded: {error}")]
    Encoder {
        /// The format wanted.
        format: ImageFormat,
        /// What the encoder said.
        error: Box<dyn Error + Send + Sync>,
    },
}
