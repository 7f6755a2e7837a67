//! Pictures of flow: as many vectors as cells, nothing outside, and what does not fit refused.

use atomesh::geometry::{Bounds, Point};
use atomesh::image::{Frame, Image, Samples};
use atomesh::mesh::{Delaunay, Mesh, PolyMesh};
use atomesh::voronoi::voronoi;
use atomesh::watch::Silent;
use atomesh_draw::{
    DrawError, FlowCells, FlowLine, FlowPicture, FlowStyle, FlowWell, Picture, PictureFormat,
    Style, draw_flow, draw_flow_slices,
};
use proptest::prelude::*;

/// Triangles of an `n` × `n` grid of squares, ten samples wide.
fn squares(n: u32) -> Mesh<2> {
    let at = |i: u32, j: u32| i + (n + 1) * j;
    let points =
        (0..=n).flat_map(|j| (0..=n).map(move |i| [10.0 * f64::from(i), 10.0 * f64::from(j)]));
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let corners = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)];
        [a, b, d, a, d, c]
    });
    Mesh::new(points.collect(), corners.collect()).unwrap()
}

fn turning(mesh: &Mesh<2>) -> Vec<Point<2>> {
    let middle = |cell: &[u32]| -> Point<2> {
        std::array::from_fn(|k| {
            cell.iter().map(|&c| mesh.points()[c as usize][k]).sum::<f64>() / 3.0
        })
    };
    mesh.cells().map(middle).map(|[x, y]| [y - 21.0, 19.0 - x]).collect()
}

/// Cells around scattered sites, the same each time.
fn polygons() -> PolyMesh<2> {
    let bounds = Bounds { min: [0.0; 2], max: [40.0, 30.0] };
    let site = |n: u32| {
        let n = f64::from(n);
        [40.0 * (n * 0.754_877).fract(), 30.0 * (n * 0.569_84).fract()]
    };
    let sites: Vec<Point<2>> = (0..40).map(site).collect();
    voronoi(&Delaunay::<2>::new(), &sites, bounds, &mut Silent).unwrap()
}

fn grey<const D: usize>(shape: [usize; D]) -> Image<D> {
    let samples = Samples::U8(vec![7; shape.iter().product()].into());
    Image::new(Frame::new(shape).unwrap(), samples).unwrap()
}

/// The tetrahedra of a cube, and points that are where the faces of the slices cannot be.
fn cube(side: f64) -> Mesh<3> {
    let mut points: Vec<Point<3>> =
        (0..8).map(|i| [0, 1, 2].map(|k| side * f64::from(i >> k & 1))).collect();
    points.push([0.45 * side, 0.4 * side, 0.55 * side]);
    Delaunay::<3>::new().connect(&points, &mut Silent).unwrap()
}

fn svg(picture: &Picture) -> String {
    String::from_utf8(picture.encode(PictureFormat::Svg).unwrap()).unwrap()
}

/// How many polygons of a colour there are.
fn polygon_count(svg: &str, color: &str) -> usize {
    let start = format!("<path fill=\"{color}\" d");
    svg.lines().filter(|l| l.starts_with(&start)).map(|l| l.matches('Z').count()).sum()
}

#[test]
fn each_cell_has_a_vector_and_each_barrier_a_bold_line() {
    let mesh = squares(4);
    let velocities = turning(&mesh);
    let flow = FlowPicture {
        velocities: &velocities,
        barriers: &[3, 20],
        ..FlowPicture::new(FlowCells::Simplices(&mesh))
    };
    // none of the middles is where the rotation has its own
    let text = svg(&draw_flow(&flow, &Style::default(), &FlowStyle::default()).unwrap());
    assert_eq!(polygon_count(&text, "#000000"), mesh.cell_count());
    let bold = text.lines().find(|l| l.contains("stroke-width=\"4\"")).unwrap();
    assert_eq!(bold.matches('L').count(), 2);
    let thin = text.lines().find(|l| l.contains("stroke-width=\"1.2\"")).unwrap();
    assert_eq!(thin.matches('L').count(), mesh.facets().len());
    let cells = polygons();
    let velocities = vec![[1.0, 0.5]; cells.cell_count()];
    let flow =
        FlowPicture { velocities: &velocities, ..FlowPicture::new(FlowCells::Polytopes(&cells)) };
    let style = FlowStyle { vector_spacing: 0.01, ..FlowStyle::default() };
    let text = svg(&draw_flow(&flow, &Style::default(), &style).unwrap());
    assert_eq!(polygon_count(&text, "#000000"), cells.cell_count());
}

#[test]
fn vectors_are_as_long_as_what_they_stand_for_up_to_a_cap() {
    // in x, from nought to ten; the cap is at 1.5 of what nine of ten are slower than
    let mesh = squares(4);
    let velocities: Vec<Point<2>> =
        (0..32).map(|i| [if i == 31 { 1e6 } else { f64::from(i) }, 0.0]).collect();
    let flow =
        FlowPicture { velocities: &velocities, ..FlowPicture::new(FlowCells::Simplices(&mesh)) };
    let text = svg(&draw_flow(&flow, &Style::default(), &FlowStyle::default()).unwrap());
    let vectors = text.lines().find(|l| l.starts_with("<path fill=\"#000000\" d")).unwrap();
    let d = vectors.split(" d=\"").nth(1).unwrap();
    let length = |outline: &str| {
        let xs: Vec<f64> = outline
            .split(['M', 'L'])
            .filter_map(|place| place.split(' ').next()?.parse().ok())
            .collect();
        xs.iter().copied().fold(f64::MIN, f64::max) - xs.iter().copied().fold(f64::MAX, f64::min)
    };
    let mut lengths: Vec<f64> = d.split('Z').map(length).filter(|l| *l > 0.0).collect();
    lengths.sort_by(f64::total_cmp);
    // of 31 that flow, number 28 is brisk: one median edge, 20 pixels; coordinates have two decimals
    let longest = lengths.pop().unwrap();
    assert!((longest - 30.0).abs() < 0.03, "{longest}");
    for (length, speed) in lengths.iter().rev().zip((1..=30).rev()) {
        assert!((length - 20.0 / 28.0 * f64::from(speed)).abs() < 0.03, "{length} at {speed}");
    }
}

#[test]
fn what_does_not_flow_has_dots_and_what_is_not_there_is_not_drawn() {
    let mesh = squares(3);
    let still = vec![[0.0; 2]; mesh.cell_count()];
    let cells = FlowCells::Simplices(&mesh);
    let draw = |flow: &FlowPicture<2>| {
        svg(&draw_flow(flow, &Style::default(), &FlowStyle::default()).unwrap())
    };
    let text = draw(&FlowPicture { velocities: &still, ..FlowPicture::new(cells) });
    assert_eq!((polygon_count(&text, "#000000"), text.matches("h0").count()), (0, 18));
    let text = draw(&FlowPicture::new(cells));
    assert_eq!(text.matches("<path").count(), 2, "the page and the edges: {text}");
    let none = Mesh::<2>::new(vec![], vec![]).unwrap();
    draw(&FlowPicture::new(FlowCells::Simplices(&none)));
    let none = Mesh::<3>::new(vec![], vec![]).unwrap();
    let flow = FlowPicture::new(FlowCells::Simplices(&none));
    draw_flow_slices(&flow, None, &Style::default(), &FlowStyle::default()).unwrap();
}

#[test]
fn pressures_fill_cells_from_dark_to_light() {
    let mesh = squares(1);
    let flow =
        FlowPicture { pressures: &[2.0, 5.0], ..FlowPicture::new(FlowCells::Simplices(&mesh)) };
    let text = svg(&draw_flow(&flow, &Style::default(), &FlowStyle::default()).unwrap());
    let fills: Vec<&str> = text.lines().filter(|l| l.contains("crispEdges")).collect();
    assert_eq!(fills.len(), 2);
    // the ends of viridis, half a level in
    let start = |line: &str, color: [u8; 3]| {
        let hex = line.split('"').nth(1).unwrap();
        let part =
            |k: usize| i32::from(u8::from_str_radix(&hex[1 + 2 * k..3 + 2 * k], 16).unwrap());
        (0..3).all(|k| (part(k) - i32::from(color[k])).abs() < 8)
    };
    assert!(start(fills[0], [68, 1, 84]) && start(fills[1], [253, 231, 37]), "{fills:?}");
}

#[test]
fn a_legend_makes_the_picture_wider_where_colours_mean_something() {
    let mesh = squares(2);
    let pressures: Vec<f64> = (0..8).map(f64::from).collect();
    let bare = FlowPicture::new(FlowCells::Simplices(&mesh));
    let coloured = FlowPicture { pressures: &pressures, ..bare };
    let width = |flow: &FlowPicture<2>, legend: bool| {
        let style = FlowStyle { legend, ..FlowStyle::default() };
        draw_flow(flow, &Style::default(), &style).unwrap().width()
    };
    assert_eq!(width(&bare, true), width(&bare, false));
    assert_eq!(width(&coloured, false), width(&bare, true));
    assert!(width(&coloured, true) > width(&coloured, false) + 50);
}

#[test]
fn slices_have_a_vector_in_each_part_of_a_cell_and_wells_of_two_sizes() {
    let mesh = cube(20.0);
    let velocities = vec![[1.0, 2.0, 3.0]; mesh.cell_count()];
    let image = grey([21; 3]);
    let wells = [
        FlowWell { place: [10.0; 3], rate: 1.0 },
        FlowWell { place: [10.0, 10.0, 12.0], rate: -1.0 },
    ];
    let flow = FlowPicture {
        image: Some(&image),
        velocities: &velocities,
        wells: &wells,
        ..FlowPicture::new(FlowCells::Simplices(&mesh))
    };
    let all = FlowStyle { vector_spacing: 0.01, ..FlowStyle::default() };
    let style = Style { edge_pixels: 100.0, ..Style::default() };
    let text = svg(&draw_flow_slices(&flow, None, &style, &all).unwrap());
    let crossed = |axis: usize| {
        let beyond = |&c: &u32| mesh.points()[c as usize][axis] >= 10.0;
        mesh.cells().filter(|cell| !cell.iter().all(beyond) && cell.iter().any(beyond)).count()
    };
    assert_eq!(polygon_count(&text, "#000000"), (0..3).map(crossed).sum::<usize>());
    // in three slices and in the view
    assert_eq!(polygon_count(&text, "#d6281e"), 4);
    assert_eq!(polygon_count(&text, "#1450c8"), 4);
}

#[test]
fn what_does_not_fit_is_refused() {
    let mesh = squares(1);
    let new = FlowPicture::new(FlowCells::Simplices(&mesh));
    let draw = |flow: FlowPicture<2>| {
        draw_flow(&flow, &Style::default(), &FlowStyle::default()).unwrap_err()
    };
    let odd = draw(FlowPicture { velocities: &[[0.0; 2]; 3], ..new });
    assert_eq!(odd, DrawError::Count { what: "velocities", found: 3, expected: 2 });
    assert_eq!(odd.to_string(), "3 velocities; expected none or 2");
    let odd = draw(FlowPicture { pressures: &[0.0], ..new });
    assert_eq!(odd, DrawError::Count { what: "pressures", found: 1, expected: 2 });
    let odd = draw(FlowPicture { barriers: &[5], ..new });
    assert_eq!(odd.to_string(), "barrier 5; the mesh has 5 facets");
    let line = FlowLine { points: &[[0.0; 2]], times: &[] };
    assert!(matches!(draw(FlowPicture { lines: &[line], ..new }), DrawError::Count { .. }));
    let style = FlowStyle { vector_length: f64::NAN, ..FlowStyle::default() };
    let refused = draw_flow(&new, &Style::default(), &style).unwrap_err();
    assert!(refused.to_string().starts_with("vector_length is NaN"), "{refused}");
    let mesh = cube(4.0);
    let flow = FlowPicture::new(FlowCells::Simplices(&mesh));
    let at = Some([2.0, 2.0, 5.0]);
    let refused = draw_flow_slices(&flow, at, &Style::default(), &FlowStyle::default());
    assert!(matches!(refused, Err(DrawError::Slice { axis: 2, .. })));
}

/// All coordinates in the filled polygons of an SVG.
fn places(svg: &str) -> Vec<Point<2>> {
    let filled = svg
        .lines()
        .filter(|l| l.starts_with("<path fill=\"#") && !l.contains("#ffffff\" d=\"M0 0H"));
    let of = |line: &str| -> Vec<Point<2>> {
        let d = line.split(" d=\"").nth(1).unwrap().trim_end_matches("\"/>").replace('Z', "");
        let place = |text: &str| {
            let (x, y) = text.split_once(' ').unwrap();
            [x.parse().unwrap(), y.parse().unwrap()]
        };
        d.split(['M', 'L']).filter(|t| !t.is_empty()).map(place).collect()
    };
    filled.flat_map(of).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

    #[test]
    fn nothing_leaves_the_picture_and_the_same_flow_has_the_same_bytes(
        velocities in prop::collection::vec(prop::array::uniform2(prop::num::f64::ANY), 18),
        pressures in prop::collection::vec(prop::num::f64::ANY, 18),
        place in prop::array::uniform2(-5.0..40.0),
        rate in -1.0..1.0,
        end in prop::array::uniform2(-100.0..100.0),
        with_image in any::<bool>(),
    ) {
        let mesh = squares(3);
        let image = grey([31, 31]);
        let flow = FlowPicture {
            image: with_image.then_some(&image),
            barriers: &[1, 2],
            velocities: &velocities,
            pressures: if rate > 0.0 { &pressures } else { &[] },
            wells: &[FlowWell { place, rate }],
            lines: &[FlowLine { points: &[place, end, [1.0, 1.0]], times: &[0.0, rate, 2.0] }],
            ..FlowPicture::new(FlowCells::Simplices(&mesh))
        };
        let draw = || draw_flow(&flow, &Style::default(), &FlowStyle::default()).unwrap();
        let (picture, again) = (draw(), draw());
        for format in [PictureFormat::Png, PictureFormat::Svg] {
            prop_assert!(picture.encode(format).unwrap() == again.encode(format).unwrap());
        }
        let limits = [picture.width(), picture.height()].map(f64::from);
        let outside = |p: &Point<2>| (0..2).any(|k| !(0.0..=limits[k]).contains(&p[k]));
        let places = places(&svg(&picture));
        prop_assert!(!places.iter().any(outside), "{:?}", places.iter().find(|p| outside(p)));
    }
}
