//! Real files, where the environment variable `ATOMESH_DATA` names their folder.

use std::path::PathBuf;

use atomesh::watch::Silent;
use atomesh_io::image::{AnyImage, ReadNote, ReadOptions, load_image, read_image};

/// The folder, if it is given.
fn folder() -> Option<PathBuf> {
    std::env::var_os("ATOMESH_DATA").map(PathBuf::from)
}

/// The image of that name, if the folder is given.
fn real(name: &str) -> Option<AnyImage> {
    Some(read_image(&folder()?.join(name), &ReadOptions::default(), &mut Silent).unwrap())
}

#[test]
fn the_brain_template_has_its_frame() {
    let Some(image) = real("mni152-t1.nii.gz") else { return };
    assert_eq!(image.shape(), [197, 233, 189]);
    assert_eq!(image.type_name(), "uint8");
    assert_eq!(image.origin(), [-98.0, -134.0, -72.0]);
    assert_eq!(image.spacing(), [1.0; 3]);
    assert_eq!(image.direction(), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
}

#[test]
fn the_fault_map_is_flat_bytes() {
    let Some(image) = real("hale2001-fig1-faults.png") else { return };
    assert_eq!((image.shape(), image.type_name()), (vec![256, 256], "uint8"));
}

#[test]
fn the_seismic_section_has_x_fastest() {
    let Some(image) = real("f3-amplitude.npy") else { return };
    assert_eq!((image.shape(), image.type_name()), (vec![440, 222], "float32"));
    assert_eq!(image.range().nan_count, 0);
}

#[test]
fn the_bp_2004_velocities_are_12_and_a_half_by_6_and_a_quarter_metres_apart() {
    let name = "vel_z6.25m_x12.5m_exact.segy"; // in SeismicMesh's source distribution
    let Some(path) = folder().map(|folder| folder.join(name)).filter(|path| path.exists()) else {
        return;
    };
    let loaded = load_image(&path, &ReadOptions::default(), &mut Silent).unwrap();
    assert_eq!(loaded.image.shape(), [5395, 1911]);
    assert_eq!(loaded.image.spacing(), [12.5, 6.25]);
    assert_eq!(loaded.image.origin(), [12.5, 0.0]);
    let range = loaded.image.range();
    // as NumPy finds it in the file, beside its own decoding of IBM's numbers
    assert!((range.min, range.max) == (1_429.000_244_140_625, 4790.0) && range.nan_count == 0);
    assert!(loaded.notes.contains(&ReadNote::Feet)); // says the header, though the name says metres
}
