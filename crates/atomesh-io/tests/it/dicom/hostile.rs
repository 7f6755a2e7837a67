//! Files that promise more than they hold, or hold nonsense: an error, never a panic or room without bound.

use std::path::Path;

use atomesh::watch::Silent;
use atomesh_io::image::{ImageFormat, ReadOptions, ReadReason, decode_image};
use proptest::prelude::*;

use super::{File, decode, element, list, sequence};

/// A frame of each packing, with its transfer syntax.
fn packed(which: usize) -> (&'static str, Vec<u8>) {
    let (syntax, name) = [
        ("4.70", "lossless-16.jpg"),
        ("4.70", "lossless-16-predictor-7.jpg"),
        ("4.51", "smooth-12.jpg"),
        ("4.50", "smooth-8.jpg"),
        ("4.80", "ls-16.jls"),
        ("4.81", "ls-8-near-3.jls"),
        ("4.90", "16.j2k"),
        ("4.91", "smooth-8.j2k"),
        ("4.90", "16.jp2"),
    ][which];
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/packed-frames");
    (syntax, std::fs::read(data.join(name)).unwrap())
}

/// A file of several frames with functional groups.
fn enhanced() -> File {
    let mut file = File::of([3, 2], &[7; 12], 0.0);
    file.text(0x0028_0008, "IS", "2");
    let item = |z: f64| {
        let position = element(0x0020_0032, "DS", list(&[0.0, 0.0, z]).as_bytes());
        sequence(0x0020_9113, &[position])
    };
    file.put(sequence(0x5200_9230, &[item(0.0), item(1.5)]));
    file
}

#[test]
fn counts_of_frames_that_no_file_holds_are_refused() {
    for (frames, part) in [
        ("4000000000", "24 of"),
        ("3", "of 18 samples"),
        ("-1", "number of frames"),
        ("x", "number of"),
    ] {
        let mut file = enhanced();
        file.text(0x0028_0008, "IS", frames);
        let text = decode(&file.bytes()).unwrap_err().to_string();
        assert!(text.contains(part) || text.contains("samples are there"), "{frames}: {text}");
    }
    let mut file = File::of([u16::MAX, u16::MAX], &[], 0.0);
    file.pack("4.90", &[&[&packed(6).1]], false);
    file.text(0x0028_0008, "IS", "4000000000");
    assert!(matches!(decode(&file.bytes()), Err(ReadReason::Truncated { .. })));
}

#[test]
fn what_inflates_to_more_than_an_image_is_refused() {
    let mut file = File::of([3, 2], &[7; 6], 0.0);
    // 300 MiB of zeros before the pixel data
    file.put([&element(0x0009_1001, "UN", &[])[..8], &(300_u32 << 20).to_le_bytes()].concat());
    let with_zeros = {
        let mut elements = file.elements.clone();
        elements.get_mut(&0x0009_1001).unwrap().extend(vec![0; 300 << 20]);
        File { elements }
    };
    let bytes = with_zeros.deflated();
    assert!(bytes.len() < 1 << 20);
    let text = decode(&bytes).unwrap_err().to_string();
    assert!(text.contains("more than 256 MiB"), "{text}");
    // pixel data of 200 MiB where there is room for 1
    let mut file = File::of([10_240, 10_240], &[], 0.0);
    file.put(element(0x7fe0_0010, "OW", &vec![0; 200 << 20]));
    let options = ReadOptions { memory_limit: Some(1 << 20), ..ReadOptions::default() };
    let read = decode_image(&file.deflated(), ImageFormat::DICOM, &options, &mut Silent);
    assert!(matches!(read, Err(ReadReason::Memory { .. })), "{read:?}");
}

#[test]
fn values_and_sequences_are_not_held_beyond_what_an_image_needs() {
    let mut file = File::of([3, 2], &[7; 6], 0.0);
    file.put(element(0x0028_0030, "UN", &[b'1'; 5000]));
    assert!(decode(&file.bytes()).unwrap_err().to_string().contains("5000 bytes"));
    // items without end, and sequences in sequences
    let mut file = enhanced();
    file.put(sequence(0x5200_9230, &vec![Vec::new(); (1 << 20) + 1]));
    assert!(decode(&file.bytes()).unwrap_err().to_string().contains("1048576 items"));
    let mut inner = Vec::new();
    for _ in 0..40 {
        inner = sequence(0x5200_9230, &[inner]);
    }
    let mut file = enhanced();
    file.put(inner);
    assert!(decode(&file.bytes()).unwrap_err().to_string().contains("nested deeper"));
    // an item longer than its sequence
    let mut file = enhanced();
    let mut bytes = sequence(0x5200_9230, &[element(0x0020_0013, "IS", b"12")]);
    let at = bytes.len() - 14;
    bytes[at..at + 4].copy_from_slice(&100_u32.to_le_bytes());
    file.put(bytes);
    assert!(decode(&file.bytes()).is_err());
}

#[test]
fn cut_files_are_refused_wherever_they_end() {
    let mut file = File::of([11, 9], &[], 0.0);
    let (syntax, frame) = packed(0);
    file.pack(syntax, &[&[&frame]], false);
    for bytes in [enhanced().bytes(), file.bytes()] {
        assert!(decode(&bytes).is_ok());
        for length in 0..bytes.len() {
            assert!(decode(&bytes[..length]).is_err(), "cut to {length}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    /// Packed frames with a few bytes changed, and cut: an image or an error, no panic.
    #[test]
    fn damaged_frames_end_in_an_image_or_an_error(
        which in 0..9usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..5),
        length in any::<prop::sample::Index>(),
        cut in prop::bool::weighted(0.2),
    ) {
        let (syntax, mut frame) = packed(which);
        for (place, value) in changes {
            let at = place.index(frame.len());
            frame[at] = value;
        }
        if cut {
            frame.truncate(length.index(frame.len()));
        }
        let mut file = File::of([11, 9], &[], 0.0);
        if ["4.50", "4.81", "4.91"].contains(&syntax) {
            file.bits(8, 8, false);
        }
        file.pack(syntax, &[&[&frame]], false);
        let _ = decode(&file.bytes());
    }

    /// Headers with functional groups, damaged.
    #[test]
    fn damaged_groups_end_in_an_image_or_an_error(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let mut bytes = enhanced().bytes();
        for (place, value) in changes {
            let at = 132 + place.index(bytes.len() - 132);
            bytes[at] = if bytes[at].is_ascii_digit() { b'0' + value % 10 } else { value };
        }
        let _ = decode(&bytes);
    }
}
