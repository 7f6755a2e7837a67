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
#[cfg(feature = "studio")]
pub mod replay;
pub mod report;
pub mod sample;
pub mod standard_output;
#[cfg(feature = "studio")]
pub mod studio;
pub mod surfaces;
pub mod synth;
