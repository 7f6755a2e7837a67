//! Writing: a page for each z, not compressed.

use std::io::{Seek, Write};

use ::tiff::TiffError;
use ::tiff::encoder::colortype::{
    ColorType as Encoded, Gray8, Gray16, Gray32, Gray32Float, Gray64Float, GrayI8, GrayI16, GrayI32,
};
use ::tiff::encoder::{TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, TiffValue};
use atomesh::image::Samples;
use atomesh::watch::{Phase, Watch, check};

use super::super::codec::Output;
use super::super::error::WriteReason;
use super::super::view::ImageView;
use super::FORMAT;

/// Writes a page for each z, not compressed; BigTIFF where 32-bit offsets would not reach.
pub(super) fn write(
    out: &mut dyn Output,
    image: &ImageView,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let samples = image.samples;
    if samples.len() as u64 * samples.sample_size() as u64 > 4_000_000_000 {
        let encoder = TiffEncoder::<_, TiffKindBig>::new_generic(out).map_err(failure)?;
        write_pages(encoder, image, watch)
    } else {
        let encoder = TiffEncoder::<_, TiffKindStandard>::new_generic(out).map_err(failure)?;
        write_pages(encoder, image, watch)
    }
}

/// Writes the pages with one function for each type.
fn write_pages<W: Write + Seek, K: TiffKind>(
    mut encoder: TiffEncoder<W, K>,
    image: &ImageView,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let side = |n: usize| {
        u32::try_from(n).map_err(|_| WriteReason::Shape {
            format: FORMAT,
            shape: image.shape.clone(),
            expected: "up to 2^32 samples across; write .npy instead",
        })
    };
    let size = [side(image.shape[0])?, side(image.shape[1])?];
    match image.samples {
        Samples::U8(v) => write_planes::<Gray8, _, _>(&mut encoder, v, size, watch),
        Samples::I8(v) => write_planes::<GrayI8, _, _>(&mut encoder, v, size, watch),
        Samples::U16(v) => write_planes::<Gray16, _, _>(&mut encoder, v, size, watch),
        Samples::I16(v) => write_planes::<GrayI16, _, _>(&mut encoder, v, size, watch),
        Samples::U32(v) => write_planes::<Gray32, _, _>(&mut encoder, v, size, watch),
        Samples::I32(v) => write_planes::<GrayI32, _, _>(&mut encoder, v, size, watch),
        Samples::F32(v) => write_planes::<Gray32Float, _, _>(&mut encoder, v, size, watch),
        Samples::F64(v) => write_planes::<Gray64Float, _, _>(&mut encoder, v, size, watch),
        other => Err(WriteReason::SampleType {
            format: FORMAT,
            sample_type: other.type_name(),
            expected: "integers up to 32 bits, float32 and float64",
        }),
    }
}

/// Writes planes of so many samples along x and y, strip by strip.
fn write_planes<C: Encoded, W: Write + Seek, K: TiffKind>(
    encoder: &mut TiffEncoder<W, K>,
    samples: &[C::Inner],
    size: [u32; 2],
    watch: &mut dyn Watch,
) -> Result<(), WriteReason>
where
    [C::Inner]: TiffValue,
{
    let [width, height] = size;
    let mut left = samples;
    for plane in samples.chunks_exact(width as usize * height as usize) {
        let mut page = encoder.new_image::<C>(width, height).map_err(failure)?;
        let mut rows = plane;
        while !rows.is_empty() {
            check(watch, Phase::Write, 1.0 - left.len() as f64 / samples.len() as f64, None)?;
            let count = (page.next_strip_sample_count() as usize).min(rows.len());
            page.write_strip(&rows[..count]).map_err(failure)?;
            rows = &rows[count..];
            left = &left[count..];
        }
        page.finish().map_err(failure)?;
    }
    Ok(())
}

/// The reason that an encoder's error stands for.
fn failure(error: TiffError) -> WriteReason {
    match error {
        TiffError::IoError(e) => WriteReason::Io(e),
        other => WriteReason::Encoder { format: FORMAT, error: other.into() },
    }
}
