//! Files of many frames, and what values mean.

use atomesh::image::Samples;
use atomesh_io::image::{Meaning, ReadNote, ReadOptions, ScanNote};

use super::{File, decode, element, folder, list, load, load_with, near, numbers, sequence};

/// An item of functional groups with a position and a slope.
fn groups(position: [f64; 3], slope: f64) -> Vec<u8> {
    let position = element(0x0020_0032, "DS", list(&position).as_bytes());
    let scale =
        [element(0x0028_1052, "DS", b"-10"), element(0x0028_1053, "DS", list(&[slope]).as_bytes())];
    [sequence(0x0020_9113, &[position]), sequence(0x0028_9145, &[scale.concat()])].concat()
}

/// An enhanced image of three frames, stored in another order than they lie.
fn enhanced() -> File {
    let mut file = File::of([2, 2], &[5, 6, 7, 8, 1, 2, 3, 4, 9, 10, 11, 12], 0.0);
    file.without(&[0x0020_0032, 0x0020_0037, 0x0028_0030]);
    file.text(0x0028_0008, "IS", "3");
    let shared = [
        sequence(0x0020_9116, &[element(0x0020_0037, "DS", b"1\\0\\0\\0\\1\\0")]),
        sequence(0x0028_9110, &[element(0x0028_0030, "DS", b"0.5\\2")]),
    ];
    file.put(sequence(0x5200_9229, &[shared.concat()]));
    let frames =
        [(4.0, 1.0), (1.0, 2.0), (7.0, 3.0)].map(|(z, slope)| groups([1.0, 2.0, z], slope));
    file.put(sequence(0x5200_9230, &frames));
    file
}

#[test]
fn frames_lie_where_their_functional_groups_say() {
    let image = decode(&enhanced().bytes()).unwrap();
    assert_eq!((image.shape(), image.spacing()), (vec![2, 2, 3], vec![2.0, 0.5, 3.0]));
    near(&image.origin(), &[-1.0, -2.0, 1.0]);
    // each with its own slope
    let expected = [1, 2, 3, 4].map(|v| 2.0 * f64::from(v) - 10.0).into_iter();
    let expected = expected.chain([5, 6, 7, 8].map(|v| f64::from(v) - 10.0));
    let expected = expected.chain([9, 10, 11, 12].map(|v| 3.0 * f64::from(v) - 10.0));
    assert_eq!(numbers(&image), expected.collect::<Vec<_>>());
    assert!(matches!(image.samples(), Samples::F32(_)));

    // groups beyond the frames are left out
    let mut more = enhanced();
    more.text(0x0028_0008, "IS", "1");
    let folder = folder([("a.dcm", more.bytes())]);
    let loaded = load(&folder.path().join("a.dcm")).unwrap();
    assert_eq!((loaded.image.shape(), numbers(&loaded.image)[0]), (vec![2, 2], -5.0));
    assert!(loaded.notes.contains(&ScanNote::MoreGroups { found: 3, frames: 1 }.into()));
    let mut few = enhanced();
    few.put(sequence(0x5200_9230, &[groups([0.0; 3], 1.0)]));
    let text = decode(&few.bytes()).unwrap_err().to_string();
    assert!(text.contains("1 for 3 frames"), "{text}");
    let mut twice = enhanced();
    let at = |z| groups([0.0, 0.0, z], 1.0);
    twice.put(sequence(0x5200_9230, &[at(0.0), at(1.0), at(0.0)]));
    let text = decode(&twice.bytes()).unwrap_err().to_string();
    assert!(text.contains("frame 1 and frame 3 are at the same place"), "{text}");
}

#[test]
fn a_dose_is_placed_by_its_offsets_and_scaled() {
    let mut file = File::of([2, 1], &[], 0.0);
    file.bits(32, 32, false);
    let stored: Vec<u8> = [1_000_000_u32, 2, 3, 4, 5, 4_000_000_000].map(u32::to_le_bytes).concat();
    file.put(element(0x7fe0_0010, "OW", &stored));
    file.text(0x0028_0008, "IS", "3");
    file.text(0x3004_000e, "DS", "1e-6");
    let read = |offsets: &str, height: f64| {
        let mut file = file.clone();
        file.text(0x0020_0032, "DS", &list(&[10.0, -20.0, height]));
        file.text(0x3004_000c, "DS", offsets);
        decode(&file.bytes())
    };
    let image = read("0\\5\\10", 7.0).unwrap();
    assert_eq!((image.shape(), image.spacing()), (vec![2, 1, 3], vec![1.2, 0.8, 5.0]));
    near(&image.origin(), &[-10.0, 20.0, 7.0]);
    near(&numbers(&image), &[1.0, 2e-6, 3e-6, 4e-6, 5e-6, 4000.0]);
    // places along z, and frames from the top down
    near(&read("7\\12\\17", 7.0).unwrap().origin(), &[-10.0, 20.0, 7.0]);
    let down = read("0\\-5\\-10", 7.0).unwrap();
    near(&down.origin(), &[-10.0, 20.0, -3.0]);
    near(&numbers(&down)[..2], &[5e-6, 4000.0]);
    let text = read("0\\5", 7.0).unwrap_err().to_string();
    assert!(text.contains("2 numbers for 3 frames"), "{text}");
}

#[test]
fn stored_bits_count_wherever_they_are() {
    let mut file = File::of([2, 1], &[0x1230, 0xfff0], 0.0);
    file.bits(16, 12, false);
    file.short(0x0028_0102, 15);
    assert_eq!(numbers(&decode(&file.bytes()).unwrap()), [0x123, 0xfff].map(f64::from));
    file.short(0x0028_0103, 1);
    assert_eq!(numbers(&decode(&file.bytes()).unwrap()), [291.0, -1.0]);
    file.short(0x0028_0102, 16);
    assert!(decode(&file.bytes()).unwrap_err().to_string().contains("bits stored"));
}

#[test]
fn a_look_up_table_gives_the_values() {
    let mut file = File::of([3, 1], &[0, 101, 999], 0.0);
    let table = |descriptor: [u16; 3], values: &[u16]| {
        let bytes = |v: &[u16]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let elements = [
            element(0x0028_3002, "US", &bytes(&descriptor)),
            element(0x0028_3006, "US", &bytes(values)),
        ];
        sequence(0x0028_3000, &[elements.concat()])
    };
    file.put(table([3, 100, 16], &[40_000, 50_000, 60_000]));
    assert_eq!(numbers(&decode(&file.bytes()).unwrap()), [40_000.0, 50_000.0, 60_000.0]);
    for (descriptor, values) in [([3, 100, 16], &[1, 2][..]), ([3, 100, 7], &[1, 2, 3])] {
        file.put(table(descriptor, values));
        let text = decode(&file.bytes()).unwrap_err().to_string();
        assert!(text.contains("look-up table"), "{text}");
    }
}

#[test]
fn white_is_turned_to_black_in_brightness_alone() {
    let mut file = File::of([2, 1], &[0, 1000], 0.0);
    file.text(0x0028_0004, "CS", "MONOCHROME1");
    file.bits(16, 12, false);
    let read = |file: &File, meaning| {
        let folder = folder([("a.dcm", file.bytes())]);
        let options = ReadOptions { meaning, ..ReadOptions::default() };
        let loaded = load_with(&folder.path().join("a.dcm"), &options).unwrap();
        (numbers(&loaded.image), loaded.notes)
    };
    let (values, notes) = read(&file, Meaning::Brightness);
    assert_eq!(values, [4095.0, 3095.0]);
    assert!(notes.contains(&ReadNote::Scan(ScanNote::Inverted)), "{notes:?}");
    let (values, notes) = read(&file, Meaning::Labels);
    assert_eq!(values, [0.0, 1000.0]);
    assert!(notes.contains(&ReadNote::WhiteIsZero), "{notes:?}");
    // turned round before they are rescaled, as ITK does
    file.text(0x0028_1052, "DS", "-24");
    file.text(0x0028_1053, "DS", "2");
    assert_eq!(read(&file, Meaning::Brightness).0, [8166.0, 6166.0]);
}

#[test]
fn files_without_a_preamble_are_known_by_their_first_element() {
    let mut file = File::of([2, 1], &[3, 4], 0.0);
    file.text(0x0008_0016, "UI", "1.2.840.10008.5.1.4.1.1.2");
    let with_meta = file.bytes()[132..].to_vec();
    file.without(&[0x0002_0010]);
    let explicit = file.bytes()[132..].to_vec();
    for bytes in [&with_meta, &explicit] {
        assert_eq!(numbers(&decode(bytes).unwrap()), [3.0, 4.0]);
    }
    let folder = folder([("IM1", explicit), ("notes.txt", b"\x08\0 no image at all".to_vec())]);
    let loaded = load(folder.path()).unwrap();
    let note = ScanNote::NoPreamble { count: 1, file: "IM1".into() };
    assert!(loaded.notes.contains(&note.into()), "{:?}", loaded.notes);
}
