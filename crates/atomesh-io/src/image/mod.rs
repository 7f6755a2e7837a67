//! Image files: bytes to [`Image`] and back, one file per format.
//!
//! `table` lists the formats. A file's ending chooses one, and its first bytes must agree. Each reader
//! checks what the header promises against the size of the file, and against the memory that there is, before
//! it allocates any, then streams the samples into the one vector that will hold them, in the file's own
//! type. Headers may name files of samples beside them and below, and elsewhere where the caller allows it
//! ([`ReadOptions::data_root`]); messages quote neither those files nor text that may be no header.
//!
//! | format | endings | samples | frame |
//! | --- | --- | --- | --- |
//! | PNG, JPEG, PNM | png, jpg jpeg, pgm ppm pbm pnm pam | 8 and 16 bits; colour to luminance | none |
//! | TIFF | tif tiff | integers, floats; many pages are a volume, or a stack of channels and times | spacing |
//! | slices | a folder of TIFF, PNG, JPEG or PNM | as those | spacing |
//! | NPY, NPZ | npy, npz | every real type; arrays (y, x) or (z, y, x) | none |
//! | NIfTI-1, NIfTI-2 | nii nii.gz hdr img | every real type, RGB; one volume | sform, else qform, else spacing |
//! | MGH, MGZ | mgh mgz | bytes, integers, floats; one volume | RAS |
//! | DICOM | a folder of slices, dcm | integers, rescaled to float32; packed ones too; frames, segments | LPS turned to RAS |
//! | MetaImage | mha, mhd | every real type; zlib | LPS turned to RAS where the file speaks of a body |
//! | NRRD | nrrd, nhdr | every real type; gzip, bzip2, ascii, hex; segments | LPS, LAS turned to RAS; others as they are |
//! | VTI | vti | every real type; zlib, LZ4, LZMA, base64, ascii | as it is |
//! | VTK | vtk | every real type; ascii, binary | as it is |
//! | SEG-Y, SU | segy sgy, su | IBM and IEEE floats, integers; lines and cubes | by coordinates and interval |
//! | RSF | rsf | floats, integers; native, XDR, ASCII | o and d of each axis |
//! | raw | raw, or any with a layout | every real type | none |
//!
//! World coordinates are those that the file states, with one exception. Files of bodies state them in
//! RAS (x to the right, y to the front, z to the head: NIfTI) or in LPS (x to the left, y to the back:
//! DICOM, and what ITK writes), half a turn apart. All are read as RAS, so that a scan lies in the same
//! place whatever its format:
//!
//! | file | its world | read as |
//! | --- | --- | --- |
//! | NIfTI, MGH | RAS | it is |
//! | DICOM | LPS | turned to RAS |
//! | NRRD, `space` right-, left-anterior-superior, left-posterior-superior | as named | turned to RAS |
//! | NRRD, any other `space` or none | unknown | it is |
//! | MetaImage with `AnatomicalOrientation` or a medical `Modality` | LPS | turned to RAS |
//! | MetaImage with neither | unknown | it is |
//! | VTI, VTK | unknown | it is |
//!
//! Meshes and images are written in the same coordinates: NIfTI and NRRD say RAS, VTI and mesh formats
//! have no word for it. Flat images of NRRD and MetaImage stand as they are, unless they name a body.
//!
//! An image without a frame has unit spacing and origin 0: the resolution that a PNG or JPEG states is one of printing.
//! That of a TIFF counts, unless it is one that software writes unasked: 72, 96, 150, 300 or 600 an inch.
//!
//! Units are the file's own: micrometres stay micrometres. [`LoadedImage::units`] names them where the file does: `um`
//! of most micrographs, `mm` of DICOM, what NIfTI states.
//!
//! | values | as brightness | as labels ([`Meaning`]) |
//! | --- | --- | --- |
//! | colour | luminance | refused; or a label a colour, black 0, others from 1 by ascending red, green, blue |
//! | palette | of its colours | the indices |
//! | grey of 1, 2 or 4 bits (PNG, TIFF), PNM of another greatest value | stretched to 8 or 16 bits | as stored |
//! | PBM | black 0, white 255 | black 0, white 1 |
//! | TIFF with 0 for white | turned round | as stored |

use std::cell::Cell;
use std::fs::File;
use std::io::Cursor;
use std::path::Path;

use atomesh::image::Image;
use atomesh::watch::{Cancelled, Phase, Watch, check};

use crate::atomic_file::AtomicFile;

mod affine;
mod any_image;
mod channels;
mod codec;
mod colour;
mod detached;
mod dicom;
mod error;
mod format;
mod gunzip;
mod jpeg;
mod length;
mod memory;
mod metaimage;
mod mgh;
mod nifti;
mod note;
mod npy;
mod npz;
mod nrrd;
mod options;
mod payload;
mod png;
mod pnm;
mod raw;
mod rsf;
mod sample_type;
mod scan_note;
mod segy;
mod series_error;
mod shape;
mod slices;
mod spelling;
mod stream;
mod table;
mod text;
mod tiff;
mod traces;
mod view;
mod volumes;
mod vti;
mod vtk;
mod watched;

pub use any_image::AnyImage;
use codec::{Input, Source};
use detached::DataFolders;
pub use error::{ReadError, ReadReason, WriteError, WriteReason};
pub use format::ImageFormat;
pub use length::metres;
use memory::Memory;
pub use note::{IntervalSource, LoadedImage, ReadNote};
pub use options::{
    Duplicates, GivenFrame, Meaning, RawLayout, ReadOptions, SegyOptions, StackOptions, Vertical,
};
pub use sample_type::{ByteOrder, SampleType, UnknownByteOrder, UnknownSampleType};
pub use scan_note::ScanNote;
pub use series_error::SeriesError;
use table::extension;
pub use traces::SampleFormat;
use view::ImageView;
use watched::Watched;

/// Reads an image from a file, in the format that its name promises.
///
/// Colour becomes luminance by Rec. 601, 0.299 R + 0.587 G + 0.114 B of the values as stored,
/// rounded; opacity is ignored. NaN is kept: [`Samples::range`](atomesh::image::Samples::range) counts it.
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
    let loaded = load(path, options, watch).map(|loaded| wanted(loaded, options));
    loaded.map_err(|reason| ReadError { path: path.into(), reason })
}

fn load(
    path: &Path,
    options: &ReadOptions,
    watch: &mut dyn Watch,
) -> Result<LoadedImage, ReadReason> {
    let format = match (&options.raw, ImageFormat::of(path)) {
        (Some(_), _) => ImageFormat::RAW,
        (None, Some(format)) => format,
        (None, None) => {
            let known = ImageFormat::endings().collect::<Vec<_>>().join(" ");
            return Err(ReadReason::UnknownExtension { extension: extension(path), known });
        }
    };
    let metadata = path.metadata().map_err(ReadReason::Io)?;
    if metadata.is_dir() {
        return match &format.codec().folder {
            Some(folder) => (folder.read)(path, options, watch),
            None => Err(ReadReason::Io(std::io::ErrorKind::IsADirectory.into())),
        };
    }
    if !metadata.is_file() {
        // a pipe would keep us waiting, a device has no end
        return Err(ReadReason::Io(std::io::Error::other("it is not a plain file")));
    }
    let mut file = File::open(path).map_err(ReadReason::Io)?;
    let root = options.data_root.as_deref();
    let folders = path.parent().map(|own| DataFolders { own, root });
    let name = path.file_name().and_then(|name| name.to_str());
    let file = Stored { bytes: &mut file, length: metadata.len(), folders, name };
    decode(file, format, options, watch)
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
    load_bytes(bytes, format, options, watch).map(|loaded| loaded.image)
}

/// Whether a file is an image though its name is that of a mesh, too: `.npz` and `.vtk` can be either.
pub(crate) fn is_image_named_as_mesh(path: &Path) -> bool {
    let test = ImageFormat::from_path(path).and_then(|format| format.codec().is_no_mesh);
    test.is_some_and(|is_image| is_image(path))
}

fn load_bytes(
    bytes: &[u8],
    format: ImageFormat,
    options: &ReadOptions,
    watch: &mut dyn Watch,
) -> Result<LoadedImage, ReadReason> {
    let mut cursor = Cursor::new(bytes);
    let stored =
        Stored { bytes: &mut cursor, length: bytes.len() as u64, folders: None, name: None };
    decode(stored, format, options, watch).map(|loaded| wanted(loaded, options))
}

/// The bytes of a file, their number, and where the files that it names may be, if that is known.
struct Stored<'a> {
    bytes: &'a mut dyn Input,
    length: u64,
    folders: Option<DataFolders<'a>>,
    /// The file's own name there.
    name: Option<&'a str>,
}

fn decode(
    stored: Stored,
    format: ImageFormat,
    options: &ReadOptions,
    watch: &mut dyn Watch,
) -> Result<LoadedImage, ReadReason> {
    let Stored { bytes, length, folders, name } = stored;
    if length == 0 {
        return Err(ReadReason::Empty { format });
    }
    let codec = format.codec();
    let mut head = [0; 8];
    let count = stream::fill(bytes, &mut head)?;
    if !codec.may_begin_with(&head[..count]) {
        let like = ImageFormat::beginning_with(&head[..count]);
        return Err(ReadReason::Magic { format, found: head[..count].to_vec(), like });
    }
    bytes.rewind().map_err(ReadReason::Io)?;
    let cancelled = Cell::new(false);
    let bytes: &mut dyn Input = bytes; // no longer than the watch
    let bytes = Watched::new(bytes, length, watch, &cancelled);
    let memory = Memory::up_to(options.memory_limit);
    let loaded = (codec.read)(Source { bytes, length, folders, name, memory, options });
    if cancelled.get() { Err(Cancelled.into()) } else { loaded }
}

/// What was read, with notes on options that it did not meet. A spacing that the caller gives is in units of the
/// caller, and what the file says of its own does not count.
fn wanted(mut loaded: LoadedImage, options: &ReadOptions) -> LoadedImage {
    if options.given.spacing {
        loaded.units.clear();
        loaded.notes.retain(|note| !note.is_about_spacing());
    }
    let notes = &mut loaded.notes;
    let has_colours = notes.iter().any(|note| matches!(note, ReadNote::ColourLabels { .. }));
    if options.meaning == Meaning::LabelsByColour && !has_colours {
        notes.push(ReadNote::NoColours);
    }
    let is_segment = |note: &ReadNote| matches!(note, ReadNote::Segment { .. });
    if let Some(wanted) = options.segment.clone().filter(|_| !notes.iter().any(is_segment)) {
        notes.push(ReadNote::NoSegments { wanted });
    }
    let is_array = |note: &ReadNote| matches!(note, ReadNote::OneArray { .. });
    if let Some(wanted) = options.array.clone().filter(|_| !notes.iter().any(is_array)) {
        notes.push(ReadNote::NoArrays { wanted });
    }
    let StackOptions { channel, time, volume } = options.stack;
    for (name, wanted) in [("channel", channel), ("time", time), ("volume", volume)] {
        let is_said = |note: &ReadNote| matches!(note, ReadNote::Chosen { axis, .. } | ReadNote::OnePlane { axis, .. } if *axis == name);
        if let Some(wanted) = wanted.filter(|&n| n > 1)
            && !notes.iter().any(is_said)
        {
            notes.push(ReadNote::OnePlane { axis: name, wanted });
        }
    }
    loaded
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
    let written = write(path, &ImageView::of(image), watch);
    written.map_err(|reason| WriteError { path: path.into(), reason })
}

fn write(path: &Path, image: &ImageView, watch: &mut dyn Watch) -> Result<(), WriteReason> {
    let format = ImageFormat::from_path(path);
    let Some(write) = format.and_then(|format| format.codec().write) else {
        let known = ImageFormat::written_endings().collect::<Vec<_>>().join(" ");
        return Err(WriteReason::UnknownExtension { extension: extension(path), known });
    };
    check(watch, Phase::Write, 0.0, None)?;
    let mut file = AtomicFile::create(path)?;
    write(&mut file, image, watch)?;
    Ok(file.commit()?)
}
