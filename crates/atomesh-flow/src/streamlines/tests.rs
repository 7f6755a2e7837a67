use std::f64::consts::PI;
use std::ops::ControlFlow;

use atomesh::geometry::{Bounds, Point, difference, distance_squared, dot};
use atomesh::mesh::{Delaunay, PolyMesh};
use atomesh::voronoi::voronoi;
use atomesh::watch::Silent;
use proptest::prelude::*;

use super::pieces::Neighbour;
use super::*;
use crate::problem::{Barrier, Boundary, Condition, Control, Problem, Value, Well};
use crate::solve::{SolveOptions, SolveReport};
use crate::test_meshes::{jittered_points, name_inner_facets, unit_box};
use crate::{dg, two_point};

fn fixed<const D: usize>(group: &str, pressure: f64) -> Boundary<'static, D> {
    let condition = Condition::Pressure(Value::Constant(pressure));
    Boundary { group: group.to_string(), condition }
}

/// All sides open.
fn open<const D: usize>() -> Problem<'static, D> {
    let names = ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"];
    let boundaries = names[..2 * D].iter().map(|name| fixed(name, 0.0)).collect();
    Problem { boundaries, ..Problem::default() }
}

/// The fluxes of a velocity that is the same everywhere.
fn uniform<const D: usize>(grid: &FlowGrid<D>, velocity: &Point<D>) -> Solution<D> {
    let fluxes = grid.facets().iter().map(|facet| dot(&facet.area, velocity)).collect();
    let count = grid.cell_count();
    let solve =
        SolveReport { method: "none", unknowns: 0, nonzeros: 0, iterations: 0, residual: 0.0 };
    let (pressures, sources) = (vec![0.0; count], vec![0.0; count]);
    Solution { pressures, fluxes, sources, wells: Vec::new(), pinned: Vec::new(), solve }
}

/// Voronoi cells of jittered points in the unit square or cube.
fn cells<const D: usize>(
    delaunay: Delaunay<D>,
    steps: usize,
    jitter: f64,
    seed: u64,
) -> PolyMesh<D> {
    let bounds = Bounds { min: [0.0; D], max: [1.0; D] };
    let inner = Bounds { min: [0.5 / steps as f64; D], max: [1.0 - 0.5 / steps as f64; D] };
    let sites = jittered_points(&inner, [steps - 1; D], jitter, seed);
    voronoi(&delaunay, &sites, bounds, &mut Silent).unwrap()
}

fn traced<const D: usize>(
    grid: &FlowGrid<D>,
    problem: &Problem<'_, D>,
    solution: &Solution<D>,
    count: usize,
) -> Vec<Streamline<D>> {
    let setting = Setting::new(problem, grid).unwrap();
    let options = TraceOptions { count, ..Default::default() };
    let lines = trace(grid, &setting, solution, &options, &mut Silent).unwrap();
    for line in &lines {
        assert_eq!(line.points.len(), line.times.len());
        assert_eq!(line.points.len(), line.cells.len() + 1);
        assert!(line.times.is_sorted() && line.times.iter().all(|t| t.is_finite()));
        // on the lattice of 10⁻¹² of the box, lines stay within it
        assert!(line.points.iter().flatten().all(|x| (-1e-12..=1.0 + 1e-12).contains(x)));
    }
    lines
}

fn uniform_flow_is_straight<const D: usize>(grid: &FlowGrid<D>, velocity: Point<D>) {
    let lines = traced(grid, &open(), &uniform(grid, &velocity), 60);
    assert_eq!(lines.len(), 60);
    for line in &lines {
        let first = line.points[0];
        for (point, time) in line.points.iter().zip(&line.times) {
            let expected: Point<D> = std::array::from_fn(|k| first[k] + velocity[k] * time);
            // rounding of some hundred steps
            assert!(distance_squared(point, &expected) < 1e-22, "{point:?} {expected:?}");
        }
        assert_eq!((line.end, line.from, line.to), (End::Boundary, None, None));
        let last = line.points.last().unwrap();
        assert!(last.iter().any(|x| (x - 1.0).abs() < 1e-11), "{last:?}");
    }
}

#[test]
fn uniform_flow_is_straight_and_on_time_in_triangles_and_tetrahedra() {
    uniform_flow_is_straight(&unit_box(Delaunay::<2>::new(), 9, 0.3, 1), [0.6, 0.25]);
    uniform_flow_is_straight(&unit_box(Delaunay::<3>::new(), 5, 0.3, 2), [0.6, 0.25, 0.1]);
}

#[test]
fn uniform_flow_is_straight_and_on_time_in_voronoi_cells() {
    uniform_flow_is_straight(
        &FlowGrid::of_cells(&cells(Delaunay::<2>::new(), 9, 0.3, 1), None),
        [0.6, 0.25],
    );
    uniform_flow_is_straight(
        &FlowGrid::of_cells(&cells(Delaunay::<3>::new(), 5, 0.3, 2), None),
        [0.6, 0.25, 0.1],
    );
}

#[test]
fn lines_start_at_equal_shares_of_the_flow() {
    // flow along x, so that shares of flow are shares of the side x = 0
    let grid = unit_box(Delaunay::<2>::new(), 7, 0.3, 3);
    let mut starts: Vec<f64> = traced(&grid, &open(), &uniform(&grid, &[2.0, 0.0]), 10)
        .iter()
        .map(|line| line.points[0][1])
        .collect();
    starts.sort_by(f64::total_cmp);
    for (number, start) in starts.iter().enumerate() {
        assert!((start - (number as f64 + 0.5) / 10.0).abs() < 1e-12, "{starts:?}");
    }
}

fn rate<const D: usize>(name: &str, place: Point<D>, rate: f64) -> Well<D> {
    Well { name: name.to_string(), place, control: Control::Rate(rate), radius: None }
}

fn answer<const D: usize>(grid: &FlowGrid<D>, problem: &Problem<'_, D>) -> Solution<D> {
    let setting = Setting::new(problem, grid).unwrap();
    match grid.cells() {
        Some(cells) => {
            two_point::solve(cells, grid, &setting, &SolveOptions::default(), &mut Silent).unwrap()
        }
        None => {
            let options = dg::DgOptions { order: 1, ..Default::default() };
            dg::solve(grid, &setting, &options, &mut Silent).unwrap().solution
        }
    }
}

/// A well of rate 1 in the middle of a square whose sides have the pressure of the exact field.
fn radial(grid: &FlowGrid<2>) -> (f64, f64) {
    let centre = [0.5; 2];
    let exact = |p: &Point<2>| -distance_squared(p, &centre).sqrt().ln() / (2.0 * PI);
    let condition = Condition::Pressure(Value::Field(&exact));
    let names = ["xmin", "xmax", "ymin", "ymax"];
    let side = |name: &&str| Boundary { group: name.to_string(), condition };
    let boundaries = names.iter().map(side).collect();
    let problem =
        Problem { wells: vec![rate("well", centre, 1.0)], boundaries, ..Problem::default() };
    let lines = traced(grid, &problem, &answer(grid, &problem), 64);
    assert!(lines.iter().all(|line| line.from == Some(0) && line.end == End::Boundary));
    assert!(lines.iter().all(|line| line.points[0] == centre));
    // the last points lie at all distances between the side's middle and the corner
    let ratio = |line: &Streamline<2>| {
        line.times.last().unwrap() / (PI * distance_squared(line.points.last().unwrap(), &centre))
    };
    let mean = lines.iter().map(ratio).sum::<f64>() / 64.0;
    let spread = lines.iter().map(|line| (ratio(line) - mean).abs()).fold(0.0, f64::max);
    (mean, spread)
}

#[test]
fn time_of_flight_from_a_well_is_the_pore_volume_over_the_rate() {
    // t = π r² / Q; the mesh resolves the well's star of cells with some twenty steps to the side
    for grid in [
        unit_box(Delaunay::<2>::new(), 40, 0.2, 5),
        FlowGrid::of_cells(&cells(Delaunay::<2>::new(), 41, 0.2, 5), None),
    ] {
        let (mean, spread) = radial(&grid);
        assert!((mean - 1.0).abs() < 0.02 && spread < 0.1, "{mean} {spread}");
    }
}

fn pair<const D: usize>(a: f64, b: f64) -> Problem<'static, D> {
    Problem {
        wells: vec![rate("in", [a; D], 1.0), rate("out", [b; D], -1.0)],
        ..Problem::default()
    }
}

fn all_lines_from_the_source_end_at_the_sink<const D: usize>(grid: &FlowGrid<D>) {
    let problem = pair::<D>(0.21, 0.77);
    let lines = traced(grid, &problem, &answer(grid, &problem), 40);
    assert_eq!(lines.len(), 40);
    for line in &lines {
        assert_eq!((line.from, line.to, line.end), (Some(0), Some(1), End::Well), "{line:?}");
        assert_eq!(*line.points.first().unwrap(), [0.21; D]);
        assert_eq!(*line.points.last().unwrap(), [0.77; D]);
    }
}

#[test]
fn all_lines_from_a_source_end_at_the_sink() {
    all_lines_from_the_source_end_at_the_sink(&unit_box(Delaunay::<2>::new(), 12, 0.2, 1));
    all_lines_from_the_source_end_at_the_sink(&unit_box(Delaunay::<3>::new(), 6, 0.2, 1));
    all_lines_from_the_source_end_at_the_sink(&FlowGrid::of_cells(
        &cells(Delaunay::<2>::new(), 12, 0.2, 1),
        None,
    ));
    all_lines_from_the_source_end_at_the_sink(&FlowGrid::of_cells(
        &cells(Delaunay::<3>::new(), 6, 0.2, 1),
        None,
    ));
}

#[test]
fn the_mean_time_of_flight_is_the_pore_volume_over_the_rate() {
    // each line stands for 1/n of the flow, and the tubes fill the square: Σ t Q / n = φ |box|; sampled by 400 lines,
    // of which the slowest, in the corners, carry little but last long
    let grid = unit_box(Delaunay::<2>::new(), 16, 0.2, 9);
    let problem = pair::<2>(0.21, 0.77);
    let setting = Setting::new(&problem, &grid).unwrap();
    let porosity = Porosity::Constant(0.2);
    let options = TraceOptions { count: 400, porosity, ..Default::default() };
    let solution = answer(&grid, &problem);
    let lines = trace(&grid, &setting, &solution, &options, &mut Silent).unwrap();
    let mean = lines.iter().map(|line| line.times.last().unwrap()).sum::<f64>() / 400.0;
    assert!((mean / 0.2 - 1.0).abs() < 0.03, "{mean}");
}

#[test]
fn no_line_crosses_a_sealed_wall() {
    let mut grid = unit_box(Delaunay::<2>::new(), 20, 0.0, 1);
    let on = |p: &Point<2>| (p[0] - 0.5).abs() < 1e-9 && p[1] < 0.81;
    name_inner_facets(&mut grid, "wall", on);
    let barriers = vec![Barrier { group: "wall".to_string(), multiplier: 0.0 }];
    let problem = Problem { barriers, ..pair(0.21, 0.77) };
    let lines = traced(&grid, &problem, &answer(&grid, &problem), 80);
    let mut crossings = 0;
    for line in &lines {
        assert_eq!(line.end, End::Well);
        for pair in line.points.windows(2) {
            let (a, b) = (pair[0][0] - 0.5, pair[1][0] - 0.5);
            if a * b > 0.0 || a == b {
                continue;
            }
            let y = pair[0][1] + (pair[1][1] - pair[0][1]) * a / (a - b);
            assert!(y > 0.8 - 1e-9, "{pair:?}");
            crossings += 1;
        }
    }
    assert!(crossings >= 80, "all lines pass above the wall");
}

fn inner_fluxes_balance<const D: usize>(delaunay: Delaunay<D>, steps: usize) {
    let mesh = cells(delaunay, steps, 0.3, 4);
    let grid = FlowGrid::of_cells(&mesh, None);
    let problem = pair::<D>(0.21, 0.77);
    let setting = Setting::new(&problem, &grid).unwrap();
    let solution = answer(&grid, &problem);
    let field = FluxField::new(&grid, &setting, &solution);
    for cell in 0..grid.cell_count() {
        let pieces = field.pieces(cell);
        let measure: f64 = pieces.iter().map(|piece| piece.measure).sum();
        assert!((measure / grid.measures()[cell] - 1.0).abs() < 1e-12);
        let net: f64 = pieces.iter().flat_map(|piece| piece.fluxes).sum();
        for (number, piece) in pieces.iter().enumerate() {
            let sum: f64 = piece.fluxes.iter().sum();
            // rates are 1
            assert!((sum - net * piece.measure / measure).abs() < 1e-13, "{piece:?}");
            for corner in 0..=D {
                if let Neighbour::Piece(other) = piece.beyond[corner] {
                    let other = &pieces[other as usize];
                    let back =
                        other.beyond.iter().position(|b| *b == Neighbour::Piece(number as u32));
                    assert_eq!(other.fluxes[back.unwrap()], -piece.fluxes[corner]);
                } else {
                    assert!(matches!(piece.beyond[corner], Neighbour::Facet(_)));
                }
            }
        }
    }
}

#[test]
fn fluxes_between_the_pieces_of_a_cell_balance() {
    inner_fluxes_balance(Delaunay::<2>::new(), 8);
    inner_fluxes_balance(Delaunay::<3>::new(), 5);
}

#[test]
fn times_of_cells_follow_uniform_flow_and_grow_along_lines() {
    let grid = unit_box(Delaunay::<2>::new(), 30, 0.2, 6);
    let problem =
        Problem { boundaries: vec![fixed("xmin", 1.0), fixed("xmax", 0.0)], ..Problem::default() };
    let setting = Setting::new(&problem, &grid).unwrap();
    let solution = uniform(&grid, &[2.0, 0.0]);
    let porosity = Porosity::Constant(0.5);
    let times = time_of_flight(&grid, &setting, &solution, porosity, &mut Silent).unwrap();
    for (time, centre) in times.iter().zip(grid.centroids()) {
        // φ x / v, to first order: a cell is 1/30 across
        assert!((time - 0.25 * centre[0]).abs() < 0.25 * 1.5 / 30.0, "{time} {centre:?}");
    }
}

#[test]
fn times_of_cells_conserve_volume_also_in_cycles() {
    let grid = unit_box(Delaunay::<2>::new(), 10, 0.3, 6);
    let problem = pair::<2>(0.21, 0.77);
    let setting = Setting::new(&problem, &grid).unwrap();
    let mut solution = answer(&grid, &problem);
    // an eddy around a point inside: fluxes that part a stream function, so that cells still balance
    let mesh = grid.mesh().unwrap();
    let eddy = (0..mesh.points().len() as u32)
        .find(|&p| {
            let near = mesh.points()[p as usize];
            distance_squared(&near, &[0.5; 2]) < 0.01
        })
        .unwrap();
    for (number, facet) in grid.facets().iter().enumerate() {
        let corners = grid.facet_corners(number).unwrap();
        let Some(at) = corners.iter().position(|&corner| corner == eddy) else { continue };
        let way =
            difference(&mesh.points()[corners[1 - at] as usize], &mesh.points()[eddy as usize]);
        let turn = way[0] * facet.area[1] - way[1] * facet.area[0];
        solution.fluxes[number] += 5.0 * turn.signum();
    }
    let porosity = Porosity::Constant(1.0);
    let times = time_of_flight(&grid, &setting, &solution, porosity, &mut Silent).unwrap();
    // nothing but rounding flows through a corner's cell with two sides on the boundary
    let inside = |f: &&u32| grid.facets()[**f as usize].neighbour.is_some();
    let passed = |cell: &usize| grid.facets_of(*cell).iter().filter(inside).count() > 1;
    let cells: Vec<usize> = (0..times.len()).filter(passed).collect();
    assert!(cells.iter().all(|&cell| times[cell].is_finite()));
    // what flows into the sink has been under way for the pore volume over the rate: Σ q⁻ τ = Σ φ |K|
    let pores: f64 = cells.iter().map(|&cell| grid.measures()[cell]).sum();
    let taken = cells.iter().map(|&cell| (-solution.sources[cell]).max(0.0) * times[cell]);
    let sum: f64 = taken.sum();
    assert!((sum - pores).abs() < 1e-9, "{sum} {pores}");
    let lines = traced(&grid, &problem, &solution, 50);
    assert!(lines.iter().all(|line| line.end == End::Well), "a line from outside enters no eddy");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn all_lines_end_whatever_the_fluxes(
        seed: u64, kind in 0_usize..4, x in 0.0_f64..1.0, y in 0.0_f64..1.0,
    ) {
        let problem = |grid: &FlowGrid<2>| {
            let place = if seed % 2 == 0 { [x, y] } else { grid.centroids()[0] };
            Problem { wells: vec![rate("in", place, 1.0)], ..open() }
        };
        let grid = match kind {
            0 | 1 => unit_box(Delaunay::<2>::new(), 5, 0.4, seed),
            _ => FlowGrid::of_cells(&cells(Delaunay::<2>::new(), 5, 0.45, seed), None),
        };
        let problem = problem(&grid);
        let mut solution = answer(&grid, &problem);
        if kind % 2 == 1 {
            // no balance at all, and lines that flow along facets
            for (number, flux) in solution.fluxes.iter_mut().enumerate() {
                *flux = f64::from((seed.rotate_left(number as u32) % 5) as u32) - 2.0;
            }
        }
        let setting = Setting::new(&problem, &grid).unwrap();
        let options = TraceOptions { count: 20, limit: 500, ..Default::default() };
        let lines = trace(&grid, &setting, &solution, &options, &mut Silent).unwrap();
        prop_assert_eq!(lines.len(), 20);
        for line in &lines {
            prop_assert!(line.points.iter().flatten().all(|x| (-1e-12..=1.0 + 1e-12).contains(x)));
            prop_assert!(line.cells.len() <= 502);
            prop_assert!(kind % 2 == 1 || line.end == End::Boundary, "{:?}", line);
        }
    }
}

#[test]
fn lines_have_the_same_bits_at_any_number_of_threads() {
    let grid = unit_box(Delaunay::<3>::new(), 4, 0.2, 1);
    let problem = pair::<3>(0.21, 0.77);
    let solution = answer(&grid, &problem);
    let lines = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| traced(&grid, &problem, &solution, 150))
    };
    assert_eq!(lines(1), lines(2));
}

struct Never;

impl Watch for Never {
    fn step(&mut self, phase: Phase, _: f64, _: Option<f64>) -> ControlFlow<()> {
        assert_eq!(phase, Phase::Trace);
        ControlFlow::Break(())
    }
}

#[test]
fn the_watch_ends_tracing_and_porosities_are_checked() {
    let grid = unit_box(Delaunay::<2>::new(), 3, 0.2, 1);
    let problem = open();
    let setting = Setting::new(&problem, &grid).unwrap();
    let solution = uniform(&grid, &[1.0, 0.0]);
    let options = TraceOptions::default();
    let fails = |options: &TraceOptions<'_>, watch: &mut dyn Watch| {
        trace(&grid, &setting, &solution, options, watch).unwrap_err()
    };
    assert!(matches!(fails(&options, &mut Never), FlowError::Cancelled(_)));
    let of = |porosity| TraceOptions { porosity, ..options };
    let error = fails(&of(Porosity::Constant(1.5)), &mut Silent);
    assert!(matches!(error, FlowError::Porosity { cell: 0, value: 1.5 }));
    let mut values = vec![0.2; grid.cell_count()];
    values[3] = 0.0;
    let error = fails(&of(Porosity::Cells(&values)), &mut Silent);
    assert!(matches!(error, FlowError::Porosity { cell: 3, .. }));
    let error = fails(&of(Porosity::Cells(&values[1..])), &mut Silent);
    assert!(matches!(error, FlowError::PorosityCount { .. }));
    let none = traced(&grid, &open(), &uniform(&grid, &[0.0; 2]), 10);
    assert!(none.is_empty(), "nothing flows");
}
