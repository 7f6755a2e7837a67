//! Any bytes as NPZ: an image or an error.
#![no_main]

use atomesh::watch::Silent;
use atomesh_io::image::{ImageFormat, ReadOptions, decode_image};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let options = ReadOptions::default();
    if let Ok(image) = decode_image(bytes, ImageFormat::NPZ, &options, &mut Silent) {
        assert_eq!(image.samples().len(), image.shape().iter().product::<usize>());
    }
});
