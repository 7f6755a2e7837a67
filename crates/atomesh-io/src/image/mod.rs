//! Image files: bytes to [`Image`] and back, one file per format.
//!
//! The ending of the name chooses the format, and the first bytes must agree. Each reader checks
//! what the header promises against the size of the file before it makes room, then streams the
//! samples into the one vector that will hold them, in the type in which the file has them.
//!
//! | format | endings | samples | frame |
//! | --- | --- | --- | --- |
//! | PNG, JPEG, PNM | png, jpg jpeg, pnm pgm ppm pbm pam | 8 and 16 bits; colour to luminance | none |
//! | TIFF | tif tiff | integers, floats; many pages are a volume | none |
//! | NPY | npy | every real type; arrays (y, x) or (z, y, x) | none |
//! | NIfTI-1 | nii nii.gz | every real type; one volume | sform, else qform, else spacing |
//! | SEG-Y | sgy segy | IBM and IEEE floats, integers; lines and cubes | by coordinates and interval |
//! | RSF | rsf | floats, integers; native, XDR, ASCII | o and d of each axis |
//! | raw | raw, or any with a layout | every real type | none |
//!
//! An image without a frame has unit spacing and origin 0: the resolution that a PNG, JPEG or TIFF
//! states is one of printing.

use std::cell::Cell;
use std::fmt;
use std::fs::File;
use std::io::{Cursor, Read, Seek};
use std::path::Path;

use atomesh::image::{Frame, FrameError, Image, Range, Samples};
use atomesh::watch::{Cancelled, Phase, Watch, check};

use crate::atomic_file::AtomicFile;

mod error;
mod nifti;
mod note;
mod npy;
mod raster;
mod raw;
mod rsf;
mod sample_type;
mod segy;
mod stream;
mod tiff;
mod traces;
mod watched;

pub use error::{ReadError, ReadReason, WriteError, WriteReason};
pub use note::{LoadedImage, ReadNote};
pub use raw::RawLayout;
pub use sample_type::{ByteOrder, SampleType, UnknownByteOrder, UnknownSampleType};
pub use segy::{SegyOptions, Vertical};
use watched::Watched;

/// An image whose file decided whether it is flat or a volume.
#[derive(Clone, Debug)]
pub enum AnyImage {
    /// Two axes.
    Flat(Image<2>),
    /// Three axes, also where one of them has a single sample.
    Volume(Image<3>),
}

/// Runs the same expression on an image of either dimension.
macro_rules! either {
    ($any:expr, $image:ident => $body:expr) => {
        match $any {
            AnyImage::Flat($image) => $body,
            AnyImage::Volume($image) => $body,
        }
    };
}

impl AnyImage {
    /// An image without a frame; `shape` has two or three axes, x first.
    fn frameless(shape: &[usize], samples: Samples) -> Result<Self, ReadReason> {
        match *shape {
            [nx, ny] => Ok(Self::Flat(Image::new(Frame::new([nx, ny])?, samples)?)),
            [nx, ny, nz] => Ok(Self::Volume(Image::new(Frame::new([nx, ny, nz])?, samples)?)),
            _ => Err(FrameError::Shape { shape: shape.to_vec() }.into()),
        }
    }

    /// The number of axes, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.shape().len()
    }

    /// Samples along x, y (and z).
    pub fn shape(&self) -> Vec<usize> {
        either!(self, i => i.frame().shape().to_vec())
    }

    /// World units from one sample to the next along each axis.
    pub fn spacing(&self) -> Vec<f64> {
        either!(self, i => i.frame().spacing().to_vec())
    }

    /// The world coordinates of sample 0.
    pub fn origin(&self) -> Vec<f64> {
        either!(self, i => i.frame().origin().to_vec())
    }

    /// The world directions of the axes: one row for each world axis, a column for each of ours.
    pub fn direction(&self) -> Vec<Vec<f64>> {
        either!(self, i => i.frame().direction().iter().map(|row| row.to_vec()).collect())
    }

    /// The sample values, x fastest.
    pub fn samples(&self) -> &Samples {
        either!(self, i => i.samples())
    }

    /// The name of the sample type, as NumPy spells it.
    pub fn type_name(&self) -> &'static str {
        self.samples().type_name()
    }

    /// The least and greatest sample, and the count of those that are not finite.
    pub fn range(&self) -> Range {
        self.samples().range()
    }
}

/// The image formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ImageFormat {
    /// Portable Network Graphics.
    Png,
    /// JPEG.
    Jpeg,
    /// The Netpbm family: PBM, PGM, PPM, PAM.
    Pnm,
    /// Tagged Image File Format, also BigTIFF.
    Tiff,
    /// NumPy's array file.
    Npy,
    /// NIfTI-1 in one file, `.nii`.
    Nifti,
    /// The same compressed by gzip, `.nii.gz`.
    NiftiGz,
    /// SEG-Y, revisions 0 to 2.
    Segy,
    /// Madagascar's regularly sampled format.
    Rsf,
    /// Samples and nothing else.
    Raw,
}

impl ImageFormat {
    /// The endings by which formats are known.
    pub const EXTENSIONS: [&str; 17] = [
        ".png", ".jpg", ".jpeg", ".pnm", ".pgm", ".ppm", ".pbm", ".pam", ".tif", ".tiff", ".npy",
        ".nii", ".nii.gz", ".sgy", ".segy", ".rsf", ".raw",
    ];

    /// The format that a file's name promises, in upper or lower case; none if it is not known.
    pub fn from_path(path: &Path) -> Option<Self> {
        Some(match extension(path).as_str() {
            ".png" => Self::Png,
            ".jpg" | ".jpeg" => Self::Jpeg,
            ".pnm" | ".pgm" | ".ppm" | ".pbm" | ".pam" => Self::Pnm,
            ".tif" | ".tiff" => Self::Tiff,
            ".npy" => Self::Npy,
            ".nii" => Self::Nifti,
            ".nii.gz" => Self::NiftiGz,
            ".sgy" | ".segy" => Self::Segy,
            ".rsf" => Self::Rsf,
            ".raw" => Self::Raw,
            _ => return None,
        })
    }

    /// Whether a file of this format may begin with these bytes. NIfTI's magic stands further
    /// behind, so its reader looks for it.
    fn may_begin_with(self, head: &[u8]) -> bool {
        match self {
            Self::Png => head.starts_with(b"\x89PNG\r\n\x1a\n"),
            Self::Jpeg => head.starts_with(b"\xff\xd8\xff"),
            Self::Pnm => matches!(head, [b'P', b'1'..=b'7', ..]),
            Self::Tiff => {
                matches!(head, [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..])
            }
            Self::Npy => head.starts_with(b"\x93NUMPY"),
            Self::Nifti => !head.starts_with(b"\x1f\x8b"),
            Self::NiftiGz => head.starts_with(b"\x1f\x8b"),
            Self::Segy | Self::Rsf | Self::Raw => true,
        }
    }
}

impl fmt::Display for ImageFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Pnm => "PNM",
            Self::Tiff => "TIFF",
            Self::Npy => "NPY",
            Self::Nifti => "NIfTI-1",
            Self::NiftiGz => "gzipped NIfTI-1",
            Self::Segy => "SEG-Y",
            Self::Rsf => "RSF",
            Self::Raw => "raw",
        })
    }
}

/// The ending of a file's name in lower case with its dot, `.nii.gz` as one; empty if there is none.
fn extension(path: &Path) -> String {
    let of = |p: &Path| match p.extension() {
        Some(e) => format!(".{}", e.to_string_lossy().to_lowercase()),
        None => String::new(),
    };
    match of(path).as_str() {
        ".gz" => path.file_stem().map(|s| of(Path::new(s))).unwrap_or_default() + ".gz",
        other => other.into(),
    }
}

/// How to read an image.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// The layout of raw samples; if given, the file is read as raw whatever its name is.
    /// Default: none.
    pub raw: Option<RawLayout>,
    /// What a SEG-Y file may not say; of RSF files, whether the first axis is vertical.
    pub segy: SegyOptions,
}

/// Reads an image from a file, in the format that its name promises.
///
/// Colour becomes luminance by Rec. 601, 0.299 R + 0.587 G + 0.114 B of the values as stored,
/// rounded; opacity is ignored. NaN is kept: [`Samples::range`] counts it.
///
/// ```no_run
/// use atomesh::watch::Silent;
/// use atomesh_io::image::{ReadOptions, read_image};
///
/// let image = read_image("brain.nii.gz".as_ref(), &ReadOptions::default(), &mut Silent)?;
/// println!("{:?} samples of {}", image.shape(), image.type_name());
/// # Ok::<(), atomesh_io::image::ReadError>(())
/// ```
///
/// # Errors
/// [`ReadError`] with the reason; a watch that ends the work gives [`ReadReason::Cancelled`].
pub fn read_image(
    path: &Path,
    options: &ReadOptions,
    watch: &mut dyn Watch,
) -> Result<AnyImage, ReadError> {
    load_image(path, options, watch).map(|loaded| loaded.image)
}

/// Reads an image with the units of its axes and what its reader has to say about it, such as traces
/// that are missing; as [`read_image`].
///
/// # Errors
/// As [`read_image`].
pub fn load_image(
    path: &Path,
    options: &ReadOptions,
    watch: &mut dyn Watch,
) -> Result<LoadedImage, ReadError> {
    let mut read = || {
        let format = match (&options.raw, ImageFormat::from_path(path)) {
            (Some(_), _) => ImageFormat::Raw,
            (None, Some(format)) => format,
            (None, None) => {
                return Err(ReadReason::UnknownExtension { extension: extension(path) });
            }
        };
        let file = File::open(path).map_err(ReadReason::Io)?;
        let metadata = file.metadata().map_err(ReadReason::Io)?;
        if metadata.is_dir() {
            return Err(ReadReason::Io(std::io::ErrorKind::IsADirectory.into()));
        }
        let file = Source { bytes: file, length: metadata.len(), folder: Some(folder_of(path)) };
        decode(file, format, options, watch)
    };
    read().map_err(|reason| ReadError { path: path.into(), reason })
}

/// Reads an image from the bytes of a file.
///
/// # Errors
/// As [`read_image`], without a path.
pub fn decode_image(
    bytes: &[u8],
    format: ImageFormat,
    options: &ReadOptions,
    watch: &mut dyn Watch,
) -> Result<AnyImage, ReadReason> {
    let source = Source { bytes: Cursor::new(bytes), length: bytes.len() as u64, folder: None };
    decode(source, format, options, watch).map(|loaded| loaded.image)
}

/// Where an image is read from.
struct Source<'a, R> {
    bytes: R,
    /// The number of bytes in all.
    length: u64,
    /// The folder in which other files of the image stand, if it is known.
    folder: Option<&'a Path>,
}

/// The folder of a file.
fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

/// Reads an image.
fn decode<R: Read + Seek>(
    source: Source<R>,
    format: ImageFormat,
    options: &ReadOptions,
    watch: &mut dyn Watch,
) -> Result<LoadedImage, ReadReason> {
    let Source { bytes: mut source, length: file_bytes, folder } = source;
    if file_bytes == 0 {
        return Err(ReadReason::Empty { format });
    }
    let mut head = [0; 8];
    let count = stream::fill(&mut source, &mut head)?;
    if !format.may_begin_with(&head[..count]) {
        return Err(ReadReason::Magic { format, found: head[..count].to_vec() });
    }
    source.rewind().map_err(ReadReason::Io)?;

    let cancelled = Cell::new(false);
    let source = Watched::new(source, file_bytes, watch, &cancelled);
    let image = match format {
        // these say more than the image
        ImageFormat::Segy => {
            let loaded = segy::read(source, file_bytes, &options.segy);
            return if cancelled.get() { Err(Cancelled.into()) } else { loaded };
        }
        ImageFormat::Rsf => {
            let loaded = rsf::read(source, file_bytes, folder, options.segy.vertical);
            return if cancelled.get() { Err(Cancelled.into()) } else { loaded };
        }
        ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Pnm => {
            raster::read(source, file_bytes, format)
        }
        ImageFormat::Tiff => tiff::read(source, file_bytes),
        ImageFormat::Npy => npy::read(source, file_bytes),
        ImageFormat::Nifti => nifti::read(source, file_bytes),
        ImageFormat::NiftiGz => nifti::read_gzipped(source, file_bytes),
        ImageFormat::Raw => match &options.raw {
            Some(layout) => raw::read(source, file_bytes, layout),
            None => Err(ReadReason::NoRawLayout),
        },
    };
    if cancelled.get() { Err(Cancelled.into()) } else { image.map(LoadedImage::from) }
}

/// Writes an image in the format that the file's name promises: NPY (array (y, x) or (z, y, x)),
/// NIfTI-1 with the frame as sform and qform, PNG (flat, `uint8` and `uint16`), TIFF (a page for
/// each z), or raw (least significant byte first). Only NIfTI-1 keeps the frame.
///
/// The file appears when all is written, or not at all; it holds no time and no name.
///
/// # Errors
/// [`WriteError`] with the reason; a watch that ends the work gives [`WriteReason::Cancelled`].
pub fn write_image<const D: usize>(
    path: &Path,
    image: &Image<D>,
    watch: &mut dyn Watch,
) -> Result<(), WriteError> {
    let mut write = || {
        let unknown = || WriteReason::UnknownExtension { extension: extension(path) };
        let format = ImageFormat::from_path(path).ok_or_else(unknown)?;
        check(watch, Phase::Write, 0.0, None)?;
        let mut file = AtomicFile::create(path)?;
        match format {
            ImageFormat::Png => raster::write(&mut file, image)?,
            ImageFormat::Tiff => tiff::write(&mut file, image, watch)?,
            ImageFormat::Npy => npy::write(&mut file, image, watch)?,
            ImageFormat::Nifti => nifti::write(&mut file, image, watch)?,
            ImageFormat::NiftiGz => nifti::write_gzipped(&mut file, image, watch)?,
            ImageFormat::Raw => stream::write_samples(&mut file, image.samples(), format, watch)?,
            ImageFormat::Jpeg | ImageFormat::Pnm | ImageFormat::Segy | ImageFormat::Rsf => {
                return Err(unknown());
            }
        }
        Ok(file.commit()?)
    };
    write().map_err(|reason| WriteError { path: path.into(), reason })
}

/// A shape as people write it: `640 × 480`.
fn shape_text(shape: &[usize]) -> String {
    shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" × ")
}

/// The product of the shape, if so many samples may be in a file of `file_bytes` bytes that packs
/// at most `density` of them into a byte. Headers lie; room is made only for what this lets pass.
fn plausible_count(shape: &[usize], file_bytes: u64, density: u64) -> Result<usize, ReadReason> {
    let most = u128::from(file_bytes) * u128::from(density);
    let count = shape.iter().try_fold(1usize, |n, &s| n.checked_mul(s));
    match count {
        Some(n) if n as u128 <= most => Ok(n),
        _ => Err(ReadReason::TooLarge { shape: shape_text(shape), file_bytes }),
    }
}
