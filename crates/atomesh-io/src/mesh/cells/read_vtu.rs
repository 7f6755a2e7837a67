//! Reading polygons and polyhedra with their sites, fields and features.

use std::collections::BTreeMap;

use super::super::field::OwnedField;
use super::super::metadata::{self, Metadata};
use super::super::read_error::{MeshReadError, malformed};
use super::super::vtu::array::Array;
use super::super::vtu::read::{Document, Piece};
use super::raw::RawCells;
use super::topology::CellFaces;
use super::vtu::{CELL, FEATURE, FEATURE_CELLS};

/// VTK's numbers for a polygon and a polyhedron.
const POLYGON: u32 = 7;
const POLYHEDRON: u32 = 42;

/// Reads what a VTU file of Voronoi cells says of them.
pub(super) fn read_cells_vtu(bytes: &[u8]) -> Result<RawCells, MeshReadError> {
    let document = Document::parse(bytes, "UnstructuredGrid")?;
    let [piece] = &document.pieces[..] else {
        return Err(malformed(0, "one piece", document.pieces.len().to_string()));
    };
    let dimension = dimension(piece)?;
    // versions up to 0.1.0 wrote what is known of polyhedra as field data
    let arrays = || piece.cell_data.iter().chain(&document.field_data);
    let named = |name: &str| {
        let found = arrays().find(|array| array.name == name);
        found.ok_or_else(|| malformed(piece.at, format!("the array {name:?} of cells"), "none"))
    };
    let sites = named("site")?.reals(piece.count_of(piece.cells, 3)?)?;
    let known = ["volume", CELL, FEATURE, metadata::NAME];
    let is_field = |array: &&Array| {
        let is_whole = array.tuples.is_none_or(|tuples| tuples == piece.cells);
        array.components == 1 && is_whole && !known.contains(&array.name)
    };
    let mut fields = Vec::new();
    for array in arrays().filter(is_field) {
        let Ok(values) = array.reals(piece.cells) else { continue };
        fields.push(OwnedField { name: array.name.into(), values });
    }
    let is_left = |array: &&Array| {
        array.name != "site"
            && !known.contains(&array.name)
            && !fields.iter().any(|field| field.name == array.name)
    };
    let skipped_fields =
        piece.cell_data.iter().filter(is_left).map(|array| array.name.to_owned()).collect();
    let text = document.field_data.iter().find(|array| array.name == metadata::NAME);
    let text = text.map(Array::string).transpose()?.unwrap_or_default();
    let metadata = Metadata::decode(&text);
    let standing = metadata.standing().filter(|_| dimension == 2);
    let in_plane = |places: Vec<[f64; 3]>| match &standing {
        Some(standing) => places.into_iter().map(|p| standing.in_plane(p)).collect(),
        None => places,
    };
    let cells = RawCells {
        dimension,
        sites: in_plane(sites.as_chunks::<3>().0.to_vec()),
        volumes: named("volume")?.reals(piece.cells)?,
        fields,
        skipped_fields,
        faces: Some((in_plane(points(piece)?), faces(piece, dimension)?)),
        features: features(&document.field_data)?,
        metadata,
    };
    match piece.cell_data.iter().find(|array| array.name == CELL) {
        Some(order) => ordered(cells, &order.indices(piece.cells)?),
        None => Ok(cells),
    }
}

/// 2 for polygons, 3 for polyhedra.
fn dimension(piece: &Piece) -> Result<usize, MeshReadError> {
    let kinds = topology(piece, "types")?.indices(piece.cells)?;
    let (kind, dimension) = match kinds.first() {
        Some(&POLYHEDRON) => (POLYHEDRON, 3),
        _ => (POLYGON, 2),
    };
    match kinds.iter().find(|other| **other != kind) {
        None if !kinds.is_empty() => Ok(dimension),
        other => {
            let found = other.map_or("none".into(), |kind| format!("VTK's type {kind}"));
            Err(malformed(piece.at, "Voronoi cells: polygons or polyhedra", found))
        }
    }
}

fn topology<'p, 'a>(piece: &'p Piece<'a>, name: &str) -> Result<&'p Array<'a>, MeshReadError> {
    let found = piece.topology.iter().find(|array| array.name == name);
    found.ok_or_else(|| malformed(piece.at, format!("{name} in <Cells>"), "none"))
}

fn points(piece: &Piece) -> Result<Vec<[f64; 3]>, MeshReadError> {
    let array = piece.coordinates.first();
    let array = array.ok_or_else(|| malformed(piece.at, "an array in <Points>", "none"))?;
    Ok(array.reals(piece.count_of(piece.points, 3)?)?.as_chunks::<3>().0.to_vec())
}

fn faces(piece: &Piece, dimension: usize) -> Result<CellFaces, MeshReadError> {
    let list = |list: &str, ends: &str| {
        let ends = topology(piece, ends)?.indices(piece.cells)?;
        let count = ends.last().map_or(0, |&end| end as usize);
        Ok::<_, MeshReadError>((topology(piece, list)?.indices(count)?, ends))
    };
    if dimension == 2 {
        let (points, ends) = list("connectivity", "offsets")?;
        CellFaces::of_polygons(&points, &ends)
    } else {
        let (faces, ends) = list("faces", "faceoffsets")?;
        CellFaces::of_polyhedra(&faces, &ends)
    }
}

/// The feature of each face on one, by the numbers of its two cells.
fn features(field_data: &[Array]) -> Result<BTreeMap<(u32, u32), u32>, MeshReadError> {
    let named = |name: &str| field_data.iter().find(|array| array.name == name);
    let (Some(cells), Some(features)) = (named(FEATURE_CELLS), named(FEATURE)) else {
        return Ok(BTreeMap::new());
    };
    let count = features.tuples.unwrap_or(0);
    let pairs = cells.indices(count.saturating_mul(2))?;
    let pairs = pairs.as_chunks::<2>().0.iter().map(|&[a, b]| (a.min(b), a.max(b)));
    Ok(pairs.zip(features.indices(count)?).filter(|(_, feature)| *feature > 0).collect())
}

/// The cells in the mesh's order; `places` has that of each.
fn ordered(cells: RawCells, places: &[u32]) -> Result<RawCells, MeshReadError> {
    let mut order = vec![usize::MAX; places.len()];
    for (at, &place) in places.iter().enumerate() {
        match order.get_mut(place as usize) {
            Some(slot) if *slot == usize::MAX => *slot = at,
            _ => {
                let expected = format!("each number below {} once in {CELL:?}", places.len());
                return Err(malformed(0, expected, place.to_string()));
            }
        }
    }
    let fields = cells.fields.into_iter().map(|field| OwnedField {
        name: field.name,
        values: order.iter().map(|&at| field.values[at]).collect(),
    });
    Ok(RawCells {
        sites: order.iter().map(|&at| cells.sites[at]).collect(),
        volumes: order.iter().map(|&at| cells.volumes[at]).collect(),
        fields: fields.collect(),
        faces: cells.faces.map(|(points, faces)| (points, faces.ordered(&order))),
        ..cells
    })
}
