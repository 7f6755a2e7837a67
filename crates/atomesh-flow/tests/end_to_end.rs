//! From an image of fractures that block flow to pressures, beside the same problem on a mesh made of the
//! fractures themselves.

use atomesh::features::FeatureFacetOptions;
use atomesh::geometry::{Bounds, Point};
use atomesh::image::{Frame, Image, Samples};
use atomesh::mesh::{Delaunay, FacetGroup, Mesh, Tags};
use atomesh::run::{Inputs, MeshOptions, Method, Size, prepare};
use atomesh::watch::Silent;
use atomesh_flow::dg::{self, DgOptions, DgSolution};
use atomesh_flow::{Barrier, Boundary, Condition, FlowGrid, Problem, Setting, Value};

/// The side of the square, in samples.
const SIDE: f64 = 383.0;

/// Fractures by their ends: one alone, two that cross, one that slants.
const FRACTURES: [[Point<2>; 2]; 4] = [
    [[80.0, 60.0], [80.0, 260.0]],
    [[140.0, 120.0], [300.0, 280.0]],
    [[140.0, 280.0], [300.0, 120.0]],
    [[120.0, 336.0], [280.0, 316.0]],
];

/// The distance from a point to a segment.
fn distance(p: &Point<2>, [a, b]: &[Point<2>; 2]) -> f64 {
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let along = (u[0] * v[0] + u[1] * v[1]) / (u[0] * u[0] + u[1] * u[1]);
    let t = along.clamp(0.0, 1.0);
    (v[0] - t * u[0]).hypot(v[1] - t * u[1])
}

fn nearest(p: &Point<2>) -> f64 {
    FRACTURES.iter().map(|fracture| distance(p, fracture)).fold(f64::INFINITY, f64::min)
}

/// Dark lines of a standard deviation of one sample on white.
fn drawn() -> Image<2> {
    let side = SIDE as usize + 1;
    let grey = |i: usize| {
        let s = nearest(&[(i % side) as f64, (i / side) as f64]);
        (255.0 * (1.0 - (-s * s / 2.0).exp())).round() as u8
    };
    let samples = (0..side * side).map(grey).collect();
    Image::new(Frame::new([side, side]).unwrap(), Samples::U8(samples)).unwrap()
}

/// The mesh of the image, with the facets that follow its dark lines.
fn followed(image: &Image<2>, size: f64) -> (Mesh<2>, Tags<2>) {
    let options = MeshOptions { size: Size::Constant(size), ..Default::default() };
    let method = Method::plane();
    let prepared = prepare(&method, Inputs::image(image), options, &mut Silent).unwrap();
    let outcome = prepared.run(&mut Silent).unwrap();
    let mesh = outcome.world_mesh();
    let found = outcome.features(&mesh, &FeatureFacetOptions::default(), &mut Silent).unwrap();
    let tags = outcome.tags().unwrap().merge(found.tags(&mesh).unwrap()).unwrap();
    (mesh, tags)
}

/// A mesh whose edges run exactly along the fractures: points on them, a lattice beside them.
fn conforming(step: f64) -> (Mesh<2>, Tags<2>) {
    let mut points: Vec<Point<2>> = Vec::new();
    let mut ways: Vec<Vec<Point<2>>> = Vec::new();
    for [a, b] in FRACTURES {
        // an even number of pieces, so that the two that cross share the point in their middle
        let pieces = 2 * ((b[0] - a[0]).hypot(b[1] - a[1]) / step / 2.0).ceil() as usize;
        let at = |k: usize| {
            let t = k as f64 / pieces as f64;
            [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
        };
        let way: Vec<Point<2>> = (0..=pieces).map(at).collect();
        let new = way.iter().filter(|p| !points.contains(p)).copied().collect::<Vec<_>>();
        points.extend(new);
        ways.push(way);
    }
    let count = (SIDE / step).ceil() as usize;
    let pitch = SIDE / count as f64;
    for j in 0..=count {
        for i in 0..=count {
            // inner points turned a little off the square lattice, so that circles are of three points
            let inner = (1..count).contains(&i) && (1..count).contains(&j);
            let turn = if inner {
                0.15 * pitch * (12.9898 * i as f64 + 78.233 * j as f64).sin()
            } else {
                0.0
            };
            let p = [i as f64 * pitch + turn, j as f64 * pitch - turn];
            if nearest(&p) > 0.75 * step {
                points.push(p);
            }
        }
    }
    let mesh = Delaunay::<2>::new().connect(&points, &mut Silent).unwrap();
    let number = |p: &Point<2>| mesh.points().iter().position(|q| q == p).unwrap() as u32;
    let facets = ways.iter().flat_map(|way| way.windows(2));
    let facets = facets.map(|ends| [number(&ends[0]), number(&ends[1])]).collect();
    let group = FacetGroup { id: 9, name: "feature-1".to_string(), facets };
    let tags = Tags::new(&mesh, vec![group], None).expect("every piece is an edge");
    let bounds = Bounds { min: [0.0; 2], max: [SIDE; 2] };
    let sides = Tags::sides(&mesh, &bounds, 1e-9);
    (mesh, sides.merge(tags).unwrap())
}

/// Flow from left to right past sealed fractures.
fn solved(mesh: &Mesh<2>, tags: &Tags<2>, order: usize) -> (FlowGrid<2>, DgSolution<2>) {
    let grid = FlowGrid::of_mesh(mesh, tags);
    let side = |group: &str, pressure: f64| Boundary {
        group: group.to_string(),
        condition: Condition::Pressure(Value::Constant(pressure)),
    };
    let features = grid.sets().iter().filter(|set| set.name.starts_with("feature-"));
    let barriers: Vec<Barrier> =
        features.map(|set| Barrier { group: set.name.clone(), multiplier: 0.0 }).collect();
    assert!(!barriers.is_empty());
    let problem = Problem {
        boundaries: vec![side("xmin", 1.0), side("xmax", 0.0)],
        barriers,
        ..Problem::default()
    };
    let setting = Setting::new(&problem, &grid).unwrap();
    let options = DgOptions { order, ..DgOptions::default() };
    let answer = dg::solve(&grid, &setting, &options, &mut Silent).unwrap();
    assert!(answer.solution.balance(&grid).relative_error() < 1e-10);
    assert_eq!(answer.solution.leak(&grid, &setting), 0.0);
    (grid, answer)
}

/// The pressure at a place, the mean of the cells that hold it.
fn pressure(grid: &FlowGrid<2>, answer: &DgSolution<2>, place: &Point<2>) -> f64 {
    let cells = grid.cells_at(place);
    let sum: f64 = cells.iter().map(|&cell| answer.pressure(cell as usize, place)).sum();
    sum / cells.len() as f64
}

/// Places in rows and columns, even over the square.
fn places() -> impl Iterator<Item = Point<2>> {
    let count = 90;
    let at = move |k: usize| (k as f64 + 0.5) * SIDE / count as f64;
    (0..count * count).map(move |n| [at(n % count), at(n / count)])
}

/// ‖p − p_ref‖ / ‖p_ref‖ in L², by even samples.
fn relative_distance(
    reference: impl Fn(&Point<2>) -> f64,
    other: impl Fn(&Point<2>) -> f64,
) -> f64 {
    let (mut error, mut norm) = (0.0, 0.0);
    for place in places() {
        let p = reference(&place);
        error += (other(&place) - p).powi(2);
        norm += p * p;
    }
    (error / norm).sqrt()
}

#[test]
fn an_image_of_fractures_gives_the_pressures_of_the_fractures() {
    let (mesh, tags) = conforming(6.0);
    let (exact_grid, exact) = solved(&mesh, &tags, 2);
    let exact = |p: &Point<2>| pressure(&exact_grid, &exact, p);
    let (mesh, tags) = followed(&drawn(), 8.0);
    let (grid, answer) = solved(&mesh, &tags, 2);
    // most of it lies beside the fractures, which the mesh follows to half a sample: pressure jumps there
    let error = relative_distance(exact, |p| pressure(&grid, &answer, p));
    assert!(error <= 0.03, "{error}");
    // what this could not tell from an answer, were fractures of no consequence
    let without = relative_distance(exact, |p| 1.0 - p[0] / SIDE);
    assert!(without > 0.1, "{without}");
}

#[test]
fn the_reference_has_converged() {
    let answers = [12.0, 6.0].map(|step| {
        let (mesh, tags) = conforming(step);
        solved(&mesh, &tags, 2)
    });
    let [coarse, fine] = &answers;
    let change =
        relative_distance(|p| pressure(&fine.0, &fine.1, p), |p| pressure(&coarse.0, &coarse.1, p));
    assert!(change < 1e-3, "{change}");
}
