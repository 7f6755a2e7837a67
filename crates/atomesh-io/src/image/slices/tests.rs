//! Folders of slices in their natural order, and what is refused by name.

use atomesh::watch::Silent;

use super::super::{GivenFrame, load_image, write_image};
use super::*;

fn slice(folder: &Path, name: &str, shape: [usize; 2], first: u16) {
    let count = shape[0] * shape[1];
    let samples = Samples::U16((first..first + count as u16).collect::<Vec<_>>().into());
    let image = Image::new(Frame::new(shape).unwrap(), samples).unwrap();
    write_image(&folder.join(name), &image, &mut Silent).unwrap();
}

fn load(folder: &Path) -> Result<LoadedImage, String> {
    let loaded = load_image(folder, &ReadOptions::default(), &mut Silent);
    loaded.map_err(|error| error.reason.to_string())
}

#[test]
fn names_are_in_the_order_of_their_numbers() {
    let mut names = [
        "s10.png",
        "s2.png",
        "s002a.png",
        "s1.png",
        "a99999999999999999999.png",
        "a3.png",
        "s.png",
    ];
    names.sort_by(|a, b| natural(a, b));
    let expected = [
        "a3.png",
        "a99999999999999999999.png",
        "s1.png",
        "s2.png",
        "s002a.png",
        "s10.png",
        "s.png",
    ];
    let mut sorted = expected;
    sorted.sort_by(|a, b| natural(a, b));
    assert_eq!(names, sorted);
    assert_eq!(natural("s2.png", "s10.png"), Ordering::Less);
    assert_eq!(natural("s02.png", "s2.png"), Ordering::Less); // the same number, a fixed order
    assert_eq!(natural("s2", "s2"), Ordering::Equal);
}

#[test]
fn slices_are_the_planes_of_a_volume() {
    for ending in ["png", "tif"] {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        for k in [10, 2, 9, 11] {
            slice(at, &format!("s{k}.{ending}"), [3, 2], 100 * k);
        }
        fs::write(at.join("notes.txt"), "anything").unwrap();
        fs::write(at.join(".hidden.png"), "anything").unwrap();
        let loaded = load(at).unwrap();
        assert_eq!(loaded.image.shape(), [3, 2, 4]);
        let firsts: Vec<_> = (0..4).map(|z| loaded.image.samples().get(6 * z)).collect();
        assert_eq!(firsts, [200.0, 900.0, 1000.0, 1100.0]);
        let text: Vec<_> = loaded.notes.iter().map(ReadNote::to_string).collect();
        assert!(text[0].starts_with("4 slices from s2."), "{text:?}");
        assert!(text.iter().any(|t| t.contains("evenly from s2")), "{text:?}");
        assert!(text.iter().any(|t| t.contains("notes.txt")), "{text:?}");
        assert!(text.iter().any(|t| t.contains("how far apart its planes are")), "{text:?}");
        let given = GivenFrame { spacing: true, ..GivenFrame::default() };
        let options = ReadOptions { given, ..ReadOptions::default() };
        let notes = load_image(at, &options, &mut Silent).unwrap().notes;
        assert!(!notes.iter().any(|n| matches!(n, ReadNote::NoPlaneSpacing { .. })), "{notes:?}");
    }
}

#[test]
fn slices_that_differ_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    slice(at, "s1.png", [3, 2], 0);
    slice(at, "s2.png", [4, 2], 0);
    let text = load(at).unwrap_err();
    assert!(
        text.contains("s2.png holds 4 × 2 uint16") && text.contains("as s1.png does"),
        "{text}"
    );
    fs::remove_file(at.join("s2.png")).unwrap();
    assert_eq!(load(at).unwrap().image.shape(), [3, 2]);
    slice(at, "s2.tif", [3, 2], 0);
    assert!(load(at).unwrap_err().contains("1 of TIFF, 1 of PNG"));
    fs::remove_file(at.join("s2.tif")).unwrap();
    fs::write(at.join("s3.png"), "no picture").unwrap();
    assert!(load(at).unwrap_err().starts_with("s3.png: "));
    // a memory limit that one slice keeps
    slice(at, "s3.png", [3, 2], 0);
    let options = ReadOptions { memory_limit: Some(13), ..ReadOptions::default() };
    let error = load_image(at, &options, &mut Silent).unwrap_err();
    assert!(
        matches!(error.reason, ReadReason::Slice { .. } | ReadReason::Memory { .. }),
        "{error}"
    );
}

#[test]
fn a_folder_of_volumes_or_of_nothing_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    assert_eq!(ImageFormat::of(at), Some(ImageFormat::DICOM));
    let frame = Frame::new([3, 2, 2]).unwrap();
    let volume = Image::new(frame, Samples::U8(vec![0; 12].into())).unwrap();
    write_image(&at.join("v1.tif"), &volume, &mut Silent).unwrap();
    assert_eq!(ImageFormat::of(at), Some(ImageFormat::SLICES));
    assert!(load(at).unwrap_err().contains("a volume of 2 planes"));
    // a folder of DICOM with a picture beside is one of DICOM
    fs::write(at.join("i1"), [&[0; 128][..], b"DICM"].concat()).unwrap();
    assert_eq!(ImageFormat::of(at), Some(ImageFormat::DICOM));
}
