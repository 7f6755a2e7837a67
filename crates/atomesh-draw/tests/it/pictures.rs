//! Pictures, decoded and looked at sample by sample.

use std::path::Path;

use atomesh::image::{Frame, Image, Samples, Units};
use atomesh::mesh::Mesh;
use atomesh_draw::{
    DrawError, FlowCells, MovieFrame, PartsPicture, Picture, PictureFormat, Style, draw_atoms,
    draw_atoms_slices, draw_parts, draw_slices, draw_triangles, encode_movie,
};
use proptest::prelude::*;

use crate::pixels::Pixels;

/// An image whose sample at x, y is x + 10 y.
fn slope(nx: usize, ny: usize) -> Image<2> {
    let samples = (0..nx * ny).map(|i| (i % nx + 10 * (i / nx)) as u8).collect();
    Image::new(Frame::new([nx, ny]).unwrap(), Samples::U8(samples)).unwrap()
}

/// Two triangles over the whole image.
fn square(nx: usize, ny: usize) -> Mesh<2> {
    let (x, y) = ((nx - 1) as f64, (ny - 1) as f64);
    Mesh::new(vec![[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]], vec![0, 1, 2, 0, 2, 3]).unwrap()
}

fn empty<const D: usize>() -> Mesh<D> {
    Mesh::new(vec![], vec![]).unwrap()
}

#[test]
fn samples_are_squares_with_row_zero_on_top() {
    let style = Style { max_side: 80.0, brightness: 1.0, ..Style::default() };
    let pixels = Pixels::of(&draw_triangles(&slope(8, 4), &empty(), &style).unwrap());
    assert_eq!((pixels.width, pixels.height), (80, 40));
    for j in 0..4 {
        for i in 0..8 {
            let value = (i + 10 * j) as f64; // the 32 samples are too few for percentiles: 0 ... 37
            let grey = (value / 37.0 * 255.0).round() as u8;
            let (x, y) = (10.0 * i as f64, 10.0 * j as f64);
            for (dx, dy) in [(0.5, 0.5), (9.5, 0.5), (5.0, 9.5)] {
                assert_eq!(pixels.at(x + dx, y + dy), [grey; 3], "sample {i}, {j}");
            }
        }
    }
}

#[test]
fn edges_run_between_the_centres_of_samples() {
    let style = Style { max_side: 90.0, edge_pixels: 1000.0, edge_width: 3.0, ..Style::default() };
    let pixels = Pixels::of(&draw_triangles(&slope(9, 9), &square(9, 9), &style).unwrap());
    // ten pixels to a sample: the corners are at 5 and 85
    for (x, y) in [(5.0, 5.0), (85.0, 5.0), (45.0, 5.0), (5.0, 45.0), (45.0, 45.0), (45.0, 85.0)] {
        assert!(pixels.at(x, y)[0] > 200, "no edge at {x}, {y}: {:?}", pixels.at(x, y));
    }
    for (x, y) in [(2.0, 2.0), (88.0, 45.0), (60.0, 30.0), (30.0, 60.0)] {
        let [r, g, b] = pixels.at(x, y);
        assert!(r == g && g == b && r <= 153, "an edge at {x}, {y}"); // 153 = 0.6 · 255
    }
}

#[test]
fn an_edge_has_the_wanted_length_in_true_proportions() {
    let frame = Frame::new([30, 20]).unwrap().with_spacing([0.5, 2.0]).unwrap();
    let image = Image::new(frame, Samples::F32(vec![0.0; 600].into())).unwrap();
    // cells two samples wide along x, one millimetre: the median edge is 1 mm
    let points = vec![[0.0, 0.0], [2.0, 0.0], [0.0, 0.5], [4.0, 0.0]];
    let mesh = Mesh::new(points, vec![0, 1, 2]).unwrap();
    let picture = draw_triangles(&image, &mesh, &Style::default()).unwrap();
    assert_eq!((picture.width(), picture.height()), (300, 800)); // 15 × 40 mm, 20 pixels a mm
    let style = Style { units: Units::Samples, max_side: 600.0, ..Style::default() };
    let picture = draw_triangles(&image, &empty(), &style).unwrap();
    assert_eq!((picture.width(), picture.height()), (600, 400));
}

#[test]
fn outliers_and_missing_samples_leave_the_greys_as_they_are() {
    let mut samples: Vec<f32> = (0..1000).map(|i| (i % 10) as f32).collect();
    (samples[3], samples[500], samples[999]) = (f32::NAN, 1e30, f32::NEG_INFINITY);
    let image = Image::new(Frame::new([100, 10]).unwrap(), Samples::F32(samples.into())).unwrap();
    let style = Style { max_side: 100.0, brightness: 1.0, ..Style::default() };
    let pixels = Pixels::of(&draw_triangles(&image, &empty(), &style).unwrap());
    assert_eq!(pixels.at(0.5, 0.5), [0; 3]);
    assert_eq!(pixels.at(9.5, 0.5), [255; 3]);
    assert_eq!(pixels.at(3.5, 0.5), [0; 3]); // not a number
    let flat = Image::new(Frame::new([4, 4]).unwrap(), Samples::U8(vec![7; 16].into())).unwrap();
    let pixels = Pixels::of(&draw_triangles(&flat, &empty(), &style).unwrap());
    assert_eq!(pixels.at(50.0, 50.0), [128; 3]);
}

#[test]
fn svg_draws_each_edge_once_over_the_embedded_image() {
    let style = Style { atoms: true, max_side: 90.0, edge_pixels: 1000.0, ..Style::default() };
    let picture = draw_triangles(&slope(9, 9), &square(9, 9), &style).unwrap();
    let svg = String::from_utf8(picture.encode(PictureFormat::Svg).unwrap()).unwrap();
    assert!(
        svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"90\" height=\"90\"")
    );
    assert_eq!(svg.matches("<image").count(), 1);
    assert!(svg.contains("href=\"data:image/png;base64,iVBORw0KGgo"));
    let edges = svg.lines().find(|l| l.contains("stroke=\"#ffffff\"")).unwrap();
    // five edges, the diagonal among them
    assert_eq!(edges.matches('L').count(), 5, "{edges}");
    assert!(edges.contains("M5 5L85 85"), "{edges}");
    assert_eq!(svg.matches("h0").count(), 4); // a dot for each atom
}

/// An image with a grey for each axis: 10 x + 20 y + 30 z.
fn ramp(shape: [usize; 3]) -> Image<3> {
    let [nx, ny, nz] = shape;
    let mut samples = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            samples.extend((0..nx).map(|x| (10 * x + 20 * y + 30 * z) as f32));
        }
    }
    Image::new(Frame::new(shape).unwrap(), Samples::F32(samples.into())).unwrap()
}

/// One cell that is cut by all planes through its middle.
fn corner_cell(side: f64) -> Mesh<3> {
    let points = vec![[0.0; 3], [side, 0.0, 0.0], [0.0, side, 0.0], [0.0, 0.0, side]];
    Mesh::new(points, vec![0, 1, 2, 3]).unwrap()
}

fn slices_style() -> Style {
    Style { edge_pixels: 1000.0, max_side: 200.0, ..Style::default() }
}

/// The white lines of an SVG of slices, panel by panel, as paths.
fn cut_paths(picture: &Picture) -> Vec<String> {
    let svg = String::from_utf8(picture.encode(PictureFormat::Svg).unwrap()).unwrap();
    let paths = svg.lines().filter(|l| l.contains("fill=\"none\" stroke=\"#ffffff\""));
    paths.map(|l| l.split(" d=\"").nth(1).unwrap().trim_end_matches("\"/>").to_owned()).collect()
}

#[test]
fn a_plane_through_a_tetrahedron_shows_a_triangle() {
    let picture =
        draw_slices(&ramp([9, 9, 9]), &corner_cell(8.0), [4; 3], &slices_style()).unwrap();
    let paths = cut_paths(&picture);
    assert_eq!(paths.len(), 3);
    // the plane z = 4 cuts the cell x + y + z ≤ 8 in x + y ≤ 4; 200/18 pixels a sample, a panel of
    // 100 and a gap of 4 to the left
    let pixel = |i: f64, shift: f64| {
        let text = format!("{:.2}", (i + 0.5) * 200.0 / 18.0 + shift);
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    let (top, left) = (pixel(0.0, 0.0), pixel(0.0, 104.0));
    let (bottom, right) = (pixel(4.0, 0.0), pixel(4.0, 104.0));
    assert_eq!(
        paths[0],
        format!(
            "M{left} {top}L{left} {bottom}M{left} {top}L{right} {top}M{left} {bottom}L{right} {top}"
        )
    );
}

#[test]
fn slices_on_the_faces_of_the_box_show_the_faces_there() {
    // x = 0, y = 0 and z = 0 hold a face of the cell each; at the other end it has only a corner
    let first = draw_slices(&ramp([9, 9, 9]), &corner_cell(8.0), [0; 3], &slices_style()).unwrap();
    for path in cut_paths(&first) {
        assert_eq!(path.matches('L').count(), 3, "{path}");
    }
    let last = draw_slices(&ramp([9, 9, 9]), &corner_cell(8.0), [8; 3], &slices_style()).unwrap();
    for path in cut_paths(&last) {
        assert_eq!(path.matches('L').count(), 0, "{path}");
    }
}

#[test]
fn panels_show_their_slices_and_red_lines_where_the_others_are() {
    let shape = [6, 5, 4];
    let at = [2, 1, 3];
    let style = Style { brightness: 1.0, max_side: 220.0, ..Style::default() };
    for z_up in [false, true] {
        let style = Style { z_up, ..style.clone() };
        let picture = draw_slices(&ramp(shape), &empty(), at, &style).unwrap();
        let pixels = Pixels::of(&picture);
        // 20 pixels a sample; the left column is 100 wide, the upper row 100 high, gaps of 4
        let grey = |x: usize, y: usize, z: usize| {
            let value = (10 * x + 20 * y + 30 * z) as f64;
            [(value / 220.0 * 255.0).round() as u8; 3]
        };
        let up = |k: usize| if z_up { 3 - k } else { k };
        let center = |i: usize, j: usize| (20.0 * i as f64 + 15.0, 20.0 * j as f64 + 5.0);
        for k in 0..4 {
            let (x, y) = center(k, k);
            if k > 1 {
                assert_eq!(pixels.at(104.0 + x, y), grey(k, k, 3), "X-Y at {k}, {k}");
                assert_eq!(pixels.at(x, 104.0 + y), grey(2, k, up(k)), "Y-Z at {k}, {k}");
            }
            if k < 2 {
                assert_eq!(pixels.at(104.0 + x, 104.0 + y), grey(k, 1, up(k)), "X-Z at {k}, {k}");
            }
        }
        let red = |[r, g, b]: [u8; 3]| r > g.saturating_add(40) && r > b.saturating_add(40);
        assert!(red(pixels.at(104.0 + 50.0, 80.0)), "x = 2 in X-Y");
        assert!(red(pixels.at(104.0 + 10.0, 30.0)), "y = 1 in X-Y");
        assert!(red(pixels.at(30.0, 104.0 + 20.0 * up(3) as f64 + 10.0)), "z = 3 in Y-Z");
    }
}

#[test]
fn the_view_in_space_shows_what_is_nearest() {
    // each slice has a value of its own
    let mut samples = vec![0.0f32; 729];
    for (i, sample) in samples.iter_mut().enumerate() {
        let [x, y, z] = [i % 9, i / 9 % 9, i / 81];
        *sample = match (z == 4, y == 4, x == 4) {
            (true, ..) => 90.0,
            (_, true, _) => 60.0,
            (.., true) => 30.0,
            _ => 0.0,
        };
    }
    let image = Image::new(Frame::new([9; 3]).unwrap(), Samples::F32(samples.into())).unwrap();
    let grey = |value: f64| [(value / 90.0 * 0.85 * 255.0).round() as u8; 3];
    for z_up in [false, true] {
        let style = Style { z_up, max_side: 400.0, ..Style::default() };
        let pixels = Pixels::of(&draw_slices(&image, &empty(), [4; 3], &style).unwrap());
        // the slices meet near the middle of the panel, 100, 100; the eye is above: below the middle
        // lies the near half of the horizontal slice, above it the vertical slices hide the far half
        assert_eq!(pixels.at(95.0, 112.0), grey(90.0), "z up: {z_up}");
        let sides = [pixels.at(70.0, 75.0), pixels.at(125.0, 75.0)];
        assert_eq!(sides, [grey(60.0), grey(30.0)], "z up: {z_up}");
        let corner = pixels.at(3.0, 3.0);
        assert!(corner[0] < corner[2], "no slice reaches the corner: {corner:?}");
    }
}

#[test]
fn places_and_styles_without_a_meaning_are_refused() {
    let slice = draw_slices(&ramp([4, 5, 6]), &empty(), [1, 5, 1], &Style::default()).unwrap_err();
    assert_eq!(slice, DrawError::Slice { axis: 1, at: 5, count: 5 });
    assert_eq!(slice.to_string(), "slice 5 along axis 1 of an image with 5 samples");
    for value in [0.0, -1.0, f64::NAN, 1.5] {
        let style = Style { brightness: value, ..Style::default() };
        let refused = draw_triangles(&slope(4, 4), &empty(), &style).unwrap_err();
        assert!(refused.to_string().starts_with("brightness is "), "{refused}");
    }
    let unknown = PictureFormat::of(Path::new("a.gif")).unwrap_err();
    assert_eq!(
        unknown.to_string(),
        "\"a.gif\" is not the name of a picture; expected .png or .svg"
    );
    assert_eq!(PictureFormat::of(Path::new("a.SVG")), Ok(PictureFormat::Svg));
}

/// The frames of an animated PNG as a program shows them, each over the one before, and how long they stay.
fn frames_of(bytes: &[u8]) -> Vec<(Vec<[u8; 4]>, u16)> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let control = reader.info().animation_control.unwrap();
    assert_eq!(control.num_plays, 0, "again and again");
    let mut shown: Vec<[u8; 4]> = Vec::new();
    let mut frames = Vec::new();
    for _ in 0..control.num_frames {
        let mut rgba = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut rgba).unwrap();
        let frame = *reader.info().frame_control().unwrap();
        let new: &[[u8; 4]] = rgba.as_chunks().0;
        shown.resize(new.len(), [0; 4]);
        let opaque = shown.iter_mut().zip(new).filter(|(_, new)| new[3] == 255);
        opaque.for_each(|(shown, new)| *shown = *new);
        frames.push((shown.clone(), frame.delay_num));
    }
    frames
}

#[test]
fn a_movie_shows_its_pictures_one_after_another() {
    let style = Style { max_side: 90.0, ..Style::default() };
    let image = slope(9, 9);
    let at = |x: f64| draw_atoms(&image, &[[x, 4.0]], &style).unwrap();
    let places = [1.0, 4.0, 4.0, 7.5];
    let frame = |number: usize| -> Result<MovieFrame, DrawError> {
        Ok(MovieFrame { picture: at(places[number]), milliseconds: 10 + number as u16 })
    };
    let movie = encode_movie(4, frame).unwrap();
    let frames = frames_of(&movie);
    assert_eq!(frames.len(), 4);
    for (number, ((rgba, delay), place)) in frames.iter().zip(places).enumerate() {
        let alone = Pixels::of(&at(place));
        assert!(rgba.iter().zip(&alone.rgb).all(|(shown, alone)| shown[..3] == *alone), "{number}");
        assert_eq!(*delay, 10 + number as u16);
    }
    assert_eq!(encode_movie(4, frame).unwrap(), movie);
    // a frame like the one before takes little
    assert!(encode_movie(3, |number| frame([0, 1, 3][number])).unwrap().len() + 400 > movie.len());
    assert!(matches!(encode_movie(0, frame), Err(DrawError::Png { .. })));
    let fails = |number: usize| {
        if number == 1 { Err(DrawError::Format { path: "x".into() }) } else { frame(0) }
    };
    assert_eq!(encode_movie(2, fails), Err(DrawError::Format { path: "x".into() }));
}

#[test]
fn atoms_of_each_slice_are_shown_in_its_panel_alone() {
    let image = ramp([8, 8, 8]);
    let style = Style { atom_color: [255, 0, 255], ..slices_style() };
    let lists = [vec![[2.0; 3]], vec![], vec![]]; // off the red lines
    let count = |lists: [&[[f64; 3]]; 3]| {
        let pixels = Pixels::of(&draw_atoms_slices(&image, lists, [4; 3], &style).unwrap());
        pixels.rgb.iter().filter(|rgb| **rgb == [255, 0, 255]).count()
    };
    let one = count(lists.each_ref().map(Vec::as_slice));
    let all = count([&lists[0], &lists[0], &lists[0]]);
    assert!(one > 0 && all > 2 * one, "{one}, {all}");
}

#[test]
fn parts_tint_the_image_each_in_its_colour_and_have_dark_borders() {
    let (image, mesh) = (slope(9, 9), square(9, 9));
    let style = Style { edges: false, ..Style::default() };
    let draw = |parts: &[i32], image| {
        let picture = PartsPicture { cells: FlowCells::Simplices(&mesh), image, parts };
        draw_parts(&picture, &style).map(|picture| Pixels::of(&picture))
    };
    let pixels = draw(&[1, 2], Some(&image)).unwrap();
    let side = pixels.width as f64;
    let [lower, upper] = [pixels.at(0.8 * side, 0.3 * side), pixels.at(0.3 * side, 0.8 * side)];
    let is_grey = |[r, g, b]: [u8; 3]| r == g && g == b;
    assert!(!is_grey(lower) && !is_grey(upper) && lower != upper, "{lower:?}, {upper:?}");
    let one = draw(&[1, 1], Some(&image)).unwrap();
    let on_diagonal = |pixels: &Pixels| pixels.at(0.5 * side, 0.5 * side);
    assert!(on_diagonal(&pixels) != on_diagonal(&one), "a border on the diagonal");
    assert!(draw(&[1, 2], None).is_ok());
    let odd = draw(&[1], Some(&image)).err();
    assert_eq!(odd, Some(DrawError::Count { what: "parts", found: 1, expected: 2 }));
}

#[test]
fn the_same_picture_has_the_same_bytes() {
    let draw =
        || draw_slices(&ramp([9, 8, 7]), &corner_cell(6.0), [4; 3], &slices_style()).unwrap();
    for format in [PictureFormat::Png, PictureFormat::Svg] {
        assert!(draw().encode(format).unwrap() == draw().encode(format).unwrap());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

    #[test]
    fn any_mesh_over_any_image_is_drawn_within_the_limits(
        shape in prop::array::uniform3(1usize..20),
        points in prop::collection::vec(prop::array::uniform3(-1e3..1e3), 4..20),
        corners in prop::collection::vec(0u32..4, 0..10),
        sample in prop::num::f32::ANY,
    ) {
        let count = shape.iter().product();
        let image = Image::new(Frame::new(shape).unwrap(), Samples::F32(vec![sample; count].into())).unwrap();
        let corners = corners[..corners.len() / 4 * 4].to_vec();
        let mesh = Mesh::new(points, corners).unwrap();
        let style = Style { atoms: true, max_side: 300.0, ..Style::default() };
        let picture = draw_slices(&image, &mesh, shape.map(|n| n / 2), &style).unwrap();
        prop_assert!(picture.width() <= 306 && picture.height() <= 306);
        picture.encode(PictureFormat::Png).unwrap();
        picture.encode(PictureFormat::Svg).unwrap();
    }
}
