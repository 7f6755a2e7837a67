//! Any bytes as a DICOM slice: an image or an error.
#![no_main]

use atomesh::watch::Silent;
use atomesh_io::image::{ImageFormat, ReadOptions, decode_image};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    // the magic and its place are given, so that no time is spent on finding them
    let bytes = [&[0; 128][..], b"DICM", bytes].concat();
    let options = ReadOptions::default();
    if let Ok(image) = decode_image(&bytes, ImageFormat::DICOM, &options, &mut Silent) {
        assert_eq!(image.samples().len(), image.shape().iter().product::<usize>());
    }
});
