//! The cell behind a facet: the one that the facet's normal points out of.

use atomesh::mesh::Mesh;

/// A cell, and its corner, from 0, that is not on the facet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Behind {
    pub cell: usize,
    pub opposite: usize,
}

/// The cell whose own facet there is turned alike; else the first of the cells `beside` the facet. `None` if
/// there are no such cells.
pub(super) fn cell_behind<const D: usize>(
    mesh: &Mesh<D>,
    facet: &[u32; D],
    beside: impl Iterator<Item = u32>,
) -> Option<Behind> {
    let mut first = None;
    for cell in beside {
        let cell = cell as usize;
        let corners = &mesh.corners()[cell * (D + 1)..][..D + 1];
        let opposite = corners.iter().position(|c| !facet.contains(c)).unwrap_or(0);
        let found = Behind { cell, opposite };
        if is_rotated(&mesh.facet_of(cell, opposite), facet) {
            return Some(found);
        }
        first = first.or(Some(found));
    }
    first
}

/// Whether the corners follow one another in the same order around.
fn is_rotated<const D: usize>(a: &[u32; D], b: &[u32; D]) -> bool {
    let shift = b.iter().position(|corner| *corner == a[0]).unwrap_or(0);
    // an edge has its two ends in one order alone
    if D == 2 { a == b } else { (0..D).all(|k| a[k] == b[(k + shift) % D]) }
}
