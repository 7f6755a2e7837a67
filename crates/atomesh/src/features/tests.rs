use proptest::prelude::*;

use super::*;
use crate::fields::{Interpolation, ScalarField};
use crate::geometry::Point;
use crate::image::Grid;
use crate::mesh::{Delaunay, Facet};
use crate::watch::Silent;

/// A square or cube of `n` steps a side, each divided along its main diagonal (Kuhn's simplices), with the
/// point of index (i, j, k) at number i + (n + 1)(j + (n + 1) k).
fn grid<const D: usize>(n: usize) -> Mesh<D> {
    let side = n + 1;
    let points = (0..side.pow(D as u32))
        .map(|i| std::array::from_fn(|k| (i / side.pow(k as u32) % side) as f64))
        .collect();
    let mut corners: Vec<u32> = Vec::new();
    for cube in 0..n.pow(D as u32) {
        let first: usize = (0..D).map(|k| cube / n.pow(k as u32) % n * side.pow(k as u32)).sum();
        for order in orders(D) {
            let mut cell = vec![first];
            for &axis in &order {
                cell.push(cell[cell.len() - 1] + side.pow(axis as u32));
            }
            let odd = (0..D).flat_map(|i| (0..i).map(move |j| (i, j)));
            if odd.filter(|&(i, j)| order[i] < order[j]).count() % 2 == 1 {
                cell.swap(D - 1, D);
            }
            corners.extend(cell.into_iter().map(|corner| corner as u32));
        }
    }
    let mesh = Mesh::new(points, corners).unwrap();
    mesh.validate().unwrap();
    mesh
}

fn orders(count: usize) -> Vec<Vec<usize>> {
    if count == 2 {
        return vec![vec![0, 1], vec![1, 0]];
    }
    [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]].map(Vec::from).into()
}

/// The features of the inner facets whose corners pass, at −1; others are at 0.
fn chosen<const D: usize>(
    mesh: &Mesh<D>,
    options: &FeatureFacetOptions,
    passes: impl Fn(&[Point<D>; D]) -> bool,
) -> FeatureSet<D> {
    let mut facets = mesh.facets();
    facets.retain(|facet| facet.neighbour.is_some());
    let field = FacetField::given(facets, |facet| {
        let corners = facet.corners.map(|corner| mesh.points()[corner as usize]);
        if passes(&corners) { -1.0 } else { 0.0 }
    });
    find_features(mesh, &field, options).unwrap()
}

fn all<const D: usize>(corners: &[Point<D>; D], test: impl Fn(&Point<D>) -> bool) -> bool {
    corners.iter().all(test)
}

/// Everything chosen is kept.
const KEEP: FeatureFacetOptions = FeatureFacetOptions {
    below: -0.5,
    test: FacetTest::Mean,
    min_facets: 1,
    min_measure: 0.0,
    close_gaps: false,
};

#[test]
fn a_line_is_one_piece_from_its_left_end_to_the_right() {
    let mesh = grid::<2>(6);
    let found = chosen(&mesh, &KEEP, |c| all(c, |p| p[1] == 3.0));
    let [line] = &found.features[..] else { panic!("{found:?}") };
    let expected: Vec<[u32; 2]> = (21..27).map(|a| [a, a + 1]).collect();
    assert_eq!(line.facets, expected);
    assert!(line.orientable && !line.closed && line.mean == -1.0);
    let report = &found.report(&mesh)[0];
    assert_eq!((report.id, report.name.as_str(), report.measure), (1, "feature-1", 6.0));
    assert_eq!((&report.min[..], &report.max[..]), (&[0.0, 3.0][..], &[6.0, 3.0][..]));
    let tags = found.tags(&mesh).unwrap();
    assert_eq!(tags.facet_group("feature-1").unwrap().facets, expected);
}

#[test]
fn lines_that_cross_part_into_four_that_share_a_point_and_the_longest_is_first() {
    let mesh = grid::<2>(6);
    let found = chosen(&mesh, &KEEP, |c| all(c, |p| p[0] == 2.0) || all(c, |p| p[1] == 3.0));
    let lengths: Vec<usize> = found.features.iter().map(|f| f.facets.len()).collect();
    assert_eq!(lengths, [4, 3, 3, 2]);
    assert_eq!(found.intersections, [[2 + 7 * 3]]);
    for line in &found.features {
        assert!(line.facets.as_flattened().contains(&23));
        assert!(line.facets.windows(2).all(|pair| pair[0][1] == pair[1][0]), "{line:?}");
    }
}

#[test]
fn a_loop_begins_at_its_lowest_point_and_closes() {
    let mesh = grid::<2>(6);
    let on_rim = |p: &Point<2>| (p[0] - 3.0).abs().max((p[1] - 3.0).abs()) == 2.0;
    let along_axis = |c: &[Point<2>; 2]| c[0][0] == c[1][0] || c[0][1] == c[1][1];
    let found = chosen(&mesh, &KEEP, |c| all(c, on_rim) && along_axis(c));
    let [rim] = &found.features[..] else { panic!("{found:?}") };
    assert_eq!((rim.facets.len(), rim.closed, rim.facets[0][0]), (16, true, 8));
    assert!((0..16).all(|k| rim.facets[k][1] == rim.facets[(k + 1) % 16][0]));
}

#[test]
fn without_its_spur_a_line_is_whole_again() {
    let mesh = grid::<2>(6);
    let passes = |c: &[Point<2>; 2]| {
        let spur = all(c, |p| p[0] == 3.0 && p[1] >= 3.0 && p[1] <= 4.0);
        let speck = all(c, |p| p[1] == 1.0 && p[0] >= 4.0 && p[0] <= 5.0);
        all(c, |p| p[1] == 3.0) || spur || speck
    };
    assert_eq!(chosen(&mesh, &KEEP, passes).features.len(), 4);
    let found = chosen(&mesh, &FeatureFacetOptions { min_facets: 2, ..KEEP }, passes);
    assert_eq!(found.features.len(), 1);
    assert_eq!(found.selection, Selection { chosen: 8, added: 0, dropped: 2 });
    let found = chosen(&mesh, &FeatureFacetOptions { min_measure: 1.5, ..KEEP }, passes);
    assert_eq!(found.features.len(), 1);
    let found = chosen(&mesh, &FeatureFacetOptions { min_measure: 7.0, ..KEEP }, passes);
    assert_eq!((found.features.len(), found.selection.dropped), (0, 8));
}

#[test]
fn of_two_small_ways_between_the_same_points_the_deeper_stays() {
    let mesh = grid::<2>(6);
    let mut facets = mesh.facets();
    facets.retain(|facet| facet.neighbour.is_some());
    let detour = |p: &Point<2>| [[2.0, 3.0], [3.0, 4.0], [3.0, 3.0]].contains(p);
    let field = FacetField::given(facets, |facet| {
        let corners = facet.corners.map(|corner| mesh.points()[corner as usize]);
        match corners {
            // the diagonal and the step down lead where the line does, with less of the feature
            _ if all(&corners, |p| p[1] == 3.0) => -0.9,
            _ if all(&corners, detour) => -0.6,
            _ => 0.0,
        }
    });
    let found =
        find_features(&mesh, &field, &FeatureFacetOptions { min_facets: 3, ..KEEP }).unwrap();
    let [line] = &found.features[..] else { panic!("{found:?}") };
    assert_eq!(line.facets, (21..27).map(|a| [a, a + 1]).collect::<Vec<_>>());
    assert!(found.intersections.is_empty());
}

#[test]
fn a_short_piece_that_joins_two_others_stays() {
    // two lines along x, and one facet up between them; another facet up from the first ends free
    let mesh = grid::<2>(6);
    let passes = |c: &[Point<2>; 2]| {
        let is_level = |y: f64| all(c, |p| p[1] == y);
        let is_up = |x: f64| all(c, |p| p[0] == x && (2.0..=3.0).contains(&p[1]));
        let is_free = all(c, |p| p[0] == 5.0 && (1.0..=2.0).contains(&p[1]));
        is_level(2.0) || is_level(3.0) || is_up(3.0) || is_free
    };
    let options = FeatureFacetOptions { min_facets: 2, ..KEEP };
    let found = chosen(&mesh, &options, passes);
    assert_eq!((found.features.len(), found.selection.dropped), (5, 1));
    assert!(found.features.iter().any(|feature| feature.facets.len() == 1));
}

fn facets_in_a_valley_are_found<const D: usize>() {
    let mesh = grid::<D>(6);
    // a valley 0.7 deep and 0.3 wide across the middle, at y = 3.2
    let samples = Grid::<D> { shape: [31; D], step: [0.2; D] };
    let b = |i: usize| -0.7 * (-0.5 * ((samples.position(i)[1] - 3.2) / 0.3).powi(2)).exp();
    let values = (0..samples.sample_count()).map(|i| b(i) as f32).collect();
    let potential = ScalarField::potential(samples, values, Interpolation::Linear).unwrap();
    let along = |least_depth: f64| {
        FacetField::in_valleys(&mesh, &potential, 0.3, least_depth, &mut Silent).unwrap()
    };
    let field = along(0.25);
    for (i, facet) in field.facets().iter().enumerate() {
        let corners = facet.corners.map(|corner| mesh.points()[corner as usize]);
        let share = -field.greatest()[i];
        if all(&corners, |p| p[1] == 3.0) {
            assert_eq!(share, 1.0, "{corners:?}");
            // 0.2 from its middle a bell of 0.3 is 0.56 deep, the parabola through values 0.45 on both sides a little more
            assert!((-0.62..-0.56).contains(&field.mean()[i]), "{}", field.mean()[i]);
        } else if all(&corners, |p| p[1] == corners[0][1]) || all(&corners, |p| p[0] == 1.0) {
            // beside the valley, or upright across it
            assert_eq!(share, 0.0, "{corners:?}");
        } else {
            // of what rises by 45° and more 0.3 √2 is near the valley along its own normal
            assert!(share < 0.6, "{share} of {corners:?}");
        }
    }
    assert!(along(0.75).greatest().iter().all(|&share| share == 0.0));
}

#[test]
fn facets_lie_in_valleys_that_are_near_and_turned_as_they_are() {
    facets_in_a_valley_are_found::<2>();
    facets_in_a_valley_are_found::<3>();
}

#[test]
fn gaps_of_one_facet_are_closed_on_request_and_no_others() {
    let mesh = grid::<2>(8);
    let gap = |from: f64, to: f64| {
        move |c: &[Point<2>; 2]| all(c, |p| p[1] == 3.0) && !all(c, |p| p[0] >= from && p[0] <= to)
    };
    let close = FeatureFacetOptions { close_gaps: true, ..KEEP };
    assert_eq!(chosen(&mesh, &KEEP, gap(3.0, 4.0)).features.len(), 2);
    let found = chosen(&mesh, &close, gap(3.0, 4.0));
    assert_eq!((found.features.len(), found.selection.added), (1, 1));
    assert_eq!(chosen(&mesh, &close, gap(3.0, 5.0)).features.len(), 2);
    // two lines side by side: the rungs between their ends turn too far
    let found = chosen(&mesh, &close, |c| {
        c[0][1] == c[1][1] && all(c, |p| (3.0..=4.0).contains(&p[1]) && p[0] >= 1.0 && p[0] <= 7.0)
    });
    assert_eq!((found.features.len(), found.selection.added), (2, 0));
}

#[test]
fn a_plane_is_one_surface_with_its_normals_up() {
    let mesh = grid::<3>(4);
    let found = chosen(&mesh, &KEEP, |c| all(c, |p| p[2] == 2.0));
    let [plane] = &found.features[..] else { panic!("{found:?}") };
    assert_eq!((plane.facets.len(), plane.orientable, plane.closed), (32, true, false));
    assert!(plane.facets.iter().all(|facet| mesh.facet_normal(facet) == [0.0, 0.0, 0.5]));
    assert_eq!(found.report(&mesh)[0].measure, 16.0);
}

#[test]
fn features_that_reach_the_sides_cut_regions_and_others_do_not() {
    let mesh = grid::<3>(4);
    let through = chosen(&mesh, &Default::default(), |c| all(c, |p| p[0] == 1.0));
    let regions = through.regions(&mesh, 0);
    assert_eq!(regions.ids(), [1, 2]);
    let of = |id: i32| regions.of_cells.iter().filter(|&&of| of == id).count();
    assert_eq!((of(1), of(2)), (6 * 16, 6 * 48), "six cells a cube");
    let half = chosen(&mesh, &Default::default(), |c| all(c, |p| p[0] == 1.0 && p[1] <= 2.0));
    assert_eq!(half.regions(&mesh, 0).ids(), [1]);
    assert_eq!(through.regions(&mesh, 97).ids(), [2], "the smaller part is an island");
}

#[test]
fn a_hole_of_one_triangle_is_a_gap_too() {
    let mesh = grid::<3>(4);
    let hole = |p: &Point<3>| [[1.0, 1.0], [2.0, 1.0], [2.0, 2.0]].contains(&[p[0], p[1]]);
    let close = FeatureFacetOptions { close_gaps: true, ..KEEP };
    let found = chosen(&mesh, &close, |c| all(c, |p| p[2] == 2.0) && !all(c, hole));
    assert_eq!(found.selection, Selection { chosen: 31, added: 1, dropped: 0 });
    assert_eq!(found.features.len(), 1);
}

#[test]
fn planes_that_cross_part_into_four_surfaces_that_share_edges() {
    let mesh = grid::<3>(4);
    let found = chosen(&mesh, &KEEP, |c| all(c, |p| p[2] == 2.0) || all(c, |p| p[0] == 1.0));
    let areas: Vec<f64> = found.report(&mesh).iter().map(|f| f.measure).collect();
    assert_eq!(areas, [12.0, 8.0, 8.0, 4.0]);
    assert_eq!(found.intersections.len(), 4);
    for edge in &found.intersections {
        assert!(edge.iter().all(|&point| {
            let p = mesh.points()[point as usize];
            p[0] == 1.0 && p[2] == 2.0
        }));
    }
}

#[test]
fn a_closed_surface_has_its_normals_all_out_or_all_in() {
    let mesh = grid::<3>(5);
    // the hull of the block from 1 to 3 along every axis
    let found = chosen(&mesh, &KEEP, |c| {
        let inside = all(c, |p| p.iter().all(|&x| (1.0..=3.0).contains(&x)));
        let on_side = |k: usize, at: f64| all(c, |p| p[k] == at);
        inside && (0..3).any(|k| on_side(k, 1.0) || on_side(k, 3.0))
    });
    let [hull] = &found.features[..] else { panic!("{} pieces", found.features.len()) };
    assert!(hull.closed && hull.orientable);
    assert_eq!(found.report(&mesh)[0].measure, 24.0);
    // the divergence theorem: a third of the sum of x · normal is the volume
    let volume: f64 = hull
        .facets
        .iter()
        .map(|facet| dot(&mesh.points()[facet[0] as usize], &mesh.facet_normal(facet)) / 3.0)
        .sum();
    assert!((volume.abs() - 8.0).abs() < 1e-12, "{volume}");
}

#[test]
fn a_surface_of_one_side_is_known_for_it() {
    // Möbius' band of five triangles
    let mesh = Mesh::new((0..5).map(|i| [f64::from(i), f64::from(i * i), 1.0]).collect(), vec![]);
    let bands = [[0, 1, 2], [0, 1, 4], [0, 3, 4], [1, 2, 3], [2, 3, 4]];
    let facets = bands.map(|corners| Facet { corners, cell: 0, neighbour: Some(1) });
    let field = FacetField::given(facets.into(), |_| -1.0);
    let found = find_features(&mesh.unwrap(), &field, &KEEP).unwrap();
    let [band] = &found.features[..] else { panic!("{found:?}") };
    assert_eq!((band.facets.len(), band.orientable, band.closed), (5, false, false));
}

#[test]
fn facets_in_a_valley_are_found_by_b_between_samples_and_missed_by_points() {
    // two walls at x = 2 and 4, and edges of length 2 from one to the other
    let mesh = grid::<2>(4);
    let points = mesh.points().iter().map(|p| [2.0 * p[0], 2.0 * p[1]]).collect();
    let mesh = Mesh::new(points, mesh.corners().to_vec()).unwrap();
    let b = |x: usize| if x == 2 || x == 4 { -1.0 } else { 0.0 };
    let image = (0..81).map(|i| b(i % 9)).collect();
    let grid = Grid { shape: [9, 9], step: [1.0; 2] };
    let potential = ScalarField::potential(grid, image, Interpolation::Linear).unwrap();
    let field = FacetField::along(&mesh, &potential, &mut Silent).unwrap();
    let found = find_features(&mesh, &field, &FeatureFacetOptions { below: -0.8, ..KEEP }).unwrap();
    let on_walls = found.report(&mesh);
    assert_eq!(on_walls.len(), 2);
    assert!(on_walls.iter().all(|wall| wall.measure == 8.0 && wall.mean == -1.0));
    // between the walls b is a triangle up to 0: the mean along the edge is −1/2, and the greatest 0
    let across = field.facets().iter().position(|facet| facet.corners == [6, 7]).unwrap();
    assert_eq!((field.mean()[across], field.greatest()[across]), (-0.5, -0.25));
    let values: Vec<f32> = mesh.points().iter().map(|p| b(p[0] as usize)).collect();
    let field = FacetField::from_points(&mesh, &values).unwrap();
    assert_eq!(field.mean()[across], -1.0);
}

#[test]
fn what_is_out_of_range_is_refused() {
    let mesh = grid::<2>(2);
    let field = FacetField::given(vec![], |_| 0.0);
    let refused =
        |options: FeatureFacetOptions| find_features(&mesh, &field, &options).unwrap_err();
    let error = refused(FeatureFacetOptions { below: f64::NAN, ..KEEP });
    assert_eq!(error.to_string(), "the threshold is NaN; expected -1 to 1, as b(x) is");
    let error = refused(FeatureFacetOptions { min_measure: -1.0, ..KEEP });
    assert_eq!(error, FeaturesError::MinMeasure { value: -1.0 });
    let error = FacetField::from_points(&mesh, &[0.0]).unwrap_err();
    assert_eq!(error, FeaturesError::PointCount { found: 1, expected: 9 });
}

/// Pieces hold every kept facet once, and normals agree wherever two facets of a piece meet alone.
fn pieces_are_sound<const D: usize>(
    delaunay: &Delaunay<D>,
    points: &[Point<D>],
    values: &[f64],
    close_gaps: bool,
) {
    let Ok(mesh) = delaunay.connect(points, &mut Silent) else { return };
    let mut facets = mesh.facets();
    facets.retain(|facet| facet.neighbour.is_some());
    let sum = |facet: &Facet<D>| facet.corners.iter().map(|&c| values[c as usize]).sum::<f64>();
    let field = FacetField::given(facets, |facet| sum(facet) / D as f64);
    let options = FeatureFacetOptions { below: -0.3, min_facets: 2, close_gaps, ..KEEP };
    let found = find_features(&mesh, &field, &options).unwrap();
    let groups = found.groups();
    assert!(Tags::new(&mesh, groups, None).is_ok());
    let mut runs = std::collections::HashMap::new();
    for (number, feature) in found.features.iter().enumerate() {
        for facet in &feature.facets {
            let mut sorted = *facet;
            sorted.sort_unstable();
            for off in 0..D {
                let mut ridge: Vec<u32> = (0..D).filter(|&k| k != off).map(|k| sorted[k]).collect();
                // which way the ridge runs: by the parity of the order and of the corner left out
                let odd = facet
                    .iter()
                    .enumerate()
                    .map(|(k, c)| facet[..k].iter().filter(|other| *other > c).count());
                let turned = odd.sum::<usize>() + off;
                ridge.sort_unstable();
                runs.entry(ridge).or_insert(vec![]).push((number, turned % 2));
            }
        }
    }
    for (ridge, meets) in runs {
        if let [a, b] = meets[..] {
            assert_eq!(a.0, b.0, "{ridge:?} joins two pieces");
            if found.features[a.0].orientable {
                assert_ne!(a.1, b.1, "{ridge:?} of {:?}", found.features[a.0]);
            }
        } else if meets.len() > 2 {
            assert!(found.intersections.contains(&ridge));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn pieces_of_any_choice_are_sound(
        numbers in prop::collection::vec((0.0..1.0, 0.0..1.0, 0.0..1.0, -1.0..0.4), 8..60),
        close_gaps in any::<bool>(),
    ) {
        let values: Vec<f64> = numbers.iter().map(|n| n.3).collect();
        let flat: Vec<_> = numbers.iter().map(|n| [n.0, n.1]).collect();
        pieces_are_sound(&Delaunay::<2>::new(), &flat, &values, close_gaps);
        let solid: Vec<_> = numbers.iter().map(|n| [n.0, n.1, n.2]).collect();
        pieces_are_sound(&Delaunay::<3>::new(), &solid, &values, close_gaps);
    }
}
