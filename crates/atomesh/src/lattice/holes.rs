//! Filling the holes of a lattice where something was changed, and only there.

use crate::parallel::prelude::*;

use crate::fields::NominalDistance;
use crate::geometry::{Bounds, Point, PointGrid, all_axes, distance_squared};
use crate::watch::{Phase, Watch, check};

use super::scatter::{Hole, Scatterer, Spread, fill_faces};
use super::{Lattice, LatticeError};

/// How far from the places around which atoms were taken out the atoms around a hole are at most, over d: such holes have
/// radii below 1.2 d, and hold an atom that was within 0.7 d of a place.
const HOLE_REACH: f64 = 3.0;
/// How far from the sides of the box the atoms around a hole beside one are at most, over d.
const BESIDE: f64 = 2.5;

/// [`fill_holes`](super::fill_holes) of a lattice that had none but beside the sides of the box until atoms were put at
/// `places` and what was near these was taken out. Only what is near either is connected, and then what is near the atoms
/// added.
///
/// # Errors
/// As [`fill_holes`](super::fill_holes).
pub(crate) fn fill_holes_near<const D: usize>(
    scatterer: &Scatterer<D>,
    mut lattice: Lattice<D>,
    places: &[Point<D>],
    distance: &NominalDistance<D>,
    rounds: usize,
    watch: &mut dyn Watch,
) -> Result<Lattice<D>, LatticeError> {
    fill_faces(&mut lattice, distance, rounds, watch)?;
    let bounds = *lattice.bounds();
    let mut atoms = lattice.atoms().to_vec();
    let spread = scatterer.spread(rounds);
    complete(&spread, &mut atoms, places, &bounds, distance, watch)?;
    for p in atoms.split_off(lattice.len()) {
        lattice.push(p, all_axes::<D>(), 1.0);
    }
    Ok(lattice)
}

/// Adds atoms in the holes near some places and beside the sides of the box, and near the atoms added.
fn complete<const D: usize>(
    spread: &Spread<'_, D>,
    atoms: &mut Vec<Point<D>>,
    places: &[Point<D>],
    bounds: &Bounds<D>,
    distance: &NominalDistance<D>,
    watch: &mut dyn Watch,
) -> Result<(), LatticeError> {
    let field = |p: &Point<D>| distance.at(p);
    let mut reach = HOLE_REACH * distance.greatest();
    let is_beside = |p: &Point<D>| {
        (0..D).any(|k| (p[k] - bounds.min[k]).min(bounds.max[k] - p[k]) < BESIDE * distance.at(p))
    };
    let mut some = near_places(atoms, places, reach, bounds, is_beside);
    for round in 0..spread.rounds {
        check(watch, Phase::Grow, round as f64 / (round + 8) as f64, None)?;
        if some.len() <= D + 1 {
            break;
        }
        let mut holes = spread.holes(&some, bounds, &field, watch)?;
        keep_empty(&mut holes, atoms, bounds);
        if holes.is_empty() {
            break;
        }
        let before = atoms.len();
        spread.plug(&holes, bounds, atoms);
        if atoms.len() == before || round + 1 == spread.rounds {
            break;
        }
        // no hole of the next round is larger than the largest of this one, and each has a new atom on its sphere
        reach = 2.0 * holes.iter().map(|hole| hole.ratio * hole.d).fold(0.0, f64::max);
        some = near_places(atoms, &atoms[before..], reach, bounds, |_| false);
    }
    Ok(())
}

/// The atoms within `reach` of some places, and those that are wanted anyway.
fn near_places<const D: usize>(
    atoms: &[Point<D>],
    places: &[Point<D>],
    reach: f64,
    bounds: &Bounds<D>,
    is_wanted: impl Fn(&Point<D>) -> bool + Sync,
) -> Vec<Point<D>> {
    let grid = PointGrid::new(bounds, reach, places.iter().copied());
    let is_near = |p: &Point<D>| {
        let mut is_near = false;
        grid.near(p, reach, |place, _| is_near |= distance_squared(place, p) <= reach * reach);
        is_near
    };
    let atoms = atoms.par_iter().with_min_len(1 << 8);
    atoms.filter(|p| is_wanted(p) || is_near(p)).copied().collect()
}

/// Drops the spheres of cells of some atoms that other atoms are inside of: these are no cells of all atoms.
fn keep_empty<const D: usize>(holes: &mut Vec<Hole<D>>, atoms: &[Point<D>], bounds: &Bounds<D>) {
    /// An atom nearer than this is inside, over the radius: corners are as far as rounding leaves them.
    const INSIDE: f64 = 1.0 - 1e-6;
    let Some(least) = holes.iter().map(|hole| hole.ratio * hole.d).min_by(f64::total_cmp) else {
        return;
    };
    let grid = PointGrid::new(bounds, least, atoms.iter().copied());
    let is_empty = |hole: &Hole<D>| {
        grid.nearest(&hole.centre, INSIDE * hole.ratio * hole.d, |_| true).is_none()
    };
    let empty: Vec<bool> = holes.par_iter().with_min_len(1 << 6).map(is_empty).collect();
    let mut empty = empty.into_iter();
    holes.retain(|_| empty.next() == Some(true));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::dot;
    use crate::image::Grid;
    use crate::lattice::{Crystal, GrowOptions, fill_holes, grow};
    use crate::watch::Silent;

    /// A crystal with atoms of their own on a ball, and without those near them; and these places.
    fn with_a_ball<const D: usize>(
        crystal: &Crystal<D>,
        distance: &NominalDistance<D>,
        bounds: Bounds<D>,
    ) -> (Lattice<D>, Vec<Point<D>>) {
        let d = distance.least();
        let grown = grow(crystal, bounds, distance, &GrowOptions::default(), &mut Silent).unwrap();
        let middle: Point<D> = std::array::from_fn(|k| 0.47 * bounds.max[k] + 0.1 * k as f64);
        let radius = 0.28 * bounds.max[0];
        // where a spiral meets the ball
        let mut places: Vec<Point<D>> = Vec::new();
        for i in 0..4000 {
            let (turn, rise) = (2.399_963 * f64::from(i), (f64::from(i) + 0.5) / 2000.0 - 1.0);
            let across = (1.0 - rise * rise).sqrt();
            let unit = [across * turn.cos(), across * turn.sin(), rise];
            let unit: Point<D> = std::array::from_fn(|k| unit[k]);
            let length = dot(&unit, &unit).sqrt().max(1e-9);
            let place: Point<D> = std::array::from_fn(|k| middle[k] + radius / length * unit[k]);
            let apart = (0.9 * d).powi(2);
            if places.iter().all(|other| distance_squared(other, &place) >= apart) {
                places.push(place);
            }
        }
        let is_clear = |p: &Point<D>| {
            places.iter().all(|place| distance_squared(place, p) >= (0.7 * d).powi(2))
        };
        let atoms: Vec<Point<D>> = grown.atoms().to_vec();
        let mut lattice = grown.retained(|i| is_clear(&atoms[i]));
        places.iter().for_each(|place| lattice.push(*place, bounds.freedom(place), 0.0));
        (lattice, places)
    }

    fn what_is_far_need_not_be_connected<const D: usize>(
        crystal: &Crystal<D>,
        scatterer: &Scatterer<D>,
        grid: &Grid<D>,
    ) {
        let (distance, bounds) = (NominalDistance::constant(grid, 5.0).unwrap(), grid.bounds());
        let (lattice, places) = with_a_ball(crystal, &distance, bounds);
        let before = lattice.len();
        let all = fill_holes(scatterer, lattice.clone(), &distance, 2, &mut Silent).unwrap();
        let near = fill_holes_near(scatterer, lattice, &places, &distance, 2, &mut Silent).unwrap();
        let [added, as_well] = [&all, &near].map(|lattice| lattice.len() - before);
        // of holes as large as each other either may be filled first
        assert!(added > 20 && added.abs_diff(as_well) <= 1 + added / 50, "{added} {as_well}");
        let lonely = |from: &Lattice<D>, to: &Lattice<D>| {
            let grid = PointGrid::new(&bounds, 5.0, to.atoms().iter().copied());
            let of = &from.atoms()[before..];
            of.iter().filter(|p| grid.nearest(p, 0.01, |_| true).is_none()).count()
        };
        assert!(10 * lonely(&near, &all) <= added && 10 * lonely(&all, &near) <= added);
        // no hole is left that filling all would not leave
        let field = |p: &Point<D>| distance.at(p);
        let left = |lattice: &Lattice<D>| {
            let holes = scatterer.spread(1).holes(lattice.atoms(), &bounds, &field, &mut Silent);
            holes.unwrap().len()
        };
        assert!(left(&near) <= left(&all) + added / 20, "{} {}", left(&near), left(&all));
    }

    #[test]
    fn holes_near_places_are_those_of_the_whole_lattice() {
        let plane = Grid::<2> { shape: [121, 111], step: [1.0; 2] };
        what_is_far_need_not_be_connected(&Crystal::hexagonal(), &Scatterer::<2>::new(), &plane);
        let space = Grid::<3> { shape: [61, 57, 63], step: [1.0; 3] };
        let crystal = Crystal::body_centered_cubic();
        what_is_far_need_not_be_connected(&crystal, &Scatterer::<3>::new(), &space);
    }
}
