//! Tags between a mesh and its files: facets by the groups that they are in, and back.

use std::collections::{BTreeMap, HashMap, HashSet};

use atomesh::mesh::{FacetGroup, Mesh, PointGroup, Regions, Tags};

use super::metadata::Metadata;
use super::read_error::MeshReadError;

/// The name of the one region that formats need where a mesh has facet groups but no regions.
pub(super) const DOMAIN: &str = "domain";

/// Facets that are in the same groups: their places among the tags' groups, and the facets as the first of
/// these groups turns them.
pub(super) type Joined<const D: usize> = Vec<(Vec<usize>, Vec<[u32; D]>)>;

/// The tagged facets, each once, by the set of groups that they are in; sets in ascending order, facets in
/// the order in which groups name them.
pub(super) fn by_groups<const D: usize>(tags: &Tags<D>) -> Joined<D> {
    let mut groups_of: HashMap<[u32; D], Vec<usize>> = HashMap::new();
    for (at, group) in tags.facet_groups().iter().enumerate() {
        for facet in &group.facets {
            groups_of.entry(ascending(facet)).or_default().push(at);
        }
    }
    let mut joined: BTreeMap<Vec<usize>, Vec<[u32; D]>> = BTreeMap::new();
    for (at, group) in tags.facet_groups().iter().enumerate() {
        for facet in &group.facets {
            let groups = &groups_of[&ascending(facet)];
            if groups.first() == Some(&at) {
                joined.entry(groups.clone()).or_default().push(*facet);
            }
        }
    }
    joined.into_iter().collect()
}

/// The corners in ascending order, by which facets are compared.
pub(super) fn ascending<const D: usize>(facet: &[u32; D]) -> [u32; D] {
    let mut sorted = *facet;
    sorted.sort_unstable();
    sorted
}

/// A name for formats that take letters, digits, `_` and `-` only.
pub(super) fn plain_name(name: &str) -> String {
    name.replace('.', "_")
}

/// Tags as a file has them, before the dimension is known.
#[derive(Debug, Default)]
pub(super) struct RawTags {
    /// Lines, each with the number of a group; a line of several groups is listed once for each.
    pub edges: Vec<([u32; 2], i32)>,
    /// Triangles likewise.
    pub triangles: Vec<([u32; 3], i32)>,
    /// How many of the file's triangles are facets of groups.
    pub facet_cells: usize,
    /// The region of each triangle that is a cell; 0 where the file has none.
    pub triangle_regions: Vec<i32>,
    /// The region of each tetrahedron.
    pub tetrahedron_regions: Vec<i32>,
    /// Whether the file names regions at all.
    pub has_regions: bool,
    /// Points, each with the number of a group.
    pub points: Vec<(u32, i32)>,
    /// Names of groups: their dimension, number and name.
    pub names: Vec<(usize, i32, String)>,
}

impl RawTags {
    /// Puts points into the groups of these numbers, one for each point; 0 is none. A number that no group can have is
    /// left out later.
    pub fn points_of(&mut self, groups: &[u32]) {
        let in_group = groups.iter().enumerate().filter(|(_, group)| **group > 0);
        let number = |group: &u32| i32::try_from(*group).unwrap_or(0);
        self.points.extend(in_group.map(|(point, group)| (point as u32, number(group))));
    }

    /// Gives groups of points the names that atomesh has given them, and their numbers where the file has others
    /// beside the names.
    pub fn name_points(&mut self, metadata: &Metadata) {
        let mut own = HashMap::new();
        for (id, name) in metadata.point_groups() {
            let Ok(id) = i32::try_from(id) else { continue };
            let known = self.names.iter_mut().find(|(dim, _, known)| *dim == 0 && *known == name);
            match known {
                Some((_, number, _)) => {
                    own.insert(std::mem::replace(number, id), id);
                }
                None => self.names.push((0, id, name)),
            }
        }
        for (_, group) in &mut self.points {
            *group = own.get(group).copied().unwrap_or(*group);
        }
    }

    /// The groups of points, each of them in the first that has it, and the number of points left out.
    fn point_groups(
        &self,
        point_count: usize,
        taken: &mut HashSet<String>,
    ) -> (Vec<PointGroup>, usize) {
        let mut groups: BTreeMap<i32, Vec<u32>> = BTreeMap::new();
        let (mut found, mut left_out) = (HashSet::new(), 0);
        for &(point, id) in &self.points {
            if (point as usize) < point_count && id > 0 && found.insert(point) {
                groups.entry(id).or_default().push(point);
            } else {
                left_out += 1;
            }
        }
        let named = |(id, points): (i32, Vec<u32>)| {
            let name = self.name(0, id).unwrap_or_else(|| format!("points-{id}"));
            PointGroup { id: id as u32, name: unique(name, taken), points }
        };
        (groups.into_iter().map(named).collect(), left_out)
    }

    /// The tags of a mesh of edges and triangles, or of triangles and tetrahedra; and the number of facets and points left
    /// out because they are not the mesh's, or are listed twice.
    pub fn into_tags<const D: usize>(
        self,
        mesh: &Mesh<D>,
        facets: Vec<([u32; D], i32)>,
        of_cells: Vec<i32>,
    ) -> Result<(Tags<D>, usize), MeshReadError> {
        let mut taken = HashSet::new();
        let mut groups: BTreeMap<i32, FacetGroup<D>> = BTreeMap::new();
        let mut left_out = 0;
        let cells = mesh.cells_of_points();
        let mut found = HashSet::new();
        for (facet, id) in facets {
            let sorted = ascending(&facet);
            let distinct = sorted.windows(2).all(|pair| pair[0] != pair[1]);
            let is_facet = distinct && mesh.cells_beside(&sorted, &cells).next().is_some();
            if !is_facet || !found.insert((sorted, id)) {
                left_out += 1;
                continue;
            }
            let group = groups.entry(id).or_insert_with(|| FacetGroup {
                id: id.unsigned_abs().max(1),
                name: unique(
                    self.name(D - 1, id).unwrap_or_else(|| format!("group-{id}")),
                    &mut taken,
                ),
                facets: Vec::new(),
            });
            group.facets.push(facet);
        }
        // groups of a file without facets have their names all the same
        for (dimension, id, name) in &self.names {
            if *dimension == D - 1 && !groups.contains_key(id) {
                let name = unique(fit(name), &mut taken);
                groups
                    .insert(*id, FacetGroup { id: id.unsigned_abs().max(1), name, facets: vec![] });
            }
        }
        let regions = self.regions::<D>(of_cells, &mut taken);
        let mut groups: Vec<FacetGroup<D>> = groups.into_values().collect();
        groups.sort_by_key(|group| group.id);
        groups.dedup_by_key(|group| group.id);
        let (points, others) = self.point_groups(mesh.points().len(), &mut taken);
        let tags = Tags::new(mesh, groups, regions)?.with_point_groups(mesh, points)?;
        Ok((tags, left_out + others))
    }

    fn name(&self, dimension: usize, id: i32) -> Option<String> {
        let named = self.names.iter().find(|(d, i, _)| (*d, *i) == (dimension, id));
        named.map(|(_, _, name)| fit(name))
    }

    fn regions<const D: usize>(
        &self,
        of_cells: Vec<i32>,
        taken: &mut HashSet<String>,
    ) -> Option<Regions> {
        let first = *of_cells.first()?;
        let whole = of_cells.iter().all(|&id| id == first);
        let nameless = |id: i32| self.name(D, id).is_none_or(|name| name == DOMAIN);
        if !self.has_regions || whole && nameless(first) {
            return None;
        }
        let mut regions = Regions { of_cells, names: Vec::new() };
        for id in regions.ids() {
            if let Some(name) = self.name(D, id).filter(|name| *name != format!("region-{id}")) {
                regions.names.push((id, unique(name, taken)));
            }
        }
        Some(regions)
    }
}

/// The name with other characters than tags allow as `_`, and with a letter in front.
fn fit(name: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    let mut fitting: String = name.chars().map(|c| if plain(c) { c } else { '_' }).collect();
    if !fitting.starts_with(|c: char| c.is_ascii_alphabetic()) {
        fitting.insert_str(0, "group-");
    }
    fitting.truncate(60);
    fitting
}

/// The name, with a number behind it if it is taken.
fn unique(name: String, taken: &mut HashSet<String>) -> String {
    let mut trial = name.clone();
    let mut number = 2;
    while !taken.insert(trial.clone()) {
        trial = format!("{}.{number}", &name[..name.len().min(52)]);
        number += 1;
    }
    trial
}
