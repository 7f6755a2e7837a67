//! A mesh in space as seen from above: slices of the image, surfaces, cells cut away.
//!
//! What is nearer hides what is farther, pixel by pixel ([`depth`]): surfaces may pass through slices and through each
//! other, as in figure 10 of Hale (2001). The parallel projection is that of the other views.

mod depth;
mod names;
mod solid;

use atomesh::geometry::{Point, difference, dot};
use atomesh::image::Image;

use crate::color_map::color_of_part;
use crate::error::DrawError;
use crate::flow::FlowCells;
use crate::picture::Picture;
use crate::raster::Ramp;
use crate::shape::{Place, Rect, Shape};
use crate::style::{Color, Style};
use crate::view::{BACKGROUND, BRIGHTNESS, Camera, Fit, OUTLINE, box_edges};
use depth::{Corner, DepthCanvas, Outline};
use solid::Solid;

/// The longest side of a picture in pixels, unless the style allows less.
const LONGEST: f64 = 1200.0;

/// The share of the light that comes from everywhere; the rest depends on how a facet faces the eye.
const AMBIENT: f64 = 0.45;

/// The light on an edge, over that on its facet; on dark facets edges are lighter by so much instead.
const EDGE: f64 = 0.6;
const LIGHTER: u8 = 60;

/// The brightest colour of a facet on which edges are lighter.
const DARK: u8 = 80;

/// Where slices lie between the side of the box that is nearest to the eye and the farthest one.
const SLICES: f64 = 0.7;

/// A surface: facets of a mesh in one colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet<const D: usize> {
    /// What it is, for the legend. Letters, digits and the signs `-`, `_` and `.` are shown.
    pub name: String,
    /// The corners of its facets, as numbers of the mesh's points.
    pub facets: Vec<[u32; D]>,
}

/// The contents of a picture in space, in sample coordinates. Whatever is empty is not drawn.
#[derive(Clone, Copy, Debug)]
pub struct SpacePicture<'a, const D: usize> {
    /// The mesh.
    pub cells: FlowCells<'a, D>,
    /// The image of the slices, and on cells cut away. Without one, the box is the mesh's.
    pub image: Option<&'a Image<D>>,
    /// Surfaces, each in its colour.
    pub sheets: &'a [Sheet<D>],
    /// The part of each cell, as its colour where cells are cut away.
    pub parts: &'a [i32],
    /// Whether cells are drawn in place of slices, those nearest to the eye cut away: an eighth of the box.
    pub cells_cut_away: bool,
}

impl<const D: usize> SpacePicture<'_, D> {
    fn check(&self) -> Result<(), DrawError> {
        let (found, expected) = (self.parts.len(), self.cells.cell_count());
        if found != 0 && found != expected {
            return Err(DrawError::Count { what: "parts", found, expected });
        }
        let count = self.cells.points().len();
        let corners = self.sheets.iter().flat_map(|sheet| sheet.facets.iter().flatten());
        match corners.copied().find(|&point| point as usize >= count) {
            Some(point) => Err(DrawError::Point { point, count }),
            None => Ok(()),
        }
    }
}

/// Draws slices of an image in space with surfaces before them; or the cells of a mesh, an eighth of them cut away, in the
/// greys of the image or the colours of their parts.
///
/// [`Style::edges`] are those of facets, darker than these, or lighter on dark ones. The picture has [`Style::max_side`] pixels or 1200, whichever
/// is less, along its longer side. Cost: O(pixels + cells + facets).
///
/// # Errors
/// [`DrawError::Style`] if a number of the style is out of range, [`DrawError::Count`] if there is not one part for each
/// cell, [`DrawError::Point`] if a surface has a corner that is not the mesh's.
pub fn draw_space(contents: &SpacePicture<'_, 3>, style: &Style) -> Result<Picture, DrawError> {
    let style = style.checked()?;
    contents.check()?;
    let scene = Scene::new(contents, style);
    let size = scene.size.map(|side| side.ceil().max(1.0) as usize);
    let mut canvas = DepthCanvas::new(size, BACKGROUND);
    if contents.cells_cut_away {
        Solid::new(&scene).paint(&mut canvas);
    } else {
        scene.slices(&mut canvas);
    }
    for (sheet, number) in contents.sheets.iter().zip(1..) {
        scene.sheet(sheet, color_of_part(number), &mut canvas);
    }
    scene.frame(&mut canvas);
    let mut picture = Picture::new(scene.size);
    let corner = [0.0; 2];
    picture.shapes.push(Shape::Colors { raster: canvas.pixels(), corner });
    picture.shapes.push(names::of_axes(&scene));
    let named = contents.sheets.iter().zip(1..);
    let named = named.map(|(sheet, number)| (sheet.name.as_str(), color_of_part(number)));
    picture.shapes.extend(names::legend(named.collect(), scene.size));
    Ok(picture)
}

/// What is drawn, the box around it, and where its points are in the picture.
struct Scene<'a> {
    contents: &'a SpacePicture<'a, 3>,
    style: &'a Style,
    ramp: Option<Ramp>,
    camera: Camera,
    fit: Fit,
    /// The size of the picture in pixels.
    size: Place,
    /// The box: its least sample coordinates and its extent.
    first: Point<3>,
    extent: Point<3>,
    /// The sides of a sample.
    step: Point<3>,
}

impl<'a> Scene<'a> {
    fn new(contents: &'a SpacePicture<'a, 3>, style: &'a Style) -> Self {
        let (first, extent) = contents.cells.shown_box(contents.image);
        let step = contents.image.map_or([1.0; 3], |i| i.frame().grid(style.units).step);
        let camera = Camera::new(style.z_up);
        let sides = std::array::from_fn(|k| extent[k] * step[k]);
        let seen = camera.seen(&sides);
        let longest = LONGEST.min(style.max_side);
        let share = longest / seen[0].max(seen[1]);
        let size = seen.map(|side| side * share);
        let fit = camera.fit(&sides, &Rect { corner: [0.0; 2], size });
        let ramp = contents.image.map(|image| Ramp::robust(image.samples(), BRIGHTNESS));
        Self { contents, style, ramp, camera, fit, size, first, extent, step }
    }

    /// Where a point is in the picture, and how far from the eye.
    fn seen(&self, p: &Point<3>) -> Corner {
        let p = self.in_box(p);
        let [x, y] = self.fit.place(self.camera.project(&p));
        [x, y, dot(&p, &self.camera.away)]
    }

    /// A point relative to the least corner of the box, in units of length.
    fn in_box(&self, p: &Point<3>) -> Point<3> {
        let p = difference(p, &self.first);
        std::array::from_fn(|k| p[k] * self.step[k])
    }

    /// A place between the sides of the box, 0 nearest to the eye and 1 farthest from it, along each axis.
    fn between(&self, share: f64) -> Point<3> {
        std::array::from_fn(|k| {
            let share = if self.camera.away[k] > 0.0 { share } else { 1.0 - share };
            self.first[k] + share * self.extent[k]
        })
    }

    /// The light on a facet, from [`AMBIENT`] seen edge-on to 1 from the front.
    fn light(&self, corners: &[Point<3>; 3]) -> f64 {
        let facing = self.camera.facing(&corners.each_ref().map(|p| self.in_box(p)));
        AMBIENT + (1.0 - AMBIENT) * facing
    }

    /// The edges of a facet of a colour, those asked for.
    fn outline(&self, color: Color, edges: [bool; 3]) -> Option<Outline> {
        let is_dark = color.iter().all(|&c| c < DARK);
        let color = if is_dark { color.map(|c| c + LIGHTER) } else { lit(color, EDGE) };
        self.style.edges.then_some(Outline { edges, width: self.style.edge_width, color })
    }

    /// The grey of the image's sample nearest to a place; a middle grey without one.
    fn grey(&self, p: &Point<3>) -> Color {
        match (self.contents.image, &self.ramp) {
            (Some(image), Some(ramp)) => {
                let shape = image.frame().shape();
                let sample = |k: usize| (p[k].round().max(0.0) as usize).min(shape[k] - 1);
                let at = (sample(2) * shape[1] + sample(1)) * shape[0] + sample(0);
                [ramp.grey(image.samples().get(at)); 3]
            }
            _ => [160; 3],
        }
    }

    /// Three slices through one place.
    fn slices(&self, canvas: &mut DepthCanvas) {
        if self.contents.image.is_none() {
            return;
        }
        // through the middles of samples, where it is plain which one is shown
        let at = self.between(SLICES).map(f64::round);
        for normal in 0..3 {
            let (right, down) = ((normal + 1) % 3, (normal + 2) % 3);
            let corner = |i: usize, j: usize| -> Point<3> {
                let mut p = at;
                p[right] = self.first[right] + i as f64 * self.extent[right];
                p[down] = self.first[down] + j as f64 * self.extent[down];
                p
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            for half in [[a, b, c], [a, c, d]] {
                canvas.triangle(half.each_ref().map(|p| self.seen(p)), None, |shares| {
                    self.grey(&between(&half, shares))
                });
            }
            for ends in [[a, b], [b, c], [c, d], [d, a]] {
                canvas.line(ends.map(|p| self.seen(&p)), 1.0, OUTLINE);
            }
        }
    }

    fn sheet(&self, sheet: &Sheet<3>, color: Color, canvas: &mut DepthCanvas) {
        let points = self.contents.cells.points();
        for facet in &sheet.facets {
            let corners = facet.map(|point| points[point as usize]);
            let color = lit(color, self.light(&corners));
            let outline = self.outline(color, [true; 3]);
            canvas.triangle(corners.map(|p| self.seen(&p)), outline, |_| color);
        }
    }

    /// The edges of the box, where nothing hides them.
    fn frame(&self, canvas: &mut DepthCanvas) {
        for (_, ends) in box_edges(&self.first, &self.extent) {
            canvas.line(ends.map(|p| self.seen(&p)), 1.0, OUTLINE);
        }
    }
}

/// A colour in less light.
fn lit(color: Color, light: f64) -> Color {
    color.map(|c| (f64::from(c) * light).round() as u8)
}

/// The place of which corners have these shares.
fn between(corners: &[Point<3>; 3], shares: [f64; 3]) -> Point<3> {
    std::array::from_fn(|k| (0..3).map(|i| shares[i] * corners[i][k]).sum())
}
