//! Steady flow of one fluid on a mesh that follows an image: `−∇·(k∇p) = q` (Hale 2001, section 3.1).
//!
//! A [`Problem`] says what flows where, by names and places: permeability, wells, pressure or flux on sides,
//! barriers with multipliers. A [`Grid`] is what is known of a mesh's cells and facets, whether triangles,
//! tetrahedra or Voronoi cells. The two make a [`Setting`], in which every facet and well is placed and every
//! compartment has been found solvable. Then one of two schemes answers with a [`Solution`]:
//!
//! - [`dg`]: discontinuous Galerkin on triangles and tetrahedra, any permeability;
//! - [`two_point`]: two-point flux on Voronoi cells, isotropic permeability.
//!
//! Both conserve mass in every cell, and let pressure jump across barriers. A crate of its own since it brings a
//! heavy dependency, the sparse direct solver. All lengths are those of the mesh's coordinates; permeability
//! is in any unit, and rates are then in those of permeability × pressure × length^(D−2).

pub mod dg;
mod error;
mod grid;
mod permeability;
mod problem;
mod setting;
mod solution;
pub mod solve;
pub mod streamlines;
pub mod two_point;
#[cfg(test)]
pub(crate) mod test_meshes;

pub use error::FlowError;
pub use grid::{FacetSet, FlowFacet, Grid};
pub use permeability::{Permeability, Tensor};
pub use problem::{Barrier, Boundary, Condition, Control, Problem, Value, Well};
pub use setting::{Compartment, PlacedWell, Setting, well_index};
pub use solution::{Balance, Solution, WellFlow};
