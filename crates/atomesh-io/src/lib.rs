//! Files in and out: images with their frames, and meshes.

pub mod atomic_file;
mod files;
pub mod image;
pub mod mesh;
pub mod output_group;
pub mod place;
pub mod surface;

pub use files::{MeshFiles, PointValue};
