//! Tags as Gmsh knows them: entities, and the physical groups that these are in.

use super::super::data::MeshData;
use super::super::tags::{DOMAIN, by_groups};

/// The cells of one region.
pub(super) struct CellEntity {
    /// The physical groups: none or one.
    pub physicals: Vec<i32>,
    /// How many cells it has.
    pub count: usize,
}

/// The facets that are in the same groups.
pub(super) struct FacetEntity<const D: usize> {
    /// The physical groups.
    pub physicals: Vec<i32>,
    pub facets: Vec<[u32; D]>,
}

/// The entities of a mesh; each kind is numbered from 1 in its order here.
pub(super) struct Entities<const D: usize> {
    pub cells: Vec<CellEntity>,
    pub facets: Vec<FacetEntity<D>>,
    /// Dimension, number and name of each physical group.
    pub names: Vec<(usize, i32, String)>,
    /// The regions whose physical group has another number: theirs, and that.
    pub known_as: Vec<(i32, i32)>,
    /// The place of each cell's entity; empty if there is one.
    of_cells: Vec<u32>,
    /// The cells by entity, in order within each.
    order: Vec<u32>,
}

impl<const D: usize> Entities<D> {
    pub fn of(data: &MeshData<D>) -> Self {
        let whole = CellEntity { physicals: vec![], count: data.mesh().cell_count() };
        let mut entities = Self {
            cells: vec![whole],
            facets: vec![],
            names: vec![],
            known_as: vec![],
            of_cells: vec![],
            order: (0..data.mesh().cell_count() as u32).collect(),
        };
        let Some(tags) = data.tags().filter(|tags| !tags.is_empty()) else { return entities };
        for group in tags.facet_groups() {
            entities.names.push((D - 1, group.id as i32, group.name.clone()));
        }
        for (groups, facets) in by_groups(tags) {
            let physicals = groups.iter().map(|&at| tags.facet_groups()[at].id as i32).collect();
            entities.facets.push(FacetEntity { physicals, facets });
        }
        let Some(regions) = tags.regions() else {
            entities.cells[0].physicals = vec![1];
            entities.names.push((D, 1, DOMAIN.into()));
            return entities;
        };
        let ids = regions.ids();
        let mut next = ids.last().copied().unwrap_or(0).max(0);
        entities.cells.clear();
        for &id in &ids {
            let mut physical = id;
            if id < 1 {
                next = next.saturating_add(1);
                physical = next;
                entities.known_as.push((id, physical));
            }
            entities.names.push((D, physical, regions.name(id)));
            entities.cells.push(CellEntity { physicals: vec![physical], count: 0 });
        }
        // every region is among the ids
        let place = |id: &i32| ids.binary_search(id).unwrap_or(0) as u32;
        entities.of_cells = regions.of_cells.iter().map(place).collect();
        for &at in &entities.of_cells {
            entities.cells[at as usize].count += 1;
        }
        let of_cells = &entities.of_cells;
        entities.order.sort_by_key(|&cell| of_cells[cell as usize]);
        entities
    }

    /// The place of a cell's entity.
    pub fn entity_of(&self, cell: usize) -> usize {
        self.of_cells.get(cell).map_or(0, |&at| at as usize)
    }

    /// Each entity's cells, in the order of entities.
    pub fn cells_by_entity(&self) -> impl Iterator<Item = (&CellEntity, &[u32])> {
        let mut rest = &self.order[..];
        self.cells.iter().map(move |entity| {
            let (own, others) = rest.split_at(entity.count);
            rest = others;
            (entity, own)
        })
    }

    /// How many facets there are, one of several groups counted for each.
    pub fn facet_count(&self) -> usize {
        self.facets.iter().map(|entity| entity.facets.len() * entity.physicals.len()).sum()
    }
}
