//! Meshes aligned with images, by Dave Hale's *Atomic Images* (2001).
//!
//! An image becomes a potential `b(x)`, −1 in features and 0 elsewhere. A lattice of atoms, about a
//! nominal distance `d(x)` apart, lowers a weighted sum of a pair potential, which keeps it regular,
//! and of the image potential, which pulls atoms onto features. Only then are the atoms connected.
//!
//! The modules follow that order; each names only modules above it in this list.

pub mod distance;
pub mod enhance;
pub mod geometry;
pub mod image;
pub mod lattice;
pub mod measure;
pub mod mesh;
pub mod minimize;
pub mod optimize;
pub mod pair;
pub mod pipeline;
pub mod potential;
pub mod synth;
pub mod watch;
