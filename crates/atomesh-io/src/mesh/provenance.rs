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
}
