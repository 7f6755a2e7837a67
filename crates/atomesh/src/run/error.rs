//! What can go wrong, and what is odd enough to say.

use crate::conform::ConformError;
use crate::enhance::EnhanceError;
use crate::features::FeaturesError;
use crate::fields::DistanceError;
use crate::fields::FieldError;
use crate::improve::ImproveError;
use crate::lattice::LatticeError;
use crate::measure::MeasureError;
use crate::mesh::ConnectError;
use crate::mirror::MirrorError;
use crate::optimize::OptimizeError;
use crate::region::{RegionError, ThinLayer};
use crate::sample::SampleError;
use crate::voronoi::VoronoiError;
use crate::watch::Cancelled;

use super::options::LatticeKind;

/// Why there is no mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The image has one sample along an axis.
    #[error("the image has 1 sample along {}; a mesh needs 2 or more along every axis", ["x", "y", "z"][*axis])]
    Thin {
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
    },
    /// The samples are so far from 0 that coordinates cannot tell them apart well.
    #[error(
        "the samples lie as far as {value:e} along {}, where numbers are {:.1e} apart; expected a millionth of the \
         spacing, {spacing}, or less", ["x", "y", "z"][*axis], value.abs() * f64::EPSILON
    )]
    Frame {
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
        /// The greatest coordinate.
        value: f64,
        /// World units from one sample to the next.
        spacing: f64,
    },
    /// A lattice of another dimension.
    #[error("lattice {} does not exist in {dimension}-D; choose {}", .kind.name(), if *.dimension == 2 { "hexagonal or random" } else { "bcc, fcc or random" })]
    LatticeDimension {
        /// The lattice asked for.
        kind: LatticeKind,
        /// The image's dimension.
        dimension: usize,
    },
    /// A field of another shape than the image's.
    #[error("the {name} has the shape {found:?}; the image has {expected:?} (x first)")]
    Shape {
        /// Which field.
        name: &'static str,
        /// The image's shape.
        expected: Vec<usize>,
        /// The field's shape.
        found: Vec<usize>,
    },
    /// Atoms or a mesh of another box than the image's.
    #[error("the box is {found}; the image's is {expected}, in lattice units")]
    OtherBox {
        /// The image's box.
        expected: String,
        /// The box found.
        found: String,
    },
    /// The work would not fit in memory.
    #[error(
        "about {} of memory needed, {} available; a nominal distance above {least}, --crop, or a \
         coarser image would need less",
        bytes(*.needed), bytes(*.available)
    )]
    Memory {
        /// Bytes expected.
        needed: u64,
        /// Bytes allowed.
        available: u64,
        /// The least nominal distance of the run.
        least: f64,
    },
    /// Features could not be looked for in memory.
    #[error(
        "about {} of memory needed to find features, {} available; --crop or a coarser image would need less",
        bytes(*.needed), bytes(*.available)
    )]
    FeatureMemory {
        /// Bytes expected.
        needed: u64,
        /// Bytes allowed.
        available: u64,
    },
    /// Velocities that carry no waves, with no least length to take there.
    #[error(
        "{count} of {all} velocities are 0 or less, or no numbers, first at sample {index}: {value}; expected values above 0, \
         or a least edge length, which is taken where no waves travel (shear waves in water)"
    )]
    NoVelocity {
        /// How many.
        count: usize,
        /// How many samples there are.
        all: usize,
        /// The first of them, x fastest.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A spacing factor so small that a graded lattice would be another than asked for.
    #[error(
        "with the spacing factor {factor}, edges of a lattice that varies would be about {share:.2} of the nominal \
         distance; expected a factor of {:.2} or more, or a smaller distance", (100.0 * least).ceil() / 100.0
    )]
    Crowded {
        /// The spacing factor γ.
        factor: f64,
        /// The length of edges over d.
        share: f64,
        /// The least factor taken.
        least: f64,
    },
    /// The potential could not be made.
    #[error(transparent)]
    Enhance(#[from] EnhanceError),
    /// The potential or the weight is out of range.
    #[error(transparent)]
    Potential(#[from] FieldError),
    /// The nominal distance is out of range.
    #[error(transparent)]
    Distance(#[from] DistanceError),
    /// The lattice could not be made.
    #[error(transparent)]
    Lattice(LatticeError),
    /// The atoms could not be moved.
    #[error(transparent)]
    Optimize(OptimizeError),
    /// The atoms could not be connected.
    #[error(transparent)]
    Connect(ConnectError),
    /// A mask or labels are of no use.
    #[error(transparent)]
    Region(RegionError),
    /// The labels could not be sampled in cells.
    #[error(transparent)]
    Sample(SampleError),
    /// The mesh could not be improved.
    #[error(transparent)]
    Improve(ImproveError),
    /// Features could not be found among its facets.
    #[error(transparent)]
    Features(FeaturesError),
    /// The Voronoi cells could not be made.
    #[error(transparent)]
    Voronoi(VoronoiError),
    /// Cells without volume, to the precision of numbers.
    #[error(
        "{count} of {all} cells have no {} to the precision of numbers, the first near {place}; a lower image weight \
         (--beta), another size or seed may avoid it", if *.dimension == 2 { "area" } else { "volume" }
    )]
    Flat {
        /// How many cells.
        count: usize,
        /// The number of all cells.
        all: usize,
        /// The middle of the first, in world coordinates.
        place: String,
        /// The image's dimension.
        dimension: usize,
    },
    /// The mesh could not be measured.
    #[error(transparent)]
    Measure(MeasureError),
    /// The caller ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl RunError {
    /// Whether the caller ended the work, in whichever phase.
    pub fn is_cancelled(&self) -> bool {
        matches!(
            self,
            Self::Cancelled(_)
                | Self::Enhance(EnhanceError::Cancelled(_))
                | Self::Lattice(LatticeError::Cancelled(_))
                | Self::Optimize(OptimizeError::Cancelled(_))
                | Self::Connect(ConnectError::Cancelled(_))
                | Self::Region(RegionError::Cancelled(_))
                | Self::Sample(SampleError::Cancelled(_))
                | Self::Improve(ImproveError::Cancelled(_))
                | Self::Features(FeaturesError::Cancelled(_))
                | Self::Voronoi(VoronoiError::Cancelled(_))
                | Self::Measure(MeasureError::Cancelled(_))
        )
    }
}

macro_rules! from {
    ($($error:ident => $variant:ident),*) => {
        $(impl From<$error> for RunError {
            fn from(error: $error) -> Self {
                Self::$variant(error)
            }
        })*
    };
}
from!(LatticeError => Lattice, OptimizeError => Optimize, ConnectError => Connect, RegionError => Region, SampleError => Sample, ImproveError => Improve, FeaturesError => Features, VoronoiError => Voronoi, MeasureError => Measure);

impl From<ConformError> for RunError {
    fn from(error: ConformError) -> Self {
        match error {
            ConformError::Lattice(error) => Self::Lattice(error),
            ConformError::Optimize(error) => Self::Optimize(error),
            ConformError::Cancelled(cancelled) => Self::Cancelled(cancelled),
        }
    }
}

impl From<MirrorError> for RunError {
    fn from(error: MirrorError) -> Self {
        match error {
            MirrorError::Lattice(error) => Self::Lattice(error),
            MirrorError::Optimize(error) => Self::Optimize(error),
            MirrorError::Cancelled(cancelled) => Self::Cancelled(cancelled),
        }
    }
}

/// What is odd but no error.
#[derive(Clone, Debug, PartialEq, serde::Serialize, thiserror::Error)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Warning {
    /// The image has no features of the kind asked for.
    #[error("the image has no features of this kind: the mesh is regular")]
    Constant,
    /// Facets were to conform to features, and do not.
    #[error("atoms do not conform to features: {why}")]
    NotConforming {
        /// What stands in the way.
        why: &'static str,
    },
    /// Facets are turned onto features, but no atoms put on them, where nobody asked for either.
    #[error("facets are turned onto features, no atoms put on them: {why}")]
    TurnedOnly {
        /// What stands in the way.
        why: String,
    },
    /// Some of the features are not met by facets of their own.
    #[error("{:.0} % of the features are not met, where they cross, end, or are nearer to each other than about two thirds of an edge, first near {place}: shorter edges meet more", 100.0 * share)]
    NotMet {
        /// The share of all features' length, in space of their area.
        share: f64,
        /// A place on the strongest of them, in world coordinates.
        place: String,
    },
    /// Velocities that carry no waves.
    #[error(
        "{count} of {all} velocities are 0 or less, where no waves travel (shear waves in water): the least edge length, {least}, is taken there"
    )]
    NoVelocity {
        /// How many.
        count: usize,
        /// How many samples there are.
        all: usize,
        /// The length taken.
        least: f64,
    },
    /// A small spacing factor, with which a graded lattice is denser than asked for.
    #[error(
        "with the spacing factor {factor}, atoms of a lattice that varies stand wherever others leave room: edges are about {share:.2} of the nominal distance"
    )]
    Crowded {
        /// The spacing factor γ.
        factor: f64,
        /// The length of edges over d.
        share: f64,
    },
    /// Cells below the floor of angles that could not be raised.
    #[error(
        "{count} of {all} cells stay below the least angle of {floor} degrees, the flattest with {least:.1} near {place}: seed points near each other or near sides, a thin box or a high --min-angle leave no room"
    )]
    BelowFloor {
        /// The cells below it.
        count: usize,
        /// All cells.
        all: usize,
        /// The floor, in degrees.
        floor: f64,
        /// The least angle, in degrees.
        least: f64,
        /// The middle of the cell that has it, in world coordinates.
        place: String,
    },
    /// Labels of the image that no cell has.
    #[error("no cell has {} of the label image: the regions are too small for edges this long, or joined others as islands", few(labels.iter().map(|label| format!("label {label}"))))]
    LabelsLost {
        /// The labels, ascending.
        labels: Vec<i32>,
    },
    /// Layers of labels that come out broken or smaller than they are.
    #[error("layers of labels come out broken or smaller, since edges are longer than they are thick: {}; a nominal distance of at most the thickness keeps a layer whole", few(layers.iter().map(layer)))]
    ThinLayers {
        /// The layers, by ascending labels.
        layers: Vec<ThinLayer>,
    },
    /// d is larger than the box.
    #[error("the nominal distance {distance} exceeds the box, {extent} along {}: the mesh is as coarse as can be", ["x", "y", "z"][*axis])]
    Coarse {
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
        /// The least nominal distance.
        distance: f64,
        /// The box along the axis.
        extent: f64,
    },
}

impl Warning {
    /// Whether this is a choice made for the user, not something amiss.
    pub fn is_note(&self) -> bool {
        matches!(self, Self::TurnedOnly { .. } | Self::NoVelocity { .. })
    }
}

/// The most things that a warning names.
const MOST_NAMED: usize = 4;

/// The first of some things, and how many more there are.
fn few(things: impl ExactSizeIterator<Item = String>) -> String {
    let more = things.len().saturating_sub(MOST_NAMED);
    let named = things.take(MOST_NAMED).collect::<Vec<_>>().join(", ");
    if more == 0 { named } else { format!("{named} and {more} more") }
}

/// A layer in words, its thickness with as many digits as people care for.
fn layer(layer: &ThinLayer) -> String {
    let thickness = format!("{:.3}", layer.thickness);
    let thickness = thickness.trim_end_matches('0').trim_end_matches('.');
    format!("label {}, {thickness} thick", layer.label)
}

/// A number of bytes for people.
fn bytes(count: u64) -> String {
    let mib = count as f64 / (1 << 20) as f64;
    if mib < 1024.0 { format!("{mib:.0} MiB") } else { format!("{:.1} GiB", mib / 1024.0) }
}
