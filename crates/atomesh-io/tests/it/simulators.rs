//! Grids for PFLOTRAN, TOUGH and OPM: read back as each program reads them, conductances by each program's own formula
//! are those of two-point flux.

use atomesh::features::FeatureFaces;
use atomesh::image::Frame;
use atomesh::mesh::{Delaunay, PolyMesh, connections};
use atomesh::voronoi::voronoi;
use atomesh::watch::Silent;
use atomesh_io::mesh::Provenance;
use atomesh_io::mesh::cells::{CellData, Rock, Simulator, SimulatorFiles, write_simulator};

/// Cells of sites all over a box and on its sides.
fn cells<const D: usize>(frame: &Frame<D>, delaunay: &Delaunay<D>) -> PolyMesh<D> {
    let bounds = frame.grid(atomesh::image::Units::Physical).bounds();
    let steps = [0.754_877, 0.569_84, 0.819_17];
    let place = |n: usize| -> [f64; D] {
        let share = |k: usize| (1.2 * (n as f64 * steps[k]).fract() - 0.1).clamp(0.0, 1.0);
        std::array::from_fn(|k| bounds.min[k] + share(k) * (bounds.max[k] - bounds.min[k]))
    };
    let mut sites: Vec<[f64; D]> = (0..50).map(place).collect();
    sites.sort_by(atomesh::geometry::lexicographic);
    sites.dedup();
    voronoi(delaunay, &sites, bounds, &mut Silent).unwrap()
}

/// The first face is sealed, the second lets a quarter through.
fn multipliers<const D: usize>(mesh: &PolyMesh<D>, second: f64) -> Vec<f64> {
    let mut all = vec![1.0; mesh.inner_face_count()];
    all[..2].copy_from_slice(&[0.0, second]);
    all
}

/// The texts of a simulator's files.
fn texts<const D: usize>(
    simulator: Simulator,
    frame: &Frame<D>,
    mesh: &PolyMesh<D>,
    rock: &Rock,
) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let files = SimulatorFiles::of(simulator, &folder.path().join("a.grid"), D);
    let provenance = Provenance {
        version: "0".into(),
        options: serde_json::json!({}),
        seed: 7,
        units: vec![],
        standing: None,
    };
    let features = FeatureFaces { of_faces: vec![], strengths: vec![], areas: vec![] };
    let wells = &[2];
    let data = CellData { mesh, features: &features, frame, provenance: &provenance, wells };
    write_simulator(&files, &data, rock, &mut Silent).unwrap();
    files.paths().iter().map(|path| std::fs::read_to_string(path).unwrap()).collect()
}

fn numbers(line: &str) -> Vec<f64> {
    line.split_whitespace().map(|word| word.parse().unwrap()).collect()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// What two-point flux lets through each open face, of unit permeability: the cells, and how much.
fn expected<const D: usize>(
    mesh: &PolyMesh<D>,
    multipliers: &[f64],
    thickness: f64,
) -> Vec<(usize, usize, f64)> {
    let faces = connections(mesh).into_iter().zip(multipliers);
    let open = faces.filter(|(_, multiplier)| **multiplier > 0.0);
    let one = |(face, multiplier): (atomesh::mesh::Connection<D>, &f64)| {
        let [a, b] = face.cells.map(|cell| cell as usize);
        (a, b, face.geometry() * thickness * multiplier)
    };
    open.map(one).collect()
}

fn check_pflotran<const D: usize>(frame: &Frame<D>, delaunay: &Delaunay<D>, thickness: f64) {
    let mesh = cells(frame, delaunay);
    let multipliers = multipliers(&mesh, 0.25);
    let k = vec![1.0; mesh.cell_count()];
    let rock = Rock { permeability: &k, multipliers: &multipliers, top: 5.0, thickness };
    let texts = texts(Simulator::Pflotran, frame, &mesh, &rock);
    let depth = if D == 2 { thickness } else { 1.0 };
    let mut lines = texts[0].lines();
    assert_eq!(lines.next(), Some(&*format!("CELLS {}", mesh.cell_count())));
    let centers: Vec<Vec<f64>> = lines.by_ref().take(mesh.cell_count()).map(numbers).collect();
    for (cell, (row, measure)) in centers.iter().zip(mesh.measures()).enumerate() {
        assert_eq!((row[0], row[4]), ((cell + 1) as f64, measure * depth));
        if D == 2 {
            assert_eq!(row[3], 5.0 - 0.5 * thickness);
        }
    }
    let expected = expected(&mesh, &multipliers, depth);
    assert_eq!(lines.next(), Some(&*format!("CONNECTIONS {}", expected.len())));
    for (line, (a, b, conductance)) in lines.zip(expected) {
        let row = numbers(line);
        assert_eq!((row[0], row[1]), ((a + 1) as f64, (b + 1) as f64));
        // PFLOTRAN adds the distances of both centres from the place
        let way = distance(&centers[a][1..4], &row[2..5]) + distance(&centers[b][1..4], &row[2..5]);
        assert!((row[5] / way - conductance).abs() < 1e-10 * conductance, "{a} {b}");
    }
    // the faces of a side have its area, and places off the centres
    assert_eq!(texts.len(), 2 + 2 * D);
    let site: Vec<String> = mesh.centers()[2].iter().map(|x| format!(",{x:?}")).collect();
    assert!(texts[1 + 2 * D].ends_with(&format!("\nwell-1,3{}\n", site.concat())));
    let extent = frame.grid(atomesh::image::Units::Physical).bounds().extent();
    for (side, text) in texts[1..=2 * D].iter().enumerate() {
        let rows: Vec<Vec<f64>> = text.lines().skip(1).map(numbers).collect();
        assert_eq!(text.lines().next(), Some(&*format!("CONNECTIONS {}", rows.len())));
        let area: f64 = rows.iter().map(|row| row[4]).sum();
        let whole: f64 = (0..D).filter(|k| *k != side / 2).map(|k| extent[k]).product();
        assert!((area - whole * depth).abs() < 1e-10 * area, "side {side}");
        for row in rows {
            let center = &centers[row[0] as usize - 1][1..4];
            assert!(distance(center, &row[1..4]) > 0.0, "PFLOTRAN divides by it");
        }
    }
}

#[test]
fn pflotrans_conductances_are_those_of_two_point_flux() {
    let frame = Frame::new([9, 7]).unwrap().with_spacing([2.0, 2.0]).unwrap();
    check_pflotran(&frame, &Delaunay::<2>::new(), 2.0);
    check_pflotran(&Frame::new([5, 4, 6]).unwrap(), &Delaunay::<3>::new(), 1.0);
}

#[test]
fn tough_reads_its_columns() {
    let frame = Frame::new([5, 4, 6]).unwrap().with_origin([430_000.0, 6_470_000.0, -1_500.0]);
    let frame = frame.unwrap();
    let mesh = cells(&frame, &Delaunay::<3>::new());
    let multipliers = multipliers(&mesh, 0.25);
    let k: Vec<f64> = (0..mesh.cell_count()).map(|cell| 1e-13 * (1.0 + cell as f64)).collect();
    let rock = Rock { permeability: &k, multipliers: &multipliers, top: 0.0, thickness: 1.0 };
    let text = &texts(Simulator::Tough, &frame, &mesh, &rock)[0];
    let (elements, connected) = text.split_once("\n\nCONNE\n").unwrap();
    let column = |line: &str, from: usize| line[from - 1..from + 9].trim().parse::<f64>().unwrap();
    let near = |found: f64, expected: f64| (found - expected).abs() <= 1e-4 * expected.abs() + 1e-9;
    let names: Vec<&str> = elements.lines().skip(1).map(|line| &line[..5]).collect();
    assert_eq!(names.len(), mesh.cell_count());
    for (line, (volume, (center, k))) in
        elements.lines().skip(1).zip(mesh.measures().iter().zip(mesh.centers().iter().zip(&k)))
    {
        assert!(near(column(line, 21), *volume) && near(column(line, 41), *k), "{line}");
        (0..3).for_each(|axis| assert!(near(column(line, 51 + 10 * axis), center[axis]), "{line}"));
    }
    let expected = expected(&mesh, &multipliers, 1.0);
    let rows: Vec<&str> = connected.lines().take_while(|line| !line.is_empty()).collect();
    assert_eq!(rows.len(), expected.len());
    for (line, (a, b, conductance)) in rows.iter().zip(expected) {
        assert_eq!((&line[..5], &line[5..10]), (names[a], names[b]));
        assert_eq!(line[25..30].trim(), "1");
        let found = column(line, 51) / (column(line, 31) + column(line, 41));
        assert!(near(found, conductance), "{line}: {found} for {conductance}");
        // the first element above the second: the sines of TOUGH's manual, z growing upwards
        let height = mesh.centers()[a][2] - mesh.centers()[b][2];
        let sine = height / distance(&mesh.centers()[a], &mesh.centers()[b]);
        assert!((column(line, 61) - sine).abs() < 1e-6, "{line}: {sine}");
    }
    assert!(connected.ends_with("\n\n"), "a block ends with an empty line");
}

fn check_opm<const D: usize>(frame: &Frame<D>, delaunay: &Delaunay<D>) {
    let mesh = cells(frame, delaunay);
    let multipliers = multipliers(&mesh, 1.0);
    let k = vec![1.0; mesh.cell_count()];
    let rock = Rock { permeability: &k, multipliers: &multipliers, top: 0.0, thickness: 1.0 };
    let text = &texts(Simulator::Opm, frame, &mesh, &rock)[0];
    let mut words = text.split_whitespace();
    let mut take = |count: usize| -> Vec<f64> {
        words.by_ref().take(count).map(|word| word.parse().unwrap()).collect()
    };
    let whole = |numbers: Vec<f64>| -> Vec<usize> { numbers.iter().map(|x| *x as usize).collect() };
    let [dimension, cell_count, face_count, point_count, corner_count, cell_faces] =
        whole(take(6))[..]
    else {
        panic!("six counts")
    };
    assert_eq!((dimension, cell_count), (D, mesh.cell_count()));
    assert_eq!(face_count, mesh.face_count() + 1, "the sealed face is two");
    assert_eq!(take(2), [0.0, 0.0]);
    take(D); // an index of cells that there is not
    assert_eq!(take(D * point_count), mesh.points().as_flattened());
    let starts = whole(take(face_count + 1));
    assert_eq!(starts[face_count], corner_count);
    let corners = take(corner_count);
    assert!(corners.iter().all(|corner| (*corner as usize) < point_count));
    let sides = take(2 * face_count);
    let areas = take(face_count);
    let places = take(D * face_count);
    let normals = take(D * face_count);
    let cell_starts = whole(take(cell_count + 1));
    assert_eq!(cell_starts[cell_count], cell_faces);
    let of_cells = whole(take(cell_faces));
    let volumes = take(cell_count);
    let centers = take(D * cell_count);
    assert_eq!(words.next(), None);
    assert_eq!(volumes, mesh.measures());
    // every cell has the faces that name it, and they are closed
    for cell in 0..cell_count {
        let faces = &of_cells[cell_starts[cell]..cell_starts[cell + 1]];
        let mut sum = vec![0.0; D];
        for &face in faces {
            let sign = match sides[2 * face..2 * face + 2] {
                [first, _] if first == cell as f64 => 1.0,
                [_, second] if second == cell as f64 => -1.0,
                _ => panic!("face {face} is not of cell {cell}"),
            };
            (0..D).for_each(|axis| sum[axis] += sign * normals[D * face + axis]);
        }
        assert!(sum.iter().all(|x| x.abs() < 1e-9), "cell {cell}: {sum:?}");
    }
    // half transmissibilities as OPM has them: normal · way / way²
    let half = |cell: usize, face: usize| -> f64 {
        let way: Vec<f64> = (0..D).map(|k| places[D * face + k] - centers[D * cell + k]).collect();
        let along: f64 = (0..D).map(|k| normals[D * face + k] * way[k]).sum();
        along.abs() / way.iter().map(|x| x * x).sum::<f64>()
    };
    let inner =
        (0..face_count).filter(|face| sides[2 * face..2 * face + 2].iter().all(|s| *s >= 0.0));
    let mut found: Vec<(usize, usize, f64)> = inner
        .map(|face| {
            let [a, b] = [sides[2 * face] as usize, sides[2 * face + 1] as usize];
            let normal = &normals[D * face..D * (face + 1)];
            assert!((distance(normal, &vec![0.0; D]) - areas[face]).abs() < 1e-12);
            (a, b, 1.0 / (1.0 / half(a, face) + 1.0 / half(b, face)))
        })
        .collect();
    found.sort_by_key(|(a, b, _)| (*a, *b));
    let mut expected = expected(&mesh, &multipliers, 1.0);
    expected.sort_by_key(|(a, b, _)| (*a, *b));
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(&expected) {
        assert_eq!((found.0, found.1), (expected.0, expected.1));
        assert!((found.2 - expected.2).abs() < 1e-9 * expected.2, "{found:?} for {expected:?}");
    }
}

#[test]
fn opms_conductances_are_those_of_two_point_flux() {
    let frame = Frame::new([9, 7]).unwrap().with_spacing([2.0, 2.0]).unwrap();
    check_opm(&frame, &Delaunay::<2>::new());
    check_opm(&Frame::new([5, 4, 6]).unwrap(), &Delaunay::<3>::new());
}
