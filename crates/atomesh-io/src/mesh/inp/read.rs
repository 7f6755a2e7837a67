//! Reading Abaqus input files.

use std::collections::HashMap;

use super::super::loaded::AnyMesh;
use super::super::metadata::{self, Metadata};
use super::super::parts::Parts;
use super::super::read_error::{MeshReadError, malformed};
use super::super::tags::plain_name;
use super::{CELLS, face_number};

/// Reads the triangles (CPS3, CPE3, S3 …) or tetrahedra (C3D4), or the corners of those of second order (CPS6,
/// C3D10 …), of an Abaqus input file with numbers as text and without parts or generated sets; element sets are regions and surfaces are groups of facets. Of an
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
    /// Elements: how many nodes each has, and the place of the set that they are in.
    Elements(usize, Option<usize>),
    /// The named set.
    Set(String),
    /// The last set of nodes.
    NodeSet,
    /// The named surface.
    Surface(String),
}

/// A line of a surface: the faces of a number of all elements in a set.
struct SurfaceLine {
    surface: String,
    set: String,
    face: usize,
}

/// The numbers of groups and regions by their names, as comments have them.
#[derive(Default)]
struct Names {
    /// Dimension counted down from that of cells, number and name.
    known: Vec<(usize, i32, String)>,
    /// The greatest number given to a name that no comment has.
    last: i32,
}

impl Names {
    /// To be called when all comments are known.
    fn close(&mut self) {
        self.last = self.known.iter().map(|(_, id, _)| *id).max().unwrap_or(0).max(0);
    }

    /// The number of a group (1 below the cells) or region (0 below): that of a comment, or the next one.
    fn number(&mut self, below: usize, name: &str) -> i32 {
        let same = |(b, _, n): &&(usize, i32, String)| {
            *b == below && plain_name(n).eq_ignore_ascii_case(name)
        };
        if let Some((_, id, _)) = self.known.iter().find(same) {
            return *id;
        }
        self.last += 1;
        self.known.push((below, self.last, name.into()));
        self.last
    }
}

/// How many nodes a triangle or tetrahedron of that type has, whatever it stands for: stress, heat, sound, membrane, rigid
/// ...; 0 for other elements. Letters after the count say how it is solved (C3D10MH, S3RS).
fn node_count(kind: &str) -> usize {
    let shape = kind.trim_end_matches(|c: char| "himprst".contains(c));
    match shape {
        "c3d4" | "dc3d4" | "ac3d4" => 4,
        "c3d10" | "dc3d10" | "ac3d10" => 10,
        "cps3" | "cpe3" | "cpeg3" | "cax3" | "cgax3" | "dc2d3" | "dcax3" | "ac2d3" | "acax3"
        | "s3" | "ds3" | "stri3" | "m3d3" | "r3d3" | "sfm3d3" => 3,
        "cps6" | "cpe6" | "cpeg6" | "cax6" | "cgax6" | "dc2d6" | "dcax6" | "ac2d6" | "acax6"
        | "s6" | "ds6" | "stri65" | "m3d6" | "sfm3d6" => 6,
        _ => 0,
    }
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
    node_sets: Vec<(String, Vec<u64>)>,
    surfaces: Vec<SurfaceLine>,
    names: Names,
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
            self.names.known.push((below, id, name.into()));
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
                let count = node_count(&option("TYPE"));
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
            "NSET" => {
                self.node_sets.push((option("NSET"), Vec::new()));
                Section::NodeSet
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
                self.element(&numbers, count, set).map_err(|expected| wrong(&expected))?;
            }
            Section::Set(_) => {
                // sets of sets are passed over
                let numbers = words().filter_map(|word| word.parse::<u64>().ok());
                if let Some((_, set)) = self.sets.last_mut() {
                    set.extend(numbers);
                }
            }
            Section::NodeSet => {
                let numbers = words().filter_map(|word| word.parse::<u64>().ok());
                if let Some((_, set)) = self.node_sets.last_mut() {
                    set.extend(numbers);
                }
            }
            Section::Surface(name) => {
                let mut words = words();
                let set = words.next().unwrap_or_default().to_ascii_lowercase();
                let face = words.next().unwrap_or_default().to_ascii_uppercase();
                let face = face.strip_prefix('S').and_then(|face| face.parse().ok()).unwrap_or(0);
                self.surfaces.push(SurfaceLine { surface: name.clone(), set, face });
            }
        }
        Ok(())
    }

    /// Keeps the corners of an element of `nodes` nodes, which come first, and puts it into the set of a place; or says
    /// what is expected.
    fn element(&mut self, numbers: &[u64], nodes: usize, set: Option<usize>) -> Result<(), String> {
        let [number, corners @ ..] = numbers else { return Err("an element".into()) };
        if corners.len() != nodes {
            return Err(format!("an element of {nodes} nodes"));
        }
        let count = if matches!(nodes, 3 | 6) { 3 } else { 4 };
        self.parts.has_quadratic |= nodes > count;
        let kept = match count {
            3 => &mut self.parts.triangles,
            _ => &mut self.parts.tetrahedra,
        };
        self.elements.insert(*number, (kept.len(), count));
        if let Some(set) = set {
            self.sets[set].1.push(*number);
        }
        for corner in &corners[..count] {
            let index = self.index_of.get(corner).copied();
            kept.push(index.ok_or("nodes that stand before")?);
        }
        Ok(())
    }

    fn finish(mut self) -> Result<AnyMesh, MeshReadError> {
        self.parts.metadata = Metadata::decode(self.json.as_bytes());
        self.names.close();
        self.add_points();
        self.add_surfaces();
        self.add_regions();
        let cells = if self.parts.tetrahedra.is_empty() { 2 } else { 3 };
        let names = self.names.known.into_iter();
        self.parts.tags.names = names.map(|(below, id, name)| (cells - below, id, name)).collect();
        self.parts.into_mesh()
    }

    /// Takes the sets of nodes that atomesh has written for groups of points; those of facets are known by their faces.
    fn add_points(&mut self) {
        for (id, name) in self.parts.metadata.point_groups() {
            let own = |(set, _): &&(String, Vec<u64>)| plain_name(&name).eq_ignore_ascii_case(set);
            let Some((_, nodes)) = self.node_sets.iter().find(own) else { continue };
            let points = nodes.iter().filter_map(|node| self.index_of.get(node));
            self.parts.tags.points.extend(points.map(|&point| (point, id as i32)));
        }
    }

    /// Puts the faces of surfaces into groups of their names.
    fn add_surfaces(&mut self) {
        for SurfaceLine { surface, set, face } in &self.surfaces {
            let id = self.names.number(1, surface);
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
    }

    /// Takes the sets that are not those of surfaces as regions.
    fn add_regions(&mut self) {
        let parts = &mut self.parts;
        parts.tags.triangle_regions = vec![0; parts.triangles.len() / 3];
        parts.tags.tetrahedron_regions = vec![0; parts.tetrahedra.len() / 4];
        for (name, elements) in &self.sets {
            if self.surfaces.iter().any(|line| line.set == *name) {
                continue;
            }
            let id = self.names.number(0, name);
            parts.tags.has_regions = true;
            for element in elements {
                match self.elements.get(element) {
                    Some(&(start, 3)) => parts.tags.triangle_regions[start / 3] = id,
                    Some(&(start, _)) => parts.tags.tetrahedron_regions[start / 4] = id,
                    None => {}
                }
            }
        }
    }
}
