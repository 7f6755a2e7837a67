//! Files of another program: see tests/data.

use super::super::{ReadOptions, decode_image, load_bytes};
use super::*;
use atomesh::image::Samples;
use atomesh::watch::Silent;

fn decode(bytes: &[u8]) -> Result<AnyImage, ReadReason> {
    decode_image(bytes, FORMAT, &ReadOptions::default(), &mut Silent)
}

/// The samples of a file of that shape.
fn samples(bytes: &[u8], shape: [usize; 2]) -> Vec<u8> {
    let image = decode(bytes).unwrap();
    assert_eq!(image.shape(), shape);
    match image.samples() {
        Samples::U8(samples) => samples.to_vec(),
        other => panic!("{}", other.type_name()),
    }
}

macro_rules! data {
    ($name:literal) => {
        include_bytes!(concat!("../../../tests/data/", $name))
    };
}

/// Whether two greys are as near as JPEG's own rounding lets them be.
fn is_near(found: u8, expected: u8) -> bool {
    found.abs_diff(expected) <= 2
}

#[test]
fn grey_is_read_to_within_rounding() {
    let ramp = samples(data!("pillow-grey-ramp.jpg"), [24, 9]);
    assert!(ramp.iter().enumerate().all(|(k, &v)| is_near(v, 10 * (k % 24) as u8)), "{ramp:?}");
}

#[test]
fn colour_becomes_luminance_in_every_kind_of_file() {
    for file in [&data!("pillow-halves-420.jpg")[..], data!("pillow-halves-progressive.jpg")] {
        let halves = samples(file, [32, 16]);
        // Rec. 601: red is 76, green 150; 4:2:0 mixes the two beside the middle
        for (k, &v) in halves.iter().enumerate().filter(|(k, _)| !(14..18).contains(&(k % 32))) {
            assert!(is_near(v, if k % 32 < 16 { 76 } else { 150 }), "{k}: {v}");
        }
    }
    let red = samples(data!("pillow-cmyk-red.jpg"), [16, 8]);
    assert!(red.iter().all(|&v| is_near(v, 76)), "{red:?}");
}

#[test]
fn broken_files_are_refused() {
    let whole = data!("pillow-grey-ramp.jpg");
    for length in 1..whole.len() / 3 {
        assert!(decode(&whole[..length]).is_err(), "{length}");
    }
    // a frame of 65535 × 65535 samples, in so few bytes
    let mut huge = whole.to_vec();
    let frame = huge.windows(2).position(|marker| marker == [0xff, 0xc0]).unwrap();
    huge[frame + 5..frame + 9].fill(0xff);
    let error = decode(&huge).unwrap_err();
    assert!(matches!(error, ReadReason::TooLarge { .. }), "{error}");
}

#[test]
fn labels_and_masks_are_warned_of_and_colours_are_no_labels() {
    let load = |bytes: &[u8], meaning| {
        let options = ReadOptions { meaning, ..ReadOptions::default() };
        load_bytes(bytes, FORMAT, &options, &mut Silent)
    };
    for meaning in [Meaning::Labels, Meaning::Mask] {
        let notes = load(data!("pillow-grey-ramp.jpg"), meaning).unwrap().notes;
        assert!(notes == [ReadNote::Lossy] && notes[0].is_warning(), "{notes:?}");
    }
    let error = load(data!("pillow-halves-420.jpg"), Meaning::Labels).unwrap_err();
    assert!(matches!(error, ReadReason::ColourLabels { .. }), "{error}");
}
