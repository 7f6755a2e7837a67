//! polyMesh folders: what is written is what OpenFOAM asks for, and is read back.

use atomesh::geometry::Bounds;
use atomesh::mesh::{Delaunay, FacetGroup, Mesh, Regions, Tags};
use atomesh::watch::Silent;
use atomesh_io::mesh::MeshData;
use atomesh_io::mesh::openfoam::{
    Beyond, FoamMesh, FoamMeshError, Patch, read_foam_mesh, write_foam_mesh,
};

/// A box of points in rows, 0 to `n` along every axis, shifted inside so that no two cells are alike.
fn points<const D: usize>(n: usize) -> Vec<[f64; D]> {
    (0..(n + 1).pow(D as u32))
        .map(|i| {
            let index: [usize; D] = std::array::from_fn(|k| i / (n + 1).pow(k as u32) % (n + 1));
            std::array::from_fn(|k| {
                let inside = index[k] > 0 && index[k] < n;
                let shift = if inside { 0.2 * ((i * 7 + k) as f64).sin() } else { 0.0 };
                index[k] as f64 + shift
            })
        })
        .collect()
}

/// Sides, a tagged facet inside, and two regions.
fn tags<const D: usize>(mesh: &Mesh<D>) -> Tags<D> {
    let inside = mesh.facets().into_iter().filter(|facet| facet.neighbour.is_some());
    // every other one turned
    let facets: Vec<[u32; D]> = inside
        .take(6)
        .enumerate()
        .map(|(i, facet)| {
            let mut corners = facet.corners;
            corners.rotate_left(i % 2);
            corners
        })
        .collect();
    let fault = FacetGroup { id: 9, name: "feature-1".into(), facets };
    let of_cells = (0..mesh.cell_count()).map(|cell| if cell % 3 == 0 { 7 } else { -1 }).collect();
    let regions = Regions { of_cells, names: vec![(7, "salt".into())] };
    let own = Tags::new(mesh, vec![fault], Some(regions)).unwrap();
    Tags::sides(mesh, &Bounds::of(mesh.points()).unwrap(), 0.0).merge(own).unwrap()
}

/// The normal of a face, its length the area: the sum of the cross products from the first corner.
fn area(mesh: &FoamMesh, corners: &[u32]) -> [f64; 3] {
    let at = |k: usize| mesh.points()[corners[k] as usize];
    let mut sum = [0.0; 3];
    for k in 1..corners.len() - 1 {
        let (a, b, c) = (at(0), at(k), at(k + 1));
        let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
        for k in 0..3 {
            sum[k] += (u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3]) / 2.0;
        }
    }
    sum
}

/// Volume by the divergence theorem over the outer faces: a third of the sum of x · area.
fn volume(mesh: &FoamMesh) -> f64 {
    let outer = (0..mesh.face_count()).map(|face| mesh.face(face));
    let outer = outer.filter(|(_, _, beyond)| matches!(beyond, Beyond::Patch(_)));
    outer
        .map(|(corners, ..)| {
            let (x, area) = (mesh.points()[corners[0] as usize], area(mesh, corners));
            (0..3).map(|k| x[k] * area[k]).sum::<f64>() / 3.0
        })
        .sum()
}

fn written_and_read<const D: usize>(mesh: &Mesh<D>) -> FoamMesh {
    let tags = tags(mesh);
    let made = FoamMesh::of_mesh(&MeshData::new(mesh).with_tags(&tags)).unwrap();
    made.validate().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("polyMesh");
    write_foam_mesh(&path, &made, &mut Silent).unwrap();
    let read = read_foam_mesh(&path).unwrap();
    assert_eq!(read, made.ordered());
    read.validate().unwrap();
    // written over itself, it stays the same
    write_foam_mesh(&path, &read, &mut Silent).unwrap();
    assert_eq!(read_foam_mesh(&path).unwrap(), read);
    read
}

#[test]
fn a_volume_has_its_sides_as_patches_and_features_as_zones() {
    let mesh = Delaunay::<3>::new().connect(&points(4), &mut Silent).unwrap();
    let read = written_and_read(&mesh);
    let names: Vec<&str> = read.patches().iter().map(|patch| patch.name.as_str()).collect();
    assert_eq!(names, ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"]);
    assert!((volume(&read) - 64.0).abs() < 1e-12 * 64.0);
    let zones: Vec<_> = read.cell_zones().iter().map(|zone| zone.name.as_str()).collect();
    assert_eq!(zones, ["region--1", "salt"]);
    let of_mesh = tags(&mesh);
    let fault = of_mesh.facet_group("feature-1").unwrap();
    let [zone] = read.face_zones() else { panic!("one zone") };
    assert_eq!((zone.name.as_str(), zone.faces.len()), ("feature-1", 6));
    for (facet, &(face, flipped)) in fault.facets.iter().zip(&zone.faces) {
        let (corners, owner, beyond) = read.face(face as usize);
        assert!(matches!(beyond, Beyond::Cell(other) if other > owner));
        // the zone's normal, turned where it says so, is the face's
        let (own, tagged) = (area(&read, corners), area(&read, facet));
        let along: f64 = (0..3).map(|k| own[k] * tagged[k]).sum();
        assert_eq!(along < 0.0, flipped, "{facet:?}");
    }
    assert!(zone.faces.iter().any(|(_, flip)| *flip) && zone.faces.iter().any(|(_, flip)| !flip));
}

#[test]
fn faces_stand_in_the_order_that_openfoam_asks_for() {
    let mesh = Delaunay::<3>::new().connect(&points(3), &mut Silent).unwrap();
    let read = written_and_read(&mesh);
    let keys: Vec<_> = (0..read.face_count())
        .map(|face| match read.face(face) {
            (_, owner, Beyond::Cell(other)) => (0, owner, other),
            (_, _, Beyond::Patch(patch)) => (1, patch, 0),
        })
        .collect();
    assert!(keys.is_sorted());
}

#[test]
fn a_flat_mesh_becomes_one_layer_of_prisms() {
    let mesh = Delaunay::<2>::new().connect(&points(4), &mut Silent).unwrap();
    let read = written_and_read(&mesh);
    let last = read.patches().last().unwrap();
    assert_eq!((last.name.as_str(), last.is_empty), ("frontAndBack", true));
    assert_eq!(read.patches().len(), 5);
    // as high as the square root of the mean area: 16 over the number of cells
    let height = (16.0 / mesh.cell_count() as f64).sqrt();
    assert!((volume(&read) - 16.0 * height).abs() < 1e-12 * 16.0 * height);
    assert_eq!(read.points().len(), 2 * mesh.points().len());
}

#[test]
fn wrong_faces_are_refused_by_name() {
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let empty = || FoamMesh::new(points.clone(), 1, vec![Patch::new("hull")]);
    let wrong = |corners: &[u32], owner, beyond| {
        empty().push_face(corners, owner, beyond).unwrap_err().to_string()
    };
    assert_eq!(wrong(&[0, 1], 0, Beyond::Patch(0)), "face 0 has 2 corners; expected 3 or more");
    assert_eq!(wrong(&[0, 1, 4], 0, Beyond::Patch(0)), "face 0 names point 4; there are 4");
    assert_eq!(wrong(&[0, 1, 2], 1, Beyond::Patch(0)), "face 0 names cell 1; there are 1");
    assert_eq!(wrong(&[0, 1, 2], 0, Beyond::Patch(1)), "face 0 names patch 1; there are 1");
    assert_eq!(wrong(&[0, 1, 2], 0, Beyond::Cell(0)), "face 0 has cell 0 on both sides");
    assert_eq!(empty().validate(), Err(FoamMeshError::NoFaces { cell: 0 }));
    let mut open = empty();
    for face in [[0, 2, 1], [0, 1, 3], [0, 3, 2]] {
        open.push_face(&face, 0, Beyond::Patch(0)).unwrap();
    }
    assert_eq!(open.validate(), Err(FoamMeshError::Open { cell: 0, edge: [1, 2] }));
    open.push_face(&[1, 2, 3], 0, Beyond::Patch(0)).unwrap();
    assert_eq!(open.validate(), Ok(()));
}
