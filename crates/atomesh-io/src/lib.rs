//! Files in and out: images with their frames, and meshes.

pub mod atomic_file;
pub mod image;
pub mod mesh;
pub mod surface;
