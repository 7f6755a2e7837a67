//! The commands, one file each.

pub mod check;
pub mod clusters;
pub mod completions;
pub mod enhance;
pub mod export;
pub mod features;
pub mod flow;
pub mod info;
pub mod man;
pub mod mesh;
pub mod report;
pub mod sample;
pub mod standard_output;
pub mod surfaces;
pub mod synth;
