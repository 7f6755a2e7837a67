//! Meshes aligned with images, by Dave Hale's *Atomic Images* (2001).
//!
//! An image becomes a potential `b(x)`, −1 in features and 0 elsewhere. A lattice of atoms, about a
//! nominal distance `d(x)` apart, lowers a weighted sum of a pair potential, which keeps it regular,
//! and of the image potential, which pulls atoms onto features. Only then are the atoms connected.
//!
//! The modules follow that order; each names only modules above it in this list.

mod parallel;
pub mod geometry;
pub mod watch;
pub mod minimize;
pub mod image;
pub mod fields;
pub mod crests;
pub mod synth;
pub mod enhance;
pub mod mesh;
pub mod energy;
pub mod region;
pub mod lattice;
pub mod optimize;
pub mod mirror;
pub mod conform;
pub mod improve;
pub mod edit;
pub mod features;
pub mod sample;
pub mod voronoi;
pub mod cluster;
pub mod measure;
pub mod run;

/// Compiles and runs the code in the README.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

/// Compiles and runs the code in `docs/method.md`.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/method.md")]
struct MethodDocument;
