//! What a polyMesh promises.

use super::{Beyond, FoamMesh, FoamMeshError};

impl FoamMesh {
    /// Checks that the faces around each cell close it: every edge of a face is one of exactly one other
    /// face of the cell, which runs along it the other way. Cost: O(n log n) in corners of faces.
    ///
    /// # Errors
    /// [`FoamMeshError::Open`] names the first cell that is not closed.
    pub fn validate(&self) -> Result<(), FoamMeshError> {
        // each edge of each cell, with how often it runs up and down
        let mut edges: Vec<(u32, [u32; 2], bool)> = Vec::with_capacity(2 * self.corners.len());
        for face in 0..self.face_count() {
            let (corners, owner, beyond) = self.face(face);
            for (k, &a) in corners.iter().enumerate() {
                let b = corners[(k + 1) % corners.len()];
                let (edge, up) = ([a.min(b), a.max(b)], a < b);
                edges.push((owner, edge, up));
                if let Beyond::Cell(other) = beyond {
                    edges.push((other, edge, !up));
                }
            }
        }
        edges.sort_unstable();
        for runs in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            if !matches!(runs, [(_, _, false), (_, _, true)]) {
                let (cell, edge, _) = runs[0];
                return Err(FoamMeshError::Open { cell, edge });
            }
        }
        let closed = edges.chunk_by(|a, b| a.0 == b.0).count();
        if closed == self.cell_count() {
            return Ok(());
        }
        let found =
            edges.chunk_by(|a, b| a.0 == b.0).zip(0..).find(|(runs, cell)| runs[0].0 != *cell);
        let cell = found.map_or(closed as u32, |(_, cell)| cell);
        Err(FoamMeshError::NoFaces { cell })
    }
}
