//! Files of Voronoi cells: what is written is read back by other means and keeps its promises.

use std::collections::HashMap;
use std::fs;
use std::io::{Cursor, Read};

use atomesh::features::FeatureFaces;
use atomesh::geometry::{Bounds, Point};
use atomesh::image::Frame;
use atomesh::mesh::{Delaunay, PolyMesh};
use atomesh::voronoi::voronoi;
use atomesh::watch::Silent;
use atomesh_io::mesh::Provenance;
use atomesh_io::mesh::cells::write_cells_vtu;
use atomesh_io::mesh::cells::{
    CellData, ConnectionFiles, NO_CELL, foam_mesh_of, write_connections,
};
use atomesh_io::mesh::openfoam::{CellZone, read_foam_mesh, write_foam_mesh};

/// A body-centred crystal in a box whose sides cut its cells.
fn crystal() -> PolyMesh<3> {
    let bounds = Bounds { min: [0.0; 3], max: [3.0, 2.0, 2.0] };
    let mut sites: Vec<Point<3>> = Vec::new();
    for n in 0..48 {
        let corner = [n % 4, n / 4 % 3, n / 12 % 4].map(f64::from);
        sites.push(corner);
        sites.push(corner.map(|x| x + 0.5));
    }
    sites.retain(|p| bounds.contains(p));
    voronoi(&Delaunay::<3>::new(), &sites, bounds, &mut Silent).unwrap()
}

fn flat() -> PolyMesh<2> {
    let bounds = Bounds { min: [0.0; 2], max: [4.0, 3.0] };
    let sites: Vec<Point<2>> = (0..40)
        .map(f64::from)
        .map(|n| [4.0 * (n * 0.754_877).fract(), 3.0 * (n * 0.569_84).fract()])
        .collect();
    voronoi(&Delaunay::<2>::new(), &sites, bounds, &mut Silent).unwrap()
}

fn unmarked<const D: usize>(mesh: &PolyMesh<D>) -> FeatureFaces {
    let mut of_faces = vec![0; mesh.face_count()];
    of_faces[0] = 1;
    let strengths = vec![0.0; mesh.inner_face_count()];
    FeatureFaces { of_faces, strengths, areas: vec![1.0] }
}

fn with_data<const D: usize, T>(mesh: &PolyMesh<D>, use_it: impl FnOnce(&CellData<D>) -> T) -> T {
    let frame = Frame::new([4; D]).unwrap();
    let options = serde_json::json!({});
    let provenance =
        Provenance { version: "0".into(), options, seed: 7, units: Vec::new(), standing: None };
    let features = unmarked(mesh);
    let wells = &[3, NO_CELL, 7];
    use_it(&CellData { mesh, features: &features, frame: &frame, provenance: &provenance, wells })
}

/// The arrays of a VTU file by name, as bytes, by what the format says and nothing of this crate.
pub fn arrays(file: &[u8]) -> HashMap<String, Vec<u8>> {
    let mark = b"<AppendedData encoding=\"raw\">\n_";
    let at = file.windows(mark.len()).position(|w| w == mark).unwrap();
    let (head, body) = (std::str::from_utf8(&file[..at]).unwrap(), &file[at + mark.len()..]);
    let word = |at: usize| u64::from_le_bytes(body[at..at + 8].try_into().unwrap()) as usize;
    let attribute = |tag: &str, name: &str| {
        let rest = tag.split_once(&format!("{name}=\"")).unwrap().1;
        rest.split_once('"').unwrap().0.to_owned()
    };
    let mut found = HashMap::new();
    for tag in head.split("<DataArray ").skip(1) {
        let offset: usize = attribute(tag, "offset").parse().unwrap();
        let blocks = word(offset);
        let (mut bytes, mut start) = (Vec::new(), offset + 24 + 8 * blocks);
        for block in 0..blocks {
            let size = word(offset + 24 + 8 * block);
            let part = &body[start..start + size];
            flate2::read::ZlibDecoder::new(part).read_to_end(&mut bytes).unwrap();
            start += size;
        }
        found.insert(attribute(tag, "Name"), bytes);
    }
    found
}

fn reals(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
}

pub fn indices(bytes: &[u8]) -> Vec<usize> {
    bytes.chunks_exact(8).map(|b| i64::from_le_bytes(b.try_into().unwrap()) as usize).collect()
}

fn vtu<const D: usize>(mesh: &PolyMesh<D>) -> HashMap<String, Vec<u8>> {
    let mut out = Cursor::new(Vec::new());
    with_data(mesh, |data| write_cells_vtu(&mut out, data, &mut Silent)).unwrap();
    arrays(&out.into_inner())
}

#[test]
fn polyhedra_in_a_file_are_closed_turned_outward_and_fill_the_box() {
    let mesh = crystal();
    let arrays = vtu(&mesh);
    let points: Vec<[f64; 3]> =
        reals(&arrays["Points"]).chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    let (faces, ends) = (indices(&arrays["faces"]), indices(&arrays["faceoffsets"]));
    let (corners, corner_ends) = (indices(&arrays["connectivity"]), indices(&arrays["offsets"]));
    assert_eq!(arrays["types"], vec![42; mesh.cell_count()]);
    let volumes = reals(&arrays["volume"]);
    let (mut total, mut start, mut corner_start) = (0.0, 0, 0);
    for cell in 0..mesh.cell_count() {
        let record = &faces[start..ends[cell]];
        start = ends[cell];
        let mut at = 1;
        let (mut edges, mut volume, mut named) = (Vec::new(), 0.0, Vec::new());
        for _ in 0..record[0] {
            let around = &record[at + 1..at + 1 + record[at]];
            at += 1 + around.len();
            assert!(around.len() >= 3);
            named.extend_from_slice(around);
            for k in 0..around.len() {
                edges.push((around[k], around[(k + 1) % around.len()]));
            }
            for k in 1..around.len() - 1 {
                let [a, b, c] = [0, k, k + 1].map(|n| points[around[n]]);
                let cross =
                    |k: usize| b[(k + 1) % 3] * c[(k + 2) % 3] - b[(k + 2) % 3] * c[(k + 1) % 3];
                volume += (0..3).map(|k| a[k] * cross(k)).sum::<f64>() / 6.0;
            }
        }
        assert_eq!(at, record.len());
        for &(a, b) in &edges {
            assert_eq!(edges.iter().filter(|e| **e == (b, a)).count(), 1, "cell {cell} is open");
        }
        named.sort_unstable();
        named.dedup();
        assert_eq!(named, corners[corner_start..corner_ends[cell]]);
        corner_start = corner_ends[cell];
        // coordinates up to 3: a few roundings of numbers near 30
        assert!((volume - volumes[cell]).abs() < 1e-13, "cell {cell}: {volume}");
        total += volume;
    }
    assert!((total - 12.0).abs() < 1e-11, "{total}");
}

#[test]
fn polygons_in_a_file_run_counter_clockwise_and_fill_the_box() {
    let mesh = flat();
    let arrays = vtu(&mesh);
    let points = reals(&arrays["Points"]);
    let (corners, ends) = (indices(&arrays["connectivity"]), indices(&arrays["offsets"]));
    assert_eq!(arrays["types"], vec![7; mesh.cell_count()]);
    let (mut total, mut start) = (0.0, 0);
    for &end in &ends {
        let around = &corners[start..end];
        start = end;
        let at = |k: usize| &points[3 * around[k % around.len()]..][..3];
        let twice: f64 =
            (0..around.len()).map(|k| at(k)[0] * at(k + 1)[1] - at(k + 1)[0] * at(k)[1]).sum();
        assert!(twice > 0.0);
        total += 0.5 * twice;
    }
    assert!((total - 12.0).abs() < 1e-12, "{total}");
}

#[test]
fn open_foam_s_folder_reads_back_closed_with_sides_and_features() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("polyMesh");
    for foam in [with_data(&crystal(), foam_mesh_of), with_data(&flat(), foam_mesh_of)] {
        let foam = foam.unwrap();
        write_foam_mesh(&path, &foam, &mut Silent).unwrap();
        let read = read_foam_mesh(&path).unwrap();
        assert_eq!(read.validate(), Ok(()));
        assert_eq!((read.cell_count(), read.face_count()), (foam.cell_count(), foam.face_count()));
        let names: Vec<&str> = read.patches().iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names[..4], ["xmin", "xmax", "ymin", "ymax"]);
        assert_eq!(read.face_zones()[0].name, "feature-1");
        assert_eq!(read.face_zones()[0].faces.len(), 1);
        let wells = [("well-1", 3), ("well-3", 7)];
        let wells = wells.map(|(name, cell)| CellZone { name: name.into(), cells: vec![cell] });
        assert_eq!(read.cell_zones(), wells);
    }
}

#[test]
fn a_list_of_connections_says_what_the_mesh_is() {
    let mesh = flat();
    let folder = tempfile::tempdir().unwrap();
    let files = ConnectionFiles::of(&folder.path().join("flow.json"));
    with_data(&mesh, |data| write_connections(&files, data, &mut Silent)).unwrap();
    let head: serde_json::Value = serde_json::from_slice(&fs::read(&files.head).unwrap()).unwrap();
    assert_eq!(head["cells"]["count"], 40);
    assert_eq!(head["connections"]["file"], "flow-connections.csv");
    assert_eq!(head["metadata"]["seed"], 7);
    let table = |path| -> Vec<Vec<String>> {
        let text = fs::read_to_string(path).unwrap();
        text.lines().skip(1).map(|l| l.split(',').map(str::to_owned).collect()).collect()
    };
    let (cells, inner, sides) =
        (table(&files.cells), table(&files.connections), table(&files.boundary));
    let number = |text: &String| text.parse::<f64>().unwrap();
    let total: f64 = cells.iter().map(|row| number(&row[3])).sum();
    assert!((total - 12.0).abs() < 1e-12);
    let of_wells = cells.iter().enumerate().filter(|(_, row)| row[6] != "0");
    let of_wells: Vec<_> = of_wells.map(|(cell, row)| (cell, row[6].as_str())).collect();
    assert_eq!(of_wells, [(3, "1"), (7, "3")]);
    // each cell's outward area vectors cancel, by the tables alone
    let mut open = vec![[0.0; 2]; 40];
    for row in &inner {
        assert_eq!(row.len(), 12);
        let (i, j): (usize, usize) = (row[0].parse().unwrap(), row[1].parse().unwrap());
        for k in 0..2 {
            let part = number(&row[2]) * number(&row[5 + k]);
            open[i][k] += part;
            open[j][k] -= part;
        }
        // the plane between two sites is half way, and square to the line between them
        assert!((number(&row[3]) - number(&row[4])).abs() < 1e-12);
        assert!((number(&row[10]) - 1.0).abs() < 1e-12);
    }
    for row in &sides {
        let cell: usize = row[0].parse().unwrap();
        (0..2).for_each(|k| open[cell][k] += number(&row[2]) * number(&row[4 + k]));
    }
    assert!(open.iter().flatten().all(|x| x.abs() < 1e-12));
    assert_eq!(inner[0][11], "1");
    assert!(inner[1..].iter().all(|row| row[11] == "0"));
}
