//! The three orthogonal slices of a tetrahedral mesh over its image.

use atomesh::geometry::Point;
use atomesh::image::Image;
use atomesh::mesh::{Mesh, PolyMesh};

use crate::flat::{LOOKS, median, scale, typical_length};
use crate::label::label;
use crate::picture::{Picture, Place, Rect, Shape};
use crate::raster::Ramp;
use crate::view::view;
use crate::{DrawError, Style};

/// Pixels between panels.
pub(crate) const GAP: f64 = 4.0;

/// Half the side of an atom's square, in widths of an edge.
const ATOM_HALF: f64 = 2.0;

/// The colour of the lines where the other slices pass.
pub(crate) const CROSS_HAIR: [u8; 3] = [230, 0, 0];

/// A slice: its name, the axis it is normal to, and the axes drawn to the right and down.
pub(crate) struct Plane {
    pub name: &'static str,
    pub normal: usize,
    pub right: usize,
    pub down: usize,
}

/// The slices in the paper's places: X-Y upper right, Y-Z lower left, X-Z lower right, so that x is
/// shared by the right panels and z by the lower ones.
pub(crate) const PLANES: [(Plane, [usize; 2]); 3] = [
    (Plane { name: "X-Y", normal: 2, right: 0, down: 1 }, [1, 0]),
    (Plane { name: "Y-Z", normal: 0, right: 1, down: 2 }, [0, 1]),
    (Plane { name: "X-Z", normal: 1, right: 0, down: 2 }, [1, 1]),
];

/// Draws the slices through sample `at` of an image with the cuts of the mesh's faces, as in figure 9
/// of Hale (2001), beside a view of the slices in space; red lines show where the other slices pass. With [`Style::atoms`], atoms within one
/// sample of a slice are drawn as squares.
///
/// The mesh is in sample coordinates. Cost: O(pixels + samples of the slices + cells).
///
/// # Errors
/// [`DrawError::Slice`] if `at` is outside the image, [`DrawError::Style`] if a number of the style has
/// no meaning.
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
    let scene = Scene { image, mesh, at, style, pixels: step.map(|s| s * scale) };
    let ramp = Ramp::robust(image.samples(), style.brightness);

    let mut picture = Picture::new(extent.map(|e| e * scale + GAP));
    let corner = Rect { corner: [0.0; 2], size: [sides[1] * scale; 2] };
    picture.shapes.extend(view(image, at, style, corner));
    for (plane, [column, row]) in &PLANES {
        let corner =
            [*column as f64 * (sides[1] * scale + GAP), *row as f64 * (sides[1] * scale + GAP)];
        let size = [plane.right, plane.down].map(|k| sides[k] * scale);
        let panel = Panel { scene: &scene, plane, rect: Rect { corner, size } };
        picture.shapes.extend(panel.shapes(&ramp));
    }
    Ok(picture)
}

/// What all panels show.
struct Scene<'a> {
    image: &'a Image<3>,
    mesh: &'a dyn Sliced,
    at: [usize; 3],
    style: &'a Style,
    /// Pixels to a sample along each axis.
    pixels: [f64; 3],
}

/// One slice in its place.
struct Panel<'a> {
    scene: &'a Scene<'a>,
    plane: &'a Plane,
    rect: Rect,
}

impl Panel<'_> {
    fn shapes(&self, ramp: &Ramp) -> Vec<Shape> {
        let (style, plane, rect) = (self.scene.style, self.plane, self.rect);
        let mut shapes = vec![self.background(ramp)];
        if style.edges {
            let (width, color) = (style.edge_width, style.edge_color);
            shapes.push(Shape::Lines { lines: self.cuts(), width, color });
        }
        if style.atoms {
            let (half, color) = (ATOM_HALF * style.edge_width, style.atom_color);
            shapes.push(Shape::Squares { centers: self.atoms(), half, color });
        }
        let cross = self.place(&self.scene.at.map(|i| i as f64));
        let [end_x, end_y] = std::array::from_fn(|k| rect.corner[k] + rect.size[k]);
        let lines = vec![
            [[rect.corner[0], cross[1]], [end_x, cross[1]]],
            [[cross[0], rect.corner[1]], [cross[0], end_y]],
        ];
        shapes.push(Shape::Lines { lines, width: 1.0, color: CROSS_HAIR });
        shapes.extend(label(plane.name, &rect));
        shapes
    }

    /// Whether the axis drawn downward is shown from its end.
    fn flipped(&self) -> bool {
        self.scene.style.z_up && self.plane.down == 2
    }

    /// Where a point, seen along the normal, is in the picture.
    fn place(&self, p: &Point<3>) -> Place {
        let Plane { right, down, .. } = *self.plane;
        let pixels = &self.scene.pixels;
        let x = (p[right] + 0.5) * pixels[right];
        let y = (p[down] + 0.5) * pixels[down];
        let y = if self.flipped() { self.rect.size[1] - y } else { y };
        [self.rect.corner[0] + x, self.rect.corner[1] + y]
    }

    fn background(&self, ramp: &Ramp) -> Shape {
        let Plane { normal, right, down, .. } = *self.plane;
        let grid = self.scene.image.frame().grid(self.scene.style.units);
        let (shape, strides) = (grid.shape, grid.strides());
        let start = self.scene.at[normal] * strides[normal];
        let samples = self.scene.image.samples();
        let raster = ramp.raster(samples, shape[right], shape[down], |i, j| {
            let j = if self.flipped() { shape[down] - 1 - j } else { j };
            start + i * strides[right] + j * strides[down]
        });
        Shape::upright(raster, self.rect)
    }

    /// Where the plane cuts the faces of the cells, each line once, in pixels.
    fn cuts(&self) -> Vec<[Place; 2]> {
        let cuts = self.scene.mesh.cuts(self.plane.normal, self.level()).into_iter();
        unique(cuts.map(|ends| ends.map(|p| self.place(&p))))
    }

    fn level(&self) -> Level {
        let at = self.scene.at[self.plane.normal];
        Level { value: at as f64, own_is_above: at > 0 }
    }

    fn atoms(&self) -> Vec<Place> {
        let (normal, value) = (self.plane.normal, self.level().value);
        let near = |p: &&Point<3>| (p[normal] - value).abs() <= 1.0;
        self.scene.mesh.atoms().iter().filter(near).map(|p| self.place(p)).collect()
    }
}

/// Lines to a hundredth of a pixel, each once and none without length, in order: faces around an edge that lies
/// in a plane share their cut.
pub(crate) fn unique(lines: impl Iterator<Item = [Place; 2]>) -> Vec<[Place; 2]> {
    let rounded = lines.map(|ends| {
        let [a, b] = ends.map(|p| p.map(|v| (v * 100.0).round() as i64));
        [a.min(b), a.max(b)]
    });
    let mut lines: Vec<[[i64; 2]; 2]> = rounded.filter(|[a, b]| a != b).collect();
    lines.sort_unstable();
    lines.dedup();
    lines.into_iter().map(|l| l.map(|p| p.map(|v| v as f64 / 100.0))).collect()
}

/// A plane at a constant coordinate. Points exactly on it count as one side, so that no face is cut in
/// a corner: as above, except on the first plane, below which there is nothing.
#[derive(Clone, Copy)]
pub(crate) struct Level {
    pub value: f64,
    pub own_is_above: bool,
}

impl Level {
    pub fn is_below(&self, x: f64) -> bool {
        if self.own_is_above { x < self.value } else { x <= self.value }
    }

    /// The line in which the plane across axis `normal` cuts a convex polygon, if it does.
    pub fn cut(self, normal: usize, corners: &[Point<3>]) -> Option<[Point<3>; 2]> {
        let mut ends = (0..corners.len()).filter_map(|at| {
            let (p, q) = (corners[at], corners[(at + 1) % corners.len()]);
            if self.is_below(p[normal]) == self.is_below(q[normal]) {
                return None;
            }
            let share = (self.value - p[normal]) / (q[normal] - p[normal]);
            Some(std::array::from_fn(|k| p[k] + share * (q[k] - p[k])))
        });
        Some([ends.next()?, ends.next()?])
    }
}

/// What slices show of a mesh.
trait Sliced {
    /// The lines in which a plane cuts the mesh's faces.
    fn cuts(&self, normal: usize, level: Level) -> Vec<[Point<3>; 2]>;
    /// The atoms.
    fn atoms(&self) -> &[Point<3>];
    /// The typical length of an edge, of samples with sides `step`.
    fn edge(&self, step: &Point<3>) -> Option<f64>;
}

impl Sliced for Mesh<3> {
    fn cuts(&self, normal: usize, level: Level) -> Vec<[Point<3>; 2]> {
        let faces = faces_cut(self, normal, level).into_iter();
        faces.flat_map(|face| level.cut(normal, &face.map(|i| self.points()[i as usize]))).collect()
    }

    fn atoms(&self) -> &[Point<3>] {
        self.points()
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

    fn atoms(&self) -> &[Point<3>] {
        self.centers()
    }

    /// From site to site: cells are as large as tetrahedra's edges are long.
    fn edge(&self, step: &Point<3>) -> Option<f64> {
        let faces = (0..self.inner_face_count()).step_by(self.face_count().div_ceil(LOOKS).max(1));
        let length = |face: usize| {
            let [a, b] = [self.owners()[face], self.neighbours()[face]];
            let [a, b] = [a, b].map(|cell| self.centers()[cell as usize]);
            (0..3).map(|k| ((b[k] - a[k]) * step[k]).powi(2)).sum::<f64>().sqrt()
        };
        median(faces.map(length).collect())
    }
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
