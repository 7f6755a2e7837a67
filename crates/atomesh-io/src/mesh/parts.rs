//! The step from a file's points and cells to a mesh, which all readers share.

use atomesh::mesh::{Mesh, Tags};

use super::field::OwnedField;
use super::loaded::{AnyMesh, LoadedMesh};
use super::metadata::{Metadata, POINT_GROUP};
use super::read_error::MeshReadError;
use super::tags::RawTags;

/// A file's points and cells before its dimension is known.
#[derive(Debug, Default)]
pub(super) struct Parts {
    pub points: Vec<[f64; 3]>,
    pub triangles: Vec<u32>,
    pub tetrahedra: Vec<u32>,
    pub skipped_cells: usize,
    /// The names of fields that are no scalars, or not whole.
    pub skipped_fields: Vec<String>,
    /// The corners of each cell of the file that is kept, 0 for the others, in the file's order.
    pub cell_kinds: Vec<u8>,
    pub fields: Vec<OwnedField>,
    /// A value for each cell of the file.
    pub cell_fields: Vec<OwnedField<f64>>,
    pub metadata: Metadata,
    /// Whether cells of second order were read, of which the corners are kept.
    pub has_quadratic: bool,
    pub tags: RawTags,
}

impl Parts {
    /// Keeps a cell whose corners are known.
    pub fn add_triangle(&mut self, corners: &[u32]) {
        self.triangles.extend_from_slice(corners);
        self.cell_kinds.push(3);
    }

    /// Keeps a cell whose corners are known.
    pub fn add_tetrahedron(&mut self, corners: &[u32]) {
        self.tetrahedra.extend_from_slice(corners);
        self.cell_kinds.push(4);
    }

    /// Leaves a field out.
    pub fn skip_field(&mut self, name: &str) {
        if !name.is_empty() && !self.skipped_fields.iter().any(|known| known == name) {
            self.skipped_fields.push(name.to_owned());
        }
    }

    /// Leaves a cell out.
    pub fn skip_cell(&mut self) {
        self.skipped_cells += 1;
        self.cell_kinds.push(0);
    }

    /// The fields of the cells with so many corners; fields of another number of cells are dropped.
    fn fields_of(&mut self, corners: u8) -> Vec<OwnedField<f64>> {
        let kinds = &self.cell_kinds;
        let mut fields = std::mem::take(&mut self.cell_fields);
        fields.retain_mut(|field| {
            let whole = field.values.len() == kinds.len();
            if !whole {
                self.skipped_fields.push(field.name.clone());
            }
            let mut kinds = kinds.iter();
            field.values.retain(|_| kinds.next() == Some(&corners));
            whole
        });
        fields
    }

    /// Puts the values of the cells with so many corners in an order of these cells, if there is one.
    pub fn sort_fields(&mut self, corners: u8, order: &[usize]) {
        if order.is_empty() {
            return;
        }
        let kinds = self.cell_kinds.iter().enumerate();
        let places: Vec<usize> = kinds.filter(|(_, k)| **k == corners).map(|(i, _)| i).collect();
        for field in &mut self.cell_fields {
            let values: Vec<f64> = order.iter().map(|&cell| field.values[places[cell]]).collect();
            places.iter().zip(values).for_each(|(&place, value)| field.values[place] = value);
        }
    }

    /// Drops the points that are no corner of a cell that is kept, if there were cells of second order: the
    /// middles of their edges.
    fn drop_middles(&mut self) {
        if !self.has_quadratic {
            return;
        }
        let cells =
            if self.tetrahedra.is_empty() { &mut self.triangles } else { &mut self.tetrahedra };
        let mut number = vec![u32::MAX; self.points.len()];
        for &corner in cells.iter() {
            if let Some(n) = number.get_mut(corner as usize) {
                *n = 0;
            }
        }
        for (place, n) in number.iter_mut().filter(|n| **n == 0).enumerate() {
            *n = place as u32; // there are fewer than 2^32 points
        }
        for corner in cells.iter_mut() {
            // a corner that names no point keeps naming none
            *corner = number.get(*corner as usize).copied().unwrap_or(u32::MAX);
        }
        let is_kept = |i: usize| number[i] != u32::MAX;
        let mut at = 0..;
        self.points.retain(|_| at.next().is_some_and(is_kept));
        // facets that lose a corner are not the mesh's, and are left out later
        let renumber = |c: &mut u32| *c = number.get(*c as usize).copied().unwrap_or(u32::MAX);
        self.tags.edges.iter_mut().for_each(|(edge, _)| edge.iter_mut().for_each(renumber));
        self.tags.triangles.iter_mut().for_each(|(t, _)| t.iter_mut().for_each(renumber));
        self.tags.points.iter_mut().for_each(|(point, _)| renumber(point));
        for field in &mut self.fields {
            let mut at = 0..;
            field.values.retain(|_| at.next().is_some_and(|i| i < number.len() && is_kept(i)));
        }
    }

    /// Takes the groups of points that atomesh has written as a field.
    fn take_point_groups(&mut self) {
        let is_ours = !self.metadata.point_groups().is_empty();
        let place = self.fields.iter().position(|field| field.name == POINT_GROUP);
        if let (true, Some(place)) = (is_ours, place) {
            let field = self.fields.remove(place);
            let groups: Vec<u32> = field.values.iter().map(|&group| group as u32).collect();
            self.tags.points_of(&groups);
        }
        self.tags.name_points(&self.metadata);
    }

    /// A mesh of the tetrahedra, if there are any, or else of the triangles.
    pub fn into_mesh(mut self) -> Result<AnyMesh, MeshReadError> {
        self.take_point_groups();
        self.drop_middles();
        if !self.tetrahedra.is_empty() {
            let cell_fields = self.fields_of(4);
            let mesh = Mesh::new(self.points, self.tetrahedra)?;
            let facets = std::mem::take(&mut self.tags.triangles);
            let regions = std::mem::take(&mut self.tags.tetrahedron_regions);
            let untagged = (self.triangles.len() / 3).saturating_sub(self.tags.facet_cells);
            let (tags, left_out) = self.tags.into_tags(&mesh, facets, regions)?;
            let skipped = self.skipped_cells + untagged + left_out;
            let loaded = loaded(mesh, self.fields, &self.metadata, skipped);
            let skipped_fields = self.skipped_fields;
            let loaded = LoadedMesh { tags, cell_fields, skipped_fields, ..loaded };
            return Ok(AnyMesh::Volume(loaded));
        }
        if self.triangles.is_empty() {
            return Err(MeshReadError::NoCells { skipped: self.skipped_cells });
        }
        if let Some(standing) = self.metadata.standing() {
            self.points.iter_mut().for_each(|p| *p = standing.in_plane(*p));
        }
        let (mut min, mut max, mut size) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
        for p in &self.points {
            (min, max) = (min.min(p[2]), max.max(p[2]));
            size = size.max(p[0].abs()).max(p[1].abs());
        }
        // the tolerance covers a rotation in double precision, and text with ten digits
        if max - min > 1e-9 * size {
            return Err(MeshReadError::NotFlat { min, max });
        }
        let cell_fields = self.fields_of(3);
        let points = self.points.into_iter().map(|[x, y, _]| [x, y]).collect();
        let mesh = Mesh::new(points, self.triangles)?;
        let facets = std::mem::take(&mut self.tags.edges);
        let regions = std::mem::take(&mut self.tags.triangle_regions);
        let (tags, left_out) = self.tags.into_tags(&mesh, facets, regions)?;
        let skipped = self.skipped_cells + left_out;
        let loaded = loaded(mesh, self.fields, &self.metadata, skipped);
        let skipped_fields = self.skipped_fields;
        Ok(AnyMesh::Flat(LoadedMesh { tags, cell_fields, skipped_fields, ..loaded }))
    }
}

/// A mesh with what else the file says.
pub(super) fn loaded<const D: usize>(
    mesh: Mesh<D>,
    point_fields: Vec<OwnedField>,
    metadata: &Metadata,
    skipped_cells: usize,
) -> LoadedMesh<D> {
    let (frame, provenance) = (metadata.frame(), metadata.provenance());
    LoadedMesh {
        mesh,
        point_fields,
        cell_fields: Vec::new(),
        tags: Tags::default(),
        frame,
        provenance,
        skipped_cells,
        skipped_fields: Vec::new(),
    }
}
