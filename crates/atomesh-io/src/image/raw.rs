//! Raw samples: the file is the samples, and everything about them comes from the caller.

use std::io::{Seek, SeekFrom};

use atomesh::watch::Watch;

use super::any_image::AnyImage;
use super::codec::{Codec, Output, Source};
use super::error::{ReadReason, WriteReason};
use super::format::ImageFormat;
use super::note::LoadedImage;
use super::options::RawLayout;
use super::shape::plausible_count;
use super::stream::{self, Layout};
use super::view::ImageView;

const FORMAT: ImageFormat = ImageFormat::named("raw");

pub(super) const CODEC: Codec = Codec {
    endings: &[".raw"],
    writes_floats: true,
    write: Some(write),
    ..Codec::reading(FORMAT, read)
};

/// Reads a raw file, whose size must be exactly what the layout says.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let Source { bytes: mut source, length: file_bytes, options, memory, .. } = source;
    let layout = options.raw.as_ref().ok_or(ReadReason::NoRawLayout)?;
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
    let count = plausible_count(shape, file_bytes, 1)?;
    source.seek(SeekFrom::Start(*offset)).map_err(ReadReason::Io)?;
    let layout = Layout {
        sample_type: *sample_type,
        byte_order: *byte_order,
        count,
        reserve: count,
        scale: None,
        turned: None,
        memory,
    };
    let samples = stream::read_samples(&mut source, &layout)?;
    Ok(AnyImage::frameless(shape, samples)?.into())
}

/// Writes the samples, the least significant byte first.
fn write(
    out: &mut dyn Output,
    image: &ImageView,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    stream::write_samples(out, image.samples, FORMAT, watch)
}

#[cfg(test)]
mod tests {
    use super::super::{ByteOrder, ReadOptions, SampleType, decode_image};
    use super::*;
    use atomesh::image::Samples;
    use atomesh::watch::Silent;

    fn decode(bytes: &[u8], layout: RawLayout) -> Result<AnyImage, ReadReason> {
        let options = ReadOptions { raw: Some(layout), ..ReadOptions::default() };
        decode_image(bytes, FORMAT, &options, &mut Silent)
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
        assert_eq!(*image.samples(), Samples::U16(vec![1, 2, 256, 65535].into()));
        assert_eq!(image.shape(), [2, 2]);

        let wide = decode(&(-7i64).to_le_bytes(), layout(&[1, 1, 1], SampleType::I64)).unwrap();
        assert_eq!(*wide.samples(), Samples::F64(vec![-7.0].into()));
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
