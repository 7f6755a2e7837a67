//! Writing the 348 bytes of a NIfTI-1 header.

use super::super::error::WriteReason;
use super::super::view::ImageView;
use super::FORMAT;
use super::header::{FIRST_BYTES, FIRST_SAMPLE};
use super::places::FIRST;
use super::quaternion::quaternion;

/// Where the bits of a sample stand.
const BITPIX: usize = 72;

/// A header for samples that follow it in one file, and the four bytes that say that no extension
/// does.
pub(super) fn encode(
    image: &ImageView,
    datatype: i16,
    bits: i16,
) -> Result<[u8; FIRST_SAMPLE as usize], WriteReason> {
    let mut bytes = [0; FIRST_SAMPLE as usize];
    let axes = image.dimension();
    let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
    put(0, &(FIRST_BYTES as i32).to_le_bytes());
    put(FIRST.dim, &(axes as i16).to_le_bytes());
    for axis in 0..7 {
        let count = image.shape.get(axis).copied().unwrap_or(1);
        let count = i16::try_from(count).map_err(|_| WriteReason::Shape {
            format: FORMAT,
            shape: image.shape.clone(),
            expected: "up to 32767 along each axis; write .npy instead",
        })?;
        put(FIRST.dim + 2 * (axis + 1), &count.to_le_bytes());
    }
    put(FIRST.datatype, &datatype.to_le_bytes());
    put(BITPIX, &bits.to_le_bytes());
    put(FIRST.vox_offset, &(FIRST_SAMPLE as f32).to_le_bytes());
    put(FIRST.scl_slope, &1f32.to_le_bytes());
    put(FIRST.magic, b"n+1\0");

    let affine = image.affine();
    let (quaternion, qfac) = quaternion(image.direction, image.is_mirrored);
    put(FIRST.pixdim, &(qfac as f32).to_le_bytes());
    put(FIRST.qform_code, &2i16.to_le_bytes());
    put(FIRST.sform_code, &2i16.to_le_bytes());
    for k in 0..3 {
        let positive = single("spacing", image.spacing[k])?;
        put(FIRST.pixdim + 4 * (k + 1), &positive.to_le_bytes());
        put(FIRST.quatern_b + 4 * k, &(quaternion[k] as f32).to_le_bytes());
        let offset = single("origin", affine.origin[k])?;
        put(FIRST.qoffset_x + 4 * k, &offset.to_le_bytes());
        for c in 0..3 {
            put(FIRST.srow_x + 16 * k + 4 * c, &(affine.matrix[k][c] as f32).to_le_bytes());
        }
        put(FIRST.srow_x + 16 * k + 12, &offset.to_le_bytes());
    }
    Ok(bytes)
}

/// The value in single precision, if it has one there that is neither infinite nor 0 by rounding.
fn single(quantity: &'static str, value: f64) -> Result<f32, WriteReason> {
    let rounded = value as f32;
    if rounded.is_finite() && (rounded.is_normal() || value == 0.0 || quantity == "origin") {
        Ok(rounded)
    } else {
        Err(WriteReason::Frame {
            format: FORMAT,
            quantity,
            value,
            expected: "a number of single precision",
        })
    }
}
