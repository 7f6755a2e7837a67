//! Discontinuous Galerkin on triangles and tetrahedra.
