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
