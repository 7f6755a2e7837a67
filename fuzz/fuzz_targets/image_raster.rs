//! Any bytes as PNG, JPEG and PNM: an image or an error.
#![no_main]

use atomesh::watch::Silent;
use atomesh_io::image::{ImageFormat, ReadOptions, decode_image};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for format in [ImageFormat::PNG, ImageFormat::JPEG, ImageFormat::PNM] {
        if let Ok(image) = decode_image(bytes, format, &ReadOptions::default(), &mut Silent) {
            assert_eq!(image.samples().len(), image.shape().iter().product::<usize>());
        }
    }
});
