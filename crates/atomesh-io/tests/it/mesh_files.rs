//! Mesh files: what is written is read back, what others wrote is read, what is broken is refused.

use std::io::Cursor;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use atomesh::image::Frame;
use atomesh::mesh::Mesh;
use atomesh::watch::{Phase, Silent, Watch};
use atomesh_io::mesh::msh::{MshEncoding, MshVersion, read_msh, write_msh};
use atomesh_io::mesh::npz::{read_npz, write_npz};
use atomesh_io::mesh::vtk::{read_vtk, write_vtk};
use atomesh_io::mesh::vtu::{read_vtu, write_vtu};
use atomesh_io::mesh::*;
use proptest::prelude::*;

const FORMATS: [MeshFormat; 7] = [
    MeshFormat::Vtu,
    MeshFormat::Vtk,
    MeshFormat::Npz,
    MeshFormat::Msh(MshVersion::V41, MshEncoding::Binary),
    MeshFormat::Msh(MshVersion::V41, MshEncoding::Text),
    MeshFormat::Msh(MshVersion::V22, MshEncoding::Binary),
    MeshFormat::Msh(MshVersion::V22, MshEncoding::Text),
];

fn write<const D: usize>(format: MeshFormat, data: &MeshData<D>) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let written = match format {
        MeshFormat::Vtu => write_vtu(&mut out, data, &mut Silent),
        MeshFormat::Vtk => write_vtk(&mut out, data, &mut Silent),
        MeshFormat::Npz => write_npz(&mut out, data, &mut Silent),
        MeshFormat::Msh(version, encoding) => {
            write_msh(&mut out, data, version, encoding, &mut Silent)
        }
        _ => unreachable!("{format:?} has no test"),
    };
    written.unwrap();
    out.into_inner()
}

fn read(format: MeshFormat, bytes: &[u8]) -> Result<AnyMesh, MeshReadError> {
    match format {
        MeshFormat::Vtu => read_vtu(bytes),
        MeshFormat::Vtk => read_vtk(bytes),
        MeshFormat::Npz => read_npz(bytes),
        MeshFormat::Msh(..) => read_msh(bytes),
        _ => unreachable!("{format:?} has no test"),
    }
}

/// Numbers between −1 and 1 that use all their digits.
fn noise(i: usize) -> f64 {
    ((i as f64 + 0.5) * 12.9898).sin() * (1.0 - 1.0 / 3.0)
}

/// A fan of `count` cells around shared points, with coordinates of all sizes.
fn fan<const D: usize>(count: usize) -> Mesh<D> {
    let points = (0..count + D).map(|i| {
        std::array::from_fn(|k| noise(3 * i + k) * 10f64.powi((i as i32 + k as i32) % 7 - 3))
    });
    // from the last cell to the first, so that the first corners have bytes above 127
    let corners = (0..count as u32).rev().flat_map(|i| (0..=D as u32).map(move |k| i + k));
    Mesh::new(points.collect(), corners.collect()).unwrap()
}

fn provenance() -> Provenance {
    Provenance {
        version: "0.1.0".into(),
        options: serde_json::json!({ "size": "6..18", "beta": 0.1, "odd": "<&\"$End] é" }),
        seed: u64::MAX,
        units: vec!["um".into(); 3],
        standing: None,
    }
}

/// A frame whose numbers need all 17 digits.
fn frame<const D: usize>() -> Frame<D> {
    let frame = Frame::new([9; D]).unwrap();
    frame.with_spacing([0.1; D]).unwrap().with_origin([1.0 / 3.0; D]).unwrap()
}

fn field(count: usize, scale: f64) -> Vec<f32> {
    (0..count).map(|i| (noise(i) * scale) as f32).collect()
}

/// Numbers that need double precision.
fn totals(count: usize) -> Vec<f64> {
    (0..count).map(|i| 16_777_217.0 + noise(i)).collect()
}

fn assert_same<const D: usize>(loaded: &LoadedMesh<D>, mesh: &Mesh<D>, fields: &[(&str, &[f32])]) {
    assert_eq!(&loaded.mesh, mesh);
    let quality: Vec<f64> = field(mesh.cell_count(), 1.0).into_iter().map(f64::from).collect();
    assert_eq!(loaded.cell_field("quality"), Some(quality.as_slice()));
    assert_eq!(loaded.cell_field("total"), Some(totals(mesh.cell_count()).as_slice()));
    assert_eq!(loaded.cell_fields.len(), 2);
    let found: Vec<_> =
        loaded.point_fields.iter().map(|f| (f.name.as_str(), f.values.as_slice())).collect();
    assert_eq!(found, fields);
    assert_eq!(loaded.frame, Some(frame()));
    assert_eq!(loaded.provenance, Some(provenance()));
    assert_eq!(loaded.skipped_cells, 0);
}

/// Writes a mesh in all formats and gives what is read back to `check`.
fn round_trip<const D: usize>(count: usize, check: impl Fn(AnyMesh, &Mesh<D>, &[(&str, &[f32])])) {
    let mesh = fan::<D>(count);
    let distance = field(mesh.points().len(), 10.0);
    let potential = field(mesh.points().len(), 1e-7);
    let (quality, total) = (field(mesh.cell_count(), 1.0), totals(mesh.cell_count()));
    let (provenance, frame) = (provenance(), frame());
    let data = MeshData::new(&mesh)
        .with_point_field("distance", &distance)
        .and_then(|d| d.with_point_field("potential", &potential))
        .and_then(|d| d.with_cell_field("quality", &quality))
        .and_then(|d| d.with_cell_field("total", &total))
        .unwrap()
        .with_frame(&frame)
        .with_provenance(&provenance);
    for format in FORMATS {
        let loaded =
            read(format, &write(format, &data)).unwrap_or_else(|e| panic!("{format:?}: {e}"));
        check(loaded, &mesh, &[("distance", &distance), ("potential", &potential)]);
    }
}

#[test]
fn flat_meshes_are_read_as_they_were_written() {
    for count in [1, 2, 500] {
        round_trip::<2>(count, |loaded, mesh, fields| match loaded {
            AnyMesh::Flat(loaded) => assert_same(&loaded, mesh, fields),
            AnyMesh::Volume(_) => panic!("a flat mesh was read as a volume"),
        });
    }
}

#[test]
fn volumes_are_read_as_they_were_written() {
    // 40,000 cells make several blocks of corners and of points
    for count in [1, 2, 40_000] {
        round_trip::<3>(count, |loaded, mesh, fields| match loaded {
            AnyMesh::Volume(loaded) => assert_same(&loaded, mesh, fields),
            AnyMesh::Flat(_) => panic!("a volume was read as a flat mesh"),
        });
    }
}

#[test]
fn the_bytes_do_not_depend_on_threads_or_time() {
    let mesh = fan::<3>(100_000);
    let values = field(mesh.points().len(), 1.0);
    let data = MeshData::new(&mesh).with_point_field("distance", &values).unwrap();
    for format in FORMATS {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| write(format, &data))
        };
        assert!(with(1) == with(3), "{format:?}");
    }
}

#[test]
fn the_size_of_a_vtu_is_as_when_it_was_measured() {
    // half of the plain bytes at most: compression happens, and blocks are not lost
    let mesh = fan::<3>(20_000);
    let plain = mesh.points().len() * 24 + mesh.cell_count() * (16 + 4 + 1);
    let size = write(MeshFormat::Vtu, &MeshData::new(&mesh)).len();
    assert!(size < plain * 9 / 10 && size > plain / 10, "{size} of {plain}");
}

fn data_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

#[test]
fn meshes_by_vtk_and_gmsh_are_read() {
    let corners = [[0.0, 0.0], [1.5, 0.0], [1.5, 1.0], [0.0, 1.0 / 3.0]];
    let mut count = 0;
    for entry in std::fs::read_dir(data_folder()).unwrap() {
        let path = entry.unwrap().path();
        if MeshFormat::of(&path).is_err() {
            continue;
        }
        count += 1;
        let AnyMesh::Flat(mesh) = read_mesh(&path).unwrap_or_else(|e| panic!("{path:?}: {e}"))
        else {
            panic!("{path:?} is not flat");
        };
        for (found, expected) in mesh.mesh.points().iter().zip(&corners) {
            // VTK writes legacy text with 11 digits
            assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-11), "{path:?}: {found:?}");
        }
        assert_eq!(mesh.mesh.points().len(), 4, "{path:?}");
        let area: f64 = mesh.mesh.cells().map(|c| area(&mesh.mesh, c)).sum();
        assert!((area - 1.0).abs() < 1e-10, "{path:?}: {area}");
        if path.file_name().unwrap().to_str().unwrap().starts_with("vtk") {
            assert_eq!(mesh.mesh.corners(), [0, 1, 2, 0, 2, 3], "{path:?}");
            assert_eq!(mesh.point_field("distance"), Some(&[1.0, 2.0, 3.0, 4.0][..]), "{path:?}");
            assert_eq!(mesh.provenance.as_ref().map(|p| p.seed), Some(7), "{path:?}");
        } else {
            assert_eq!(mesh.skipped_cells, 8, "{path:?}"); // four points and four lines
        }
    }
    assert_eq!(count, 11);
}

fn area(mesh: &Mesh<2>, cell: &[u32]) -> f64 {
    let [a, b, c] = [0, 1, 2].map(|k| mesh.points()[cell[k] as usize]);
    ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2.0
}

#[test]
fn paths_choose_the_format_and_half_files_do_not_stay() {
    struct Stop;
    impl Watch for Stop {
        fn step(&mut self, _: Phase, _: f64, _: Option<f64>) -> ControlFlow<()> {
            ControlFlow::Break(())
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let mesh = fan::<2>(3);
    for name in ["a.vtu", "a.vtk", "a.msh", "a.msh2", "a.MSH", "a.npz"] {
        let path = folder.path().join(name);
        write_mesh(&path, &MeshData::new(&mesh), &mut Silent).unwrap();
        match read_mesh(&path).unwrap() {
            AnyMesh::Flat(loaded) => assert_eq!(loaded.mesh, mesh),
            AnyMesh::Volume(_) => panic!("{name}"),
        }
    }
    let before = std::fs::read_dir(folder.path()).unwrap().count();
    let stopped = write_mesh(&folder.path().join("b.vtu"), &MeshData::new(&mesh), &mut Stop);
    assert!(matches!(stopped, Err(MeshWriteError::Cancelled(_))));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), before);
    for name in ["a.stl", "vtu", "a"] {
        let unknown = write_mesh(&folder.path().join(name), &MeshData::new(&mesh), &mut Silent);
        assert!(matches!(unknown, Err(MeshWriteError::Format(_))), "{name}");
    }
}

#[test]
fn fields_that_no_format_can_hold_are_refused() {
    let mesh = fan::<2>(3);
    let right = field(mesh.points().len(), 1.0);
    let with = |name, values| MeshData::new(&mesh).with_point_field(name, values);
    for name in ["", "two words", "a\"b", "<", "é", "points", "cells", "atomesh", "a/b"] {
        let refused = with(name, &right).unwrap_err();
        assert_eq!(refused, MeshDataError::FieldName { name: name.into() });
    }
    let short = with("distance", &right[1..]).unwrap_err();
    assert!(matches!(short, MeshDataError::FieldLength { expected: 5, found: 4, .. }));
    let twice = with("distance", &right).unwrap().with_point_field("distance", &right);
    assert!(matches!(twice, Err(MeshDataError::FieldName { .. })));
}

/// A VTU file in text of the given points and cells.
fn text_vtu(points: &[&str], cells: &[(&str, u8)]) -> String {
    let mut ends = vec![];
    let mut end = 0;
    for (corners, _) in cells {
        end += corners.split(' ').count();
        ends.push(end.to_string());
    }
    let corners: Vec<_> = cells.iter().map(|c| c.0).collect();
    let kinds: Vec<_> = cells.iter().map(|c| c.1.to_string()).collect();
    format!(
        "<VTKFile type='UnstructuredGrid'><UnstructuredGrid>\
         <Piece NumberOfPoints='{}' NumberOfCells='{}'>\
         <Points><DataArray type='Float64' NumberOfComponents='3'>{}</DataArray></Points>\
         <Cells><DataArray type='Int64' Name='connectivity'>{}</DataArray>\
         <DataArray type='Int64' Name='offsets'>{}</DataArray>\
         <DataArray type='UInt8' Name='types'>{}</DataArray></Cells>\
         </Piece></UnstructuredGrid></VTKFile>",
        points.len(),
        cells.len(),
        points.join(" "),
        corners.join(" "),
        ends.join(" "),
        kinds.join(" "),
    )
}

const CORNERS: [&str; 4] = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"];

#[test]
fn tetrahedra_win_over_the_triangles_of_their_surface() {
    let text = text_vtu(&CORNERS, &[("0 1 2", 5), ("0 1 2 3", 10), ("0 1", 3)]);
    let Ok(AnyMesh::Volume(mesh)) = read_vtu(text.as_bytes()) else { panic!("no volume") };
    assert_eq!((mesh.mesh.cell_count(), mesh.skipped_cells), (1, 2));
}

#[test]
fn errors_name_what_is_wrong() {
    let message = |text: &str| read_vtu(text.as_bytes()).unwrap_err().to_string();
    let good = text_vtu(&CORNERS, &[("0 1 2 3", 10)]);
    for (from, to, expected) in [
        ("0 1 2 3", "0 1 2 4", "expected a point below 4, found 4"),
        ("0 1 2 3", "0 1 2 -1", "a number in range in array \"connectivity\", found -1"),
        ("0 1 2 3", "0 1 2", "expected 4 numbers in array \"connectivity\", found 3"),
        ("1 0 0", "1 nan 0", "coordinate NaN along axis 1"),
        ("Piece NumberOfPoints='4'", "Piece NumberOfPoints='5'", "expected 15 numbers"),
        ("Piece NumberOfPoints='4'", "Piece NumberOfPoints='-4'", "a count in NumberOfPoints"),
        ("UnstructuredGrid'", "PolyData'", "VTK file type \"PolyData\" is not supported"),
        ("'Int64' Name='offsets'", "'Int64' Name='ends'", "expected offsets in <Cells>"),
        ("<VTKFile", "<KML", "expected <VTKFile>"),
        (">10<", ">12<", "no triangles or tetrahedra among 1 cells"),
        ("</VTKFile>", "<", "expected a name, found the end"),
    ] {
        assert!(good.contains(from));
        let message = message(&good.replacen(from, to, 1));
        assert!(message.contains(expected), "{from} → {to}: {message}");
    }
    let steep = text_vtu(&CORNERS, &[("0 1 3", 5)]);
    assert!(message(&steep).contains("z from 0 to 1; expected one z"));
}

#[test]
fn absurd_counts_are_refused_without_the_memory() {
    // each would take terabytes if it were believed
    let huge = (1u64 << 60).to_string();
    let vtu = text_vtu(&CORNERS, &[("0 1 2 3", 10)]);
    for count in ["NumberOfPoints='4'", "NumberOfCells='1'", "NumberOfComponents='3'"] {
        let (name, _) = count.split_once('=').unwrap();
        let text = vtu.replacen(count, &format!("{name}='{huge}'"), 1);
        assert!(read_vtu(text.as_bytes()).is_err(), "{count}");
    }
    let legacy = "# vtk DataFile Version 3.0\n\nBINARY\nDATASET UNSTRUCTURED_GRID\n";
    for section in ["POINTS % double", "CELLS 1 %", "CELL_TYPES %", "FIELD F 1\na % % float"] {
        let text = format!("{legacy}{}\n", section.replace('%', &huge));
        assert!(read_vtk(text.as_bytes()).is_err(), "{section}");
    }
    for text in [
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n% % 1 %\n2 1 0 %\n$EndNodes\n",
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 % 1 %\n2 1 0 %\n$EndNodes\n",
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%\n$EndNodes\n",
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Elements\n%\n1 2 2000000000 1\n$EndElements\n",
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$NodeData\n1\n\"a\"\n0\n3\n0\n1\n%\n$EndNodeData\n",
    ] {
        let text = text.replace('%', &huge);
        assert!(read_msh(text.as_bytes()).is_err(), "{text}");
    }
}

/// Readers take any bytes without a panic; most are refused.
fn read_everywhere(bytes: &[u8]) {
    for format in FORMATS {
        let _ = read(format, bytes);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn changed_files_are_read_or_refused_without_a_panic(
        format in 0..FORMATS.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>(),
        cuts in any::<bool>(),
    ) {
        let mesh = fan::<3>(5);
        let values = field(mesh.points().len(), 1.0);
        let data = MeshData::new(&mesh).with_point_field("distance", &values).unwrap();
        let mut bytes = write(FORMATS[format], &data);
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if cuts {
            bytes.truncate(cut.index(bytes.len()));
        }
        read_everywhere(&bytes);
    }

    #[test]
    fn changed_files_of_others_are_read_or_refused_without_a_panic(
        file in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let mut paths: Vec<_> =
            std::fs::read_dir(data_folder()).unwrap().map(|e| e.unwrap().path()).collect();
        paths.retain(|path| path.is_file()); // a folder holds the slices of a series
        paths.sort();
        let path = &paths[file.index(paths.len())];
        let mut bytes = std::fs::read(path).unwrap();
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        read_everywhere(&bytes);
    }

    #[test]
    fn any_bytes_are_refused_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        read_everywhere(&bytes);
    }
}
