//! Atoms on features: on nodes, then on curves, then, in space, on surfaces.

use crate::parallel::prelude::*;

use crate::crests::{Foot, Pieces};
use crate::fields::NominalDistance;
use crate::geometry::{Bins, Bounds, Point, PointGrid, difference, distance_squared, dot};
use crate::watch::{Cancelled, Phase, Watch, check};

use super::curves::Curves;

/// The least distance of two atoms of different pieces, over d: the weaker piece is not met there.
const APART: f64 = 0.45;
/// The first distance of atoms on a surface, over d: a random packing of discs has as many as a hexagonal lattice of
/// edges d if they are this far apart (Feder 1980: 0.547 of the area is covered).
const FIRST: f64 = 0.75;
/// The least distance of atoms on a surface once they have settled, over d.
const SETTLED: f64 = 0.55;
/// The least distance of atoms on surfaces from the sides of the box, over d.
const SIDE: f64 = 0.4;
/// An atom nearer to a side of the box than this is on it, in mean steps.
pub(super) const ON_SIDE: f64 = 0.05;
/// How often atoms on surfaces are brought onto their pieces, how often they are moved by the pair force each time, and
/// how far at most, over d.
const SWEEPS: usize = 8;
const ROUNDS: usize = 6;
const LONGEST: f64 = 0.1;
const RATE: f64 = 0.08;

/// An atom on a feature.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FeatureAtom<const D: usize> {
    pub position: Point<D>,
    /// The pieces that it is on.
    pub pieces: Vec<u32>,
    /// The dimension of what it is on: 0 a node, 1 a curve, 2 a surface.
    pub rank: u8,
}

impl<const D: usize> FeatureAtom<D> {
    pub fn new(position: Point<D>, pieces: Vec<u32>, rank: u8) -> Self {
        Self { position, pieces, rank }
    }
}

/// Atoms about d(x) apart on all pieces: those of the stronger pieces first wherever two are too near.
///
/// # Errors
/// [`Cancelled`] if the watch ends the work.
pub(super) fn feature_atoms<const D: usize>(
    pieces: &Pieces<D>,
    bounds: &Bounds<D>,
    distance: &NominalDistance<D>,
    watch: &mut dyn Watch,
) -> Result<Vec<FeatureAtom<D>>, Cancelled> {
    check(watch, Phase::Grow, 0.0, None)?;
    let curves = Curves::of(pieces, bounds, distance);
    let mut atoms = curves.atoms(distance);
    for atom in &mut atoms {
        atom.position = onto_sides(&atom.position, bounds, ON_SIDE * pieces.step());
    }
    atoms.retain(|atom| keeps_off_sides(&atom.position, bounds, distance));
    let mut atoms = apart(atoms, bounds, distance);
    if D > 2 {
        let held = atoms.len();
        add_on_surfaces(&mut atoms, pieces, bounds, distance);
        settle(&mut atoms, held, pieces, bounds, distance, watch)?;
        atoms = apart(atoms, bounds, distance);
        let is_clear: Vec<bool> =
            atoms.par_iter().map(|atom| is_clear(atom, pieces, distance)).collect();
        let mut is_clear = is_clear.iter();
        atoms.retain(|_| is_clear.next() == Some(&true));
    }
    check(watch, Phase::Grow, 0.2, None)?;
    Ok(atoms)
}

/// The atoms without those too near to one before: on lower ranks, and on stronger pieces.
fn apart<const D: usize>(
    mut atoms: Vec<FeatureAtom<D>>,
    bounds: &Bounds<D>,
    distance: &NominalDistance<D>,
) -> Vec<FeatureAtom<D>> {
    let first = |atom: &FeatureAtom<D>| atom.pieces.iter().copied().min().unwrap_or(u32::MAX);
    atoms.sort_by_key(|atom| (atom.rank, first(atom))); // stable
    let mut bins = Bins::new(bounds, distance.least(), atoms.len());
    let mut kept: Vec<FeatureAtom<D>> = Vec::new();
    for atom in atoms {
        let d = distance.at(&atom.position);
        let mut is_free = true;
        bins.near(&atom.position, SETTLED.max(APART) * d, |i| {
            let other: &FeatureAtom<D> = &kept[i];
            let shares = atom.pieces.iter().any(|piece| other.pieces.contains(piece));
            let least = if shares { SETTLED } else { APART };
            let squared = distance_squared(&other.position, &atom.position);
            is_free &= squared >= (least * d).powi(2);
        });
        if is_free {
            bins.push(&atom.position);
            kept.push(atom);
        }
    }
    kept
}

/// Points of pieces that are far enough from the atoms before them. Each atom takes the points near it, so that those left
/// need not look for atoms.
fn add_on_surfaces<const D: usize>(
    atoms: &mut Vec<FeatureAtom<D>>,
    pieces: &Pieces<D>,
    bounds: &Bounds<D>,
    distance: &NominalDistance<D>,
) {
    let all: Vec<_> = pieces.points().collect();
    let grid =
        PointGrid::new(bounds, FIRST * distance.least(), all.iter().map(|(p, _)| p.position));
    let mut is_taken: Vec<bool> = (all.par_iter().with_min_len(1 << 10))
        .map(|(p, _)| !inner(bounds, distance.at(&p.position)).contains(&p.position))
        .collect();
    // what is near is told by d at the points, which is at most so many times as much as d at the atom
    let rise = FIRST * distance.greatest_slope();
    let most = if rise < 1.0 { 1.0 / (1.0 - rise) } else { f64::INFINITY };
    let take = |atom: &FeatureAtom<D>, is_taken: &mut [bool]| {
        let reach = FIRST * distance.greatest().min(most * distance.at(&atom.position));
        grid.near(&atom.position, reach, |place, i| {
            let least = if atom.pieces.contains(&all[i].1) { FIRST } else { APART };
            is_taken[i] = is_taken[i]
                || distance_squared(&atom.position, place) < (least * distance.at(place)).powi(2);
        });
    };
    atoms.iter().for_each(|atom| take(atom, &mut is_taken));
    // a fixed shuffle, so that no row of samples comes first
    let mut order: Vec<u32> = (0..all.len() as u32).collect();
    order.par_sort_unstable_by_key(|&i| {
        u64::from(i).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(23)
    });
    for i in order {
        if !is_taken[i as usize] {
            let (point, piece) = all[i as usize];
            let atom = FeatureAtom::new(point.position, vec![piece], 2);
            take(&atom, &mut is_taken);
            atoms.push(atom);
        }
    }
}

/// Moves the atoms from `held` on by the pair force, each along its piece: in its tangent plane for some rounds, then
/// back onto it.
fn settle<const D: usize>(
    atoms: &mut [FeatureAtom<D>],
    held: usize,
    pieces: &Pieces<D>,
    bounds: &Bounds<D>,
    distance: &NominalDistance<D>,
    watch: &mut dyn Watch,
) -> Result<(), Cancelled> {
    for sweep in 0..SWEEPS {
        check(watch, Phase::Grow, 0.2 * sweep as f64 / SWEEPS as f64, None)?;
        let feet: Vec<Option<Foot<D>>> = (atoms[held..].par_iter())
            .with_min_len(1 << 6)
            .map(|atom| {
                let d = distance.at(&atom.position);
                let foot = pieces.foot_on(atom.pieces[0], &atom.position, 2.0 * d)?;
                let is_in = foot.beyond == 0.0 && inner(bounds, d).contains(&foot.position);
                is_in.then_some(foot)
            })
            .collect();
        for (atom, foot) in atoms[held..].iter_mut().zip(&feet) {
            atom.position = foot.map_or(atom.position, |foot| foot.position);
        }
        let places = pushed(atoms, held, &feet, bounds, distance);
        for (atom, place) in atoms[held..].iter_mut().zip(&places) {
            atom.position = *place;
        }
    }
    // last, onto the pieces
    let last: Vec<Option<Point<D>>> = (atoms[held..].par_iter())
        .with_min_len(1 << 6)
        .map(|atom| {
            let d = distance.at(&atom.position);
            let foot = pieces.foot_on(atom.pieces[0], &atom.position, 2.0 * d)?;
            (foot.beyond == 0.0).then(|| bounds.clamp(&foot.position))
        })
        .collect();
    for (atom, place) in atoms[held..].iter_mut().zip(last) {
        atom.position = place.unwrap_or(atom.position);
    }
    Ok(())
}

/// The places of the atoms from `held` on after some rounds of the pair force in the tangent planes of their feet.
fn pushed<const D: usize>(
    atoms: &[FeatureAtom<D>],
    held: usize,
    feet: &[Option<Foot<D>>],
    bounds: &Bounds<D>,
    distance: &NominalDistance<D>,
) -> Vec<Point<D>> {
    let mut places: Vec<Point<D>> = atoms.iter().map(|atom| atom.position).collect();
    for _ in 0..ROUNDS {
        let grid = PointGrid::new(bounds, distance.least(), places.iter().copied());
        let moved = |(i, foot): (usize, &Option<Foot<D>>)| {
            let place = places[held + i];
            let Some(foot) = foot else { return place };
            let d = distance.at(&place);
            let mut force = [0.0; D];
            grid.near(&place, 1.5 * d, |other, j| {
                if held + i != j {
                    add_force(&mut force, &place, other, d);
                }
            });
            let across = dot(&force, &foot.normal);
            (0..D).for_each(|k| force[k] -= across * foot.normal[k]);
            let length = RATE * dot(&force, &force).sqrt();
            let scale = RATE * d * (LONGEST / length.max(LONGEST));
            let to = std::array::from_fn(|k| place[k] + scale * force[k]);
            inner(bounds, d).clamp(&to)
        };
        let next: Vec<Point<D>> =
            (feet.par_iter().enumerate()).with_min_len(1 << 6).map(moved).collect();
        places[held..].copy_from_slice(&next);
    }
    places.split_off(held)
}

/// The place itself, put on the sides of the box that are nearer than `near`.
pub(super) fn onto_sides<const D: usize>(
    place: &Point<D>,
    bounds: &Bounds<D>,
    near: f64,
) -> Point<D> {
    std::array::from_fn(|k| {
        let sides = [bounds.min[k], bounds.max[k]];
        sides.into_iter().find(|side| (place[k] - side).abs() <= near).unwrap_or(place[k])
    })
}

/// Whether an atom on a surface leaves the surfaces that cross it to the atoms where they cross.
fn is_clear<const D: usize>(
    atom: &FeatureAtom<D>,
    pieces: &Pieces<D>,
    distance: &NominalDistance<D>,
) -> bool {
    if atom.rank < 2 {
        return true;
    }
    let clear = APART * distance.at(&atom.position);
    let mut others = pieces.near(&atom.position, clear);
    others.retain(|other| !atom.pieces.contains(other));
    others.iter().all(|&other| {
        let foot = pieces.foot_on(other, &atom.position, clear);
        foot.is_none_or(|foot| {
            foot.beyond > 0.0 || foot.signed_distance(&atom.position).abs() >= clear
        })
    })
}

/// Whether a place is on or well within each side of the box: a feature along a side gives way to it.
fn keeps_off_sides<const D: usize>(
    place: &Point<D>,
    bounds: &Bounds<D>,
    distance: &NominalDistance<D>,
) -> bool {
    let inner = inner(bounds, distance.at(place));
    (0..D).all(|k| {
        let is_on = place[k] == bounds.min[k] || place[k] == bounds.max[k];
        is_on || (inner.min[k]..=inner.max[k]).contains(&place[k])
    })
}

/// The part of the box in which atoms of surfaces are: nearer to its sides are the curves in which surfaces meet them.
fn inner<const D: usize>(bounds: &Bounds<D>, d: f64) -> Bounds<D> {
    let inset = |k: usize| (SIDE * d).min(0.5 * (bounds.max[k] - bounds.min[k]));
    Bounds {
        min: std::array::from_fn(|k| bounds.min[k] + inset(k)),
        max: std::array::from_fn(|k| bounds.max[k] - inset(k)),
    }
}

/// Adds the pair force that an atom at `other` has on one at `at`, over its greatest (Shimada 1993).
fn add_force<const D: usize>(force: &mut Point<D>, at: &Point<D>, other: &Point<D>, d: f64) {
    let offset = difference(at, other);
    let r = dot(&offset, &offset).sqrt();
    let u = r / d;
    if u >= 1.5 || r == 0.0 {
        return;
    }
    let push = 9.0 / 8.0 - 19.0 / 8.0 * u * u + 5.0 / 4.0 * u * u * u;
    (0..D).for_each(|k| force[k] += push / r * offset[k]);
}
