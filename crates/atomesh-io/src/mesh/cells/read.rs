//! Reading Voronoi cells that atomesh wrote: VTU, or the list of connections.
//!
//! Both files name the sites, and Voronoi cells are made by their sites and their box, which the frame gives. So
//! cells are not pieced together from the file's faces, but made again, and their volumes are compared with the
//! file's: what is returned is what was written, or an error says which cell is not. The list also says which
//! faces lie on features.

use std::collections::BTreeMap;
use std::path::Path;

use atomesh::features::FeatureFaces;
use atomesh::geometry::{Bounds, Point};
use atomesh::image::{Frame, Units};
use atomesh::mesh::{Delaunay, PolyMesh};
use atomesh::run::Tools;
use atomesh::watch::Watch;

use super::super::field::OwnedField;
use super::super::provenance::Provenance;
use super::raw::{CellReadError, RawCells, read_bytes};
use super::read_vtu::read_cells_vtu;
use super::table::read_list;

/// Volumes may differ from the file's by this share of the mean volume: rounding on the way through the frame.
const SAME_VOLUME: f64 = 1e-8;

/// Voronoi cells as read from a file.
#[derive(Clone, Debug)]
pub struct LoadedCells<const D: usize> {
    /// The cells, in world coordinates, in the file's order.
    pub mesh: PolyMesh<D>,
    /// Which faces lie on features; none where the file does not say it.
    pub features: FeatureFaces,
    /// The scalar fields in the cells, in the file's order.
    pub fields: Vec<OwnedField<f64>>,
    /// The frame of the image that the cells follow.
    pub frame: Frame<D>,
    /// Where they come from.
    pub provenance: Provenance,
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
        Ok(AnyCells::Flat(rebuild(&Delaunay::<2>::new(), Tools::plane(), raw, watch)?))
    } else {
        Ok(AnyCells::Volume(rebuild(&Delaunay::<3>::new(), Tools::space(), raw, watch)?))
    }
}

/// The cells of the sites, in the box of the frame.
fn rebuild<const D: usize>(
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
    let units = provenance.options.get("lattice").and_then(|lattice| lattice.get("units"));
    let units = units.and_then(|units| serde_json::from_value(units.clone()).ok());
    let units: Units = units.unwrap_or_default();
    let bounds = frame.grid(units).bounds();
    let site = |site: &Point<3>| {
        let world: Point<D> = std::array::from_fn(|k| site[k]);
        on_sides(frame.world_to_lattice(units, &world), &bounds)
    };
    let sites: Vec<Point<D>> = raw.sites.iter().map(site).collect();
    let cells = (tools.voronoi)(delaunay, &sites, bounds, watch)?;
    let mesh = cells.moved(frame.is_mirrored(), |p| frame.lattice_to_world(units, p));
    let mean = mesh.measure() / mesh.cell_count() as f64;
    for (cell, (&found, &expected)) in raw.volumes.iter().zip(mesh.measures()).enumerate() {
        let same = (found - expected).abs() <= SAME_VOLUME * mean;
        if !same {
            return Err(CellReadError::OtherCell { cell, found, expected });
        }
    }
    let features = features(&mesh, &raw.features);
    Ok(LoadedCells { mesh, features, fields: raw.fields, frame, provenance })
}

/// The place itself, or on a side of the box that is not further away than rounding.
fn on_sides<const D: usize>(place: Point<D>, bounds: &Bounds<D>) -> Point<D> {
    std::array::from_fn(|k| {
        let near = 1e-10 * (bounds.max[k] - bounds.min[k]);
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
