//! Where a mesh comes from.

use super::standing::Standing;

/// What is known of the world of an image's axes, beside its frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct World {
    /// The units of the axes, such as `m` or `ms`; empty if the file names none.
    pub units: Vec<String>,
    /// Where a flat image stands in space, if it is known.
    pub standing: Option<Standing>,
}

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
    /// Where a flat world stands in space, if it is known: points of files are written there.
    pub standing: Option<Standing>,
}

impl Provenance {
    /// The same in this world.
    pub fn in_world(mut self, world: &World) -> Self {
        self.units.clone_from(&world.units);
        self.standing = world.standing;
        self
    }
}
