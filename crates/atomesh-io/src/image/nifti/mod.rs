//! NIfTI-1 in one file, plain or gzipped: a header of 348 bytes, then the samples, x fastest.
//!
//! Definition: <https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h>. World coordinates are
//! the file's own: x to the right, y to the front, z to the top of the head (RAS+), nearly always
//! in millimetres. Two-file NIfTI (`.hdr` and `.img`), NIfTI-2 and ANALYZE are refused by name.

use std::io::{Read, Seek, Write};

use atomesh::image::{Image, Samples};
use atomesh::watch::Watch;
use flate2::read::MultiGzDecoder;
use flate2::write::GzEncoder;

use super::affine;
use super::stream::{self, GZIP_RATIO, Layout};
use super::{AnyImage, ImageFormat, ReadReason, WriteReason};

mod header;

use header::Header;

const FORMAT: ImageFormat = ImageFormat::Nifti;

/// Reads a `.nii` file.
pub(super) fn read<R: Read + Seek>(mut source: R, file_bytes: u64) -> Result<AnyImage, ReadReason> {
    let header = Header::read(&mut source)?;
    let size = header.sample_type.size() as u64;
    let found = file_bytes.saturating_sub(header.offset) / size;
    // the header's axes are 16 bits wide, so that their product cannot overflow
    let expected: u64 = header.shape.iter().map(|&n| n as u64).product();
    if expected > found {
        return Err(ReadReason::Truncated { expected, found });
    }
    samples_after(&mut source, &header, expected as usize, expected as usize)
}

/// Reads a `.nii.gz` file. Room for samples is made as they come, since the size of what is packed
/// is not known; the whole stream is unpacked, so that its check sum is checked.
pub(super) fn read_gzipped<R: Read>(source: R, file_bytes: u64) -> Result<AnyImage, ReadReason> {
    let mut source = MultiGzDecoder::new(std::io::BufReader::with_capacity(1 << 16, source));
    let header = Header::read(&mut source)?;
    let density = GZIP_RATIO / header.sample_type.size() as u64;
    let count = super::plausible_count(&header.shape, file_bytes, density)?;
    let packed_samples = file_bytes as usize / header.sample_type.size();
    let image = samples_after(&mut source, &header, count, packed_samples.saturating_mul(4))?;
    std::io::copy(&mut source, &mut std::io::sink())
        .map_err(|e| ReadReason::decoder(ImageFormat::NiftiGz, e))?;
    Ok(image)
}

/// Skips what is between header and samples, and reads those.
fn samples_after(
    source: &mut dyn Read,
    header: &Header,
    count: usize,
    reserve: usize,
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
    };
    affine::image(FORMAT, &header.shape, header.affine, || stream::read_samples(source, &layout))
}

/// Writes a `.nii` file, the frame as sform and as qform (code 2, "aligned").
pub(super) fn write<const D: usize>(
    out: &mut dyn Write,
    image: &Image<D>,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let samples = image.samples();
    let (code, bits) = match samples {
        Samples::U8(_) => (2, 8),
        Samples::I8(_) => (256, 8),
        Samples::U16(_) => (512, 16),
        Samples::I16(_) => (4, 16),
        Samples::U32(_) => (768, 32),
        Samples::I32(_) => (8, 32),
        Samples::F32(_) => (16, 32),
        _ => (64, 64),
    };
    out.write_all(&header::encode(image.frame(), code, bits)?)?;
    stream::write_samples(out, samples, FORMAT, watch)
}

/// Writes a `.nii.gz` file; the gzip header holds neither name nor time.
pub(super) fn write_gzipped<const D: usize>(
    out: &mut dyn Write,
    image: &Image<D>,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let mut packed = GzEncoder::new(out, flate2::Compression::default());
    write(&mut packed, image, watch)?;
    packed.finish()?;
    Ok(())
}
