//! Tags: named groups of facets, points and cells, by which a solver knows boundaries, features, wells and regions.
//!
//! Tags name points and cells by number: they fit only the mesh that they were made for, wherever its points are moved
//! to. A facet may be in several groups, a point in one. Every mesh format can hold their names.

mod check;
mod names;
mod sides;
#[cfg(test)]
mod tests;

use std::collections::{HashMap, HashSet};

use super::Mesh;
pub use check::TagsError;
pub use names::{
    MASK_NAME, feature_name, interface_name, is_feature_name, region_name, side_name, well_name,
};

/// A named group of facets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FacetGroup<const D: usize> {
    /// The group's number, 1 or more.
    pub id: u32,
    /// Its name: a letter, then letters, digits, `_`, `-` or `.`, 64 at most.
    pub name: String,
    /// The facets as their corners, points of the mesh. Their order is the facet's orientation: see
    /// [`Mesh::facet_of`].
    pub facets: Vec<[u32; D]>,
}

/// A named group of points.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PointGroup {
    /// The group's number, 1 or more, counted apart from those of facets.
    pub id: u32,
    /// Its name, as a [`FacetGroup`] has one.
    pub name: String,
    /// The points, by their places in the mesh.
    pub points: Vec<u32>,
}

/// The region that each cell belongs to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Regions {
    /// One number for each cell, such as the label of the image that the cell lies in.
    pub of_cells: Vec<i32>,
    /// Names of some of the regions.
    pub names: Vec<(i32, String)>,
}

impl Regions {
    /// The numbers in use, ascending.
    pub fn ids(&self) -> Vec<i32> {
        let mut ids = self.of_cells.clone();
        ids.sort_unstable();
        ids.dedup();
        ids
    }

    /// The name of a region: its own, or else [`region_name`].
    pub fn name(&self, id: i32) -> String {
        let named = self.names.iter().find(|(named, _)| *named == id);
        named.map_or_else(|| region_name(id), |(_, name)| name.clone())
    }
}

/// Named groups of facets, points and cells of a mesh. The default has none.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tags<const D: usize> {
    facet_groups: Vec<FacetGroup<D>>,
    point_groups: Vec<PointGroup>,
    regions: Option<Regions>,
}

impl<const D: usize> Tags<D> {
    /// These groups and regions of `mesh`. Cost: O(cells).
    ///
    /// # Errors
    /// [`TagsError`] names the first id, name or facet that does not fit.
    pub fn new(
        mesh: &Mesh<D>,
        facet_groups: Vec<FacetGroup<D>>,
        regions: Option<Regions>,
    ) -> Result<Self, TagsError> {
        check::check_facets(mesh, &facet_groups)?;
        if let Some(regions) = &regions {
            let (found, expected) = (regions.of_cells.len(), mesh.cell_count());
            if found != expected {
                return Err(TagsError::RegionCount { found, expected });
            }
        }
        let tags = Self { facet_groups, point_groups: Vec::new(), regions };
        check::check_names(&tags)?;
        Ok(tags)
    }

    /// The same with groups of points of `mesh` in place of those that there are.
    ///
    /// # Errors
    /// [`TagsError`] names the first id, name or point that does not fit; a point may be in one group.
    pub fn with_point_groups(
        mut self,
        mesh: &Mesh<D>,
        point_groups: Vec<PointGroup>,
    ) -> Result<Self, TagsError> {
        check::check_points(mesh.points().len(), &point_groups)?;
        self.point_groups = point_groups;
        check::check_names(&self)?;
        Ok(self)
    }

    /// The groups of facets.
    pub fn facet_groups(&self) -> &[FacetGroup<D>] {
        &self.facet_groups
    }

    /// The group of that name.
    pub fn facet_group(&self, name: &str) -> Option<&FacetGroup<D>> {
        self.facet_groups.iter().find(|group| group.name == name)
    }

    /// The groups of points.
    pub fn point_groups(&self) -> &[PointGroup] {
        &self.point_groups
    }

    /// The id of each point's group, 0 for none, of a mesh of `count` points. Empty if there are no groups.
    pub fn group_of_points(&self, count: usize) -> Vec<u32> {
        if self.point_groups.is_empty() {
            return Vec::new();
        }
        let mut groups = vec![0; count];
        for group in &self.point_groups {
            group.points.iter().for_each(|&point| groups[point as usize] = group.id);
        }
        groups
    }

    /// The cells' regions.
    pub fn regions(&self) -> Option<&Regions> {
        self.regions.as_ref()
    }

    /// Whether there are no groups and no regions.
    pub fn is_empty(&self) -> bool {
        self.facet_groups.is_empty() && self.point_groups.is_empty() && self.regions.is_none()
    }

    /// These tags and those of `other`, both of the same mesh. Groups of one name become one, which has each facet once,
    /// oriented as in these tags. Groups that only `other` has keep their ids if these are free, or else get the next
    /// ones. Points are those of these tags, or if these have none, of `other`.
    ///
    /// # Errors
    /// [`TagsError`] if both have regions, or a region of one has the name of a group of the other.
    pub fn merge(mut self, other: Self) -> Result<Self, TagsError> {
        let groups = self.facet_groups.iter().enumerate();
        let places: HashMap<String, usize> =
            groups.map(|(place, group)| (group.name.clone(), place)).collect();
        let mut ids: HashSet<u32> = self.facet_groups.iter().map(|group| group.id).collect();
        let mut greatest = ids.iter().copied().max().unwrap_or(0);
        for mut group in other.facet_groups {
            if let Some(&place) = places.get(&group.name) {
                let own = &mut self.facet_groups[place];
                own.facets.append(&mut group.facets);
                keep_first(&mut own.facets);
                continue;
            }
            if ids.contains(&group.id) {
                group.id = greatest
                    .checked_add(1)
                    .ok_or_else(|| TagsError::Id { name: group.name.clone(), id: greatest })?;
            }
            ids.insert(group.id);
            greatest = greatest.max(group.id);
            self.facet_groups.push(group);
        }
        if self.point_groups.is_empty() {
            self.point_groups = other.point_groups;
        }
        self.regions = match (self.regions, other.regions) {
            (Some(_), Some(_)) => return Err(TagsError::TwoRegions),
            (own, others) => own.or(others),
        };
        check::check_names(&self)?;
        Ok(self)
    }

    /// The tags of the mesh moved by a map that mirrors ([`Mesh::moved`]): every facet is turned over, so that normals
    /// that pointed out still do.
    pub fn turned(mut self) -> Self {
        for group in &mut self.facet_groups {
            group.facets.iter_mut().for_each(|facet| facet.swap(D - 2, D - 1));
        }
        self
    }
}

/// The corners in ascending order, by which facets are compared.
fn ascending<const D: usize>(facet: &[u32; D]) -> [u32; D] {
    let mut sorted = *facet;
    sorted.sort_unstable();
    sorted
}

/// Keeps the first of facets with the same corners, in their order.
fn keep_first<const D: usize>(facets: &mut Vec<[u32; D]>) {
    let mut found = HashSet::new();
    facets.retain(|facet| found.insert(ascending(facet)));
}
