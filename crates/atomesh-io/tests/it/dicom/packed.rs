//! Packed frames are unpacked to what was packed; see `tests/data/README.md` for how they were made.

use std::path::Path;

use atomesh::watch::Silent;
use atomesh_io::image::{ImageFormat, Meaning, ReadNote, ReadOptions, ReadReason, load_image};

use super::{File, decode, folder, numbers};

fn frame(name: &str) -> Vec<u8> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/packed-frames");
    std::fs::read(data.join(name)).unwrap()
}

/// The values that were packed.
fn values(bits: u32) -> Vec<f64> {
    let value = |k: u32| {
        let (x, y) = (k % 11, k / 11);
        let is_flat = (2..7).contains(&x) && (3..6).contains(&y);
        if is_flat { 7 } else { (x * x * 37 + y * 53 + x * y * 11) % (1 << bits) }
    };
    (0..99).map(|k| value(k).into()).collect()
}

/// The smooth values that were packed with losses.
fn smooth() -> Vec<f64> {
    let value = |k: u32| {
        let (x, y) = (f64::from(k % 11), f64::from(k / 11));
        (128.0 + 90.0 * (x / 3.0).sin() + 20.0 * (y / 2.0).cos()).round()
    };
    (0..99).map(value).collect()
}

fn packed(syntax: &str, name: &str, [allocated, stored]: [u16; 2], is_signed: bool) -> File {
    let mut file = File::of([11, 9], &[], 0.0);
    file.bits(allocated, stored, is_signed);
    file.pack(syntax, &[&[&frame(name)]], false);
    file
}

#[test]
fn lossless_frames_have_the_values_that_were_packed() {
    for (syntax, name, bits, count) in [
        ("4.70", "lossless-16.jpg", [16, 16], 16),
        ("4.70", "lossless-12.jpg", [16, 12], 12),
        ("4.57", "lossless-8-predictor-4.jpg", [8, 8], 8),
        ("4.57", "lossless-16-predictor-7.jpg", [16, 16], 16),
        ("4.80", "ls-16.jls", [16, 16], 16),
        ("4.80", "ls-8.jls", [8, 8], 8),
        ("4.90", "16.j2k", [16, 16], 16),
        ("4.90", "16.jp2", [16, 16], 16),
    ] {
        let image = decode(&packed(syntax, name, bits, false).bytes()).unwrap();
        assert_eq!(image.shape(), [11, 9]);
        assert_eq!(numbers(&image), values(count), "{name}");
    }
}

#[test]
fn signed_frames_keep_their_sign_whoever_states_it() {
    // the codestream of JPEG 2000 says that it is signed, that of JPEG only holds the bits
    let image = decode(&packed("4.90", "signed-12.j2k", [16, 12], true).bytes()).unwrap();
    let expected: Vec<f64> = values(12).iter().map(|v| v - 2048.0).collect();
    assert_eq!(numbers(&image), expected);
    let image = decode(&packed("4.70", "lossless-12.jpg", [16, 12], true).bytes()).unwrap();
    let signed = |v: f64| if v < 2048.0 { v } else { v - 4096.0 };
    assert_eq!(numbers(&image), values(12).into_iter().map(signed).collect::<Vec<_>>());
}

#[test]
fn lossy_frames_are_near_what_was_packed() {
    let far = |syntax, name, bits, packed_values: &[f64]| {
        let image = decode(&packed(syntax, name, bits, false).bytes()).unwrap();
        let pairs = numbers(&image);
        pairs.iter().zip(packed_values).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
    };
    // what the encoder was told; what the encoder's own decoder leaves, 1, 4 and 6, and 1 for rounding
    assert_eq!(far("4.81", "ls-8-near-3.jls", [8, 8], &values(8)), 3.0);
    assert!(far("4.50", "smooth-8.jpg", [8, 8], &smooth()) <= 2.0);
    assert!(far("4.91", "smooth-8.j2k", [8, 8], &smooth()) <= 5.0);
    let fine: Vec<f64> = smooth().iter().map(|v| 16.0 * v).collect();
    assert!(far("4.51", "smooth-12.jpg", [16, 12], &fine) <= 7.0);
}

#[test]
fn labels_that_were_packed_with_losses_are_warned_of() {
    let folder = folder([("a.dcm", packed("4.50", "smooth-8.jpg", [8, 8], false).bytes())]);
    let notes = |meaning| {
        let options = ReadOptions { meaning, ..ReadOptions::default() };
        load_image(&folder.path().join("a.dcm"), &options, &mut Silent).unwrap().notes
    };
    assert!(notes(Meaning::Labels).contains(&ReadNote::Lossy));
    assert!(!notes(Meaning::Brightness).contains(&ReadNote::Lossy));
}

#[test]
fn frames_are_found_whether_they_are_in_one_fragment_or_several() {
    let [first, second] = ["lossless-16.jpg", "lossless-16-predictor-7.jpg"].map(frame);
    let twice = [values(16), values(16)].concat();
    let (head, tail) = first.split_at(40);
    let by_fragment: &[&[&[u8]]] = &[&[&first], &[&second]];
    let in_parts: &[&[&[u8]]] = &[&[head, tail], &[&second]];
    for (frames, has_table) in
        [(by_fragment, false), (by_fragment, true), (in_parts, false), (in_parts, true)]
    {
        let mut file = File::of([11, 9], &[], 0.0);
        file.text(0x0028_0008, "IS", "2");
        file.text(0x3004_000c, "DS", "0\\2.5");
        file.pack("4.70", frames, has_table);
        let image = decode(&file.bytes()).unwrap();
        assert_eq!((image.shape(), numbers(&image)), (vec![11, 9, 2], twice.clone()));
    }
    let mut file = File::of([11, 9], &[], 0.0);
    file.text(0x0028_0008, "IS", "4");
    file.text(0x3004_000c, "DS", "0\\2.5\\5\\7.5");
    file.pack("4.70", in_parts, false);
    let text = decode(&file.bytes()).unwrap_err().to_string();
    assert!(text.contains("fragments"), "{text}");
}

#[test]
fn frames_that_are_not_what_the_header_says_are_refused_before_they_are_unpacked() {
    let whole = packed("4.70", "lossless-16.jpg", [16, 16], false);
    let with = |change: &dyn Fn(&mut File)| {
        let mut file = whole.clone();
        change(&mut file);
        decode(&file.bytes()).unwrap_err().to_string()
    };
    let text = with(&|file| file.short(0x0028_0010, 10));
    assert!(text.contains("11 × 9 samples where the header says 11 × 10"), "{text}");
    let text = with(&|file| file.bits(8, 8, false));
    assert!(text.contains("16 bits where the header allocates 8"), "{text}");
    for (syntax, name) in [("4.90", "16.j2k"), ("4.80", "ls-16.jls"), ("4.70", "lossless-16.jpg")] {
        let bytes = frame(name);
        let half = &bytes[..bytes.len() / 2];
        let text = with(&|file| file.pack(syntax, &[&[half]], false));
        assert!(!text.is_empty(), "{name} cut short");
        let text = with(&|file| file.pack(syntax, &[&[&bytes[..20]]], false));
        assert!(text.contains("packed frame"), "{name}: {text}");
    }
    let text = with(&|file| file.text(0x0002_0010, "UI", "1.2.840.10008.1.2.4.201"));
    assert!(text.contains("high-throughput JPEG 2000"), "{text}");
    let text = with(&|file| file.text(0x0002_0010, "UI", "1.2.840.10008.1.2.4.102"));
    assert!(text.contains("a video codec"), "{text}");
}

#[test]
fn packed_frames_make_no_more_room_than_there_is() {
    for (syntax, name) in [("4.90", "16.j2k"), ("4.80", "ls-16.jls"), ("4.70", "lossless-16.jpg")] {
        let bytes = packed(syntax, name, [16, 16], false).bytes();
        let limited = |limit| {
            let options = ReadOptions { memory_limit: Some(limit), ..ReadOptions::default() };
            atomesh_io::image::decode_image(&bytes, ImageFormat::DICOM, &options, &mut Silent)
        };
        assert!(matches!(limited(197), Err(ReadReason::Memory { .. })), "{name}");
        assert!(limited(99 * 16).is_ok(), "{name}");
    }
}

#[test]
fn deflated_files_are_read_as_others() {
    let file = File::of([3, 2], &[1, 2, 3, 4, 5, 60_000], 1.0);
    let (plain, deflated) = (decode(&file.bytes()).unwrap(), decode(&file.deflated()).unwrap());
    assert_eq!(numbers(&deflated), [1.0, 2.0, 3.0, 4.0, 5.0, 60_000.0]);
    assert_eq!((deflated.spacing(), deflated.origin()), (plain.spacing(), plain.origin()));
    let all = super::three().map(|(name, file)| (name, file.deflated()));
    let image = super::load(folder(all).path()).unwrap().image;
    assert_eq!((image.shape(), numbers(&image)[17]), (vec![3, 2, 3], 25.0));
    let bytes = file.deflated();
    for length in 132..bytes.len() - 1 {
        assert!(decode(&bytes[..length]).is_err(), "cut to {length}");
    }
}
