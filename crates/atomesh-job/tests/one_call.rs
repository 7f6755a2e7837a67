//! What a user of the library does: an image in memory goes in, an answer comes out, and a watch listens.

use std::ops::ControlFlow;

use atomesh::image::{Frame, Image, Samples};
use atomesh::run::MeshKind;
use atomesh::watch::{Phase, Watch};
use atomesh_job::flow::{FlowMeshCells, FlowOptions, flow};
use atomesh_job::mesh::{MeshImages, mesh};
use atomesh_job::options::{LatticeOptions, RunConfig};
use atomesh_job::{Dimension, ErrorKind, NoteKind, Session};

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
    Image::new(frame, Samples::U8(grey.into())).unwrap()
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
    let flat = Image::new(Frame::new([24, 24]).unwrap(), Samples::U8(vec![7; 576].into())).unwrap();
    let outcome =
        mesh(&run("6"), MeshImages::new(flat), &Dimension::plane(), &mut session).unwrap();
    assert!(outcome.mesh().cell_count() > 10);
    let [note] = session.notes() else { panic!("{:?}", session.notes()) };
    assert!(note.kind == NoteKind::Warning && note.text.contains("no features"), "{note}");
}

/// What flows from below to above past sealed features, and the notes.
fn sealed_flow(image: Image<2>, size: &str, kind: MeshKind) -> (f64, Vec<String>) {
    let mut watch = Phases::default();
    let mut session = Session::new(&mut watch);
    let mut run = run(size);
    run.lattice.mesh = Some(kind);
    let sides = ["ymin=pressure:1", "ymax=pressure:0"].map(|side| side.parse().unwrap());
    let options = FlowOptions { side: sides.to_vec(), ..Default::default() };
    let plane = Dimension::plane();
    let answer = flow(&run, &options, MeshImages::new(image), &plane, &mut session).unwrap();
    let notes = session.notes().iter().map(ToString::to_string).collect();
    (answer.balance(&plane.flow).scale, notes)
}

#[test]
fn a_sealed_row_lets_nothing_through_and_that_is_said() {
    for kind in [MeshKind::Delaunay, MeshKind::Voronoi] {
        let (scale, notes) = sealed_flow(image(), "3", kind);
        // on Voronoi cells rounding is left
        assert!(scale < 1e-12, "{scale} flows on {kind:?}");
        assert!(notes.iter().any(|note| note.contains("nothing flows")), "{notes:?}");
    }
}

#[test]
fn what_flows_past_rows_too_near_to_each_other_is_said() {
    // two dark lines 2 to 8 samples apart, each from edge to edge, so that nothing should pass
    let grey = (0..96 * 80).map(|i| {
        let [x, y] = [f64::from(i % 96), f64::from(i / 96)];
        let off = [y - 38.0, y - 40.0 - x / 16.0];
        let valley = off.map(|off| (-0.5 * off * off).exp());
        (200.0 * (1.0 - valley[0].max(valley[1]))) as u8
    });
    let image = Image::new(Frame::new([96, 80]).unwrap(), Samples::U8(grey.collect())).unwrap();
    for kind in [MeshKind::Delaunay, MeshKind::Voronoi] {
        for size in ["5", "8", "12"] {
            let (scale, notes) = sealed_flow(image.clone(), size, kind);
            let is_said = notes.iter().any(|note| note.contains("passes a feature"));
            assert!(scale < 1e-12 || is_said, "{scale} flows on {kind:?} at {size}: {notes:?}");
        }
    }
}
