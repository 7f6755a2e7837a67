//! Tags go through every format that holds them, and stay as they were.

use atomesh::geometry::Bounds;
use atomesh::mesh::{
    Delaunay, FacetGroup, Mesh, PointGroup, Quadratic, Regions, Tags, interface_name,
};
use atomesh::region::{Interface, interfaces};
use atomesh::watch::Silent;
use atomesh_io::mesh::inp::read_inp;
use atomesh_io::mesh::msh::{MshEncoding, MshVersion, read_msh};
use atomesh_io::mesh::openfoam::{FoamMesh, read_foam_mesh, write_foam_mesh};
use atomesh_io::mesh::vtu::read_vtu;
use atomesh_io::mesh::{
    AnyMesh, LoadedMesh, MeshData, MeshFormat, Provenance, read_mesh, write_mesh_as,
};
use proptest::prelude::*;

/// Rows of points, 0 to `n` along every axis, shifted inside.
fn points<const D: usize>(n: usize) -> Vec<[f64; D]> {
    (0..(n + 1).pow(D as u32))
        .map(|i| {
            let index: [usize; D] = std::array::from_fn(|k| i / (n + 1).pow(k as u32) % (n + 1));
            let inside = |k: usize| index[k] > 0 && index[k] < n;
            std::array::from_fn(|k| {
                let shift = if inside(k) { 0.2 * ((i * 7 + k) as f64).sin() } else { 0.0 };
                index[k] as f64 + shift
            })
        })
        .collect()
}

/// The sides, a group that shares a facet with one of them, and one inside with facets turned both ways.
fn tagged<const D: usize>(mesh: &Mesh<D>, regions: Option<Regions>) -> Tags<D> {
    let sides = Tags::sides(mesh, &Bounds::of(mesh.points()).unwrap(), 0.0);
    let shared = sides.facet_group("xmin").unwrap().facets[..1].to_vec();
    let inside = mesh.facets().into_iter().filter(|facet| facet.neighbour.is_some()).take(5);
    let turned = inside.enumerate().map(|(i, facet)| {
        let mut corners = facet.corners;
        if i % 2 == 0 {
            corners.swap(D - 2, D - 1);
        }
        corners
    });
    let groups = vec![
        FacetGroup { id: 20, name: "inlet".into(), facets: shared },
        FacetGroup { id: 11, name: "feature-1".into(), facets: turned.collect() },
    ];
    let tags = sides.merge(Tags::new(mesh, groups, regions).unwrap()).unwrap();
    tags.with_point_groups(mesh, wells(mesh)).unwrap()
}

/// A point inside, and two corners in one group.
fn wells<const D: usize>(mesh: &Mesh<D>) -> Vec<PointGroup> {
    let inside = mesh.points().iter().position(|p| p[0].fract() != 0.0).unwrap();
    let last = mesh.points().len() as u32 - 1;
    vec![
        PointGroup { id: 1, name: "well-1".into(), points: vec![inside as u32] },
        PointGroup { id: 4, name: "corners".into(), points: vec![0, last] },
    ]
}

fn regions(cells: usize, names: &[(i32, &str)]) -> Regions {
    let of_cells = (0..cells).map(|cell| [3, -1, 0, 8][cell % 4]).collect();
    let names = names.iter().map(|(id, name)| (*id, (*name).to_string())).collect();
    Regions { of_cells, names }
}

const FORMATS: [(&str, MeshFormat); 6] = [
    ("a.vtu", MeshFormat::Vtu),
    ("a.inp", MeshFormat::Inp),
    ("a.msh", MeshFormat::Msh(MshVersion::V41, MshEncoding::Binary)),
    ("b.msh", MeshFormat::Msh(MshVersion::V41, MshEncoding::Text)),
    ("a.msh2", MeshFormat::Msh(MshVersion::V22, MshEncoding::Binary)),
    ("b.msh2", MeshFormat::Msh(MshVersion::V22, MshEncoding::Text)),
];

/// The groups by id, each with its facets as sets of corners that run in one way.
fn canonical<const D: usize>(tags: &Tags<D>) -> Vec<(u32, String, Vec<[u32; D]>)> {
    let mut groups: Vec<_> = (tags.facet_groups().iter())
        .map(|group| {
            let mut facets: Vec<[u32; D]> = group.facets.clone();
            if D == 3 {
                // where a triangle begins is of no matter
                for facet in &mut facets {
                    let least = (0..D).min_by_key(|&k| facet[k]).unwrap();
                    facet.rotate_left(least);
                }
            }
            facets.sort_unstable();
            (group.id, group.name.clone(), facets)
        })
        .collect();
    groups.sort();
    groups
}

fn check<const D: usize>(
    mesh: &Mesh<D>,
    tags: &Tags<D>,
    pick: impl Fn(AnyMesh) -> Option<LoadedMesh<D>>,
) {
    let folder = tempfile::tempdir().unwrap();
    let provenance = Provenance {
        version: "0.1.0".into(),
        options: serde_json::json!({}),
        seed: 7,
        units: Vec::new(),
        standing: None,
    };
    let data = MeshData::new(mesh).with_tags(tags).with_provenance(&provenance);
    for (name, format) in FORMATS {
        let path = folder.path().join(name);
        write_mesh_as(&path, format, &data, &mut Silent).unwrap();
        let read = pick(read_mesh(&path).unwrap_or_else(|e| panic!("{name}: {e}"))).unwrap();
        assert_eq!(&read.mesh, mesh, "{name}");
        assert_eq!(read.skipped_cells, 0, "{name}");
        assert_eq!(read.provenance.as_ref(), Some(&provenance), "{name}");
        assert_eq!(read.tags.regions(), tags.regions(), "{name}");
        assert_eq!(read.tags.point_groups(), tags.point_groups(), "{name}");
        assert_eq!(read.point_fields, [], "{name}");
        let (found, expected) = (canonical(&read.tags), canonical(tags));
        assert_eq!(found, expected, "{name}");
    }
}

fn flat(any: AnyMesh) -> Option<LoadedMesh<2>> {
    if let AnyMesh::Flat(loaded) = any { Some(loaded) } else { None }
}

fn volume(any: AnyMesh) -> Option<LoadedMesh<3>> {
    if let AnyMesh::Volume(loaded) = any { Some(loaded) } else { None }
}

#[test]
fn groups_alone_are_read_as_they_were_written() {
    let mesh = Delaunay::<2>::new().connect(&points(4), &mut Silent).unwrap();
    check(&mesh, &tagged(&mesh, None), flat);
    let mesh = Delaunay::<3>::new().connect(&points(3), &mut Silent).unwrap();
    check(&mesh, &tagged(&mesh, None), volume);
}

#[test]
fn regions_keep_their_numbers_even_those_below_one_and_their_names() {
    let names = [(-1, "outside"), (3, "salt")];
    let mesh = Delaunay::<2>::new().connect(&points(4), &mut Silent).unwrap();
    check(&mesh, &tagged(&mesh, Some(regions(mesh.cell_count(), &names))), flat);
    let mesh = Delaunay::<3>::new().connect(&points(3), &mut Silent).unwrap();
    check(&mesh, &tagged(&mesh, Some(regions(mesh.cell_count(), &names))), volume);
    let alone = Tags::new(&mesh, vec![], Some(regions(mesh.cell_count(), &[]))).unwrap();
    check(&mesh, &alone, volume);
}

/// Interfaces of regions without an order, and after them a feature on the facets of the first, turned the other
/// way.
fn with_interfaces<const D: usize>(mesh: &Mesh<D>) -> Tags<D> {
    let labels = (0..mesh.cell_count()).map(|cell| [3, -1, 0][cell * cell % 7 % 3]);
    let regions = Regions { of_cells: labels.collect(), names: Vec::new() };
    let mut groups: Vec<FacetGroup<D>> = interfaces(mesh, &regions.of_cells)
        .into_iter()
        .zip(1..)
        .map(|(Interface { labels, facets }, id)| FacetGroup {
            id,
            name: interface_name(labels),
            facets,
        })
        .collect();
    let turned = groups[0].facets.iter().map(|facet| {
        let mut facet = *facet;
        facet.swap(D - 2, D - 1);
        facet
    });
    let feature = FacetGroup { id: 50, name: "feature-1".into(), facets: turned.collect() };
    groups.push(feature);
    Tags::new(mesh, groups, Some(regions)).unwrap()
}

/// Interfaces run from the lower label to the higher in every file, whatever other groups have their facets.
fn check_interfaces<const D: usize>(
    mesh: &Mesh<D>,
    pick: impl Fn(AnyMesh) -> Option<LoadedMesh<D>>,
) {
    let folder = tempfile::tempdir().unwrap();
    let tags = with_interfaces(mesh);
    for (name, format) in FORMATS {
        let path = folder.path().join(name);
        let data = MeshData::new(mesh).with_tags(&tags);
        write_mesh_as(&path, format, &data, &mut Silent).unwrap();
        let read = pick(read_mesh(&path).unwrap()).unwrap();
        let without_feature = |tags: &Tags<D>| {
            let mut groups = canonical(tags);
            groups.retain(|(id, ..)| *id != 50);
            groups
        };
        assert_eq!(without_feature(&read.tags), without_feature(&tags), "{name}");
        assert_eq!(read.tags.regions(), tags.regions(), "{name}");
        let feature = read.tags.facet_group("feature-1").unwrap();
        assert_eq!(feature.facets.len(), tags.facet_groups()[0].facets.len(), "{name}");
    }
}

#[test]
fn interfaces_run_from_the_lower_label_to_the_higher_in_every_file() {
    check_interfaces(&Delaunay::<2>::new().connect(&points(4), &mut Silent).unwrap(), flat);
    check_interfaces(&Delaunay::<3>::new().connect(&points(3), &mut Silent).unwrap(), volume);
}

#[test]
fn groups_of_other_programs_get_names_that_fit() {
    let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n\
        $PhysicalNames\n3\n1 1 \"Inlet left\"\n1 2 \"Inlet_left\"\n2 5 \"7 rock\"\n$EndPhysicalNames\n\
        $Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n\
        $Elements\n6\n1 1 2 1 1 1 2\n2 1 2 2 2 2 3\n3 1 2 4 3 3 4\n4 1 2 4 3 2 4\n\
        5 2 2 5 1 1 2 3\n6 2 2 5 1 1 3 4\n$EndElements\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.msh");
    std::fs::write(&path, text).unwrap();
    let loaded = flat(read_mesh(&path).unwrap()).unwrap();
    let groups: Vec<_> = (loaded.tags.facet_groups().iter())
        .map(|group| (group.id, group.name.as_str(), group.facets.clone()))
        .collect();
    let expected = [
        (1, "Inlet_left", vec![[0, 1]]),
        (2, "Inlet_left.2", vec![[1, 2]]),
        (4, "group-4", vec![[2, 3]]),
    ];
    assert_eq!(groups, expected);
    // the line across from 2 to 4 is no edge of the mesh
    assert_eq!(loaded.skipped_cells, 1);
    let regions = loaded.tags.regions().unwrap();
    assert_eq!((&regions.of_cells[..], regions.name(5)), (&[5, 5][..], "group-7_rock".to_string()));
}

/// The golden file of a square of two triangles with its sides; it changes only when the format does.
#[test]
fn a_square_is_this_text_in_abaqus() {
    let square = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mesh = Mesh::new(square, vec![0, 1, 2, 0, 2, 3]).unwrap();
    let sides = Tags::sides(&mesh, &Bounds::of(mesh.points()).unwrap(), 0.0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.inp");
    let data = MeshData::new(&mesh).with_tags(&sides);
    write_mesh_as(&path, MeshFormat::Inp, &data, &mut Silent).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let expected = "*HEADING\natomesh\n**atomesh {}\n*NODE\n\
        1, 0.0, 0.0, 0.0\n2, 1.0, 0.0, 0.0\n3, 1.0, 1.0, 0.0\n4, 0.0, 1.0, 0.0\n\
        *ELEMENT, TYPE=CPS3, ELSET=cells\n1, 1, 2, 3\n2, 1, 3, 4\n\
        **group 1 xmin\n*NSET, NSET=xmin\n1, 4\n*ELSET, ELSET=xmin_S3, INTERNAL\n2\n\
        *SURFACE, TYPE=ELEMENT, NAME=xmin\nxmin_S3, S3\n\
        **group 2 xmax\n*NSET, NSET=xmax\n2, 3\n*ELSET, ELSET=xmax_S2, INTERNAL\n1\n\
        *SURFACE, TYPE=ELEMENT, NAME=xmax\nxmax_S2, S2\n\
        **group 3 ymin\n*NSET, NSET=ymin\n1, 2\n*ELSET, ELSET=ymin_S1, INTERNAL\n1\n\
        *SURFACE, TYPE=ELEMENT, NAME=ymin\nymin_S1, S1\n\
        **group 4 ymax\n*NSET, NSET=ymax\n3, 4\n*ELSET, ELSET=ymax_S2, INTERNAL\n2\n\
        *SURFACE, TYPE=ELEMENT, NAME=ymax\nymax_S2, S2\n";
    assert_eq!(text, expected);
}

/// Readers take any bytes without a panic.
fn read_bytes(format: MeshFormat, bytes: &[u8]) {
    let _ = match format {
        MeshFormat::Vtu => read_vtu(bytes),
        MeshFormat::Inp => read_inp(bytes),
        _ => read_msh(bytes),
    };
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn changed_files_with_tags_are_read_or_refused_without_a_panic(
        format in 0..FORMATS.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>(),
        cuts in any::<bool>(),
    ) {
        let mesh = Delaunay::<3>::new().connect(&points(1), &mut Silent).unwrap();
        let regions = regions(mesh.cell_count(), &[(3, "salt")]);
        let inner = FacetGroup { id: 9, name: "inner".into(), facets: vec![mesh.facet_of(0, 1)] };
        let tags = Tags::new(&mesh, vec![inner], Some(regions)).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let data = MeshData::new(&mesh).with_tags(&tags);
        write_mesh_as(&path, FORMATS[format].1, &data, &mut Silent).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if cuts {
            bytes.truncate(cut.index(bytes.len()));
        }
        read_bytes(FORMATS[format].1, &bytes);
    }
}

/// Of formats without facets and regions, points have their groups all the same.
#[test]
fn groups_of_points_go_through_every_format() {
    fn check<const D: usize>(pick: fn(AnyMesh) -> Option<LoadedMesh<D>>, mesh: &Mesh<D>) {
        let folder = tempfile::tempdir().unwrap();
        let tags = Tags::default().with_point_groups(mesh, wells(mesh)).unwrap();
        let quadratic = Quadratic::new(mesh);
        let plain = MeshData::new(mesh).with_tags(&tags);
        let straight = [("a.vtk", MeshFormat::Vtk), ("a.npz", MeshFormat::Npz)];
        for (name, format) in straight.into_iter().chain(FORMATS) {
            // of cells of second order too, whose corners alone are read back
            for data in [plain.clone(), plain.clone().with_quadratic(&quadratic)] {
                let path = folder.path().join(name);
                write_mesh_as(&path, format, &data, &mut Silent).unwrap();
                let read = pick(read_mesh(&path).unwrap()).unwrap();
                assert_eq!(read.tags.point_groups(), tags.point_groups(), "{name}");
                assert_eq!((read.skipped_cells, read.point_fields.len()), (0, 0), "{name}");
            }
        }
        let foam = FoamMesh::of_mesh(&plain).unwrap();
        let path = folder.path().join("polyMesh");
        write_foam_mesh(&path, &foam, &mut Silent).unwrap();
        let zones = read_foam_mesh(&path).unwrap().point_zones().to_vec();
        let names: Vec<&str> = zones.iter().map(|zone| zone.name.as_str()).collect();
        assert_eq!(names, ["well-1", "corners"]);
        // flat meshes have two points of each
        assert_eq!(zones[0].points.len(), if D == 2 { 2 } else { 1 });
    }
    check(flat, &Delaunay::<2>::new().connect(&points(4), &mut Silent).unwrap());
    check(volume, &Delaunay::<3>::new().connect(&points(3), &mut Silent).unwrap());
}

/// Gmsh's own files have points in groups, one point in two of them, and groups whose numbers lines have too.
#[test]
fn physical_points_of_gmsh_are_groups_of_points() {
    let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n\
        $PhysicalNames\n2\n0 1 \"tip\"\n1 1 \"rim\"\n$EndPhysicalNames\n\
        $Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 1 1 0\n$EndNodes\n\
        $Elements\n6\n1 15 2 1 1 2\n2 15 2 5 1 2\n3 15 2 5 2 3\n4 1 2 1 1 1 2\n\
        5 2 2 0 1 1 2 3\n6 2 2 0 1 2 4 3\n$EndElements\n";
    let AnyMesh::Flat(read) = read_msh(text.as_bytes()).unwrap() else { panic!("triangles") };
    let group = |id, name: &str, points: &[u32]| PointGroup {
        id,
        name: name.into(),
        points: points.to_vec(),
    };
    assert_eq!(read.tags.point_groups(), [group(1, "tip", &[1]), group(5, "points-5", &[2])]);
    assert_eq!(read.tags.facet_groups()[0].name, "rim");
    assert_eq!(read.skipped_cells, 1, "the point that is in a group before");
}

/// Numbers of groups that do not fit are left out, with no panic.
#[test]
fn groups_of_points_with_absurd_numbers_are_left_out() {
    let mesh = Delaunay::<2>::new().connect(&points(4), &mut Silent).unwrap();
    let absurd = |id| PointGroup { id, name: "well-1".into(), points: vec![3] };
    for id in [1 << 31, u32::MAX] {
        let tags = Tags::default().with_point_groups(&mesh, vec![absurd(id)]).unwrap();
        let data = MeshData::new(&mesh).with_tags(&tags);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        write_mesh_as(&path, MeshFormat::Npz, &data, &mut Silent).unwrap();
        let AnyMesh::Flat(read) = read_mesh(&path).unwrap() else { panic!("triangles") };
        assert_eq!((read.tags.point_groups().len(), read.skipped_cells), (0, 1));
    }
}
