//! Points on the features of an image: where they are, between samples, and how they are turned.
//!
//! A feature is a line in the plane and a sheet in space; a [`FeaturePoint`] is one place on it. They come from
//!
//! - the bottoms of the valleys of b ([`bottoms`]), which facets should follow, and its crests where it repels
//!   ([`repelling_crests`]);
//! - raw images, by the finders of [`crate::enhance`].
//!
//! Points are linked into groups, the small and weak of which are left out ([`linked`], [`in_large_groups`]).
//! Groups become a potential again (`widen`) or evenly spaced sites for atoms (`sites`).

mod groups;
mod pieces;
mod point;
mod repelling;
mod sites;
mod valley;
mod widen;

pub(crate) use groups::strongest_tenth;
pub use groups::{Hysteresis, in_large_groups, linked, strongest};
pub(crate) use pieces::tangents;
pub use pieces::{Cleanness, Foot, Pieces};
pub use point::FeaturePoint;
pub use repelling::repelling_crests;
pub(crate) use sites::{nearest_sites, sites};
pub use valley::{ValleySearch, bottoms};
pub(crate) use widen::widen;
