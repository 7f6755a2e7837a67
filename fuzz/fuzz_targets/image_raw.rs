//! Any layout for any bytes: an image or an error.
#![no_main]

use atomesh::watch::Silent;
use atomesh_io::image::{ByteOrder, ImageFormat, RawLayout, ReadOptions, SampleType, decode_image};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: (u8, bool, u8, Vec<u64>, &[u8])| {
    let (kind, big, offset, shape, bytes) = input;
    let layout = RawLayout {
        shape: shape.iter().map(|&n| n as usize).collect(),
        sample_type: SampleType::ALL[usize::from(kind) % SampleType::ALL.len()],
        byte_order: if big { ByteOrder::Big } else { ByteOrder::Little },
        offset: offset.into(),
    };
    let options = ReadOptions { raw: Some(layout), ..ReadOptions::default() };
    if let Ok(image) = decode_image(bytes, ImageFormat::RAW, &options, &mut Silent) {
        assert_eq!(image.samples().len(), image.shape().iter().product::<usize>());
    }
});
