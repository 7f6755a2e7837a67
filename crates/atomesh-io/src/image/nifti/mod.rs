//! NIfTI-1 and NIfTI-2, in one file or a pair of header and samples, plain or gzipped: a header, then the samples, x
//! fastest, volume after volume. Written is NIfTI-1 in one file.
//!
//! Definition: <https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h> and `nifti2.h` beside it. World coordinates
//! are the file's own: x to the right, y to the front, z to the top of the head (RAS+), nearly always in millimetres;
//! the unit that the header names (`xyzt_units`) is stated, and none is changed. ANALYZE is refused by name.

use std::io::Write;

use atomesh::watch::Watch;
use flate2::write::GzEncoder;

use super::affine;
use super::codec::{Begins, Codec, Output, Source};
use super::colour::Values;
use super::error::{ReadReason, WriteReason};
use super::format::ImageFormat;
use super::gunzip::{GZIP, Unpacked};
use super::memory::Memory;
use super::note::{LoadedImage, ReadNote};
use super::options::{Meaning, ReadOptions};
use super::sample_type::SampleType;
use super::spelling::Spelling;
use super::stream;
use super::view::ImageView;
use super::volumes::Volumes;

mod encode;
mod header;
mod pair;
mod places;
mod quaternion;

use header::Header;
#[cfg(test)]
pub(super) use quaternion::rotation;

const FORMAT: ImageFormat = ImageFormat::named("NIfTI");
const FORMAT_GZIPPED: ImageFormat = ImageFormat::named("gzipped NIfTI");

pub(super) const CODEC: Codec = Codec {
    endings: &[".nii"],
    header_endings: &[".hdr", ".img"],
    has_frame: true,
    z_is_height: true,
    writes_floats: true,
    write: Some(write),
    ..Codec::reading(FORMAT, read)
};

pub(super) const GZIPPED: Codec = Codec {
    format: FORMAT_GZIPPED,
    endings: &[".nii.gz"],
    header_endings: &[".hdr.gz", ".img.gz"],
    begins: Begins::Mostly(&[GZIP]),
    read: read_gzipped,
    write: Some(write_gzipped),
    ..CODEC
};

/// Reads a file whose name promises that it is plain.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    read_either(source, false)
}

/// Reads a file whose name promises gzip.
fn read_gzipped(source: Source) -> Result<LoadedImage, ReadReason> {
    read_either(source, true)
}

/// Reads a file, or a pair of them by one of the two, plain or gzipped whatever their names are. A gzipped stream is
/// unpacked up to its end, so that its check sum is checked, unless that is far behind the samples.
fn read_either(source: Source, is_gz: bool) -> Result<LoadedImage, ReadReason> {
    let Source { mut bytes, length, folders, name, memory, options } = source;
    let names = name.and_then(pair::names);
    if let Some(pair) = names.as_ref().filter(|pair| pair.is_samples) {
        let (mut file, _) = pair.open(folders, &pair.header)?;
        let header = Header::read(&mut Unpacked::new(&mut file)?.bytes)?;
        return samples(header, Unpacked::new(bytes)?, length, (is_gz, memory, options));
    }
    let mut source = Unpacked::new(&mut bytes)?;
    let header = Header::read(&mut source.bytes)?;
    if !header.is_pair {
        return samples(header, source, length, (is_gz, memory, options));
    }
    let pair = names.ok_or_else(|| {
        header::wrong(
            "magic",
            "\"ni1\", a header without samples",
            "\"n+1\", or names .hdr and .img",
        )
    })?;
    drop(source);
    let (file, length) = pair.open(folders, &pair.samples)?;
    samples(header, Unpacked::new(bytes.over(file, length))?, length, (is_gz, memory, options))
}

/// Reads the volume that is wanted, from behind the header, or of a pair from the beginning of its samples.
fn samples(
    header: Header,
    mut source: Unpacked,
    length: u64,
    (is_gz, memory, options): (bool, Memory, &ReadOptions),
) -> Result<LoadedImage, ReadReason> {
    let header = header.with_given(options.given);
    let read_bytes = if header.is_pair { 0 } else { header.bytes };
    let volumes = Volumes {
        shape: &header.shape,
        count: header.volumes,
        sample_type: header.sample_type,
        channels: header.channels,
        byte_order: header.byte_order,
        scale: header.scale,
        gap: header.offset.saturating_sub(read_bytes),
    };
    let mut notes = header.notes;
    if source.is_packed != is_gz {
        notes.push(ReadNote::Gzip { is_packed: source.is_packed });
    }
    let (which, chosen) = volumes.chosen(options.stack.volume)?;
    notes.extend(chosen);
    let bytes = if source.is_packed { length } else { length.saturating_sub(read_bytes) };
    let mut values = Values::new(FORMAT, options.meaning);
    if header.channels > 1 && values.meaning == Meaning::Brightness {
        values.note(ReadNote::Luminance);
    }
    let mut more = Vec::new();
    let loaded = affine::placed(FORMAT, &header.shape, header.affine, || {
        let samples = volumes.read(which, &mut source, bytes, &mut values, memory)?;
        let (samples, said) = values.finish(samples);
        more = said;
        Ok(samples)
    })?;
    notes.extend(loaded.notes);
    notes.extend(more);
    let axes = loaded.image.dimension();
    let units = header.unit.map_or(Vec::new(), |unit| vec![unit.into(); axes]);
    Ok(LoadedImage { units, notes, ..loaded })
}

/// Writes a `.nii` file, the frame as sform and as qform (code 2, "aligned").
fn write(
    out: &mut dyn Output,
    image: &ImageView,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    write_plain(out, image, watch)
}

/// Writes a `.nii.gz` file; the gzip header holds neither name nor time.
fn write_gzipped(
    out: &mut dyn Output,
    image: &ImageView,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let mut packed = GzEncoder::new(out, flate2::Compression::default());
    write_plain(&mut packed, image, watch)?;
    packed.finish()?;
    Ok(())
}

fn write_plain(
    out: &mut dyn Write,
    image: &ImageView,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let sample_type = Spelling::of_samples(image.samples).map(|own| (own.nifti, own.sample_type));
    let (code, sample_type) = sample_type.unwrap_or((64, SampleType::F64));
    let bits = 8 * sample_type.size() as i16;
    out.write_all(&encode::encode(image, code, bits)?)?;
    stream::write_samples(out, image.samples, FORMAT, watch)
}
