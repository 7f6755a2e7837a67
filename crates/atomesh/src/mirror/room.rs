//! Where only the atoms of pairs may be.

use crate::fields::NominalDistance;
use crate::geometry::{Bounds, Point, distance_squared};

use super::bins::Bins;
use super::crests::Crest;
use super::feet::nearest;
use super::pairs::Pairs;

/// An atom must be farther from a crest than the pair's by this factor.
const SLACK: f64 = 1.02;
/// How far from a crest, over d at the atom, that can be: √(0.8² + 0.35²) 1.02 at the crest, whose d may be larger as
/// its slope is at most 1/4.
const REACH: f64 = 1.25;

/// Balls about crests with the nearest atoms of pairs on them, and balls about those atoms.
pub(super) struct Room<'a, const D: usize> {
    distance: &'a NominalDistance<D>,
    /// Atoms of pairs that were not there before.
    sites: &'a [Point<D>],
    site_bins: Bins<D>,
    /// Centres and squared radii.
    balls: Vec<(Point<D>, f64)>,
    ball_bins: Bins<D>,
}

impl<'a, const D: usize> Room<'a, D> {
    /// The room of pairs on crests.
    pub fn new(
        crests: &[Crest<D>],
        pairs: &'a Pairs<D>,
        distance: &'a NominalDistance<D>,
        bounds: &Bounds<D>,
    ) -> Self {
        let of = nearest(crests, &pairs.feet, distance, bounds);
        let ball = |(crest, foot): (&Crest<D>, Option<u32>)| {
            let sites = pairs.of_feet[foot? as usize].map(|site| &pairs.sites[site as usize]);
            let squares = sites.map(|site| distance_squared(site, &crest.position));
            Some((crest.position, SLACK * SLACK * squares[0].min(squares[1])))
        };
        let balls: Vec<_> = crests.iter().zip(of).filter_map(ball).collect();
        let least = distance.least();
        let ball_bins = Bins::of(bounds, least, balls.iter().map(|ball| ball.0));
        let sites = pairs.new_sites();
        let site_bins = Bins::of(bounds, least, sites.iter().copied());
        Self { distance, sites, site_bins, balls, ball_bins }
    }

    /// Whether an atom at `p` leaves every crest to its pair and is `clear` d or more from the atoms of pairs.
    pub fn is_free(&self, p: &Point<D>, clear: f64) -> bool {
        let d = self.distance.at(p);
        let mut free = true;
        self.site_bins.near(p, clear * d, |at| {
            free &= distance_squared(p, &self.sites[at]) >= (clear * d).powi(2);
        });
        self.ball_bins.near(p, REACH * d, |at| {
            let (centre, squared) = &self.balls[at];
            free &= distance_squared(p, centre) >= *squared;
        });
        free
    }
}
