//! Images as options describe them: frame, box of interest, raw layout.

use std::path::PathBuf;

use atomesh::image::{Frame, FrameError, Image};
use atomesh_io::image::{
    ByteOrder, Duplicates, GivenFrame, Meaning, RawLayout, ReadOptions, SampleFormat, SampleType,
    SegyOptions, StackOptions, Vertical,
};
use serde::{Deserialize, Serialize};

use super::section::section;
use crate::error::JobError;
use crate::memory;
use crate::values::{Counts, Numbers, Text, WorldBox};
#[cfg(feature = "clap")]
use crate::values::{count_in, named, number_in};

/// Which byte of a number comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RawOrder {
    /// The least significant.
    Little,
    /// The most significant.
    Big,
}

section! {
    /// Where the samples are, and which of them count.
    pub struct FrameOptions {
        /// World units from one sample to the next along x, y (and z), as in 0.5,0.5,2; replaces the
        /// image's own. Default: the image's, else 1
        #[arg(long, value_name = "SX,SY[,SZ]", allow_hyphen_values = true)]
        pub spacing: Numbers,
        /// World coordinates of the first sample; replaces the image's own. Default: the image's,
        /// else 0
        #[arg(long, value_name = "X,Y[,Z]", allow_hyphen_values = true)]
        pub origin: Numbers,
        /// World directions of the axes as a matrix, row by row: its columns are the axes x, y (and z).
        /// Default: the image's, else the world's axes
        #[arg(long, value_name = "M11,M12,...", allow_hyphen_values = true)]
        pub direction: Numbers,
        /// Let y grow upwards: the rows of the image run down from the greatest y, so that photographs (PNG, JPEG,
        /// TIFF) stand upright in programs whose y points up, such as Abaqus and Gmsh. The box stays. Default: false, rows
        /// run along y as they come
        #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true,
            default_missing_value = "true")]
        pub y_up: bool,
        /// Box of interest in world coordinates, rounded outward to whole samples
        #[arg(long, value_name = "X0..X1,Y0..Y1[,Z0..Z1]", allow_hyphen_values = true)]
        pub crop: Text<WorldBox>,
        /// Value that NaN samples are written and drawn as; they count as places without data, which are no features.
        /// Default: NaN samples are an error
        #[arg(long, value_name = "VALUE", allow_hyphen_values = true,
            value_parser = number_in(f64::MIN, f64::MAX, "a finite number"))]
        pub fill: f64,
        /// TIFF stacks of several channels: which one, from 1, as ImageJ counts. Default: several are an error
        #[arg(long, value_name = "N", value_parser = count_in(1, "a number from 1"))]
        pub channel: usize,
        /// TIFF stacks of several points of time: which one, from 1. Default: several are an error
        #[arg(long, value_name = "N", value_parser = count_in(1, "a number from 1"))]
        pub time: usize,
        /// NIfTI and FreeSurfer files of several volumes (4-D): which one, from 1. Default: several are an error
        #[arg(long, value_name = "N", value_parser = count_in(1, "a number from 1"))]
        pub volume: usize,
        /// NPZ, VTI and VTK files of several arrays: which one, by its name. Default: the only one that is an image; of
        /// VTI and VTK the file's scalars, or the first
        #[arg(long, value_name = "NAME")]
        pub array: String,
        /// DICOM folders of several series: which one, by its UID, its number or its description. Default: several are an
        /// error
        #[arg(long, value_name = "SERIES")]
        pub series: String,
        /// Segmentations (.seg.nrrd, DICOM): which segment, by its name or its number from 1; samples are 1 in it and 0
        /// elsewhere. Default: all as labels; segments that overlap are an error
        #[arg(long, value_name = "NAME|N")]
        pub segment: String,
        /// Colour images as labels: one for each colour, black 0, the others from 1 by ascending red, green, blue.
        /// Default: false, colours are an error; grey values and indices of palettes are labels as they are
        #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true,
            default_missing_value = "true")]
        pub labels_by_color: bool,
        /// Raw samples: how many along x, y (and z), x fastest in the file. A NumPy array of
        /// shape (nz, ny, nx) is NX,NY,NZ here
        #[arg(long, value_name = "NX,NY[,NZ]")]
        pub shape: Counts,
        /// Raw samples: their type by NumPy's name: uint8, int16, float32 ...
        #[arg(long, value_name = "TYPE")]
        pub dtype: Text<SampleType>,
        /// Raw samples: byte order. Default: little
        #[arg(long, value_name = "ORDER",
            value_parser = named::<RawOrder>(&["little", "big"]))]
        pub byte_order: RawOrder,
        /// Raw samples: bytes before the first. Default: 0
        #[arg(long, value_name = "BYTES")]
        pub offset: u64,
        /// SEG-Y: first bytes of the inline and the crossline number in a trace header; the same byte
        /// twice makes a line. Default: 189,193
        #[arg(long, value_name = "INLINE,XLINE")]
        pub trace_bytes: Counts,
        /// SEG-Y: first bytes of X and Y in a trace header. Default: 181,185, or else 73,77 or 81,85,
        /// the first of these that vary
        #[arg(long, value_name = "X,Y")]
        pub coordinate_bytes: Counts,
        /// SEG-Y: how samples are written, whatever the header's format code says. Default: what that says
        #[arg(long, value_name = "FORMAT", value_parser = named::<SampleFormat>(SampleFormat::NAMES))]
        pub sample_format: SampleFormat,
        /// SEG-Y: which of several traces with the same numbers counts, the first or the last in the file. Default: they
        /// are an error
        #[arg(long, value_name = "WHICH", value_parser = named::<Duplicates>(&["first", "last"]))]
        pub duplicates: Duplicates,
        /// SEG-Y: read the whole traces of a file that is cut short. Default: false, such a file is an error
        #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true,
            default_missing_value = "true")]
        pub truncated: bool,
        /// Folder in which, and below which, the headers of NRRD, MetaImage and RSF may name the files of
        /// their samples. Default: the header's own folder
        #[arg(long, value_name = "DIR")]
        pub data_root: PathBuf,
        /// SEG-Y: the axis along a trace, time (milliseconds) or depth (metres or feet).
        /// RSF: the first axis is vertical, whatever its label says
        #[arg(long, value_name = "AXIS", value_parser = named::<Vertical>(&["time", "depth"]))]
        pub vertical: Vertical,
    }
}

/// The frame over the same box whose rows run down from the greatest y.
///
/// # Errors
/// [`JobError`] if its axes are not the world's: then it says itself which way is up.
fn upright<const D: usize>(frame: Frame<D>) -> Result<Frame<D>, JobError> {
    let unit = |r: usize, c: usize| f64::from(u8::from(r == c));
    let mut rows = frame.direction();
    if (0..D * D).any(|at| rows[at / D][at % D] != unit(at / D, at % D)) {
        let message =
            "--y-up is for images whose axes are the world's; expected no other direction";
        return Err(JobError::misuse(message));
    }
    rows[1][1] = -1.0;
    let mut origin = frame.origin();
    origin[1] += (frame.shape()[1] - 1) as f64 * frame.spacing()[1];
    let turned = frame.with_origin(origin).and_then(|frame| frame.with_direction(rows));
    turned.map_err(JobError::misuse)
}

/// The names of the options of a frame, for messages.
const OPTIONS: [&str; 4] = ["--spacing", "--origin", "--direction", "--crop"];

impl FrameOptions {
    /// The layout of raw samples, if one is given.
    pub fn raw_layout(&self) -> Result<Option<RawLayout>, JobError> {
        let (shape, sample_type) = match (&self.shape, self.dtype) {
            (None, None) => return Ok(None),
            (Some(shape), Some(Text(sample_type))) => (shape.0.clone(), sample_type),
            _ => return Err(JobError::misuse("raw samples need both a shape and a dtype")),
        };
        if !(2..=3).contains(&shape.len()) {
            let count = shape.len();
            return Err(JobError::misuse(format!("--shape has {count} axes; expected 2 or 3")));
        }
        let byte_order = match self.byte_order {
            Some(RawOrder::Big) => ByteOrder::Big,
            Some(RawOrder::Little) | None => ByteOrder::Little,
        };
        Ok(Some(RawLayout { shape, sample_type, byte_order, offset: self.offset.unwrap_or(0) }))
    }

    /// How images are read.
    pub fn read_options(&self) -> Result<ReadOptions, JobError> {
        let pair = |option: &str, counts: &Option<Counts>| match counts.as_ref().map(|c| &c.0[..]) {
            None => Ok(None),
            Some(&[a, b]) if [a, b].iter().all(|byte| (1..=237).contains(byte)) => Ok(Some([a, b])),
            Some(found) => Err(JobError::misuse(format!(
                "{option} is {found:?}; expected two bytes from 1 to 237"
            ))),
        };
        let segy = SegyOptions {
            trace_bytes: pair("--trace-bytes", &self.trace_bytes)?,
            coordinate_bytes: pair("--coordinate-bytes", &self.coordinate_bytes)?,
            sample_format: self.sample_format,
            vertical: self.vertical,
            duplicates: self.duplicates,
            truncated: self.truncated == Some(true),
        };
        if let Some(root) = self.data_root.as_ref().filter(|root| !root.is_dir()) {
            return Err(JobError::misuse(format!(
                "--data-root {} is not a folder",
                root.display()
            )));
        }
        let data_root = self.data_root.clone();
        let Self { channel, time, volume, .. } = *self;
        let stack = StackOptions { channel, time, volume };
        if [channel, time, volume].contains(&Some(0)) {
            return Err(JobError::misuse("--channel, --time and --volume count from 1"));
        }
        let given = GivenFrame {
            spacing: self.spacing.is_some(),
            origin: self.origin.is_some(),
            direction: self.direction.is_some(),
        };
        let (raw, memory_limit) = (self.raw_layout()?, memory::room());
        let (array, segment) = (self.array.clone(), self.segment.clone());
        let meaning = Meaning::default();
        let series = self.series.clone();
        Ok(ReadOptions {
            raw,
            segy,
            data_root,
            memory_limit,
            stack,
            array,
            series,
            segment,
            given,
            meaning,
        })
    }

    /// How images are read whose values mean that; labels go by colour if that is asked for.
    pub fn read_options_for(&self, meaning: Meaning) -> Result<ReadOptions, JobError> {
        let meaning = match meaning {
            Meaning::Labels if self.labels_by_color == Some(true) => Meaning::LabelsByColour,
            other => other,
        };
        Ok(ReadOptions { meaning, ..self.read_options()? })
    }

    /// The frame with what the options override.
    pub fn apply<const D: usize>(&self, mut frame: Frame<D>) -> Result<Frame<D>, JobError> {
        let misuse = |e: FrameError| JobError::misuse(e);
        if let Some(spacing) = &self.spacing {
            frame = frame.with_spacing(axes(OPTIONS[0], &spacing.0)?).map_err(misuse)?;
        }
        if let Some(origin) = &self.origin {
            frame = frame.with_origin(axes(OPTIONS[1], &origin.0)?).map_err(misuse)?;
        }
        if let Some(Numbers(direction)) = &self.direction {
            if direction.len() != D * D {
                return Err(wrong_count(OPTIONS[2], direction.len(), D * D, D));
            }
            let rows = std::array::from_fn(|r| std::array::from_fn(|c| direction[r * D + c]));
            frame = frame.with_direction(rows).map_err(misuse)?;
        }
        if self.y_up == Some(true) {
            frame = upright(frame)?;
        }
        Ok(frame)
    }

    /// The image in the frame of the options, cropped, without NaN.
    pub fn place<const D: usize>(&self, image: Image<D>) -> Result<Image<D>, JobError> {
        let image = self.place_as_is(image)?;
        let (nan, all) = (image.samples().range().nan_count, image.samples().len());
        if nan == 0 {
            return Ok(image);
        }
        let message = format!("{nan} of {all} samples are NaN; expected numbers");
        Err(JobError::content(message).advise("--fill VALUE puts a number in their place"))
    }

    /// The image in the frame of the options, cropped; NaN stays unless there is a value for it, and has no data then.
    pub fn place_as_is<const D: usize>(&self, image: Image<D>) -> Result<Image<D>, JobError> {
        let frame = self.apply(*image.frame())?;
        let mut image = image.with_frame(frame).map_err(JobError::content)?;
        if let Some(Text(crop)) = &self.crop {
            let (start, end) = crop.samples(&frame).map_err(JobError::misuse)?;
            image = image.crop(start, end).map_err(JobError::misuse)?;
        }
        let Some(fill) = self.fill.filter(|_| image.samples().range().nan_count > 0) else {
            return Ok(image);
        };
        let is_nan = |index: usize| image.samples().get(index).is_nan();
        let before = image.absent();
        let is_absent = |index: usize| is_nan(index) || before.is_some_and(|flags| flags[index]);
        let absent = (0..image.samples().len()).map(is_absent).collect();
        let mut samples = image.samples().clone();
        samples.fill_nan(fill);
        let filled = image.with_samples(samples).and_then(|image| image.with_absent(absent));
        filled.map_err(JobError::content)
    }
}

/// One number for each axis.
pub fn axes<const D: usize>(option: &str, numbers: &[f64]) -> Result<[f64; D], JobError> {
    numbers.try_into().map_err(|_| wrong_count(option, numbers.len(), D, D))
}

fn wrong_count(option: &str, found: usize, expected: usize, dimension: usize) -> JobError {
    JobError::misuse(format!(
        "{option} has {found} numbers; expected {expected} for a {dimension}-D image"
    ))
}
