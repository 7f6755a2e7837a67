//! Triangles and tetrahedra as a polyMesh.

use std::collections::HashMap;

use atomesh::mesh::{Mesh, Tags};

use super::super::data::MeshData;
use super::super::metadata;
use super::{Beyond, CellZone, FaceZone, FoamMesh, FoamMeshError, Patch, PointZone};

/// The patch of the hull's facets that no group has.
const OTHER: &str = "defaultFaces";

impl FoamMesh {
    /// The mesh with its tags: groups of facets become patches on the hull and face zones inside, groups of points point
    /// zones, regions cell zones. A facet of several groups is given to the first. Fields are left out. Flat meshes
    /// become prisms as high as the square root of the mean area of cells.
    ///
    /// # Errors
    /// [`FoamMeshError`] if a cell names a point twice or a facet has more than two cells.
    pub fn of_mesh<const D: usize>(data: &MeshData<D>) -> Result<Self, FoamMeshError> {
        let (mesh, none) = (data.mesh(), Tags::default());
        let tags = data.tags().unwrap_or(&none);
        let groups = Groups::new(tags);
        let mut patches: Vec<Patch> =
            tags.facet_groups().iter().map(|group| Patch::new(group.name.as_str())).collect();
        patches.push(Patch::new(OTHER));
        let mut faces = Vec::new();
        let mut zones: Vec<FaceZone> = (tags.facet_groups().iter())
            .map(|group| FaceZone { name: group.name.clone(), faces: Vec::new() })
            .collect();
        for facet in mesh.facets() {
            let cell = facet.cell as usize;
            let corners = &mesh.corners()[cell * (D + 1)..(cell + 1) * (D + 1)];
            let opposite = corners.iter().position(|c| !facet.corners.contains(c)).unwrap_or(0);
            let outward = mesh.facet_of(cell, opposite);
            let group = groups.of(&facet.corners);
            let beyond = match (facet.neighbour, group) {
                (Some(other), None) => Beyond::Cell(other),
                (Some(other), Some((group, tagged))) => {
                    let flipped = !is_even(&outward, &tagged);
                    zones[group].faces.push((faces.len() as u32, flipped));
                    Beyond::Cell(other)
                }
                (None, group) => {
                    let last = patches.len() - 1;
                    Beyond::Patch(group.map_or(last, |(group, _)| group) as u32)
                }
            };
            faces.push((outward, facet.cell, beyond));
        }
        let mut made = with_faces(mesh, &faces, patches)?.without_empty_patches();
        for zone in zones.into_iter().filter(|zone| !zone.faces.is_empty()) {
            made.push_face_zone(zone)?;
        }
        for group in tags.point_groups() {
            let mut points = group.points.clone();
            if D == 2 {
                // and what stands above them
                let up = mesh.points().len() as u32;
                points.extend(group.points.iter().map(|point| point + up));
            }
            made.push_point_zone(PointZone { name: group.name.clone(), points })?;
        }
        for (name, cells) in regions(tags) {
            made.push_cell_zone(CellZone { name, cells })?;
        }
        Ok(made.with_note(&format!("{} {}", metadata::NAME, data.metadata())))
    }

    /// The same without patches that have no face, whose order else stays.
    fn without_empty_patches(mut self) -> Self {
        let mut used = vec![false; self.patches.len()];
        for beyond in &self.beyond {
            if let Beyond::Patch(patch) = beyond {
                used[*patch as usize] = true;
            }
        }
        let number: Vec<u32> = used
            .iter()
            .scan(0, |next, &used| {
                let number = *next;
                *next += u32::from(used);
                Some(number)
            })
            .collect();
        for beyond in &mut self.beyond {
            if let Beyond::Patch(patch) = beyond {
                *patch = number[*patch as usize];
            }
        }
        let mut used = used.into_iter();
        self.patches.retain(|_| used.next().unwrap_or(true));
        self
    }
}

/// Faces between corners, as [`FoamMesh`] takes them.
type Faces<const D: usize> = [([u32; D], u32, Beyond)];

fn with_faces<const D: usize>(
    mesh: &Mesh<D>,
    faces: &Faces<D>,
    patches: Vec<Patch>,
) -> Result<FoamMesh, FoamMeshError> {
    if D == 2 {
        let points: Vec<[f64; 2]> = mesh.points().iter().map(|p| [p[0], p[1]]).collect();
        let edges: Vec<_> =
            faces.iter().map(|&(f, owner, beyond)| ([f[0], f[1]], owner, beyond)).collect();
        let mean = mesh.measure().abs() / mesh.cell_count().max(1) as f64;
        let thickness = if mean > 0.0 { mean.sqrt() } else { 1.0 };
        return FoamMesh::extruded(&points, mesh.cells(), &edges, patches, thickness);
    }
    let points = mesh.points().iter().map(|p| std::array::from_fn(|k| p[k])).collect();
    let mut made = FoamMesh::new(points, mesh.cell_count(), patches);
    for (corners, owner, beyond) in faces {
        made.push_face(corners, *owner, *beyond)?;
    }
    Ok(made)
}

/// The first group that has each facet, and the facet as it stands there.
struct Groups<const D: usize>(HashMap<[u32; D], (usize, [u32; D])>);

impl<const D: usize> Groups<D> {
    fn new(tags: &Tags<D>) -> Self {
        let mut first = HashMap::new();
        for (at, group) in tags.facet_groups().iter().enumerate() {
            for facet in &group.facets {
                let mut corners = *facet;
                corners.sort_unstable();
                first.entry(corners).or_insert((at, *facet));
            }
        }
        Self(first)
    }

    /// The group of a facet whose corners ascend.
    fn of(&self, corners: &[u32; D]) -> Option<(usize, [u32; D])> {
        self.0.get(corners).copied()
    }
}

/// Whether an even number of swaps leads from one order of corners to the other.
fn is_even<const D: usize>(a: &[u32; D], b: &[u32; D]) -> bool {
    let rank = |corner: &u32| b.iter().position(|c| c == corner);
    let swaps: usize =
        (0..D).map(|k| a[..k].iter().filter(|c| rank(c) > rank(&a[k])).count()).sum();
    swaps.is_multiple_of(2)
}

/// The regions' names, each with its cells, by number.
fn regions<const D: usize>(tags: &Tags<D>) -> Vec<(String, Vec<u32>)> {
    let Some(regions) = tags.regions() else { return Vec::new() };
    let ids = regions.ids();
    let mut cells = vec![Vec::new(); ids.len()];
    for (cell, id) in regions.of_cells.iter().enumerate() {
        if let Ok(at) = ids.binary_search(id) {
            cells[at].push(cell as u32);
        }
    }
    ids.iter().map(|&id| regions.name(id)).zip(cells).collect()
}
