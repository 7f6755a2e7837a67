//! Pictures in space, decoded and looked at pixel by pixel.

use atomesh::image::{Frame, Image, Samples};
use atomesh::mesh::{Delaunay, Mesh};
use atomesh::watch::Silent;
use atomesh_draw::{DrawError, FlowCells, PictureFormat, Sheet, SpacePicture, Style, draw_space};

use crate::pixels::Pixels;

const SIDE: usize = 9;

/// A cube of equal samples.
fn grey_cube() -> Image<3> {
    let samples = Samples::U8(vec![100; SIDE.pow(3)].into());
    Image::new(Frame::new([SIDE; 3]).unwrap(), samples).unwrap()
}

/// A crystal of cubes over the image, as tetrahedra.
fn tetrahedra() -> Mesh<3> {
    let at = |i: usize| 2.0 * i as f64;
    let points: Vec<_> = (0..125).map(|i| [at(i % 5), at(i / 5 % 5), at(i / 25)]).collect();
    Delaunay::<3>::new().connect(&points, &mut Silent).unwrap()
}

/// The part of a picture that a colour's hue has: pixels that are clearly more of `channel` than of the others.
fn share(pixels: &Pixels, channel: usize) -> f64 {
    let is_of =
        |rgb: &&[u8; 3]| (0..3).all(|k| k == channel || rgb[channel] > rgb[k].saturating_add(40));
    pixels.rgb.iter().filter(is_of).count() as f64 / pixels.rgb.len() as f64
}

fn scene<'a>(
    mesh: &'a Mesh<3>,
    image: Option<&'a Image<3>>,
    sheets: &'a [Sheet<3>],
) -> SpacePicture<'a, 3> {
    let cells = FlowCells::Simplices(mesh);
    SpacePicture { cells, image, sheets, parts: &[], cells_cut_away: false }
}

/// The facets of the mesh on a plane normal to an axis.
fn plane(mesh: &Mesh<3>, axis: usize, at: f64) -> Vec<[u32; 3]> {
    let is_on = |corners: &[u32; 3]| corners.iter().all(|&c| mesh.points()[c as usize][axis] == at);
    mesh.facets().iter().map(|facet| facet.corners).filter(is_on).collect()
}

#[test]
fn a_surface_hides_what_is_behind_it_and_is_hidden_by_what_is_before_it() {
    let (mesh, image) = (tetrahedra(), grey_cube());
    let style = Style { edges: false, max_side: 300.0, ..Style::default() };
    let shown = |z: f64| {
        // the first colour is red
        let sheets = [Sheet { name: "z".into(), facets: plane(&mesh, 2, z) }];
        let picture = draw_space(&scene(&mesh, Some(&image), &sheets), &style).unwrap();
        share(&Pixels::of(&picture), dominant())
    };
    // z is depth: the uppermost is nearest to the eye, the lowest is behind the horizontal slice
    let (top, middle, bottom) = (shown(0.0), shown(4.0), shown(8.0));
    assert!(top > 0.1, "{top}");
    assert!(middle > 0.05 && middle < top + 0.01, "{middle} of {top}");
    // what stands out below the slice stays in sight
    assert!(bottom < 0.7 * top, "{bottom} of {top}");
}

/// The channel of the first sheet's colour.
fn dominant() -> usize {
    let mesh = tetrahedra();
    let sheets = [Sheet { name: String::new(), facets: plane(&mesh, 2, 0.0) }];
    let style = Style { edges: false, max_side: 100.0, ..Style::default() };
    let pixels = Pixels::of(&draw_space(&scene(&mesh, None, &sheets), &style).unwrap());
    (0..3).max_by(|&a, &b| share(&pixels, a).total_cmp(&share(&pixels, b))).unwrap()
}

#[test]
fn cells_cut_away_leave_seven_eighths_and_show_their_parts() {
    let mesh = tetrahedra();
    // the lower half is one part, the upper another
    let z = |cell: &[u32]| cell.iter().map(|&c| mesh.points()[c as usize][2]).sum::<f64>() / 4.0;
    let parts: Vec<i32> = mesh.cells().map(|cell| if z(cell) < 4.0 { 1 } else { 2 }).collect();
    let style = Style { max_side: 300.0, ..Style::default() };
    let solid = SpacePicture { parts: &parts, cells_cut_away: true, ..scene(&mesh, None, &[]) };
    let bytes = draw_space(&solid, &style).unwrap().encode(PictureFormat::Png).unwrap();
    let plain = SpacePicture { parts: &[], ..solid };
    let plain = draw_space(&plain, &style).unwrap();
    assert_ne!(bytes, plain.encode(PictureFormat::Png).unwrap(), "parts have colours");
    let pixels = Pixels::of(&plain);
    // a cube from above covers most of a picture that fits it; what is cut away changes that nowhere but in its light
    let background = pixels.at(2.0, 2.0);
    let covered = pixels.rgb.iter().filter(|rgb| **rgb != background).count() as f64;
    assert!(covered / pixels.rgb.len() as f64 > 0.6);
}

#[test]
fn a_picture_is_the_same_again_and_its_svg_holds_the_pixels() {
    let (mesh, image) = (tetrahedra(), grey_cube());
    let sheets = [Sheet { name: "feature-1".into(), facets: plane(&mesh, 0, 4.0) }];
    let contents = scene(&mesh, Some(&image), &sheets);
    let draw = |format| {
        let style = Style { max_side: 200.0, ..Style::default() };
        draw_space(&contents, &style).unwrap().encode(format).unwrap()
    };
    assert_eq!(draw(PictureFormat::Png), draw(PictureFormat::Png));
    let svg = String::from_utf8(draw(PictureFormat::Svg)).unwrap();
    assert!(svg.contains("data:image/png;base64,"), "{}", &svg[..200]);
}

#[test]
fn what_does_not_fit_the_mesh_is_refused() {
    let mesh = tetrahedra();
    let sheets = [Sheet { name: String::new(), facets: vec![[0, 1, 125]] }];
    let refused = draw_space(&scene(&mesh, None, &sheets), &Style::default());
    assert_eq!(refused.unwrap_err(), DrawError::Point { point: 125, count: 125 });
    let contents = SpacePicture { parts: &[1], ..scene(&mesh, None, &[]) };
    let refused = draw_space(&contents, &Style::default()).unwrap_err();
    assert!(matches!(refused, DrawError::Count { what: "parts", found: 1, .. }), "{refused}");
}

#[test]
fn nothing_is_a_picture_of_an_empty_box() {
    let mesh = Mesh::new(Vec::new(), Vec::new()).unwrap();
    let style = Style { max_side: 50.0, ..Style::default() };
    let picture = draw_space(&scene(&mesh, None, &[]), &style).unwrap();
    assert!(picture.width() <= 50 && picture.height() <= 50);
    let solid = SpacePicture { cells_cut_away: true, ..scene(&mesh, None, &[]) };
    assert!(draw_space(&solid, &style).is_ok());
}
