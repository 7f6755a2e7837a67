//! Reading MSH 4.1 and 2.2, binary (either byte order) and text.
//!
//! Points are named by tags, which need not be 1, 2, 3 ...; they keep the file's order. Sections that
//! hold no points, cells or values at points or in cells are passed over.

use std::collections::HashMap;
use std::str::FromStr;

use super::super::column::{Endian, Number};
use super::super::data::{AnyMesh, OwnedField};
use super::super::metadata::Metadata;
use super::super::read::{MeshReadError, Parts, excerpt, malformed};
use super::{MshEncoding, MshVersion};

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
            _ => {}
        }
        reader.from.skip_past(&format!("$End{section}"))?;
    }
    reader.finish();
    reader.parts.into_mesh()
}

/// Numbers of text or binary sections, one after another.
struct Numbers<'a> {
    bytes: &'a [u8],
    at: usize,
    encoding: MshEncoding,
    endian: Endian,
}

impl<'a> Numbers<'a> {
    fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    fn expected(&self, what: impl Into<String>) -> MeshReadError {
        malformed(self.at, what, excerpt(self.bytes, self.at))
    }

    fn skip_blanks(&mut self) {
        self.at += self.rest().iter().take_while(|b| b.is_ascii_whitespace()).count();
    }

    /// The name of the next section; `None` at the end.
    fn section(&mut self) -> Result<Option<&'a str>, MeshReadError> {
        self.skip_blanks();
        if self.rest().is_empty() {
            return Ok(None);
        }
        match self.line()?.strip_prefix('$') {
            Some(name) if !name.is_empty() => Ok(Some(name)),
            _ => Err(self.expected("a section, '$' and a name, before this")),
        }
    }

    /// The rest of the line, without blanks around it.
    fn line(&mut self) -> Result<&'a str, MeshReadError> {
        let rest = self.rest();
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        let text =
            std::str::from_utf8(&rest[..length]).map_err(|_| self.expected("a line of text"))?;
        self.at += (length + 1).min(rest.len());
        Ok(text.trim())
    }

    fn skip_past(&mut self, mark: &str) -> Result<(), MeshReadError> {
        let found = self.rest().windows(mark.len()).position(|w| w == mark.as_bytes());
        let found = found.ok_or_else(|| self.expected(mark))?;
        self.at += found + mark.len();
        Ok(())
    }

    /// The next word of text, as a number.
    fn word<T: FromStr>(&mut self, what: &str) -> Result<T, MeshReadError> {
        self.skip_blanks();
        let rest = self.rest();
        let length = rest.iter().take_while(|b| !b.is_ascii_whitespace()).count();
        let word = std::str::from_utf8(&rest[..length]).ok().and_then(|w| w.parse().ok());
        let value = word.ok_or_else(|| self.expected(what))?;
        self.at += length;
        Ok(value)
    }

    fn number<T: Number + FromStr>(&mut self, what: &str) -> Result<T, MeshReadError> {
        if self.encoding == MshEncoding::Text {
            return self.word(what);
        }
        let bytes = self.rest().get(..T::SIZE).ok_or_else(|| self.expected(what))?;
        self.at += T::SIZE;
        Ok(T::take(bytes, self.endian))
    }

    fn int(&mut self) -> Result<i32, MeshReadError> {
        self.number("a 32-bit integer")
    }

    fn real(&mut self) -> Result<f64, MeshReadError> {
        self.number("a real number")
    }

    /// A number of things that take at least two bytes each (text) or four (binary).
    fn bounded(&self, count: u64, what: &str) -> Result<usize, MeshReadError> {
        match usize::try_from(count) {
            Ok(n) if n <= self.rest().len() / 2 + 1 => Ok(n),
            _ => Err(malformed(self.at, format!("{what} that fit the file"), count.to_string())),
        }
    }
}

/// Which point or cell a tag names.
#[derive(Default)]
struct Tags {
    /// The tag of each; in most files tag t names point t − 1.
    tags: Vec<u64>,
    map: HashMap<u64, u32>,
}

impl Tags {
    fn push(&mut self, tag: u64) {
        self.tags.push(tag);
    }

    /// To be called when all tags are known.
    fn close(&mut self) {
        let plain = self.tags.iter().enumerate().all(|(i, &tag)| tag == i as u64 + 1);
        if !plain {
            self.map = self.tags.iter().enumerate().map(|(i, &tag)| (tag, i as u32)).collect();
        }
    }

    fn index(&self, tag: u64) -> Option<u32> {
        if self.map.is_empty() {
            let index = tag.checked_sub(1)?;
            return (index < self.tags.len() as u64).then_some(index as u32);
        }
        self.map.get(&tag).copied()
    }
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

    /// Puts regions and cells as they were, if atomesh wrote them, once all sections are read.
    fn finish(&mut self) {
        let parts = &mut self.parts;
        let known_as = parts.metadata.regions();
        for (region, physical) in known_as {
            let regions = parts.tags.triangle_regions.iter_mut();
            let regions = regions.chain(&mut parts.tags.tetrahedron_regions);
            regions.filter(|id| **id == physical).for_each(|id| *id = region);
            // names of facets have a lower dimension, those of cells the greatest
            let dimension = if parts.tetrahedra.is_empty() { 2 } else { 3 };
            let named = |(d, id, _): &&mut (usize, i32, String)| (*d, *id) == (dimension, physical);
            if let Some(name) = parts.tags.names.iter_mut().find(named) {
                name.1 = region;
            }
        }
        if parts.metadata.is_ours() {
            let [triangles, tetrahedra] = &self.cell_tags;
            if parts.tetrahedra.is_empty() {
                let order = order_of(triangles);
                sort_cells::<3>(&order, &mut parts.triangles, &mut parts.tags.triangle_regions);
                parts.sort_fields(3, &order);
            }
            let order = order_of(tetrahedra);
            sort_cells::<4>(&order, &mut parts.tetrahedra, &mut parts.tags.tetrahedron_regions);
            parts.sort_fields(4, &order);
        }
    }

    fn elements(&mut self) -> Result<(), MeshReadError> {
        match self.version {
            MshVersion::V41 => self.elements_41()?,
            MshVersion::V22 => self.elements_22()?,
        }
        self.cell_of.close();
        Ok(())
    }

    fn elements_41(&mut self) -> Result<(), MeshReadError> {
        let blocks = self.count("blocks of cells")?;
        for _ in 0..3 {
            self.size()?; // cells, least and greatest tag
        }
        for _ in 0..blocks {
            let entity = (self.from.int()?, self.from.int()?);
            let physicals = self.physicals.get(&entity).cloned().unwrap_or_default();
            let kind = self.from.int()?;
            let corners = self.corner_count(kind)?;
            for _ in 0..self.count("cells")? {
                let tag = self.size()?;
                self.cell_of.push(tag);
                self.cell((kind, tag), corners, &physicals, Self::size)?;
            }
        }
        Ok(())
    }

    fn elements_22(&mut self) -> Result<(), MeshReadError> {
        let count = self.text_count("cells")?;
        let mut done = 0;
        while done < count {
            let text = self.from.encoding == MshEncoding::Text;
            let mut tag = if text { self.from.int()? } else { 0 };
            let kind = self.from.int()?;
            let corners = self.corner_count(kind)?;
            let following = if text { 1 } else { self.from.int()? };
            let following = self.from.bounded(following.max(0) as u64, "cells")?;
            let tags = self.from.int()?;
            if following == 0 {
                return Err(self.from.expected("cells in this block"));
            }
            for _ in 0..following {
                if !text {
                    tag = self.from.int()?;
                }
                let mut physical = [0];
                for k in 0..tags {
                    let value = self.from.int()?;
                    if k == 0 {
                        physical = [value.saturating_abs()];
                    }
                }
                let physicals = &physical[..usize::from(physical[0] != 0)];
                let tag = self.tag(tag)?;
                self.cell_of.push(tag);
                self.cell((kind, tag), corners, physicals, |reader| {
                    let tag = reader.from.int()?;
                    reader.tag(tag)
                })?;
            }
            done += following;
        }
        Ok(())
    }

    fn corner_count(&self, kind: i32) -> Result<usize, MeshReadError> {
        corner_count(kind).ok_or_else(|| MeshReadError::Unsupported {
            what: "cell type",
            found: kind.to_string(),
            expected: "one of Gmsh's numbers 1 to 31",
        })
    }

    /// Reads the corners of a cell of a type and tag and keeps it if it is a triangle, a tetrahedron, or a
    /// line of a physical group.
    fn cell(
        &mut self,
        (kind, tag): (i32, u64),
        corners: usize,
        physicals: &[i32],
        read: impl Fn(&mut Self) -> Result<u64, MeshReadError>,
    ) -> Result<(), MeshReadError> {
        let mut cell = [0; 4];
        // of cells of second order the corners, which come first
        let is_quadratic = matches!(kind, 8 | 9 | 11);
        let kind = match kind {
            8 => 1,
            9 => 2,
            11 => 4,
            _ => kind,
        };
        self.parts.has_quadratic |= is_quadratic;
        for k in 0..corners {
            let tag = read(self)?;
            if matches!(kind, 1 | 2 | 4) && k < corners_of(kind) {
                let index = self.index_of.index(tag);
                cell[k] = index.ok_or_else(|| {
                    malformed(self.from.at, "a point's tag before this", tag.to_string())
                })?;
            }
        }
        let [a, b, c, _] = cell;
        let region = physicals.first().copied().unwrap_or(0);
        let tags = &mut self.parts.tags;
        tags.has_regions |= region != 0 && kind != 1;
        match kind {
            1 if region != 0 => {
                self.parts.cell_kinds.push(0);
                tags.edges.extend(physicals.iter().map(|&id| ([a, b], id)));
            }
            2 => {
                tags.triangle_regions.push(region);
                tags.facet_cells += usize::from(region != 0);
                tags.triangles.extend(physicals.iter().map(|&id| ([a, b, c], id)));
                self.cell_tags[0].push(tag);
                self.parts.add_triangle(&cell[..3]);
            }
            4 => {
                tags.tetrahedron_regions.push(region);
                self.cell_tags[1].push(tag);
                self.parts.add_tetrahedron(&cell);
            }
            _ => self.parts.skip_cell(),
        }
        Ok(())
    }

    /// Keeps a scalar field that has a value for every point, or for every cell or all of one kind.
    fn field(&mut self, of_cells: bool) -> Result<(), MeshReadError> {
        let mut name = "";
        for i in 0..self.text_count("strings")? {
            let line = self.from.line()?;
            if i == 0 {
                name = line.trim_matches('"');
            }
        }
        for _ in 0..self.text_count("real numbers")? {
            self.from.line()?;
        }
        let mut integers = Vec::new();
        for _ in 0..self.text_count("integers")? {
            let line = self.from.line()?;
            let value = line.parse::<u64>();
            integers.push(value.map_err(|_| malformed(self.from.at, "a count before this", line))?);
        }
        let [_, components, count, ..] = integers[..] else {
            return Err(self.from.expected("three integers before this"));
        };
        let count = self.from.bounded(count, "values")?;
        let (tags, all) = match of_cells {
            true => (&self.cell_of, self.parts.cell_kinds.len()),
            false => (&self.index_of, self.parts.points.len()),
        };
        let triangles = self.parts.triangles.len() / 3;
        let kept = [all, triangles, self.parts.tetrahedra.len() / 4];
        let whole = if of_cells { kept.contains(&count) } else { count == all };
        let keep = components == 1 && whole && !name.is_empty();
        let mut values = vec![f64::NAN; if keep { all } else { 0 }];
        for _ in 0..count {
            let tag = self.from.int()?;
            let tag = u64::try_from(tag)
                .map_err(|_| malformed(self.from.at, "a tag of 0 or more", tag.to_string()))?;
            let index = tags.index(tag);
            for _ in 0..components {
                let value = self.from.real()?;
                if let Some(slot) = index.and_then(|i| values.get_mut(i as usize)) {
                    *slot = value;
                }
            }
        }
        let name = name.into();
        if keep && of_cells {
            self.parts.cell_fields.push(OwnedField { name, values });
        } else if keep {
            let values = values.into_iter().map(|v| v as f32).collect();
            self.parts.fields.push(OwnedField { name, values });
        }
        Ok(())
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

/// How many corners a line (Gmsh's type 1), a triangle (2) or a tetrahedron (4) has.
fn corners_of(kind: i32) -> usize {
    match kind {
        1 => 2,
        2 => 3,
        _ => 4,
    }
}

/// How many points a cell of Gmsh's type has.
fn corner_count(kind: i32) -> Option<usize> {
    const COUNTS: [usize; 31] = [
        2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10, 12, 15, 15, 21, 4,
        5, 6, 20, 35, 56,
    ];
    COUNTS.get(usize::try_from(kind).ok()?.checked_sub(1)?).copied()
}
