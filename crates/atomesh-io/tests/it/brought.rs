//! Files as other programs write them, which lie beside the real data: read where `ATOMESH_DATA` names its folder.

use std::path::PathBuf;

use atomesh::watch::Silent;
use atomesh_io::image::{
    Duplicates, GivenFrame, LoadedImage, Meaning, ReadNote, ReadOptions, SegyOptions, StackOptions,
    load_image,
};

/// The folder of cases; none where there is none.
fn cases() -> Option<PathBuf> {
    let cases = PathBuf::from(std::env::var_os("ATOMESH_DATA")?).join("../cases");
    cases.is_dir().then_some(cases)
}

fn load(name: &str, options: &ReadOptions) -> Result<LoadedImage, String> {
    let path = cases().expect("looked for before").join(name);
    load_image(&path, options, &mut Silent).map_err(|error| error.reason.to_string())
}

fn plain(name: &str) -> LoadedImage {
    load(name, &ReadOptions::default()).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn said(loaded: &LoadedImage) -> String {
    loaded.notes.iter().map(ReadNote::to_string).collect::<Vec<_>>().join("\n")
}

/// Checks shape and range.
fn check(name: &str, loaded: &LoadedImage, shape: &[usize], [min, max]: [f64; 2]) {
    let range = loaded.image.range();
    println!("{name}: {:?} {range:?} {:?}\n{}", loaded.image.spacing(), loaded.units, said(loaded));
    assert_eq!(loaded.image.shape(), shape, "{name}");
    assert_eq!((range.min, range.max), (min, max), "{name}");
}

#[test]
fn scans_have_the_shapes_and_ranges_that_their_writers_gave_them() {
    if cases().is_none() {
        return;
    }
    let u2 = [0.0, 59_999.0];
    let volume = [40, 33, 7];
    for (name, shape, range) in [
        ("07-folder-of-slices/png", &volume[..], u2),
        ("07-folder-of-slices/tif", &volume, u2),
        ("12-numpy/1zyx.npy", &[7, 6, 5], [-499.0, 498.0]),
        ("12-numpy/image.npz", &[7, 6, 5], [-499.0, 498.0]),
        ("13-nifti-kin/nifti2.nii", &[9, 8, 7], [-495.0, 1494.0]),
        ("13-nifti-kin/pair.hdr", &[9, 8, 7], [-495.0, 1494.0]),
        ("13-nifti-kin/pair.img", &[9, 8, 7], [-495.0, 1494.0]),
        ("16-tiff-refused/c_zstd_u2.tif", &volume, u2),
    ] {
        let name = format!("scans/{name}");
        let loaded = plain(&name);
        let range_found = loaded.image.range();
        println!("{name} {range_found:?}\n{}", said(&loaded));
        assert_eq!(loaded.image.shape(), shape, "{name}");
        assert_eq!((range_found.min, range_found.max), (range[0], range[1]), "{name}");
    }
    for name in [
        "13-nifti-kin/gz-zero-padded.nii.gz",
        "13-nifti-kin/not-gzipped.nii.gz",
        "13-nifti-kin/micron.nii",
        "13-nifti-kin/rgb24.nii",
        "13-nifti-kin/one-slice-z.nii",
        "13-nifti-kin/one-slice.nrrd",
        "12-numpy/rgb-h-w-3.npy",
        "08-shear/sform-all-zero.nii",
        "08-shear/sform-shear-2e-4.nii.gz",
        "16-tiff-refused/bool.tif",
        "16-tiff-refused/g4.tif",
        "16-tiff-refused/ga.tif",
        "16-tiff-refused/mixed.tif",
        "16-tiff-refused/pal.tif",
        "16-tiff-refused/pals.tif",
        "16-tiff-refused/rgbp.tif",
        "16-tiff-refused/tile3.tif",
        "17-nrrd-vti-mha/anatomical-orientation.mha",
        "17-nrrd-vti-mha/bzip2.nrrd",
        "17-nrrd-vti-mha/hex.nrrd",
        "17-nrrd-vti-mha/lz4.vti",
        "17-nrrd-vti-mha/lzma.vti",
        "17-nrrd-vti-mha/one-slice-oblique.vti",
        "17-nrrd-vti-mha/structured-points.vtk",
    ] {
        let name = format!("scans/{name}");
        match load(&name, &ReadOptions::default()) {
            Ok(loaded) => println!(
                "{name} {:?} {:?} {:?} {:?}\n{}",
                loaded.image.shape(),
                loaded.image.spacing(),
                loaded.image.range(),
                loaded.units,
                said(&loaded)
            ),
            Err(error) => panic!("{name}: {error}"),
        }
    }
}

#[test]
fn one_of_several_is_chosen_and_none_is_refused() {
    if cases().is_none() {
        return;
    }
    let none = ReadOptions::default();
    let array = |name: &str| ReadOptions { array: Some(name.into()), ..ReadOptions::default() };
    let refused = |name: &str, part: &str| {
        let error = load(name, &none).err().unwrap_or_default();
        assert!(error.contains(part), "{name}: {error:?} lacks {part}");
    };
    refused("scans/12-numpy/image-and-label.npz", "image");
    refused("scans/13-nifti-kin/4d-2-volumes.nii", "2 volumes");
    refused("scans/17-nrrd-vti-mha/overlapping.seg.nrrd", "overlap");
    refused("scans/08-shear/sform-shear-17deg.nii", "degrees");
    let image = load("scans/12-numpy/image-and-label.npz", &array("image")).unwrap();
    check("npz", &image, &[7, 6, 5], [-499.0, 498.0]);
    let stack = StackOptions { volume: Some(2), ..StackOptions::default() };
    let second = ReadOptions { stack, ..ReadOptions::default() };
    let first = StackOptions { volume: Some(1), ..StackOptions::default() };
    let first = ReadOptions { stack: first, ..ReadOptions::default() };
    for (name, shape) in [("4d-2-volumes.nii", [9, 8, 7]), ("test.mgz", [3, 4, 5])] {
        let of = |options| load(&format!("scans/13-nifti-kin/{name}"), options).unwrap();
        assert_eq!(of(&first).image.shape(), shape);
        assert_ne!(of(&first).image.samples(), of(&second).image.samples());
    }
    for segment in ["1", "2"] {
        let options = ReadOptions { segment: Some(segment.into()), ..ReadOptions::default() };
        let loaded = load("scans/17-nrrd-vti-mha/overlapping.seg.nrrd", &options).unwrap();
        check("segment", &loaded, &[9, 8, 7], [0.0, 1.0]);
        let count = (0..504).filter(|&k| loaded.image.samples().get(k) == 1.0).count();
        println!("{count} inside");
    }
    let given = GivenFrame { direction: true, ..GivenFrame::default() };
    let given = ReadOptions { given, ..ReadOptions::default() };
    assert!(load("scans/08-shear/sform-shear-17deg.nii", &given).is_ok());
    let labels = ReadOptions { meaning: Meaning::Labels, ..ReadOptions::default() };
    let palette = load("scans/16-tiff-refused/pal.tif", &labels).unwrap();
    println!("{:?} {}", palette.image.range(), said(&palette));
}

#[test]
fn seismic_files_of_every_revision_are_the_same_cube() {
    if cases().is_none() {
        return;
    }
    let folder = "seismic-and-labels";
    let of = |name: &str, segy: SegyOptions| {
        load(&format!("{folder}/{name}"), &ReadOptions { segy, ..ReadOptions::default() })
    };
    let none = SegyOptions::default();
    let extra = of("rev21_extra_header.sgy", none).unwrap();
    check("rev 2.1", &extra, &[16, 12, 20], [100_300.0, extra.image.range().max]);
    for duplicates in [Duplicates::First, Duplicates::Last] {
        let options = SegyOptions { duplicates: Some(duplicates), ..none };
        let cube = of("duplicate_trace.sgy", options).unwrap();
        println!("{:?} {}", cube.image.range(), said(&cube));
        assert_eq!(cube.image.shape(), [16, 12, 20]);
        assert_eq!(cube.image.spacing(), extra.image.spacing());
    }
    assert!(of("duplicate_trace.sgy", none).unwrap_err().contains("inline 101, crossline 303"));
    let error = of("truncated.sgy", none).unwrap_err();
    assert!(error.contains("191 traces are whole"), "{error}");
    let cut = of("truncated.sgy", SegyOptions { truncated: true, ..none }).unwrap();
    assert_eq!(cut.image.shape(), [16, 12, 20]);
    assert!(said(&cut).contains("191") && said(&cut).contains("1 of 192 traces are missing"));
}
