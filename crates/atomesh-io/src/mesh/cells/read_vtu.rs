//! Reading the sites and fields of polygons and polyhedra.

use super::super::field::OwnedField;
use super::super::metadata::{self, Metadata};
use super::super::read_error::{MeshReadError, malformed};
use super::super::vtu::array::Array;
use super::super::vtu::read::Document;
use super::raw::RawCells;

/// VTK's numbers for a polygon and a polyhedron.
const POLYGON: u32 = 7;
const POLYHEDRON: u32 = 42;

/// Reads what a VTU file of Voronoi cells says of them, its corners and faces apart.
pub(super) fn read_cells_vtu(bytes: &[u8]) -> Result<RawCells, MeshReadError> {
    let document = Document::parse(bytes, "UnstructuredGrid")?;
    let [piece] = &document.pieces[..] else {
        return Err(malformed(0, "one piece", document.pieces.len().to_string()));
    };
    let kinds = piece.topology.iter().find(|array| array.name == "types");
    let kinds = kinds.ok_or_else(|| malformed(piece.at, "types in <Cells>", "none"))?;
    let kinds = kinds.indices(piece.cells)?;
    let dimension = match kinds.first() {
        Some(&POLYGON) => 2,
        Some(&POLYHEDRON) => 3,
        other => {
            let found = other.map_or("none".into(), |kind| format!("VTK's type {kind}"));
            return Err(malformed(piece.at, "Voronoi cells: polygons or polyhedra", found));
        }
    };
    // polyhedra have their values in the field data
    let arrays = || piece.cell_data.iter().chain(&document.field_data);
    let named = |name: &str| {
        let found = arrays().find(|array| array.name == name);
        found.ok_or_else(|| malformed(piece.at, format!("the array {name:?} of cells"), "none"))
    };
    let sites = named("site")?.reals(piece.count_of(piece.cells, 3)?)?;
    let is_field = |array: &&Array| {
        let is_whole = array.tuples.is_none_or(|tuples| tuples == piece.cells);
        array.components == 1 && is_whole && array.name != metadata::NAME && array.name != "volume"
    };
    let mut fields = Vec::new();
    for array in arrays().filter(is_field) {
        let Ok(values) = array.reals(piece.cells) else { continue };
        fields.push(OwnedField { name: array.name.into(), values });
    }
    let text = document.field_data.iter().find(|array| array.name == metadata::NAME);
    let text = text.map(Array::string).transpose()?.unwrap_or_default();
    Ok(RawCells {
        dimension,
        sites: sites.as_chunks::<3>().0.to_vec(),
        volumes: named("volume")?.reals(piece.cells)?,
        fields,
        metadata: Metadata::decode(&text),
        ..RawCells::default()
    })
}
