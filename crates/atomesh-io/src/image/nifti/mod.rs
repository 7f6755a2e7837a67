//! NIfTI-1 in one file, plain or gzipped: a header of 348 bytes, then the samples, x fastest.
//!
//! Definition: <https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h>. World coordinates are
//! the file's own: x to the right, y to the front, z to the top of the head (RAS+), nearly always
//! in millimetres; the unit that the header names (`xyzt_units`) is stated, and none is changed. Two-file NIfTI (`.hdr` and `.img`), NIfTI-2 and ANALYZE are refused by name.

use std::io::{Read, Write};

use atomesh::watch::Watch;
use flate2::read::MultiGzDecoder;
use flate2::write::GzEncoder;

use super::affine;
use super::any_image::AnyImage;
use super::codec::{Begins, Codec, Output, Source};
use super::error::{ReadReason, WriteReason};
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::LoadedImage;
use super::sample_type::SampleType;
use super::shape::plausible_count;
use super::spelling::Spelling;
use super::stream::{self, GZIP_RATIO, Layout};
use super::view::ImageView;

mod encode;
mod header;
mod quaternion;

use header::Header;
#[cfg(test)]
pub(super) use quaternion::rotation;

const FORMAT: ImageFormat = ImageFormat::named("NIfTI-1");
const FORMAT_GZIPPED: ImageFormat = ImageFormat::named("gzipped NIfTI-1");

/// The most bytes that are unpacked behind the samples.
const MOST_BEHIND: u64 = 1 << 24;

/// The magic word of a gzip stream.
const GZIP: &[u8] = b"\x1f\x8b";

pub(super) const CODEC: Codec = Codec {
    endings: &[".nii"],
    // the magic word stands at the end of the header, where the reader looks for it
    begins: Begins::If(|head| !head.starts_with(GZIP)),
    has_frame: true,
    z_is_height: true,
    writes_floats: true,
    write: Some(write),
    ..Codec::reading(FORMAT, read)
};

pub(super) const GZIPPED: Codec = Codec {
    format: FORMAT_GZIPPED,
    endings: &[".nii.gz"],
    begins: Begins::With(&[GZIP]),
    read: read_gzipped,
    write: Some(write_gzipped),
    ..CODEC
};

/// Reads a `.nii` file.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let Source { bytes: mut source, length: file_bytes, memory, options, .. } = source;
    let header = Header::read(&mut source)?.with_given(options.given);
    let size = header.sample_type.size() as u64;
    let found = file_bytes.saturating_sub(header.offset) / size;
    // the header's axes are 16 bits wide, so that their product cannot overflow
    let expected: u64 = header.shape.iter().map(|&n| n as u64).product();
    if expected > found {
        return Err(ReadReason::Truncated { expected, found });
    }
    let image = samples_after(&mut source, &header, [expected as usize; 2], memory)?;
    Ok(in_units(image, &header))
}

/// Reads a `.nii.gz` file. Memory is allocated as samples come, since the unpacked size is not known.
/// The stream is unpacked up to its end, so that its check sum is checked, unless that is far behind the samples.
fn read_gzipped(source: Source) -> Result<LoadedImage, ReadReason> {
    let (file_bytes, memory, given) = (source.length, source.memory, source.options.given);
    let mut source = MultiGzDecoder::new(std::io::BufReader::with_capacity(1 << 16, source.bytes));
    let header = Header::read(&mut source)?.with_given(given);
    let density = GZIP_RATIO / header.sample_type.size() as u64;
    let count = plausible_count(&header.shape, file_bytes, density)?;
    let packed_samples = file_bytes as usize / header.sample_type.size();
    let image =
        samples_after(&mut source, &header, [count, packed_samples.saturating_mul(4)], memory)?;
    std::io::copy(&mut source.take(MOST_BEHIND), &mut std::io::sink())
        .map_err(|e| ReadReason::decoder(FORMAT_GZIPPED, e))?;
    Ok(in_units(image, &header))
}

/// The image with the unit that its header names for all axes.
fn in_units(image: AnyImage, header: &Header) -> LoadedImage {
    let units = header.unit.map_or(Vec::new(), |unit| vec![unit.into(); header.shape.len()]);
    LoadedImage { units, ..image.into() }
}

/// Skips what is between header and samples, and reads `count` of those, `reserve` of which memory is allocated for
/// at once.
fn samples_after(
    source: &mut dyn Read,
    header: &Header,
    [count, reserve]: [usize; 2],
    memory: Memory,
) -> Result<AnyImage, ReadReason> {
    let gap = header.offset - header::BYTES as u64;
    let skipped = std::io::copy(&mut source.take(gap), &mut std::io::sink());
    if skipped.map_err(|e| ReadReason::decoder(FORMAT, e))? < gap {
        return Err(ReadReason::Truncated { expected: count as u64, found: 0 });
    }
    let layout = Layout {
        sample_type: header.sample_type,
        byte_order: header.byte_order,
        count,
        reserve,
        scale: header.scale,
        turned: None,
        memory,
    };
    affine::image(FORMAT, &header.shape, header.affine, || stream::read_samples(source, &layout))
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
