//! Shapes in messages, and against the sizes of files.

use super::error::ReadReason;

/// A shape as people write it: `640 × 480`.
pub(super) fn shape_text(shape: &[usize]) -> String {
    shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" × ")
}

/// The product of the shape, if so many samples may be in a file of `file_bytes` bytes that packs at most
/// `density` of them into a byte. Headers lie: memory is allocated only for what this lets pass.
pub(super) fn plausible_count(
    shape: &[usize],
    file_bytes: u64,
    density: u64,
) -> Result<usize, ReadReason> {
    let most = u128::from(file_bytes) * u128::from(density);
    let count = shape.iter().try_fold(1usize, |n, &s| n.checked_mul(s));
    match count {
        Some(n) if n as u128 <= most => Ok(n),
        _ => Err(too_large(shape, file_bytes)),
    }
}

/// The error for a shape that a file of so many bytes cannot have.
pub(super) fn too_large(shape: &[usize], file_bytes: u64) -> ReadReason {
    ReadReason::TooLarge { shape: shape_text(shape), file_bytes }
}
