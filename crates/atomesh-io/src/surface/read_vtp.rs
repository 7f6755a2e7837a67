//! Reading VTP, VTK's XML format for poly data: lines of two points and triangles.

use super::loaded::LoadedSurface;
use crate::mesh::MeshReadError;
use crate::mesh::read_error::malformed;
use crate::mesh::vtu::array::Array;
use crate::mesh::vtu::read::Document;

/// Reads the lines and triangles of the first piece of a VTP file, with the names of their groups where
/// atomesh wrote them. Other cells are an error.
pub(super) fn read_vtp(bytes: &[u8]) -> Result<LoadedSurface, MeshReadError> {
    let document = Document::parse(bytes, "PolyData")?;
    let mut surface = LoadedSurface::default();
    let Some(piece) = document.pieces.first() else { return Ok(surface) };
    if let Some(points) = piece.coordinates.first() {
        let numbers = points.reals(piece.count_of(piece.points, 3)?)?;
        surface.points.extend(numbers.as_chunks::<3>().0);
    }
    let lines = corners(&piece.lines, piece.counts[0], 2)?;
    surface.lines.extend(lines.as_chunks::<2>().0);
    let triangles = corners(&piece.polygons, piece.counts[1], 3)?;
    surface.triangles.extend(triangles.as_chunks::<3>().0);
    let count = surface.lines.len() + surface.triangles.len();
    surface.groups = vec![String::new(); count];
    let named = |name: &str| document.field_data.iter().find(|array| array.name == name);
    let feature = piece.cell_data.iter().find(|array| array.name == "feature");
    if let (Some(feature), Some(ids), Some(names)) =
        (feature, named("feature_ids"), named("feature_names"))
    {
        let ids = ids.indices(ids.tuples.unwrap_or(0))?;
        let names = String::from_utf8_lossy(&names.string()?).into_owned();
        for (group, id) in surface.groups.iter_mut().zip(feature.indices(count)?) {
            let at = ids.iter().position(|own| *own == id);
            *group = at.and_then(|at| names.lines().nth(at)).unwrap_or_default().to_owned();
        }
    }
    Ok(surface)
}

/// The corners of `count` cells of `each` corners.
fn corners(arrays: &[Array], count: usize, each: usize) -> Result<Vec<u32>, MeshReadError> {
    if count == 0 {
        return Ok(Vec::new());
    }
    let named = |name: &str| {
        let found = arrays.iter().find(|array| array.name == name);
        found.ok_or_else(|| malformed(0, format!("the array {name:?}"), "none"))
    };
    let ends = named("offsets")?.indices(count)?;
    if let Some(odd) = (0..count).find(|&i| ends[i] as usize != (i + 1) * each) {
        let expected = format!("cells of {each} corners");
        return Err(malformed(0, expected, format!("offset {} of cell {odd}", ends[odd])));
    }
    named("connectivity")?.indices(count.saturating_mul(each))
}
