//! What holds of every mesh: symmetry, stability, constants, size, threads; and what is refused.

use atomesh::geometry::{Bounds, Point};
use atomesh::mesh::{Delaunay, Mesh};
use atomesh::voronoi::voronoi;
use atomesh::watch::Silent;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::super::*;
use super::SCHEMES;
use super::linear::random_tensor;
use crate::grid::FlowGrid;
use crate::permeability::Permeability;
use crate::problem::{Barrier, Boundary, Condition, Control, Problem, Value, Well};
use crate::solve::Sparse;
use crate::test_meshes::{grid as grid_of, name_inner_facets, unit_box};

/// Pressure on one side, a well of given pressure, a partly sealing and a sealing wall, and a tensor for each cell.
fn everything<'a, const D: usize>(grid: &mut FlowGrid<D>) -> Problem<'a, D> {
    name_inner_facets(grid, "partly", |x| x[0] < 0.45);
    name_inner_facets(grid, "sealed", |x| x[0] > 0.6 && x[1] > 0.6);
    let barrier = |group: &str, multiplier: f64| Barrier { group: group.to_string(), multiplier };
    let tensor = |cell: usize| random_tensor::<D>(cell as u64);
    Problem {
        permeability: Permeability::CellTensors((0..grid.cell_count()).map(tensor).collect()),
        boundaries: vec![Boundary {
            group: "xmin".to_string(),
            condition: Condition::Pressure(Value::Constant(7.0)),
        }],
        wells: vec![Well {
            name: "well".to_string(),
            place: [0.4; D],
            control: Control::Pressure(7.0),
            radius: Some(1e-3),
        }],
        barriers: vec![barrier("partly", 0.3), barrier("sealed", 0.0)],
        ..Problem::default()
    }
}

fn matrix<const D: usize>(
    grid: &FlowGrid<D>,
    setting: &Setting<'_, D>,
    options: &DgOptions,
) -> Sparse {
    let scheme = Scheme::new(grid, setting, options).unwrap();
    assemble::matrix(&scheme, &mut Silent).unwrap()
}

/// The least eigenvalue of a symmetric matrix over the largest entry.
fn least_eigenvalue(matrix: &Sparse) -> f64 {
    let n = matrix.row_count();
    let mut dense = faer::Mat::<f64>::zeros(n, n);
    for (row, column, value) in matrix.entries() {
        dense[(row, column)] = value;
    }
    let largest = matrix.entries().fold(0.0_f64, |most, entry| most.max(entry.2.abs()));
    for (row, column, value) in matrix.entries() {
        assert!((value - dense[(column, row)]).abs() <= 1e-14 * largest, "{row} {column}");
    }
    let values = dense.self_adjoint_eigenvalues(faer::Side::Lower).unwrap();
    values.iter().copied().fold(f64::INFINITY, f64::min) / largest
}

fn is_symmetric_and_definite<const D: usize>(delaunay: Delaunay<D>, orders: &[usize]) {
    let mut grid = unit_box(delaunay, 3, 0.3, 2);
    let problem = everything(&mut grid);
    let setting = Setting::new(&problem, &grid).unwrap();
    for &order in orders {
        let least = |penalty: f64| {
            let options = DgOptions { order, penalty, ..DgOptions::default() };
            least_eigenvalue(&matrix(&grid, &setting, &options))
        };
        // at the bound itself; eigenvalues are known to rounding of the largest
        assert!(least(1.0) > 1e-12, "{D}-D {order}: {:e}", least(1.0));
        // and the bound is none too far: a sixth of it, which options do not allow, is too little
        assert!(least(1.0 / 6.0) < -1e-9, "{D}-D {order}: {:e}", least(1.0 / 6.0));
    }
}

#[test]
fn the_penalty_needs_no_tuning_whatever_the_permeability() {
    is_symmetric_and_definite(Delaunay::<2>::new(), &[1, 2, 3]);
    is_symmetric_and_definite(Delaunay::<3>::new(), &[1]);
}

fn fluxes_are_those_of_the_equations<const D: usize>(delaunay: Delaunay<D>, scheme: (Form, usize)) {
    let mut grid = unit_box(delaunay, 3, 0.3, 2);
    let mut problem = everything(&mut grid);
    let field = |x: &Point<D>| 5.0 + x[0] - 3.0 * x[1];
    let condition = Condition::Flux(Value::Field(&field));
    problem.boundaries.push(Boundary { group: "ymax".to_string(), condition });
    problem.boundaries[0].condition = Condition::Pressure(Value::Field(&field));
    problem.source = Some(Value::Field(&field));
    let barriers = std::mem::take(&mut problem.barriers);
    problem.barriers = barriers.into_iter().filter(|b| b.multiplier > 0.0).collect();
    let setting = Setting::new(&problem, &grid).unwrap();
    let options = DgOptions { form: scheme.0, order: scheme.1, ..DgOptions::default() };
    let scheme = Scheme::new(&grid, &setting, &options).unwrap();
    let (loads, matrix) = (loads::loads(&scheme), matrix(&grid, &setting, &options));
    let mut random = Pcg64::seed_from_u64(1);
    let any: Vec<f64> = loads.rhs.iter().map(|_| random.random_range(-1.0..1.0)).collect();
    let count = scheme.element.count();
    let means = |cell: u32| any[cell as usize * count];
    let mut excess = loads.sources.clone();
    for well in &scheme.pressure_wells {
        let share = |cell: u32| grid.measures()[cell as usize] / well.measure;
        let mean: f64 = well.cells.iter().map(|&cell| share(cell) * means(cell)).sum();
        for &cell in &well.cells {
            excess[cell as usize] += share(cell) * well.index * (well.pressure - mean);
        }
    }
    for (number, facet) in grid.facets().iter().enumerate() {
        let flux = scheme.flux(number, &any);
        excess[facet.cell as usize] -= flux;
        if let Some(other) = facet.neighbour {
            excess[other as usize] += flux;
        }
    }
    let largest = matrix.entries().fold(0.0_f64, |most, entry| most.max(entry.2.abs()));
    let left = product(&matrix, &any);
    for (cell, excess) in excess.into_iter().enumerate() {
        let residual = loads.rhs[cell * count] - left[cell * count];
        // rounding of sums of some hundred terms
        assert!((residual - excess).abs() <= 1e-13 * largest, "{D}-D: {residual} {excess}");
    }
}

#[test]
fn a_cells_equation_is_its_mass_balance_whatever_the_pressures() {
    for scheme in SCHEMES {
        fluxes_are_those_of_the_equations(Delaunay::<2>::new(), scheme);
        fluxes_are_those_of_the_equations(Delaunay::<3>::new(), scheme);
    }
}

#[test]
fn cells_balance_where_little_flows_beside_what_could() {
    let mut grid = unit_box(Delaunay::<2>::new(), 8, 0.2, 2);
    name_inner_facets(&mut grid, "partly", |x| x[0] < 0.45);
    let fixed = |group: &str, pressure: f64| Boundary {
        group: group.to_string(),
        condition: Condition::Pressure(Value::Constant(pressure)),
    };
    let k = |x: &Point<2>| if (0.4..0.6).contains(&x[0]) { 1e-9 } else { 10.0 };
    let problem = Problem {
        permeability: Permeability::Cells(grid.centroids().iter().map(k).collect()),
        boundaries: vec![fixed("xmin", 1e3), fixed("xmax", 1e3 + 1.0)],
        barriers: vec![Barrier { group: "partly".to_string(), multiplier: 1e-3 }],
        ..Problem::default()
    };
    let setting = Setting::new(&problem, &grid).unwrap();
    for (form, order) in SCHEMES {
        let options = DgOptions { form, order, ..DgOptions::default() };
        let solution = solve(&grid, &setting, &options, &mut Silent).unwrap().solution;
        let balance = solution.balance(&grid);
        assert!(balance.scale > 1e-12 && balance.relative_error() <= 1e-10, "{balance:?}");
    }
}

fn a_constant_is_exact<const D: usize>(delaunay: Delaunay<D>, orders: &[(Form, usize)]) {
    let mut grid = unit_box(delaunay, 3, 0.3, 2);
    let problem = everything(&mut grid);
    let setting = Setting::new(&problem, &grid).unwrap();
    let fixed: Vec<bool> = setting.compartments().iter().map(|c| c.has_pressure).collect();
    assert!(fixed.iter().any(|fixed| *fixed));
    for &(form, order) in orders {
        let options = DgOptions { form, order, ..DgOptions::default() };
        let solution = solve(&grid, &setting, &options, &mut Silent).unwrap().solution;
        for (cell, pressure) in solution.pressures.iter().enumerate() {
            let fixed = fixed[setting.compartment_of()[cell] as usize];
            assert_eq!(*pressure, if fixed { 7.0 } else { 0.0 });
        }
        assert!(solution.fluxes.iter().all(|flux| *flux == 0.0));
    }
}

#[test]
fn a_constant_pressure_makes_no_flow_at_all() {
    a_constant_is_exact(Delaunay::<2>::new(), &SCHEMES);
    a_constant_is_exact(Delaunay::<3>::new(), &SCHEMES[..2]);
}

/// The pressures of a flow from the side to the well, on a mesh `size` times as large.
fn pressures<const D: usize>(grid: &FlowGrid<D>, size: f64) -> Vec<f64> {
    let mesh = grid.mesh().unwrap();
    let points = mesh.points().iter().map(|x| x.map(|x| size * x)).collect();
    let grid = grid_of(&Mesh::new(points, mesh.corners().to_vec()).unwrap(), Vec::new());
    let problem = Problem {
        boundaries: vec![Boundary {
            group: "xmin".to_string(),
            condition: Condition::Pressure(Value::Constant(1.0)),
        }],
        wells: vec![Well {
            name: "well".to_string(),
            place: [0.6 * size; D],
            control: Control::Rate(size.powi(D as i32 - 2)),
            radius: None,
        }],
        ..Problem::default()
    };
    let setting = Setting::new(&problem, &grid).unwrap();
    solve(&grid, &setting, &DgOptions::default(), &mut Silent).unwrap().solution.pressures
}

#[test]
fn size_does_not_matter() {
    fn check<const D: usize>(delaunay: Delaunay<D>) {
        let grid = unit_box(delaunay, 3, 0.2, 6);
        let expected = pressures(&grid, 1.0);
        for size in [1e-3, 1e4] {
            for (a, b) in pressures(&grid, size).iter().zip(&expected) {
                assert!((a - b).abs() < 1e-11, "{size}: {a} {b}");
            }
        }
    }
    check(Delaunay::<2>::new());
    check(Delaunay::<3>::new());
}

#[test]
fn threads_do_not_matter() {
    let mut grid = unit_box(Delaunay::<2>::new(), 20, 0.3, 2);
    let mut problem = everything(&mut grid);
    problem.wells[0].control = Control::Pressure(-3.0);
    let setting = Setting::new(&problem, &grid).unwrap();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = DgOptions::default();
        pool.install(|| solve(&grid, &setting, &options, &mut Silent)).unwrap().solution
    };
    let (one, three) = (run(1), run(3));
    assert_eq!(one.pressures, three.pressures);
    assert_eq!(one.fluxes, three.fluxes);
}

#[test]
fn the_coarse_space_holds_linear_pressures_and_is_cut_at_barriers() {
    let mut grid = unit_box(Delaunay::<3>::new(), 4, 0.0, 2);
    name_inner_facets(&mut grid, "fault", |x| x[0] == 0.5 && x[1] <= 0.5);
    let barriers = vec![Barrier { group: "fault".to_string(), multiplier: 0.5 }];
    let problem = Problem { barriers, ..Problem::default() };
    let setting = Setting::new(&problem, &grid).unwrap();
    let options = DgOptions::default();
    let scheme = Scheme::new(&grid, &setting, &options).unwrap();
    let coarse = coarse::coarse(&scheme);
    let points = grid.mesh().unwrap().points();
    let doubled = points.iter().filter(|x| x[0] == 0.5 && x[1] < 0.5).count();
    assert_eq!(coarse.column_count(), points.len() + doubled);
    // the value at each corner of each cell, summed with the function's, is that of a linear pressure
    let linear = |x: &Point<3>| 1.0 + 2.0 * x[0] - x[1] + 0.5 * x[2];
    let mut values = vec![0.0; coarse.column_count()];
    let count = scheme.element.count();
    for (cell, corners) in grid.mesh().unwrap().cells().enumerate() {
        let mut columns = coarse.row(cell * count).0.to_vec();
        assert_eq!(columns.len(), 4);
        columns.dedup();
        assert_eq!(columns.len(), corners.len(), "a value for each corner");
    }
    // constants first: all values 1 make the mean 1 and nothing else
    values.fill(1.0);
    for (row, sum) in product(&coarse, &values).into_iter().enumerate() {
        let expected = f64::from(u8::from(row % count == 0));
        assert!((sum - expected).abs() < 1e-14);
    }
    // without barriers values are numbered by the corners, in the order in which cells name them
    let open = Problem::default();
    let setting = Setting::new(&open, &grid).unwrap();
    let scheme = Scheme::new(&grid, &setting, &options).unwrap();
    let coarse = coarse::coarse(&scheme);
    let mut seen: Vec<u32> = Vec::new();
    for corner in grid.mesh().unwrap().corners() {
        if !seen.contains(corner) {
            seen.push(*corner);
        }
    }
    let values: Vec<f64> = seen.iter().map(|&point| linear(&points[point as usize])).collect();
    let coefficients = product(&coarse, &values);
    for (cell, centroid) in grid.centroids().iter().enumerate() {
        let own = &coefficients[cell * count..(cell + 1) * count];
        assert!((own[0] - linear(centroid)).abs() < 1e-13);
        let corner = points[grid.mesh().unwrap().corners()[cell * 4 + 2] as usize];
        let at = scheme.cells[cell].coordinates(&corner);
        let found = scheme::value(own, &scheme.element.basis.values(&at));
        assert!((found - linear(&corner)).abs() < 1e-12, "{found}");
    }
}

fn product(matrix: &Sparse, values: &[f64]) -> Vec<f64> {
    let mut into = vec![0.0; matrix.row_count()];
    for (row, column, value) in matrix.entries() {
        into[row] += value * values[column];
    }
    into
}

#[test]
fn what_cannot_be_solved_is_refused() {
    let grid = unit_box(Delaunay::<2>::new(), 3, 0.2, 6);
    let problem = Problem::default();
    let setting = Setting::new(&problem, &grid).unwrap();
    let fails = |options: DgOptions| solve(&grid, &setting, &options, &mut Silent).unwrap_err();
    let obb = DgOptions { form: Form::OdenBabuskaBaumann, order: 1, ..DgOptions::default() };
    assert!(matches!(fails(obb), FlowError::Order { found: 1, form: "obb", least: 2, most: 3 }));
    let high = DgOptions { order: 4, ..DgOptions::default() };
    assert!(matches!(fails(high), FlowError::Order { found: 4, .. }));
    for value in [0.5, f64::NAN, f64::INFINITY] {
        let options = DgOptions { penalty: value, ..DgOptions::default() };
        assert!(matches!(fails(options), FlowError::Penalty { .. }));
    }
}

#[test]
fn voronoi_cells_are_refused() {
    let bounds = Bounds { min: [0.0; 2], max: [1.0; 2] };
    let sites = [[0.2, 0.3], [0.7, 0.6]];
    let cells = voronoi(&Delaunay::<2>::new(), &sites, bounds, &mut Silent).unwrap();
    let grid = FlowGrid::of_cells(&cells, None);
    let problem = Problem::default();
    let setting = Setting::new(&problem, &grid).unwrap();
    let error = solve(&grid, &setting, &DgOptions::default(), &mut Silent).unwrap_err();
    assert_eq!(error, FlowError::NotSimplices);
}

#[test]
fn forms_are_found_by_their_names() {
    for form in Form::ALL {
        assert_eq!(form.name().parse(), Ok(form));
    }
    assert_eq!("nipg".parse::<Form>(), Err(UnknownForm("nipg".to_string())));
}
