//! Meshes in memory are those of files: as they are looked at, written, and made from fields in memory.

use std::path::PathBuf;

use atomesh::image::{Frame, Image, Samples};
use atomesh::watch::Silent;
use atomesh_io::mesh::{AnyMesh, World};
use atomesh_job::mesh::{GivenField, GivenFields, MadeMesh, MeshImages, meshed, prepare};
use atomesh_job::mesh_file::{MeshFile, read};
use atomesh_job::options::{LatticeOptions, OutputOptions, RunConfig};
use atomesh_job::sample::Property;
use atomesh_job::{Dimension, JobError, Session};

const SHAPE: [usize; 2] = [48, 40];

fn frame() -> Frame<2> {
    Frame::new(SHAPE).unwrap().with_spacing([0.5, 0.25]).unwrap().with_origin([3.0, -2.0]).unwrap()
}

/// A bright image with a dark row from edge to edge.
fn image() -> Image<2> {
    let mut grey = vec![200u8; SHAPE[0] * SHAPE[1]];
    grey[20 * SHAPE[0]..21 * SHAPE[0]].fill(10);
    Image::new(frame(), Samples::U8(grey.into())).unwrap()
}

fn run(kind: &str, output: PathBuf) -> RunConfig {
    let lattice = LatticeOptions {
        size: Some("2".parse().unwrap()),
        mesh: Some(serde_json::from_str(&format!("{kind:?}")).unwrap()),
        ..Default::default()
    };
    let output = OutputOptions { output: Some(output), ..Default::default() };
    RunConfig { lattice, output, ..Default::default() }
}

#[test]
fn a_made_mesh_is_looked_at_as_its_file_is_read() {
    let folder = tempfile::tempdir().unwrap();
    for kind in ["delaunay", "voronoi"] {
        let run = run(kind, folder.path().join(format!("{kind}.vtu")));
        let (plane, mut watch) = (Dimension::plane(), Silent);
        let mut session = Session::new(&mut watch);
        let (prepared, image) =
            prepare(&run, MeshImages::new(image()), &plane, &mut session).unwrap();
        let outcome = meshed(&run, prepared, &mut session).unwrap();
        let world = World { units: vec!["mm".into(); 2], standing: None };
        let values = (0..outcome.cells().map_or(outcome.mesh().cell_count(), |c| c.cell_count()))
            .map(|cell| cell as f64 + 0.5)
            .collect();
        let properties = [Property::new("k".into(), values)];
        let made = MadeMesh {
            run: &run,
            outcome: &outcome,
            image: Some(&image),
            world: &world,
            properties: &properties,
            regions: None,
        };
        made.write(&plane, &mut session).unwrap();
        match read(run.output.output.as_ref().unwrap(), &mut session).unwrap() {
            MeshFile::Flat(mut file) => {
                assert_eq!(file.cell_field("k").unwrap()[3], 3.5);
                file.cell_fields.clear(); // what was given besides
                assert_eq!(AnyMesh::Flat(made.loaded().unwrap()), AnyMesh::Flat(file));
            }
            MeshFile::Polygons(file) => {
                let cells = made.loaded_cells().unwrap();
                assert_eq!(file.fields[0].values[3], 3.5);
                assert_eq!(cells.mesh.points(), file.mesh.points());
                assert_eq!(cells.mesh.corners(), file.mesh.corners());
                assert_eq!(cells.features.of_faces, file.features.of_faces);
                assert_eq!(cells.features.areas, file.features.areas);
                assert_eq!((cells.frame, cells.provenance), (file.frame, file.provenance));
            }
            _ => panic!("a file of the plane"),
        }
    }
}

#[test]
fn without_an_image_pictures_and_reports_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut run = run("delaunay", folder.path().join("m.vtu"));
    let (plane, mut watch) = (Dimension::plane(), Silent);
    let mut session = Session::new(&mut watch);
    let (prepared, _) = prepare(&run, MeshImages::new(image()), &plane, &mut session).unwrap();
    let outcome = meshed(&run, prepared, &mut session).unwrap();
    run.output.picture = Some(folder.path().join("m.png"));
    let made = MadeMesh {
        run: &run,
        outcome: &outcome,
        image: None,
        world: &World::default(),
        properties: &[],
        regions: None,
    };
    assert!(made.report(&plane, &mut session).is_err());
    let refused = made.write(&plane, &mut session).unwrap_err();
    assert!(refused.to_string().contains("need the image"), "{refused}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// The labels as a mesh gets them, and what is said.
fn labels(given: Image<2>) -> Result<(Samples, Vec<String>), JobError> {
    let field = GivenField { image: given, units: Vec::new() };
    let fields = GivenFields { labels: Some(field), ..Default::default() };
    let mut watch = Silent;
    let mut session = Session::new(&mut watch);
    let (run, plane) = (RunConfig::default(), Dimension::plane());
    let images = MeshImages::with_fields(&run, image(), fields, &plane, &mut session)?;
    let notes = session.notes().iter().map(|note| note.text.clone()).collect();
    Ok((images.labels.unwrap().into_parts().1, notes))
}

/// Labels that differ everywhere, by sample of the image.
fn numbers(order: impl Fn(usize, usize) -> usize) -> Samples {
    let all = (0..SHAPE[1]).flat_map(|y| (0..SHAPE[0]).map(move |x| (x, y)));
    Samples::U16(all.map(|(x, y)| order(x, y) as u16).collect())
}

#[test]
fn fields_in_memory_are_placed_by_their_own_frames() {
    let label = |x: usize, y: usize| (x / 12) * 4 + y / 10;
    let same = Image::new(frame(), numbers(label)).unwrap();
    assert_eq!(labels(same).unwrap(), (numbers(label), vec![]));
    // unit steps at 0 say nothing of places
    let bare = Image::new(Frame::new(SHAPE).unwrap(), numbers(label)).unwrap();
    let (found, notes) = labels(bare).unwrap();
    assert_eq!(found, numbers(label));
    assert!(notes[0].contains("taken one by one"), "{notes:?}");
    // the same lattice of samples from its other end
    let turned = frame().with_direction([[-1.0, 0.0], [0.0, 1.0]]).unwrap();
    let turned = turned.with_origin([3.0 + 0.5 * 47.0, -2.0]).unwrap();
    let given = Image::new(turned, numbers(|x, y| label(47 - x, y))).unwrap();
    let (found, notes) = labels(given).unwrap();
    assert_eq!(found, numbers(label));
    assert!(notes[0].contains("reordered"), "{notes:?}");
    // elsewhere
    let far = frame().with_origin([900.0, 0.0]).unwrap();
    let refused = labels(Image::new(far, numbers(label)).unwrap()).unwrap_err();
    assert!(refused.to_string().starts_with("labels: ") && refused.to_string().contains("outside"));
}

#[test]
fn labels_in_memory_near_to_whole_numbers_are_rounded_with_a_note() {
    let near: Vec<f32> = (0..SHAPE[0] * SHAPE[1]).map(|i| (i % 3) as f32 + 1e-5).collect();
    let (found, notes) = labels(Image::new(frame(), Samples::F32(near.into())).unwrap()).unwrap();
    assert_eq!((found.get(0), found.get(1), found.get(5)), (0.0, 1.0, 2.0));
    assert!(notes.iter().any(|note| note.contains("rounded")), "{notes:?}");
}
