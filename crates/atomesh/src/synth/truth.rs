//! What a synthetic image shows, exactly.

use super::{Layers, Scene};
use crate::geometry::{Point, difference, distance_squared, dot};
use crate::image::Grid;
use serde::ser::{Serialize, SerializeMap, SerializeStruct, Serializer};

/// What a feature stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Role {
    /// A fault: a dark line or sheet, or a break in layers.
    Fault,
    /// A thin slit: a dark line.
    Slit,
    /// The outline of a disc or the surface of a sphere: an edge.
    Outline,
    /// The boundaries between grains: edges.
    Boundary,
}

/// Where a feature is, in world coordinates.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Geometry<const D: usize> {
    /// The straight segments between successive points.
    Path {
        /// The points, at least one.
        points: Vec<Point<D>>,
    },
    /// A flat disk; in 2-D a segment.
    Disk {
        /// Its centre.
        center: Point<D>,
        /// The unit normal of its plane; in 2-D of its line.
        normal: Point<D>,
        /// Its radius; in 2-D half its length.
        radius: f64,
    },
    /// A sphere's surface; in 2-D a circle.
    Sphere {
        /// Its centre.
        center: Point<D>,
        /// Its radius.
        radius: f64,
    },
    /// The boundaries between the Voronoi cells of points.
    Grains {
        /// The points, at least two and all different.
        centers: Vec<Point<D>>,
    },
}

impl<const D: usize> Geometry<D> {
    /// The exact Euclidean distance from `p` to the nearest point of the feature, which may lie
    /// outside the image.
    pub fn distance(&self, p: &Point<D>) -> f64 {
        match self {
            Self::Path { points } => match points.as_slice() {
                [point] => distance_squared(p, point).sqrt(),
                _ => points
                    .windows(2)
                    .map(|s| segment_distance(p, &s[0], &s[1]))
                    .fold(f64::INFINITY, f64::min),
            },
            Self::Disk { center, normal, radius } => {
                let v = difference(p, center);
                let height = dot(&v, normal);
                let across = (dot(&v, &v) - height * height).max(0.0).sqrt();
                height.hypot((across - radius).max(0.0))
            }
            Self::Sphere { center, radius } => (distance_squared(p, center).sqrt() - radius).abs(),
            Self::Grains { centers } => boundary_distance(p, centers),
        }
    }
}

/// The distance from `p` to the segment from `a` to `b`.
fn segment_distance<const D: usize>(p: &Point<D>, a: &Point<D>, b: &Point<D>) -> f64 {
    let (edge, v) = (difference(b, a), difference(p, a));
    let length_squared = dot(&edge, &edge);
    let t =
        if length_squared > 0.0 { (dot(&v, &edge) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    distance_squared(p, &std::array::from_fn(|k| a[k] + t * edge[k])).sqrt()
}

/// The distance from `p` to the boundary of its Voronoi cell.
///
/// The cell is the intersection of half-spaces, one for each other centre, so the nearest of their
/// planes holds the nearest boundary point.
fn boundary_distance<const D: usize>(p: &Point<D>, centers: &[Point<D>]) -> f64 {
    let Some(own) =
        centers.iter().min_by(|a, b| distance_squared(p, a).total_cmp(&distance_squared(p, b)))
    else {
        return f64::INFINITY;
    };
    let nearest = distance_squared(p, own);
    let mut least = f64::INFINITY;
    for other in centers {
        let apart = distance_squared(own, other).sqrt();
        if apart > 0.0 {
            least = least.min((distance_squared(p, other) - nearest) / (2.0 * apart));
        }
    }
    least
}

/// One feature of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueFeature<const D: usize> {
    /// What it stands for.
    pub role: Role,
    /// Where it is.
    pub geometry: Geometry<D>,
}

/// The features of a synthetic image, in world coordinates.
///
/// Serialised, it is the description that is written beside the image.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth<const D: usize> {
    /// What was drawn.
    pub scene: Scene,
    /// From which seed.
    pub seed: u64,
    /// The image's samples; sample 0 is at the world's origin.
    pub grid: Grid<D>,
    /// What the image shows, at least one feature.
    pub features: Vec<TrueFeature<D>>,
    /// The layers that were drawn or that the faults cut, in scenes that have them.
    pub layers: Option<Layers<D>>,
}

impl<const D: usize> Truth<D> {
    /// The distance from a point of the world to the nearest feature.
    pub fn distance(&self, p: &Point<D>) -> f64 {
        self.features.iter().map(|f| f.geometry.distance(p)).fold(f64::INFINITY, f64::min)
    }
}

/// Points as lists of numbers; serde cannot derive this for arrays of any length.
pub(super) struct Rows<'a, const D: usize>(pub &'a [Point<D>]);

impl<const D: usize> Serialize for Rows<'_, D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|p| p.as_slice()))
    }
}

impl<const D: usize> Serialize for TrueFeature<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("role", &self.role)?;
        match &self.geometry {
            Geometry::Path { points } => {
                map.serialize_entry("kind", "path")?;
                map.serialize_entry("points", &Rows(points))?;
            }
            Geometry::Disk { center, normal, radius } => {
                map.serialize_entry("kind", "disk")?;
                map.serialize_entry("center", center.as_slice())?;
                map.serialize_entry("normal", normal.as_slice())?;
                map.serialize_entry("radius", radius)?;
            }
            Geometry::Sphere { center, radius } => {
                map.serialize_entry("kind", "sphere")?;
                map.serialize_entry("center", center.as_slice())?;
                map.serialize_entry("radius", radius)?;
            }
            Geometry::Grains { centers } => {
                map.serialize_entry("kind", "grains")?;
                map.serialize_entry("centers", &Rows(centers))?;
            }
        }
        map.end()
    }
}

impl<const D: usize> Serialize for Truth<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut out = serializer.serialize_struct("Truth", 6)?;
        out.serialize_field("scene", &self.scene)?;
        out.serialize_field("seed", &self.seed)?;
        out.serialize_field("shape", self.grid.shape.as_slice())?;
        out.serialize_field("spacing", self.grid.step.as_slice())?;
        out.serialize_field("features", &self.features)?;
        out.serialize_field("layers", &self.layers)?;
        out.end()
    }
}
