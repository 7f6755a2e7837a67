//! What tags promise, checked.

use std::collections::HashSet;

use super::{FacetGroup, PointGroup, Tags, ascending};
use crate::mesh::Mesh;

/// The first promise that tags break.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TagsError {
    /// A group's number is 0, or that of another group.
    #[error("group {name:?} has the id {id}; expected 1 or more, other than those of other groups")]
    Id {
        /// The group's name.
        name: String,
        /// Its number.
        id: u32,
    },
    /// A name that not every format can hold, or that another group or region has.
    #[error(
        "the name {name:?}; expected a letter and up to 63 letters, digits, '_', '-' or '.', other than other names"
    )]
    Name {
        /// The name found.
        name: String,
    },
    /// The corners are not those of a facet of the mesh.
    #[error("facet group {name:?} has the corners {facet:?}; expected a facet of the mesh")]
    Facet {
        /// The group's name.
        name: String,
        /// The corners found.
        facet: Vec<u32>,
    },
    /// A group has a facet twice.
    #[error("facet group {name:?} has the facet {facet:?} twice")]
    Twice {
        /// The group's name.
        name: String,
        /// The facet's corners.
        facet: Vec<u32>,
    },
    /// A point is not one of the mesh, or in two groups.
    #[error(
        "point group {name:?} has the point {point}; expected points of the mesh, each in one group"
    )]
    Point {
        /// The group's name.
        name: String,
        /// The point's place.
        point: u32,
    },
    /// There is not one region for each cell.
    #[error("regions of {found} cells for a mesh of {expected}")]
    RegionCount {
        /// The number of regions given.
        found: usize,
        /// The number of cells.
        expected: usize,
    },
    /// A region has two names.
    #[error("region {id} has two names, {first:?} and {second:?}")]
    RegionNames {
        /// The region.
        id: i32,
        /// One name.
        first: String,
        /// The other.
        second: String,
    },
    /// Two tags to be merged both have regions.
    #[error("both have regions; expected at most one to have them")]
    TwoRegions,
}

/// Whether ids are in order, and names fit every format and differ.
pub(super) fn check_names<const D: usize>(tags: &Tags<D>) -> Result<(), TagsError> {
    let mut names: Vec<&str> = Vec::new();
    let mut ids = HashSet::new();
    for group in &tags.facet_groups {
        if group.id == 0 || !ids.insert(group.id) {
            return Err(TagsError::Id { name: group.name.clone(), id: group.id });
        }
        names.push(&group.name);
    }
    ids.clear();
    for group in &tags.point_groups {
        if group.id == 0 || !ids.insert(group.id) {
            return Err(TagsError::Id { name: group.name.clone(), id: group.id });
        }
        names.push(&group.name);
    }
    let named = tags.regions.iter().flat_map(|regions| &regions.names);
    let mut named: Vec<&(i32, String)> = named.collect();
    names.extend(named.iter().map(|(_, name)| name.as_str()));
    if let Some(name) = names.iter().find(|name| !is_name(name)) {
        return Err(TagsError::Name { name: (*name).into() });
    }
    names.sort_unstable();
    if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(TagsError::Name { name: pair[0].into() });
    }
    named.sort_unstable();
    match named.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        Some(pair) => {
            let (first, second) = (pair[0].1.clone(), pair[1].1.clone());
            Err(TagsError::RegionNames { id: pair[0].0, first, second })
        }
        None => Ok(()),
    }
}

/// Whether every format can hold the name.
fn is_name(name: &str) -> bool {
    let plain = |c: u8| c.is_ascii_alphanumeric() || b"_-.".contains(&c);
    name.len() <= 64
        && name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.bytes().all(plain)
}

/// Whether the groups hold points of a mesh of `count`, each once.
pub(super) fn check_points(count: usize, groups: &[PointGroup]) -> Result<(), TagsError> {
    let mut taken = HashSet::new();
    for group in groups {
        let is_odd = |point: &&u32| **point as usize >= count || !taken.insert(**point);
        if let Some(&point) = group.points.iter().find(is_odd) {
            return Err(TagsError::Point { name: group.name.clone(), point });
        }
    }
    Ok(())
}

/// Whether the groups hold facets of the mesh, each once.
pub(super) fn check_facets<const D: usize>(
    mesh: &Mesh<D>,
    groups: &[FacetGroup<D>],
) -> Result<(), TagsError> {
    if groups.iter().all(|group| group.facets.is_empty()) {
        return Ok(());
    }
    let cells = mesh.cells_of_points();
    for group in groups {
        let name = || group.name.clone();
        let is_facet = |facet: &[u32; D]| {
            let distinct = (1..D).all(|k| !facet[..k].contains(&facet[k]));
            distinct && mesh.cells_beside(facet, &cells).next().is_some()
        };
        if let Some(odd) = group.facets.iter().find(|facet| !is_facet(facet)) {
            return Err(TagsError::Facet { name: name(), facet: odd.to_vec() });
        }
        let mut sorted: Vec<[u32; D]> = group.facets.iter().map(ascending).collect();
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(TagsError::Twice { name: name(), facet: pair[0].to_vec() });
        }
    }
    Ok(())
}
