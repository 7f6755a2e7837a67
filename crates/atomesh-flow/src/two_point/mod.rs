//! Two-point flux on Voronoi cells.
