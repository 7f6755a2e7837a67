//! Real files, where the environment variable `ATOMESH_DATA` names their folder.

use std::path::PathBuf;

use atomesh::watch::Silent;
use atomesh_io::image::{AnyImage, ReadOptions, read_image};

/// The image of that name, if the folder is given.
fn real(name: &str) -> Option<AnyImage> {
    let folder = PathBuf::from(std::env::var_os("ATOMESH_DATA")?);
    Some(read_image(&folder.join(name), &ReadOptions::default(), &mut Silent).unwrap())
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
