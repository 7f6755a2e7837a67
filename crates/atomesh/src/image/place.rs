//! Where samples are in memory: from an index to a place, and from a place to the indices beside it.

/// The sample at an index, axis by axis.
pub(crate) fn coordinates<const D: usize>(mut index: usize, shape: [usize; D]) -> [usize; D] {
    std::array::from_fn(|k| {
        let i = index % shape[k];
        index /= shape[k];
        i
    })
}

/// The index of the neighbour `code`, whose digits to base 3 are the steps along the axes plus 1; the
/// first half of all codes are earlier in memory. `None` outside the image.
pub(crate) fn neighbour<const D: usize>(
    sample: [usize; D],
    shape: [usize; D],
    mut code: usize,
) -> Option<usize> {
    let (mut index, mut stride) = (0, 1);
    for k in 0..D {
        let i = (sample[k] + code % 3).checked_sub(1).filter(|&i| i < shape[k])?;
        index += i * stride;
        stride *= shape[k];
        code /= 3;
    }
    Some(index)
}
