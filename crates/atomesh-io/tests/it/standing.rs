//! Flat meshes that stand in space: files have their points there, and give them back as they were.

use atomesh::mesh::{Delaunay, FacetGroup, Mesh};
use atomesh::watch::Silent;
use atomesh_io::mesh::msh::{MshEncoding, MshVersion};
use atomesh_io::mesh::{
    AnyMesh, MeshData, MeshFormat, Provenance, Standing, World, read_mesh, write_mesh_as,
};
use atomesh_io::surface::{SurfaceExtras, WorldAxes, read_surface, write_surface};

/// A plane through (3, −7, 2.5) whose x runs along (2, 0, 1).
fn standing() -> Standing {
    Standing::along([3.0, -7.0, 2.5], [[2.0, 0.0, 1.0], [0.5, 3.0, 0.0]])
}

fn mesh() -> Mesh<2> {
    let points: Vec<[f64; 2]> =
        (0..20).map(f64::from).map(|n| [(n * 3.7) % 8.0, (n * 2.3) % 5.0]).collect();
    Delaunay::<2>::new().connect(&points, &mut Silent).unwrap()
}

fn provenance() -> Provenance {
    let options = serde_json::json!({});
    let provenance =
        Provenance { version: "0".into(), options, seed: 7, units: vec![], standing: None };
    provenance.in_world(&World { units: vec!["mm".into(); 2], standing: Some(standing()) })
}

#[test]
fn meshes_come_back_into_their_plane() {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, provenance) = (mesh(), provenance());
    let vectors: Vec<[f64; 2]> = vec![[1.0, 2.0]; mesh.cell_count()];
    for (name, format) in [
        ("a.vtu", MeshFormat::Vtu),
        ("a.vtk", MeshFormat::Vtk),
        ("a.inp", MeshFormat::Inp),
        ("a.npz", MeshFormat::Npz),
        ("a.msh", MeshFormat::Msh(MshVersion::V41, MshEncoding::Binary)),
        ("b.msh2", MeshFormat::Msh(MshVersion::V22, MshEncoding::Text)),
    ] {
        let mut data = MeshData::new(&mesh).with_provenance(&provenance);
        if !["a.inp", "a.npz"].contains(&name) {
            data = data.with_cell_vectors("velocity", &vectors).unwrap();
        }
        let path = folder.path().join(name);
        write_mesh_as(&path, format, &data, &mut Silent).unwrap();
        let AnyMesh::Flat(read) = read_mesh(&path).unwrap() else { panic!("{name}: no triangles") };
        assert_eq!(read.mesh.corners(), mesh.corners(), "{name}");
        for (a, b) in read.mesh.points().iter().zip(mesh.points()) {
            assert!((a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-12, "{name}: {a:?} for {b:?}");
        }
        assert_eq!(read.provenance.as_ref(), Some(&provenance), "{name}");
    }
}

#[test]
fn what_is_written_lies_in_the_plane() {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, provenance) = (mesh(), provenance());
    let path = folder.path().join("a.inp");
    let data = MeshData::new(&mesh).with_provenance(&provenance);
    write_mesh_as(&path, MeshFormat::Inp, &data, &mut Silent).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let lines = text.lines().skip_while(|line| *line != "*NODE").skip(1);
    let lines: Vec<&str> = lines.take(mesh.points().len()).collect();
    for (line, p) in lines.iter().zip(mesh.points()) {
        let place: Vec<f64> = line.split(", ").skip(1).map(|word| word.parse().unwrap()).collect();
        let expected = standing().in_space(*p);
        (0..3).for_each(|k| assert!((place[k] - expected[k]).abs() < 1e-12, "{line}"));
    }
    let group = FacetGroup { id: 1, name: "rim".into(), facets: vec![mesh.facet_of(0, 0)] };
    let axes = WorldAxes { standing: Some(standing()), ..WorldAxes::default() };
    let extras = SurfaceExtras { values: None, axes: Some(&axes) };
    let path = folder.path().join("rim.obj");
    write_surface(&path, &mesh, &[group], extras, &mut Silent).unwrap();
    for p in &read_surface(&path).unwrap().points {
        assert!(standing().in_plane(*p)[2].abs() < 1e-12, "{p:?}");
    }
}
