//! Pairs of atoms that are mirror images of each other in a feature.

use crate::crests::FeaturePoint;
use crate::fields::NominalDistance;
use crate::geometry::{Bins, Bounds, Point, difference, distance_squared, dot};
use crate::lattice::Lattice;

use super::{APART, is_held};

/// The distance of an atom from its site, over d; beside the box's sides it may be less. On the paper's figure 1 recall
/// is the same from 0.3 to 0.4; on a volume of faults (d = 8) it is 0.90, 0.91 and 0.92 with 0.45, 0.4 and 0.35,
/// before atoms are shared.
const HALF: f64 = 0.35;

/// Sites on features that have a pair of atoms.
pub(super) struct Pairs<const D: usize> {
    /// Atoms that stay where they are: first those that the lattice holds already, then the new ones.
    pub atoms: Vec<Point<D>>,
    given: usize,
    /// The sites, in lattice coordinates.
    pub sites: Vec<FeaturePoint<D>>,
    /// The two atoms of each site.
    pub of_sites: Vec<[u32; 2]>,
    /// How many sites share an atom with another.
    pub shared: usize,
}

impl<const D: usize> Pairs<D> {
    /// Pairs at those of the sites where there is room, the first ones first.
    pub fn new(
        sites: &[FeaturePoint<D>],
        lattice: &Lattice<D>,
        distance: &NominalDistance<D>,
    ) -> Self {
        let bounds = *lattice.bounds();
        let held = (0..lattice.len()).filter(|&i| is_held(lattice, i));
        let atoms: Vec<Point<D>> = held.map(|i| lattice.atoms()[i]).collect();
        let given = atoms.len();
        let mut bins = Bins::new(&bounds, distance.least(), given + 2 * sites.len());
        atoms.iter().for_each(|atom| bins.push(atom));
        let mut pairs = Self { atoms, given, sites: Vec::new(), of_sites: Vec::new(), shared: 0 };
        for site in sites {
            let d = distance.at(&site.position);
            let Some(places) = both_sides(site, d, &bounds) else { continue };
            let near = |p: &Point<D>, atoms: &[Point<D>]| nearest(&bins, atoms, p, APART * d);
            let taken = places.map(|place| near(&place, &pairs.atoms));
            let next = pairs.atoms.len() as u32;
            let (pair, added): ([u32; 2], Vec<Point<D>>) = match taken {
                [None, None] => ([next, next + 1], places.to_vec()),
                [Some(a), Some(b)] if a != b => ([a, b], Vec::new()),
                [Some(_), Some(_)] => continue,
                [Some(atom), None] | [None, Some(atom)] => {
                    let image = mirror_image(&pairs.atoms[atom as usize], site);
                    // an atom on the feature itself has its image on top of it
                    if !bounds.contains(&image) || near(&image, &pairs.atoms).is_some() {
                        continue;
                    }
                    ([atom, next], vec![image])
                }
            };
            pairs.shared += usize::from(added.len() < 2);
            added.iter().for_each(|atom| bins.push(atom));
            pairs.atoms.extend(added);
            pairs.sites.push(*site);
            pairs.of_sites.push(pair);
        }
        pairs
    }

    /// The atoms that the lattice did not have.
    pub fn new_atoms(&self) -> &[Point<D>] {
        &self.atoms[self.given..]
    }
}

/// The places of a pair's atoms at a site, nearer to it where the box ends; `None` if even these are outside the box.
fn both_sides<const D: usize>(
    site: &FeaturePoint<D>,
    d: f64,
    bounds: &Bounds<D>,
) -> Option<[Point<D>; 2]> {
    let mut share = HALF;
    while share >= 0.5 * APART {
        let beside = |h: f64| std::array::from_fn(|k| site.position[k] + h * site.normal[k]);
        let places: [Point<D>; 2] = [beside(share * d), beside(-share * d)];
        if places.iter().all(|place| bounds.contains(place)) {
            return Some(places);
        }
        share *= 0.85;
    }
    None
}

/// The nearest atom within `reach`.
fn nearest<const D: usize>(
    bins: &Bins<D>,
    atoms: &[Point<D>],
    p: &Point<D>,
    reach: f64,
) -> Option<u32> {
    let mut best = (reach * reach, None);
    bins.near(p, reach, |at| {
        let found = (distance_squared(&atoms[at], p), Some(at as u32));
        if found < best {
            best = found;
        }
    });
    best.1
}

/// The mirror image of a point in the feature at a site.
fn mirror_image<const D: usize>(p: &Point<D>, site: &FeaturePoint<D>) -> Point<D> {
    let height = dot(&difference(p, &site.position), &site.normal);
    std::array::from_fn(|k| p[k] - 2.0 * height * site.normal[k])
}
