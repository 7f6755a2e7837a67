//! Files of flow: velocities and pressures in VTU, fluxes as a table.

use atomesh::features::FeatureFaces;
use atomesh::geometry::Bounds;
use atomesh::image::Frame;
use atomesh::mesh::{Delaunay, Mesh, Quadratic};
use atomesh::voronoi::voronoi;
use atomesh::watch::Silent;
use atomesh_io::mesh::cells::CellData;
use atomesh_io::mesh::cells::{write_cells_vtu, write_cells_vtu_with};
use atomesh_io::mesh::vtu::write_broken_vtu;
use atomesh_io::mesh::{
    AnyMesh, CellFields, FacetFlux, FluxFiles, FluxTable, LoadedMesh, MeshData, Provenance,
    read_mesh, write_fluxes, write_mesh,
};

fn flat() -> Mesh<2> {
    let points = vec![[0.0, 0.0], [1.0, 0.0], [1.5, 1.0], [0.0, 1.0]];
    Mesh::new(points, vec![0, 1, 2, 0, 2, 3]).unwrap()
}

fn solid() -> Mesh<3> {
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]];
    Mesh::new(points, vec![0, 1, 2, 3, 1, 2, 3, 4]).unwrap()
}

/// The head of a VTU file.
fn head(bytes: &[u8]) -> String {
    let mark = b"<AppendedData";
    let at = bytes.windows(mark.len()).position(|w| w == mark).unwrap();
    String::from_utf8(bytes[..at].to_vec()).unwrap()
}

/// A pressure that is quadratic, and jumps by 100 from cell to cell.
fn pressure<const D: usize>(cell: usize, p: &[f64; D]) -> f64 {
    100.0 * cell as f64 + p.iter().map(|x| x * x + x).sum::<f64>()
}

/// Checks broken pressures of both orders. `read` gives the file's mesh.
fn jumps_stay<const D: usize>(mesh: &Mesh<D>, read: impl Fn(AnyMesh) -> LoadedMesh<D>) {
    let folder = tempfile::tempdir().unwrap();
    let velocities = vec![[0.25; D]; mesh.cell_count()];
    let frame = Frame::new([4; D]).unwrap();
    let means = vec![0.5_f64; mesh.cell_count()];
    let data = MeshData::new(mesh).with_frame(&frame);
    let data = data.with_cell_field("time_of_flight", &means).unwrap();
    let data = data.with_cell_vectors("velocity", &velocities).unwrap();
    let quadratic = Quadratic::new(mesh);
    for order in [1, 2, 3] {
        let path = folder.path().join(format!("{order}.vtu"));
        // the points that are asked for are those that Quadratic, in VTK's order too, has there
        let each = if order == 1 { D + 1 } else { Quadratic::<D>::NODES };
        let value = |cell: usize, node: usize, p: &[f64; D]| {
            let expected = quadratic.cells()[cell * Quadratic::<D>::NODES + node];
            assert!(node < each && quadratic.nodes()[expected as usize] == *p);
            pressure(cell, p)
        };
        let write = || {
            write_broken_vtu(&path, &data, order, &value, &mut Silent).unwrap();
            std::fs::read(&path).unwrap()
        };
        let bytes = write();
        assert_eq!(bytes, write());
        let head = head(&bytes);
        let points = mesh.cell_count() * each;
        assert!(head.contains(&format!("NumberOfPoints=\"{points}\"")), "{head}");
        assert!(head.contains("Name=\"velocity\" NumberOfComponents=\"3\""), "{head}");
        let loaded = read(read_mesh(&path).unwrap());
        assert_eq!(loaded.frame, Some(frame));
        assert_eq!(loaded.cell_field("time_of_flight"), Some(means.as_slice()));
        let values = loaded.point_field("pressure").unwrap();
        assert_eq!(loaded.mesh.cell_count(), mesh.cell_count());
        for (cell, (own, corners)) in mesh.cells().zip(loaded.mesh.cells()).enumerate() {
            for (corner, &point) in own.iter().zip(corners) {
                let place = &loaded.mesh.points()[point as usize];
                assert_eq!(place, &mesh.points()[*corner as usize]);
                // the reader keeps single precision
                assert_eq!(values[point as usize], pressure(cell, place) as f32);
            }
        }
    }
}

#[test]
fn a_broken_pressure_keeps_its_jumps() {
    jumps_stay(&flat(), |any| match any {
        AnyMesh::Flat(mesh) => mesh,
        AnyMesh::Volume(_) => panic!("triangles became tetrahedra"),
    });
    jumps_stay(&solid(), |any| match any {
        AnyMesh::Volume(mesh) => mesh,
        AnyMesh::Flat(_) => panic!("tetrahedra became triangles"),
    });
}

#[test]
fn vectors_stand_wherever_values_in_cells_do() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = solid();
    let velocities = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
    let pressures = [7.0_f64, 8.0];
    let with = || MeshData::new(&mesh).with_cell_field("pressure", &pressures[..]).unwrap();
    for name in ["a.vtu", "a.vtk", "a.msh", "a.npz", "a.inp"] {
        let path = folder.path().join(name);
        let data = with().with_cell_vectors("velocity", &velocities).unwrap();
        write_mesh(&path, &data, &mut Silent).unwrap();
        let AnyMesh::Volume(read) = read_mesh(&path).unwrap() else { panic!("{name} is flat") };
        assert_eq!(read.mesh, mesh);
        if name != "a.inp" {
            assert_eq!(read.cell_field("pressure"), Some(&pressures[..]), "{name}");
        }
        let bytes = std::fs::read(&path).unwrap();
        let holds = bytes.windows(8).any(|w| w == b"velocity");
        assert_eq!(holds, name != "a.inp", "{name}");
    }
    for odd in ["pressure", "points", "a b", ""] {
        assert!(with().with_cell_vectors(odd, &velocities).is_err(), "{odd}");
    }
    let error = with().with_cell_vectors("velocity", &velocities[..1]).unwrap_err();
    let expected = "field \"velocity\" has 1 values for 2 points or cells";
    assert_eq!(error.to_string(), expected);
}

/// The heads of files of Voronoi cells with and without fields.
fn heads_of_cells<const D: usize>(
    delaunay: &Delaunay<D>,
    sites: &[[f64; D]],
    bounds: Bounds<D>,
) -> [String; 2] {
    let mesh = voronoi(delaunay, sites, bounds, &mut Silent).unwrap();
    let (frame, features) = (Frame::new([4; D]).unwrap(), FeatureFaces::default());
    let provenance = Provenance {
        version: "0".into(),
        options: serde_json::json!({}),
        seed: 0,
        units: Vec::new(),
        standing: None,
    };
    let data = CellData {
        mesh: &mesh,
        features: &features,
        frame: &frame,
        provenance: &provenance,
        wells: &[],
    };
    let (pressures, velocities) = (vec![1.0; sites.len()], vec![[2.0; D]; sites.len()]);
    let fields = CellFields::new(sites.len()).with_numbers("pressure", &pressures).unwrap();
    let fields = fields.with_vectors("velocity", &velocities).unwrap();
    let mut out = [(); 2].map(|()| std::io::Cursor::new(Vec::new()));
    write_cells_vtu(&mut out[0], &data, &mut Silent).unwrap();
    write_cells_vtu_with(&mut out[1], &data, &fields, &mut Silent).unwrap();
    out.map(|out| head(&out.into_inner()))
}

#[test]
fn fields_of_voronoi_cells_are_cell_data() {
    let bounds = Bounds { min: [0.0; 2], max: [2.0; 2] };
    let sites = [[0.5, 0.5], [1.5, 0.4], [0.4, 1.5], [1.6, 1.7]];
    let flat = heads_of_cells(&Delaunay::<2>::new(), &sites, bounds);
    let bounds = Bounds { min: [0.0; 3], max: [2.0; 3] };
    let sites =
        [[0.5, 0.5, 0.5], [1.5, 0.4, 0.6], [0.4, 1.5, 0.3], [0.6, 0.7, 1.6], [1.4, 1.6, 1.5]];
    let solid = heads_of_cells(&Delaunay::<3>::new(), &sites, bounds);
    for [bare, with] in [flat, solid] {
        assert!(!bare.contains("Name=\"pressure\""));
        let cell_data =
            with.split_once("<CellData>").unwrap().1.split_once("</CellData>").unwrap().0;
        assert!(cell_data.contains("Name=\"pressure\""), "{with}");
        assert!(cell_data.contains("Name=\"velocity\" NumberOfComponents=\"3\""), "{with}");
    }
}

#[test]
fn fluxes_are_a_table_with_a_head() {
    let folder = tempfile::tempdir().unwrap();
    let files = FluxFiles::of(&folder.path().join("flow.json"));
    let inner = FacetFlux {
        cell: 0,
        neighbour: Some(1),
        centroid: [0.5, 1.0 / 3.0],
        area: [3.0, -4.0],
        flux: 0.1,
        multiplier: 0.0,
        group: "feature-1",
    };
    let facets = [
        inner,
        FacetFlux { cell: 1, neighbour: None, multiplier: 1.0, group: "a \"b\", c", ..inner },
    ];
    let table = FluxTable { facets: &facets, frame: None, provenance: None };
    write_fluxes(&files, &table, &mut Silent).unwrap();
    let text = std::fs::read_to_string(&files.facets).unwrap();
    let expected = "facet,cell,neighbour,area,normal_x,normal_y,face_x,face_y,flux,multiplier,group\n\
        0,0,1,5.0,0.6,-0.8,0.5,0.3333333333333333,0.1,0.0,feature-1\n\
        1,1,-1,5.0,0.6,-0.8,0.5,0.3333333333333333,0.1,1.0,\"a \"\"b\"\", c\"\n";
    assert_eq!(text, expected);
    let head: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&files.head).unwrap()).unwrap();
    assert_eq!(head["facets"]["file"], "flow-facets.csv");
    assert_eq!(head["facets"]["count"], 2);
    // the head describes no column that the table has not
    for name in head["columns"].as_object().unwrap().keys() {
        assert!(text.lines().next().unwrap().contains(name.as_str()), "{name}");
    }
}
