//! The three orthogonal slices of tetrahedra or polyhedra over their image.

use atomesh::geometry::Point;
use atomesh::image::Image;
use atomesh::mesh::{Mesh, PolyMesh};

use crate::cut::{Level, unique};
use crate::error::DrawError;
use crate::label::label;
use crate::panel::{GAP, Panel};
use crate::picture::Picture;
use crate::raster::Ramp;
use crate::scale::{EDGE_SAMPLES, median, scale, typical_length};
use crate::shape::{Place, Rect, Shape};
use crate::style::Style;
use crate::view::view;

/// Half the side of an atom's square, in widths of an edge.
const ATOM_HALF: f64 = 2.0;

/// Draws the slices through sample `at` of an image with the cuts of the mesh's faces, as in figure 9
/// of Hale (2001), beside a view of the slices in space. Red lines show where the other slices are.
/// With [`Style::atoms`], atoms within one sample of a slice are drawn as squares.
///
/// The mesh is in sample coordinates. Cost: O(pixels + samples of the slices + cells).
///
/// # Errors
/// [`DrawError::Slice`] if `at` is outside the image, [`DrawError::Style`] if a number of the style is out of range.
pub fn draw_slices(
    image: &Image<3>,
    mesh: &Mesh<3>,
    at: [usize; 3],
    style: &Style,
) -> Result<Picture, DrawError> {
    draw(image, mesh, at, style)
}

/// Draws the cuts of polyhedra over the slices of an image, their sites as atoms; otherwise as
/// [`draw_slices`].
///
/// # Errors
/// As [`draw_slices`].
pub fn draw_polyhedra(
    image: &Image<3>,
    mesh: &PolyMesh<3>,
    at: [usize; 3],
    style: &Style,
) -> Result<Picture, DrawError> {
    draw(image, mesh, at, style)
}

/// Draws atoms alone over the slices of an image, in sample coordinates: of each slice, by the axis that it is normal to,
/// those that are given for it. The picture is as large as allowed.
///
/// # Errors
/// As [`draw_slices`].
pub fn draw_atoms_slices(
    image: &Image<3>,
    atoms: [&[Point<3>]; 3],
    at: [usize; 3],
    style: &Style,
) -> Result<Picture, DrawError> {
    let style = Style { edges: false, atoms: true, ..style.clone() };
    draw(image, &AtomsAtSlices(atoms), at, &style)
}

/// Atoms near each slice, without a mesh.
struct AtomsAtSlices<'a>([&'a [Point<3>]; 3]);

impl Sliced for AtomsAtSlices<'_> {
    fn cuts(&self, _: usize, _: Level) -> Vec<[Point<3>; 2]> {
        Vec::new()
    }

    fn atoms_near(&self, normal: usize, _: f64) -> Vec<Point<3>> {
        self.0[normal].to_vec()
    }

    fn edge(&self, _: &Point<3>) -> Option<f64> {
        None
    }
}

fn draw(
    image: &Image<3>,
    mesh: &dyn Sliced,
    at: [usize; 3],
    style: &Style,
) -> Result<Picture, DrawError> {
    let style = style.checked()?;
    let shape = image.frame().shape();
    for axis in 0..3 {
        if at[axis] >= shape[axis] {
            return Err(DrawError::Slice { axis, at: at[axis], count: shape[axis] });
        }
    }
    let step = image.frame().grid(style.units).step;
    let sides: Point<3> = std::array::from_fn(|k| shape[k] as f64 * step[k]);
    let extent = [sides[1] + sides[0], sides[1] + sides[2]];
    let scale = scale(mesh.edge(&step), &extent, style);
    let scene = Scene { image, mesh, at, style };
    let ramp = Ramp::robust(image.samples(), style.brightness);

    let mut picture = Picture::new(extent.map(|e| e * scale + GAP));
    let sides = sides.map(|side| side * scale);
    let corner = Rect { corner: [0.0; 2], size: [sides[1]; 2] };
    picture.shapes.extend(view(image, at, style, corner));
    for panel in Panel::all([-0.5; 3], sides, step.map(|s| s * scale), style.z_up) {
        picture.shapes.extend(scene.shapes(&panel, &ramp));
    }
    Ok(picture)
}

/// What all panels show.
struct Scene<'a> {
    image: &'a Image<3>,
    mesh: &'a dyn Sliced,
    at: [usize; 3],
    style: &'a Style,
}

impl Scene<'_> {
    fn shapes(&self, panel: &Panel, ramp: &Ramp) -> Vec<Shape> {
        let style = self.style;
        let mut shapes = vec![panel.image(self.image, self.at, style.units, ramp)];
        if style.edges {
            let (width, color) = (style.edge_width, style.edge_color);
            shapes.push(Shape::Lines { lines: self.cuts(panel), width, color });
        }
        if style.atoms {
            let (half, color) = (ATOM_HALF * style.edge_width, style.atom_color);
            shapes.push(Shape::Squares { centers: self.atoms(panel), half, color });
        }
        shapes.push(panel.cross_hair(&self.at.map(|i| i as f64)));
        shapes.extend(label(panel.slice.name, &panel.rect));
        shapes
    }

    /// The lines in which the plane cuts the faces of the cells, each once, in pixels.
    fn cuts(&self, panel: &Panel) -> Vec<[Place; 2]> {
        let at = self.at[panel.slice.normal];
        let level = Level { value: at as f64, own_is_above: at > 0 };
        let cuts = self.mesh.cuts(panel.slice.normal, level).into_iter();
        unique(cuts.map(|ends| ends.map(|p| panel.place(&p))))
    }

    fn atoms(&self, panel: &Panel) -> Vec<Place> {
        let normal = panel.slice.normal;
        let near = self.mesh.atoms_near(normal, self.at[normal] as f64);
        near.iter().map(|p| panel.place(p)).collect()
    }
}

/// A mesh that slices can show.
trait Sliced {
    /// The lines in which a plane cuts the mesh's faces.
    fn cuts(&self, normal: usize, level: Level) -> Vec<[Point<3>; 2]>;
    /// The atoms near a plane.
    fn atoms_near(&self, normal: usize, value: f64) -> Vec<Point<3>>;
    /// The typical length of an edge, for samples with sides `step`.
    fn edge(&self, step: &Point<3>) -> Option<f64>;
}

impl Sliced for Mesh<3> {
    fn cuts(&self, normal: usize, level: Level) -> Vec<[Point<3>; 2]> {
        let faces = faces_cut(self, normal, level).into_iter();
        faces.flat_map(|face| level.cut(normal, &face.map(|i| self.points()[i as usize]))).collect()
    }

    fn atoms_near(&self, normal: usize, value: f64) -> Vec<Point<3>> {
        within_a_sample(self.points(), normal, value)
    }

    fn edge(&self, step: &Point<3>) -> Option<f64> {
        typical_length(self, step)
    }
}

impl Sliced for PolyMesh<3> {
    fn cuts(&self, normal: usize, level: Level) -> Vec<[Point<3>; 2]> {
        let points = |face: usize| self.face(face).iter().map(|&c| self.points()[c as usize]);
        let cut = |face| level.cut(normal, &points(face).collect::<Vec<_>>());
        (0..self.face_count()).flat_map(cut).collect()
    }

    fn atoms_near(&self, normal: usize, value: f64) -> Vec<Point<3>> {
        within_a_sample(self.centers(), normal, value)
    }

    /// The distance between neighbouring sites, which compares with the edges of tetrahedra.
    fn edge(&self, step: &Point<3>) -> Option<f64> {
        let faces =
            (0..self.inner_face_count()).step_by(self.face_count().div_ceil(EDGE_SAMPLES).max(1));
        let length = |face: usize| {
            let [a, b] = [self.owners()[face], self.neighbours()[face]];
            let [a, b] = [a, b].map(|cell| self.centers()[cell as usize]);
            (0..3).map(|k| ((b[k] - a[k]) * step[k]).powi(2)).sum::<f64>().sqrt()
        };
        median(faces.map(length).collect())
    }
}

fn within_a_sample(atoms: &[Point<3>], normal: usize, value: f64) -> Vec<Point<3>> {
    atoms.iter().filter(|p| (p[normal] - value).abs() <= 1.0).copied().collect()
}

/// The faces with corners on both sides of the plane, each once, in order.
fn faces_cut(mesh: &Mesh<3>, normal: usize, level: Level) -> Vec<[u32; 3]> {
    let below = |i: u32| level.is_below(mesh.points()[i as usize][normal]);
    let mut faces = Vec::new();
    for cell in mesh.cells() {
        let sides = [0, 1, 2, 3].map(|k| below(cell[k]));
        if sides.iter().all(|&s| s == sides[0]) {
            continue;
        }
        for opposite in 0..4 {
            let [a, b, c] = [1, 2, 3].map(|k| (opposite + k) % 4);
            if sides[a] != sides[b] || sides[b] != sides[c] {
                let mut face = [cell[a], cell[b], cell[c]];
                face.sort_unstable();
                faces.push(face);
            }
        }
    }
    faces.sort_unstable();
    faces.dedup();
    faces
}
