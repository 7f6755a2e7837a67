//! Where a mesh comes from.

/// Where a mesh comes from: what is needed to make it again, and nothing that differs between two
/// runs of the same input, options and seed (no threads, paths or times).
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// The version of atomesh.
    pub version: String,
    /// The options of the run.
    pub options: serde_json::Value,
    /// The seed of the run's random numbers.
    pub seed: u64,
    /// The units of the world's axes, such as `um`, as the image's file names them; empty if it names none.
    pub units: Vec<String>,
}

impl Provenance {
    /// The same in a world of these units.
    pub fn in_units(mut self, units: &[String]) -> Self {
        self.units = units.to_vec();
        self
    }
}
