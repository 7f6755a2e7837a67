//! Segmentations become labels.

use atomesh_io::image::{ReadNote, ReadOptions, ReadReason, ScanNote};

use super::{File, decode, element, folder, list, load, load_with, near, numbers, sequence};

/// A segmentation of 5 × 3 samples: of each frame the segment, the height and the samples, `#` inside.
fn segmentation(frames: &[(u16, f64, [&str; 3])]) -> File {
    let mut file = File::of([5, 3], &[], 0.0);
    file.without(&[0x0020_0032, 0x0020_0037, 0x0028_0030]);
    file.text(0x0008_0060, "CS", "SEG");
    file.text(0x0062_0001, "CS", "BINARY");
    file.text(0x0028_0008, "IS", &frames.len().to_string());
    file.bits(1, 1, false);
    let segment = |number: u16, name: &str| {
        [
            element(0x0062_0004, "US", &number.to_le_bytes()),
            element(0x0062_0005, "LO", name.as_bytes()),
        ]
        .concat()
    };
    file.put(sequence(0x0062_0002, &[segment(1, "Liver"), segment(7, "Vessel")]));
    let shared = [
        sequence(0x0020_9116, &[element(0x0020_0037, "DS", b"1\\0\\0\\0\\1\\0")]),
        sequence(0x0028_9110, &[element(0x0028_0030, "DS", b"2\\1")]),
    ];
    file.put(sequence(0x5200_9229, &[shared.concat()]));
    let groups = |(segment, height, _): &(u16, f64, [&str; 3])| {
        let position = element(0x0020_0032, "DS", list(&[1.0, 2.0, *height]).as_bytes());
        let number = element(0x0062_000b, "US", &segment.to_le_bytes());
        [sequence(0x0020_9113, &[position]), sequence(0x0062_000a, &[number])].concat()
    };
    file.put(sequence(0x5200_9230, &frames.iter().map(groups).collect::<Vec<_>>()));
    // 15 bits a frame: all but the first begin within a byte
    let drawn: Vec<bool> = frames
        .iter()
        .flat_map(|(.., rows)| rows.iter().flat_map(|row| row.bytes()))
        .map(|b| b == b'#')
        .collect();
    let mut bytes = vec![0_u8; drawn.len().div_ceil(8)];
    drawn
        .iter()
        .enumerate()
        .filter(|(_, set)| **set)
        .for_each(|(k, _)| bytes[k / 8] |= 1 << (k % 8));
    file.put(element(0x7fe0_0010, "OB", &bytes));
    file
}

const LEFT: [&str; 3] = ["##...", "#....", "##..."];
const RIGHT: [&str; 3] = ["...##", "....#", "....."];

fn labels(of: [(&[&str; 3], f64); 2]) -> Vec<f64> {
    let at = |k: usize, (rows, label): (&[&str; 3], f64)| {
        if rows[k / 5].as_bytes()[k % 5] == b'#' { label } else { 0.0 }
    };
    (0..15).map(|k| at(k, of[0]) + at(k, of[1])).collect()
}

#[test]
fn labels_are_the_numbers_of_segments() {
    let file = segmentation(&[(1, 4.0, LEFT), (7, 4.0, RIGHT), (7, 0.0, LEFT), (1, 2.0, RIGHT)]);
    let folder = folder([("seg.dcm", file.bytes())]);
    let path = folder.path().join("seg.dcm");
    let loaded = load(&path).unwrap();
    assert_eq!((loaded.image.shape(), loaded.image.type_name()), (vec![5, 3, 3], "uint8"));
    near(&loaded.image.spacing(), &[1.0, 2.0, 2.0]);
    near(&loaded.image.origin(), &[-1.0, -2.0, 0.0]);
    let none = [(&LEFT, 7.0), (&RIGHT, 0.0)];
    let expected = [
        labels(none),
        labels([(&LEFT, 0.0), (&RIGHT, 1.0)]),
        labels([(&LEFT, 1.0), (&RIGHT, 7.0)]),
    ];
    assert_eq!(numbers(&loaded.image), expected.concat());
    let note = ScanNote::Segments { list: "1 Liver, 7 Vessel".into() };
    assert!(loaded.notes.contains(&note.into()), "{:?}", loaded.notes);

    let one = |segment: &str| {
        let options = ReadOptions { segment: Some(segment.into()), ..ReadOptions::default() };
        load_with(&path, &options)
    };
    for segment in ["7", "vessel"] {
        let loaded = one(segment).unwrap();
        let inside = [
            labels([(&LEFT, 1.0), (&RIGHT, 0.0)]),
            vec![0.0; 15],
            labels([(&LEFT, 0.0), (&RIGHT, 1.0)]),
        ];
        assert_eq!(numbers(&loaded.image), inside.concat(), "{segment}");
        let note = ReadNote::Segment { name: "Vessel".into(), number: 7, count: 2 };
        assert!(loaded.notes.contains(&note), "{:?}", loaded.notes);
    }
    let text = one("2").unwrap_err().to_string();
    assert!(text.contains("1 Liver, 7 Vessel; expected one, not \"2\""), "{text}");
}

#[test]
fn segments_that_overlap_are_refused_unless_one_is_chosen() {
    let file = segmentation(&[(1, 0.0, LEFT), (7, 0.0, LEFT), (1, 1.0, LEFT)]);
    let error = decode(&file.bytes()).unwrap_err();
    assert!(matches!(error, ReadReason::Segments { layers: 2, .. }), "{error}");
    let folder = folder([("seg.dcm", file.bytes())]);
    let options = ReadOptions { segment: Some("1".into()), ..ReadOptions::default() };
    let loaded = load_with(&folder.path().join("seg.dcm"), &options).unwrap();
    assert_eq!(numbers(&loaded.image).iter().sum::<f64>(), 10.0);
}

#[test]
fn slices_without_a_frame_are_empty() {
    let file = segmentation(&[(1, 0.0, LEFT), (1, 2.0, RIGHT), (1, 8.0, LEFT)]);
    let folder = folder([("seg.dcm", file.bytes())]);
    let loaded = load(&folder.path().join("seg.dcm")).unwrap();
    assert_eq!(loaded.image.shape(), [5, 3, 5]);
    let slices: Vec<f64> =
        numbers(&loaded.image).chunks(15).map(|slice| slice.iter().sum()).collect();
    assert_eq!(slices, [5.0, 3.0, 0.0, 0.0, 5.0]);
    let note = ScanNote::EmptySlices { empty: 2, count: 5 };
    assert!(loaded.notes.contains(&note.into()), "{:?}", loaded.notes);
    // one slice alone is flat
    let flat = decode(&segmentation(&[(1, 3.0, LEFT), (7, 3.0, RIGHT)]).bytes()).unwrap();
    assert_eq!(flat.shape(), [5, 3]);
    assert_eq!(numbers(&flat), labels([(&LEFT, 1.0), (&RIGHT, 7.0)]));
}

#[test]
fn shares_of_one_segment_are_numbers_to_1() {
    let mut file = File::of([2, 1], &[], 0.0);
    file.text(0x0008_0060, "CS", "SEG");
    file.text(0x0062_0001, "CS", "FRACTIONAL");
    file.short(0x0062_000e, 200);
    file.bits(8, 8, false);
    file.put(element(0x7fe0_0010, "OB", &[50, 200]));
    near(&numbers(&decode(&file.bytes()).unwrap()), &[0.25, 1.0]);
    file.text(0x0062_0001, "CS", "OTHER");
    assert!(decode(&file.bytes()).unwrap_err().to_string().contains("type OTHER"));
}
