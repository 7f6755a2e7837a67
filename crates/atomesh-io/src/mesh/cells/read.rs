//! Reading Voronoi cells that atomesh wrote: VTU, or the list of connections.
//!
//! A VTU file has the points and faces of its cells, and these are the mesh's; the volumes that it names must be theirs.
//! A list of connections has none. It names the sites, and Voronoi cells are made by their sites and their box,
//! which the frame gives: they are made again, and their volumes compared with the list's. Either way what is returned is
//! what was written, or an error says which cell is not.

use std::collections::BTreeMap;
use std::path::Path;

use atomesh::features::FeatureFaces;
use atomesh::geometry::{Bounds, Point};
use atomesh::image::{Frame, Units};
use atomesh::mesh::{Delaunay, PolyFault, PolyMesh};
use atomesh::run::Tools;
use atomesh::watch::Watch;

use super::super::field::OwnedField;
use super::super::provenance::Provenance;
use super::raw::{CellReadError, RawCells, read_bytes};
use super::read_vtu::read_cells_vtu;
use super::table::read_list;
use super::{CellData, NO_CELL, WELL};

/// Volumes may differ from the file's by this share of the mean volume: rounding on the way through the frame.
const SAME_VOLUME: f64 = 1e-8;

/// Voronoi cells as read from a file.
#[derive(Clone, Debug)]
pub struct LoadedCells<const D: usize> {
    /// The cells, in world coordinates, in the order in which they were made.
    pub mesh: PolyMesh<D>,
    /// Which faces lie on features; none where the file does not say it.
    pub features: FeatureFaces,
    /// The scalar fields in the cells, in the file's order.
    pub fields: Vec<OwnedField<f64>>,
    /// The names of fields left out: vectors, and values that are no numbers.
    pub skipped_fields: Vec<String>,
    /// The frame of the image that the cells follow.
    pub frame: Frame<D>,
    /// Where they come from.
    pub provenance: Provenance,
    /// The cell of each well, in their order; [`NO_CELL`] for one that no cell has.
    pub wells: Vec<u32>,
}

impl<const D: usize> LoadedCells<D> {
    /// The cells as they are written.
    pub fn data(&self) -> CellData<'_, D> {
        let Self { mesh, features, frame, provenance, wells, .. } = self;
        CellData { mesh, features, frame, provenance, wells }
    }
}

/// Voronoi cells whose dimension the file decides.
#[derive(Clone, Debug)]
pub enum AnyCells {
    /// Polygons.
    Flat(LoadedCells<2>),
    /// Polyhedra.
    Volume(LoadedCells<3>),
}

/// Reads Voronoi cells from a .vtu file, or the head (.json) of a list of connections and the tables beside it.
///
/// # Errors
/// [`CellReadError`] if the file is of another kind, or its cells are not those of its sites.
pub fn read_cells(path: &Path, watch: &mut dyn Watch) -> Result<AnyCells, CellReadError> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let raw = match extension.to_str() {
        Some("vtu") => read_cells_vtu(&read_bytes(path)?)?,
        Some("json") => read_list(path)?,
        _ => return Err(CellReadError::Format),
    };
    if raw.dimension == 2 {
        Ok(AnyCells::Flat(loaded(&Delaunay::<2>::new(), Tools::plane(), raw, watch)?))
    } else {
        Ok(AnyCells::Volume(loaded(&Delaunay::<3>::new(), Tools::space(), raw, watch)?))
    }
}

/// Where cells lie: the image's frame, and its box in the lattice's units.
struct Place<const D: usize> {
    frame: Frame<D>,
    units: Units,
    bounds: Bounds<D>,
    /// How far rounding in the world may take a place off in the lattice.
    rounding: f64,
}

impl<const D: usize> Place<D> {
    fn of(frame: Frame<D>, provenance: &Provenance) -> Self {
        let units = provenance.options.get("lattice").and_then(|lattice| lattice.get("units"));
        let units = units.and_then(|units| serde_json::from_value(units.clone()).ok());
        let units = units.unwrap_or_default();
        let grid = frame.grid(units);
        let scale = grid.step.iter().zip(frame.spacing()).map(|(step, spacing)| step / spacing);
        // a coordinate, the origin and D products are rounded, each by half a unit in the last place of the greatest
        let roundings = (D + 2) as f64 * f64::EPSILON * greatest(&frame);
        let rounding = roundings * scale.fold(0.0, f64::max);
        Self { frame, units, bounds: grid.bounds(), rounding }
    }

    /// The place in the lattice, on a side of the box where rounding took it off.
    fn in_lattice(&self, world: &Point<D>) -> Point<D> {
        on_sides(self.frame.world_to_lattice(self.units, world), &self.bounds, self.rounding)
    }
}

/// The greatest coordinate in the world, without its sign, of a corner of the box.
fn greatest<const D: usize>(frame: &Frame<D>) -> f64 {
    let last = frame.shape().map(|n| (n - 1) as f64);
    let corner = |n: usize| std::array::from_fn(|k| if n >> k & 1 == 0 { 0.0 } else { last[k] });
    let corners = (0..1 << D).map(|n| frame.lattice_to_world(Units::Samples, &corner(n)));
    corners.flatten().fold(0.0, |most, x| most.max(x.abs()))
}

impl<const D: usize> LoadedCells<D> {
    /// Checks what the cells promise, in the lattice, where the box has its sides: see [`PolyMesh::validate`]. What
    /// rounding of the file's coordinates can do is no fault.
    ///
    /// # Errors
    /// The first fault.
    pub fn validate(&self) -> Result<(), PolyFault> {
        let place = Place::of(self.frame, &self.provenance);
        let mesh = self.mesh.moved(self.frame.is_mirrored(), |p| place.in_lattice(p));
        mesh.validate_rounded(&place.bounds, place.rounding)
    }
}

/// The cells that a file describes.
fn loaded<const D: usize>(
    delaunay: &Delaunay<D>,
    tools: &Tools<D>,
    raw: RawCells,
    watch: &mut dyn Watch,
) -> Result<LoadedCells<D>, CellReadError> {
    let known = (raw.metadata.frame::<D>(), raw.metadata.provenance());
    let (Some(frame), Some(provenance)) = known else {
        let found = "cells without the frame of an image".to_string();
        return Err(CellReadError::NotVoronoi { found });
    };
    let place = Place::of(frame, &provenance);
    let sites: Vec<Point<D>> = raw.sites.iter().map(flat).collect();
    let mesh = match raw.faces {
        Some((points, faces)) => {
            let points: Vec<Point<D>> = points.iter().map(flat).collect();
            let in_lattice: Vec<Point<D>> = points.iter().map(|p| place.in_lattice(p)).collect();
            let side_of = |corners: &[u32]| side(corners, &in_lattice, &place.bounds);
            PolyMesh::new(faces.parts(points, sites, side_of)?)?
        }
        None => {
            let sites: Vec<Point<D>> = sites.iter().map(|p| place.in_lattice(p)).collect();
            let cells = (tools.voronoi)(delaunay, &sites, place.bounds, watch)?;
            cells.moved(frame.is_mirrored(), |p| frame.lattice_to_world(place.units, p))
        }
    };
    check_volumes(&mesh, &raw.volumes)?;
    let features = features(&mesh, &raw.features);
    let RawCells { mut fields, skipped_fields, .. } = raw;
    let wells = take_wells(&mut fields);
    Ok(LoadedCells { mesh, features, fields, skipped_fields, frame, provenance, wells })
}

/// The cell of each well, which files have as a field of their numbers.
fn take_wells(fields: &mut Vec<OwnedField<f64>>) -> Vec<u32> {
    // a field of somebody else's of that name has other numbers than those of wells, or one of them twice
    let count = |field: &OwnedField<f64>| {
        let all = field.values.len() as f64;
        let is_number = |well: &f64| well.fract() == 0.0 && (0.0..=all).contains(well);
        let mut numbers: Vec<u32> = field.values.iter().map(|&well| well as u32).collect();
        numbers.sort_unstable();
        let numbers = &numbers[numbers.partition_point(|&well| well == 0)..];
        let once = numbers.windows(2).all(|pair| pair[0] < pair[1]);
        let last = numbers.last().map(|&last| last as usize);
        last.filter(|_| once && field.values.iter().all(is_number))
    };
    let place = fields.iter().position(|field| field.name == WELL);
    let Some((place, count)) = place.and_then(|place| Some((place, count(&fields[place])?))) else {
        return Vec::new();
    };
    let of_cells = fields.remove(place).values;
    let mut wells = vec![NO_CELL; count];
    for (cell, &well) in of_cells.iter().enumerate().filter(|(_, well)| **well > 0.0) {
        wells[well as usize - 1] = cell as u32;
    }
    wells
}

fn flat<const D: usize>(place: &Point<3>) -> Point<D> {
    std::array::from_fn(|k| place[k])
}

/// The side of the box that all corners are on.
fn side<const D: usize>(corners: &[u32], points: &[Point<D>], bounds: &Bounds<D>) -> Option<usize> {
    (0..2 * D).find(|side| {
        let end = if side % 2 == 0 { bounds.min } else { bounds.max }[side / 2];
        let is_on = |&c: &u32| points.get(c as usize).is_some_and(|p| p[side / 2] == end);
        corners.iter().all(is_on)
    })
}

fn check_volumes<const D: usize>(mesh: &PolyMesh<D>, volumes: &[f64]) -> Result<(), CellReadError> {
    let mean = mesh.measure() / mesh.cell_count() as f64;
    for (cell, (&found, &expected)) in volumes.iter().zip(mesh.measures()).enumerate() {
        let same = (found - expected).abs() <= SAME_VOLUME * mean;
        if !same {
            return Err(CellReadError::OtherCell { cell, found, expected });
        }
    }
    Ok(())
}

/// The place itself, or on a side of the box that is not further away than rounding.
fn on_sides<const D: usize>(place: Point<D>, bounds: &Bounds<D>, rounding: f64) -> Point<D> {
    std::array::from_fn(|k| {
        let near = rounding.max(1e-10 * (bounds.max[k] - bounds.min[k]));
        let sides = [bounds.min[k], bounds.max[k]];
        sides.into_iter().find(|side| (place[k] - side).abs() <= near).unwrap_or(place[k])
    })
}

fn features<const D: usize>(mesh: &PolyMesh<D>, known: &BTreeMap<(u32, u32), u32>) -> FeatureFaces {
    let mut of_faces = vec![0; mesh.face_count()];
    let mut areas = vec![0.0; known.values().max().map_or(0, |&most| most as usize)];
    for (face, &neighbour) in mesh.neighbours().iter().enumerate() {
        if let Some(&feature) = known.get(&(mesh.owners()[face], neighbour)) {
            of_faces[face] = feature;
            let area = mesh.area_vector(face);
            areas[feature as usize - 1] += area.iter().map(|x| x * x).sum::<f64>().sqrt();
        }
    }
    FeatureFaces { of_faces, strengths: Vec::new(), areas }
}
