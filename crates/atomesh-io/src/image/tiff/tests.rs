//! Files written here and by the format's encoder.

use std::io::Cursor;

use ::tiff::encoder::TiffEncoder;
use ::tiff::encoder::colortype::{Gray8, Gray64, GrayI8, RGB8, RGB32Float};
use atomesh::watch::Silent;

use super::super::options::{GivenFrame, ReadOptions, StackOptions};
use super::super::view::ImageView;
use super::super::{decode_image, load_bytes};
use super::write::write;
use super::*;

fn decode(bytes: &[u8]) -> Result<AnyImage, ReadReason> {
    decode_image(bytes, FORMAT, &ReadOptions::default(), &mut Silent)
}

fn encode<const D: usize>(shape: [usize; D], samples: Samples) -> Vec<u8> {
    let image = Image::new(Frame::new(shape).unwrap(), samples).unwrap();
    let mut bytes = Cursor::new(Vec::new());
    write(&mut bytes, &ImageView::of(&image), &mut Silent).unwrap();
    bytes.into_inner()
}

#[test]
fn every_type_goes_there_and_back() {
    for samples in [
        Samples::U8(vec![0, 1, 255, 3, 4, 5].into()),
        Samples::I8(vec![-128, 1, 127, 3, 4, 5].into()),
        Samples::U16(vec![0, 1, 65535, 3, 4, 5].into()),
        Samples::I16(vec![-32768, 1, 2, 3, 4, 5].into()),
        Samples::U32(vec![u32::MAX, 1, 2, 3, 4, 5].into()),
        Samples::I32(vec![i32::MIN, 1, 2, 3, 4, 5].into()),
        Samples::F32(vec![-0.5, f32::INFINITY, 2.0, 3.0, 4.0, 1e-30].into()),
        Samples::F64(vec![-0.5, 1e300, 2.0, 3.0, 4.0, 5.0].into()),
    ] {
        let flat = decode(&encode([3, 2], samples.clone())).unwrap();
        assert_eq!((flat.shape(), flat.samples()), (vec![3, 2], &samples));
        let volume = decode(&encode([1, 2, 3], samples.clone())).unwrap();
        assert_eq!((volume.shape(), volume.samples()), (vec![1, 2, 3], &samples));
    }
}

#[test]
fn pages_of_another_shape_or_type_are_named() {
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    encoder.write_image::<Gray8>(3, 2, &[0; 6]).unwrap();
    encoder.write_image::<Gray8>(3, 2, &[0; 6]).unwrap();
    encoder.write_image::<Gray8>(2, 2, &[0; 4]).unwrap();
    encoder.write_image::<Gray8>(2, 2, &[0; 4]).unwrap();
    let small = load(bytes.get_ref(), StackOptions::default()).unwrap();
    assert_eq!(small.image.shape(), [3, 2, 2]);
    assert!(said(&small)[0].starts_with("2 of 4 pages are left out"), "{:?}", small.notes);
    assert!(small.notes[0].is_warning());

    // more pages of another shape are no thumbnails
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    encoder.write_image::<Gray8>(3, 2, &[0; 6]).unwrap();
    encoder.write_image::<Gray8>(2, 2, &[0; 4]).unwrap();
    encoder.write_image::<Gray8>(2, 2, &[0; 4]).unwrap();
    let text = decode(bytes.get_ref()).unwrap_err().to_string();
    assert!(text.starts_with("page 1 is 3 × 2") && text.contains("expected 2 × 2"), "{text}");

    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    encoder.write_image::<Gray8>(3, 2, &[0; 6]).unwrap();
    encoder.write_image::<GrayI8>(3, 2, &[0; 6]).unwrap();
    let text = decode(bytes.get_ref()).unwrap_err().to_string();
    assert!(text.contains("page 2") && text.contains("Int"), "{text}");
}

#[test]
fn colour_becomes_luminance_and_wide_integers_doubles() {
    let mut bytes = Cursor::new(Vec::new());
    TiffEncoder::new(&mut bytes).unwrap().write_image::<RGB8>(2, 1, &[255, 0, 0, 9, 9, 9]).unwrap();
    assert_eq!(*decode(bytes.get_ref()).unwrap().samples(), Samples::U8(vec![76, 9].into()));

    let mut bytes = Cursor::new(Vec::new());
    TiffEncoder::new(&mut bytes)
        .unwrap()
        .write_image::<RGB32Float>(1, 1, &[1.0, 0.0, 0.0])
        .unwrap();
    assert_eq!(*decode(bytes.get_ref()).unwrap().samples(), Samples::F32(vec![0.299].into()));

    let mut bytes = Cursor::new(Vec::new());
    TiffEncoder::new(&mut bytes).unwrap().write_image::<Gray64>(1, 1, &[1 << 40]).unwrap();
    let image = decode(bytes.get_ref()).unwrap();
    assert_eq!(*image.samples(), Samples::F64(vec![(1u64 << 40) as f64].into()));
}

#[test]
fn cut_files_are_refused_wherever_they_end() {
    let bytes = encode([5, 4, 3], Samples::U16((0..60).collect()));
    for length in 1..bytes.len() {
        assert!(decode(&bytes[..length]).is_err(), "{length}");
    }
}

#[test]
fn an_absurd_size_is_refused_before_room_is_made() {
    let mut bytes = encode([3, 2], Samples::U8(vec![0; 6].into()));
    // the entries of width, length and rows per strip, each 12 bytes
    for tag in [256u16, 257, 278] {
        let [low, high] = tag.to_le_bytes();
        let entry = [low, high, 4, 0, 1, 0, 0, 0]; // one 32-bit number
        let at = bytes.windows(8).position(|w| w == entry).unwrap();
        bytes[at + 8..at + 12].copy_from_slice(&60_000u32.to_le_bytes());
    }
    let error = decode(&bytes).unwrap_err();
    assert!(matches!(error, ReadReason::TooLarge { .. }), "{error}");
}

/// A tag of a directory: its number, type and bytes, least first.
type Entry = (u16, u16, Vec<u8>);

fn short(tag: u16, value: u16) -> Entry {
    (tag, 3, value.to_le_bytes().into())
}

fn ratio(tag: u16, above: u32, below: u32) -> Entry {
    (tag, 5, [above.to_le_bytes(), below.to_le_bytes()].concat())
}

fn text(text: &str) -> Entry {
    (270, 2, [text.as_bytes(), b"\0"].concat())
}

/// Pages of one strip of bytes each, `width` across, with more entries; those that are given replace the usual ones.
fn pages(width: u16, planes: &[&[u8]], more: &[Entry]) -> Vec<u8> {
    let mut file = b"II\x2a\0\0\0\0\0".to_vec();
    let mut link = 4;
    for plane in planes {
        let start = file.len() as u32;
        file.extend(*plane);
        let rows = (plane.len() / usize::from(width)) as u16;
        let mut entries = vec![short(256, width), short(257, rows), short(258, 8), short(259, 1)];
        entries.extend([short(262, 1), (273, 4, start.to_le_bytes().into()), short(278, rows)]);
        entries.push((279, 4, (plane.len() as u32).to_le_bytes().into()));
        entries.retain(|(tag, ..)| more.iter().all(|(other, ..)| other != tag));
        entries.extend(more.iter().cloned());
        // a page of tiles has no strips
        let is_tiled = more.iter().any(|(tag, ..)| *tag == 324);
        entries.retain(|(tag, ..)| !(is_tiled && [273, 278, 279].contains(tag)));
        entries.sort_by_key(|(tag, ..)| *tag);
        let size = |kind: u16| [0, 1, 1, 2, 4, 8][usize::from(kind)];
        let mut places = Vec::new();
        for (.., value) in &entries {
            places.push(file.len() as u32);
            file.extend(if value.len() > 4 { &value[..] } else { &[] });
        }
        let directory = (file.len() as u32).to_le_bytes();
        file[link..link + 4].copy_from_slice(&directory);
        file.extend((entries.len() as u16).to_le_bytes());
        for ((tag, kind, value), place) in entries.iter().zip(places) {
            file.extend(tag.to_le_bytes());
            file.extend(kind.to_le_bytes());
            file.extend(((value.len() / size(*kind)) as u32).to_le_bytes());
            let mut inline = [value.as_slice(), &[0; 4]].concat();
            inline.truncate(4);
            file.extend(if value.len() > 4 { place.to_le_bytes().to_vec() } else { inline });
        }
        link = file.len();
        file.extend([0; 4]);
    }
    file
}

fn load(bytes: &[u8], stack: StackOptions) -> Result<LoadedImage, ReadReason> {
    let options = ReadOptions { stack, ..ReadOptions::default() };
    load_bytes(bytes, FORMAT, &options, &mut Silent)
}

fn meant(bytes: &[u8], meaning: Meaning) -> Result<LoadedImage, ReadReason> {
    let options = ReadOptions { meaning, ..ReadOptions::default() };
    load_bytes(bytes, FORMAT, &options, &mut Silent)
}

fn said(loaded: &LoadedImage) -> Vec<String> {
    loaded.notes.iter().map(ToString::to_string).collect()
}

/// Six planes of two samples, each of its number.
const SIX: [&[u8]; 6] = [&[0, 0], &[1, 1], &[2, 2], &[3, 3], &[4, 4], &[5, 5]];

/// The first samples of the planes.
fn firsts(loaded: &LoadedImage) -> Vec<f64> {
    let samples = loaded.image.samples();
    (0..samples.len()).step_by(2).map(|k| samples.get(k)).collect()
}

#[test]
fn one_channel_and_time_of_a_stack_are_chosen() {
    let stack = text("ImageJ=1.53t\nimages=6\nchannels=2\nslices=3\nhyperstack=true\n");
    let file = pages(1, &SIX, &[stack]);
    let refusal = load(&file, StackOptions::default()).unwrap_err().to_string();
    assert!(refusal.contains("2 channels and 1 times of 1 × 2 × 3 samples"), "{refusal}");
    let channel = |n| load(&file, StackOptions { channel: Some(n), ..StackOptions::default() });
    assert_eq!(firsts(&channel(1).unwrap()), [0.0, 2.0, 4.0]);
    assert_eq!(firsts(&channel(2).unwrap()), [1.0, 3.0, 5.0]);
    assert_eq!(said(&channel(2).unwrap()), ["channel 2 of 2"]);
    assert!(channel(3).unwrap_err().to_string().contains("not channel 3"));

    let times = text("ImageJ=1.53t\nimages=6\nframes=6\n");
    let file = pages(1, &SIX, &[times]);
    assert!(load(&file, StackOptions::default()).is_err());
    let third =
        load(&file, StackOptions { time: Some(3), channel: Some(2), volume: None }).unwrap();
    assert_eq!((third.image.shape(), firsts(&third)), (vec![1, 2], vec![2.0]));
    let warning = said(&third).into_iter().find(|note| note.contains("channel 2 was asked for"));
    assert!(warning.is_some(), "{:?}", third.notes);
}

#[test]
fn ome_and_tifffile_name_their_axes() {
    let ome = "<OME><Image><Pixels DimensionOrder='XYZCT' SizeX='1' SizeY='2' SizeC='2' SizeZ='3' \
               SizeT='1' PhysicalSizeX='0.5' PhysicalSizeY='0.5' PhysicalSizeZ='2'/></Image></OME>";
    let file = pages(1, &SIX, &[text(ome)]);
    let second = load(&file, StackOptions { channel: Some(2), ..StackOptions::default() }).unwrap();
    assert_eq!(firsts(&second), [3.0, 4.0, 5.0]);
    assert_eq!(
        (second.image.spacing(), &second.units[..]),
        (vec![0.5, 0.5, 2.0], &["um"; 3].map(String::from)[..])
    );
    assert!(said(&second).contains(&"the spacing 0.5,0.5,2 um is that of the OME-XML".into()));

    let file = pages(1, &SIX, &[text(r#"{"shape": [3, 2, 2, 1], "axes": "ZCYX"}"#)]);
    let second = load(&file, StackOptions { channel: Some(2), ..StackOptions::default() }).unwrap();
    assert_eq!(firsts(&second), [1.0, 3.0, 5.0]);
    let file = pages(1, &SIX, &[text(r#"{"shape": [2, 3, 2, 1], "axes": "CZYX"}"#)]);
    let second = load(&file, StackOptions { channel: Some(2), ..StackOptions::default() }).unwrap();
    assert_eq!(firsts(&second), [3.0, 4.0, 5.0]);
    let file = pages(1, &SIX, &[text(r#"{"shape": [3, 2, 2, 1]}"#)]);
    assert!(load(&file, StackOptions::default()).unwrap_err().to_string().contains("[3, 2]"));
}

#[test]
fn descriptions_that_promise_other_planes_are_refused_or_noted() {
    let of =
        |description: &str| load(&pages(1, &SIX, &[text(description)]), StackOptions::default());
    let channels = of("ImageJ=1\nimages=8\nchannels=2\nslices=4\n").unwrap_err().to_string();
    assert!(channels.contains("the ImageJ description promises 2 channels"), "{channels}");
    let slices = of("ImageJ=1\nimages=8\nslices=8\n").unwrap();
    assert_eq!(slices.image.shape(), [1, 2, 6]);
    assert!(said(&slices)[0].contains("promises 8 planes, and there are 6"), "{:?}", slices.notes);
    assert!(slices.notes[0].is_warning());
    let broken = of("<OME><Image>").unwrap_err().to_string();
    assert!(broken.contains("OME-XML"), "{broken}");
}

#[test]
fn planes_behind_a_single_directory_are_read() {
    let stack = text("ImageJ=1.53q\nimages=3\nslices=3\nunit=micron\nspacing=2.0\n");
    let strip = (279, 4, 2u32.to_le_bytes().to_vec());
    // the first plane is the directory's, the others follow it
    let whole: &[u8] = &[7, 7, 8, 8, 9, 9];
    let entries = [stack, strip, short(257, 2), short(278, 2), ratio(282, 1, 1), ratio(283, 1, 1)];
    let file = pages(1, &[whole], &entries);
    let loaded = load(&file, StackOptions::default()).unwrap();
    assert_eq!((loaded.image.shape(), firsts(&loaded)), (vec![1, 2, 3], vec![7.0, 8.0, 9.0]));
    assert_eq!((loaded.image.spacing(), loaded.units[0].as_str()), (vec![1.0, 1.0, 2.0], "um"));
    let more = text("ImageJ=1.53q\nimages=3000\nslices=3000\n");
    let entries = [more, short(257, 2), short(278, 2)];
    let error = load(&pages(1, &[whole], &entries), StackOptions::default()).unwrap_err();
    assert!(matches!(error, ReadReason::Truncated { expected: 6000, .. }), "{error}");
}

#[test]
fn resolution_is_the_spacing_unless_software_wrote_it_unasked() {
    let of = |x: u32, y: u32, unit: u16| {
        let entries = [ratio(282, x, 1), ratio(283, y, 1), short(296, unit)];
        load(&pages(1, &[&[1, 2]], &entries), StackOptions::default()).unwrap()
    };
    let measured = of(100, 50, 3);
    assert_eq!((measured.image.spacing(), measured.units[0].as_str()), (vec![0.1, 0.2], "mm"));
    assert!(!measured.notes[0].is_warning() && said(&measured)[0].contains("resolution tags"));
    for usual in [72, 96, 150, 300, 600] {
        let loaded = of(usual, usual, 2);
        assert_eq!((loaded.image.spacing(), loaded.units.len()), (vec![1.0; 2], 0));
        assert!(said(&loaded)[0].contains("unasked"), "{:?}", loaded.notes);
    }
    assert!((of(254, 254, 2).image.spacing()[0] - 0.1).abs() < 1e-15); // a rounding of 25.4 / 254
    assert_eq!(of(1, 1, 1).notes, []);
    assert!(of(1, 2, 1).notes[0].is_warning());
    let imagej = [text("ImageJ=1.11a\nimages=1\nunit=um\n"), ratio(282, 10, 1), ratio(283, 10, 1)];
    let loaded = load(&pages(1, &[&[1, 2]], &imagej), StackOptions::default()).unwrap();
    assert_eq!((loaded.image.spacing(), loaded.units[0].as_str()), (vec![0.1; 2], "um"));
}

#[test]
fn a_volume_without_a_spacing_of_planes_is_warned_of() {
    let entries = [ratio(282, 100, 1), ratio(283, 100, 1), short(296, 3)];
    let loaded = load(&pages(1, &SIX, &entries), StackOptions::default()).unwrap();
    assert_eq!(loaded.image.spacing(), [0.1, 0.1, 1.0]);
    let warning = loaded.notes.iter().find(|note| note.is_warning()).unwrap();
    assert!(warning.to_string().contains("how far apart its planes are"), "{warning}");
}

#[test]
fn a_spacing_that_is_given_needs_no_unit_of_the_files() {
    let given = GivenFrame { spacing: true, ..GivenFrame::default() };
    let options = ReadOptions { given, ..ReadOptions::default() };
    let entries = [ratio(282, 100, 1), ratio(283, 50, 1), short(296, 3)];
    let file = pages(1, &[&[1, 2]], &entries);
    let loaded = load_bytes(&file, FORMAT, &options, &mut Silent).unwrap();
    assert_eq!((loaded.units, loaded.notes), (vec![], vec![]));
}

#[test]
fn few_bits_are_stretched_as_pictures_and_stored_as_labels() {
    let bits = |depth: u16| [short(256, 3), short(257, 1), short(258, depth), short(278, 1)];
    let one = pages(1, &[&[0b1010_0000]], &bits(1));
    assert_eq!(*decode(&one).unwrap().samples(), Samples::U8(vec![255, 0, 255].into()));
    let labels = meant(&one, Meaning::Labels).unwrap();
    assert_eq!(*labels.image.samples(), Samples::U8(vec![1, 0, 1].into()));
    let two = pages(1, &[&[0b0001_1100]], &bits(2));
    assert_eq!(*decode(&two).unwrap().samples(), Samples::U8(vec![0, 85, 255].into()));
    assert_eq!(
        *meant(&two, Meaning::Mask).unwrap().image.samples(),
        Samples::U8(vec![0, 1, 3].into())
    );
}

#[test]
fn values_of_labels_stay_where_0_is_white() {
    let file = pages(1, &[&[1, 2], &[3, 0]], &[short(262, 0)]);
    assert_eq!(*decode(&file).unwrap().samples(), Samples::U8(vec![254, 253, 252, 255].into()));
    let labels = meant(&file, Meaning::Labels).unwrap();
    assert_eq!(*labels.image.samples(), Samples::U8(vec![1, 2, 3, 0].into()));
    assert_eq!(labels.notes, [ReadNote::WhiteIsZero]);
}

#[test]
fn labels_of_a_palette_are_its_indices() {
    // red, green and blue of all indices one after another, 256 of each
    let colours: [[u16; 3]; 3] = [[0xff00, 0, 0], [0, 0x8200, 0], [0, 0, 0xff00]];
    let map: Vec<u8> = (0..3)
        .flat_map(|c| (0..256).map(move |k| colours.get(k).map_or(0, |colour| colour[c])))
        .flat_map(u16::to_le_bytes)
        .collect();
    let file = pages(1, &[&[0, 1], &[2, 1]], &[short(262, 3), (320, 3, map)]);
    let picture = load(&file, StackOptions::default()).unwrap();
    // Rec. 601 of 255 red, 130 green and 255 blue
    assert_eq!(*picture.image.samples(), Samples::U8(vec![76, 76, 29, 76].into()));
    assert_eq!(picture.notes, [ReadNote::PaletteLuminance]);
    let labels = meant(&file, Meaning::Labels).unwrap();
    assert_eq!(*labels.image.samples(), Samples::U8(vec![0, 1, 2, 1].into()));
    assert_eq!(labels.notes, [ReadNote::PaletteIndices { is_black_elsewhere: false }]);
    let colours = meant(&file, Meaning::LabelsByColour).unwrap();
    assert_eq!(*colours.image.samples(), Samples::U32(vec![3, 2, 1, 2].into()));
}

/// Whole numbers of a tag, of 4 bytes each.
fn longs(tag: u16, values: &[u32]) -> Entry {
    (tag, 4, values.iter().flat_map(|n| n.to_le_bytes()).collect())
}

/// Bits of three channels, or two.
fn bits(channels: usize) -> Entry {
    (258, 3, [8, 0].repeat(channels))
}

#[test]
fn channels_in_planes_are_those_that_are_together() {
    let colours: [[u8; 3]; 4] = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [9, 80, 200]];
    let planes: Vec<u8> = (0..3).flat_map(|c| colours.map(|colour| colour[c])).collect();
    let (rows, per_strip) = (short(257, 2), short(278, 2));
    let parted = pages(
        2,
        &[&planes],
        &[
            rows.clone(),
            per_strip.clone(),
            bits(3),
            short(262, 2),
            short(277, 3),
            short(284, 2),
            longs(273, &[8, 12, 16]),
            longs(279, &[4, 4, 4]),
        ],
    );
    let together = pages(
        2,
        &[colours.as_flattened()],
        &[rows, per_strip, bits(3), short(262, 2), short(277, 3)],
    );
    let luminance = decode(&together).unwrap();
    assert_eq!(decode(&parted).unwrap().samples(), luminance.samples());
    for meaning in [Meaning::LabelsByColour, Meaning::Mask] {
        let of = |file: &[u8]| meant(file, meaning).unwrap().image.samples().clone();
        assert_eq!(of(&parted), of(&together), "{meaning:?}");
    }
    assert!(meant(&parted, Meaning::Labels).is_err());
    for length in 8..parted.len() {
        let _ = decode(&parted[..length]);
    }
}

#[test]
fn opacity_of_grey_does_not_count() {
    let rest = [short(257, 2), short(278, 2), bits(2), short(277, 2)];
    let entries = |kind: u16| [&rest[..], &[short(338, kind)]].concat();
    let plane: &[u8] = &[1, 99, 2, 98, 3, 97, 4, 96];
    let grey = decode(&pages(2, &[plane], &entries(2))).unwrap();
    assert_eq!(*grey.samples(), Samples::U8(vec![1, 2, 3, 4].into()));
    // a second channel of anything else is none of opacity
    let text = decode(&pages(2, &[plane], &entries(0))).unwrap_err().to_string();
    assert!(text.contains("2 channels of 8 bits"), "{text}");
}

#[test]
fn zstd_is_unpacked_and_not_beyond_the_page() {
    let plane: Vec<u8> = (0..200).map(|k| k / 3).collect();
    let level = ruzstd::encoding::CompressionLevel::Fastest;
    let packed = ruzstd::encoding::compress_to_vec(&plane[..], level);
    let entries = [short(257, 10), short(278, 10), short(259, 50_000)];
    let file = pages(20, &[&packed], &entries);
    assert_eq!(*decode(&file).unwrap().samples(), Samples::U8(plane.into()));
    let taller = [short(257, 11), short(278, 11), short(259, 50_000)];
    assert!(decode(&pages(20, &[&packed], &taller)).is_err());
    let labels = [&entries[..], &[short(262, 0)]].concat();
    let white = pages(20, &[&packed], &labels);
    assert_eq!(decode(&white).unwrap().samples().get(0), 255.0);
    assert_eq!(meant(&white, Meaning::Labels).unwrap().image.samples().get(0), 0.0);
    for at in 8..packed.len() {
        let mut broken = file.clone();
        broken[at] ^= 0x55;
        let _ = decode(&broken);
    }
}

#[test]
fn tiles_with_a_depth_are_a_volume() {
    // 17 × 3 × 3 samples in tiles of 16 × 16 × 2: two across and two deep
    let value = |x: usize, y: usize, z: usize| (x + 20 * y + 80 * z) as u8;
    let mut tiles = Vec::new();
    for tile in 0..4 {
        for at in 0..512 {
            let (x, y, z) = (tile % 2 * 16 + at % 16, at / 16 % 16, tile / 2 * 2 + at / 256);
            tiles.push(if x < 17 && y < 3 && z < 3 { value(x, y, z) } else { 77 });
        }
    }
    let entries = [
        short(257, 3),
        short(322, 16),
        short(323, 16),
        longs(32_997, &[3]),
        longs(32_998, &[2]),
        longs(324, &[8, 520, 1032, 1544]),
        longs(325, &[512; 4]),
    ];
    let file = pages(17, &[&tiles], &entries);
    let image = decode(&file).unwrap();
    assert_eq!(image.shape(), [17, 3, 3]);
    let expected: Vec<u8> = (0..153).map(|k| value(k % 17, k / 17 % 3, k / 51)).collect();
    assert_eq!(*image.samples(), Samples::U8(expected.into()));
    let absurd = [&entries[..6], &[longs(325, &[512; 4]), longs(322, &[1 << 20])]].concat();
    assert!(decode(&pages(17, &[&tiles], &absurd[1..])).is_err());
}

#[test]
fn a_long_description_of_a_small_image_counts() {
    let long = format!("ImageJ=1\nimages=1\nunit=um\n{}", "info=long \n".repeat(50));
    let entries = [text(&long), ratio(282, 4, 1), ratio(283, 4, 1)];
    let loaded = load(&pages(1, &[&[1]], &entries), StackOptions::default()).unwrap();
    assert_eq!((loaded.image.spacing(), loaded.units[0].as_str()), (vec![0.25; 2], "um"));
}
