//! Where only the atoms of pairs may be.

use crate::crests::{FeaturePoint, nearest_sites};
use crate::fields::NominalDistance;
use crate::geometry::{Bins, Bounds, Point, distance_squared};

use super::pairs::Pairs;

/// The least distance of another atom from a point on a feature, over that of the pair's atoms.
const SLACK: f64 = 1.02;
/// The greatest of these distances, over d at the atom: √(0.8² + 0.35²) 1.02 at the point, whose d may be larger, as its
/// slope is at most 1/4.
const REACH: f64 = 1.25;

/// Balls about points on features, as large as the nearest pair's atoms are far, and balls about these atoms.
pub(super) struct Exclusion<'a, const D: usize> {
    distance: &'a NominalDistance<D>,
    /// Atoms of pairs that the lattice did not have before.
    atoms: &'a [Point<D>],
    atom_bins: Bins<D>,
    balls: Vec<Ball<D>>,
    ball_bins: Bins<D>,
}

/// A ball.
struct Ball<const D: usize> {
    centre: Point<D>,
    radius_squared: f64,
}

impl<'a, const D: usize> Exclusion<'a, D> {
    /// What the pairs at sites on the features of `crests` exclude.
    pub fn new(
        crests: &[FeaturePoint<D>],
        pairs: &'a Pairs<D>,
        distance: &'a NominalDistance<D>,
        bounds: &Bounds<D>,
    ) -> Self {
        let ball = |crest: &FeaturePoint<D>, site: Option<u32>| {
            let atoms = pairs.of_sites[site? as usize].map(|atom| &pairs.atoms[atom as usize]);
            let squares = atoms.map(|atom| distance_squared(atom, &crest.position));
            let radius_squared = SLACK * SLACK * squares[0].min(squares[1]);
            Some(Ball { centre: crest.position, radius_squared })
        };
        let nearest = nearest_sites(crests, &pairs.sites, distance, bounds);
        let balls = crests.iter().zip(nearest).filter_map(|(crest, site)| ball(crest, site));
        let balls: Vec<Ball<D>> = balls.collect();
        let least = distance.least();
        let ball_bins = Bins::of(bounds, least, balls.iter().map(|ball| ball.centre));
        let atoms = pairs.new_atoms();
        let atom_bins = Bins::of(bounds, least, atoms.iter().copied());
        Self { distance, atoms, atom_bins, balls, ball_bins }
    }

    /// Whether an atom at `p` leaves every point of features to its pair, and is `clear` d or more from atoms of pairs.
    pub fn allows(&self, p: &Point<D>, clear: f64) -> bool {
        let d = self.distance.at(p);
        let mut allowed = true;
        self.atom_bins.near(p, clear * d, |at| {
            allowed &= distance_squared(p, &self.atoms[at]) >= (clear * d).powi(2);
        });
        self.ball_bins.near(p, REACH * d, |at| {
            let ball = &self.balls[at];
            allowed &= distance_squared(p, &ball.centre) >= ball.radius_squared;
        });
        allowed
    }
}
