//! How to read an image: what its file may not say.

use std::path::PathBuf;

use super::sample_type::{ByteOrder, SampleType};
use super::traces::SampleFormat;

/// How to read an image.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// The layout of raw samples; if given, the file is read as raw whatever its name is.
    /// Default: none.
    pub raw: Option<RawLayout>,
    /// What a SEG-Y file may not say; of RSF files, whether the first axis is vertical.
    pub segy: SegyOptions,
    /// A folder in which, and below which, headers may name the files of their samples. Default: the header's
    /// own folder alone.
    pub data_root: Option<PathBuf>,
    /// The most bytes that the samples of an image may take. Default: as many as the system gives.
    pub memory_limit: Option<u64>,
    /// What the values of samples mean. Default: brightness.
    pub meaning: Meaning,
    /// Which part of a file that holds several images.
    pub stack: StackOptions,
    /// The array that is read, by its name, of files of several: NPZ, VTI and VTK. Default: the only one, or that
    /// which a VTI names as its scalars.
    pub array: Option<String>,
    /// The segment of a segmentation (`.seg.nrrd`, DICOM), by its name or its number from 1: samples are 1 inside and 0
    /// outside. Default: all of them as labels, which those that overlap cannot be.
    pub segment: Option<String>,
    /// The series of a folder of DICOM files, by its identifier (UID), its number or its description. Default: the only
    /// one.
    pub series: Option<String>,
    /// The parts of the frame that the caller gives, which a file need not state. Default: none.
    pub given: GivenFrame,
}

/// What the values of samples mean, which decides what becomes of colours, palettes and grey of few bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Meaning {
    /// Brightness: colour and palettes become luminance, grey of another greatest value than 255 or 65535 is
    /// stretched to the whole range of 8 or 16 bits.
    #[default]
    Brightness,
    /// Labels: values as they are stored, of palettes the indices. Colour is an error, unless its three channels
    /// are equal everywhere.
    Labels,
    /// Labels, one for each colour: black is 0, the others count from 1, ascending by red, then green, then blue.
    /// Grey values are labels as they are stored.
    LabelsByColour,
    /// A mask, 0 outside: as labels, and of colours the greatest channel.
    Mask,
}

/// Which part of a file that holds several images is read, counted from 1, as ImageJ shows them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StackOptions {
    /// The channel. Default: the only one.
    pub channel: Option<usize>,
    /// The point of time. Default: the only one.
    pub time: Option<usize>,
    /// The volume of a NIfTI or FreeSurfer file of four axes. Default: the only one.
    pub volume: Option<usize>,
}

/// Which parts of the frame the caller puts in place of the file's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GivenFrame {
    /// The spacing. The units that the file names for its own do not count then.
    pub spacing: bool,
    /// The place of the first sample.
    pub origin: bool,
    /// The directions of the axes.
    pub direction: bool,
}

/// What a raw file does not say about itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawLayout {
    /// Samples along x, y (and z); x is the fastest in the file.
    pub shape: Vec<usize>,
    /// The type of the samples.
    pub sample_type: SampleType,
    /// The order of their bytes.
    pub byte_order: ByteOrder,
    /// The bytes before the first sample, which are skipped.
    pub offset: u64,
}

/// What a SEG-Y file may not say, or say in its own way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SegyOptions {
    /// The first bytes, counted from 1, of the inline and the crossline number in a trace header;
    /// one place twice makes a line. Default: 189 and 193.
    pub trace_bytes: Option<[usize; 2]>,
    /// The first bytes of X and Y. Default: the first of 181 and 185, 73 and 77, 81 and 85 that
    /// vary.
    pub coordinate_bytes: Option<[usize; 2]>,
    /// How samples are written; goes before the format code of the header. Default: what that says.
    pub sample_format: Option<SampleFormat>,
    /// What the samples of a trace are along. Default: unknown, which leaves its unit unnamed.
    pub vertical: Option<Vertical>,
    /// Which of several traces with the same numbers is read. Default: they are an error.
    pub duplicates: Option<Duplicates>,
    /// Whether the whole traces of a file that ends inside of one are read. Default: false, it is an error.
    pub truncated: bool,
}

/// Which of several traces with the same numbers is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Duplicates {
    /// That which comes first in the file.
    First,
    /// That which comes last.
    Last,
}

/// What the vertical axis of seismic data is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Vertical {
    /// Two-way time, in milliseconds.
    Time,
    /// Depth, in metres or feet.
    Depth,
}
