//! Barriers: image wells beside a fault, and the slit.

use std::f64::consts::TAU;

use super::*;

/// The error beside a sealed fault at x = 0, with a well of rate 1 at (2, 0) and cells of side `step`: of pressures
/// further than 1 from the well in the mean square, and of the pressure at the well's wall.
fn beside_a_fault(step: f64) -> [f64; 2] {
    let count = (8.0 / step).round() as usize;
    let sites = lattice([-4.0 + 0.5 * step; 2], step, [count; 2]);
    let cells = cells_of(&sites, Bounds { min: [-4.0; 2], max: [4.0; 2] });
    let mut grid = FlowGrid::of_cells(&cells, None);
    assert_eq!(name_faces(&mut grid, "fault", |f| f.centroid[0].abs() < 1e-9), count);
    let place = [2.0 + 0.5 * step, 0.5 * step];
    let squared = |p: &Point<2>, x: f64| (p[0] - x).powi(2) + (p[1] - place[1]).powi(2);
    let exact = |p: &Point<2>| match p[0] > 0.0 {
        true => -0.5 / TAU * (squared(p, place[0]) * squared(p, -place[0])).ln(),
        false => 0.0,
    };
    let radius = 1e-3;
    let problem = Problem {
        wells: vec![well(place, Control::Rate(1.0), Some(radius))],
        boundaries: all_sides(&exact),
        barriers: vec![Barrier { group: "fault".to_string(), multiplier: 0.0 }],
        ..Problem::default()
    };
    let found = answer(&cells, &grid, &problem);
    let far = sites.iter().zip(&found.pressures).filter(|(p, _)| squared(p, place[0]) > 1.0);
    let (sum, count) = far.fold((0.0, 0), |(sum, n), (site, pressure)| {
        (sum + (pressure - exact(site)).powi(2), n + 1)
    });
    let wall = -(radius * 2.0 * place[0]).ln() / TAU;
    [(sum / f64::from(count)).sqrt(), (found.wells[0].wall_pressure.unwrap() - wall).abs()]
}

#[test]
fn a_well_beside_a_sealed_fault_has_an_image() {
    let (coarse, fine) = (beside_a_fault(0.25), beside_a_fault(0.125));
    let order = (coarse[0] / fine[0]).log2();
    assert!(order > 1.8, "order {order}: {coarse:?}, {fine:?}");
    assert!(fine[0] < 1e-4 && fine[1] < 5e-4, "{fine:?}");
}

/// √(z² − 1), cut from −1 to 1: z far away.
fn root(place: &Point<2>) -> Point<2> {
    let polar = |x: f64| (x.hypot(place[1]).sqrt(), 0.5 * place[1].atan2(x));
    let ((r, a), (s, b)) = (polar(place[0] - 1.0), polar(place[0] + 1.0));
    [r * s * (a + b).cos(), r * s * (a + b).sin()]
}

/// Squares of side 1/20 around the slit −1…1 on y = 0, each halved `levels` times near its tips. Mirrored across the
/// slit, and near a tip across x = ±1, so that faces lie on the slit and end where it ends.
fn around_the_slit(levels: usize) -> Vec<Point<2>> {
    let step = 0.05;
    let mut squares: Vec<(Point<2>, f64)> = Vec::new();
    let mut rest: Vec<(Point<2>, f64)> =
        lattice([-2.0 + 0.5 * step; 2], step, [80; 2]).into_iter().map(|p| (p, step)).collect();
    while let Some((middle, side)) = rest.pop() {
        let far = (middle[0].abs() - 1.0).hypot(middle[1]) > 3.0 * side;
        if far || side < 1.5 * step * 0.5_f64.powi(levels as i32) {
            squares.push((middle, side));
            continue;
        }
        let quarter = 0.25 * side;
        for [x, y] in [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]] {
            rest.push(([middle[0] + x * quarter, middle[1] + y * quarter], 0.5 * side));
        }
    }
    squares.into_iter().map(|square| square.0).collect()
}

/// The error of the jump across the sealed slit in upward flow of velocity 1, in L² as a share of the jump:
/// p = −Im √(z² − 1) jumps by 2 √(1 − x²).
fn jump_error(levels: usize) -> f64 {
    let cells = cells_of(&around_the_slit(levels), Bounds { min: [-2.0; 2], max: [2.0; 2] });
    let mut grid = FlowGrid::of_cells(&cells, None);
    let on_slit = |p: &Point<2>| p[1].abs() < 1e-9 && p[0].abs() < 1.0;
    let length = |f: &crate::grid::FlowFacet<2>| f.measure();
    name_faces(&mut grid, "slit", |f| on_slit(&f.centroid));
    let exact = |p: &Point<2>| -root(p)[1];
    let problem = Problem {
        boundaries: all_sides(&exact),
        barriers: vec![Barrier { group: "slit".to_string(), multiplier: 0.0 }],
        ..Problem::default()
    };
    let found = answer(&cells, &grid, &problem);
    let (mut error, mut norm, mut whole) = (0.0, 0.0, 0.0);
    for facet in grid.facets()[..cells.inner_face_count()].iter().filter(|f| on_slit(&f.centroid)) {
        let pressure = |cell: u32| found.pressures[cell as usize];
        let jump = (pressure(facet.cell) - pressure(facet.neighbour.unwrap())).abs();
        let exact = 2.0 * (1.0 - facet.centroid[0].powi(2)).sqrt();
        error += length(facet) * (jump - exact).powi(2);
        norm += length(facet) * exact * exact;
        whole += length(facet);
    }
    assert!((whole - 2.0).abs() < 1e-9, "the faces are the slit");
    (error / norm).sqrt()
}

#[test]
fn across_a_sealed_slit_the_pressure_jumps() {
    // squares of one size see a slit that is 0.3 d too long at either end, since the velocity at a tip is infinite;
    // smaller cells at the tips see it right
    let errors = [0, 1, 2, 3].map(jump_error);
    assert!(errors[0] < 0.04, "{errors:?}");
    assert!(errors.windows(2).all(|pair| pair[1] < 0.75 * pair[0]), "{errors:?}");
    assert!(errors[2] < 0.02, "{errors:?}");
}

#[test]
fn nothing_flows_at_all_in_compartments_that_nothing_drives() {
    let bounds = cube::<2>(1.0);
    let cells = cells_of(&scattered::<2>(200, 3), bounds);
    let mut grid = FlowGrid::of_cells(&cells, None);
    let centers = cells.centers().to_vec();
    let is_left = |cell: u32| centers[cell as usize][0] < 0.5;
    name_faces(&mut grid, "wall", |f| is_left(f.cell) != f.neighbour.is_none_or(is_left));
    let problem = Problem {
        boundaries: vec![pressure_on("xmin", 0.1), pressure_on("xmax", 0.7)],
        barriers: vec![Barrier { group: "wall".to_string(), multiplier: 0.0 }],
        ..Problem::default()
    };
    let found = answer(&cells, &grid, &problem);
    assert!(found.fluxes.iter().all(|flux| *flux == 0.0), "rounding is no flow");
    assert!(found.velocities(&grid).as_flattened().iter().all(|v| *v == 0.0));
    let expected = |cell| if is_left(cell) { 0.1 } else { 0.7 };
    let pressures = found.pressures.iter().zip(0..);
    assert!(pressures.into_iter().all(|(pressure, cell)| *pressure == expected(cell)));
    // one side driven, the other not
    let driven =
        Problem { wells: vec![well([0.9, 0.4], Control::Rate(1.0), None)], ..problem.clone() };
    let found = answer(&cells, &grid, &driven);
    let rest = found.velocities(&grid);
    let moves = |cell: &u32| rest[*cell as usize].iter().any(|v| *v != 0.0);
    let count = centers.len() as u32;
    assert!((0..count).filter(moves).all(|cell| !is_left(cell)));
    assert!((0..count).filter(moves).count() > 20);
}
