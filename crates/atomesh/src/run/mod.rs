//! A run: from an image to a mesh, stage by stage. The one entry point of every shell.
//!
//! ```text
//! prepare → Prepared → Filled → Settled → Connected → Improved → Outcome
//!                                       ↘ Divided (Voronoi's cells) ↗
//! ```
//!
//! [`prepare()`] makes the potential b(x), the nominal distance d(x) and the weight β(x);
//! [`Prepared::estimate`] says what the rest will take; [`Prepared::run`] takes all other stages at once. Each
//! stage is an owned value: keep it, clone it, send it to another thread, look at its atoms or its mesh, and go on
//! from it as often as you like. A run may also start from your own atoms ([`Prepared::with_atoms`]), from an
//! editor's ([`Prepared::with_settled`]) or from a mesh ([`Prepared::with_mesh`]).
//!
//! All of it works in lattice space; [`Outcome::world_mesh`] places the mesh in the world.
//!
//! ```
//! use atomesh::image::{Frame, Image, Samples};
//! use atomesh::run::{Inputs, MeshOptions, Method, Size, prepare};
//! use atomesh::watch::Silent;
//!
//! let mut grey = vec![200u8; 64 * 48];
//! grey[24 * 64..25 * 64].fill(10); // a dark row
//! let image = Image::new(Frame::new([64, 48])?, Samples::U8(grey.into()))?;
//! let options = MeshOptions { size: Size::Constant(6.0), ..Default::default() };
//! let settled = prepare(&Method::plane(), Inputs::image(&image), options, &mut Silent)?
//!     .fill(&mut Silent)?
//!     .settle(&mut Silent)?;
//! println!("{} atoms", settled.lattice().len());
//! let outcome = settled.connect(&mut Silent)?.improve(&mut Silent)?.finish(&mut Silent)?;
//! assert!(outcome.mesh().validate().is_ok());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod across;
mod compiled;
#[cfg(test)]
mod conform_tests;
mod connected;
mod divided;
mod error;
mod estimate;
mod filled;
mod find;
mod improved;
mod inputs;
mod method;
#[cfg(test)]
mod mirror_tests;
mod options;
mod outcome;
mod prepare;
mod prepared;
mod report;
mod settled;
#[cfg(test)]
mod stage_tests;
#[cfg(test)]
mod tests;
mod tools;

pub use across::AcrossFeature;
pub use connected::Connected;
pub use divided::Divided;
pub use error::{RunError, Warning};
pub use estimate::{Estimate, potential_bytes};
pub use filled::Filled;
pub use improved::Improved;
pub use inputs::Inputs;
pub use method::Method;
pub use options::{LatticeKind, MeshKind, MeshOptions, POINTS_PER_WAVELENGTH, Size};
pub use outcome::{Outcome, lattice_cells, lattice_mesh, sides};
pub use prepared::Prepared;
pub use report::{MeshReport, VoronoiReport};
pub use settled::Settled;
pub use tools::Tools;

use crate::watch::Watch;

/// Makes b(x), d(x) and β(x): the first stage.
///
/// # Errors
/// [`RunError`] if an option is out of range, a field has another shape or bad values, the samples
/// are not finite, or the work was cancelled.
pub fn prepare<const D: usize>(
    method: &Method<D>,
    inputs: Inputs<'_, D>,
    options: MeshOptions<D>,
    watch: &mut dyn Watch,
) -> Result<Prepared<D>, RunError> {
    (method.stages().prepare)(method, inputs, options, watch)
}
