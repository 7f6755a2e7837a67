//! Any bytes as NIfTI-1, plain and gzipped: an image or an error, and the same one by both ways.
#![no_main]

use std::io::Write;

use atomesh::watch::Silent;
use atomesh_io::image::{ImageFormat, ReadOptions, decode_image};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let options = ReadOptions::default();
    let plain = decode_image(bytes, ImageFormat::NIFTI, &options, &mut Silent);
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    let packed = packed.write_all(bytes).and_then(|()| packed.finish()).unwrap();
    let packed = decode_image(&packed, ImageFormat::NIFTI_GZ, &options, &mut Silent);
    match (plain, packed) {
        (Ok(a), Ok(b)) => {
            assert_eq!(a.samples().len(), a.shape().iter().product::<usize>());
            assert_eq!((a.shape(), a.type_name()), (b.shape(), b.type_name()));
            assert_eq!((a.spacing(), a.origin()), (b.spacing(), b.origin()));
        }
        (Ok(_), Err(e)) => panic!("only the packed file is refused: {e}"),
        (Err(e), Ok(_)) => assert!(bytes.starts_with(b"\x1f\x8b"), "only packed is taken: {e}"),
        (Err(_), Err(_)) => {}
    }
    // and as a gzip stream of its own
    let _ = decode_image(bytes, ImageFormat::NIFTI_GZ, &options, &mut Silent);
});
