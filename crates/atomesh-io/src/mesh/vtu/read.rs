//! Reading VTU: text, base64 and raw data, inline and appended, plain and compressed by zlib, LZ4 or LZMA.

use super::super::column::Endian;
use super::super::field::OwnedField;
use super::super::loaded::AnyMesh;
use super::super::metadata::{self, Metadata};
use super::super::parts::Parts;
use super::super::read_error::{MeshReadError, excerpt, malformed};
use super::super::tags::RawTags;
use super::array::{Array, Layout, Place};
use super::compressor::{self, Compressor};
use super::xml::{Event, Scanner, Tag, find};

/// Reads the triangles or tetrahedra of a VTU file; of several pieces, all.
///
/// # Errors
/// [`MeshReadError`] if the bytes are not such a file. No count in the file makes this allocate more
/// than the file's own data call for.
pub fn read_vtu(bytes: &[u8]) -> Result<AnyMesh, MeshReadError> {
    let document = Document::parse(bytes, "UnstructuredGrid")?;
    let mut parts = Parts::default();
    if let Some(array) = document.field_data.iter().find(|a| a.name == metadata::NAME) {
        parts.metadata = Metadata::decode(&array.string()?);
    }
    for (i, piece) in document.pieces.iter().enumerate() {
        piece.add_to(&mut parts, i == 0)?;
    }
    if document.pieces.len() == 1 {
        document.add_tags(&mut parts.tags)?;
    }
    parts.into_mesh()
}

/// The arrays of a file, found but not read.
pub(crate) struct Document<'a> {
    /// The tag that is named as the kind is; image data have their frame there.
    pub grid: Option<Tag<'a>>,
    pub field_data: Vec<Array<'a>>,
    pub pieces: Vec<Piece<'a>>,
}

#[derive(Default)]
pub(crate) struct Piece<'a> {
    pub at: usize,
    /// The first and last point along each axis, in image data.
    pub extent: &'a str,
    pub points: usize,
    /// The number of cells; in poly data that of lines and polygons.
    pub cells: usize,
    pub coordinates: Vec<Array<'a>>,
    /// The connectivity and offsets of lines, and of polygons.
    pub lines: Vec<Array<'a>>,
    pub polygons: Vec<Array<'a>>,
    pub counts: [usize; 2],
    pub topology: Vec<Array<'a>>,
    /// The names of the point and cell arrays that are shown first, if the file says so.
    pub scalars: [Option<&'a str>; 2],
    pub point_data: Vec<Array<'a>>,
    pub cell_data: Vec<Array<'a>>,
}

/// Where the appended data begin, and whether they are base64.
#[derive(Clone, Copy)]
struct Appended {
    start: usize,
    base64: bool,
}

impl<'a> Document<'a> {
    /// Finds the arrays of a file of VTK's `kind`.
    pub fn parse(bytes: &'a [u8], kind: &'static str) -> Result<Self, MeshReadError> {
        let mut scanner = Scanner::new(bytes);
        let root = match scanner.next()? {
            Event::Open(tag) if tag.name == "VTKFile" => tag,
            _ => return Err(malformed(0, "<VTKFile>", excerpt(bytes, 0))),
        };
        let layout = layout(&root, kind)?;
        let mut document = Self { grid: None, field_data: vec![], pieces: vec![] };
        let mut section = "";
        let mut appended = None;
        let mut pending = Vec::new();
        loop {
            match scanner.next()? {
                Event::Open(tag) => match tag.name {
                    "AppendedData" => {
                        appended = Some(Appended::locate(bytes, scanner.at(), &tag)?);
                        break; // raw data are no XML
                    }
                    "Piece" => document.pieces.push(Piece::new(&tag, kind)?),
                    "FieldData" | "PointData" | "CellData" | "Points" | "Cells" | "Lines"
                    | "Polys" | "Verts" | "Strips" => {
                        section = tag.name;
                        let of = ["PointData", "CellData"].iter().position(|s| *s == section);
                        if let (Some(of), Some(piece)) = (of, document.pieces.last_mut()) {
                            piece.scalars[of] = tag.get("Scalars");
                        }
                    }
                    name if name == kind => document.grid = Some(tag),
                    "DataArray" => {
                        pending.push((section, document.pieces.len(), tag, scanner.at()))
                    }
                    _ => {}
                },
                Event::Close("VTKFile") | Event::End => break,
                Event::Close(_) => {}
            }
        }
        for (section, pieces, tag, text) in pending {
            document.add(section, pieces, || array(bytes, layout, &tag, text, appended))?;
        }
        Ok(document)
    }

    /// Files an array under the section it stands in, of the last of the `pieces` before it.
    fn add(
        &mut self,
        section: &str,
        pieces: usize,
        array: impl FnOnce() -> Result<Array<'a>, MeshReadError>,
    ) -> Result<(), MeshReadError> {
        let piece = pieces.checked_sub(1).and_then(|i| self.pieces.get_mut(i));
        match (section, piece) {
            ("FieldData", _) => self.field_data.push(array()?),
            ("Points", Some(piece)) => piece.coordinates.push(array()?),
            ("Cells", Some(piece)) => piece.topology.push(array()?),
            ("Lines", Some(piece)) => piece.lines.push(array()?),
            ("Polys", Some(piece)) => piece.polygons.push(array()?),
            ("PointData", Some(piece)) => piece.point_data.push(array()?),
            ("CellData", Some(piece)) => piece.cell_data.push(array()?),
            _ => {}
        }
        Ok(())
    }

    /// Reads the groups of facets and the names of regions, where the file has them as atomesh writes them.
    fn add_tags(&self, tags: &mut RawTags) -> Result<(), MeshReadError> {
        let named = |name: &str| self.field_data.iter().find(|a| a.name == name);
        let groups = (named("facets"), named("facet_group"));
        if let ((Some(facets), Some(group_of)), Some(dimension @ (2 | 3))) =
            (groups, groups.0.map(|a| a.components))
        {
            let (Some(facet_count), Some(group_count)) = (facets.tuples, group_of.tuples) else {
                return Ok(());
            };
            if facet_count != group_count {
                let expected = format!("as many facets as groups of them, {group_count}");
                return Err(malformed(0, expected, facet_count.to_string()));
            }
            let corners = facets.indices(facet_count.saturating_mul(dimension))?;
            let group_of = group_of.reals(group_count)?;
            for (corners, &group) in corners.chunks_exact(dimension).zip(&group_of) {
                match *corners {
                    [a, b] => tags.edges.push(([a, b], group as i32)),
                    [a, b, c] => tags.triangles.push(([a, b, c], group as i32)),
                    _ => {}
                }
            }
        }
        // the dimension of facets is one less than that of cells
        let cells = if tags.tetrahedron_regions.is_empty() { 2 } else { 3 };
        for (dimension, ids, names) in [
            (cells - 1, "facet_group_ids", "facet_group_names"),
            (cells, "region_ids", "region_names"),
        ] {
            let (Some(ids), Some(names)) = (named(ids), named(names)) else { continue };
            let Some(count) = ids.tuples else { continue };
            let (ids, names) = (ids.reals(count)?, names.string()?);
            let names = String::from_utf8_lossy(&names).into_owned();
            let pairs = ids.iter().zip(names.lines());
            tags.names.extend(pairs.map(|(&id, name)| (dimension, id as i32, name.to_owned())));
        }
        Ok(())
    }
}

fn layout(root: &Tag, kind: &'static str) -> Result<Layout, MeshReadError> {
    let unsupported = |what, found: &str, expected| {
        Err(MeshReadError::Unsupported { what, found: found.into(), expected })
    };
    match root.get("type") {
        Some(found) if found == kind => {}
        other => return unsupported("VTK file type", other.unwrap_or(""), kind),
    }
    let compressor = match root.get("compressor") {
        None | Some("") => None,
        Some(name) => match Compressor::named(name) {
            None => return unsupported("compressor", name, compressor::NAMES),
            known => known,
        },
    };
    let wide_header = match root.get("header_type") {
        None | Some("UInt32") => false,
        Some("UInt64") => true,
        Some(other) => return unsupported("header type", other, "UInt32 or UInt64"),
    };
    let endian = match root.get("byte_order") {
        None | Some("LittleEndian") => Endian::Little,
        Some("BigEndian") => Endian::Big,
        Some(other) => return unsupported("byte order", other, "LittleEndian or BigEndian"),
    };
    Ok(Layout { endian, wide_header, compressor })
}

impl Appended {
    fn locate(bytes: &[u8], start: usize, tag: &Tag) -> Result<Self, MeshReadError> {
        let base64 = match tag.get("encoding") {
            Some("raw") => false,
            None | Some("base64") => true,
            Some(other) => {
                return Err(MeshReadError::Unsupported {
                    what: "encoding of appended data",
                    found: other.into(),
                    expected: "raw or base64",
                });
            }
        };
        let mark = find(bytes, start, b"_")
            .filter(|&mark| bytes[start..mark].iter().all(u8::is_ascii_whitespace))
            .ok_or_else(|| malformed(start, "'_' before appended data", excerpt(bytes, start)))?;
        Ok(Self { start: mark + 1, base64 })
    }
}

fn array<'a>(
    file: &'a [u8],
    layout: Layout,
    tag: &Tag<'a>,
    text: usize,
    appended: Option<Appended>,
) -> Result<Array<'a>, MeshReadError> {
    let place = match tag.get("format").unwrap_or("ascii") {
        "ascii" => Place::Text(text),
        "binary" => Place::Base64(text),
        "appended" => {
            let appended = appended
                .ok_or_else(|| malformed(tag.at, "<AppendedData> for this array", "none"))?;
            let offset = tag.count("offset")?;
            let start = appended.start.checked_add(offset).filter(|&s| s <= file.len());
            let start = start
                .ok_or_else(|| malformed(tag.at, "an offset in the file", offset.to_string()))?;
            if appended.base64 { Place::Base64(start) } else { Place::Raw(start) }
        }
        other => {
            return Err(MeshReadError::Unsupported {
                what: "array format",
                found: other.into(),
                expected: "ascii, binary or appended",
            });
        }
    };
    let components = match tag.get("NumberOfComponents") {
        None | Some("") => 1,
        Some(_) => tag.count("NumberOfComponents")?,
    };
    let (kind, name) = (tag.require("type")?, tag.get("Name").unwrap_or(""));
    let tuples = tag.get("NumberOfTuples").and_then(|count| count.trim().parse().ok());
    Ok(Array { file, layout, place, kind, name, components, tuples })
}

/// Whether an array holds the region of each cell, and no field.
fn is_region(array: &Array) -> bool {
    array.name == "region" && array.is_integer() && array.components == 1
}

/// Appends the fields of one more piece to those of the pieces before; the names of those that not all pieces have.
fn append<T: Clone>(
    fields: &mut Vec<OwnedField<T>>,
    more: Vec<OwnedField<T>>,
    first: bool,
) -> Vec<String> {
    if first {
        *fields = more;
        return Vec::new();
    }
    let of_some = more.iter().filter(|new| !fields.iter().any(|old| old.name == new.name));
    let mut lost: Vec<String> = of_some.map(|field| field.name.clone()).collect();
    fields.retain_mut(|old| match more.iter().find(|new| new.name == old.name) {
        Some(new) => {
            old.values.extend_from_slice(&new.values);
            true
        }
        None => {
            lost.push(old.name.clone());
            false
        }
    });
    lost
}

impl<'a> Piece<'a> {
    fn new(tag: &Tag<'a>, kind: &str) -> Result<Self, MeshReadError> {
        if kind == "ImageData" {
            let extent = tag.require("Extent")?;
            return Ok(Self { at: tag.at, extent, ..Self::default() });
        }
        let points = tag.count("NumberOfPoints")?;
        let mut piece = Self { at: tag.at, points, ..Self::default() };
        if kind == "PolyData" {
            piece.counts = [tag.count("NumberOfLines")?, tag.count("NumberOfPolys")?];
        } else {
            piece.cells = tag.count("NumberOfCells")?;
        }
        Ok(piece)
    }

    /// Appends the piece's points, cells and scalar fields; fields that not all pieces have are dropped.
    fn add_to(&self, parts: &mut Parts, first: bool) -> Result<(), MeshReadError> {
        let base = u32::try_from(parts.points.len()).ok();
        let base = base.ok_or_else(|| malformed(self.at, "fewer than 2^32 points", "more"))?;
        let wrong = |expected: &str| malformed(self.at, expected, "a piece without it");
        let coordinates = self.coordinates.first().ok_or_else(|| wrong("one array in <Points>"))?;
        if coordinates.components != 3 {
            let found = coordinates.components.to_string();
            return Err(malformed(self.at, "points of 3 components", found));
        }
        let numbers = coordinates.reals(self.count_of(self.points, 3)?)?;
        parts.points.extend(numbers.as_chunks::<3>().0);
        self.add_cells(parts, base)?;

        let mut fields = Vec::new();
        for array in self.point_data.iter().filter(|a| !a.name.is_empty()) {
            if array.components != 1 {
                parts.skip_field(array.name);
                continue;
            }
            let values = array.reals(self.points)?.into_iter().map(|v| v as f32).collect();
            fields.push(OwnedField { name: array.name.into(), values });
        }
        let mut lost = append(&mut parts.fields, fields, first);
        let (fields, skipped) = self.cell_fields()?;
        lost.extend(append(&mut parts.cell_fields, fields, first));
        lost.extend(skipped);
        lost.iter().for_each(|name| parts.skip_field(name));
        Ok(())
    }

    /// The scalar fields in the cells, and the names of those that are passed over: of several components, or of types that
    /// are not numbers.
    fn cell_fields(&self) -> Result<(Vec<OwnedField<f64>>, Vec<String>), MeshReadError> {
        let (mut fields, mut skipped) = (Vec::new(), Vec::new());
        for array in self.cell_data.iter().filter(|a| !a.name.is_empty() && !is_region(a)) {
            if array.components != 1 {
                skipped.push(array.name.into());
                continue;
            }
            match array.reals(self.cells) {
                Ok(values) => fields.push(OwnedField { name: array.name.into(), values }),
                Err(MeshReadError::Unsupported { .. }) => skipped.push(array.name.into()),
                Err(e) => return Err(e),
            }
        }
        Ok((fields, skipped))
    }

    fn add_cells(&self, parts: &mut Parts, base: u32) -> Result<(), MeshReadError> {
        let named = |name: &str| {
            let found = self.topology.iter().find(|a| a.name == name);
            found.ok_or_else(|| malformed(self.at, format!("{name} in <Cells>"), "none"))
        };
        let ends = named("offsets")?.indices(self.cells)?;
        let kinds = named("types")?.indices(self.cells)?;
        let corner_count = ends.last().map_or(0, |&end| end as usize);
        let mut corners = named("connectivity")?.indices(corner_count)?;
        for corner in &mut corners {
            let absolute = corner.checked_add(base).filter(|_| (*corner as usize) < self.points);
            *corner = absolute.ok_or_else(|| {
                let expected = format!("a point below {}", self.points);
                malformed(self.at, expected, corner.to_string())
            })?;
        }
        let region = self.cell_data.iter().find(|a| is_region(a));
        let region = region.map(|a| a.reals(self.cells)).transpose()?;
        parts.tags.has_regions |= region.is_some();
        let region_of = |cell: usize| region.as_ref().map_or(0, |r| r[cell] as i32);
        let mut start = 0;
        for (cell, (&end, &kind)) in ends.iter().zip(&kinds).enumerate() {
            let list = corners.get(start..end as usize);
            let list = list.ok_or_else(|| {
                malformed(self.at, format!("growing offsets at cell {cell}"), end.to_string())
            })?;
            start = end as usize;
            match (kind, list.len()) {
                (5, 3) | (22, 6) => {
                    parts.add_triangle(&list[..3]);
                    parts.tags.triangle_regions.push(region_of(cell));
                    parts.has_quadratic |= kind == 22;
                }
                (10, 4) | (24, 10) => {
                    parts.add_tetrahedron(&list[..4]);
                    parts.tags.tetrahedron_regions.push(region_of(cell));
                    parts.has_quadratic |= kind == 24;
                }
                (5 | 10 | 22 | 24, found) => {
                    let expected = format!("3, 4, 6 or 10 points of cell {cell}");
                    return Err(malformed(self.at, expected, found.to_string()));
                }
                _ => parts.skip_cell(),
            }
        }
        Ok(())
    }

    pub fn count_of(&self, items: usize, each: usize) -> Result<usize, MeshReadError> {
        let count = items.checked_mul(each);
        count.ok_or_else(|| malformed(self.at, "a count in memory's reach", items.to_string()))
    }
}
