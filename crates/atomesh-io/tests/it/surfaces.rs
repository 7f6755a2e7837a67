//! Surface files: what is read back is what was written, and formats refuse what they cannot hold.

use atomesh::geometry::Bounds;
use atomesh::mesh::{FacetGroup, Mesh, Tags};
use atomesh::watch::Silent;
use atomesh_io::surface::{LoadedSurface, SurfaceExtras, WorldAxes, read_surface, write_surface};

/// Two tetrahedra on a triangle, with its facet and the hull as groups, and a point of neither.
fn solid() -> (Mesh<3>, Vec<FacetGroup<3>>) {
    let third = 1.0 / 3.0;
    let points = vec![
        [9.0, 9.0, 9.0],
        [0.0, 0.0, 0.0],
        [1.0, 0.0, third],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 1.0, 1e6 + third],
    ];
    let mesh = Mesh::new(points, vec![1, 2, 3, 4, 2, 3, 4, 5]).unwrap();
    let groups = vec![
        FacetGroup { id: 1, name: "feature-1".into(), facets: vec![[2, 3, 4], [2, 4, 5]] },
        FacetGroup { id: 2, name: "feature-2".into(), facets: vec![[1, 3, 2]] },
    ];
    (mesh, groups)
}

fn flat() -> (Mesh<2>, Vec<FacetGroup<2>>) {
    let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0 / 3.0], [0.0, 1.0]];
    let mesh = Mesh::new(points, vec![0, 1, 2, 0, 2, 3]).unwrap();
    let groups = vec![
        FacetGroup { id: 1, name: "feature-1".into(), facets: vec![[1, 2], [2, 3]] },
        FacetGroup { id: 2, name: "feature-2".into(), facets: vec![[2, 0]] },
    ];
    (mesh, groups)
}

/// The corners' places of each facet, with its group's name or number.
fn shapes(surface: &LoadedSurface) -> Vec<(Vec<[f64; 3]>, String)> {
    let at = |corners: &[u32]| corners.iter().map(|&c| surface.points[c as usize]).collect();
    let lines = surface.lines.iter().map(|line| at(line));
    let triangles = surface.triangles.iter().map(|triangle| at(triangle));
    lines.chain(triangles).zip(surface.groups.iter().cloned()).collect()
}

fn expected<const D: usize>(
    mesh: &Mesh<D>,
    groups: &[FacetGroup<D>],
) -> Vec<(Vec<[f64; 3]>, String)> {
    let place = |corner: u32| {
        let p = mesh.points()[corner as usize];
        std::array::from_fn(|k| if k < D { p[k] } else { 0.0 })
    };
    let of = |group: &FacetGroup<D>| {
        let name = group.name.clone();
        let facets = group.facets.clone();
        facets.into_iter().map(move |facet| (facet.map(place).to_vec(), name.clone()))
    };
    groups.iter().flat_map(|group| of(group).collect::<Vec<_>>()).collect()
}

#[test]
fn triangles_are_read_as_they_were_written() {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, groups) = solid();
    for name in ["a.vtp", "a.obj", "a.ply", "a.ts", "a.STL"] {
        let path = folder.path().join(name);
        write_surface(&path, &mesh, &groups, SurfaceExtras::default(), &mut Silent).unwrap();
        let read = read_surface(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
        let mut expected = expected(&mesh, &groups);
        if name == "a.STL" {
            for (corners, group) in &mut expected {
                let single = corners.as_flattened_mut().iter_mut();
                single.for_each(|x| *x = f64::from(*x as f32));
                *group = group.replace("feature-", "");
            }
        }
        assert_eq!(shapes(&read), expected, "{name}");
        let count = read.points.len();
        // points shared by groups are shared in the file, but by GOCAD's objects and STL's triangles
        let shared = [("a.vtp", 5), ("a.obj", 5), ("a.ply", 5), ("a.ts", 4 + 3), ("a.STL", 9)];
        assert!(shared.contains(&(name, count)), "{name}: {count}");
    }
}

#[test]
fn lines_are_read_as_they_were_written() {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, groups) = flat();
    for name in ["a.vtp", "a.obj", "a.ply", "a.pl"] {
        let path = folder.path().join(name);
        write_surface(&path, &mesh, &groups, SurfaceExtras::default(), &mut Silent).unwrap();
        let read = read_surface(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(shapes(&read), expected(&mesh, &groups), "{name}");
    }
}

#[test]
fn formats_refuse_what_they_cannot_hold_and_leave_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, groups) = flat();
    let refused = |name: &str| {
        let path = folder.path().join(name);
        let error = write_surface(&path, &mesh, &groups, SurfaceExtras::default(), &mut Silent)
            .unwrap_err();
        assert!(!path.exists(), "{name}");
        error.to_string()
    };
    let advice = "cannot hold lines; expected .vtp, .obj, .ply or .pl for a flat mesh";
    assert_eq!(refused("a.stl"), format!("STL {advice}"));
    assert_eq!(refused("a.ts"), format!("GOCAD TSurf {advice}"));
    assert!(refused("a.vtu").contains("is not a surface file by its name; expected one of .vtp"));
    let (mesh, groups) = solid();
    let error = write_surface(
        &folder.path().join("a.pl"),
        &mesh,
        &groups,
        SurfaceExtras::default(),
        &mut Silent,
    );
    assert!(error.unwrap_err().to_string().starts_with("GOCAD PLine cannot hold triangles"));
    let odd = [FacetGroup { id: 1, name: "odd".into(), facets: vec![[1, 2, 7]] }];
    let error = write_surface(
        &folder.path().join("a.obj"),
        &mesh,
        &odd,
        SurfaceExtras::default(),
        &mut Silent,
    );
    assert_eq!(error.unwrap_err().to_string(), "a facet of \"odd\" names point 7; the mesh has 6");
}

#[test]
fn text_of_stl_is_told_from_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.stl");
    let text = "solid rock\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 0\n\
        endloop\nendfacet\nendsolid rock\n";
    std::fs::write(&path, text).unwrap();
    let read = read_surface(&path).unwrap();
    assert_eq!(read.points, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!((&read.triangles[..], &read.groups[..]), (&[[0, 1, 2]][..], &["rock".into()][..]));
    for wrong in ["solid\nvertex 0 0\n", "solid\nvertex 0 0 0\nendloop\n", "liquid"] {
        std::fs::write(&path, wrong).unwrap();
        assert!(read_surface(&path).is_err(), "{wrong}");
    }
}

#[test]
fn a_vtp_names_its_arrays_and_is_the_same_again() {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, groups) = solid();
    let write = |name: &str| {
        let path = folder.path().join(name);
        let extras = SurfaceExtras { values: Some(&[-0.5, -0.25]), axes: None };
        write_surface(&path, &mesh, &groups, extras, &mut Silent).unwrap();
        std::fs::read(path).unwrap()
    };
    let bytes = write("a.vtp");
    assert_eq!(bytes, write("b.vtp"));
    let head = String::from_utf8_lossy(&bytes);
    for part in [
        "type=\"PolyData\"",
        "NumberOfPoints=\"5\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"3\"",
        "type=\"Int32\" Name=\"feature\"",
        "type=\"Float32\" Name=\"potential\"",
        "Name=\"feature_names\"",
        "<Polys>",
    ] {
        assert!(head.contains(part), "{part}");
    }
    let bounds = Bounds::of(mesh.points()).unwrap();
    let none = Tags::sides(&mesh, &bounds, 0.0);
    // no facet lies on the box: groups without facets make a file without points
    let path = folder.path().join("none.vtp");
    write_surface(&path, &mesh, &none.facet_groups()[..1], SurfaceExtras::default(), &mut Silent)
        .unwrap();
}

#[test]
fn gocad_is_told_units_and_where_z_grows() {
    let (folder, (mesh, groups)) = (tempfile::tempdir().unwrap(), solid());
    let path = folder.path().join("a.ts");
    let text = |axes: Option<&WorldAxes>| {
        let extras = SurfaceExtras { values: None, axes };
        write_surface(&path, &mesh, &groups, extras, &mut Silent).unwrap();
        std::fs::read_to_string(&path).unwrap()
    };
    assert!(!text(None).contains("ZPOSITIVE"));
    let units = vec!["m".into(), "m".into(), "ms".into()];
    let mut axes = WorldAxes { units, z_down: true, standing: None };
    let found = text(Some(&axes));
    // each object has a system of its own, before its part
    assert_eq!(found.matches("ZPOSITIVE Depth\n").count(), groups.len());
    assert_eq!(found.matches("AXIS_UNIT \"m\" \"m\" \"ms\"\n").count(), groups.len());
    assert!(found.find("END_ORIGINAL_COORDINATE_SYSTEM\n") < found.find("TFACE"));
    axes = WorldAxes::default();
    let found = text(Some(&axes));
    assert!(found.contains("ZPOSITIVE Elevation") && found.contains("AXIS_UNIT \"none\""));
    assert_eq!(read_surface(&path).unwrap().triangles.len(), 3);
}
