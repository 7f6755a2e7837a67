//! Raw samples: the file is the samples, and everything about them comes from the caller.

use std::io::{Read, Seek, SeekFrom};

use super::stream::{self, Layout};
use super::{AnyImage, ByteOrder, ReadReason, SampleType};

/// What a raw file does not say about itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawLayout {
    /// Samples along x, y (and z); x is the fastest in the file.
    pub shape: Vec<usize>,
    /// The type of the samples.
    pub sample_type: SampleType,
    /// The order of their bytes.
    pub byte_order: ByteOrder,
    /// The bytes before the first sample, which are skipped.
    pub offset: u64,
}

/// Reads a raw file, whose size must be exactly what the layout says.
pub(super) fn read<R: Read + Seek>(
    mut source: R,
    file_bytes: u64,
    layout: &RawLayout,
) -> Result<AnyImage, ReadReason> {
    let RawLayout { shape, sample_type, byte_order, offset } = layout;
    if !(2..=3).contains(&shape.len()) {
        return Err(ReadReason::RawShape { shape: shape.clone() });
    }
    let count = shape.iter().fold(1u128, |n, &s| n.saturating_mul(s as u128));
    let expected =
        count.saturating_mul(sample_type.size() as u128).saturating_add(u128::from(*offset));
    if expected != u128::from(file_bytes) {
        return Err(ReadReason::RawSize {
            found: file_bytes,
            expected,
            shape: shape.clone(),
            sample_type: *sample_type,
            offset: *offset,
        });
    }
    let count = super::plausible_count(shape, file_bytes, 1)?;
    source.seek(SeekFrom::Start(*offset)).map_err(ReadReason::Io)?;
    let layout = Layout {
        sample_type: *sample_type,
        byte_order: *byte_order,
        count,
        reserve: count,
        scale: None,
        turned: None,
    };
    AnyImage::frameless(shape, stream::read_samples(&mut source, &layout)?)
}

#[cfg(test)]
mod tests {
    use super::super::{ImageFormat, ReadOptions, decode_image};
    use super::*;
    use atomesh::image::Samples;
    use atomesh::watch::Silent;

    fn decode(bytes: &[u8], layout: RawLayout) -> Result<AnyImage, ReadReason> {
        let options = ReadOptions { raw: Some(layout), ..ReadOptions::default() };
        decode_image(bytes, ImageFormat::Raw, &options, &mut Silent)
    }

    fn layout(shape: &[usize], sample_type: SampleType) -> RawLayout {
        RawLayout { shape: shape.into(), sample_type, byte_order: ByteOrder::Little, offset: 0 }
    }

    #[test]
    fn byte_order_and_offset_are_followed() {
        let bytes = [9, 9, 9, 0, 1, 0, 2, 1, 0, 255, 255];
        let big =
            RawLayout { byte_order: ByteOrder::Big, offset: 3, ..layout(&[2, 2], SampleType::U16) };
        let image = decode(&bytes, big).unwrap();
        assert_eq!(*image.samples(), Samples::U16(vec![1, 2, 256, 65535]));
        assert_eq!(image.shape(), [2, 2]);

        let wide = decode(&(-7i64).to_le_bytes(), layout(&[1, 1, 1], SampleType::I64)).unwrap();
        assert_eq!(*wide.samples(), Samples::F64(vec![-7.0]));
        assert_eq!(wide.dimension(), 3);
    }

    #[test]
    fn a_size_that_does_not_match_is_refused_with_both_sizes() {
        for length in [23, 25] {
            let error = decode(&vec![0; length], layout(&[3, 4], SampleType::I16)).unwrap_err();
            let text = error.to_string();
            assert!(text.contains(&length.to_string()) && text.contains("24"), "{text}");
        }
        for shape in [&[usize::MAX, usize::MAX, usize::MAX][..], &[0, 3], &[1 << 63, 2]] {
            let error = decode(&[0; 8], layout(shape, SampleType::F64)).unwrap_err();
            assert!(matches!(error, ReadReason::RawSize { .. }), "{error}");
        }
        assert!(matches!(
            decode(&[0; 8], layout(&[8], SampleType::U8)),
            Err(ReadReason::RawShape { .. })
        ));
    }

    #[test]
    fn no_samples_are_no_image() {
        let empty = RawLayout { offset: 8, ..layout(&[0, 3], SampleType::U8) };
        assert!(matches!(decode(&[0; 8], empty), Err(ReadReason::Frame(_))));
    }
}
