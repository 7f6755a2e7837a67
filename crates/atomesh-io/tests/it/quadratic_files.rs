//! Cells of second order: written with all their nodes, read as the mesh of their corners.

use atomesh::mesh::{FacetGroup, Mesh, Quadratic, Tags};
use atomesh::watch::Silent;
use atomesh_io::mesh::msh::{MshEncoding, MshVersion};
use atomesh_io::mesh::{AnyMesh, MeshData, MeshFormat, read_mesh, write_mesh_as};

const FORMATS: [(MeshFormat, &str); 7] = [
    (MeshFormat::Vtu, "vtu"),
    (MeshFormat::Vtk, "vtk"),
    (MeshFormat::Msh(MshVersion::V41, MshEncoding::Binary), "msh"),
    (MeshFormat::Msh(MshVersion::V41, MshEncoding::Text), "msh"),
    (MeshFormat::Msh(MshVersion::V22, MshEncoding::Binary), "msh2"),
    (MeshFormat::Msh(MshVersion::V22, MshEncoding::Text), "msh2"),
    (MeshFormat::Npz, "npz"),
];

fn round_trip<const D: usize>(mesh: &Mesh<D>, of: impl Fn(AnyMesh) -> (Mesh<D>, Vec<f32>)) {
    let folder = tempfile::tempdir().unwrap();
    let quadratic = Quadratic::new(mesh);
    let values: Vec<f32> = (0..mesh.points().len()).map(|i| 1.5 * i as f32).collect();
    let extended = quadratic.extend(&values);
    let data = MeshData::new(mesh).with_quadratic(&quadratic);
    let data = data.with_point_field("height", &extended).unwrap();
    for (i, (format, ending)) in FORMATS.into_iter().enumerate() {
        let path = folder.path().join(format!("{i}.{ending}"));
        write_mesh_as(&path, format, &data, &mut Silent).unwrap();
        let (read, field) = of(read_mesh(&path).unwrap());
        assert_eq!((&read, &field), (mesh, &values), "{format:?}");
    }
}

#[test]
fn every_format_gives_the_corners_back() {
    let square = vec![[0.0, 0.0], [1.0, 0.0], [1.5, 1.0], [0.0, 1.0]];
    round_trip(&Mesh::new(square, vec![0, 1, 2, 0, 2, 3]).unwrap(), |any| match any {
        AnyMesh::Flat(mesh) => (mesh.mesh, mesh.point_fields[0].values.clone()),
        AnyMesh::Volume(_) => panic!("triangles became tetrahedra"),
    });
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]];
    round_trip(&Mesh::new(points, vec![0, 1, 2, 3, 1, 2, 3, 4]).unwrap(), |any| match any {
        AnyMesh::Volume(mesh) => (mesh.mesh, mesh.point_fields[0].values.clone()),
        AnyMesh::Flat(_) => panic!("tetrahedra became triangles"),
    });
}

#[test]
fn nodes_are_in_each_format_s_order() {
    let points = vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
    let mesh = Mesh::new(points, vec![0, 1, 2, 3]).unwrap();
    let quadratic = Quadratic::new(&mesh);
    let data = MeshData::new(&mesh).with_quadratic(&quadratic);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.msh");
    let format = MeshFormat::Msh(MshVersion::V22, MshEncoding::Text);
    write_mesh_as(&path, format, &data, &mut Silent).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let cell = text.lines().skip_while(|l| *l != "$Elements").nth(2).unwrap();
    // 1-based nodes of edges 01 02 03 12 13 23 are 5 … 10; Gmsh wants 01 12 20 03 23 13
    assert_eq!(cell, "1 11 2 0 1 1 2 3 4 5 8 6 7 10 9");
    // VTK wants 01 12 20 03 13 23
    assert_eq!(quadratic.cells(), [0, 1, 2, 3, 4, 7, 5, 6, 8, 9]);
}

#[test]
fn node_sets_of_abaqus_hold_the_nodes_between_corners() {
    let points = vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0], [2.0; 3]];
    let mesh = Mesh::new(points, vec![0, 1, 2, 3, 1, 2, 3, 4]).unwrap();
    let quadratic = Quadratic::new(&mesh);
    let group = |name: &str, facets| FacetGroup { id: 1, name: name.into(), facets };
    let tags = Tags::new(&mesh, vec![group("bottom", vec![[0, 2, 1]])], None).unwrap();
    let data = MeshData::new(&mesh).with_quadratic(&quadratic).with_tags(&tags);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.inp");
    write_mesh_as(&path, MeshFormat::Inp, &data, &mut Silent).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let set = text.lines().skip_while(|line| *line != "*NSET, NSET=bottom").nth(1).unwrap();
    let middle = |a, b| quadratic.middle(a, b).unwrap() + 1;
    let mut nodes = [1, 2, 3, middle(0, 1), middle(1, 2), middle(0, 2)];
    nodes.sort_unstable();
    let nodes: Vec<String> = nodes.iter().map(u32::to_string).collect();
    assert_eq!(set, nodes.join(", "));
    // read back, what is left are the corners, the cells between them and the group
    let AnyMesh::Volume(read) = read_mesh(&path).unwrap() else { panic!() };
    assert_eq!(read.mesh, mesh);
    assert_eq!(read.tags.facet_groups(), tags.facet_groups());
}
