//! Files of every kind of sample, chunk by chunk.

use super::super::note::ReadNote;
use super::super::{ReadOptions, decode_image, load_bytes};
use super::*;
use atomesh::watch::Silent;
use std::io::Write;

fn decode(bytes: &[u8]) -> Result<AnyImage, ReadReason> {
    decode_image(bytes, FORMAT, &ReadOptions::default(), &mut Silent)
}

/// What a file is to hold.
#[derive(Clone, Copy, Default)]
struct Kind {
    shape: [u8; 2],
    depth: u8,
    /// 0 grey, 2 RGB, 3 palette, 4 grey and opacity, 6 RGB and opacity.
    color: u8,
    is_interlaced: bool,
}

/// A file of these chunks and packed rows, each with its filter in front.
fn file(kind: Kind, chunks: &[(&[u8; 4], &[u8])], rows: &[u8]) -> Vec<u8> {
    let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), Default::default());
    zlib.write_all(rows).unwrap();
    let packed = zlib.finish().unwrap();
    let [width, height] = kind.shape;
    let interlaced = u8::from(kind.is_interlaced);
    let head = [0, 0, 0, width, 0, 0, 0, height, kind.depth, kind.color, 0, 0, interlaced];
    let mut all: Vec<(&[u8; 4], &[u8])> = vec![(b"IHDR", &head)];
    all.extend(chunks);
    all.extend([(b"IDAT", &packed[..]), (b"IEND", &[][..])]);
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    for (name, content) in all {
        let body = [&name[..], content].concat();
        let mut sum = flate2::Crc::new();
        sum.update(&body);
        png.extend((content.len() as u32).to_be_bytes());
        png.extend(body);
        png.extend(sum.sum().to_be_bytes());
    }
    png
}

fn samples(kind: Kind, rows: &[u8]) -> Samples {
    decode(&file(kind, &[], rows)).unwrap().samples().clone()
}

#[test]
fn grey_of_each_depth_is_stretched_to_whole_bytes() {
    let kind = |depth| Kind { shape: [3, 1], depth, ..Kind::default() };
    assert_eq!(samples(kind(1), &[0, 0b1010_0000]), Samples::U8(vec![255, 0, 255].into()));
    assert_eq!(samples(kind(2), &[0, 0b0001_1100]), Samples::U8(vec![0, 85, 255].into()));
    assert_eq!(samples(kind(4), &[0, 0x0f, 0x20]), Samples::U8(vec![0, 255, 34].into()));
    assert_eq!(samples(kind(8), &[0, 1, 2, 200]), Samples::U8(vec![1, 2, 200].into()));
    let wide = [0, 0, 1, 0x12, 0x34, 0xff, 0xff];
    assert_eq!(samples(kind(16), &wide), Samples::U16(vec![1, 0x1234, 0xffff].into()));
}

#[test]
fn colour_becomes_luminance_and_opacity_is_ignored() {
    let kind = |color, depth| Kind { shape: [2, 1], depth, color, ..Kind::default() };
    let rgb = [0, 255, 0, 0, 0, 255, 0];
    assert_eq!(samples(kind(2, 8), &rgb), Samples::U8(vec![76, 150].into()));
    let rgba = [0, 255, 0, 0, 0, 9, 9, 9, 255];
    assert_eq!(samples(kind(6, 8), &rgba), Samples::U8(vec![76, 9].into()));
    let grey_alpha = [0, 7, 0, 8, 255];
    assert_eq!(samples(kind(4, 8), &grey_alpha), Samples::U8(vec![7, 8].into()));
    // (19595 · 65535 + 32768) / 65536, and a grey
    let wide = [0, 0xff, 0xff, 0, 0, 0, 0, 0x12, 0x34, 0x12, 0x34, 0x12, 0x34];
    assert_eq!(samples(kind(2, 16), &wide), Samples::U16(vec![19595, 0x1234].into()));
    let wide = [0, 0x12, 0x34, 0, 0, 0, 1, 0xff, 0xff];
    assert_eq!(samples(kind(4, 16), &wide), Samples::U16(vec![0x1234, 1].into()));
    let wide = [0, 0, 5, 0, 5, 0, 5, 0, 0, 0, 6, 0, 6, 0, 6, 9, 9];
    assert_eq!(samples(kind(6, 16), &wide), Samples::U16(vec![5, 6].into()));
}

#[test]
fn transparent_colours_keep_their_grey() {
    let grey = Kind { shape: [2, 1], depth: 8, ..Kind::default() };
    let image = decode(&file(grey, &[(b"tRNS", &[0, 7])], &[0, 7, 9])).unwrap();
    assert_eq!(*image.samples(), Samples::U8(vec![7, 9].into()));
    let rgb = Kind { shape: [1, 1], depth: 8, color: 2, ..Kind::default() };
    let image = decode(&file(rgb, &[(b"tRNS", &[0, 5, 0, 5, 0, 5])], &[0, 5, 5, 5])).unwrap();
    assert_eq!(*image.samples(), Samples::U8(vec![5].into()));
}

#[test]
fn interlaced_rows_are_put_in_their_places() {
    let kind = Kind { shape: [2, 2], depth: 8, is_interlaced: true, ..Kind::default() };
    // Adam7 gives (0, 0) in its first pass, (1, 0) in its sixth, row 1 in its seventh
    assert_eq!(samples(kind, &[0, 1, 0, 2, 0, 3, 4]), Samples::U8(vec![1, 2, 3, 4].into()));
}

#[test]
fn palettes_are_followed_and_broken_ones_refused() {
    let kind = Kind { shape: [1, 1], depth: 8, color: 3, ..Kind::default() };
    let indexed = |palette: &[u8]| file(kind, &[(b"PLTE", palette)], &[0, 0]);
    let image = decode(&indexed(&[255, 0, 0, 9, 9, 9])).unwrap();
    assert_eq!(*image.samples(), Samples::U8(vec![76].into()));
    for length in [1, 2, 4, 5, 7] {
        let error = decode(&indexed(&vec![1; length])).unwrap_err();
        assert!(error.to_string().contains("multiple of 3"), "{error}");
    }
    let narrow = Kind { shape: [3, 1], depth: 1, ..kind };
    let palette: (&[u8; 4], &[u8]) = (b"PLTE", &[9, 9, 9, 0, 255, 0]);
    let image = decode(&file(narrow, &[palette], &[0, 0b0100_0000])).unwrap();
    assert_eq!(*image.samples(), Samples::U8(vec![9, 150, 9].into()));
}

#[test]
fn texts_and_profiles_are_passed_over_even_broken() {
    let kind = Kind { shape: [1, 1], depth: 8, ..Kind::default() };
    let chunks: [(&[u8; 4], &[u8]); 2] =
        [(b"zTXt", b"Comment\0\0not zlib"), (b"iCCP", b"name\0\0not zlib")];
    assert_eq!(
        *decode(&file(kind, &chunks, &[0, 5])).unwrap().samples(),
        Samples::U8(vec![5].into())
    );
}

#[test]
fn cut_files_are_refused_wherever_they_end() {
    let kind = Kind { shape: [16, 16], depth: 8, ..Kind::default() };
    let rows: Vec<u8> = (0..16).flat_map(|y| (0..17).map(move |x| x * y)).map(|v| v % 5).collect();
    let png = file(kind, &[], &rows);
    // the last chunk, IEND, carries no samples
    for length in 1..png.len() - 16 {
        assert!(decode(&png[..length]).is_err(), "{length}");
    }
}

#[test]
fn absurd_sizes_are_refused_before_room_is_made() {
    let kind = Kind { shape: [1, 1], depth: 8, ..Kind::default() };
    let mut png = file(kind, &[], &[0, 0]);
    png[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    let mut sum = flate2::Crc::new();
    sum.update(&png[12..29]);
    png[29..33].copy_from_slice(&sum.sum().to_be_bytes());
    let error = decode(&png).unwrap_err().to_string();
    assert!(error.contains("more than its size allows"), "{error}"); // a row alone is too long
}

#[test]
fn what_is_written_is_read_again() {
    use atomesh::image::{Frame, Image};
    for samples in [
        Samples::U8(vec![0, 1, 2, 253, 254, 255].into()),
        Samples::U16(vec![0, 1, 256, 257, 65534, 65535].into()),
    ] {
        let image = Image::new(Frame::new([3, 2]).unwrap(), samples.clone()).unwrap();
        let mut file = std::io::Cursor::new(Vec::new());
        write(&mut file, &ImageView::of(&image), &mut Silent).unwrap();
        let back = decode(&file.into_inner()).unwrap();
        assert_eq!((back.shape(), back.samples()), (vec![3, 2], &samples));
    }
}

/// The samples by what they mean, and the notes.
fn meant(meaning: Meaning, png: &[u8]) -> (Samples, Vec<ReadNote>) {
    let options = ReadOptions { meaning, ..ReadOptions::default() };
    let loaded = load_bytes(png, FORMAT, &options, &mut Silent).unwrap();
    (loaded.image.samples().clone(), loaded.notes)
}

#[test]
fn labels_of_few_bits_stay_as_they_are_stored() {
    for is_interlaced in [false, true] {
        let kind = |depth| Kind { shape: [3, 1], depth, is_interlaced, ..Kind::default() };
        // of one row of three, interlacing stores sample 0 first, then 2, then 1
        let rows = |whole: &[u8], passes: [&[u8]; 3]| -> Vec<u8> {
            if is_interlaced { passes.concat() } else { whole.to_vec() }
        };
        let two = rows(&[0, 0b0001_1100], [&[0, 0], &[0, 0b1100_0000], &[0, 0b0100_0000]]);
        for meaning in [Meaning::Labels, Meaning::Mask] {
            let (samples, notes) = meant(meaning, &file(kind(2), &[], &two));
            assert_eq!((samples, notes), (Samples::U8(vec![0, 1, 3].into()), vec![]));
        }
        let one = rows(&[0, 0b1010_0000], [&[0, 0x80], &[0, 0x80], &[0, 0]]);
        let (samples, _) = meant(Meaning::Labels, &file(kind(1), &[], &one));
        assert_eq!(samples, Samples::U8(vec![1, 0, 1].into()));
    }
    let wide = Kind { shape: [2, 1], depth: 16, ..Kind::default() };
    let (samples, _) = meant(Meaning::Labels, &file(wide, &[], &[0, 0, 1, 0x12, 0x34]));
    assert_eq!(samples, Samples::U16(vec![1, 0x1234].into()));
}

#[test]
fn labels_of_a_palette_are_its_indices_or_its_colours() {
    let kind = Kind { shape: [3, 1], depth: 8, color: 3, ..Kind::default() };
    // red and green of one luminance
    let palette: (&[u8; 4], &[u8]) = (b"PLTE", &[255, 0, 0, 0, 130, 0, 0, 0, 255]);
    let png = file(kind, &[palette], &[0, 0, 1, 2]);
    let indices = ReadNote::PaletteIndices { is_black_elsewhere: false };
    for meaning in [Meaning::Labels, Meaning::Mask] {
        let (samples, notes) = meant(meaning, &png);
        assert_eq!((samples, notes), (Samples::U8(vec![0, 1, 2].into()), vec![indices.clone()]));
    }
    let (samples, notes) = meant(Meaning::LabelsByColour, &png);
    assert_eq!(samples, Samples::U32(vec![3, 2, 1].into()));
    assert!(notes[0].to_string().contains("3 #ff0000"), "{notes:?}");
    assert_eq!(meant(Meaning::Brightness, &png).0, Samples::U8(vec![76, 76, 29].into()));
    let narrow = Kind { depth: 4, ..kind };
    let (samples, _) = meant(Meaning::Labels, &file(narrow, &[palette], &[0, 0x01, 0x20]));
    assert_eq!(samples, Samples::U8(vec![0, 1, 2].into()));
}

#[test]
fn a_mask_whose_palette_begins_with_white_is_warned_of() {
    let kind = Kind { shape: [2, 1], depth: 8, color: 3, ..Kind::default() };
    let palette: (&[u8; 4], &[u8]) = (b"PLTE", &[255, 255, 255, 0, 0, 0]);
    let mask = |rows: &[u8]| meant(Meaning::Mask, &file(kind, &[palette], rows)).1;
    let warning = [ReadNote::PaletteIndices { is_black_elsewhere: true }];
    assert!(mask(&[0, 0, 1]) == warning && warning[0].is_warning());
    // black that is nowhere is no reason to warn
    assert_eq!(mask(&[0, 0, 0]), [ReadNote::PaletteIndices { is_black_elsewhere: false }]);
}

#[test]
fn colours_are_labels_where_they_are_asked_to_be() {
    let kind = Kind { shape: [2, 1], depth: 8, color: 2, ..Kind::default() };
    let png = file(kind, &[], &[0, 255, 0, 0, 0, 130, 0]);
    let options = ReadOptions { meaning: Meaning::Labels, ..ReadOptions::default() };
    let error = decode_image(&png, FORMAT, &options, &mut Silent).unwrap_err();
    assert!(matches!(error, ReadReason::ColourLabels { .. }), "{error}");
    assert_eq!(meant(Meaning::LabelsByColour, &png).0, Samples::U32(vec![2, 1].into()));
    assert_eq!(meant(Meaning::Mask, &png).0, Samples::U8(vec![255, 130].into()));
    let grey = Kind { color: 0, ..kind };
    let (samples, notes) = meant(Meaning::LabelsByColour, &file(grey, &[], &[0, 7, 8]));
    assert_eq!((samples, notes), (Samples::U8(vec![7, 8].into()), vec![ReadNote::NoColours]));
}
