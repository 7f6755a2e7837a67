//! Voronoi cells for PFLOTRAN (explicit unstructured grids), TOUGH (MESH) and OPM (`read_grid`).
//!
//! All three find what flows between two cells from the distances of their centres from a place on the face between
//! them. The centre of a cell is its site and the place is where the line between the sites crosses the face, so that their
//! conductances are those of two-point flux, area / (d₁/k₁ + d₂/k₂), whatever the face's shape.
//!
//! Polygons are one layer of prisms. Faces that barriers seal are left out; a share that a barrier lets through takes the
//! area down, but for OPM, whose grids hold geometry alone.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use atomesh::geometry::Point;
use atomesh::mesh::{Connection, PolyMesh, boundary_connections, connections, side_name};
use atomesh::watch::Watch;

use super::super::error::MeshWriteError;
use super::modflow::Rock;
use super::{CellData, wells_beside, wells_table, write_texts};

/// A program that takes cells and what connects them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Simulator {
    /// PFLOTRAN: an explicit unstructured grid, and a list of connections for each side of the box.
    Pflotran,
    /// TOUGH2, TOUGH3, iTOUGH2: a file MESH.
    Tough,
    /// OPM: the text of an unstructured grid.
    Opm,
}

/// Where the files of a simulator go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SimulatorFiles {
    /// Whose they are.
    pub simulator: Simulator,
    /// The grid.
    pub grid: PathBuf,
    /// The sides of the box, by number: for PFLOTRAN alone.
    pub sides: Vec<PathBuf>,
    /// The cells of wells: NAME-wells.csv, written where there are any.
    pub wells: Option<PathBuf>,
}

impl SimulatorFiles {
    /// The files of a grid of so many axes: for PFLOTRAN NAME.uge, and beside it NAME-xmin.ex …
    pub fn of(simulator: Simulator, grid: &Path, dimension: usize) -> Self {
        let side = |side: usize| {
            let mut name = grid.file_stem().unwrap_or_default().to_owned();
            name.push(format!("-{}.ex", side_name(side)));
            grid.with_file_name(name)
        };
        let count = if simulator == Simulator::Pflotran { 2 * dimension } else { 0 };
        let wells = Some(wells_beside(grid));
        Self { simulator, grid: grid.into(), sides: (0..count).map(side).collect(), wells }
    }

    /// All of them.
    pub fn paths(&self) -> Vec<&Path> {
        std::iter::once(&self.grid)
            .chain(&self.sides)
            .chain(&self.wells)
            .map(PathBuf::as_path)
            .collect()
    }
}

/// The most elements that names of five characters tell apart as they are made here.
pub const MOST_TOUGH_ELEMENTS: usize = 26 * 36 * 36 * 100;

/// Writes the files. All appear only when all are written.
///
/// # Errors
/// If a file cannot be written, or the watch ends the work.
pub fn write_simulator<const D: usize>(
    files: &SimulatorFiles,
    data: &CellData<D>,
    rock: &Rock,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let cells = Cells { mesh: data.mesh, rock, faces: connections(data.mesh) };
    let mut texts = vec![(&files.grid, cells.grid(files.simulator))];
    texts.extend(files.sides.iter().zip(cells.sides()));
    let wells = wells_table(data, |cell| match files.simulator {
        Simulator::Pflotran => (cell + 1).to_string(),
        Simulator::Tough => tough_name(cell),
        Simulator::Opm => cell.to_string(),
    });
    texts.extend(files.wells.as_ref().zip(wells));
    write_texts(&texts, watch)
}

/// Cells with the faces between them.
struct Cells<'a, const D: usize> {
    mesh: &'a PolyMesh<D>,
    rock: &'a Rock<'a>,
    faces: Vec<Connection<D>>,
}

impl<const D: usize> Cells<'_, D> {
    fn grid(&self, simulator: Simulator) -> String {
        match simulator {
            Simulator::Pflotran => self.pflotran(),
            Simulator::Tough => self.tough(),
            Simulator::Opm => self.opm(),
        }
    }

    /// How thick the layer of polygons is; 1 of polyhedra.
    fn thickness(&self) -> f64 {
        if D == 2 { self.rock.thickness } else { 1.0 }
    }

    /// A place in space: of polygons, in the middle of the layer.
    fn in_space(&self, place: &Point<D>) -> [f64; 3] {
        let middle = self.rock.top - 0.5 * self.rock.thickness;
        std::array::from_fn(|k| place.get(k).copied().unwrap_or(middle))
    }

    /// Where the line between the centres of two cells crosses the face between them.
    fn crossing(&self, face: &Connection<D>) -> Point<D> {
        let [a, b] = face.cells.map(|cell| &self.mesh.centers()[cell as usize]);
        let [near, far] = face.distances;
        let share = near / (near + far);
        std::array::from_fn(|k| a[k] + share * (b[k] - a[k]))
    }

    /// The faces that let something through, each with its multiplier.
    fn open(&self) -> impl Iterator<Item = (&Connection<D>, f64)> {
        let all = self.faces.iter().zip(self.rock.multipliers);
        all.filter(|(_, multiplier)| **multiplier > 0.0).map(|(face, m)| (face, *m))
    }

    fn pflotran(&self) -> String {
        let (mesh, thickness) = (self.mesh, self.thickness());
        let mut text = format!("CELLS {}\n", mesh.cell_count());
        for (cell, (center, measure)) in mesh.centers().iter().zip(mesh.measures()).enumerate() {
            let [x, y, z] = self.in_space(center);
            let volume = measure * thickness;
            let _ = writeln!(text, "{} {x:?} {y:?} {z:?} {volume:?}", cell + 1);
        }
        let _ = writeln!(text, "CONNECTIONS {}", self.open().count());
        for (face, multiplier) in self.open() {
            let [a, b] = face.cells.map(|cell| cell + 1);
            let [x, y, z] = self.in_space(&self.crossing(face));
            let area = face.area * thickness * multiplier;
            let _ = writeln!(text, "{a} {b} {x:?} {y:?} {z:?} {area:?}");
        }
        text
    }

    /// The faces on each side of the box, as PFLOTRAN's regions take them. A cell whose site lies on the side is a
    /// thousandth of its size away from it, since PFLOTRAN divides by the distance.
    fn sides(&self) -> Vec<String> {
        let thickness = self.thickness();
        let mut lines = vec![String::new(); 2 * D];
        let mut counts = vec![0; 2 * D];
        for face in boundary_connections(self.mesh) {
            let cell = face.cell as usize;
            let size = self.mesh.measures()[cell].powf(1.0 / D as f64);
            let distance = face.distance.max(1e-3 * size);
            let center = &self.mesh.centers()[cell];
            let place: Point<D> = std::array::from_fn(|k| center[k] + distance * face.normal[k]);
            let [x, y, z] = self.in_space(&place);
            let area = face.area * thickness;
            let _ = writeln!(lines[face.side], "{} {x:?} {y:?} {z:?} {area:?}", cell + 1);
            counts[face.side] += 1;
        }
        let whole = |(lines, count): (String, usize)| format!("CONNECTIONS {count}\n{lines}");
        lines.into_iter().zip(counts).map(whole).collect()
    }

    /// Columns as the manual has them. The permeability is the modifier of the rock's, which counts where a rock is called
    /// SEED.
    fn tough(&self) -> String {
        let (mesh, thickness) = (self.mesh, self.thickness());
        let mut text = "ELEME\n".to_owned();
        let cells = mesh.centers().iter().zip(mesh.measures()).zip(self.rock.permeability);
        for (cell, ((center, measure), k)) in cells.enumerate() {
            let [x, y, z] = self.in_space(center).map(ten);
            let (name, volume, modifier) = (tough_name(cell), ten(measure * thickness), ten(*k));
            let _ = writeln!(text, "{name}{:15}{volume}{:10}{modifier}{x}{y}{z}", "", "");
        }
        text += "\nCONNE\n";
        for (face, multiplier) in self.open() {
            let [a, b] = face.cells.map(|cell| tough_name(cell as usize));
            let [near, far] = face.distances.map(ten);
            let area = ten(face.area * thickness * multiplier);
            // the first above the second counts as positive, z growing upwards
            let down = if D == 3 { -face.normal[2] } else { 0.0 };
            let _ = writeln!(text, "{a}{b}{:15}{:5}{near}{far}{area}{}", "", 1, ten(down));
        }
        text + "\n"
    }

    /// What `read_grid` reads: counts, points, faces, cells. A face that is sealed is two on the outside.
    fn opm(&self) -> String {
        let mesh = self.mesh;
        let sealed = |face: usize| self.rock.multipliers.get(face) == Some(&0.0);
        let mut faces = Vec::new();
        let mut of_cells = vec![Vec::new(); mesh.cell_count()];
        for face in 0..mesh.face_count() {
            let owner = mesh.owners()[face] as i64;
            let neighbour = mesh.neighbours().get(face).map_or(-1, |&cell| i64::from(cell));
            let both = match neighbour >= 0 && sealed(face) {
                true => vec![[owner, -1], [-1, neighbour]],
                false => vec![[owner, neighbour]],
            };
            for sides in both {
                let number = faces.len();
                let beside = sides.iter().filter(|cell| **cell >= 0);
                beside.for_each(|&cell| of_cells[cell as usize].push(number));
                faces.push((face, sides));
            }
        }
        let corner_count: usize = faces.iter().map(|(face, _)| mesh.face(*face).len()).sum();
        let cell_faces: usize = of_cells.iter().map(Vec::len).sum();
        let (cells, points) = (mesh.cell_count(), mesh.points().len());
        let counts = [D, cells, faces.len(), points, corner_count, cell_faces];
        let mut text = String::new();
        row(&mut text, counts);
        row(&mut text, [0, 0]); // neither tags of faces nor an index of cells
        row(&mut text, [cells, 1, 1].iter().take(D));
        mesh.points().iter().for_each(|point| row(&mut text, point.map(Real)));
        row(&mut text, starts(faces.iter().map(|(face, _)| mesh.face(*face).len())));
        faces.iter().for_each(|(face, _)| row(&mut text, mesh.face(*face)));
        faces.iter().for_each(|(_, sides)| row(&mut text, sides));
        let areas = faces.iter().map(|(face, _)| Real(length(&mesh.area_vector(*face))));
        areas.for_each(|area| row(&mut text, [area]));
        for (face, _) in &faces {
            let place = match self.faces.get(*face) {
                Some(connection) => self.crossing(connection),
                None => mesh.face_centroid(*face),
            };
            row(&mut text, place.map(Real));
        }
        faces.iter().for_each(|(face, _)| row(&mut text, mesh.area_vector(*face).map(Real)));
        row(&mut text, starts(of_cells.iter().map(Vec::len)));
        of_cells.iter().for_each(|faces| row(&mut text, faces));
        mesh.measures().iter().for_each(|measure| row(&mut text, [Real(*measure)]));
        mesh.centers().iter().for_each(|center| row(&mut text, center.map(Real)));
        text
    }
}

fn length<const D: usize>(vector: &Point<D>) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// A number with all its digits.
struct Real(f64);

impl std::fmt::Display for Real {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.0)
    }
}

fn row<T: std::fmt::Display>(text: &mut String, numbers: impl IntoIterator<Item = T>) {
    for (at, number) in numbers.into_iter().enumerate() {
        let _ = write!(text, "{}{number}", if at > 0 { " " } else { "" });
    }
    text.push('\n');
}

/// Where lists of these lengths begin, one after another, and where the last ends.
fn starts(lengths: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut sum = 0;
    let ends = lengths.map(|length| {
        sum += length;
        sum
    });
    std::iter::once(0).chain(ends).collect()
}

/// A name of three characters and two digits, the first a letter.
fn tough_name(cell: usize) -> String {
    const SIGNS: &[u8; 36] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789";
    let (rest, number) = (cell / 100, cell % 100);
    let sign = |at: usize| char::from(SIGNS[at]);
    let first = sign(rest / (36 * 36) % 26);
    format!("{first}{}{}{number:02}", sign(rest / 36 % 36), sign(rest % 36))
}

/// The number in ten columns, with a point, as near as they allow.
fn ten(x: f64) -> String {
    let fixed = (0..9).rev().map(|digits| format!("{x:.digits$}"));
    let scaled = (0..8).rev().map(|digits| format!("{x:.digits$E}"));
    let has_point = |text: &String| text.contains('.') && text.len() <= 10;
    let error = |text: &String| (text.parse::<f64>().unwrap_or(f64::INFINITY) - x).abs();
    let best = fixed.chain(scaled).filter(has_point).min_by(|a, b| error(a).total_cmp(&error(b)));
    format!("{:>10}", best.unwrap_or_else(|| format!("{x:.0E}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_fit_ten_columns() {
        for x in
            [0.0, 1.0, -1.0, 430_123.456_789, -6.470_123_456e6, 1.234_567e-12, -9.87e300, 0.1 + 0.2]
        {
            let text = ten(x);
            assert_eq!(text.len(), 10, "{text:?}");
            let back: f64 = text.trim().parse().unwrap();
            assert!((back - x).abs() <= 5e-3 * x.abs(), "{text:?} for {x}");
            assert!(text.contains('.'), "{text:?}");
        }
        assert_eq!(ten(430_123.456_789), "430123.457");
    }

    #[test]
    fn names_are_different_and_begin_with_a_letter() {
        assert_eq!(tough_name(0), "AAA00");
        assert_eq!(tough_name(3_599), "AA999");
        let last = tough_name(MOST_TOUGH_ELEMENTS - 1);
        assert_eq!(last, "Z9999");
        let names: std::collections::BTreeSet<String> = (0..200_000).map(tough_name).collect();
        assert_eq!(names.len(), 200_000);
    }
}
