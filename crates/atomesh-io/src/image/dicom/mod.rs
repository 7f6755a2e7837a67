//! DICOM: a folder with the slices of one series, or a single slice.
//!
//! Files are known by their magic word, whatever their names are. Files without an image (reports, a
//! `DICOMDIR`) are ignored. All images of a folder must be of one series, alike, and evenly spaced:
//! mixed, missing or duplicate slices are errors that name files and values. World coordinates are LPS
//! in the files and are turned to RAS, as NIfTI's are. Samples are those that are stored, or, with a
//! rescale slope and intercept (Hounsfield units), single precision; where the least value is white
//! (MONOCHROME1) they are turned round first. A single slice is a flat image; its frame is kept if the
//! slice lies across z, and is its spacing alone if not, since a plane has no other place for it. The spacing of a
//! radiograph may be known at the detector alone (imager pixel spacing); it is taken, with a note.
//!
//! What the caller gives of the frame need not be in the files: slices without a position are put in the order of their
//! instance numbers where the spacing is given.
//!
//! Plain samples are read, and those packed by run lengths. JPEG and its kin, frames in one file, and
//! colours are refused by name. The grammar of a data set is short and written here by hand: the crate that
//! has more of it brings some 50 others, an unmaintained one among them.

use std::fs::{self, File};
use std::path::Path;

use atomesh::image::Samples;
use atomesh::watch::{Phase, Watch, check};

use super::affine::{self, Affine, World};
use super::any_image::AnyImage;
use super::codec::{Codec, Folder, Source};
use super::error::ReadReason;
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::{LoadedImage, ReadNote};
use super::options::{GivenFrame, ReadOptions};

mod data_set;
mod series;
mod slice;

use data_set::Reader;
use series::Series;
use slice::{Pixels, Scale, Slice};

const FORMAT: ImageFormat = ImageFormat::named("DICOM");

/// The unit of all lengths.
const MILLIMETRE: &str = "mm";

/// The magic word comes after 128 bytes of anything; the reader looks for it.
pub(super) const CODEC: Codec = Codec {
    endings: &[".dcm"],
    has_frame: true,
    z_is_height: true,
    folder: Some(Folder { is_part: is_dicom, read: read_folder }),
    ..Codec::reading(FORMAT, read)
};

/// Whether the file at a path begins as DICOM files do.
fn is_dicom(path: &Path) -> bool {
    File::open(path).is_ok_and(|mut file| data_set::is_dicom(&mut file))
}

/// Reads a file with a single slice.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let (given, memory) = (source.options.given, source.memory);
    let mut reader = Reader::new(source.bytes, source.length);
    let slice = Slice::read(&mut reader)?.ok_or_else(|| ReadReason::Unsupported {
        format: FORMAT,
        found: "no image".into(),
        expected: "a slice",
    })?;
    let shape = slice.pixels.shape;
    let flat = Flat::of(&slice, given);
    let image = affine::image(FORMAT, &shape, flat.affine, || {
        let mut volume = Volume::new(&slice.pixels, slice.is_plain(), shape[0] * shape[1], memory)?;
        volume.append(&slice.samples(&mut reader, memory)?, slice.scale);
        Ok(volume.samples)
    })?;
    Ok(flat.loaded(image))
}

/// Reads the slices in a folder.
fn read_folder(
    folder: &Path,
    options: &ReadOptions,
    watch: &mut dyn Watch,
) -> Result<LoadedImage, ReadReason> {
    let memory = Memory::up_to(options.memory_limit);
    let (slices, others) = headers(folder, watch)?;
    let series = Series::new(slices, others, options.given)?;
    let slices = &series.slices;
    let (_, head) = &slices[0];
    let [nx, ny] = head.pixels.shape;
    let samples = || {
        let is_plain = slices.iter().all(|(_, slice)| slice.is_plain());
        let mut volume = Volume::new(&head.pixels, is_plain, nx * ny * slices.len(), memory)?;
        for (k, (file, slice)) in slices.iter().enumerate() {
            check(watch, Phase::Read, 0.1 + 0.9 * k as f64 / slices.len() as f64, None)?;
            let values =
                open(&folder.join(file)).and_then(|mut reader| slice.samples(&mut reader, memory));
            volume.append(&values.map_err(|reason| in_file(file, reason))?, slice.scale);
        }
        Ok(volume.samples)
    };
    if slices.len() == 1 {
        let flat = Flat::of(head, options.given);
        return Ok(flat.loaded(affine::image(FORMAT, &[nx, ny], flat.affine, samples)?));
    }
    let affine = head.affine(series.step).with_given(options.given);
    let image = affine::image(FORMAT, &[nx, ny, slices.len()], affine, samples)?;
    let loaded = LoadedImage { units: vec![MILLIMETRE.into(); 3], ..image.into() };
    let by_number = ReadNote::ByNumber { numbers: "instance numbers" };
    Ok(loaded.noting(World::LeftPosterior.note()).noting(series.is_by_number.then_some(by_number)))
}

/// The slices in a folder, each with the name of its file, and how many other files there are.
fn headers(
    folder: &Path,
    watch: &mut dyn Watch,
) -> Result<(Vec<(String, Slice)>, usize), ReadReason> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(ReadReason::Io)? {
        let entry = entry.map_err(ReadReason::Io)?;
        // links are followed
        if entry.path().is_file() {
            names.push(entry.file_name());
        }
    }
    names.sort();
    let (mut slices, mut others) = (Vec::new(), 0);
    for (k, name) in names.iter().enumerate() {
        // a header is some kilobytes, a slice half a megabyte
        check(watch, Phase::Read, 0.1 * k as f64 / names.len() as f64, None)?;
        let text = name.to_string_lossy().into_owned();
        let slice = header(&folder.join(name)).map_err(|reason| in_file(&text, reason))?;
        match slice {
            Some(slice) => slices.push((text, slice)),
            None => others += 1,
        }
    }
    Ok((slices, others))
}

/// The error of a file in the folder.
fn in_file(file: &str, reason: ReadReason) -> ReadReason {
    match reason {
        ReadReason::Cancelled(_) => reason,
        _ => ReadReason::Slice { file: file.into(), reason: Box::new(reason) },
    }
}

fn open(path: &Path) -> Result<Reader<File>, ReadReason> {
    let file = File::open(path).map_err(ReadReason::Io)?;
    let bytes = file.metadata().map_err(ReadReason::Io)?.len();
    Ok(Reader::new(file, bytes))
}

/// The header of a slice; none if the file is not DICOM, or holds no image.
fn header(path: &Path) -> Result<Option<Slice>, ReadReason> {
    if is_dicom(path) { Slice::read(&mut open(path)?) } else { Ok(None) }
}

/// A single slice without its samples: where it is if it lies across z, else its spacing alone.
struct Flat {
    affine: Affine,
    world: World,
    /// What is said of the spacing.
    note: Option<ReadNote>,
}

impl Flat {
    fn of(slice: &Slice, given: GivenFrame) -> Self {
        let spacing = slice.spacing.or(slice.imager_spacing);
        let note = match (slice.spacing, slice.imager_spacing) {
            (Some(_), _) => None,
            (None, Some(spacing)) => Some(ReadNote::AtDetector { spacing }),
            (None, None) => Some(ReadNote::NoSpacing),
        };
        let mut slice = slice.clone();
        slice.spacing = spacing;
        let affine = slice.affine([0.0, 0.0, 1.0]).with_given(given);
        if affine::flat_frame(FORMAT, slice.pixels.shape, affine).is_ok() {
            return Self { affine, world: World::LeftPosterior, note };
        }
        let [x, y] = spacing.unwrap_or([1.0; 2]);
        Self { affine: Affine::scaling([x, y, 1.0]), world: World::Ours, note }
    }

    /// The image with what is known of it.
    fn loaded(&self, image: AnyImage) -> LoadedImage {
        let units = match self.note {
            Some(ReadNote::NoSpacing) => Vec::new(),
            _ => vec![MILLIMETRE.into(); 2],
        };
        LoadedImage { units, ..image.into() }.noting(self.world.note()).noting(self.note.clone())
    }
}

/// The samples of all slices.
struct Volume {
    samples: Samples,
}

impl Volume {
    /// Room for `count` samples, in the least type that holds the stored ones, or in single precision
    /// if they are rescaled.
    fn new(
        pixels: &Pixels,
        is_plain: bool,
        count: usize,
        memory: Memory,
    ) -> Result<Self, ReadReason> {
        let samples = match (is_plain, pixels.stored, pixels.is_signed) {
            (false, ..) => Samples::F32(room(count, memory)?.into()),
            (_, ..9, false) => Samples::U8(room(count, memory)?.into()),
            (_, ..9, true) => Samples::I8(room(count, memory)?.into()),
            (_, ..17, false) => Samples::U16(room(count, memory)?.into()),
            (_, ..17, true) => Samples::I16(room(count, memory)?.into()),
            (_, _, false) => Samples::U32(room(count, memory)?.into()),
            (_, _, true) => Samples::I32(room(count, memory)?.into()),
        };
        Ok(Self { samples })
    }

    /// Appends the samples of a slice.
    fn append(&mut self, values: &[i64], scale: Scale) {
        /// Appends with one function for each type of integers.
        macro_rules! append_as {
            ($($kind:ident $number:ty),*) => {
                match &mut self.samples {
                    $(Samples::$kind(v) => v.to_mut().extend(values.iter().map(|&x| x as $number)),)*
                    Samples::F32(v) => {
                        v.to_mut().extend(values.iter().map(|&x| scale.of(x)));
                    }
                    _ => {} // no other is made
                }
            };
        }
        append_as!(U8 u8, I8 i8, U16 u16, I16 i16, U32 u32, I32 i32);
    }
}

/// A vector with room for `count` samples.
fn room<T>(count: usize, memory: Memory) -> Result<Vec<T>, ReadReason> {
    let mut samples = Vec::new();
    memory.reserve(&mut samples, count)?;
    Ok(samples)
}
