//! Writing MSH.

use std::io::Write;

use atomesh::geometry::Bounds;
use atomesh::mesh::Mesh;
use atomesh::watch::{Phase, Watch, check};

use super::super::column::{Endian, Number};
use super::super::data::MeshData;
use super::super::error::MeshWriteError;
use super::super::format::{MshEncoding, MshVersion};
use super::super::standing::{Standing, placed};
use super::entities::Entities;
use super::values::{Quantity, element_cells};
use super::{POINT, element_type, place};

/// Bytes gathered before they are handed on.
const CHUNK: usize = 1 << 18;

/// Numbers a line where the order of cells is told.
const CELLS_A_LINE: usize = 16;

/// Cells or points between two looks at the watch.
const ITEMS_PER_STEP: usize = 1 << 18;

/// Writes a mesh as MSH.
///
/// # Errors
/// If there are more points or cells than the format's 32-bit numbers can name, `out` cannot be
/// written to, or the watch ends the work.
pub fn write_msh<const D: usize>(
    out: &mut impl Write,
    data: &MeshData<D>,
    version: MshVersion,
    encoding: MshEncoding,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let entities = Entities::of(data);
    let elements = data.mesh().cell_count() + entities.facet_count() + entities.point_count();
    let count = data.nodes().len().max(elements);
    if i32::try_from(count).is_err() {
        return Err(MeshWriteError::TooMany { format: "MSH", count, limit: i32::MAX as usize });
    }
    let fields = data.cell_fields().len() + data.cell_vectors().len();
    let steps = 2 + data.point_fields().len() + fields;
    let items = (steps * count.max(1)) as f64;
    let standing = data.standing();
    let mut numbers = Numbers { out, bytes: vec![], encoding, watch, standing, done: 0, items };
    numbers.head(version, &data.metadata_with_numbers(&entities.known_as))?;
    physical_names(&mut numbers, &entities);
    match version {
        MshVersion::V41 => {
            entities_41(&mut numbers, data.mesh(), &entities);
            nodes_41(&mut numbers, data.nodes())?;
            elements_41(&mut numbers, data, &entities)?;
        }
        MshVersion::V22 => {
            nodes_22(&mut numbers, data.nodes())?;
            elements_22(&mut numbers, data, &entities)?;
        }
    }
    for field in data.point_fields() {
        let values = field.values();
        let points = 0..values.len() as u32;
        field_data(&mut numbers, "NodeData", &Quantity::numbers(field), points)?;
    }
    if fields > 0 {
        let cells = element_cells(data, &entities, version);
        let all = || cells.iter().copied();
        for field in data.cell_fields() {
            field_data(&mut numbers, "ElementData", &Quantity::numbers(field), all())?;
        }
        for field in data.cell_vectors() {
            let vectors = Quantity::vectors(field, standing);
            field_data(&mut numbers, "ElementData", &vectors, all())?;
        }
    }
    numbers.flush()
}

/// Writes numbers in the chosen encoding.
struct Numbers<'a, W> {
    out: &'a mut W,
    bytes: Vec<u8>,
    encoding: MshEncoding,
    watch: &'a mut dyn Watch,
    /// Where a flat mesh stands.
    standing: Option<&'a Standing>,
    done: usize,
    items: f64,
}

impl<W: Write> Numbers<'_, W> {
    fn text(&mut self, text: &str) {
        self.bytes.extend_from_slice(text.as_bytes());
    }

    fn put<T: Number + std::fmt::Display>(&mut self, value: T) {
        match self.encoding {
            MshEncoding::Binary => value.put(Endian::Little, &mut self.bytes),
            MshEncoding::Text => self.text(&format!("{value} ")),
        }
    }

    fn int(&mut self, value: usize) {
        self.put(value as i32); // counts were checked to fit
    }

    fn size(&mut self, value: usize) {
        self.put(value as u64);
    }

    fn ints<const N: usize>(&mut self, values: [usize; N]) {
        values.into_iter().for_each(|v| self.int(v));
    }

    fn sizes<const N: usize>(&mut self, values: [usize; N]) {
        values.into_iter().for_each(|v| self.size(v));
    }

    fn real(&mut self, value: f64) {
        match self.encoding {
            MshEncoding::Binary => value.put(Endian::Little, &mut self.bytes),
            MshEncoding::Text => self.text(&format!("{value:.16e} ")),
        }
    }

    /// Ends a line of text; binary numbers have no lines.
    fn line(&mut self) {
        if self.encoding == MshEncoding::Text {
            self.bytes.pop_if(|b| *b == b' ');
            self.bytes.push(b'\n');
        }
    }

    /// Ends a point or cell.
    fn item(&mut self) -> Result<(), MeshWriteError> {
        self.line();
        self.item_of_text()
    }

    /// Counts what was written, and hands it on where it is much.
    fn item_of_text(&mut self) -> Result<(), MeshWriteError> {
        self.done += 1;
        if self.done.is_multiple_of(ITEMS_PER_STEP) {
            check(self.watch, Phase::Write, (self.done as f64 / self.items).min(1.0), None)?;
        }
        if self.bytes.len() >= CHUNK { self.flush() } else { Ok(()) }
    }

    /// Ends a section; binary numbers are followed by a line break.
    fn end(&mut self, section: &str) {
        if self.encoding == MshEncoding::Binary {
            self.bytes.push(b'\n');
        }
        self.text(&format!("$End{section}\n"));
    }

    fn flush(&mut self) -> Result<(), MeshWriteError> {
        self.out.write_all(&self.bytes)?;
        self.bytes.clear();
        Ok(())
    }

    fn head(&mut self, version: MshVersion, metadata: &str) -> Result<(), MeshWriteError> {
        let version = match version {
            MshVersion::V41 => "4.1",
            MshVersion::V22 => "2.2",
        };
        match self.encoding {
            MshEncoding::Binary => {
                self.text(&format!("$MeshFormat\n{version} 1 8\n"));
                self.int(1); // tells the order of the bytes
                self.end("MeshFormat");
            }
            MshEncoding::Text => {
                self.text(&format!("$MeshFormat\n{version} 0 8\n$EndMeshFormat\n"));
            }
        }
        // "$" opens and closes sections; JSON can do without it
        let metadata = metadata.replace('$', "\\u0024");
        self.text(&format!("$Comments\n{metadata}\n$EndComments\n"));
        Ok(())
    }

    /// An element of Gmsh's kind, in a group.
    fn element_22(&mut self, tag: usize, kind: i32, group: Group, nodes: &[u32]) {
        self.int(tag);
        if self.encoding == MshEncoding::Text {
            self.put(kind);
            self.int(2);
        }
        self.put(group.physical);
        self.int(group.entity);
        let count = nodes.len();
        (0..count).for_each(|k| self.int(nodes[place(count, k)] as usize + 1));
    }

    fn point<const D: usize>(&mut self, p: &[f64; D]) {
        placed(p, self.standing).into_iter().for_each(|x| self.real(x));
    }
}

/// What an element of version 2.2 is in: a physical group, 0 for none, and an entity.
#[derive(Clone, Copy)]
struct Group {
    physical: i32,
    entity: usize,
}

fn nodes_41<W: Write, const D: usize>(
    to: &mut Numbers<W>,
    points: &[[f64; D]],
) -> Result<(), MeshWriteError> {
    let count = points.len();
    to.text("$Nodes\n");
    to.sizes([1, count, count.min(1), count]); // blocks, points, least and greatest tag
    to.line();
    to.ints([D, 1, 0]); // dimension and tag of the entity, no parameters
    to.size(count);
    to.line();
    for tag in 1..=count {
        to.size(tag);
        to.item()?;
    }
    for p in points {
        to.point(p);
        to.item()?;
    }
    to.end("Nodes");
    Ok(())
}

/// One block an entity: the cells of each region, the facets after them, and points last, numbered from 1 in the order in which they
/// stand, since readers that pass over numbers take values by that order. Where it is not the mesh's, a section of
/// its own says it.
fn elements_41<W: Write, const D: usize>(
    to: &mut Numbers<W>,
    data: &MeshData<D>,
    entities: &Entities<D>,
) -> Result<(), MeshWriteError> {
    let (cell_count, each) = (data.mesh().cell_count(), data.nodes_per_cell());
    let is_quadratic = data.quadratic().is_some();
    let facet_count: usize = entities.facets.iter().map(|e| e.facets.len()).sum();
    let count = cell_count + facet_count + entities.point_count();
    let blocks = entities.cells.len() + entities.facets.len() + entities.points.len();
    to.text("$Elements\n");
    to.sizes([blocks, count, count.min(1), count]);
    to.line();
    let mut tag = 0;
    for (at, (entity, cells)) in entities.cells_by_entity().enumerate() {
        to.ints([D, at + 1]);
        to.put(element_type(D, is_quadratic));
        to.size(entity.count);
        to.line();
        for cell in cells.iter().map(|&cell| cell as usize) {
            tag += 1;
            to.size(tag);
            let nodes = &data.cell_nodes()[cell * each..(cell + 1) * each];
            (0..each).for_each(|k| to.size(nodes[place(each, k)] as usize + 1));
            to.item()?;
        }
    }
    for (at, entity) in entities.facets.iter().enumerate() {
        to.ints([D - 1, at + 1]);
        to.put(element_type(D - 1, is_quadratic));
        to.size(entity.facets.len());
        to.line();
        for facet in &entity.facets {
            tag += 1;
            to.size(tag);
            data.facet_nodes(facet).iter().for_each(|&node| to.size(node as usize + 1));
            to.item()?;
        }
    }
    for (at, entity) in entities.points.iter().enumerate() {
        to.ints([0, at + 1]);
        to.put(POINT);
        to.size(1);
        to.line();
        tag += 1;
        to.sizes([tag, entity.point as usize + 1]);
        to.item()?;
    }
    to.end("Elements");
    cell_order(to, entities.order())
}

/// The place in the mesh of each cell, from 0 on, as text, unless they stand in the mesh's order.
fn cell_order<W: Write>(to: &mut Numbers<W>, order: &[u32]) -> Result<(), MeshWriteError> {
    if order.is_sorted() {
        return Ok(());
    }
    to.text(&format!("$CellOrder\n{}\n", order.len()));
    for cells in order.chunks(CELLS_A_LINE) {
        let words: Vec<String> = cells.iter().map(u32::to_string).collect();
        to.text(&words.join(" "));
        to.text("\n");
        to.item_of_text()?;
    }
    to.text("$EndCellOrder\n");
    Ok(())
}

/// The names of groups and regions, if there are any.
fn physical_names<W: Write, const D: usize>(to: &mut Numbers<W>, entities: &Entities<D>) {
    let names = &entities.names;
    if names.is_empty() {
        return;
    }
    to.text(&format!("$PhysicalNames\n{}\n", names.len()));
    for (dimension, number, name) in names {
        to.text(&format!("{dimension} {number} \"{name}\"\n"));
    }
    to.text("$EndPhysicalNames\n");
}

/// The entities with the groups that they are in, if there are any; their boxes are the mesh's.
fn entities_41<W: Write, const D: usize>(
    to: &mut Numbers<W>,
    mesh: &Mesh<D>,
    entities: &Entities<D>,
) {
    if entities.names.is_empty() {
        return;
    }
    to.text("$Entities\n");
    let mut counts = [0; 4];
    (counts[0], counts[D - 1], counts[D]) =
        (entities.points.len(), entities.facets.len(), entities.cells.len());
    to.sizes(counts);
    to.line();
    for (at, entity) in entities.points.iter().enumerate() {
        to.int(at + 1);
        to.point(&mesh.points()[entity.point as usize]);
        to.size(1);
        to.put(entity.physical);
        to.line();
    }
    let bounds = Bounds::of(mesh.points()).unwrap_or(Bounds { min: [0.0; D], max: [0.0; D] });
    let facets = entities.facets.iter().enumerate().map(|(at, e)| (at + 1, &e.physicals));
    let cells = entities.cells.iter().enumerate().map(|(at, e)| (at + 1, &e.physicals));
    for (tag, physicals) in facets.chain(cells) {
        to.int(tag);
        to.point(&bounds.min);
        to.point(&bounds.max);
        to.size(physicals.len());
        physicals.iter().for_each(|&physical| to.put(physical));
        to.size(0); // entities that bound it: not told
        to.line();
    }
    to.end("Entities");
}

fn nodes_22<W: Write, const D: usize>(
    to: &mut Numbers<W>,
    points: &[[f64; D]],
) -> Result<(), MeshWriteError> {
    to.text(&format!("$Nodes\n{}\n", points.len()));
    for (i, p) in points.iter().enumerate() {
        to.int(i + 1);
        to.point(p);
        to.item()?;
    }
    to.end("Nodes");
    Ok(())
}

/// The cells as in the mesh, then the facets, one of several groups once for each, since an element has one
/// group in this version, and the points of groups.
fn elements_22<W: Write, const D: usize>(
    to: &mut Numbers<W>,
    data: &MeshData<D>,
    entities: &Entities<D>,
) -> Result<(), MeshWriteError> {
    let (cells, facets) = (data.mesh().cell_count(), entities.facet_count());
    let (each, is_quadratic) = (data.nodes_per_cell(), data.quadratic().is_some());
    let points = entities.point_count();
    to.text(&format!("$Elements\n{}\n", cells + facets + points));
    let text = to.encoding == MshEncoding::Text;
    if !text && cells > 0 {
        to.put(element_type(D, is_quadratic));
        to.ints([cells, 2]); // cells of that kind, each with two tags
    }
    for (cell, nodes) in data.cell_nodes().chunks_exact(each).enumerate() {
        let entity = entities.entity_of(cell);
        let physical = entities.cells[entity].physicals.first().copied().unwrap_or(0);
        let kind = element_type(D, is_quadratic);
        to.element_22(cell + 1, kind, Group { physical, entity: entity + 1 }, nodes);
        to.item()?;
    }
    if !text && facets > 0 {
        to.put(element_type(D - 1, is_quadratic));
        to.ints([facets, 2]);
    }
    let mut tag = cells;
    for (at, entity) in entities.facets.iter().enumerate() {
        for &physical in &entity.physicals {
            for facet in &entity.facets {
                tag += 1;
                let kind = element_type(D - 1, is_quadratic);
                let group = Group { physical, entity: at + 1 };
                to.element_22(tag, kind, group, &data.facet_nodes(facet));
                to.item()?;
            }
        }
    }
    if !text && points > 0 {
        to.put(POINT);
        to.ints([points, 2]);
    }
    for (at, entity) in entities.points.iter().enumerate() {
        tag += 1;
        let group = Group { physical: entity.physical, entity: at + 1 };
        to.element_22(tag, POINT, group, &[entity.point]);
        to.item()?;
    }
    to.end("Elements");
    Ok(())
}

/// A field, in the form that both versions share; `places` are those of its values, one for each point or element in
/// the file's order.
fn field_data<W: Write>(
    to: &mut Numbers<W>,
    section: &str,
    field: &Quantity,
    places: impl ExactSizeIterator<Item = u32>,
) -> Result<(), MeshWriteError> {
    let (name, components, count) = (field.name, field.components, places.len());
    // one string: the name; one real: the time; three integers: time step, components, values
    to.text(&format!("${section}\n1\n\"{name}\"\n1\n0\n3\n0\n{components}\n{count}\n"));
    for (i, place) in places.enumerate() {
        to.int(i + 1);
        (0..components).for_each(|k| to.real(field.value(place, k)));
        to.item()?;
    }
    to.end(section);
    Ok(())
}
