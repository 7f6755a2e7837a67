//! Volumes as FreeSurfer writes them, and headers that lie.

use atomesh::image::{Samples, Units};
use atomesh::watch::Silent;

use super::super::{AnyImage, ReadOptions, StackOptions, load_bytes};
use super::*;

/// A file of 3 × 2 × 2 samples a frame, its axes those of coronal slices; `edit` changes the header.
fn file(frames: i32, edit: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = Vec::new();
    [1, 3, 2, 2, frames, 4, 0].iter().for_each(|n: &i32| bytes.extend(n.to_be_bytes()));
    bytes.extend(1i16.to_be_bytes());
    let axes = [-1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0];
    let reals = [&[0.5, 1.0, 2.0][..], &axes, &[10.0, 20.0, 30.0]].concat();
    reals.iter().for_each(|x: &f32| bytes.extend(x.to_be_bytes()));
    bytes.resize(HEADER, 0);
    (0..12 * frames as i16).for_each(|n| bytes.extend((n - 5).to_be_bytes()));
    edit(&mut bytes);
    bytes
}

fn load(bytes: &[u8], volume: Option<usize>) -> Result<LoadedImage, ReadReason> {
    let stack = StackOptions { volume, ..StackOptions::default() };
    load_bytes(bytes, FORMAT, &ReadOptions { stack, ..ReadOptions::default() }, &mut Silent)
}

#[test]
fn a_volume_lies_about_its_middle() {
    let loaded = load(&file(1, |_| {}), None).unwrap();
    let AnyImage::Volume(image) = &loaded.image else { panic!("flat") };
    assert_eq!(*image.samples(), Samples::I16((-5..7).collect::<Vec<i16>>().into()));
    // the sample (nx, ny, nz) / 2 is at the stated place
    assert_eq!(
        image.frame().lattice_to_world(Units::Samples, &[1.5, 1.0, 1.0]),
        [10.0, 20.0, 30.0]
    );
    assert_eq!(image.frame().lattice_to_world(Units::Samples, &[0.0; 3]), [10.75, 18.0, 31.0]);
    assert_eq!((loaded.units, loaded.notes), (vec!["mm".to_owned(); 3], vec![]));
}

#[test]
fn a_frame_that_is_not_valid_is_that_of_coronal_slices_with_a_note() {
    let loaded = load(&file(1, |bytes| bytes[28..30].fill(0)), None).unwrap();
    assert_eq!(
        (loaded.image.spacing(), loaded.image.origin()),
        (vec![1.0; 3], vec![1.5, -1.0, 1.0])
    );
    assert!(loaded.notes[0].is_warning(), "{:?}", loaded.notes);
}

#[test]
fn cosines_that_are_no_unit_vectors_do_not_count() {
    let odd = file(1, |bytes| bytes[42..46].copy_from_slice(&2f32.to_be_bytes()));
    let loaded = load(&odd, None).unwrap();
    assert_eq!((loaded.image.spacing(), loaded.notes.len()), (vec![0.5, 1.0, 2.0], 1));
    assert_eq!(loaded.image.origin(), load(&file(1, |_| {}), None).unwrap().image.origin());
    let given = GivenFrame { direction: true, ..GivenFrame::default() };
    let options = ReadOptions { given, ..ReadOptions::default() };
    let loaded = load_bytes(&odd, FORMAT, &options, &mut Silent).unwrap();
    assert_eq!((loaded.image.origin(), loaded.notes), (vec![9.25, 19.0, 28.0], vec![]));
}

#[test]
fn one_frame_of_several_is_chosen() {
    let bytes = file(3, |_| {});
    let text = load(&bytes, None).unwrap_err().to_string();
    assert!(text.contains("3 volumes of 3 × 2 × 2 samples"), "{text}");
    assert!(load(&bytes, Some(4)).unwrap_err().to_string().ends_with("not volume 4"));
    let second = load(&bytes, Some(2)).unwrap();
    assert_eq!(second.image.samples().get(0), 7.0);
    assert_eq!(second.notes, [ReadNote::Chosen { axis: "volume", number: 2, count: 3 }]);
}

#[test]
fn files_that_lie_or_end_early_are_refused() {
    let put = |k: usize, n: i32| {
        file(1, move |bytes| bytes[4 * k..4 * k + 4].copy_from_slice(&n.to_be_bytes()))
    };
    for (bytes, part) in [
        (put(0, 2), "version is 2"),
        (put(1, 0), "width is 0"),
        (put(3, -2), "depth is -2"),
        (put(4, 0), "nframes is 0"),
        (put(5, 2), "type is 2"),
        (put(1, i32::MAX), "cut short"),
    ] {
        let text = load(&bytes, None).unwrap_err().to_string();
        assert!(text.contains(part), "{text}");
    }
    let whole = file(1, |_| {});
    assert!((1..whole.len()).all(|length| load(&whole[..length], None).is_err()));
}
