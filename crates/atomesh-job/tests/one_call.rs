//! What a user of the library does: an image in memory goes in, an answer comes out, and a watch listens.

use std::ops::ControlFlow;

use atomesh::image::{Frame, Image, Samples};
use atomesh::watch::{Phase, Watch};
use atomesh_job::flow::{FlowMeshCells, FlowOptions, flow};
use atomesh_job::mesh::{MeshImages, mesh};
use atomesh_job::options::{LatticeOptions, RunConfig};
use atomesh_job::{Dimension, ErrorKind, Session};

/// Collects phases; ends the work as soon as one of them begins.
#[derive(Default)]
struct Phases {
    seen: Vec<Phase>,
    last: Option<Phase>,
}

impl Watch for Phases {
    fn step(&mut self, phase: Phase, _: f64, _: Option<f64>) -> ControlFlow<()> {
        if self.seen.last() != Some(&phase) {
            self.seen.push(phase);
        }
        if self.last == Some(phase) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// A bright image with a dark row from edge to edge.
fn image() -> Image<2> {
    let mut grey = vec![200u8; 48 * 40];
    grey[20 * 48..21 * 48].fill(10);
    let frame = Frame::new([48, 40]).unwrap().with_spacing([0.5, 0.5]).unwrap();
    Image::new(frame, Samples::U8(grey)).unwrap()
}

fn run(size: &str) -> RunConfig {
    let lattice = LatticeOptions { size: Some(size.parse().unwrap()), ..Default::default() };
    RunConfig { lattice, ..Default::default() }
}

fn across(multiplier: f64) -> FlowOptions {
    FlowOptions {
        source: vec!["12,3:rate=2".parse().unwrap()],
        sink: vec!["12,17".parse().unwrap()],
        multiplier,
        order: Some(1),
        ..Default::default()
    }
}

#[test]
fn an_image_in_memory_becomes_a_mesh_and_an_answer_in_one_call() {
    let mut watch = Phases::default();
    let mut session = Session::new(&mut watch);
    let plane = Dimension::plane();
    let answer =
        flow(&run("3"), &across(0.1), MeshImages::new(image()), &plane, &mut session).unwrap();
    assert!(session.notes().is_empty(), "{:?}", session.notes());
    let timed: Vec<Phase> = session.times().iter().map(|(phase, _)| *phase).collect();
    assert!(timed.contains(&Phase::Optimize), "{timed:?}");

    let FlowMeshCells::Simplices { mesh, tags } = &answer.mesh.cells else { panic!("triangles") };
    assert_eq!(mesh.validate(), Ok(()));
    assert!(tags.facet_group("feature-1").is_some(), "the row is a barrier");
    // two units flow from one side of the row to the other, and the pressure falls across it
    let balance = answer.balance(&plane.flow);
    assert!((balance.wells_in - 2.0).abs() < 1e-9 && (balance.wells_out - 2.0).abs() < 1e-9);
    assert!(balance.relative_error() < 1e-9);
    let [source, sink] = [0, 1].map(|well: usize| answer.solution.wells[well].cell_pressure);
    assert!(source > sink, "{source} {sink}");
    for phase in [Phase::Potential, Phase::Optimize, Phase::Connect, Phase::Solve] {
        assert!(watch.seen.contains(&phase), "{phase:?} of {:?}", watch.seen);
    }
}

#[test]
fn a_watch_ends_the_work_in_any_phase() {
    for phase in [Phase::Potential, Phase::Optimize, Phase::Connect, Phase::Solve] {
        let mut watch = Phases { last: Some(phase), ..Default::default() };
        let mut session = Session::new(&mut watch);
        let plane = Dimension::plane();
        let images = MeshImages::new(image());
        let error = flow(&run("3"), &across(0.1), images, &plane, &mut session).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Cancelled, "{phase:?}: {error}");
    }
}

#[test]
fn errors_say_of_what_kind_they_are_without_a_file() {
    let mut watch = Phases::default();
    let mut session = Session::new(&mut watch);
    let plane = Dimension::plane();
    let error = mesh(&run("0.25"), MeshImages::new(image()), &plane, &mut session).unwrap_err();
    assert_eq!((error.kind(), error.path()), (ErrorKind::Misuse, None), "{error}");
    let sealed = FlowOptions { sink: vec![], ..across(0.0) };
    let error = flow(&run("3"), &sealed, MeshImages::new(image()), &plane, &mut session);
    let error = error.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Content, "{error}");
    assert!(error.advice().is_some_and(|advice| advice.contains("pressure")));
}

#[test]
fn warnings_are_notes() {
    let mut watch = Phases::default();
    let mut session = Session::new(&mut watch);
    let flat = Image::new(Frame::new([24, 24]).unwrap(), Samples::U8(vec![7; 576])).unwrap();
    let outcome =
        mesh(&run("6"), MeshImages::new(flat), &Dimension::plane(), &mut session).unwrap();
    assert!(outcome.mesh().cell_count() > 10);
    let [note] = session.notes() else { panic!("{:?}", session.notes()) };
    assert!(note.is_warning && note.text.contains("no features"), "{note}");
}
