//! The sides of the box as groups of facets.

use std::collections::HashMap;

use super::{FacetGroup, Tags, ascending, side_name};
use crate::geometry::Bounds;
use crate::mesh::Mesh;

impl<const D: usize> Tags<D> {
    /// The hull's facets by the side of the box that they lie on, normals outward: groups 1 `xmin`,
    /// 2 `xmax`, 3 `ymin` … `zmax`. A point is on a side if it is at most `tolerance` from it. `mesh` and `bounds` are in
    /// lattice coordinates; the groups also fit the mesh moved to the world. Cost: O(cells).
    pub fn sides(mesh: &Mesh<D>, bounds: &Bounds<D>, tolerance: f64) -> Self {
        let on_sides: Vec<u8> = mesh.points().iter().map(|p| bounds.sides(p, tolerance)).collect();
        let mut groups: Vec<FacetGroup<D>> = (0..2 * D)
            .map(|side| FacetGroup {
                id: side as u32 + 1,
                name: side_name(side).into(),
                facets: Vec::new(),
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
        Self { facet_groups: groups, ..Self::default() }
    }
}

/// Drops facets that occur twice: they lie between two cells.
fn drop_pairs<const D: usize>(facets: &mut Vec<[u32; D]>) {
    let mut count = HashMap::new();
    facets.iter().for_each(|facet| *count.entry(ascending(facet)).or_insert(0) += 1);
    facets.retain(|facet| count[&ascending(facet)] == 1);
}
