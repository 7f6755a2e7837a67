//! Which files are read: one series of several, and folders in folders.

use atomesh_io::image::{ReadNote, ReadOptions, ReadReason, ScanNote, SeriesError};

use super::{File, folder, load, load_with, numbers, three, whole};

/// The three slices, and two of another series.
fn two_series() -> tempfile::TempDir {
    let mut files = three().to_vec();
    for (_, file) in &mut files {
        file.text(0x0020_0011, "IS", "4");
        file.text(0x0008_103e, "LO", "Thorax");
    }
    for (name, height) in [("d", 0.0), ("e", 1.0)] {
        let mut file = File::of([3, 2], &[9; 6], height);
        file.text(0x0020_000e, "UI", "1.2.9");
        file.text(0x0020_0011, "IS", "5");
        file.text(0x0008_103e, "LO", "Thorax");
        files.push((name, file));
    }
    folder(whole(&files))
}

#[test]
fn one_of_several_series_is_chosen_by_what_it_is_known_by() {
    let folder = two_series();
    let read = |series: &str| {
        let options = ReadOptions { series: Some(series.into()), ..ReadOptions::default() };
        load_with(folder.path(), &options)
    };
    for (series, count) in [("1.2.3", 3), ("4", 3), ("04", 3), ("1.2.9", 2), (" 5 ", 2)] {
        let loaded = read(series).unwrap();
        assert_eq!(loaded.image.shape(), [3, 2, count], "{series}");
        let note = loaded.notes.first().unwrap();
        assert!(matches!(note, ReadNote::Scan(ScanNote::Series { count: 2, .. })), "{note:?}");
        assert!(note.is_remark() && note.to_string().contains("Thorax"), "{note}");
    }
    let text = load(folder.path()).unwrap_err().to_string();
    let listed =
        "1.2.3, number 4, \"Thorax\" (3 files, such as a.17); 1.2.9, number 5, \"Thorax\" (2 files";
    assert!(text.contains(listed), "{text}");
    // a description of both tells nothing
    for (series, is_known) in [("thorax", true), ("6", false)] {
        let error = read(series).unwrap_err();
        let ReadReason::Series(reason) = &error.reason else { panic!("{error}") };
        assert_eq!(matches!(**reason, SeriesError::SeveralSeries { .. }), is_known, "{error}");
        assert!(error.to_string().contains(listed), "{error}");
    }
}

#[test]
fn images_of_other_series_may_be_what_is_not_read() {
    let mut files = three().to_vec();
    let mut report = File::of([3, 2], &[9; 6], 0.0);
    report.text(0x0020_000e, "UI", "1.2.9");
    report.text(0x0028_0004, "CS", "RGB");
    files.push(("report", report));
    let folder = folder(whole(&files));
    let read = |series: &str| {
        let options = ReadOptions { series: Some(series.into()), ..ReadOptions::default() };
        load_with(folder.path(), &options)
    };
    assert_eq!(read("1.2.3").unwrap().image.shape(), [3, 2, 3]);
    let text = read("1.2.9").unwrap_err().to_string();
    assert!(text.contains("report: DICOM file holds RGB samples"), "{text}");
    let text = load(folder.path()).unwrap_err().to_string();
    assert!(text.contains("several series"), "{text}");
}

#[test]
fn slices_in_folders_below_are_read_and_the_folder_is_named() {
    let inner = |folder: &'static str, files: &[(&'static str, File)]| {
        let path = |name: &str| format!("{folder}/{name}");
        files.iter().map(|(name, file)| (path(name), file.bytes())).collect::<Vec<_>>()
    };
    let nested = |all: &[(String, Vec<u8>)]| {
        folder(all.iter().map(|(name, bytes)| (name.as_str(), bytes.clone())))
    };
    let folder = nested(&inner("sub/ser1", &three()));
    let loaded = load(folder.path()).unwrap();
    assert_eq!(numbers(&loaded.image)[..4], [0.0, 1.0, 2.0, 3.0]);
    let note = ScanNote::Below { folder: "sub/ser1".into() };
    assert!(loaded.notes.contains(&note.into()), "{:?}", loaded.notes);
    // each slice in a folder of its own
    let all: Vec<_> = ["x", "y", "z"]
        .into_iter()
        .zip(three())
        .flat_map(|(folder, file)| inner(folder, &[file]))
        .collect();
    let folder = nested(&all);
    let loaded = load(folder.path()).unwrap();
    assert_eq!(loaded.image.shape(), [3, 2, 3]);
    assert!(loaded.notes[0].to_string().contains("3 folders, such as"), "{}", loaded.notes[0]);
    // what lies in the folder itself goes before
    std::fs::write(folder.path().join("top.dcm"), three()[0].1.bytes()).unwrap();
    assert_eq!(load(folder.path()).unwrap().image.shape(), [3, 2]);
    let empty = nested(&[("a/b/no image".to_owned(), b"none".to_vec())]);
    let text = load(empty.path()).unwrap_err().to_string();
    assert!(text.contains("no DICOM images (other files: 1)"), "{text}");
}
