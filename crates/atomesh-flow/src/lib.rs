//! Steady flow of one fluid on a mesh that follows an image: `−∇·(k∇p) = q` (Hale 2001, section 3.1).
//!
//! A [`Problem`] says what flows where, by names and places: permeability, wells, pressure or flux on sides,
//! barriers with multipliers. A [`FlowGrid`] holds the cells and facets of a mesh of triangles, tetrahedra or
//! Voronoi cells. The two make a [`Setting`], in which every facet and well is placed and every
//! compartment is known to have a solution. Then one of two schemes computes a [`Solution`]:
//!
//! - [`dg`]: discontinuous Galerkin on triangles and tetrahedra, any permeability;
//! - [`two_point`]: two-point flux on Voronoi cells, isotropic permeability.
//!
//! Both conserve mass in every cell, and let pressure jump across barriers. [`FlowMethod`] holds them for callers that
//! are generic over the dimension. Lengths are in the unit of the mesh's coordinates, permeability in any unit; the
//! unit of rates is that of permeability × pressure × length^(D−2).
//!
//! ```
//! use atomesh::geometry::Bounds;
//! use atomesh::mesh::{Delaunay, Tags};
//! use atomesh::watch::Silent;
//! use atomesh_flow::{Boundary, Condition, FlowGrid, Problem, Setting, Value, dg};
//!
//! let points: Vec<[f64; 2]> = (0..25).map(|i| [f64::from(i % 5), f64::from(i / 5)]).collect();
//! let mesh = Delaunay::<2>::new().connect(&points, &mut Silent)?;
//! let sides = Tags::sides(&mesh, &Bounds { min: [0.0; 2], max: [4.0; 2] }, 1e-9);
//! let grid = FlowGrid::of_mesh(&mesh, &sides);
//! let fixed = |group: &str, pressure| Boundary {
//!     group: group.into(),
//!     condition: Condition::Pressure(Value::Constant(pressure)),
//! };
//! let boundaries = vec![fixed("xmin", 1.0), fixed("xmax", 0.0)];
//! let problem = Problem { boundaries, ..Default::default() };
//! let setting = Setting::new(&problem, &grid)?;
//! let answer = dg::solve(&grid, &setting, &Default::default(), &mut Silent)?;
//! let balance = answer.solution.balance(&grid);
//! // a pressure drop of 1 over a length of 4 drives 1/4 through each unit of the side, which is 4 long
//! assert!((balance.boundary_in - 1.0).abs() < 1e-12 && balance.relative_error() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod dg;
mod error;
mod grid;
mod method;
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
pub use grid::{FacetSet, FlowFacet, FlowGrid};
pub use method::FlowMethod;
pub use permeability::{Permeability, Tensor};
pub use problem::{Barrier, Boundary, Condition, Control, Problem, Value, Well};
pub use setting::{Compartment, PlacedWell, Setting, well_index};
pub use solution::{Balance, Solution, WellFlow};
