//! Improving a mesh after its points are connected: facets turn onto features, and no cell stays flat.
//!
//! Delaunay's rule knows the atoms but not the image. Where two atoms on a feature are not joined, or a
//! tetrahedron has four corners near one plane, swaps and small moves do what the rule cannot. Swaps lower the
//! mean of b along facets (Hale 2001 names them in section 2.4), moves lower the energy of facets and of shape
//! together. There is a floor on the least angle of a cell: cells above it stay above it.
//!
//! [`Improver`] is the contract: [`PlaneImprover`] improves triangles, [`SpaceImprover`] tetrahedra. Points without
//! freedom stay, others stay on the side of the box that they lie on. In the plane, points that move freely may be
//! taken away where they crowd, and added where they are missing; in space they may be merged.

mod plane;
mod space;

pub use plane::PlaneImprover;
pub use space::SpaceImprover;

use crate::fields::FieldsView;
use crate::mesh::{Mesh, MeshError};
use crate::watch::{Cancelled, Watch};

/// How facets are aligned with features once the atoms are connected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Align {
    /// Neither swaps nor moves: Delaunay's mesh as it is.
    Off,
    /// Swaps alone; points stay.
    Swaps,
    /// Swaps and moves. Points may also be taken away, and in the plane added.
    Full,
    /// Atoms stand on features before all others, and facets of features are kept ([`crate::conform`]).
    Conform,
    /// [`Conform`](Self::Conform) where features are clean lines or sheets, [`Full`](Self::Full) where they are ragged
    /// or there are none. An [`Improver`], which knows no features, takes it as full.
    #[default]
    Auto,
}

impl Align {
    /// Whether points are moved.
    pub(crate) fn moves(self) -> bool {
        !matches!(self, Self::Off | Self::Swaps)
    }
}

/// How a mesh is improved.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImproveOptions {
    /// What is done.
    pub align: Align,
    /// The floor on the least angle of a cell, in degrees: the interior angle in the plane, from 0 to below 60, the
    /// dihedral angle in space, from 0 to below 70.5. Cells above it are kept above it; cells below it are raised as
    /// far as possible.
    pub min_angle: f64,
}

impl ImproveOptions {
    /// The defaults for images of a dimension: a floor of 20° in the plane, of 15° in space.
    pub fn for_dimension(dimension: usize) -> Self {
        Self { align: Align::default(), min_angle: if dimension == 2 { 20.0 } else { 15.0 } }
    }

    /// Checks the floor: 0 or more, and below the angles of the regular triangle, 60°, or tetrahedron, 70.5°.
    ///
    /// # Errors
    /// [`ImproveError::MinAngle`].
    pub fn validate(&self, dimension: usize) -> Result<(), ImproveError> {
        let (value, below) = (self.min_angle, if dimension == 2 { 60.0 } else { 70.5 });
        if (0.0..below).contains(&value) {
            return Ok(());
        }
        let expected = if dimension == 2 { "0 or more, below 60" } else { "0 or more, below 70.5" };
        Err(ImproveError::MinAngle { value, expected })
    }
}

/// Why a mesh could not be improved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImproveError {
    /// The floor is out of range.
    #[error("the least angle is {value} degrees; expected {expected}")]
    MinAngle {
        /// The floor asked for.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// The result is not a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The caller ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What improving a mesh did.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ImproveReport {
    /// Rounds of swaps and moves.
    pub rounds: usize,
    /// Swaps made.
    pub swaps: usize,
    /// Moves made.
    pub moves: usize,
    /// Points taken away.
    pub removed: usize,
    /// Points added.
    pub added: usize,
    /// The least angle before, in degrees.
    pub angle_before: f64,
    /// The least angle after, in degrees.
    pub angle_after: f64,
    /// Cells whose least angle is still below the floor.
    pub below: usize,
    /// Whether every cell keeps the floor.
    pub floor_held: bool,
    /// Whether so many cells stayed below the floor after a round that it was given up.
    pub gave_up: bool,
}

impl ImproveReport {
    /// What was done in all, where a second improvement followed.
    pub(crate) fn and(self, next: Self) -> Self {
        Self {
            rounds: self.rounds + next.rounds,
            swaps: self.swaps + next.swaps,
            moves: self.moves + next.moves,
            removed: self.removed + next.removed,
            added: self.added + next.added,
            angle_before: self.angle_before,
            ..next
        }
    }
}

/// What of a mesh stays.
#[derive(Clone, Copy, Debug)]
pub struct Held<'a, const D: usize> {
    /// Bit k of a point lets it move along axis k.
    pub freedom: &'a [u8],
    /// Facets that stay facets, corners ascending, in lexicographic order; their corners may not move.
    pub facets: &'a [[u32; D]],
    /// Whether each point is one around which the mesh may change; around all, if there is nothing. In the plane, where all
    /// takes little time, it is not asked.
    pub near: Option<&'a [bool]>,
}

/// Improves meshes of one dimension.
pub trait Improver<const D: usize>: Sync {
    /// The mesh with its cells swapped and its points moved, and what was done. Points keep their order, without those taken away; added points follow. The result is the
    /// same at any thread count.
    ///
    /// # Errors
    /// [`ImproveError`] if the floor is out of range or the work was cancelled.
    fn improve(
        &self,
        mesh: Mesh<D>,
        held: Held<'_, D>,
        fields: FieldsView<'_, D>,
        options: &ImproveOptions,
        watch: &mut dyn Watch,
    ) -> Result<(Mesh<D>, ImproveReport), ImproveError>;
}
