//! Arrays of every type and order, and headers that lie.

use super::super::{AnyImage, ReadOptions, decode_image};
use super::*;
use atomesh::image::{Frame, Image, Samples};
use atomesh::watch::Silent;

fn file(dictionary: &str, samples: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((dictionary.len() as u16).to_le_bytes());
    bytes.extend(dictionary.as_bytes());
    bytes.extend(samples);
    bytes
}

fn decode(bytes: &[u8]) -> Result<AnyImage, ReadReason> {
    decode_image(bytes, FORMAT, &ReadOptions::default(), &mut Silent)
}

fn message(dictionary: &str) -> String {
    decode(&file(dictionary, &[0; 16])).unwrap_err().to_string()
}

#[test]
fn arrays_are_read_in_either_order() {
    let c =
        file("{'descr': '|u1', 'fortran_order': False, 'shape': (2, 3), }", &[0, 1, 2, 10, 11, 12]);
    let f =
        file("{'shape': (2, 3), 'fortran_order': True, 'descr': '|u1'}", &[0, 10, 1, 11, 2, 12]);
    for bytes in [c, f] {
        let image = decode(&bytes).unwrap();
        assert_eq!(image.shape(), [3, 2]);
        assert_eq!(*image.samples(), Samples::U8(vec![0, 1, 2, 10, 11, 12].into()));
    }
}

#[test]
fn every_type_is_read() {
    let cases: [(&str, &[u8], Samples); 14] = [
        ("|b1", &[2, 0], Samples::U8(vec![1, 0].into())),
        ("?", &[1, 0], Samples::U8(vec![1, 0].into())),
        ("|u1", &[200, 0], Samples::U8(vec![200, 0].into())),
        ("|i1", &[200, 0], Samples::I8(vec![-56, 0].into())),
        ("<u2", &[1, 2, 0, 0], Samples::U16(vec![513, 0].into())),
        (">i2", &[255, 254, 0, 0], Samples::I16(vec![-2, 0].into())),
        (">u4", &[1, 0, 0, 2, 0, 0, 0, 0], Samples::U32(vec![16777218, 0].into())),
        ("<i4", &[254, 255, 255, 255, 0, 0, 0, 0], Samples::I32(vec![-2, 0].into())),
        (
            ">u8",
            &[0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
            Samples::F64(vec![4294967296.0, 0.0].into()),
        ),
        ("<i8", &[255; 16], Samples::F64(vec![-1.0, -1.0].into())),
        ("<f2", &[0, 0x3c, 0, 0xc0], Samples::F32(vec![1.0, -2.0].into())),
        (">f4", &[0x3f, 0x80, 0, 0, 0, 0, 0, 0], Samples::F32(vec![1.0, 0.0].into())),
        ("<f4", &[0, 0, 0x80, 0x3f, 0, 0, 0, 0], Samples::F32(vec![1.0, 0.0].into())),
        (
            ">f8",
            &[0xbf, 0xe0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
            Samples::F64(vec![-0.5, 0.0].into()),
        ),
    ];
    for (descr, bytes, expected) in cases {
        let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (1, 2)}}");
        assert_eq!(*decode(&file(&text, bytes)).unwrap().samples(), expected, "{descr}");
    }
}

#[test]
fn absurd_shapes_are_refused() {
    for shape in [
        "(9223372036854775808, 1)",
        "(9223372036854775808, 2)",
        "(4294967296, 4294967296, 4294967296)",
        "(1000000, 1000000)",
    ] {
        let text = format!("{{'descr': '<f8', 'fortran_order': True, 'shape': {shape}}}");
        assert!(message(&text).contains("more than a file of"), "{}", message(&text));
    }
    let text = "{'descr': '<f8', 'fortran_order': False, 'shape': (18446744073709551616, 1)}";
    assert!(message(text).contains("whole numbers below 2^64"), "{}", message(text));
    let text = "{'descr': '<f8', 'fortran_order': False, 'shape': (0, 5)}";
    assert!(message(text).contains("[5, 0] has no samples"), "{}", message(text));
}

#[test]
fn a_cut_file_says_how_many_samples_are_there() {
    let text = "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4)}";
    assert!(message(text).contains("2 of 12 samples"), "{}", message(text));
    let whole = file(text, &[0; 96]);
    for length in 1..whole.len() {
        assert!(decode(&whole[..length]).is_err(), "{length}");
    }
    assert!(decode(&whole).is_ok());
}

#[test]
fn what_is_not_supported_is_named() {
    let with = |descr: &str, shape: &str| {
        message(&format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}}}"))
    };
    assert!(with("'<c16'", "(1, 1)").contains("\"<c16\""));
    assert!(with("'|O'", "(1, 1)").contains("\"|O\""));
    assert!(with("[('a', '<f4')]", "(1, 1)").contains("several fields"));
    assert!(with("'<f4'", "(4,)").contains("1 axes"));
    assert!(with("'<f4'", "()").contains("0 axes"));
    assert!(with("'<f4'", "(1, 1, 1, 4)").contains("4 axes"));
    assert!(with("'<f4'", "(-1, 1)").contains("whole numbers"));
    assert!(message("{'descr': '<f4', 'shape': (1, 1)}").contains("fortran_order is missing"));
    assert!(message("{'descr': '<f4").contains("closing quote"));
    assert!(message("").contains("expected {"));
    let mut newer = file("", &[]);
    newer[6] = 9;
    assert!(decode(&newer).unwrap_err().to_string().contains("version is 9"));
}

#[test]
fn the_header_is_what_numpy_writes() {
    let image = Image::new(Frame::new([3, 2]).unwrap(), Samples::F32(vec![0.5; 6].into())).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    write(&mut bytes, &ImageView::of(&image), &mut Silent).unwrap();
    let bytes = bytes.into_inner();
    let mut expected = b"\x93NUMPY\x01\x00\x76\x00\
        {'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }"
        .to_vec();
    expected.resize(127, b' ');
    expected.push(b'\n');
    assert_eq!(bytes[..128], expected);
    assert_eq!(bytes.len(), 128 + 24);
}
