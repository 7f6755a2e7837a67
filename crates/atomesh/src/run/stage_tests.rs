//! Any stage can be kept, cloned and run on from.

use super::*;
use crate::edit::Editor;
use crate::image::{Frame, Image, Samples};
use crate::lattice::Lattice;
use crate::mesh::Mesh;
use crate::watch::Silent;

/// A bright ball or disc, off the middle.
fn ball<const D: usize>(side: usize) -> Image<D> {
    let frame = Frame::new([side; D]).unwrap();
    let value = |index: usize| {
        let p = crate::image::coordinates(index, [side; D]).map(|i| i as f64 / side as f64);
        let squared: f64 = (0..D).map(|k| (p[k] - 0.4 - 0.1 * k as f64).powi(2)).sum();
        if squared < 0.09 { 200u8 } else { 40 }
    };
    let grey = (0..frame.sample_count()).map(value).collect();
    Image::new(frame, Samples::U8(grey)).unwrap()
}

/// All bits of a mesh's points, and its corners.
fn bits<const D: usize>(mesh: &Mesh<D>) -> (Vec<u64>, Vec<u32>) {
    let points = mesh.points().as_flattened().iter().map(|x| x.to_bits()).collect();
    (points, mesh.corners().to_vec())
}

fn options<const D: usize>(size: f64, kind: MeshKind) -> MeshOptions<D> {
    let mut options = MeshOptions { size: Size::Constant(size), ..MeshOptions::for_kind(kind) };
    options.features.features = crate::enhance::Features::Edges;
    options
}

/// Cuts a run at each stage, clones it there and goes on from the clone: always the same mesh.
fn is_the_same_wherever_it_was_cut<const D: usize>(method: &Method<D>, side: usize, size: f64) {
    let image = ball::<D>(side);
    let prepared = || {
        let options = options(size, MeshKind::Delaunay);
        prepare(method, Inputs::image(&image), options, &mut Silent).unwrap()
    };
    let watch = &mut Silent;
    let whole = prepared().run(watch).unwrap();
    let expected = bits(whole.mesh());

    let prepared = prepared();
    let filled = prepared.fill(watch).unwrap();
    let settled = filled.clone().settle(watch).unwrap();
    let connected = settled.clone().connect(watch).unwrap();
    let improved = connected.clone().improve(watch).unwrap();
    let from_improved = improved.clone().finish(watch).unwrap();
    assert_eq!(bits(from_improved.mesh()), expected);
    // the stages before are as they were: whoever kept one goes on from it
    let again = [
        prepared.clone().run(watch),
        filled.settle(watch).and_then(|s| s.connect(watch)?.improve(watch)?.finish(watch)),
        settled.connect(watch).and_then(|c| c.improve(watch)?.finish(watch)),
        connected.improve(watch).and_then(|i| i.finish(watch)),
        improved.finish(watch),
    ];
    for (cut, outcome) in again.into_iter().enumerate() {
        let outcome = outcome.unwrap();
        assert_eq!(bits(outcome.mesh()), expected, "cut after stage {cut}");
        assert_eq!(outcome.distance_at_points(), whole.distance_at_points());
        assert_eq!(outcome.potential_at_points(), whole.potential_at_points());
        assert_eq!(outcome.optimize_report(), whole.optimize_report());
        assert_eq!(outcome.improve_report(), whole.improve_report());
    }
}

#[test]
fn a_run_in_the_plane_is_the_same_wherever_it_was_cut() {
    is_the_same_wherever_it_was_cut(&Method::plane(), 40, 5.0);
}

#[test]
fn a_run_in_space_is_the_same_wherever_it_was_cut() {
    is_the_same_wherever_it_was_cut(&Method::space(), 18, 4.5);
}

#[test]
fn a_run_to_voronoi_cells_is_the_same_wherever_it_was_cut() {
    let image = ball::<2>(40);
    let options = options(5.0, MeshKind::Voronoi);
    let watch = &mut Silent;
    let prepared = prepare(&Method::plane(), Inputs::image(&image), options, watch).unwrap();
    let whole = prepared.clone().run(watch).unwrap();
    let settled = prepared.fill(watch).unwrap().settle(watch).unwrap();
    let divided = settled.clone().divide(watch).unwrap();
    for outcome in [divided.clone().finish(watch), settled.divide(watch).unwrap().finish(watch)] {
        let outcome = outcome.unwrap();
        assert_eq!(bits(outcome.mesh()), bits(whole.mesh()));
        assert_eq!(outcome.cells(), whole.cells());
        assert_eq!(outcome.cells(), Some(divided.cells()));
    }
}

#[test]
fn stages_are_owned_and_go_to_other_threads() {
    fn goes<T: Send + Sync + Clone + 'static>() {}
    goes::<Prepared<2>>();
    goes::<Filled<3>>();
    goes::<Settled<2>>();
    goes::<Connected<3>>();
    goes::<Improved<2>>();
    goes::<Divided<3>>();
    goes::<Outcome<2>>();
    let image = ball::<2>(30);
    let options = options(5.0, MeshKind::Delaunay);
    let prepared = prepare(&Method::plane(), Inputs::image(&image), options, &mut Silent).unwrap();
    drop(image);
    let here = prepared.clone().run(&mut Silent).unwrap();
    let there = std::thread::spawn(move || prepared.run(&mut Silent).unwrap()).join().unwrap();
    assert_eq!(bits(here.mesh()), bits(there.mesh()));
}

#[test]
fn a_run_goes_on_from_an_editor_and_from_a_mesh() {
    let image = ball::<2>(40);
    let options = options(5.0, MeshKind::Delaunay);
    let watch = &mut Silent;
    let method = Method::plane();
    let prepared = prepare(&method, Inputs::image(&image), options, watch).unwrap();
    let settled = prepared.fill(watch).unwrap().settle(watch).unwrap();
    let editor = Editor::new(settled.lattice().clone(), *method.delaunay(), watch).unwrap();
    // connecting is the editor's work too, so a run that takes its mesh differs in nothing
    let (mesh, _) = editor.mesh().unwrap();
    let connected = settled.connect(watch).unwrap();
    let improved = connected.clone().improve(watch).unwrap();
    let taken = prepared.with_mesh(mesh).unwrap();
    assert_eq!(taken.freedom, connected.freedom);
    assert_eq!(bits(taken.improve(watch).unwrap().mesh()), bits(improved.mesh()));
    // an outcome's mesh placed in the world and moved back is a mesh to go on from
    let world = improved.finish(watch).unwrap().world_mesh();
    let back = lattice_mesh(&world, prepared.frame(), prepared.options().units);
    assert!(prepared.with_mesh(back).unwrap().improve(watch).is_ok());
}

#[test]
fn atoms_and_meshes_of_another_box_are_refused() {
    let (image, other) = (ball::<2>(40), ball::<2>(30));
    let method = Method::plane();
    let prepare = |image| {
        let options = options(5.0, MeshKind::Delaunay);
        prepare(&method, Inputs::image(image), options, &mut Silent).unwrap()
    };
    let (large, small) = (prepare(&image), prepare(&other));
    let lattice: Lattice<2> = large.fill(&mut Silent).unwrap().into_lattice();
    let mesh = large.clone().run(&mut Silent).unwrap().mesh().clone();
    let expected = "the box is [0.0, 0.0] to [39.0, 39.0]; the image's is [0.0, 0.0] to [29.0, 29.0], in lattice units";
    let errors = [
        small.with_atoms(lattice.clone()).err(),
        small.with_settled(lattice).err(),
        small.with_mesh(mesh).err(),
    ];
    assert_eq!(errors[0].as_ref().unwrap().to_string(), expected);
    assert_eq!(errors[0], errors[1]);
    assert!(matches!(errors[2], Some(RunError::OtherBox { .. })));
}

#[test]
fn options_are_written_and_read_whole_and_in_part() {
    let options = MeshOptions::<3> {
        size: Size::Range { min: 4.0, max: 9.5 },
        mixture: Some("faults,horizons:0.5".parse().unwrap()),
        seed_points: vec![[1.0, 2.5, -3.0]],
        memory_limit: Some(1 << 33),
        ..MeshOptions::voronoi()
    };
    let text = serde_json::to_string(&options).unwrap();
    assert_eq!(serde_json::from_str::<MeshOptions<3>>(&text).unwrap(), options);
    let part = r#"{"size": {"constant": 6.0}, "image_weight": 0.3}"#;
    let read: MeshOptions<2> = serde_json::from_str(part).unwrap();
    let expected =
        MeshOptions { size: Size::Constant(6.0), image_weight: 0.3, ..MeshOptions::default() };
    assert_eq!(read, expected);
    let wrong = |text| serde_json::from_str::<MeshOptions<2>>(text).unwrap_err().to_string();
    assert!(wrong(r#"{"seed_points": [[1, 2, 3]]}"#).contains("a point of 3 numbers; expected 2"));
    assert!(wrong(r#"{"sise": 3}"#).contains("unknown field `sise`"));
}

#[test]
fn cells_without_area_to_the_precision_of_numbers_are_refused_with_their_place() {
    let image = ball::<2>(9);
    let options = options(4.0, MeshKind::Delaunay);
    let prepared = prepare(&Method::plane(), Inputs::image(&image), options, &mut Silent).unwrap();
    // valid by exact arithmetic: a point as far above a side as a rounding of its length
    let finished = |height: f64| {
        let points = vec![[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0], [4.0, height]];
        let mesh = Mesh::new(points, vec![0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4]).unwrap();
        assert_eq!(mesh.validate(), Ok(()));
        prepared.with_mesh(mesh).unwrap().unimproved().finish(&mut Silent)
    };
    let error = finished(1e-14).unwrap_err();
    let expected = "1 of 4 cells have no area to the precision of numbers, the first near 4,0; a lower image weight \
                    (--beta), another size or seed may avoid it";
    assert_eq!(error.to_string(), expected);
    assert!(finished(1e-6).is_ok());
}
