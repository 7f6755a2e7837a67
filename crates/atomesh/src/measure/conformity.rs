//! How a mesh keeps to the features that it was made to keep to.
//!
//! Alignment asks what an image's valleys say of any mesh, and picks facets by a threshold. Here the facets of each
//! feature are known, and so is the feature: a piece of crest between samples ([`Pieces`]). So what is asked is how far
//! the facets are from their own crest, which places on it have no facet, and which cells it still cuts.

use crate::parallel::prelude::*;

use super::statistics::{sum, sums};
use crate::conform::{FeatureFacet, Unmet, cut_cells, unmet};
use crate::crests::Pieces;
use crate::fields::NominalDistance;
use crate::geometry::{Point, difference, distance_squared, dot};
use crate::mesh::{Mesh, area_vector, feature_name};
use crate::watch::{Cancelled, Phase, Watch, check};

/// A facet whose middle is within this of its piece is on it, in samples.
const TOLERANCE: f64 = 1.0;
/// The most places not met that are listed.
const MOST_PLACES: usize = 12;
/// Listed places of one feature are farther apart than this, over d.
const APART: f64 = 2.0;
/// Features nearer to each other than this, over d, cannot both have atoms.
const BOTH: f64 = 2.0 / 3.0;
/// Features run beside each other if the cosine between their normals is at least this.
const BESIDE: f64 = 0.7;
/// How far from its piece a facet is looked for, over d, and in mean steps.
const REACH: f64 = 1.0;
const REACH_STEPS: f64 = 3.0;
/// The length (2-D) or area (3-D) of a piece in a cube about one of its places, over the cube's width or its square, for
/// pieces turned at random: π/4 and 2/3.
const IN_CUBE: [f64; 2] = [std::f64::consts::FRAC_PI_4, 2.0 / 3.0];

/// A feature and how its facets keep to it.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct FeatureConformity {
    /// The name of its facets among the mesh's tags, `feature-1` for the largest; `None` if it has no facet.
    pub name: Option<String>,
    /// What kind of features was asked for, such as `edges`.
    pub kind: String,
    /// Its mean strength: that of a full feature is 1.
    pub strength: f64,
    /// How many facets it has.
    pub facets: usize,
    /// Their length (2-D) or area (3-D), in world units.
    pub measure: f64,
    /// The length or area that has no facet, in world units; an estimate, as each place that the feature is known at
    /// stands for an equal share of it.
    pub not_met: f64,
    /// The share of the feature that has no facet, 0…1.
    pub not_met_share: f64,
    /// How far its facets are from it.
    #[serde(flatten)]
    pub distance: CrestDistance,
}

/// How far facets are from the crests of their own features; `None` without facets.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct CrestDistance {
    /// The root of the mean square, in samples.
    pub rms: Option<f64>,
    /// The 95th percentile, in samples.
    pub p95: Option<f64>,
    /// The root of the mean square, in world units.
    pub rms_world: Option<f64>,
    /// The 95th percentile, in world units.
    pub p95_world: Option<f64>,
}

/// A place on a feature that has no facet of the feature near.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct NotMetPlace {
    /// The feature's number in the list of features, from 1.
    pub feature: usize,
    /// The place, in world coordinates.
    pub place: Vec<f64>,
    /// Where another feature runs beside this one, nearer than two thirds of d: the d that would do for both, in
    /// lattice units.
    pub distance_needed: Option<f64>,
}

/// How a mesh keeps to all features.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ConformityReport {
    /// The share of the facets of features, by length or area, whose middle is within `tolerance` of its own feature;
    /// `None` without facets.
    pub precision: Option<f64>,
    /// That distance, in samples: 1.
    pub tolerance: f64,
    /// How far all facets are from their features.
    #[serde(flatten)]
    pub distance: CrestDistance,
    /// The length or area of all facets of features, in world units.
    pub measure: f64,
    /// The length or area of features that has no facet, in world units: an estimate.
    pub not_met: f64,
    /// Its share of all features, 0…1.
    pub not_met_share: f64,
    /// Places without a facet, those of the largest features first, some d apart; 12 at most.
    pub not_met_places: Vec<NotMetPlace>,
    /// Cells that a feature passes through: they have corners farther than 0.1 sample on both sides of it.
    pub cells_cut: usize,
}

/// What is measured of each feature and of all.
#[derive(Clone, Debug, PartialEq)]
pub struct Conformity {
    /// The features, those with facets first, in the order of their tags, then the others, the strongest first.
    pub features: Vec<FeatureConformity>,
    /// What holds for all of them.
    pub all: ConformityReport,
}

/// A mesh in lattice coordinates with the facets of its features.
pub struct Conforming<'a, const D: usize> {
    /// The mesh.
    pub mesh: &'a Mesh<D>,
    /// The facets.
    pub facets: &'a [FeatureFacet<D>],
    /// The features.
    pub pieces: &'a Pieces<D>,
    /// The pieces that have tags, in the order of the tags.
    pub tagged: &'a [u32],
    /// What kind of features was asked for.
    pub kind: &'a str,
    /// d(x).
    pub distance: &'a NominalDistance<D>,
    /// The step of samples, in lattice units.
    pub step: [f64; D],
    /// From lattice to world coordinates.
    pub to_world: &'a (dyn Fn(&Point<D>) -> Point<D> + Sync),
}

/// Measures how the facets of features keep to them. The same at any thread count. Cost: O(points + facets), some
/// microseconds for each that is near a feature.
///
/// # Errors
/// [`Cancelled`] if the watch ends the work.
pub fn conformity<const D: usize>(
    conforming: &Conforming<'_, D>,
    watch: &mut dyn Watch,
) -> Result<Conformity, Cancelled> {
    let &Conforming { mesh, facets, pieces, distance, .. } = conforming;
    check(watch, Phase::Measure, 0.0, None)?;
    let placed = facets.par_iter().with_min_len(1 << 6).map(|facet| conforming.placed(facet));
    let placed: Vec<PlacedFacet> = placed.collect();
    check(watch, Phase::Measure, 0.4, None)?;
    let unmet = unmet(mesh, facets, pieces, distance);
    let order = conforming.order();
    let counts = Counts::new(conforming, &placed, &unmet);
    let features = order.iter().enumerate();
    let features: Vec<FeatureConformity> =
        features.map(|(at, &piece)| conforming.feature(at, piece, &placed, &counts)).collect();
    check(watch, Phase::Measure, 0.7, None)?;
    let cells_cut = cut_cells(mesh, pieces, distance).len();
    let measure = sum(0..placed.len(), &|i| placed[i].measure);
    let on = |i: usize| if placed[i].middle <= TOLERANCE { placed[i].measure } else { 0.0 };
    let all = ConformityReport {
        precision: (measure > 0.0).then(|| sum(0..placed.len(), &on) / measure),
        tolerance: TOLERANCE,
        distance: CrestDistance::of(placed.iter()),
        measure,
        not_met: features.iter().map(|feature| feature.not_met).sum(),
        not_met_share: unmet.share,
        not_met_places: conforming.listed(&unmet, &order),
        cells_cut,
    };
    Ok(Conformity { features, all })
}

/// A facet of a feature and how far it is from it.
struct PlacedFacet {
    piece: u32,
    /// Its length or area, in world units.
    measure: f64,
    /// How far its middle is, in samples.
    middle: f64,
    /// How far points on it are, each of which stands for a share of it: in samples, in world units, and the share.
    points: [(f64, f64, f64); 3],
}

impl CrestDistance {
    /// The distances of facets by the points on them.
    fn of<'a>(facets: impl Iterator<Item = &'a PlacedFacet>) -> Self {
        let weighted = |facet: &'a PlacedFacet| {
            facet
                .points
                .iter()
                .map(|&(samples, world, share)| [samples, world, share * facet.measure])
        };
        let points: Vec<[f64; 3]> = facets.flat_map(weighted).collect();
        let [squares, squares_world, total] = sums(0..points.len(), &|i| {
            let [samples, world, weight] = points[i];
            [weight * samples * samples, weight * world * world, weight]
        });
        if total <= 0.0 || total.is_nan() {
            return Self::default();
        }
        let p95 = |which: usize| {
            let of = |point: &[f64; 3]| (point[which], point[2]);
            weighted_percentile(points.iter().map(of).collect(), 0.95 * total)
        };
        Self {
            rms: Some((squares / total).sqrt()),
            p95: Some(p95(0)),
            rms_world: Some((squares_world / total).sqrt()),
            p95_world: Some(p95(1)),
        }
    }
}

/// The least value such that those up to it weigh at least `weight`.
fn weighted_percentile(mut values: Vec<(f64, f64)>, weight: f64) -> f64 {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut below = 0.0;
    let found = values.iter().find(|(_, own)| {
        below += own;
        below >= weight
    });
    found.or(values.last()).map_or(0.0, |(value, _)| *value)
}

/// Points on a facet by the shares of its corners, and the share of the facet that each stands for: Gauss's on an edge,
/// exact for degree 5; on a triangle exact for degree 2.
fn points_on<const D: usize>() -> [([f64; D], f64); 3] {
    if D == 2 {
        let off = 0.5 * 0.6f64.sqrt();
        let at = |x: f64| std::array::from_fn(|k| if k == 0 { 1.0 - x } else { x });
        return [(at(0.5 - off), 5.0 / 18.0), (at(0.5), 8.0 / 18.0), (at(0.5 + off), 5.0 / 18.0)];
    }
    let at =
        |corner: usize| std::array::from_fn(|k| if k == corner { 2.0 / 3.0 } else { 1.0 / 6.0 });
    [(at(0), 1.0 / 3.0), (at(1), 1.0 / 3.0), (at(2), 1.0 / 3.0)]
}

/// How much there is of each piece, and how much of that has no facet.
struct Counts {
    /// The places of each piece.
    places: Vec<usize>,
    /// Those that are not met.
    unmet: Vec<usize>,
    /// The length or area for which a place stands, in world units.
    each: f64,
}

impl Counts {
    fn new<const D: usize>(
        conforming: &Conforming<'_, D>,
        placed: &[PlacedFacet],
        unmet: &Unmet<D>,
    ) -> Self {
        let pieces = conforming.pieces;
        let count = |of: &mut dyn Iterator<Item = u32>| {
            let mut counts = vec![0; pieces.len()];
            of.for_each(|piece| counts[piece as usize] += 1);
            counts
        };
        let places = count(&mut pieces.places().map(|(_, piece)| piece));
        let met = pieces.places().len() - unmet.places.len();
        let measure = sum(0..placed.len(), &|i| placed[i].measure);
        // a feature with few facets is met a little beyond them
        let each = match met >= unmet.places.len() && measure > 0.0 {
            true => measure / met as f64,
            false => conforming.turned_at_random(),
        };
        Self { places, unmet: count(&mut unmet.of_places.iter().copied()), each }
    }
}

impl<const D: usize> Conforming<'_, D> {
    /// The length or area in world units for which a place stands if pieces are turned at random.
    fn turned_at_random(&self) -> f64 {
        let mut corner = [0.0; D];
        let origin = (self.to_world)(&corner);
        corner[0] = self.pieces.width();
        let width = distance_squared(&(self.to_world)(&corner), &origin).sqrt();
        IN_CUBE[D - 2] * width.powi(D as i32 - 1)
    }

    /// A facet and how far it is from its piece.
    fn placed(&self, facet: &FeatureFacet<D>) -> PlacedFacet {
        let corners = facet.corners.map(|corner| self.mesh.points()[corner as usize]);
        let at = |shares: &[f64; D]| -> Point<D> {
            std::array::from_fn(|k| (0..D).map(|c| shares[c] * corners[c][k]).sum())
        };
        let area = area_vector(&corners.map(|corner| (self.to_world)(&corner)));
        let points = points_on::<D>().map(|(shares, share)| {
            let (samples, world) = self.distance(facet.piece, &at(&shares));
            (samples, world, share)
        });
        PlacedFacet {
            piece: facet.piece,
            measure: dot(&area, &area).sqrt(),
            middle: self.distance(facet.piece, &at(&[1.0 / D as f64; D])).0,
            points,
        }
    }

    /// How far a place is from a piece, in samples and in world units; infinite where the piece is not near.
    fn distance(&self, piece: u32, place: &Point<D>) -> (f64, f64) {
        let reach = REACH * self.distance.at(place) + REACH_STEPS * self.pieces.step();
        let Some(foot) = self.pieces.foot_on(piece, place, reach) else {
            return (f64::INFINITY, f64::INFINITY);
        };
        let off = difference(place, &foot.position);
        let samples: f64 = (0..D).map(|k| (off[k] / self.step[k]).powi(2)).sum();
        let [from, to] = [place, &foot.position].map(|p| (self.to_world)(p));
        (samples.sqrt(), distance_squared(&from, &to).sqrt())
    }

    /// All pieces: those with tags in the order of these, then the others.
    fn order(&self) -> Vec<u32> {
        let mut order = self.tagged.to_vec();
        let is_tagged = |piece: &u32| self.tagged.contains(piece);
        order.extend((0..self.pieces.len() as u32).filter(|piece| !is_tagged(piece)));
        order
    }

    /// A feature, the one of number `at` in the list.
    fn feature(
        &self,
        at: usize,
        piece: u32,
        placed: &[PlacedFacet],
        counts: &Counts,
    ) -> FeatureConformity {
        let own = || placed.iter().filter(move |facet| facet.piece == piece);
        let (places, unmet) = (counts.places[piece as usize], counts.unmet[piece as usize]);
        FeatureConformity {
            name: (at < self.tagged.len()).then(|| feature_name(at as u32 + 1)),
            kind: self.kind.to_string(),
            strength: self.pieces.strength(piece),
            facets: own().count(),
            measure: own().fold(0.0, |sum, facet| sum + facet.measure),
            not_met: unmet as f64 * counts.each,
            not_met_share: unmet as f64 / places.max(1) as f64,
            distance: CrestDistance::of(own()),
        }
    }

    /// The places that are listed of those not met.
    fn listed(&self, unmet: &Unmet<D>, order: &[u32]) -> Vec<NotMetPlace> {
        let mut listed: Vec<(usize, Point<D>)> = Vec::new();
        for (at, &piece) in order.iter().enumerate() {
            let of_piece = unmet.places.iter().zip(&unmet.of_places);
            for (place, _) in of_piece.filter(|(_, own)| **own == piece) {
                let apart = APART * self.distance.at(place);
                let is_apart = |(other, there): &(usize, Point<D>)| {
                    *other != at || distance_squared(there, place) >= apart * apart
                };
                if listed.len() == MOST_PLACES {
                    break;
                }
                if listed.iter().all(is_apart) {
                    listed.push((at, *place));
                }
            }
        }
        let place = |(at, place): (usize, Point<D>)| NotMetPlace {
            feature: at + 1,
            place: (self.to_world)(&place).to_vec(),
            distance_needed: self.distance_needed(order[at], &place),
        };
        listed.into_iter().map(place).collect()
    }

    /// The d that would do for a piece at a place on it and for another beside it, if one is nearer than two thirds
    /// of d.
    fn distance_needed(&self, piece: u32, place: &Point<D>) -> Option<f64> {
        let (d, step) = (self.distance.at(place), self.pieces.step());
        let normal = self.pieces.foot_on(piece, place, REACH_STEPS * step)?.normal;
        let beside = |other: u32| {
            let foot = self.pieces.foot_on(other, place, BOTH * d + REACH_STEPS * step)?;
            let away = foot.signed_distance(place).abs();
            let is_beside = foot.beyond == 0.0 && dot(&foot.normal, &normal).abs() >= BESIDE;
            (is_beside && away < BOTH * d && away > 0.0).then_some(away)
        };
        let near = self.pieces.near(place, BOTH * d).into_iter().filter(|&other| other != piece);
        let nearest = near.filter_map(beside).fold(f64::INFINITY, f64::min);
        nearest.is_finite().then_some(nearest / BOTH)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_go_by_weight() {
        let values = || vec![(3.0, 1.0), (1.0, 8.0), (2.0, 1.0)];
        for (weight, expected) in [(7.9, 1.0), (8.0, 1.0), (8.1, 2.0), (9.5, 3.0), (10.1, 3.0)] {
            assert_eq!(weighted_percentile(values(), weight), expected, "{weight}");
        }
    }

    #[test]
    fn points_on_a_facet_integrate_squares_exactly() {
        // ∫ x² over an edge from 0 to 1, and over the triangle (0, 0), (1, 0), (0, 1) over its area: 2 · 1/12
        let mean = |points: &[(f64, f64)]| points.iter().map(|(x, w)| w * x * x).sum::<f64>();
        let edge = points_on::<2>().map(|(shares, weight)| (shares[1], weight));
        assert!((mean(&edge) - 1.0 / 3.0).abs() < 1e-15);
        let triangle = points_on::<3>().map(|(shares, weight)| (shares[1], weight));
        assert!((mean(&triangle) - 1.0 / 6.0).abs() < 1e-15);
    }
}
