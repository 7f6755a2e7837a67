//! DICOM: a folder with the slices of one series, or a file with one frame or many.
//!
//! Files are known by their magic word, or their first element, whatever their names are. Files without an image (reports,
//! a `DICOMDIR`) are ignored. Where the folder itself holds no image, those below it are read. Of several series one is
//! chosen ([`ReadOptions::series`]); its images must be alike and evenly spaced: mixed, missing or duplicate slices are
//! errors that name files and values. World coordinates are LPS in the files and are turned to RAS, as NIfTI's are.
//!
//! Samples are those that are stored, or single precision where the file rescales them: by slope and intercept
//! (Hounsfield units), a look-up table, or the scaling of a dose. Where the least value is white (MONOCHROME1), stored
//! values are turned round first, as ITK does, but for labels and masks. Segmentations become labels.
//!
//! Slices of a tilted gantry, and slices that stand nearly evenly, are resampled onto a grid, with a note. A single slice is
//! a flat image; its frame is kept if the slice lies across z, and is its spacing alone if not, since a plane has no other
//! place for it: a note says where it is. The spacing of a radiograph may be known at the detector alone (imager pixel spacing); it is taken, with a
//! note. What the caller gives of the frame need not be in the files: slices without a position are put in the order of
//! their instance numbers where the spacing is given.
//!
//! The grammar of a data set is read here by hand, and not by the crate `dicom-object`: that makes room for a value of
//! whatever length the file states, 4 GiB at worst, holds all that comes before the pixel data, and brings some 50 crates,
//! an unmaintained one among them. Packed frames are left to crates ([`packing`]).

use std::fs::File;
use std::path::Path;

use super::affine::World;
use super::codec::{Codec, Folder, Source};
use super::error::ReadReason;
use super::format::ImageFormat;
use super::note::LoadedImage;

mod choose;
mod data_set;
mod flat;
mod folder;
mod frames;
mod grid;
mod header;
mod jpeg;
mod jpeg12;
mod jpeg2000;
mod packing;
mod pixels;
mod reader;
mod runs;
mod segments;
mod series;
mod source;
mod tag;
mod volume;

use frames::Frames;
use header::Found;
use reader::Reader;
use volume::{Scan, Wishes};

const FORMAT: ImageFormat = ImageFormat::named("DICOM");

/// The unit of all lengths.
const MILLIMETRE: &str = "mm";

/// The world of all files.
const WORLD: World = World::LeftPosterior;

/// The magic word comes after 128 bytes of anything; the reader looks for it.
pub(super) const CODEC: Codec = Codec {
    endings: &[".dcm"],
    has_frame: true,
    z_is_height: true,
    folder: Some(Folder { is_part: is_dicom, read: folder::read }),
    ..Codec::reading(FORMAT, read)
};

/// Whether the file at a path begins as DICOM files do.
fn is_dicom(path: &Path) -> bool {
    File::open(path).is_ok_and(|mut file| reader::is_dicom(&mut file))
}

/// Reads a file.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let wishes = Wishes::of(source.options, source.memory);
    let mut reader = Reader::new(source.bytes, source.length);
    let found = Found::read(&mut reader, wishes.given)?;
    let found = found.ok_or_else(|| unsupported("no image", "a slice"))?;
    let scan = Scan::new(vec![(String::new(), found)], 0, &wishes)?;
    let mut frames = Frames::new(reader);
    scan.load(&wishes, &mut |header, (_, frame)| frames.values(header, frame, wishes.memory))
}

fn unsupported(found: impl Into<String>, expected: &'static str) -> ReadReason {
    ReadReason::Unsupported { format: FORMAT, found: found.into(), expected }
}
