//! Files that are damaged, absurd or misnamed end in an error that names the file and the reason,
//! never in a panic or a vast allocation.

use std::ops::ControlFlow;
use std::path::Path;

use atomesh::image::{Frame, Image, Samples};
use atomesh::watch::{Phase, Silent, Watch};
use atomesh_io::image::{
    AnyImage, ByteOrder, ImageFormat, RawLayout, ReadError, ReadNote, ReadOptions, ReadReason,
    SampleType, WriteReason, decode_image, load_image, read_image, write_image,
};
use proptest::prelude::*;

fn read(path: &Path) -> Result<AnyImage, ReadError> {
    read_image(path, &ReadOptions::default(), &mut Silent)
}

fn flat(nx: usize, ny: usize) -> Image<2> {
    let samples = (0..nx * ny).map(|k| (k * k % 251) as u8).collect();
    Image::new(Frame::new([nx, ny]).unwrap(), Samples::U8(samples)).unwrap()
}

/// The bytes of a small volume of 16-bit samples, or for PNG of a flat image, in that format.
fn bytes_of(name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    if name.ends_with(".png") {
        write_image(&path, &flat(9, 7), &mut Silent).unwrap();
    } else {
        let samples = Samples::I16((0..60).map(|k| k * 37 % 101).collect());
        let volume = Image::new(Frame::new([5, 4, 3]).unwrap(), samples).unwrap();
        write_image(&path, &volume, &mut Silent).unwrap();
    }
    std::fs::read(path).unwrap()
}

const WRITTEN: [(&str, ImageFormat); 7] = [
    ("v.npy", ImageFormat::NPY),
    ("v.nii", ImageFormat::NIFTI),
    ("v.nii.gz", ImageFormat::NIFTI_GZ),
    ("v.nrrd", ImageFormat::NRRD),
    ("v.vti", ImageFormat::VTI),
    ("v.tif", ImageFormat::TIFF),
    ("f.png", ImageFormat::PNG),
];

#[test]
fn unknown_endings_are_answered_with_the_known_ones() {
    for name in ["scan.xyz", "scan", "scan.gz", "scan.npy.gz", ".png"] {
        let error = read(Path::new(name)).unwrap_err();
        assert!(matches!(error.reason, ReadReason::UnknownExtension { .. }), "{error}");
        let text = error.to_string();
        assert!(text.starts_with(name), "{text}");
        assert!(ImageFormat::endings().all(|e| text.contains(e)), "{text}");
    }
    let error = write_image(Path::new("scan.jpg"), &flat(2, 2), &mut Silent).unwrap_err();
    assert!(error.to_string().contains(".jpg") && error.to_string().contains(".npy"), "{error}");
}

#[test]
fn every_listed_ending_is_known() {
    for ending in ImageFormat::endings() {
        let name = format!("Scan.of.1{}", ending.to_uppercase());
        assert!(ImageFormat::from_path(Path::new(&name)).is_some(), "{name}");
    }
}

#[test]
fn formats_that_hold_a_frame_say_so() {
    // a folder is one of DICOM slices
    let framed = [".nii", ".nii.gz", ".dcm", ".mha", ".mhd", ".nrrd", ".nhdr", ".vti"];
    let deep = [".sgy", ".segy", ".rsf"];
    for ending in framed.iter().chain(&deep).chain(&[".png", ".tif", ".npy", ".raw"]) {
        let name = format!("scan{ending}");
        let format = ImageFormat::of(Path::new(&name)).unwrap();
        let has_frame = framed.contains(ending) || deep.contains(ending);
        // a TIFF may state its resolution alone
        assert_eq!(format.has_frame(), has_frame || *ending == ".tif", "{ending}");
        assert_eq!(format.always_has_frame(), has_frame, "{ending}");
        assert_eq!(format.z_is_height(), framed.contains(ending), "{ending}");
    }
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(ImageFormat::of(folder.path()), Some(ImageFormat::DICOM));
}

#[test]
fn missing_files_folders_and_empty_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let missing = read(&folder.path().join("no.png")).unwrap_err().to_string();
    assert!(missing.contains("no.png") && missing.contains("cannot be read"), "{missing}");
    let inside = folder.path().join("folder.npy");
    std::fs::create_dir(&inside).unwrap();
    let error = read(&inside).unwrap_err();
    assert!(matches!(error.reason, ReadReason::Series(_)), "{error}");
    assert!(error.to_string().contains("folder.npy"), "{error}");
    for ending in ImageFormat::endings() {
        let empty = folder.path().join(format!("empty{ending}"));
        std::fs::write(&empty, "").unwrap();
        let error = read(&empty).unwrap_err();
        assert!(matches!(error.reason, ReadReason::Empty { .. }), "{error}");
    }
}

#[test]
fn files_under_a_wrong_name_are_refused_with_a_hint() {
    let folder = tempfile::tempdir().unwrap();
    for (written, _) in WRITTEN {
        let bytes = bytes_of(written);
        for ending in [
            ".png", ".jpg", ".pgm", ".tif", ".npy", ".nii", ".nii.gz", ".dcm", ".mha", ".nrrd",
            ".vti",
        ] {
            // whether NIfTI is gzipped its bytes tell
            let is_nifti = written.contains(".nii") && ending.starts_with(".nii");
            if written.ends_with(ending) || is_nifti {
                continue;
            }
            let path = folder.path().join(format!("misnamed{ending}"));
            std::fs::write(&path, &bytes).unwrap();
            let error = read(&path).unwrap_err();
            assert!(
                matches!(error.reason, ReadReason::Magic { .. } | ReadReason::Header { .. }),
                "{written} as {ending}: {error}"
            );
        }
    }
    for (written, ending) in [("v.nii.gz", "nii"), ("v.nii", "nii.gz")] {
        let path = folder.path().join(format!("misnamed.{ending}"));
        std::fs::write(&path, bytes_of(written)).unwrap();
        let loaded = load_image(&path, &ReadOptions::default(), &mut Silent).unwrap();
        assert_eq!(loaded.notes, [ReadNote::Gzip { is_packed: ending == "nii" }]);
    }
}

#[test]
fn raw_files_need_a_layout() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("v.raw");
    std::fs::write(&path, [0; 6]).unwrap();
    assert!(matches!(read(&path).unwrap_err().reason, ReadReason::NoRawLayout));
    let other = folder.path().join("v.dat");
    std::fs::write(&other, [0; 6]).unwrap();
    let layout = RawLayout {
        shape: vec![3, 2],
        sample_type: SampleType::U8,
        byte_order: ByteOrder::Little,
        offset: 0,
    };
    let image = read_image(
        &other,
        &ReadOptions { raw: Some(layout), ..ReadOptions::default() },
        &mut Silent,
    )
    .unwrap();
    assert_eq!(image.shape(), [3, 2]);
}

#[test]
fn cut_files_are_refused_wherever_they_end() {
    for (name, format) in WRITTEN {
        let bytes = bytes_of(name);
        let unneeded = if format == ImageFormat::PNG {
            16 // the last chunk, IEND, carries no samples: its 12 bytes may be missing in part
        } else if format == ImageFormat::VTI {
            b"\n</AppendedData>\n</VTKFile>\n".len() // nor do these tags
        } else {
            0
        };
        let least = bytes.len() - unneeded;
        for length in 1..least {
            let cut = decode_image(&bytes[..length], format, &ReadOptions::default(), &mut Silent);
            assert!(cut.is_err(), "{name} cut to {length} of {} bytes", bytes.len());
        }
    }
}

#[test]
fn nan_is_kept_and_counted() {
    let samples = Samples::F32(vec![1.0, f32::NAN, f32::INFINITY, -2.0].into());
    let image = Image::new(Frame::new([2, 2, 1]).unwrap(), samples).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for name in ["v.npy", "v.nii", "v.nii.gz", "v.nrrd"] {
        let path = folder.path().join(name);
        write_image(&path, &image, &mut Silent).unwrap();
        let read = read(&path).unwrap();
        let range = read.range();
        assert_eq!((range.min, range.max), (-2.0, 1.0), "{name}");
        assert_eq!((range.nan_count, range.infinite_count), (1, 1), "{name}");
        // where a file has a frame, a single slice is flat
        let shape = if name == "v.npy" { vec![2, 2, 1] } else { vec![2, 2] };
        assert_eq!(read.shape(), shape, "{name}");
    }
}

#[test]
fn rows_columns_and_constant_images_are_read() {
    let folder = tempfile::tempdir().unwrap();
    for (nx, ny) in [(1, 1), (1, 40), (40, 1)] {
        for name in ["f.npy", "f.nii", "f.nii.gz", "f.nrrd", "f.vti", "f.tif", "f.png"] {
            let path = folder.path().join(name);
            let samples = Samples::U8(vec![7; nx * ny].into());
            let image = Image::new(Frame::new([nx, ny]).unwrap(), samples.clone()).unwrap();
            write_image(&path, &image, &mut Silent).unwrap();
            let back = read(&path).unwrap();
            assert_eq!((back.shape(), back.samples()), (vec![nx, ny], &samples), "{name}");
        }
    }
    // far more samples than bytes, as constant images compress
    let wide =
        Image::new(Frame::new([2000, 1000]).unwrap(), Samples::U8(vec![7; 2_000_000].into()));
    for name in ["f.nii.gz", "f.nrrd", "f.vti", "f.png"] {
        let path = folder.path().join(name);
        write_image(&path, wide.as_ref().unwrap(), &mut Silent).unwrap();
        assert_eq!(read(&path).unwrap().shape(), [2000, 1000], "{name}");
    }
}

#[test]
fn places_and_types_that_cannot_be_written_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for ending in [".npy", ".nii", ".nii.gz", ".nrrd", ".vti", ".png", ".tif", ".raw"] {
        let nowhere = folder.path().join("none").join(format!("f{ending}"));
        let error = write_image(&nowhere, &flat(2, 2), &mut Silent).unwrap_err();
        assert!(error.to_string().contains("cannot be written"), "{error}");
        let taken = folder.path().join(format!("folder{ending}"));
        std::fs::create_dir(&taken).unwrap();
        let error = write_image(&taken, &flat(2, 2), &mut Silent).unwrap_err();
        assert!(error.to_string().contains("directory"), "{error}");
    }
    let path = folder.path().join("f.png");
    let floats = Image::new(Frame::new([1, 1]).unwrap(), Samples::F32(vec![-0.5].into())).unwrap();
    let error = write_image(&path, &floats, &mut Silent).unwrap_err();
    assert!(error.to_string().contains("float32") && error.to_string().contains(".npy"), "{error}");
    let volume =
        Image::new(Frame::new([1, 1, 2]).unwrap(), Samples::U8(vec![0; 2].into())).unwrap();
    let error = write_image(&path, &volume, &mut Silent).unwrap_err();
    assert!(matches!(error.reason, WriteReason::Shape { .. }), "{error}");
    let long =
        Image::new(Frame::new([40_000, 1]).unwrap(), Samples::U8(vec![0; 40_000].into())).unwrap();
    let error = write_image(&folder.path().join("f.nii"), &long, &mut Silent).unwrap_err();
    assert!(error.to_string().contains("32767"), "{error}");
    let fine = Frame::new([1, 1]).unwrap().with_spacing([1e-60, 1.0]).unwrap();
    let fine = Image::new(fine, Samples::U8(vec![0].into())).unwrap();
    let error = write_image(&folder.path().join("f.nii"), &fine, &mut Silent).unwrap_err();
    assert!(error.to_string().contains("spacing"), "{error}");
    let entries = std::fs::read_dir(folder.path()).unwrap();
    assert!(entries.flatten().all(|e| e.path().is_dir()), "a refused write left a file");
}

/// Ends the work when a share of it is done, and keeps the shares it was told.
struct StopAt {
    share: f64,
    shares: Vec<f64>,
}

impl Watch for StopAt {
    fn step(&mut self, phase: Phase, done: f64, _: Option<f64>) -> ControlFlow<()> {
        assert!(matches!(phase, Phase::Read | Phase::Write));
        self.shares.push(done);
        if done >= self.share { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn the_watch_ends_reading_and_writing_at_any_point() {
    let side = 1500;
    let mut state = 1u32; // noise, so that packed files are large too
    let samples = (0..side * side).map(|_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 16) as u16
    });
    let image = Image::new(Frame::new([side, side]).unwrap(), Samples::U16(samples.collect()));
    let image = image.unwrap();
    let folder = tempfile::tempdir().unwrap();
    for name in ["f.npy", "f.nii", "f.nii.gz", "f.nrrd", "f.vti", "f.tif", "f.png"] {
        let path = folder.path().join(name);
        write_image(&path, &image, &mut Silent).unwrap();
        for share in [0.0, 0.5] {
            let mut watch = StopAt { share, shares: Vec::new() };
            let error = read_image(&path, &ReadOptions::default(), &mut watch).unwrap_err();
            assert!(matches!(error.reason, ReadReason::Cancelled(_)), "{name}: {error}");
            assert!(watch.shares.is_sorted() && watch.shares.len() as f64 > 4.0 * share);
            if name == "f.png" && share > 0.0 {
                continue; // encoded in one go
            }
            std::fs::remove_file(&path).unwrap();
            let mut watch = StopAt { share, shares: Vec::new() };
            let error = write_image(&path, &image, &mut watch).unwrap_err();
            assert!(matches!(error.reason, WriteReason::Cancelled(_)), "{name}: {error}");
            assert!(!path.exists());
            assert!(watch.shares.is_sorted() && watch.shares.len() as f64 > 4.0 * share);
            write_image(&path, &image, &mut Silent).unwrap();
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Valid files with a few bytes changed, and cut or prolonged: an image or an error, no panic.
    /// What is read has as many samples as its shape says, which `Image` itself guarantees.
    #[test]
    fn damaged_files_end_in_an_image_or_an_error(
        which in 0..WRITTEN.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        length in any::<prop::sample::Index>(),
        cut in prop::bool::weighted(0.2),
    ) {
        let (name, format) = WRITTEN[which];
        let mut bytes = bytes_of(name);
        for (place, value) in changes {
            // headers are short and everything hangs on them: half of all changes go there
            let near = if value % 2 == 0 { bytes.len() } else { bytes.len().min(352) };
            let at = place.index(near);
            bytes[at] = value;
        }
        if cut {
            bytes.truncate(length.index(bytes.len()));
        }
        let _ = decode_image(&bytes, format, &ReadOptions::default(), &mut Silent);
    }

    /// Text that begins like an NPY header and goes on anyhow.
    #[test]
    fn any_npy_dictionary_ends_in_an_image_or_an_error(
        text in r"\{('(descr|shape|fortran_order)': ?('[<>|]?[a-z][1-8]'|\([0-9]{0,20}, ?[0-9]{0,3},?\)|True|False|.{0,5}),? ?){0,4}\}?",
    ) {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes.extend([0; 64]);
        let _ = decode_image(&bytes, ImageFormat::NPY, &ReadOptions::default(), &mut Silent);
    }
}
