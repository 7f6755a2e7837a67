//! Voronoi cells for other simulators: read back as they were written, and right by MODFLOW's own formulas.

use std::path::Path;

use atomesh::features::FeatureFaces;
use atomesh::geometry::Point;
use atomesh::image::{Frame, Units};
use atomesh::mesh::{Delaunay, PolyFault, PolyMesh, connections};
use atomesh::voronoi::voronoi;
use atomesh::watch::Silent;
use atomesh_io::atomic_file::AtomicFile;
use atomesh_io::mesh::cells::{
    AnyCells, CellData, CellReadError, ConnectionFiles, Flow, LoadedCells, ModflowFiles, NO_CELL,
    Rock, read_cells, write_connections, write_connections_with_flow, write_modflow,
};
use atomesh_io::mesh::cells::{write_cells_vtu, write_cells_vtu_with};
use atomesh_io::mesh::{CellFields, Provenance};

/// A frame that turns, mirrors and stretches, with sites all over its box, sides included.
fn flat() -> (Frame<2>, PolyMesh<2>) {
    let frame = Frame::new([9, 7]).unwrap().with_spacing([2.0, 2.0]).unwrap();
    let frame = frame.with_origin([10.0, -3.0]).unwrap();
    let frame = frame.with_direction([[0.6, 0.8], [0.8, -0.6]]).unwrap();
    (frame, world(&frame, &Delaunay::<2>::new(), 40))
}

fn volume() -> (Frame<3>, PolyMesh<3>) {
    let frame = Frame::new([5, 4, 6]).unwrap().with_spacing([1.0, 2.0, 0.5]).unwrap();
    let turned = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    let frame = frame.with_direction(turned).unwrap();
    (frame, world(&frame, &Delaunay::<3>::new(), 60))
}

fn world<const D: usize>(frame: &Frame<D>, delaunay: &Delaunay<D>, count: usize) -> PolyMesh<D> {
    let bounds = frame.grid(Units::Physical).bounds();
    let steps = [0.754_877, 0.569_84, 0.819_17];
    let place = |n: usize| -> Point<D> {
        let share = |k: usize| (1.2 * (n as f64 * steps[k]).fract() - 0.1).clamp(0.0, 1.0);
        std::array::from_fn(|k| bounds.min[k] + share(k) * (bounds.max[k] - bounds.min[k]))
    };
    let mut sites: Vec<Point<D>> = (0..count).map(place).collect();
    sites.sort_by(atomesh::geometry::lexicographic);
    sites.dedup();
    let cells = voronoi(delaunay, &sites, bounds, &mut Silent).unwrap();
    cells.moved(frame.is_mirrored(), |p| frame.lattice_to_world(Units::Physical, p))
}

/// The first and third face lie on feature 1, the second on feature 2.
fn features<const D: usize>(mesh: &PolyMesh<D>) -> FeatureFaces {
    let mut of_faces = vec![0; mesh.face_count()];
    of_faces[..3].copy_from_slice(&[1, 2, 1]);
    FeatureFaces { of_faces, strengths: Vec::new(), areas: vec![2.0, 1.0] }
}

fn with_data<const D: usize>(
    frame: &Frame<D>,
    mesh: &PolyMesh<D>,
    use_it: impl FnOnce(&CellData<D>),
) {
    let options = serde_json::json!({ "lattice": { "units": "physical" } });
    let provenance =
        Provenance { version: "0".into(), options, seed: 7, units: Vec::new(), standing: None };
    let features = features(mesh);
    let wells = &[NO_CELL, 5];
    use_it(&CellData { mesh, features: &features, frame, provenance: &provenance, wells });
}

fn write_vtu<const D: usize>(path: &Path, data: &CellData<D>) {
    let mut file = AtomicFile::create(path).unwrap();
    write_cells_vtu(&mut file, data, &mut Silent).unwrap();
    file.commit().unwrap();
}

fn read_flat(path: &Path) -> LoadedCells<2> {
    match read_cells(path, &mut Silent).unwrap() {
        AnyCells::Flat(cells) => cells,
        AnyCells::Volume(_) => panic!("polyhedra"),
    }
}

fn read_volume(path: &Path) -> LoadedCells<3> {
    match read_cells(path, &mut Silent).unwrap() {
        AnyCells::Volume(cells) => cells,
        AnyCells::Flat(_) => panic!("polygons"),
    }
}

fn same<const D: usize>(read: &LoadedCells<D>, mesh: &PolyMesh<D>) {
    assert_eq!(read.mesh.owners(), mesh.owners());
    assert_eq!(read.mesh.neighbours(), mesh.neighbours());
    for (a, b) in read.mesh.points().iter().zip(mesh.points()) {
        let away = atomesh::geometry::distance_squared(a, b).sqrt();
        assert!(away < 1e-9, "{a:?}, expected {b:?}");
    }
}

#[test]
fn cells_are_read_back_as_they_were_written() {
    let folder = tempfile::tempdir().unwrap();
    let (vtu, list) = (folder.path().join("cells.vtu"), folder.path().join("cells.json"));
    let (frame, mesh) = flat();
    with_data(&frame, &mesh, |data| {
        write_vtu(&vtu, data);
        write_connections(&ConnectionFiles::of(&list), data, &mut Silent).unwrap();
    });
    assert_eq!(read_flat(&vtu).mesh, mesh);
    same(&read_flat(&list), &mesh);
    for file in [&vtu, &list] {
        assert_eq!(read_flat(file).wells, [NO_CELL, 5]);
        assert_eq!(read_flat(file).fields, []);
        assert_eq!(read_flat(file).features.of_faces, features(&mesh).of_faces);
        assert_eq!(read_flat(file).frame, frame);
    }
    let (frame, mesh) = volume();
    with_data(&frame, &mesh, |data| {
        write_vtu(&vtu, data);
        write_connections(&ConnectionFiles::of(&list), data, &mut Silent).unwrap();
    });
    assert_eq!(read_volume(&vtu).mesh, mesh);
    same(&read_volume(&list), &mesh);
    assert_eq!(read_volume(&vtu).features.of_faces, features(&mesh).of_faces);
    // polyhedra stand in another order in the file
    assert_eq!(read_volume(&vtu).wells, [NO_CELL, 5]);
}

/// Numbers of each cell, none of them alike.
fn with_fields<const D: usize>(path: &Path, frame: &Frame<D>, mesh: &PolyMesh<D>) {
    let (single, double) = (numbers(mesh, 0.5), numbers(mesh, 1.0 / 3.0));
    let single: Vec<f32> = single.into_iter().map(|x| x as f32).collect();
    let vectors: Vec<Point<D>> = mesh.centers().to_vec();
    let fields = CellFields::new(mesh.cell_count()).with_numbers("v", &single).unwrap();
    let fields = fields.with_numbers("w", &double).unwrap();
    let fields = fields.with_vectors("velocity", &vectors).unwrap();
    with_data(frame, mesh, |data| {
        let mut file = AtomicFile::create(path).unwrap();
        write_cells_vtu_with(&mut file, data, &fields, &mut Silent).unwrap();
        file.commit().unwrap();
    });
}

fn numbers<const D: usize>(mesh: &PolyMesh<D>, step: f64) -> Vec<f64> {
    (0..mesh.cell_count()).map(|cell| step * cell as f64).collect()
}

fn check_fields<const D: usize>(read: &LoadedCells<D>, mesh: &PolyMesh<D>) {
    let names: Vec<&str> = read.fields.iter().map(|field| field.name.as_str()).collect();
    assert_eq!(names, ["v", "w"]);
    assert_eq!(read.fields[0].values, numbers(mesh, 0.5));
    assert_eq!(read.fields[1].values, numbers(mesh, 1.0 / 3.0));
}

#[test]
fn fields_of_cells_are_read_back_in_the_meshs_order() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cells.vtu");
    let (frame, mesh) = flat();
    with_fields(&path, &frame, &mesh);
    check_fields(&read_flat(&path), &mesh);
    let (frame, mesh) = volume();
    with_fields(&path, &frame, &mesh);
    check_fields(&read_volume(&path), &mesh);
}

/// meshio puts polyhedra together by their number of points, and their data by that number ascending.
#[test]
fn polyhedra_stand_in_the_order_of_their_number_of_points() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cells.vtu");
    let (frame, mesh) = volume();
    with_data(&frame, &mesh, |data| write_vtu(&path, data));
    let points = |cell: usize| {
        let faces = mesh.faces_of(cell);
        let mut all: Vec<u32> = faces.flat_map(|(face, _)| mesh.face(face).to_vec()).collect();
        all.sort_unstable();
        all.dedup();
        all.len()
    };
    let counts: Vec<usize> = (0..mesh.cell_count()).map(points).collect();
    assert!(!counts.is_sorted(), "the mesh's own order shows nothing");
    let file = super::cell_files::arrays(&std::fs::read(&path).unwrap());
    let ends: Vec<usize> = super::cell_files::indices(&file["offsets"]);
    let sizes: Vec<usize> = ends
        .iter()
        .enumerate()
        .map(|(n, end)| end - if n == 0 { 0 } else { ends[n - 1] })
        .collect();
    assert!(sizes.is_sorted());
    let number = |b: &[u8]| u32::from_le_bytes(b.try_into().unwrap()) as usize;
    let cells: Vec<usize> = file["cell"].chunks_exact(4).map(number).collect();
    assert_eq!(sizes, cells.iter().map(|&cell| counts[cell]).collect::<Vec<_>>());
}

/// The frame of a survey, millions away from its origin, its samples a hundredth as large: coordinates have seven
/// digits left for a sample.
fn far<const D: usize>(frame: Frame<D>) -> Frame<D> {
    let frame = frame.with_spacing(frame.spacing().map(|step| 0.01 * step)).unwrap();
    frame.with_origin(std::array::from_fn(|k| [431_234.5, 6_471_111.25, -2_000.0][k])).unwrap()
}

#[test]
fn cells_as_written_are_valid_wherever_they_lie() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cells.vtu");
    for frame in [flat().0, far(flat().0)] {
        let mesh = world(&frame, &Delaunay::<2>::new(), 40);
        with_data(&frame, &mesh, |data| write_vtu(&path, data));
        assert_eq!(read_flat(&path).validate(), Ok(()));
    }
    for frame in [volume().0, far(volume().0)] {
        let mesh = world(&frame, &Delaunay::<3>::new(), 60);
        with_data(&frame, &mesh, |data| write_vtu(&path, data));
        assert_eq!(read_volume(&path).validate(), Ok(()));
    }
}

#[test]
fn cells_with_a_point_out_of_place_are_not_valid() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cells.vtu");
    let (frame, mesh) = volume();
    let on_side: Vec<u32> =
        (mesh.inner_face_count()..mesh.face_count()).flat_map(|f| mesh.face(f).to_vec()).collect();
    let inside = mesh.corners().iter().find(|corner| !on_side.contains(corner)).unwrap();
    let place = mesh.points()[*inside as usize];
    let shift = |p: &Point<3>| if *p == place { [p[0] + 1e-4, p[1] + 2e-4, p[2]] } else { *p };
    with_data(&frame, &mesh.moved(false, shift), |data| write_vtu(&path, data));
    let fault = read_volume(&path).validate().unwrap_err();
    assert!(matches!(fault, PolyFault::Convex { .. }), "{fault}");
}

/// A text file of unit squares in a row of two, as many as are given.
fn squares(count: usize, volume: f64) -> String {
    let metadata = r#"{"version":"0","seed":1,"options":{},"frame":{"shape":[3,2],"spacing":[1.0,1.0],
        "origin":[0.0,0.0],"direction":[[1.0,0.0],[0.0,1.0]]}}"#;
    let bytes: Vec<String> = metadata.bytes().map(|b| b.to_string()).collect();
    let array = |kind: &str, name: &str, components: usize, text: &str| {
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" \
             format=\"ascii\">{text}</DataArray>\n"
        )
    };
    let text = |words: &[&str]| words[..count].join(" ");
    [
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n",
        "<FieldData>\n",
        &array("UInt8", "atomesh", 1, &bytes.join(" ")),
        "</FieldData>\n",
        &format!("<Piece NumberOfPoints=\"6\" NumberOfCells=\"{count}\">\n<CellData>\n"),
        &array("Float64", "volume", 1, &vec![volume.to_string(); count].join(" ")),
        &array("Float64", "site", 3, &text(&["0.5 0.5 0", "1.5 0.5 0"])),
        "</CellData>\n<Points>\n",
        &array("Float64", "Points", 3, "0 0 0 1 0 0 2 0 0 0 1 0 1 1 0 2 1 0"),
        "</Points>\n<Cells>\n",
        &array("Int64", "connectivity", 1, &text(&["0 1 4 3", "1 2 5 4"])),
        &array("Int64", "offsets", 1, &text(&["4", "8"])),
        &array("UInt8", "types", 1, &text(&["7", "7"])),
        "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
    ]
    .concat()
}

#[test]
fn cells_that_leave_a_gap_or_are_not_those_of_their_volumes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cells.vtu");
    let read = |count, volume| {
        std::fs::write(&path, squares(count, volume)).unwrap();
        read_cells(&path, &mut Silent).map(|_| ()).map_err(|e| e.to_string())
    };
    assert_eq!(read(2, 1.0), Ok(()));
    let gap = "cell 0 has a face that is neither another cell's nor on a side of the image's box";
    assert_eq!(read(1, 1.0), Err(gap.to_string()));
    let volume = "cell 0 has the volume 1.5; the cell of its site has 1";
    assert_eq!(read(2, 1.5), Err(volume.to_string()));
}

#[test]
fn a_list_with_flow_keeps_its_permeability_as_a_field() {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("flow.json");
    let (frame, mesh) = volume();
    let k: Vec<f64> = (0..mesh.cell_count()).map(|cell| 1.0 + cell as f64).collect();
    let t: Vec<f64> = connections(&mesh).iter().map(|c| c.geometry()).collect();
    let flow = Flow { permeability: &k, transmissibilities: &t };
    let files = ConnectionFiles::of(&list);
    with_data(&frame, &mesh, |data| {
        write_connections_with_flow(&files, data, flow, &mut Silent).unwrap();
    });
    let read = read_volume(&list);
    assert_eq!((read.fields[0].name.as_str(), &read.fields[0].values), ("permeability", &k));
    let table = std::fs::read_to_string(&files.connections).unwrap();
    let column = table.lines().skip(1).map(|line| line.rsplit(',').next().unwrap());
    let found: Vec<f64> = column.map(|text| text.parse().unwrap()).collect();
    assert_eq!(found, t);
    let sides = std::fs::read_to_string(&files.boundary).unwrap();
    let on_side = |line: &&str| line.split(',').nth(3) == Some("0.0");
    assert!(sides.lines().filter(on_side).all(|line| line.ends_with(',')));
    assert!(sides.lines().any(|line| on_side(&line)), "some sites lie on sides");
}

#[test]
fn files_that_hold_no_such_cells_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("cells.json");
    let (frame, mesh) = flat();
    let files = ConnectionFiles::of(&list);
    with_data(&frame, &mesh, |data| write_connections(&files, data, &mut Silent).unwrap());
    let whole = std::fs::read_to_string(&files.cells).unwrap();
    let fails = |text: &str| {
        std::fs::write(&files.cells, text).unwrap();
        read_cells(&list, &mut Silent).unwrap_err()
    };
    // the site of the first cell a little away
    let row = whole.lines().nth(1).unwrap();
    let x = row.split(',').nth(1).unwrap();
    let moved = row.replacen(x, &format!("{:?}", x.parse::<f64>().unwrap() + 0.01), 1);
    let error = fails(&whole.replacen(row, &moved, 1));
    assert!(
        matches!(error, CellReadError::OtherCell { .. } | CellReadError::Voronoi(_)),
        "{error}"
    );
    let error = fails(&whole.replacen("site_x", "place_x", 1));
    assert!(error.to_string().contains("site_x"), "{error}");
    let error = fails(&whole.replacen(x, "east", 1));
    assert!(error.to_string().contains("line 2") && error.to_string().contains("east"), "{error}");
    std::fs::write(&list, "{}").unwrap();
    assert!(
        read_cells(&list, &mut Silent).unwrap_err().to_string().contains("list of connections")
    );
}

/// The rows of a block.
fn block<'a>(text: &'a str, name: &str) -> Vec<Vec<&'a str>> {
    let rest = text.split_once(&format!("BEGIN {name}\n")).expect("the block is there").1;
    let lines = rest.split_once("END ").unwrap().0.lines();
    lines.map(|line| line.split_whitespace().collect()).collect()
}

/// The numbers of an array of so many.
fn array(text: &str, name: &str, count: usize) -> Vec<f64> {
    let rest = text.split_once(&format!("\n  {name}\n")).expect("the array is there").1;
    let mut words = rest.split_whitespace();
    if words.next() == Some("CONSTANT") {
        return vec![words.next().unwrap().parse().unwrap(); count];
    }
    words.skip(2).take(count).map(|word| word.parse().unwrap()).collect()
}

fn written<const D: usize>(
    frame: &Frame<D>,
    mesh: &PolyMesh<D>,
    rock: &Rock,
    name: &str,
) -> [String; 3] {
    let folder = tempfile::tempdir().unwrap();
    let files = ModflowFiles::of(&folder.path().join(name), true);
    with_data(frame, mesh, |data| write_modflow(&files, data, rock, &mut Silent).unwrap());
    let paths = files.paths();
    std::array::from_fn(|n| std::fs::read_to_string(paths[n]).unwrap())
}

#[test]
fn a_layer_of_polygons_has_the_areas_of_the_cells_and_runs_clockwise() {
    let (frame, mesh) = flat();
    let k: Vec<f64> = (0..mesh.cell_count()).map(|cell| 0.5 + cell as f64).collect();
    let mut multipliers = vec![1.0; mesh.inner_face_count()];
    multipliers[..2].copy_from_slice(&[0.0, 0.25]);
    let rock = Rock { permeability: &k, multipliers: &multipliers, top: 5.0, thickness: 2.0 };
    let [disv, npf, hfb] = written(&frame, &mesh, &rock, "layer.disv");
    let points: Vec<[f64; 2]> = block(&disv, "VERTICES")
        .iter()
        .map(|row| [row[1].parse().unwrap(), row[2].parse().unwrap()])
        .collect();
    for (row, (area, site)) in
        block(&disv, "CELL2D").iter().zip(mesh.measures().iter().zip(mesh.centers()))
    {
        assert_eq!([row[1].parse::<f64>().unwrap(), row[2].parse().unwrap()], *site);
        let at = |n: usize| points[row[4 + n % (row.len() - 4)].parse::<usize>().unwrap() - 1];
        let count = row[3].parse::<usize>().unwrap();
        assert_eq!(count, row.len() - 4);
        let twice: f64 =
            (0..count).map(|n| at(n)[0] * at(n + 1)[1] - at(n)[1] * at(n + 1)[0]).sum();
        assert!((twice + 2.0 * area).abs() < 1e-10 * area, "clockwise: below 0");
    }
    assert_eq!(array(&disv, "TOP", 1), [5.0]);
    assert_eq!(array(&disv, "BOTM", 1), [3.0]);
    assert_eq!(array(&npf, "K", k.len()), k);
    let rows = block(&hfb, "PERIOD 1");
    let [a, b] = connections(&mesh)[1].cells.map(|cell| (cell + 1).to_string());
    assert_eq!(rows.len(), 2);
    assert_eq!(rows[0][4], "0.0", "sealed");
    assert_eq!(rows[1], ["1", &a, "1", &b, "-0.25"], "below 0: a multiplier");
}

/// In plan a polyhedron is convex, runs clockwise around its site, and holds all of its points.
fn in_plan(disu: &str, mesh: &PolyMesh<3>) {
    let number = |word: &&str| word.parse::<f64>().unwrap();
    let points: Vec<[f64; 2]> =
        block(disu, "VERTICES").iter().map(|row| [number(&row[1]), number(&row[2])]).collect();
    assert_eq!(points.len(), mesh.points().len());
    let rows = block(disu, "CELL2D");
    assert_eq!(rows.len(), mesh.cell_count());
    for (cell, row) in rows.iter().enumerate() {
        let site = mesh.centers()[cell];
        assert_eq!([number(&row[1]), number(&row[2])], [site[0], site[1]]);
        let around: Vec<[f64; 2]> =
            row[4..].iter().map(|word| points[word.parse::<usize>().unwrap() - 1]).collect();
        assert_eq!(row[3], around.len().to_string());
        let corners = mesh.faces_of(cell).flat_map(|(face, _)| mesh.face(face));
        let inside = corners.map(|&c| [mesh.points()[c as usize][0], mesh.points()[c as usize][1]]);
        for p in inside.chain([[site[0], site[1]]]) {
            for (k, a) in around.iter().enumerate() {
                let b = around[(k + 1) % around.len()];
                let turn = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
                assert!(turn < 1e-12, "cell {cell}: to the right of every side, or on it");
            }
        }
    }
}

#[test]
fn polyhedra_have_the_volumes_and_conductances_of_the_cells() {
    // cubic samples: the cells of a stretched frame would not stand at right angles
    let frame = Frame::new([5, 4, 6]).unwrap();
    let mesh = world(&frame, &Delaunay::<3>::new(), 60);
    let count = mesh.cell_count();
    let k: Vec<f64> = (0..count).map(|cell| 0.5 + cell as f64).collect();
    let multipliers = vec![1.0; mesh.inner_face_count()];
    let rock = Rock { permeability: &k, multipliers: &multipliers, top: 0.0, thickness: 1.0 };
    let [disu, npf, _] = written(&frame, &mesh, &rock, "cells.disu");
    let faces = connections(&mesh);
    let nja = count + 2 * faces.len();
    assert_eq!(
        block(&disu, "DIMENSIONS"),
        [
            ["NODES", &count.to_string()],
            ["NJA", &nja.to_string()],
            ["NVERT", &mesh.points().len().to_string()]
        ]
    );
    in_plan(&disu, &mesh);
    let of_cells = |name: &str| array(&disu, name, count);
    for cell in 0..count {
        let height = of_cells("TOP")[cell] - of_cells("BOT")[cell];
        let volume = of_cells("AREA")[cell] * height;
        assert!((volume / mesh.measures()[cell] - 1.0).abs() < 1e-12);
    }
    let of_pairs = |name: &str| array(&disu, name, nja);
    let (iac, ja, cl, width) =
        (of_cells("IAC"), of_pairs("JA"), of_pairs("CL12"), of_pairs("HWVA"));
    assert!(of_pairs("IHC").iter().all(|flag| *flag == 1.0));
    let permeability = array(&npf, "K", count);
    let mut starts = vec![0];
    iac.iter().for_each(|n| starts.push(starts.last().unwrap() + *n as usize));
    let entry = |cell: usize, other: usize| {
        let own = starts[cell] + 1..starts[cell + 1];
        own.clone().find(|&at| ja[at] as usize == other + 1).expect("a neighbour")
    };
    for cell in 0..count {
        assert_eq!(ja[starts[cell]] as usize, cell + 1, "its own number first");
    }
    for face in &faces {
        let [a, b] = face.cells.map(|cell| cell as usize);
        let (there, back) = (entry(a, b), entry(b, a));
        assert_eq!(width[there], width[back], "symmetric");
        // the harmonic mean of confined cells of height 1 (MODFLOW 6, NPF, equation 4-6)
        let conductance = width[there] * permeability[a] * permeability[b]
            / (permeability[a] * cl[back] + permeability[b] * cl[there]);
        let expected = face.area / (face.distances[0] / k[a] + face.distances[1] / k[b]);
        assert!((conductance / expected - 1.0).abs() < 1e-12);
    }
}

#[test]
fn two_squares_are_written_as_these_lines() {
    let frame = Frame::new([5, 3]).unwrap();
    let bounds = frame.grid(Units::Physical).bounds();
    let middle = |k: usize, share: f64| bounds.min[k] + share * (bounds.max[k] - bounds.min[k]);
    let sites = [0.25, 0.75].map(|share| [middle(0, share), middle(1, 0.5)]);
    let mesh = voronoi(&Delaunay::<2>::new(), &sites, bounds, &mut Silent).unwrap();
    let rock = Rock { permeability: &[2.0, 3.0], multipliers: &[0.5], top: 0.0, thickness: 10.0 };
    let [disv, npf, hfb] = written_without_features(&frame, &mesh, &rock);
    assert_eq!(disv, include_str!("../data/two-squares.disv"));
    assert_eq!(npf, include_str!("../data/two-squares.npf"));
    assert_eq!(hfb, include_str!("../data/two-squares.hfb"));
}

fn written_without_features(frame: &Frame<2>, mesh: &PolyMesh<2>, rock: &Rock) -> [String; 3] {
    let folder = tempfile::tempdir().unwrap();
    let files = ModflowFiles::of(&folder.path().join("two-squares.disv"), true);
    let provenance = Provenance {
        version: "0".into(),
        options: serde_json::json!({}),
        seed: 7,
        units: Vec::new(),
        standing: None,
    };
    let features = FeatureFaces::default();
    let data = CellData { mesh, features: &features, frame, provenance: &provenance, wells: &[1] };
    write_modflow(&files, &data, rock, &mut Silent).unwrap();
    let paths = files.paths();
    std::array::from_fn(|n| std::fs::read_to_string(paths[n]).unwrap())
}
