//! Values in cells go through every format that holds them, and stand in MSH files as other readers take them.

use std::collections::{BTreeMap, BTreeSet};

use atomesh::geometry::Bounds;
use atomesh::mesh::{Delaunay, FacetGroup, Mesh, Regions, Tags};
use atomesh::watch::Silent;
use atomesh_io::mesh::msh::{MshEncoding, MshVersion};
use atomesh_io::mesh::{
    AnyMesh, LoadedMesh, MeshData, MeshFormat, Provenance, read_mesh, write_mesh_as,
};

const V41: MeshFormat = MeshFormat::Msh(MshVersion::V41, MshEncoding::Text);
const V22: MeshFormat = MeshFormat::Msh(MshVersion::V22, MshEncoding::Text);

const FORMATS: [(&str, MeshFormat); 7] = [
    ("a.vtu", MeshFormat::Vtu),
    ("a.vtk", MeshFormat::Vtk),
    ("a.npz", MeshFormat::Npz),
    ("a.msh", MeshFormat::Msh(MshVersion::V41, MshEncoding::Binary)),
    ("b.msh", V41),
    ("a.msh2", MeshFormat::Msh(MshVersion::V22, MshEncoding::Binary)),
    ("b.msh2", V22),
];

fn flat() -> Mesh<2> {
    let place = |i: usize| [(i % 5) as f64, (i / 5) as f64 + 0.01 * (i * i % 7) as f64];
    Delaunay::<2>::new().connect(&(0..25).map(place).collect::<Vec<_>>(), &mut Silent).unwrap()
}

fn solid() -> Mesh<3> {
    let place = |i: usize| {
        let index = [i % 4, i / 4 % 4, i / 16];
        std::array::from_fn(|k| index[k] as f64 + 0.01 * ((i * i + k) % 7) as f64)
    };
    Delaunay::<3>::new().connect(&(0..64).map(place).collect::<Vec<_>>(), &mut Silent).unwrap()
}

/// Two groups of facets, which share one, and regions that change from cell to cell.
fn tags<const D: usize>(mesh: &Mesh<D>, regions: bool) -> Tags<D> {
    let sides = Tags::sides(mesh, &Bounds::of(mesh.points()).unwrap(), 0.5);
    let inside = mesh.facets().into_iter().filter(|facet| facet.neighbour.is_some());
    let inside: Vec<[u32; D]> = inside.take(6).map(|facet| facet.corners).collect();
    let group = |id, name: &str, facets: &[[u32; D]]| FacetGroup {
        id,
        name: name.into(),
        facets: facets.to_vec(),
    };
    let groups = vec![group(21, "feature-1", &inside[..4]), group(22, "feature-2", &inside[3..])];
    let of_cells = (0..mesh.cell_count()).map(|cell| [2, 1, -3][cell % 3]).collect();
    let regions = regions.then_some(Regions { of_cells, names: Vec::new() });
    sides.merge(Tags::new(mesh, groups, regions).unwrap()).unwrap()
}

/// What no other cell has.
fn values<const D: usize>(mesh: &Mesh<D>) -> Vec<f64> {
    (0..mesh.cell_count()).map(|cell| cell as f64 + 0.125).collect()
}

fn write<const D: usize>(
    path: &std::path::Path,
    format: MeshFormat,
    mesh: &Mesh<D>,
    tags: &Tags<D>,
) {
    let provenance = Provenance {
        version: "0.1.0".into(),
        options: serde_json::json!({}),
        seed: 7,
        units: Vec::new(),
        standing: None,
    };
    let (values, vectors) = (values(mesh), vec![[0.5; D]; mesh.cell_count()]);
    let data = MeshData::new(mesh).with_tags(tags).with_provenance(&provenance);
    let data = data.with_cell_field("v", &values).unwrap();
    let data = data.with_cell_vectors("velocity", &vectors).unwrap();
    write_mesh_as(path, format, &data, &mut Silent).unwrap();
}

fn check<const D: usize>(mesh: &Mesh<D>, pick: impl Fn(AnyMesh) -> LoadedMesh<D>) {
    let folder = tempfile::tempdir().unwrap();
    for tags in [Tags::default(), tags(mesh, false), tags(mesh, true)] {
        for (name, format) in FORMATS {
            let path = folder.path().join(name);
            write(&path, format, mesh, &tags);
            let read = pick(read_mesh(&path).unwrap_or_else(|e| panic!("{name}: {e}")));
            assert_eq!(&read.mesh, mesh, "{name}");
            assert_eq!(read.cell_field("v"), Some(values(mesh).as_slice()), "{name}");
            if format.holds_tags() {
                assert_eq!(read.tags.regions(), tags.regions(), "{name}");
                let ids = |tags: &Tags<D>| -> BTreeMap<String, u32> {
                    tags.facet_groups().iter().map(|g| (g.name.clone(), g.id)).collect()
                };
                assert_eq!(ids(&read.tags), ids(&tags), "{name}");
            }
        }
    }
}

#[test]
fn values_are_read_back_as_they_were_written() {
    check(&flat(), |any| if let AnyMesh::Flat(mesh) = any { mesh } else { panic!("a volume") });
    check(&solid(), |any| if let AnyMesh::Volume(mesh) = any { mesh } else { panic!("flat") });
}

/// The lines of a section of a text file.
fn section<'a>(text: &'a str, name: &str) -> Vec<Vec<&'a str>> {
    let (_, rest) = text.split_once(&format!("${name}\n")).unwrap();
    let (inside, _) = rest.split_once(&format!("$End{name}")).unwrap();
    inside.lines().map(|line| line.split_ascii_whitespace().collect()).collect()
}

/// An element of a text file: its number, and its nodes from 0 on.
type Element = (usize, Vec<u32>);

fn numbers(words: &[&str]) -> Vec<usize> {
    words.iter().map(|word| word.parse().unwrap()).collect()
}

/// The elements in the order in which they stand.
fn elements(text: &str, format: MeshFormat) -> Vec<Element> {
    let lines = section(text, "Elements");
    let mut found = Vec::new();
    let mut add = |number: usize, nodes: &[usize]| {
        found.push((number, nodes.iter().map(|&n| n as u32 - 1).collect()));
    };
    if format == V22 {
        for line in &lines[1..] {
            let all = numbers(line);
            add(all[0], &all[5..]);
        }
        return found;
    }
    let mut rest = &lines[1..];
    while let [head, tail @ ..] = rest {
        let (own, others) = tail.split_at(numbers(head)[3]);
        own.iter().map(|line| numbers(line)).for_each(|all| add(all[0], &all[1..]));
        rest = others;
    }
    found
}

fn check_order<const D: usize>(mesh: &Mesh<D>) {
    let folder = tempfile::tempdir().unwrap();
    let cell_of: BTreeMap<Vec<u32>, usize> =
        mesh.cells().enumerate().map(|(cell, corners)| (corners.to_vec(), cell)).collect();
    for (format, with_regions) in [(V41, false), (V41, true), (V22, false), (V22, true)] {
        let path = folder.path().join("a.msh");
        write(&path, format, mesh, &tags(mesh, with_regions));
        let text = std::fs::read_to_string(&path).unwrap();
        let elements = elements(&text, format);
        let (_, fields) = text.split_once("\"v\"\n").unwrap();
        let rows = fields.lines().skip(6).take_while(|line| !line.starts_with('$'));
        let rows: Vec<(usize, f64)> = rows
            .map(|row| row.split_once(' ').unwrap())
            .map(|(number, value)| (number.parse().unwrap(), value.parse().unwrap()))
            .collect();
        assert_eq!(rows.len(), elements.len(), "meshio refuses fields of a part of the elements");
        for (n, ((number, nodes), (of, value))) in elements.iter().zip(&rows).enumerate() {
            // meshio goes by the order, Gmsh by the numbers
            assert_eq!((*number, *of), (n + 1, n + 1));
            match cell_of.get(nodes) {
                Some(&cell) => assert_eq!(*value, values(mesh)[cell]),
                None => {
                    let own = mesh.cells().nth(*value as usize).unwrap();
                    assert!(nodes.iter().all(|node| own.contains(node)), "a cell beside the facet");
                }
            }
        }
    }
}

#[test]
fn all_elements_have_values_those_of_their_cells_numbered_as_they_stand() {
    check_order(&flat());
    check_order(&solid());
}

#[test]
fn no_two_groups_have_one_number_in_msh() {
    let folder = tempfile::tempdir().unwrap();
    for (format, with_regions) in [(V41, false), (V41, true), (V22, false), (V22, true)] {
        let path = folder.path().join("a.msh");
        let mesh = solid();
        let tags = tags(&mesh, with_regions);
        write(&path, format, &mesh, &tags);
        let text = std::fs::read_to_string(&path).unwrap();
        let names = section(&text, "PhysicalNames");
        let ids: BTreeSet<&str> = names[1..].iter().map(|line| line[1]).collect();
        assert_eq!(ids.len(), names.len() - 1, "{names:?}");
        // labels are what users ask for by number
        for label in if with_regions { vec!["1", "2"] } else { vec![] } {
            assert!(names.contains(&vec!["3", label, &format!("\"region-{label}\"")]), "{names:?}");
        }
    }
}

#[test]
fn vectors_have_three_components_in_every_format_that_holds_values() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = flat();
    let file = |name: &str, format| {
        let path = folder.path().join(name);
        write(&path, format, &mesh, &Tags::default());
        std::fs::read(&path).unwrap()
    };
    let holds = |bytes: &[u8], text: &str| bytes.windows(text.len()).any(|w| w == text.as_bytes());
    let count = mesh.cell_count();
    let msh = file("a.msh", V41);
    let head = format!("\"velocity\"\n1\n0\n3\n0\n3\n{count}\n1 5.0000000000000000e-1 ");
    assert!(holds(&msh, &head), "{}", String::from_utf8_lossy(&msh));
    assert!(holds(&file("a.vtk", MeshFormat::Vtk), &format!("velocity 3 {count} double\n")));
    let shape = format!("'shape': ({count}, 2)");
    let npz = file("a.npz", MeshFormat::Npz);
    assert!(holds(&npz, "cell.velocity.npy") && holds(&npz, &shape));
}
