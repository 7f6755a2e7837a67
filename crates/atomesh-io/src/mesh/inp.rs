//! Abaqus input files, which Abaqus, CalculiX and others read: text.
//!
//! Cells are CPS3 or C3D4 elements, numbered from 1 as in the mesh. Each region is a set of elements. Each
//! group of facets is a surface of element faces, and a set of nodes of the same name; the elements are those
//! behind the facets, as their normals show. Names lose their dots. Comments carry the numbers of groups and
//! regions, the frame and the provenance; fields are left out.

use std::collections::HashMap;
use std::io::Write;

use atomesh::mesh::{Mesh, Tags};
use atomesh::watch::{Phase, Watch, check};

use super::MeshWriteError;
use super::data::{AnyMesh, MeshData};
use super::metadata::{self, Metadata};
use super::read::{MeshReadError, Parts, malformed};
use super::tags::plain_name;

/// Bytes gathered before they are handed on.
const CHUNK: usize = 1 << 18;

/// Lines between two looks at the watch.
const LINES_PER_STEP: usize = 1 << 18;

/// The most letters of a line of comment; lines may have 256.
const COMMENT: usize = 200;

/// The set of all elements.
const CELLS: &str = "cells";

/// Abaqus' name for cells of so many points: triangles or tetrahedra, or those of second order, whose nodes it
/// has in our order.
fn element_type(node_count: usize) -> &'static str {
    match node_count {
        3 => "CPS3",
        4 => "C3D4",
        6 => "CPS6",
        _ => "C3D10",
    }
}

/// The number of an element's face by the corner, from 0, that is not on it.
fn face_number(dimension: usize, opposite: usize) -> usize {
    if dimension == 2 { [2, 3, 1][opposite] } else { [3, 4, 2, 1][opposite] }
}

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
    let json = metadata::encode(data);
    let letters: Vec<char> = json.chars().collect();
    for part in letters.chunks(COMMENT) {
        to.line(format_args!("**{} {}", metadata::NAME, part.iter().collect::<String>()))?;
    }
    to.line(format_args!("*NODE"))?;
    for (i, p) in data.nodes().iter().enumerate() {
        let z = p.get(2).copied().unwrap_or(0.0);
        to.line(format_args!("{}, {:?}, {:?}, {z:?}", i + 1, p[0], p[1]))?;
    }
    let each = data.nodes_per_cell();
    to.line(format_args!("*ELEMENT, TYPE={}, ELSET={CELLS}", element_type(each)))?;
    for (i, cell) in data.cell_nodes().chunks_exact(each).enumerate() {
        let nodes: Vec<String> = cell.iter().map(|node| (node + 1).to_string()).collect();
        to.line(format_args!("{}, {}", i + 1, nodes.join(", ")))?;
    }
    if let Some(tags) = data.tags() {
        regions(&mut to, tags)?;
        facet_groups(&mut to, mesh, tags)?;
    }
    to.flush()
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

fn facet_groups<W: Write, const D: usize>(
    to: &mut Lines<W>,
    mesh: &Mesh<D>,
    tags: &Tags<D>,
) -> Result<(), MeshWriteError> {
    let cells = mesh.cells_of_points();
    for group in tags.facet_groups() {
        let name = plain_name(&group.name);
        let mut nodes: Vec<usize> =
            group.facets.as_flattened().iter().map(|&corner| corner as usize + 1).collect();
        nodes.sort_unstable();
        nodes.dedup();
        to.line(format_args!("**group {} {}", group.id, group.name))?;
        to.line(format_args!("*NSET, NSET={name}"))?;
        to.list(&nodes)?;
        let mut faces = vec![Vec::new(); D + 2];
        for facet in &group.facets {
            let beside = || mesh.cells_beside(facet, &cells);
            // the cell whose own facet there is turned alike, or else the one that there is
            let own = |cell: u32| {
                let corners = &mesh.corners()[cell as usize * (D + 1)..][..D + 1];
                let opposite = corners.iter().position(|c| !facet.contains(c)).unwrap_or(0);
                (cell, opposite, is_rotated(&mesh.facet_of(cell as usize, opposite), facet))
            };
            let behind = beside().map(own).find(|(_, _, alike)| *alike);
            if let Some((cell, opposite, _)) = behind.or_else(|| beside().map(own).next()) {
                faces[face_number(D, opposite)].push(cell as usize + 1);
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

/// Whether the corners follow one another in the same order around.
fn is_rotated<const D: usize>(a: &[u32; D], b: &[u32; D]) -> bool {
    let shift = b.iter().position(|corner| *corner == a[0]).unwrap_or(0);
    // an edge has its two ends in one order alone
    if D == 2 { a == b } else { (0..D).all(|k| a[k] == b[(k + shift) % D]) }
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

/// Reads the triangles (CPS3, CPE3, S3 …) or tetrahedra (C3D4) of an Abaqus input file with numbers as text
/// and without parts or generated sets; element sets are regions and surfaces are groups of facets. Of an
/// element in several sets the last counts. Other keywords are passed over.
///
/// # Errors
/// [`MeshReadError`] if the bytes are not such a file.
pub fn read_inp(bytes: &[u8]) -> Result<AnyMesh, MeshReadError> {
    let mut reader = Reader::default();
    let mut at = 0;
    for line in bytes.split(|&b| b == b'\n') {
        let text = std::str::from_utf8(line)
            .map_err(|_| malformed(at, "text", line.escape_ascii().to_string()))?;
        reader.line(text.trim_end_matches('\r'), at)?;
        at += line.len() + 1;
    }
    reader.finish()
}

/// What lines belong to.
#[derive(Debug, Default, PartialEq)]
enum Section {
    #[default]
    Other,
    Nodes,
    /// Elements of so many corners, and the place of the set that they are in.
    Elements(usize, Option<usize>),
    /// The named set.
    Set(String),
    /// The named surface.
    Surface(String),
}

#[derive(Default)]
struct Reader {
    section: Section,
    parts: Parts,
    json: String,
    index_of: HashMap<u64, u32>,
    /// Element number to the place of its corners among those of its kind, and their count.
    elements: HashMap<u64, (usize, usize)>,
    sets: Vec<(String, Vec<u64>)>,
    /// Name, set and face of each line of a surface.
    surfaces: Vec<(String, String, usize)>,
    /// Dimension counted down from that of cells, number and name, from comments.
    names: Vec<(usize, i32, String)>,
}

impl Reader {
    fn line(&mut self, text: &str, at: usize) -> Result<(), MeshReadError> {
        if let Some(comment) = text.strip_prefix("**") {
            self.comment(comment); // a part of a text may end in blanks
            return Ok(());
        }
        match text.trim().strip_prefix('*') {
            Some(keyword) => self.section = self.keyword(keyword),
            None if text.trim().is_empty() => {}
            None => self.data(text.trim(), at)?,
        }
        Ok(())
    }

    fn comment(&mut self, text: &str) {
        let (word, rest) = text.split_once(' ').unwrap_or((text, ""));
        let below = match word {
            metadata::NAME => return self.json.push_str(rest),
            "region" => 0,
            "group" => 1,
            _ => return,
        };
        if let Some((id, name)) = rest.split_once(' ')
            && let Ok(id) = id.parse()
        {
            self.names.push((below, id, name.into()));
        }
    }

    fn keyword(&mut self, text: &str) -> Section {
        let mut words = text.split(',').map(str::trim);
        let keyword = words.next().unwrap_or_default().to_ascii_uppercase();
        let options: Vec<(String, &str)> = words
            .filter_map(|word| word.split_once('='))
            .map(|(name, value)| (name.trim().to_ascii_uppercase(), value.trim()))
            .collect();
        let option = |name: &str| {
            let found = options.iter().find(|(option, _)| option == name);
            found.map_or_else(String::new, |(_, value)| value.to_ascii_lowercase())
        };
        match keyword.as_str() {
            "NODE" => Section::Nodes,
            "ELEMENT" => {
                let count = match option("TYPE").as_str() {
                    "c3d4" => 4,
                    "cps3" | "cpe3" | "cax3" | "s3" | "stri3" => 3,
                    _ => 0,
                };
                let name = option("ELSET");
                let named = !name.is_empty() && name != CELLS;
                let set = named.then(|| {
                    self.sets.push((name, Vec::new()));
                    self.sets.len() - 1
                });
                Section::Elements(count, set)
            }
            "ELSET" => {
                let name = option("ELSET");
                self.sets.push((name.clone(), Vec::new()));
                Section::Set(name)
            }
            "SURFACE" => Section::Surface(option("NAME")),
            _ => Section::Other,
        }
    }

    fn data(&mut self, text: &str, at: usize) -> Result<(), MeshReadError> {
        let words = || text.split(',').map(str::trim).filter(|word| !word.is_empty());
        let wrong = |expected: &str| malformed(at, expected, text.to_owned());
        let whole =
            |word: &str| word.parse::<u64>().map_err(|_| wrong("a number of a node or element"));
        match &self.section {
            Section::Other => {}
            Section::Nodes => {
                let mut numbers = words();
                let number = whole(numbers.next().unwrap_or_default())?;
                let mut point = [0.0; 3];
                for (slot, word) in point.iter_mut().zip(numbers) {
                    *slot = word.parse().map_err(|_| wrong("coordinates"))?;
                }
                let index = u32::try_from(self.parts.points.len());
                let index = index.map_err(|_| wrong("fewer than 2^32 nodes"))?;
                self.index_of.insert(number, index);
                self.parts.points.push(point);
            }
            Section::Elements(0, _) => self.parts.skipped_cells += 1,
            &Section::Elements(count, set) => {
                let numbers: Vec<u64> = words().map(whole).collect::<Result<_, _>>()?;
                let [number, corners @ ..] = &numbers[..] else { return Err(wrong("an element")) };
                if corners.len() != count {
                    return Err(wrong(&format!("an element of {count} nodes")));
                }
                let kept = match count {
                    3 => &mut self.parts.triangles,
                    _ => &mut self.parts.tetrahedra,
                };
                self.elements.insert(*number, (kept.len(), count));
                if let Some(set) = set {
                    self.sets[set].1.push(*number);
                }
                for corner in corners {
                    let index = self.index_of.get(corner).copied();
                    kept.push(index.ok_or_else(|| wrong("nodes that stand before"))?);
                }
            }
            Section::Set(_) => {
                // sets of sets are passed over
                let numbers = words().filter_map(|word| word.parse::<u64>().ok());
                if let Some((_, set)) = self.sets.last_mut() {
                    set.extend(numbers);
                }
            }
            Section::Surface(name) => {
                let mut words = words();
                let set = words.next().unwrap_or_default().to_ascii_lowercase();
                let face = words.next().unwrap_or_default().to_ascii_uppercase();
                let face = face.strip_prefix('S').and_then(|face| face.parse().ok()).unwrap_or(0);
                self.surfaces.push((name.clone(), set, face));
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Result<AnyMesh, MeshReadError> {
        self.parts.metadata = Metadata::decode(self.json.as_bytes());
        let cells = if self.parts.tetrahedra.is_empty() { 2 } else { 3 };
        // the next free number of groups (below 1) and regions that have none
        let mut free = self.names.iter().map(|(_, id, _)| *id).max().unwrap_or(0).max(0);
        let mut number = |names: &mut Vec<(usize, i32, String)>, below: usize, name: &str| {
            let same = |(b, _, n): &&(usize, i32, String)| {
                *b == below && plain_name(n).eq_ignore_ascii_case(name)
            };
            if let Some((_, id, _)) = names.iter().find(same) {
                return *id;
            }
            free += 1;
            names.push((below, free, name.into()));
            free
        };
        for (name, set, face) in &self.surfaces {
            let id = number(&mut self.names, 1, name);
            let found = self.sets.iter().find(|(own, _)| own == set);
            for element in found.map_or(&[][..], |(_, elements)| elements) {
                let Some(&(start, count)) = self.elements.get(element) else { continue };
                let Some(off) = (0..count).find(|&off| face_number(count - 1, off) == *face) else {
                    continue;
                };
                let parts = &mut self.parts;
                if count == 3 {
                    let cell = &parts.triangles[start..start + 3];
                    let facet = [cell[(off + 1) % 3], cell[(off + 2) % 3]];
                    parts.tags.edges.push((facet, id));
                } else {
                    let cell = &parts.tetrahedra[start..start + 4];
                    let mut facet = std::array::from_fn(|k| cell[k + usize::from(k >= off)]);
                    if off % 2 == 1 {
                        facet.swap(1, 2);
                    }
                    parts.tags.triangles.push((facet, id));
                }
            }
        }
        let parts = &mut self.parts;
        parts.tags.triangle_regions = vec![0; parts.triangles.len() / 3];
        parts.tags.tetrahedron_regions = vec![0; parts.tetrahedra.len() / 4];
        for (name, elements) in &self.sets {
            if self.surfaces.iter().any(|(_, set, _)| set == name) {
                continue;
            }
            let id = number(&mut self.names, 0, name);
            parts.tags.has_regions = true;
            for element in elements {
                match self.elements.get(element) {
                    Some(&(start, 3)) => parts.tags.triangle_regions[start / 3] = id,
                    Some(&(start, _)) => parts.tags.tetrahedron_regions[start / 4] = id,
                    None => {}
                }
            }
        }
        let names = self.names.into_iter();
        parts.tags.names = names.map(|(below, id, name)| (cells - below, id, name)).collect();
        self.parts.into_mesh()
    }
}
