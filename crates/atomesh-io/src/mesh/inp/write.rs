//! Writing Abaqus input files.

use std::collections::HashMap;
use std::io::Write;

use atomesh::mesh::{Regions, Tags};
use atomesh::watch::{Phase, Watch, check};

use super::super::behind::cell_behind;
use super::super::data::MeshData;
use super::super::error::MeshWriteError;
use super::super::metadata;
use super::super::standing::placed;
use super::super::tags::plain_name;
use super::sections::{Elastic, SectionKind, Sections};
use super::{CELLS, face_number};

/// Bytes gathered before they are handed on.
const CHUNK: usize = 1 << 18;

/// Lines between two looks at the watch.
const LINES_PER_STEP: usize = 1 << 18;

/// The most characters of a real number, in Abaqus and in CalculiX.
const WIDTH: usize = 20;

/// The most letters of a line of comment; lines may have 256.
const COMMENT: usize = 200;

/// Writes a mesh as an Abaqus input file.
///
/// # Errors
/// If `out` cannot be written to, or the watch ends the work.
pub fn write_inp<const D: usize>(
    out: &mut impl Write,
    data: &MeshData<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let mesh = data.mesh();
    let total = (data.nodes().len() + mesh.cell_count()).max(1) as f64;
    let mut to = Lines { out, bytes: Vec::new(), watch, count: 0, total };
    to.line(format_args!("*HEADING\natomesh"))?;
    let json = data.metadata();
    let letters: Vec<char> = json.chars().collect();
    for part in letters.chunks(COMMENT) {
        to.line(format_args!("**{} {}", metadata::NAME, part.iter().collect::<String>()))?;
    }
    to.line(format_args!("*NODE"))?;
    for (i, p) in data.nodes().iter().enumerate() {
        let [x, y, z] = placed(p, data.standing()).map(number);
        to.line(format_args!("{}, {x}, {y}, {z}", i + 1))?;
    }
    let each = data.nodes_per_cell();
    // nodes of cells of second order come in Abaqus' order
    let kind = data.sections().map_or(SectionKind::PlaneStress, |sections| sections.kind);
    to.line(format_args!("*ELEMENT, TYPE={}, ELSET={CELLS}", kind.element_type(each)))?;
    for (i, cell) in data.cell_nodes().chunks_exact(each).enumerate() {
        let nodes: Vec<String> = cell.iter().map(|node| (node + 1).to_string()).collect();
        to.line(format_args!("{}, {}", i + 1, nodes.join(", ")))?;
    }
    if let Some(tags) = data.tags() {
        regions(&mut to, tags)?;
        facet_groups(&mut to, data, tags)?;
        point_groups(&mut to, tags)?;
    }
    if let Some(given) = data.sections() {
        sections(&mut to, given, data.tags().and_then(Tags::regions))?;
    }
    to.flush()
}

/// The number in at most [`WIDTH`] characters: of more, programs read the first, and take e-12 for e-1.
fn number(x: f64) -> String {
    let text = format!("{x:?}");
    if text.len() <= WIDTH {
        return text;
    }
    match text.split_once('e') {
        Some((mantissa, exponent)) => {
            let before = mantissa.find('.').unwrap_or(mantissa.len()) + 1;
            let digits = WIDTH - before - 1 - exponent.len();
            format!("{x:.digits$e}")
        }
        None => {
            let digits = WIDTH.saturating_sub(text.find('.').unwrap_or(text.len()) + 1);
            format!("{x:.digits$}")
        }
    }
}

fn regions<W: Write, const D: usize>(
    to: &mut Lines<W>,
    tags: &Tags<D>,
) -> Result<(), MeshWriteError> {
    let Some(regions) = tags.regions() else { return Ok(()) };
    let mut cells: HashMap<i32, Vec<usize>> = HashMap::new();
    for (cell, &id) in regions.of_cells.iter().enumerate() {
        cells.entry(id).or_default().push(cell + 1);
    }
    for id in regions.ids() {
        let name = regions.name(id);
        to.line(format_args!("**region {id} {name}"))?;
        to.line(format_args!("*ELSET, ELSET={}", plain_name(&name)))?;
        to.list(&cells[&id])?;
    }
    Ok(())
}

/// A section for each region, or one for all cells, after the materials that are known: CalculiX wants them first.
fn sections<W: Write>(
    to: &mut Lines<W>,
    sections: &Sections,
    regions: Option<&Regions>,
) -> Result<(), MeshWriteError> {
    let all = || vec![(None, CELLS.to_owned())];
    let parts = regions.map_or_else(all, |regions| {
        let named = |id: i32| (Some(id), plain_name(&regions.name(id)));
        regions.ids().into_iter().map(named).collect()
    });
    for (id, name) in &parts {
        let of_part = |material: &&Elastic| id.is_none_or(|id| id == material.region);
        let Some(material) = sections.materials.iter().rev().find(of_part) else { continue };
        let [modulus, ratio] = [material.youngs_modulus, material.poissons_ratio].map(number);
        to.line(format_args!("*MATERIAL, NAME={name}\n*ELASTIC\n{modulus}, {ratio}"))?;
    }
    for (_, name) in &parts {
        to.line(format_args!("*SOLID SECTION, ELSET={name}, MATERIAL={name}"))?;
        if matches!(sections.kind, SectionKind::PlaneStress | SectionKind::PlaneStrain) {
            to.line(format_args!("1.0"))?; // the thickness
        }
    }
    Ok(())
}

fn facet_groups<W: Write, const D: usize>(
    to: &mut Lines<W>,
    data: &MeshData<D>,
    tags: &Tags<D>,
) -> Result<(), MeshWriteError> {
    let mesh = data.mesh();
    let cells = mesh.cells_of_points();
    for group in tags.facet_groups() {
        let name = plain_name(&group.name);
        let of_facets = group.facets.iter().flat_map(|facet| data.facet_nodes(facet));
        let mut nodes: Vec<usize> = of_facets.map(|node| node as usize + 1).collect();
        nodes.sort_unstable();
        nodes.dedup();
        to.line(format_args!("**group {} {}", group.id, group.name))?;
        to.line(format_args!("*NSET, NSET={name}"))?;
        to.list(&nodes)?;
        let mut faces = vec![Vec::new(); D + 2];
        for facet in &group.facets {
            if let Some(behind) = cell_behind(mesh, facet, mesh.cells_beside(facet, &cells)) {
                faces[face_number(D, behind.opposite)].push(behind.cell + 1);
            }
        }
        let used = || faces.iter().enumerate().filter(|(_, cells)| !cells.is_empty());
        for (number, cells) in used() {
            to.line(format_args!("*ELSET, ELSET={name}_S{number}, INTERNAL"))?;
            to.list(cells)?;
        }
        to.line(format_args!("*SURFACE, TYPE=ELEMENT, NAME={name}"))?;
        for (number, _) in used() {
            to.line(format_args!("{name}_S{number}, S{number}"))?;
        }
    }
    Ok(())
}

fn point_groups<W: Write, const D: usize>(
    to: &mut Lines<W>,
    tags: &Tags<D>,
) -> Result<(), MeshWriteError> {
    for group in tags.point_groups() {
        to.line(format_args!("*NSET, NSET={}", plain_name(&group.name)))?;
        // of cells of second order the corners come first
        let nodes: Vec<usize> = group.points.iter().map(|&point| point as usize + 1).collect();
        to.list(&nodes)?;
    }
    Ok(())
}

/// Lines of text.
struct Lines<'a, W> {
    out: &'a mut W,
    bytes: Vec<u8>,
    watch: &'a mut dyn Watch,
    count: usize,
    /// About how many lines there will be.
    total: f64,
}

impl<W: Write> Lines<'_, W> {
    fn line(&mut self, text: std::fmt::Arguments) -> Result<(), MeshWriteError> {
        self.bytes.write_fmt(text)?;
        self.bytes.push(b'\n');
        self.count += 1;
        if self.count.is_multiple_of(LINES_PER_STEP) {
            check(self.watch, Phase::Write, (self.count as f64 / self.total).min(1.0), None)?;
        }
        if self.bytes.len() >= CHUNK { self.flush() } else { Ok(()) }
    }

    /// Numbers, sixteen a line, as many as the format takes.
    fn list(&mut self, numbers: &[usize]) -> Result<(), MeshWriteError> {
        for some in numbers.chunks(16) {
            let words: Vec<String> = some.iter().map(usize::to_string).collect();
            self.line(format_args!("{}", words.join(", ")))?;
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), MeshWriteError> {
        self.out.write_all(&self.bytes)?;
        self.bytes.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_twenty_characters_at_most_and_lose_no_more_than_rounding() {
        let digits = 1.234_567_890_123_456_7;
        for exponent in -300..=300 {
            for x in [digits, -digits, 9.999_999_999_999_999] {
                let x: f64 = x * 10f64.powi(exponent);
                let text = number(x);
                assert!(text.len() <= WIDTH, "{text}");
                let back: f64 = text.parse().unwrap();
                // a sign, a point and e-300 leave twelve digits
                assert!((back - x).abs() <= 1e-12 * x.abs(), "{text}");
            }
        }
        assert_eq!(number(-1.234_567_890_123_456_7e-10), "-1.2345678901235e-10");
        assert_eq!(number(0.1), "0.1");
    }
}
