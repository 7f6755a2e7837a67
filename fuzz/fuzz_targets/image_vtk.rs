//! Any bytes as a legacy VTK image: an image or an error.
#![no_main]

use atomesh::watch::Silent;
use atomesh_io::image::{ImageFormat, ReadOptions, decode_image};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    // the magic is given, so that no time is spent on finding it
    let bytes = [&b"# vtk DataFile Version 3.0\n\n"[..], bytes].concat();
    let options = ReadOptions::default();
    if let Ok(image) = decode_image(&bytes, ImageFormat::VTK, &options, &mut Silent) {
        assert_eq!(image.samples().len(), image.shape().iter().product::<usize>());
    }
});
