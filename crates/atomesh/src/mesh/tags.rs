//! Tags: named groups of facets and cells, by which a solver knows boundaries, features and regions.
//!
//! Tags name points and cells by number, so they fit the mesh that they were made for, wherever its points
//! are moved to, and no other. A facet may be in several groups. Names are such that every mesh format can
//! hold them.

use std::collections::{HashMap, HashSet};

use super::Mesh;
use crate::geometry::Bounds;

/// What is wrong with tags.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TagsError {
    /// A group's number is 0, or that of another group.
    #[error(
        "facet group {name:?} has the id {id}; expected 1 or more, other than those of other groups"
    )]
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
    /// The corners are no facet of the mesh.
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

    /// The name of a region: its own, or `region-` and its number.
    pub fn name(&self, id: i32) -> String {
        let named = self.names.iter().find(|(named, _)| *named == id);
        named.map_or_else(|| format!("region-{id}"), |(_, name)| name.clone())
    }
}

/// Named groups of facets and cells of a mesh. The default has none.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tags<const D: usize> {
    facet_groups: Vec<FacetGroup<D>>,
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
        check_facets(mesh, &facet_groups)?;
        if let Some(regions) = &regions {
            let (found, expected) = (regions.of_cells.len(), mesh.cell_count());
            if found != expected {
                return Err(TagsError::RegionCount { found, expected });
            }
        }
        let tags = Self { facet_groups, regions };
        tags.check_names()?;
        Ok(tags)
    }

    /// The hull's facets by the side of the box that they lie on, normals outward: groups 1 `xmin`,
    /// 2 `xmax`, 3 `ymin` … `zmax`. A point is on a side if it is no farther than `tolerance` from it. Of
    /// a mesh whose points were moved to the world the groups are those of the lattice mesh. Cost: O(cells).
    pub fn sides(mesh: &Mesh<D>, bounds: &Bounds<D>, tolerance: f64) -> Self {
        let on_sides: Vec<u8> = mesh.points().iter().map(|p| bounds.sides(p, tolerance)).collect();
        let mut groups: Vec<FacetGroup<D>> = (0..2 * D)
            .map(|side| {
                let name = format!("{}{}", ["x", "y", "z"][side / 2], ["min", "max"][side % 2]);
                FacetGroup { id: side as u32 + 1, name, facets: Vec::new() }
            })
            .collect();
        for (cell, corners) in mesh.cells().enumerate() {
            for opposite in 0..Mesh::<D>::CORNERS {
                let others = (0..=D).filter(|&k| k != opposite);
                let shared = others.fold(!0, |set, k| set & on_sides[corners[k] as usize]);
                if shared != 0 {
                    let side = shared.trailing_zeros() as usize;
                    groups[side].facets.push(mesh.facet_of(cell, opposite));
                }
            }
        }
        for group in &mut groups {
            drop_pairs(&mut group.facets);
        }
        Self { facet_groups: groups, regions: None }
    }

    /// The groups of facets.
    pub fn facet_groups(&self) -> &[FacetGroup<D>] {
        &self.facet_groups
    }

    /// The group of that name.
    pub fn facet_group(&self, name: &str) -> Option<&FacetGroup<D>> {
        self.facet_groups.iter().find(|group| group.name == name)
    }

    /// The cells' regions.
    pub fn regions(&self) -> Option<&Regions> {
        self.regions.as_ref()
    }

    /// Whether there is nothing: no group and no region.
    pub fn is_empty(&self) -> bool {
        self.facet_groups.is_empty() && self.regions.is_none()
    }

    /// These tags and those of `other`, both of the same mesh. Groups of one name become one, which has
    /// each facet once, as here; other groups of `other` keep their ids where these are free, and else get
    /// the next ones.
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
        self.regions = match (self.regions, other.regions) {
            (Some(_), Some(_)) => return Err(TagsError::TwoRegions),
            (own, others) => own.or(others),
        };
        self.check_names()?;
        Ok(self)
    }

    /// The same tags of the mesh with its cells turned over, as a move to a mirrored frame does: every
    /// facet is turned, so that normals that pointed out still do.
    pub fn turned(mut self) -> Self {
        for group in &mut self.facet_groups {
            group.facets.iter_mut().for_each(|facet| facet.swap(D - 2, D - 1));
        }
        self
    }

    /// Whether ids are in order, and names fit every format and differ.
    fn check_names(&self) -> Result<(), TagsError> {
        let mut names: Vec<&str> = Vec::new();
        let mut ids = HashSet::new();
        for group in &self.facet_groups {
            if group.id == 0 || !ids.insert(group.id) {
                return Err(TagsError::Id { name: group.name.clone(), id: group.id });
            }
            names.push(&group.name);
        }
        let named = self.regions.iter().flat_map(|regions| &regions.names);
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
}

/// Whether every format can hold the name.
fn is_name(name: &str) -> bool {
    let plain = |c: u8| c.is_ascii_alphanumeric() || b"_-.".contains(&c);
    name.len() <= 64
        && name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.bytes().all(plain)
}

/// Whether the groups hold facets of the mesh, each once.
fn check_facets<const D: usize>(mesh: &Mesh<D>, groups: &[FacetGroup<D>]) -> Result<(), TagsError> {
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

/// Drops facets that come twice: they lie between two cells.
fn drop_pairs<const D: usize>(facets: &mut Vec<[u32; D]>) {
    let mut count = HashMap::new();
    facets.iter().for_each(|facet| *count.entry(ascending(facet)).or_insert(0) += 1);
    facets.retain(|facet| count[&ascending(facet)] == 1);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The corner tetrahedron of a cube of side 1 and the one that joins its three other corners.
    fn space() -> Mesh<3> {
        let points =
            vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
        Mesh::new(points, vec![0, 1, 2, 3, 1, 2, 3, 4]).unwrap()
    }

    fn square() -> Mesh<2> {
        let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        Mesh::new(points, vec![0, 1, 2, 2, 3, 0]).unwrap()
    }

    fn group<const D: usize>(id: u32, name: &str, facets: &[[u32; D]]) -> FacetGroup<D> {
        FacetGroup { id, name: name.into(), facets: facets.to_vec() }
    }

    #[test]
    fn sides_of_a_square_run_around_it_counter_clockwise() {
        let mesh = square();
        let tags = Tags::sides(&mesh, &Bounds::of(mesh.points()).unwrap(), 0.0);
        let expected = [
            group(1, "xmin", &[[3, 0]]),
            group(2, "xmax", &[[1, 2]]),
            group(3, "ymin", &[[0, 1]]),
            group(4, "ymax", &[[2, 3]]),
        ];
        assert_eq!(tags.facet_groups(), expected);
        assert_eq!(tags.clone().turned().facet_group("xmin").unwrap().facets, [[0, 3]]);
        assert_eq!(Tags::new(&mesh, expected.to_vec(), None), Ok(tags));
    }

    #[test]
    fn only_facets_on_the_box_are_its_sides_and_their_normals_point_out() {
        let mesh = space();
        let tags = Tags::sides(&mesh, &Bounds::of(mesh.points()).unwrap(), 0.0);
        let sides: Vec<_> = tags.facet_groups().iter().map(|g| g.facets.len()).collect();
        assert_eq!(sides, [1, 0, 1, 0, 1, 0]);
        for group in tags.facet_groups() {
            for &[a, b, c] in &group.facets {
                assert!(mesh.simplex(&[a, b, c, 4]).orientation() < 0.0, "{}", group.name);
            }
        }
    }

    #[test]
    fn a_facet_between_two_cells_is_no_side() {
        // within so large a tolerance the diagonal lies on every side
        let mesh = square();
        let tags = Tags::sides(&mesh, &Bounds::of(mesh.points()).unwrap(), 2.0);
        assert_eq!(tags.facet_groups()[0].facets.len(), 4);
        let tags = Tags::new(&mesh, tags.facet_groups().to_vec(), None);
        assert!(tags.is_ok(), "{tags:?}");
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let mesh = square();
        let wrong = |groups: &[FacetGroup<2>], regions: Option<Regions>| {
            Tags::new(&mesh, groups.to_vec(), regions).unwrap_err().to_string()
        };
        let message = wrong(&[group(1, "a", &[[1, 3]])], None);
        assert_eq!(
            message,
            "facet group \"a\" has the corners [1, 3]; expected a facet of the mesh"
        );
        assert!(wrong(&[group(1, "a", &[[1, 9]])], None).contains("[1, 9]"));
        assert!(wrong(&[group(1, "a", &[[1, 1]])], None).contains("[1, 1]"));
        assert!(wrong(&[group(1, "a", &[[1, 2], [2, 1]])], None).contains("[1, 2] twice"));
        assert!(wrong(&[group(0, "a", &[])], None).contains("has the id 0"));
        assert!(
            wrong(&[group(1, "a", &[]), group(1, "b", &[])], None).contains("\"b\" has the id 1")
        );
        for name in ["", "two words", "1a", "a\"b", "é", &"a".repeat(65)] {
            assert!(wrong(&[group(1, name, &[])], None).contains(&format!("the name {name:?}")));
        }
        let named = |names: &[(i32, &str)]| {
            let names = names.iter().map(|(id, name)| (*id, (*name).to_string())).collect();
            Some(Regions { of_cells: vec![1, 2], names })
        };
        assert!(wrong(&[group(1, "a", &[])], named(&[(1, "a")])).contains("the name \"a\""));
        assert!(wrong(&[], named(&[(1, "a"), (1, "b")])).contains("region 1 has two names"));
        let short = Regions { of_cells: vec![1], names: vec![] };
        assert_eq!(wrong(&[], Some(short)), "regions of 1 cells for a mesh of 2");
    }

    #[test]
    fn merging_joins_groups_of_one_name_and_numbers_others_on() {
        let mesh = square();
        let tags = |groups: &[FacetGroup<2>]| Tags::new(&mesh, groups.to_vec(), None).unwrap();
        let first = tags(&[group(1, "a", &[[0, 2], [0, 1]]), group(4, "b", &[])]);
        let second = tags(&[group(7, "a", &[[2, 0], [1, 2]]), group(1, "c", &[[0, 1]])]);
        let merged = first.merge(second).unwrap();
        let expected = [
            group(1, "a", &[[0, 2], [0, 1], [1, 2]]),
            group(4, "b", &[]),
            group(5, "c", &[[0, 1]]),
        ];
        assert_eq!(merged.facet_groups(), expected);
        let regions = Some(Regions { of_cells: vec![3, -1], names: vec![(3, "rock".into())] });
        let with_regions = Tags::new(&mesh, vec![], regions).unwrap();
        let merged = merged.merge(with_regions.clone()).unwrap();
        let found = merged.regions().unwrap();
        assert_eq!(found.ids(), [-1, 3]);
        assert_eq!([found.name(3), found.name(-1)], ["rock", "region--1"]);
        assert_eq!(merged.merge(with_regions), Err(TagsError::TwoRegions));
    }
}
