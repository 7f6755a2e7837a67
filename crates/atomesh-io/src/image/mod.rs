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
//! | DICOM | a folder of slices, dcm | integers, rescaled to float32 | LPS turned to RAS |
//! | MetaImage | mha, mhd | every real type; zlib | LPS turned to RAS where the file speaks of a body |
//! | NRRD | nrrd, nhdr | every real type; gzip, ascii | LPS, LAS turned to RAS; others as they are |
//! | VTI | vti | every real type; zlib, base64, ascii | as it is |
//! | SEG-Y | sgy segy | IBM and IEEE floats, integers; lines and cubes | by coordinates and interval |
//! | RSF | rsf | floats, integers; native, XDR, ASCII | o and d of each axis |
//! | raw | raw, or any with a layout | every real type | none |
//!
//! World coordinates are those that the file states, with one exception. Files of bodies state them in
//! RAS (x to the right, y to the front, z to the head: NIfTI) or in LPS (x to the left, y to the back:
//! DICOM, and what ITK writes), half a turn apart. All of these are read as RAS, so that a scan lies in
//! the same place whatever file it comes in:
//!
//! | file | its world | read as |
//! | --- | --- | --- |
//! | NIfTI-1 | RAS | it stands |
//! | DICOM | LPS | turned to RAS |
//! | NRRD, `space` right-, left-anterior-superior, left-posterior-superior | as named | turned to RAS |
//! | NRRD, any other `space` or none | unknown | it stands |
//! | MetaImage with `AnatomicalOrientation` or a medical `Modality` | LPS | turned to RAS |
//! | MetaImage with neither | unknown | it stands |
//! | VTI | unknown | it stands |
//!
//! Meshes and images are written in the same coordinates: NIfTI and NRRD say RAS, VTI and mesh formats
//! have no word for it. Flat images of NRRD and MetaImage stand as they are, unless they name a body.
//!
//! An image without a frame has unit spacing and origin 0: the resolution that a PNG, JPEG or TIFF
//! states is one of printing.

use std::cell::Cell;
use std::fs::File;
use std::io::{Cursor, Read, Seek};
use std::path::Path;

use atomesh::image::{Frame, FrameError, Image, Range, Samples};
use atomesh::watch::{Cancelled, Phase, Watch, check};

use crate::atomic_file::AtomicFile;

mod affine;
mod dicom;
mod error;
mod format;
mod metaimage;
mod nifti;
mod note;
mod npy;
mod nrrd;
mod payload;
mod raster;
mod raw;
mod rsf;
mod sample_type;
mod segy;
mod stream;
mod text;
mod tiff;
mod traces;
mod vti;
mod watched;

pub use dicom::SeriesError;
pub use error::{ReadError, ReadReason, WriteError, WriteReason};
pub use format::ImageFormat;
use format::extension;
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
        let format = match (&options.raw, ImageFormat::of(path)) {
            (Some(_), _) => ImageFormat::Raw,
            (None, Some(format)) => format,
            (None, None) => {
                return Err(ReadReason::UnknownExtension { extension: extension(path) });
            }
        };
        let file = File::open(path).map_err(ReadReason::Io)?;
        let metadata = file.metadata().map_err(ReadReason::Io)?;
        if metadata.is_dir() && format == ImageFormat::Dicom {
            return dicom::read_folder(path, watch);
        }
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
    let loaded = match format {
        ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Pnm => {
            raster::read(source, file_bytes, format).map(LoadedImage::from)
        }
        ImageFormat::Tiff => tiff::read(source, file_bytes).map(LoadedImage::from),
        ImageFormat::Npy => npy::read(source, file_bytes).map(LoadedImage::from),
        ImageFormat::Nifti => nifti::read(source, file_bytes).map(LoadedImage::from),
        ImageFormat::NiftiGz => nifti::read_gzipped(source, file_bytes).map(LoadedImage::from),
        ImageFormat::Dicom => dicom::read(source, file_bytes),
        ImageFormat::MetaImage => metaimage::read(source, file_bytes, folder),
        ImageFormat::Nrrd => nrrd::read(source, file_bytes, folder),
        ImageFormat::Vti => vti::read(source, file_bytes),
        ImageFormat::Segy => segy::read(source, file_bytes, &options.segy),
        ImageFormat::Rsf => rsf::read(source, file_bytes, folder, options.segy.vertical),
        ImageFormat::Raw => match &options.raw {
            Some(layout) => raw::read(source, file_bytes, layout).map(LoadedImage::from),
            None => Err(ReadReason::NoRawLayout),
        },
    };
    if cancelled.get() { Err(Cancelled.into()) } else { loaded }
}

/// Writes an image in the format that the file's name promises: NPY (array (y, x) or (z, y, x)),
/// NIfTI-1 with the frame as sform and qform, PNG (flat, `uint8` and `uint16`), TIFF (a page for
/// each z), NRRD and VTI with the frame, or raw (least significant byte first). NIfTI-1 keeps the
/// frame in single precision, NRRD and VTI keep it exactly, the others have no room for it.
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
            ImageFormat::Nrrd => nrrd::write(&mut file, image, watch)?,
            ImageFormat::Vti => vti::write(&mut file, image, watch)?,
            ImageFormat::Raw => stream::write_samples(&mut file, image.samples(), format, watch)?,
            ImageFormat::Dicom
            | ImageFormat::Jpeg
            | ImageFormat::MetaImage
            | ImageFormat::Pnm
            | ImageFormat::Segy
            | ImageFormat::Rsf => {
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
