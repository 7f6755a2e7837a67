//! Pairs of atoms, mirror images of each other in a feature.

use crate::fields::NominalDistance;
use crate::geometry::{Bounds, Point, difference, distance_squared, dot};
use crate::lattice::Lattice;

use super::bins::Bins;
use super::feet::Foot;
use super::{APART, is_held};

/// How far from its foot an atom is, over d; beside the box's sides it may be nearer. On the paper's figure 1 recall
/// is the same from 0.3 to 0.4; on a volume of faults (d = 8) it is 0.90, 0.91 and 0.92 with 0.45, 0.4 and 0.35,
/// before atoms are shared.
const HALF: f64 = 0.35;

/// Feet that have a pair of atoms.
pub(super) struct Pairs<const D: usize> {
    /// Atoms that stay where they are: given ones first.
    pub sites: Vec<Point<D>>,
    given: usize,
    /// The feet.
    pub feet: Vec<Foot<D>>,
    /// The two sites of each foot.
    pub of_feet: Vec<[u32; 2]>,
    /// How many feet share a site with another.
    pub shared: usize,
}

impl<const D: usize> Pairs<D> {
    /// Pairs at as many of the feet as have room, the first ones first.
    pub fn new(feet: &[Foot<D>], lattice: &Lattice<D>, distance: &NominalDistance<D>) -> Self {
        let bounds = *lattice.bounds();
        let held = (0..lattice.len()).filter(|&i| is_held(lattice, i));
        let sites: Vec<Point<D>> = held.map(|i| lattice.atoms()[i]).collect();
        let given = sites.len();
        let mut bins = Bins::new(&bounds, distance.least(), given + 2 * feet.len());
        sites.iter().for_each(|site| bins.push(site));
        let mut pairs = Self { sites, given, feet: Vec::new(), of_feet: Vec::new(), shared: 0 };
        for foot in feet {
            let d = distance.at(&foot.position);
            let Some(places) = both_sides(foot, d, &bounds) else { continue };
            let near = |p: &Point<D>, sites: &[Point<D>]| nearest(&bins, sites, p, APART * d);
            let taken = places.map(|place| near(&place, &pairs.sites));
            let next = pairs.sites.len() as u32;
            let (of_foot, added): ([u32; 2], Vec<Point<D>>) = match taken {
                [None, None] => ([next, next + 1], places.to_vec()),
                [Some(a), Some(b)] if a != b => ([a, b], Vec::new()),
                [Some(_), Some(_)] => continue,
                [Some(site), None] | [None, Some(site)] => {
                    let image = mirrored(&pairs.sites[site as usize], foot);
                    // a site on the feature itself has its image on top of it
                    if !bounds.contains(&image) || near(&image, &pairs.sites).is_some() {
                        continue;
                    }
                    ([site, next], vec![image])
                }
            };
            pairs.shared += usize::from(added.len() < 2);
            added.iter().for_each(|site| bins.push(site));
            pairs.sites.extend(added);
            pairs.feet.push(*foot);
            pairs.of_feet.push(of_foot);
        }
        pairs
    }

    /// The sites that the lattice did not have.
    pub fn new_sites(&self) -> &[Point<D>] {
        &self.sites[self.given..]
    }
}

/// The places on both sides of a foot; beside a side of the box nearer to it, `None` if they are outside even so.
fn both_sides<const D: usize>(foot: &Foot<D>, d: f64, bounds: &Bounds<D>) -> Option<[Point<D>; 2]> {
    let mut share = HALF;
    while share >= 0.5 * APART {
        let beside = |h: f64| std::array::from_fn(|k| foot.position[k] + h * foot.normal[k]);
        let places: [Point<D>; 2] = [beside(share * d), beside(-share * d)];
        if places.iter().all(|place| bounds.contains(place)) {
            return Some(places);
        }
        share *= 0.85;
    }
    None
}

/// The nearest site within `reach`.
fn nearest<const D: usize>(
    bins: &Bins<D>,
    sites: &[Point<D>],
    p: &Point<D>,
    reach: f64,
) -> Option<u32> {
    let mut best = (reach * reach, None);
    bins.near(p, reach, |at| {
        let found = (distance_squared(&sites[at], p), Some(at as u32));
        if found < best {
            best = found;
        }
    });
    best.1
}

/// The mirror image of a point in the plane of a foot.
fn mirrored<const D: usize>(p: &Point<D>, foot: &Foot<D>) -> Point<D> {
    let height = dot(&difference(p, &foot.position), &foot.normal);
    std::array::from_fn(|k| p[k] - 2.0 * height * foot.normal[k])
}
