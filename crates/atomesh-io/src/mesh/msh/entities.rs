//! Tags as Gmsh knows them: entities, and the physical groups that these are in.
//!
//! Gmsh counts the numbers of groups in each dimension by itself. Other readers do not, so here no group of facets has
//! the number of a region: regions keep the numbers that they have, groups of facets keep theirs if no region has one of
//! them, and else are numbered on from the regions.

use std::collections::HashSet;

use atomesh::mesh::{Regions, Tags};

use super::super::data::MeshData;
use super::super::metadata::KnownAs;
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

/// A point of a group.
pub(super) struct PointEntity {
    /// The physical group.
    pub physical: i32,
    pub point: u32,
}

/// The entities of a mesh; each kind is numbered from 1 in its order here.
pub(super) struct Entities<const D: usize> {
    pub cells: Vec<CellEntity>,
    pub facets: Vec<FacetEntity<D>>,
    pub points: Vec<PointEntity>,
    /// Dimension, number and name of each physical group.
    pub names: Vec<(usize, i32, String)>,
    /// The regions and groups whose physical group has another number.
    pub known_as: KnownAs,
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
            points: vec![],
            names: vec![],
            known_as: KnownAs::default(),
            of_cells: vec![],
            order: (0..data.mesh().cell_count() as u32).collect(),
        };
        let Some(tags) = data.tags().filter(|tags| !tags.is_empty()) else { return entities };
        if let Some(regions) = tags.regions() {
            entities.add_regions(regions);
            entities.add_groups(tags);
            entities.add_points(tags);
            return entities;
        }
        entities.add_groups(tags);
        entities.add_points(tags);
        let groups: Vec<i32> = entities.names.iter().map(|(_, number, _)| *number).collect();
        let domain = free_numbers(&groups).next().unwrap_or(i32::MAX);
        entities.cells[0].physicals = vec![domain];
        entities.names.push((D, domain, DOMAIN.into()));
        entities
    }

    fn add_regions(&mut self, regions: &Regions) {
        let ids = regions.ids();
        let mut free = free_numbers(&ids);
        self.cells.clear();
        for &id in &ids {
            let mut physical = id;
            if id < 1 {
                physical = free.next().unwrap_or(i32::MAX);
                self.known_as.regions.push((id, physical));
            }
            self.names.push((D, physical, regions.name(id)));
            self.cells.push(CellEntity { physicals: vec![physical], count: 0 });
        }
        // every region is among the ids
        let place = |id: &i32| ids.binary_search(id).unwrap_or(0) as u32;
        self.of_cells = regions.of_cells.iter().map(place).collect();
        for &at in &self.of_cells {
            self.cells[at as usize].count += 1;
        }
        let of_cells = &self.of_cells;
        self.order.sort_by_key(|&cell| of_cells[cell as usize]);
    }

    fn add_groups(&mut self, tags: &Tags<D>) {
        let regions: Vec<i32> = self.names.iter().map(|(_, number, _)| *number).collect();
        let groups = tags.facet_groups();
        let own = groups.iter().map(|group| i32::try_from(group.id).ok());
        let own: Option<Vec<i32>> = own.collect();
        let own = own.filter(|own| !own.iter().any(|number| regions.contains(number)));
        let is_own = own.is_some();
        let numbers = own.unwrap_or_else(|| free_numbers(&regions).take(groups.len()).collect());
        for (group, &number) in groups.iter().zip(&numbers) {
            self.names.push((D - 1, number, group.name.clone()));
            if !is_own {
                self.known_as.groups.push((group.id, number));
            }
        }
        for (groups, facets) in by_groups(tags) {
            let physicals = groups.iter().map(|&at| numbers[at]).collect();
            self.facets.push(FacetEntity { physicals, facets });
        }
    }

    /// Groups of points have the numbers that are left: their own are in the comment.
    fn add_points(&mut self, tags: &Tags<D>) {
        let used: Vec<i32> = self.names.iter().map(|(_, number, _)| *number).collect();
        for (group, physical) in tags.point_groups().iter().zip(free_numbers(&used)) {
            self.names.push((0, physical, group.name.clone()));
            let points = group.points.iter().map(|&point| PointEntity { physical, point });
            self.points.extend(points);
        }
    }

    /// The place of a cell's entity.
    pub fn entity_of(&self, cell: usize) -> usize {
        self.of_cells.get(cell).map_or(0, |&at| at as usize)
    }

    /// The cells by entity, in order within each.
    pub fn order(&self) -> &[u32] {
        &self.order
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

    /// How many points of groups there are.
    pub fn point_count(&self) -> usize {
        self.points.len()
    }
}

/// The numbers above 0 that are not in use: those above the greatest, then the gaps.
fn free_numbers(used: &[i32]) -> impl Iterator<Item = i32> + use<> {
    let used: HashSet<i32> = used.iter().copied().collect();
    let greatest = used.iter().copied().max().unwrap_or(0).max(0);
    let above = (1..=i32::MAX - greatest).map(move |more| greatest + more);
    above.chain(1..greatest).filter(move |number| !used.contains(number))
}
