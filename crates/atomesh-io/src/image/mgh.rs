//! FreeSurfer's volumes, `.mgh`, or `.mgz` packed by gzip: a header of 284 bytes, then the samples, x fastest, frame
//! after frame, the most significant byte first.
//!
//! Definition: <https://surfer.nmr.mgh.harvard.edu/fswiki/FsTutorial/MghFormat>. The header states spacing, direction
//! cosines and the place of the middle, sample (nx, ny, nz) / 2, in RAS and millimetres. Where it says that these are
//! not valid, FreeSurfer takes a spacing of 1 and coronal slices about the origin; so does this reader, with a note.
//! Cosines that are no unit vectors are taken for not valid, too.
//! What stands behind the samples (scan parameters, names) does not count.

use std::io::Read;

use atomesh::geometry::dot;

use super::affine::{self, Affine};
use super::codec::{Begins, Codec, Source};
use super::colour::Values;
use super::error::ReadReason;
use super::format::ImageFormat;
use super::gunzip::{GZIP, Unpacked};
use super::note::{LoadedImage, ReadNote};
use super::options::GivenFrame;
use super::sample_type::{ByteOrder, SampleType};
use super::stream;
use super::volumes::Volumes;

const FORMAT: ImageFormat = ImageFormat::named("MGH");
const FORMAT_GZIPPED: ImageFormat = ImageFormat::named("MGZ");

pub(super) const CODEC: Codec = Codec {
    endings: &[".mgh"],
    has_frame: true,
    z_is_height: true,
    ..Codec::reading(FORMAT, read_plain)
};

pub(super) const GZIPPED: Codec = Codec {
    format: FORMAT_GZIPPED,
    endings: &[".mgz", ".mgh.gz"],
    begins: Begins::Mostly(&[GZIP]),
    read: read_gzipped,
    ..CODEC
};

/// The bytes before the first sample.
const HEADER: usize = 284;

/// How far the squared length of direction cosines, in single precision, may be from 1.
const COSINE: f64 = 0.02;

/// Coronal slices: x to the left, y down, z to the front, one after another.
const CORONAL: [[f64; 3]; 3] = [[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];

fn wrong(field: &'static str, value: impl ToString, expected: &'static str) -> ReadReason {
    affine::wrong(FORMAT, field, value.to_string(), expected)
}

/// What a header says.
#[derive(Debug)]
struct Header {
    shape: [usize; 3],
    frames: u64,
    sample_type: SampleType,
    /// Whether the header says that its frame is valid.
    is_valid: bool,
    spacing: [f64; 3],
    /// The directions of the axes, one after another.
    axes: [[f64; 3]; 3],
    /// Where the sample in the middle is.
    middle: [f64; 3],
}

impl Header {
    fn read(source: &mut dyn Read) -> Result<Self, ReadReason> {
        let mut bytes = [0; HEADER];
        let filled = stream::fill(source, &mut bytes)?;
        if filled < HEADER {
            return Err(wrong("length", format!("{filled} bytes"), "284 bytes"));
        }
        let word = |at: usize| -> [u8; 4] { std::array::from_fn(|k| bytes[at + k]) };
        let whole = |k: usize| i32::from_be_bytes(word(4 * k));
        // the version's upper bytes tell what else may be in the file
        if whole(0) & 0xff != 1 {
            return Err(wrong("version", whole(0), "1"));
        }
        let count = |k: usize, field: &'static str| {
            let found = usize::try_from(whole(k)).ok().filter(|&n| n > 0);
            found.ok_or_else(|| wrong(field, whole(k), "1 or more"))
        };
        let shape = [count(1, "width")?, count(2, "height")?, count(3, "depth")?];
        let frames = count(4, "nframes")? as u64;
        let sample_type = match whole(5) {
            0 => SampleType::U8,
            1 => SampleType::I32,
            3 => SampleType::F32,
            4 => SampleType::I16,
            10 => SampleType::U16,
            other => return Err(wrong("type", other, "0, 1, 3, 4 or 10")),
        };
        let is_valid = i16::from_be_bytes([bytes[28], bytes[29]]) > 0;
        let real = |k: usize| f64::from(f32::from_be_bytes(word(30 + 4 * k)));
        let spacing = [0, 1, 2].map(real);
        let axes: [[f64; 3]; 3] =
            std::array::from_fn(|c| std::array::from_fn(|r| real(3 + 3 * c + r)));
        let middle = [12, 13, 14].map(real);
        Ok(Self { shape, frames, sample_type, is_valid, spacing, axes, middle })
    }

    /// The frame, and what there is to note of it. Directions that the caller gives go before those of the header.
    fn affine(&self, given: GivenFrame) -> (Affine, Option<ReadNote>) {
        let Self { shape, is_valid, spacing, axes, middle, .. } = *self;
        let is_cosine = |axis: &[f64; 3]| (dot(axis, axis) - 1.0).abs() <= COSINE;
        if !is_valid {
            let fault = "the header says that its frame is not valid";
            let usual = "steps of 1 mm and coronal slices about the origin, as FreeSurfer does,";
            let affine = about(shape, [1.0; 3], CORONAL, [0.0; 3]);
            return (affine, Some(ReadNote::UsualFrame { fault, usual }));
        }
        if given.direction {
            return (about(shape, spacing, Affine::scaling([1.0; 3]).matrix, middle), None);
        }
        if !axes.iter().all(is_cosine) {
            let fault = "the header's direction cosines are no unit vectors";
            let usual = "coronal slices, with its spacing about its middle,";
            let affine = about(shape, spacing, CORONAL, middle);
            return (affine, Some(ReadNote::UsualFrame { fault, usual }));
        }
        (about(shape, spacing, axes, middle), None)
    }
}

/// The affine of samples whose middle is at a place; `axes` are directions, one after another.
fn about(shape: [usize; 3], spacing: [f64; 3], axes: [[f64; 3]; 3], middle: [f64; 3]) -> Affine {
    let matrix: [[f64; 3]; 3] =
        std::array::from_fn(|r| std::array::from_fn(|c| axes[c][r] * spacing[c]));
    let half = shape.map(|n| n as f64 / 2.0);
    let origin =
        std::array::from_fn(|r| middle[r] - (0..3).map(|c| matrix[r][c] * half[c]).sum::<f64>());
    Affine { matrix, origin }
}

fn read_plain(source: Source) -> Result<LoadedImage, ReadReason> {
    read(source, false)
}

fn read_gzipped(source: Source) -> Result<LoadedImage, ReadReason> {
    read(source, true)
}

/// Reads the frame that is wanted, plain or gzipped whatever the name promises.
fn read(source: Source, is_gz: bool) -> Result<LoadedImage, ReadReason> {
    let Source { bytes, length, memory, options, .. } = source;
    let mut source = Unpacked::new(bytes)?;
    let header = Header::read(&mut source.bytes)?;
    let volumes = Volumes {
        shape: &header.shape,
        count: header.frames,
        sample_type: header.sample_type,
        channels: 1,
        byte_order: ByteOrder::Big,
        scale: None,
        gap: 0,
    };
    let mut notes = Vec::new();
    if source.is_packed != is_gz {
        notes.push(ReadNote::Gzip { is_packed: source.is_packed });
    }
    let (affine, usual) = header.affine(options.given);
    notes.extend(usual);
    let (which, chosen) = volumes.chosen(options.stack.volume)?;
    notes.extend(chosen);
    let length = if source.is_packed { length } else { length.saturating_sub(HEADER as u64) };
    let mut values = Values::new(FORMAT, options.meaning);
    let samples = || volumes.read(which, &mut source, length, &mut values, memory);
    let loaded = affine::placed(FORMAT, &header.shape, affine.with_given(options.given), samples)?;
    notes.extend(loaded.notes);
    let units = vec!["mm".into(); loaded.image.dimension()];
    Ok(LoadedImage { units, notes, ..loaded })
}

#[cfg(test)]
mod tests;
