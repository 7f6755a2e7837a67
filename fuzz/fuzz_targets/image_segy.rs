//! Any bytes as SEG-Y, anywhere the numbers may stand: an image or an error.
#![no_main]

use atomesh::watch::Silent;
use atomesh_io::image::{ImageFormat, ReadOptions, SegyOptions, Vertical, decode_image};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: (Option<[u8; 2]>, Option<[u8; 2]>, bool, &[u8])| {
    let (traces, coordinates, deep, behind) = input;
    let segy = SegyOptions {
        trace_bytes: traces.map(|t| t.map(usize::from)),
        coordinate_bytes: coordinates.map(|c| c.map(usize::from)),
        vertical: deep.then_some(Vertical::Depth),
        ..SegyOptions::default()
    };
    // the textual header is skipped: without it the fuzzer reaches what matters sooner
    let mut bytes = vec![b' '; 3200];
    bytes.extend(behind);
    let options = ReadOptions { segy, ..ReadOptions::default() };
    if let Ok(image) = decode_image(&bytes, ImageFormat::SEGY, &options, &mut Silent) {
        assert_eq!(image.samples().len(), image.shape().iter().product::<usize>());
    }
});
