//! The flow between two cells per unit of difference between their pressures.

use atomesh::mesh::{Connection, PolyMesh, connections};

use crate::error::FlowError;
use crate::permeability::Permeability;

/// The largest sine of the angle between a face's normal and the line between its sites, times the face's share of the
/// cell's surface V^((D−1)/D). Rounding alone makes 10⁻⁹.
const SKEWED: f64 = 1e-6;

/// The share of the surface up to which rounding makes a face's plane meaningless.
const THIN: f64 = 1e-4;

/// The transmissibility of each face between two cells, in the mesh's order: `m · A / (d₁/k₁ + d₂/k₂)`, with the
/// face's area A, the distances d of the sites from its plane, the permeabilities k beside it and the
/// multiplier m of a barrier.
///
/// `multipliers` has one number for each face of the mesh, those inside the box first; see
/// [`Setting::multipliers`](crate::Setting::multipliers). Unit: that of permeability × length^(D−2).
///
/// # Errors
/// [`FlowError::Tensor`] for a permeability of tensors; [`FlowError::Skewed`] names two cells whose face is not
/// normal to the line between their sites.
///
/// # Panics
/// If there are fewer multipliers than faces between two cells.
pub fn transmissibilities<const D: usize>(
    cells: &PolyMesh<D>,
    permeability: &Permeability<D>,
    multipliers: &[f64],
) -> Result<Vec<f64>, FlowError> {
    let number = |cell: u32| permeability.scalar(cell as usize).ok_or(FlowError::Tensor);
    let transmissibility = |(face, own): (usize, &Connection<D>)| {
        let surface = cells.measures()[own.cells[0] as usize].powf((D - 1) as f64 / D as f64);
        let sine = (1.0 - own.orthogonality * own.orthogonality).max(0.0).sqrt();
        let is_thin = own.area <= THIN * surface;
        if sine * own.area > SKEWED * surface {
            return Err(FlowError::Skewed { cells: own.cells, cosine: own.orthogonality });
        }
        let k = [number(own.cells[0])?, number(own.cells[1])?];
        // the plane of so thin a face is rounding; the true one is halfway between the sites
        let distances = if is_thin { [0.5 * apart(cells, own); 2] } else { own.distances };
        let resistance = distances[0] / k[0] + distances[1] / k[1];
        Ok(multipliers[face] * own.area / resistance)
    };
    connections(cells).iter().enumerate().map(transmissibility).collect()
}

/// The distance between the sites of two cells.
fn apart<const D: usize>(cells: &PolyMesh<D>, own: &Connection<D>) -> f64 {
    let [a, b] = own.cells.map(|cell| &cells.centers()[cell as usize]);
    atomesh::geometry::distance_squared(a, b).sqrt()
}
