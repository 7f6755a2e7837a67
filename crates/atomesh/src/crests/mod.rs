//! Points on the features of an image: where they are, between samples, and how they are turned.

mod valley;

pub use valley::{Bottom, Search, bottoms, in_large_groups};
