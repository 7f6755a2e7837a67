//! What a hand does, as it is logged and replayed.
//!
//! Everything that can be undone is a [`Gesture`]. State is a function of the gestures so far, and of the image: the same
//! gestures give the same bytes. Places are in samples, lengths in lattice units.

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A field that is painted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PaintedField {
    /// d(x), in lattice units.
    Size,
    /// β(x).
    Weight,
}

/// What a well does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WellKind {
    /// Fluid comes in.
    Source,
    /// Fluid goes out.
    Sink,
}

/// Something done that can be undone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Gesture {
    /// Gives an option of the run another value.
    Set {
        /// Section and name, as in `lattice.size`.
        option: String,
        /// The value; null for the default.
        value: Value,
    },
    /// Paints along a path with a soft round brush.
    Paint {
        /// What is painted.
        field: PaintedField,
        /// The value; none erases: the field is automatic again.
        value: Option<f64>,
        /// The brush's radius, in lattice units.
        radius: f64,
        /// The path.
        path: Vec<Vec<f64>>,
    },
    /// Takes all paint off a field.
    Wipe {
        /// The field.
        field: PaintedField,
    },
    /// Adds an atom.
    Add {
        /// Where.
        at: Vec<f64>,
    },
    /// Moves an atom along a path; the atoms within reach follow after each step.
    Move {
        /// Its number.
        atom: u32,
        /// The path.
        path: Vec<Vec<f64>>,
        /// How far atoms follow, over the nominal distance there; 0: none follows.
        reach: f64,
    },
    /// Removes an atom.
    Remove {
        /// Its number.
        atom: u32,
    },
    /// Pins an atom where it is, or lets it go.
    Pin {
        /// Its number.
        atom: u32,
        /// Whether it is pinned from then on.
        pinned: bool,
    },
    /// Makes the facet nearest to a place a barrier, or opens it.
    Facet {
        /// The place.
        at: Vec<f64>,
        /// Whether the whole feature is meant, of which the facet is a part.
        whole: bool,
        /// The share of flow that it lets through, 0…1.
        multiplier: f64,
    },
    /// Puts a well.
    Well {
        /// What it does.
        kind: WellKind,
        /// Where.
        at: Vec<f64>,
    },
    /// Moves a well.
    MoveWell {
        /// Its number, from 0, in the order in which wells were put.
        well: usize,
        /// Where to.
        to: Vec<f64>,
    },
    /// Takes a well away.
    RemoveWell {
        /// Its number; those of later wells become one less.
        well: usize,
    },
    /// Gives what a stroke touches a region.
    Region {
        /// The region's number, from 1; 0 takes cells out of any.
        region: u32,
        /// The brush's radius in lattice units: cells whose middles are nearer are touched, and all that the path passes.
        radius: f64,
        /// The path.
        path: Vec<Vec<f64>>,
        /// The level whose parts are touched; none: single cells.
        parts: Option<usize>,
        /// The region whose cells alone are given another, 0 for those of none; none: all.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        over: Option<u32>,
    },
    /// Names a region.
    NameRegion {
        /// Its number, from 1.
        region: u32,
        /// The name.
        name: String,
    },
    /// Makes the parts along a stroke one.
    MergeParts {
        /// The stroke.
        path: Vec<Vec<f64>>,
        /// The level that is looked at.
        parts: usize,
    },
    /// Cuts a part in two where the border between two strokes is weakest.
    SplitPart {
        /// The stroke on one side, which begins in the part.
        first: Vec<Vec<f64>>,
        /// The stroke on the other.
        second: Vec<Vec<f64>>,
        /// The level that is looked at.
        parts: usize,
    },
}

impl Gesture {
    /// Checks what does not depend on the image: numbers are finite, places have 2 or 3 of them, and paths are not longer
    /// than `most`.
    ///
    /// # Errors
    /// What is odd, in words.
    pub fn check(&self, most: usize) -> Result<(), String> {
        let (places, lengths): (Vec<&Vec<f64>>, Vec<f64>) = match self {
            Self::Set { .. } | Self::Wipe { .. } => (Vec::new(), Vec::new()),
            Self::Paint { value, radius, path, .. } => {
                (path.iter().collect(), value.iter().copied().chain([*radius]).collect())
            }
            Self::Add { at } | Self::Well { at, .. } => (vec![at], Vec::new()),
            Self::Move { path, reach, .. } => (path.iter().collect(), vec![*reach]),
            Self::Remove { .. } | Self::Pin { .. } | Self::RemoveWell { .. } => return Ok(()),
            Self::Facet { at, multiplier, .. } => (vec![at], vec![*multiplier]),
            Self::MoveWell { to, .. } => (vec![to], Vec::new()),
            Self::Region { radius, path, .. } => (path.iter().collect(), vec![*radius]),
            Self::NameRegion { .. } => return Ok(()),
            Self::MergeParts { path, .. } => (path.iter().collect(), Vec::new()),
            Self::SplitPart { first, second, .. } => {
                (first.iter().chain(second).collect(), Vec::new())
            }
        };
        if places.len() > most {
            return Err(format!("a path of {} places; expected {most} or fewer", places.len()));
        }
        if let Some(odd) = places.iter().find(|place| !(2..=3).contains(&place.len())) {
            return Err(format!("a place of {} numbers; expected 2 or 3", odd.len()));
        }
        let numbers = places.into_iter().flatten().copied().chain(lengths);
        match numbers.into_iter().find(|number| !number.is_finite()) {
            Some(odd) => Err(format!("{odd}; expected a finite number")),
            None => Ok(()),
        }
    }
}
