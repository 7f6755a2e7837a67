//! Small files of every member of the family.

use super::super::{ReadOptions, decode_image};
use super::*;
use atomesh::watch::Silent;

fn decode(bytes: &[u8]) -> Result<AnyImage, ReadReason> {
    decode_image(bytes, FORMAT, &ReadOptions::default(), &mut Silent)
}

fn samples(bytes: &[u8]) -> Samples {
    decode(bytes).unwrap().samples().clone()
}

fn message(bytes: &[u8]) -> String {
    decode(bytes).unwrap_err().to_string()
}

#[test]
fn numbers_are_read_as_text_and_as_bytes() {
    let text = samples(b"P2\n# a note\n2 2 # another\n255\n0 10\n20 255\n");
    assert_eq!(text, Samples::U8(vec![0, 10, 20, 255].into()));
    assert_eq!(samples(b"P5 1 2 65535\n\x01\x02\xff\xff"), Samples::U16(vec![258, 65535].into()));
    assert_eq!(samples(b"P2 2 1 65535 258 65535"), Samples::U16(vec![258, 65535].into()));
    assert_eq!(samples(b"P6 1 1 255\n\xff\x00\x00"), Samples::U8(vec![76].into()));
    assert_eq!(samples(b"P3 2 1 255 0 255 0 9 9 9"), Samples::U8(vec![150, 9].into()));
}

#[test]
fn other_greatest_values_are_stretched_and_rounded() {
    assert_eq!(samples(b"P2 3 1 15 0 5 15 "), Samples::U8(vec![0, 85, 255].into()));
    // 255 / 100 · 50 = 127.5, and one above the greatest is cut
    assert_eq!(samples(b"P5 3 1 100\n\x00\x32\x65"), Samples::U8(vec![0, 128, 255].into()));
    // 65535 / 1000 · 1 = 65.535
    assert_eq!(samples(b"P2 3 1 1000 0 1 1000"), Samples::U16(vec![0, 66, 65535].into()));
}

#[test]
fn bits_are_black_where_they_are_1() {
    assert_eq!(samples(b"P1\n3 2\n010\n1 1 0"), Samples::U8(vec![255, 0, 255, 0, 0, 255].into()));
    let rows = samples(b"P4 9 2\n\x80\x80\x01\x7f");
    let mut expected = vec![255; 18];
    for black in [0, 8, 9 + 7] {
        expected[black] = 0;
    }
    assert_eq!(rows, Samples::U8(expected.into()));
}

#[test]
fn pam_is_read_with_and_without_a_type() {
    let pam = |depth: u8, greatest: u16, kind: &str, body: &[u8]| {
        let kind = if kind.is_empty() { String::new() } else { format!("TUPLTYPE {kind}\n") };
        let head = format!(
            "P7\n# a note\nWIDTH 2\nHEIGHT 1\nDEPTH {depth}\nMAXVAL {greatest}\n{kind}ENDHDR\n"
        );
        [head.as_bytes(), body].concat()
    };
    assert_eq!(samples(&pam(1, 255, "GRAYSCALE", &[1, 2])), Samples::U8(vec![1, 2].into()));
    assert_eq!(
        samples(&pam(1, 65535, "GRAYSCALE", &[1, 2, 0, 3])),
        Samples::U16(vec![258, 3].into())
    );
    assert_eq!(
        samples(&pam(2, 255, "GRAYSCALE_ALPHA", &[1, 9, 2, 9])),
        Samples::U8(vec![1, 2].into())
    );
    assert_eq!(
        samples(&pam(3, 255, "RGB", &[255, 0, 0, 9, 9, 9])),
        Samples::U8(vec![76, 9].into())
    );
    let rgba = [255, 0, 0, 1, 9, 9, 9, 1];
    assert_eq!(samples(&pam(4, 255, "RGB_ALPHA", &rgba)), Samples::U8(vec![76, 9].into()));
    assert_eq!(samples(&pam(4, 255, "", &rgba)), Samples::U8(vec![76, 9].into()));
    assert_eq!(samples(&pam(1, 65535, "", &[1, 2, 0, 3])), Samples::U16(vec![258, 3].into()));
    assert_eq!(samples(&pam(1, 1, "BLACKANDWHITE", &[0, 1])), Samples::U8(vec![0, 255].into()));
    let alpha = pam(2, 1, "BLACKANDWHITE_ALPHA", &[0, 1, 1, 0]);
    assert_eq!(samples(&alpha), Samples::U8(vec![0, 255].into()));
    for (file, part) in [
        (pam(1, 1, "BLACKANDWHITE", &[0, 2]), "sample is 2"),
        (pam(1, 2, "BLACKANDWHITE", &[0, 2]), "MAXVAL is 2"),
        (pam(2, 255, "RGB", &[0; 4]), "DEPTH is 2"),
        (pam(5, 255, "", &[0; 10]), "DEPTH is 5"),
        (pam(1, 255, "ODD", &[0; 2]), "TUPLTYPE is ODD"),
        (b"P7\nWIDTH 1\nWIDTH 1\nENDHDR\n".to_vec(), "WIDTH is given twice"),
        (b"P7\nWIDTH x\nENDHDR\n".to_vec(), "WIDTH is x"),
        (b"P7\nWIDTH 1\nENDHDR\n".to_vec(), "HEIGHT is missing"),
        (b"P7\nWIDTH 1\n\n".to_vec(), "line is empty"),
        (b"P7 WIDTH 1\n".to_vec(), "a line break"),
        (b"P7\nCOLOUR 1\nENDHDR\n".to_vec(), "line is COLOUR 1"),
    ] {
        assert!(message(&file).contains(part), "{part}: {}", message(&file));
    }
}

#[test]
fn broken_files_are_refused() {
    for (file, part) in [
        (&b"P2 2 1 255 1 x"[..], "word 2 is not of type uint8"),
        (b"P2 2 1 255 1 256", "word 2 is not of type uint8"),
        (b"P2 2 1 0 1 2", "MAXVAL is 0"),
        (b"P5 2 1 65536\n1234", "MAXVAL is 65536"),
        (b"P5 -2 1 255\n12", "number is \"-\""),
        (b"P5 99999999999 1 255\n12", "too large"),
        (b"P1 2 1 0 2", "sample is 2"),
        (b"P5 4294967295 4294967295 255\n0123", "more than a file of"),
        (b"P6 4 4 255\n0123456789abcdef", "5 of 16 samples"),
    ] {
        assert!(message(file).contains(part), "{part}: {}", message(file));
    }
    for whole in [&b"P5 4 4 255\n0123456789abcdef"[..], b"P4 8 3\nabc", b"P1 3 1 010"] {
        for length in 1..whole.len() {
            assert!(decode(&whole[..length]).is_err(), "{length}");
        }
        assert!(decode(whole).is_ok());
    }
}

#[test]
fn labels_stay_as_they_are_stored() {
    let labels = |bytes: &[u8]| {
        let options = ReadOptions { meaning: Meaning::Labels, ..ReadOptions::default() };
        decode_image(bytes, FORMAT, &options, &mut Silent).map(|image| image.samples().clone())
    };
    assert_eq!(
        labels(b"P5 4 1 3\n\x00\x01\x02\x03").unwrap(),
        Samples::U8(vec![0, 1, 2, 3].into())
    );
    assert_eq!(labels(b"P2 2 1 1000 0 999").unwrap(), Samples::U16(vec![0, 999].into()));
    // 1 is black
    assert_eq!(labels(b"P1 2 1 1 0").unwrap(), Samples::U8(vec![0, 1].into()));
    assert_eq!(labels(b"P4 2 1\n\x80").unwrap(), Samples::U8(vec![0, 1].into()));
    let error = labels(b"P6 1 1 255\n\xff\x00\x00").unwrap_err();
    assert!(matches!(error, ReadReason::ColourLabels { .. }), "{error}");
}
