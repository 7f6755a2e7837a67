//! Why a lattice could not be made.

use crate::watch::Cancelled;

/// Why a lattice could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LatticeError {
    /// The box has no extent along an axis.
    #[error("the image has 1 sample along {}; a mesh needs 2 or more along every axis", ["x", "y", "z"][*axis])]
    Thin {
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
    },
    /// Lengths whose squares, in single precision for some, would overflow or vanish.
    #[error(
        "a nominal distance of {distance:e} in a box of {extent:e}; expected lengths of {:e} to {:e}",
        LENGTHS.start(), LENGTHS.end()
    )]
    Scale {
        /// The least nominal distance.
        distance: f64,
        /// The box's greatest extent.
        extent: f64,
    },
    /// A seed point lies outside the box.
    #[error(
        "seed point {index} at {point:?} lies outside the box {min:?} to {max:?} (lattice coordinates)"
    )]
    SeedOutside {
        /// The point's place in the list.
        index: usize,
        /// Its lattice coordinates.
        point: Vec<f64>,
        /// The box's least corner.
        min: Vec<f64>,
        /// The box's greatest corner.
        max: Vec<f64>,
    },
    /// Two seed points are nearly one, and are not.
    #[error(
        "seed points {first} and {second} are nearer to each other than {least:e}; expected one, or two that are farther apart"
    )]
    SeedsNear {
        /// The place of one in the list.
        first: usize,
        /// That of the other.
        second: usize,
        /// The least distance, in lattice units.
        least: f64,
    },
    /// A coordinate of an atom is NaN or infinite.
    #[error("coordinate {} of atom {index} is {value}; expected a finite number", ["x", "y", "z"][*axis])]
    NotFinite {
        /// The atom's place in the list.
        index: usize,
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
        /// The coordinate.
        value: f64,
    },
    /// An atom lies outside the box.
    #[error(
        "atom {index} at {point:?} lies outside the box {min:?} to {max:?} (lattice coordinates)"
    )]
    AtomOutside {
        /// The atom's place in the list.
        index: usize,
        /// Its lattice coordinates.
        point: Vec<f64>,
        /// The box's least corner.
        min: Vec<f64>,
        /// The box's greatest corner.
        max: Vec<f64>,
    },
    /// Two atoms are at one place.
    #[error("atoms {first} and {second} are both at {point:?}; expected one")]
    Duplicate {
        /// The place of one in the list.
        first: usize,
        /// That of the other.
        second: usize,
        /// Their lattice coordinates.
        point: Vec<f64>,
    },
    /// No atom is at a corner of the box.
    #[error("no atom at the corner {corner:?} of the box; expected one at each")]
    NoCorner {
        /// The corner's lattice coordinates.
        corner: Vec<f64>,
    },
    /// γ is not in 0.1…1.
    #[error("spacing factor {value}; expected 0.1 to 1")]
    SpacingFactor {
        /// The factor given.
        value: f64,
    },
    /// More atoms than indices can count.
    #[error("more than {limit} atoms; choose a larger nominal distance")]
    TooMany {
        /// The greatest number of atoms.
        limit: usize,
    },
    /// Scattered atoms could not be connected.
    #[error("scattering: {0}")]
    Connect(String),
    /// The caller ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Lengths whose squares neither overflow nor vanish, in single precision for some.
pub(super) const LENGTHS: std::ops::RangeInclusive<f64> = 1e-30..=1e30;
