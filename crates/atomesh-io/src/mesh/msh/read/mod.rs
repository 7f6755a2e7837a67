//! Reading MSH 4.1 and 2.2, binary (either byte order) and text.
//!
//! Points are named by tags, which need not be 1, 2, 3 ...; they keep the file's order. Sections without
//! points, cells, names or values are passed over.

use std::collections::HashMap;

use super::super::column::Endian;
use super::super::format::{MshEncoding, MshVersion};
use super::super::loaded::AnyMesh;
use super::super::metadata::{KnownAs, Metadata};
use super::super::parts::Parts;
use super::super::read_error::{MeshReadError, excerpt, malformed};

mod elements;
mod fields;
mod numbers;
mod tags;

use numbers::Numbers;
use tags::Tags;

/// Reads the triangles or tetrahedra of an MSH file.
///
/// # Errors
/// [`MeshReadError`] if the bytes are not such a file. No count in the file makes this allocate more
/// than a multiple of the file's size.
pub fn read_msh(bytes: &[u8]) -> Result<AnyMesh, MeshReadError> {
    let mut reader = Reader {
        from: Numbers { bytes, at: 0, encoding: MshEncoding::Text, endian: Endian::Little },
        version: MshVersion::V41,
        wide: true,
        index_of: Tags::default(),
        cell_of: Tags::default(),
        parts: Parts::default(),
        physicals: HashMap::new(),
        cell_tags: [Vec::new(), Vec::new()],
        cell_order: None,
    };
    reader.format()?;
    while let Some(section) = reader.from.section()? {
        match section {
            "PhysicalNames" => reader.physical_names()?,
            "Entities" if reader.version == MshVersion::V41 => reader.entities()?,
            "Nodes" => reader.nodes()?,
            "Elements" => reader.elements()?,
            "NodeData" => reader.field(false)?,
            "ElementData" => reader.field(true)?,
            "Comments" => reader.comments(),
            "CellOrder" => reader.cell_order()?,
            _ => {}
        }
        reader.from.skip_past(&format!("$End{section}"))?;
    }
    reader.finish()?;
    reader.parts.into_mesh()
}

struct Reader<'a> {
    from: Numbers<'a>,
    version: MshVersion,
    /// Whether sizes have 8 bytes, not 4 (binary 4.1).
    wide: bool,
    index_of: Tags,
    /// Which cell of the file a tag names.
    cell_of: Tags,
    parts: Parts,
    /// The physical groups of entities, by dimension and tag (4.1).
    physicals: HashMap<(i32, i32), Vec<i32>>,
    /// The tags of triangles and of tetrahedra.
    cell_tags: [Vec<u64>; 2],
    /// The place of each cell in the mesh, where the file says it.
    cell_order: Option<Vec<u64>>,
}

impl Reader<'_> {
    fn format(&mut self) -> Result<(), MeshReadError> {
        if self.from.section()? != Some("MeshFormat") {
            return Err(malformed(0, "$MeshFormat", excerpt(self.from.bytes, 0)));
        }
        let line = self.from.line()?;
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let unsupported = |what, found: &str, expected| {
            Err(MeshReadError::Unsupported { what, found: found.into(), expected })
        };
        let [version, kind, size] = words[..] else {
            return Err(malformed(self.from.at, "version, type and size before this", line));
        };
        self.version = match version {
            "4.1" => MshVersion::V41,
            "2.2" | "2.1" | "2" => MshVersion::V22,
            _ => return unsupported("MSH version", version, "4.1 or 2.2"),
        };
        self.wide = match size {
            "8" => true,
            "4" => false,
            _ => return unsupported("size of integers", size, "4 or 8"),
        };
        match kind {
            "0" => {}
            "1" => {
                self.from.encoding = MshEncoding::Binary;
                self.from.endian = match self.from.int()? {
                    1 => Endian::Little,
                    0x0100_0000 => Endian::Big,
                    other => return unsupported("byte order mark", &other.to_string(), "1"),
                };
            }
            _ => return unsupported("MSH file type", kind, "0 (text) or 1 (binary)"),
        }
        self.from.skip_past("$EndMeshFormat")
    }

    fn comments(&mut self) {
        let rest = self.from.rest();
        let end = rest.iter().position(|&b| b == b'$').unwrap_or(rest.len());
        self.parts.metadata = Metadata::decode(&rest[..end]);
    }

    fn size(&mut self) -> Result<u64, MeshReadError> {
        match (self.from.encoding, self.wide) {
            (MshEncoding::Binary, false) => Ok(self.from.number::<u32>("a 32-bit size")?.into()),
            _ => self.from.number("a 64-bit size"),
        }
    }

    fn count(&mut self, what: &str) -> Result<usize, MeshReadError> {
        let count = self.size()?;
        self.from.bounded(count, what)
    }

    /// A count that stands on a line of its own, also in binary files.
    fn text_count(&mut self, what: &str) -> Result<usize, MeshReadError> {
        let count = self.from.word(what)?;
        self.from.line()?;
        self.from.bounded(count, what)
    }

    fn point(&mut self) -> Result<(), MeshReadError> {
        let point = [self.from.real()?, self.from.real()?, self.from.real()?];
        self.parts.points.push(point);
        Ok(())
    }

    fn nodes(&mut self) -> Result<(), MeshReadError> {
        match self.version {
            MshVersion::V41 => self.nodes_41()?,
            MshVersion::V22 => {
                for _ in 0..self.text_count("points")? {
                    let tag = self.from.int()?;
                    self.index_of.push(self.tag(tag)?);
                    self.point()?;
                }
            }
        }
        if u32::try_from(self.parts.points.len()).is_err() {
            let found = self.parts.points.len().to_string();
            return Err(malformed(self.from.at, "fewer than 2^32 points", found));
        }
        self.index_of.close();
        Ok(())
    }

    fn tag(&self, tag: i32) -> Result<u64, MeshReadError> {
        u64::try_from(tag)
            .map_err(|_| malformed(self.from.at, "a tag of 0 or more", tag.to_string()))
    }

    fn nodes_41(&mut self) -> Result<(), MeshReadError> {
        let blocks = self.count("blocks of points")?;
        for _ in 0..3 {
            self.size()?; // points, least and greatest tag
        }
        for _ in 0..blocks {
            let dimension = self.from.int()?;
            self.from.int()?;
            let parametric = self.from.int()? != 0;
            for _ in 0..self.count("points")? {
                let tag = self.size()?;
                self.index_of.push(tag);
            }
            while self.parts.points.len() < self.index_of.tags.len() {
                self.point()?;
                for _ in 0..if parametric { dimension.clamp(0, 3) } else { 0 } {
                    self.from.real()?;
                }
            }
        }
        Ok(())
    }

    fn physical_names(&mut self) -> Result<(), MeshReadError> {
        for _ in 0..self.text_count("names")? {
            let line = self.from.line()?;
            let mut words = line.splitn(3, ' ');
            let mut number = || words.next().and_then(|word| word.parse::<i32>().ok());
            let (Some(dimension @ 0..=3), Some(id)) = (number(), number()) else {
                return Err(malformed(
                    self.from.at,
                    "dimension, number and name before this",
                    line,
                ));
            };
            let name = words.next().unwrap_or_default().trim_matches('"').to_owned();
            self.parts.tags.names.push((dimension as usize, id, name));
        }
        Ok(())
    }

    /// The physical groups of each entity.
    fn entities(&mut self) -> Result<(), MeshReadError> {
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = self.count("entities")?;
        }
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                let tag = self.from.int()?;
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    self.from.real()?;
                }
                let mut physicals = Vec::new();
                for _ in 0..self.count("physical groups")? {
                    physicals.push(self.from.int()?.saturating_abs());
                }
                for _ in 0..if dimension == 0 { 0 } else { self.count("bounding entities")? } {
                    self.from.int()?;
                }
                self.physicals.insert((dimension as i32, tag), physicals);
            }
        }
        Ok(())
    }

    /// The places of the file's cells in the mesh, which atomesh writes where they are not in its order.
    fn cell_order(&mut self) -> Result<(), MeshReadError> {
        let count = self.text_count("cells")?;
        let from = self.from.at;
        let mut places = Vec::with_capacity(count);
        for _ in 0..count {
            let word: u64 = self.from.word("the place of a cell")?;
            places.push(word);
        }
        let mut sorted = places.clone();
        sorted.sort_unstable();
        if sorted.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err(malformed(from, "a place of its own for each cell", "one twice"));
        }
        self.cell_order = Some(places);
        Ok(())
    }

    /// Gives regions and groups the numbers that they had, and puts cells as they were, if atomesh wrote them, once
    /// all sections are read.
    fn finish(&mut self) -> Result<(), MeshReadError> {
        self.renumber();
        if !self.parts.metadata.is_ours() {
            return Ok(());
        }
        let is_flat = self.parts.tetrahedra.is_empty();
        let [triangles, tetrahedra] = &mut self.cell_tags;
        let cells = if is_flat { triangles } else { tetrahedra };
        if let Some(places) = self.cell_order.take() {
            if places.len() != cells.len() {
                let (expected, found) = (cells.len(), places.len());
                let expected = format!("{expected} places in $CellOrder, one a cell");
                return Err(malformed(self.from.at, expected, found.to_string()));
            }
            *cells = places;
        }
        let order = order_of(cells);
        let parts = &mut self.parts;
        if is_flat {
            sort_cells::<3>(&order, &mut parts.triangles, &mut parts.tags.triangle_regions);
            parts.sort_fields(3, &order);
        } else {
            sort_cells::<4>(&order, &mut parts.tetrahedra, &mut parts.tags.tetrahedron_regions);
            parts.sort_fields(4, &order);
        }
        Ok(())
    }

    /// Gives regions and groups the numbers that the comment says.
    fn renumber(&mut self) {
        let parts = &mut self.parts;
        let KnownAs { regions, groups } = parts.metadata.known_as();
        let region: HashMap<i32, i32> = regions.iter().map(|&(id, known)| (known, id)).collect();
        let group: HashMap<i32, i32> =
            groups.iter().map(|&(id, known)| (known, id as i32)).collect();
        let give = |numbers: &HashMap<i32, i32>, id: &mut i32| {
            *id = numbers.get(id).copied().unwrap_or(*id);
        };
        let is_flat = parts.tetrahedra.is_empty();
        let tags = &mut parts.tags;
        let of_cells = tags.triangle_regions.iter_mut().chain(&mut tags.tetrahedron_regions);
        of_cells.for_each(|id| give(&region, id));
        tags.edges.iter_mut().for_each(|(_, id)| give(&group, id));
        tags.triangles.iter_mut().for_each(|(_, id)| give(&group, id));
        // names of facets have a lower dimension, those of cells the greatest
        let cells = if is_flat { 2 } else { 3 };
        for (dimension, id, _) in tags.names.iter_mut().filter(|(dimension, ..)| *dimension > 0) {
            give(if *dimension == cells { &region } else { &group }, id);
        }
    }
}

/// The cells in the order of their tags; none if they are in order.
fn order_of(tags: &[u64]) -> Vec<usize> {
    if tags.is_sorted() {
        return Vec::new();
    }
    let mut order: Vec<usize> = (0..tags.len()).collect();
    order.sort_by_key(|&cell| tags[cell]);
    order
}

/// Puts cells of `N` corners, with their regions, in an order, if there is one.
fn sort_cells<const N: usize>(order: &[usize], corners: &mut Vec<u32>, regions: &mut Vec<i32>) {
    if order.is_empty() {
        return;
    }
    *corners = order.iter().flat_map(|&cell| &corners[cell * N..(cell + 1) * N]).copied().collect();
    *regions = order.iter().map(|&cell| regions[cell]).collect();
}
