//! Masks, labels and fields lie where their own frames say.

use std::path::{Path, PathBuf};

use atomesh::image::{Frame, Image, Samples, Units};
use atomesh::watch::Silent;
use atomesh_io::image::{AnyImage, write_image};
use atomesh_job::mesh::{MeshImages, ShownImage};
use atomesh_job::options::{InputOptions, RunConfig};
use atomesh_job::{Dimension, ErrorKind, JobError, Session};

/// The ball, as labels: 1 inside of it.
const CENTRE: [f64; 3] = [-3.0, 2.0, 1.0];

fn ball(frame: Frame<3>) -> Image<3> {
    let [nx, ny, _] = frame.shape();
    let label = |index: usize| {
        let sample = [index % nx, index / nx % ny, index / (nx * ny)].map(|i| i as f64);
        let place = frame.lattice_to_world(Units::Samples, &sample);
        let squared: f64 = (0..3).map(|k| (place[k] - CENTRE[k]).powi(2)).sum();
        u8::from(squared < 16.0)
    };
    let samples = (0..frame.sample_count()).map(label).collect();
    Image::new(frame, Samples::U8(samples)).unwrap()
}

fn frame(shape: [usize; 3], origin: [f64; 3]) -> Frame<3> {
    Frame::new(shape).unwrap().with_origin(origin).unwrap()
}

struct Case {
    folder: tempfile::TempDir,
}

impl Case {
    fn new() -> Self {
        let case = Self { folder: tempfile::tempdir().unwrap() };
        case.write("image.nrrd", &ball(frame([16, 14, 12], [-8.0, -6.0, -5.0])));
        case
    }

    fn write(&self, name: &str, image: &Image<3>) -> PathBuf {
        let path = self.folder.path().join(name);
        write_image(&path, image, &mut Silent).unwrap();
        path
    }

    /// The labels as the mesh gets them, and what was said.
    fn read(
        &self,
        labels: &Path,
        change: impl Fn(&mut RunConfig),
    ) -> Result<(Image<3>, Vec<String>), JobError> {
        let image = self.folder.path().join("image.nrrd");
        let input = InputOptions {
            image: Some(image.clone()),
            labels: Some(labels.into()),
            ..Default::default()
        };
        let mut run = RunConfig { input, ..Default::default() };
        run.lattice.size = Some("3".parse().unwrap());
        change(&mut run);
        let mut watch = Silent;
        let mut session = Session::new(&mut watch);
        let image = atomesh_job::mesh::read_shown(&run, &mut session)?;
        let world = image.world();
        let AnyImage::Volume(image) = image.image else { panic!() };
        let image = ShownImage { image, world };
        let images = MeshImages::read_fields(&run, image, &Dimension::space(), &mut session)?;
        let notes = session.notes().iter().map(ToString::to_string).collect();
        Ok((images.labels.unwrap(), notes))
    }
}

#[test]
fn labels_stored_in_another_order_are_put_in_the_images() {
    let case = Case::new();
    let expected = ball(frame([16, 14, 12], [-8.0, -6.0, -5.0]));
    let turned = Frame::new([12, 16, 14]).unwrap();
    // x runs along −z, y along −x, z along y
    let turned = turned.with_direction([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]);
    let turned = turned.unwrap().with_origin([7.0, -6.0, 6.0]).unwrap();
    let path = case.write("labels.nrrd", &ball(turned));
    let (labels, notes) = case.read(&path, |_| {}).unwrap();
    assert_eq!(labels.samples(), expected.samples());
    assert!(
        matches!(&notes[..], [note] if note.contains("run along -y,z,-x of the file's")),
        "{notes:?}"
    );
    let path = case.write("same.nrrd", &expected);
    let (labels, notes) = case.read(&path, |_| {}).unwrap();
    assert_eq!((labels.samples(), notes.len()), (expected.samples(), 0));
    // options that move the image move what lies with it, and leave what lies where they put it
    let moved = |run: &mut RunConfig| run.frame.origin = Some("100,0,0".parse().unwrap());
    let there = Image::new(frame([16, 14, 12], [100.0, 0.0, 0.0]), expected.samples().clone());
    for labels in [path, case.write("there.nrrd", &there.unwrap())] {
        let (labels, notes) = case.read(&labels, moved).unwrap();
        assert_eq!(
            (labels.samples(), labels.frame().origin()),
            (expected.samples(), [100.0, 0.0, 0.0])
        );
        assert!(notes.is_empty(), "{notes:?}");
    }
}

#[test]
fn labels_on_another_grid_are_taken_at_the_same_places() {
    let case = Case::new();
    let fine = frame([40, 40, 40], [-10.0, -8.0, -6.0]).with_spacing([0.5; 3]).unwrap();
    let path = case.write("fine.nrrd", &ball(fine));
    let (labels, notes) = case.read(&path, |_| {}).unwrap();
    // every sample of the image is one of the fine grid's
    assert_eq!(labels.samples(), ball(*labels.frame()).samples());
    assert!(matches!(&notes[..], [note] if note.contains("nearest")), "{notes:?}");
    let part = frame([9, 14, 12], [-8.0, -6.0, -5.0]);
    let path = case.write("part.nrrd", &ball(part));
    let (labels, notes) = case.read(&path, |_| {}).unwrap();
    assert_eq!(labels.samples(), ball(*labels.frame()).samples()); // the ball ends at x = 0
    assert!(
        notes[0].contains("1176 of 2688 samples lie outside of the file and are 0"),
        "{notes:?}"
    );
}

#[test]
fn labels_elsewhere_are_refused_with_both_boxes() {
    let case = Case::new();
    let path = case.write("far.nrrd", &ball(frame([16, 14, 12], [50.0, 0.0, 0.0])));
    let error = case.read(&path, |_| {}).unwrap_err();
    let text = error.to_string();
    assert_eq!(error.kind(), ErrorKind::Content);
    assert!(text.contains("50..65,0..13,0..11") && text.contains("-8..7,-6..7,-5..6"), "{text}");
}

#[test]
fn labels_without_a_frame_are_taken_by_their_shape() {
    let case = Case::new();
    let expected = ball(frame([16, 14, 12], [-8.0, -6.0, -5.0]));
    let path = case.write("labels.npy", &expected);
    let (labels, notes) = case.read(&path, |_| {}).unwrap();
    assert_eq!(labels.samples(), expected.samples());
    assert!(matches!(&notes[..], [note] if note.contains("one by one")), "{notes:?}");
    let path = case.write("short.npy", &ball(frame([16, 14, 11], [0.0; 3])));
    let text = case.read(&path, |_| {}).unwrap_err().to_string();
    assert!(text.contains("[16, 14, 11]") && text.contains("[16, 14, 12]"), "{text}");
}

/// A NIfTI file of the image with a unit in its header: 2 is mm, 3 is um.
fn with_unit(path: &Path, code: u8) {
    let mut bytes = std::fs::read(path).unwrap();
    bytes[123] = code;
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn labels_in_another_unit_lie_in_the_same_place() {
    let case = Case::new();
    let own = frame([16, 14, 12], [-8.0, -6.0, -5.0]);
    let expected = ball(own);
    let image = case.write("image.nii", &expected);
    with_unit(&image, 2);
    let micrometres = own.with_spacing([1000.0; 3]).unwrap();
    let micrometres = micrometres.with_origin([-8000.0, -6000.0, -5000.0]).unwrap();
    let labels = Image::new(micrometres, expected.samples().clone()).unwrap();
    let path = case.write("labels.nii", &labels);
    with_unit(&path, 3);
    let take = |run: &mut RunConfig| run.input.image = Some(image.clone());
    let (labels, notes) = case.read(&path, take).unwrap();
    assert_eq!(labels.samples(), expected.samples());
    let note = "note: FILE: coordinates are turned from um to mm"
        .replace("FILE", &path.display().to_string());
    assert_eq!(notes, [note]);
}

#[test]
fn labels_a_rounding_off_are_rounded_and_the_note_says_how_far() {
    let case = Case::new();
    let whole = ball(frame([16, 14, 12], [-8.0, -6.0, -5.0]));
    let off = |by: f32| {
        let samples = whole.samples().to_f32().iter().map(|v| v * (1.0 - by)).collect();
        case.write("labels.nrrd", &Image::new(*whole.frame(), Samples::F32(samples)).unwrap())
    };
    let (labels, notes) = case.read(&off(2e-4), |_| {}).unwrap();
    assert_eq!(labels.samples().to_f32(), whole.samples().to_f32());
    assert!(matches!(&notes[..], [note] if note.contains("up to 2.0e-4 from whole")), "{notes:?}");
    let (labels, notes) = case.read(&off(2e-3), |_| {}).unwrap();
    assert_ne!(labels.samples().to_f32(), whole.samples().to_f32());
    assert!(notes.is_empty(), "{notes:?}");
}

#[test]
fn nan_that_a_value_replaces_is_noted_in_labels_too() {
    let case = Case::new();
    let (frame, samples) = ball(frame([16, 14, 12], [-8.0, -6.0, -5.0])).into_parts();
    let mut labels = samples.to_f32();
    labels[5..8].fill(f32::NAN);
    let path = case.write("holes.nrrd", &Image::new(frame, Samples::F32(labels.into())).unwrap());
    let (labels, notes) = case.read(&path, |run| run.frame.fill = Some(7.0)).unwrap();
    assert_eq!(labels.samples().get(6), 7.0);
    assert!(notes[0].ends_with("3 samples are NaN; they become 7"), "{notes:?}");
    assert!(case.read(&path, |_| {}).is_err());
}
