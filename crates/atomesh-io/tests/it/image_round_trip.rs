//! What is written is read back: samples, and the frame where the format has room for one.

use std::path::Path;

use atomesh::image::{Frame, Image, Samples};
use atomesh::watch::Silent;
use atomesh_io::image::{
    AnyImage, ByteOrder, RawLayout, ReadOptions, SampleType, read_image, write_image,
};
use proptest::prelude::*;

/// Spacing, origin and axes all different from each other and from the defaults: x points along
/// world −y, y along world z, z along world x (a permuted and mirrored direction). The numbers are
/// exact in single precision.
fn asymmetric() -> Frame<3> {
    Frame::new([4, 3, 2])
        .unwrap()
        .with_spacing([0.5, 2.25, 4.0])
        .unwrap()
        .with_origin([-98.5, 134.25, 7.0])
        .unwrap()
        .with_direction([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        .unwrap()
}

fn read_back<const D: usize>(image: &Image<D>, name: &str) -> AnyImage {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    write_image(&path, image, &mut Silent).unwrap();
    read_image(&path, &ReadOptions::default(), &mut Silent).unwrap()
}

fn every_type() -> [Samples; 8] {
    [
        Samples::U8((0..24).collect()),
        Samples::I8((-12..12).collect()),
        Samples::U16((0..24).map(|k| k * 2000).collect()),
        Samples::I16((-12..12).map(|k| k * 2000).collect()),
        Samples::U32((0..24).map(|k| u32::MAX - k).collect()),
        Samples::I32((0..24).map(|k| i32::MIN + k).collect()),
        Samples::F32((0..24).map(|k| k as f32 / 7.0).collect()),
        Samples::F64((0..24).map(|k| f64::from(k) / 7.0).collect()),
    ]
}

#[test]
fn nifti_keeps_an_asymmetric_frame_and_every_type() {
    for frame in [asymmetric(), mirrored_back(asymmetric())] {
        for samples in every_type() {
            for name in ["volume.nii", "volume.nii.gz", "VOLUME.NII.GZ"] {
                let image = Image::new(frame, samples.clone()).unwrap();
                let AnyImage::Volume(back) = read_back(&image, name) else { panic!("flat") };
                assert_eq!(back.frame(), &frame);
                assert_eq!(back.samples(), &samples);
            }
        }
    }
}

/// A frame whose numbers have no short form, turned about all axes.
fn oblique() -> Frame<3> {
    let ([s, c], [t, d]) = [0.3f64, 1.1].map(|a| [a.sin(), a.cos()]).into();
    let direction = [[c * d, -s, c * t], [s * d, c, s * t], [-t, 0.0, d]];
    let frame = Frame::new([4, 3, 2]).unwrap().with_direction(direction).unwrap();
    frame
        .with_spacing([0.1, 1.0 / 3.0, 4e-3])
        .unwrap()
        .with_origin([-98.1, 1e6 / 7.0, 0.7])
        .unwrap()
}

#[test]
fn nrrd_and_vti_keep_any_frame_and_every_type() {
    for frame in [asymmetric(), mirrored_back(asymmetric()), oblique(), mirrored_back(oblique())] {
        for samples in every_type() {
            for name in ["v.nrrd", "v.vti"] {
                let image = Image::new(frame, samples.clone()).unwrap();
                let AnyImage::Volume(back) = read_back(&image, name) else { panic!("flat") };
                assert_eq!(back.samples(), &samples, "{name}");
                let back = back.frame();
                assert_eq!(
                    (back.shape(), back.origin()),
                    (frame.shape(), frame.origin()),
                    "{name}"
                );
                // a direction times a spacing and their quotient are rounded, three times at most
                for c in 0..3 {
                    let error = (back.spacing()[c] / frame.spacing()[c] - 1.0).abs();
                    assert!(error <= 4.0 * f64::EPSILON, "{name} {error:e}");
                    for r in 0..3 {
                        let error = (back.direction()[r][c] - frame.direction()[r][c]).abs();
                        assert!(error <= 4.0 * f64::EPSILON, "{name} {error:e}");
                    }
                }
            }
        }
    }
}

#[test]
fn frames_along_the_axes_are_exact_in_nrrd_and_vti() {
    let frame = Frame::new([4, 3, 2]).unwrap().with_spacing([0.1, 1.0 / 3.0, 12.5]).unwrap();
    let frame = frame.with_origin([0.1, -0.2, 1e-7]).unwrap();
    let image = Image::new(frame, Samples::U8((0..24).collect())).unwrap();
    for name in ["v.nrrd", "v.vti"] {
        let AnyImage::Volume(back) = read_back(&image, name) else { panic!("flat") };
        assert_eq!(back.frame(), &frame, "{name}");
    }
}

/// The frame with its z axis turned round: of the other handedness.
fn mirrored_back(frame: Frame<3>) -> Frame<3> {
    let mut direction = frame.direction();
    direction.iter_mut().for_each(|row| row[2] = -row[2]);
    frame.with_direction(direction).unwrap()
}

#[test]
fn qform_alone_gives_the_same_frame() {
    for frame in [asymmetric(), mirrored_back(asymmetric())] {
        let image = Image::new(frame, Samples::U8((0..24).collect())).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("volume.nii");
        write_image(&path, &image, &mut Silent).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        bytes[254..256].fill(0); // sform_code
        bytes[280..328].fill(0xff); // srow_x, y, z: NaN, which nobody may read now
        std::fs::write(&path, bytes).unwrap();
        let back = read_image(&path, &ReadOptions::default(), &mut Silent).unwrap();
        let AnyImage::Volume(back) = back else { panic!("flat") };
        assert_eq!(back.frame().origin(), frame.origin());
        assert_eq!(back.frame().spacing(), frame.spacing());
        for (row, expected) in back.frame().direction().iter().zip(frame.direction()) {
            for (x, e) in row.iter().zip(expected) {
                // quaternions are stored in single precision: 2⁻²⁴ of ½, times 2 for the square
                assert!((x - e).abs() < 1e-7, "{row:?} {expected:?}");
            }
        }
    }
}

#[test]
fn a_flat_frame_survives_wherever_there_is_room_for_it() {
    let frame = Frame::new([6, 4])
        .unwrap()
        .with_spacing([12.5, 4.0])
        .unwrap()
        .with_origin([1000.0, -20.0])
        .unwrap()
        .with_direction([[0.0, 1.0], [1.0, 0.0]])
        .unwrap();
    let image = Image::new(frame, Samples::F32((0..24).map(|k| k as f32).collect())).unwrap();
    for name in ["flat.nii.gz", "flat.nrrd", "flat.vti"] {
        let AnyImage::Flat(back) = read_back(&image, name) else { panic!("volume") };
        assert_eq!(back.frame(), &frame, "{name}");
        assert_eq!(back.samples(), image.samples(), "{name}");
    }
}

#[test]
fn frameless_formats_keep_the_samples_alone() {
    let volume = Image::new(asymmetric(), Samples::F32((0..24).map(|k| k as f32).collect()));
    let flat = Image::new(Frame::new([6, 4]).unwrap(), Samples::U16((0..24).collect())).unwrap();
    for (back, shape, samples) in [
        (
            read_back(volume.as_ref().unwrap(), "v.npy"),
            vec![4, 3, 2],
            volume.as_ref().unwrap().samples(),
        ),
        (
            read_back(volume.as_ref().unwrap(), "v.tif"),
            vec![4, 3, 2],
            volume.as_ref().unwrap().samples(),
        ),
        (read_back(&flat, "f.npy"), vec![6, 4], flat.samples()),
        (read_back(&flat, "f.tiff"), vec![6, 4], flat.samples()),
        (read_back(&flat, "f.png"), vec![6, 4], flat.samples()),
    ] {
        assert_eq!(back.shape(), shape);
        assert_eq!(back.samples(), samples);
        assert!(back.spacing().iter().all(|&s| s == 1.0));
        assert!(back.origin().iter().all(|&s| s == 0.0));
    }
}

#[test]
fn the_same_image_gives_the_same_bytes() {
    let image = Image::new(asymmetric(), Samples::I16((0..24).collect())).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for name in ["v.nii.gz", "v.nii", "v.npy", "v.nrrd", "v.vti", "v.tif", "v.raw"] {
        let (a, b) = (folder.path().join(format!("a-{name}")), folder.path().join(name));
        write_image(&a, &image, &mut Silent).unwrap();
        write_image(&b, &image, &mut Silent).unwrap();
        assert_eq!(std::fs::read(a).unwrap(), std::fs::read(b).unwrap(), "{name}");
    }
}

#[test]
fn the_nifti_crate_reads_what_is_written() {
    use nifti::{NiftiObject, NiftiVolume, RandomAccessNiftiVolume, ReaderOptions};
    let image = Image::new(asymmetric(), Samples::I16((0..24).map(|k| 3 * k - 20).collect()));
    let image = image.unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("v.nii.gz");
    write_image(&path, &image, &mut Silent).unwrap();
    let object = ReaderOptions::new().read_file(&path).unwrap();
    assert_eq!(object.volume().dim(), [4, 3, 2]);
    assert_eq!(object.header().srow_x, [0.0, 0.0, 4.0, -98.5]);
    assert_eq!(object.header().srow_y, [-0.5, 0.0, 0.0, 134.25]);
    for (k, j, i) in (0..24).map(|n| (n / 12, n / 4 % 3, n % 4)) {
        let value = object.volume().get_i64(&[i, j, k]).unwrap();
        let index = usize::from(i) + 4 * (usize::from(j) + 3 * usize::from(k));
        assert_eq!(value as f64, image.samples().get(index));
    }
}

fn write_and_read(path: &Path, image: &Image<3>, raw: Option<RawLayout>) -> AnyImage {
    write_image(path, image, &mut Silent).unwrap();
    read_image(path, &ReadOptions { raw, ..ReadOptions::default() }, &mut Silent).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Any bits at all, so NaN too, which is why bits are compared. From eight samples along y and z on, three or four along x
    /// of an NPY array are colours.
    #[test]
    fn npy_and_raw_keep_every_bit(
        nx in 1usize..9, ny in 1usize..8, nz in 1usize..9,
        bits in prop::collection::vec(any::<u64>(), 512),
    ) {
        let count = nx * ny * nz;
        let values: Vec<f64> = bits[..count].iter().map(|&b| f64::from_bits(b)).collect();
        let image = Image::new(Frame::new([nx, ny, nz]).unwrap(), Samples::F64(values.into())).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let layout = RawLayout {
            shape: vec![nx, ny, nz],
            sample_type: SampleType::F64,
            byte_order: ByteOrder::Little,
            offset: 0,
        };
        for back in [
            write_and_read(&folder.path().join("v.npy"), &image, None),
            write_and_read(&folder.path().join("v.raw"), &image, Some(layout)),
        ] {
            prop_assert_eq!(back.shape(), [nx, ny, nz]);
            let Samples::F64(read) = back.samples() else { panic!("{}", back.type_name()) };
            prop_assert!(read.iter().zip(&bits).all(|(x, &b)| x.to_bits() == b));
        }
    }
}
