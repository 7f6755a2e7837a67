//! Potential energy of a lattice: image, atomic, and their weighted sum (Hale 2001, section 2.1).
//!
//! P = Σ over pairs (1 − β) φ(r/d) + Σ over atoms β b(x), equation (4); with β(x) a pair weighs
//! 1 − (βᵢ + βⱼ)/2, equation (5). Three ways to the same number: [`direct_energy`], the double sum of
//! equation (1), O(n²), the reference; [`SampledEngine`], Algorithm 1, O(N) in image samples; and
//! [`PairsEngine`], neighbour lists, O(n) in atoms, the default. All leave out the printed sum's
//! i = j, a constant n·153/512 that moves no atom.

#[cfg(feature = "conformance")]
pub mod conformance;
mod engine;
mod kernel;
mod lanes;
mod neighbors;
pub mod pair;
mod pairs;
mod sampled;
mod tree;
#[cfg(test)]
mod tests;

pub use engine::{Energy, Engine, MakeEngine, direct_energy};
pub use pairs::PairsEngine;
pub use sampled::SampledEngine;
pub(crate) use sampled::table_bytes;
