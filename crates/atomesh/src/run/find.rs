//! The features of an image that facets are to keep to.

use crate::parallel::prelude::*;

use crate::crests::{
    Cleanness, FeaturePoint, Hysteresis, Pieces, in_large_groups, linked, strongest,
    strongest_tenth,
};
use crate::enhance::{self, FeatureOptions, Features};
use crate::fields::{NominalDistance, ScalarField};
use crate::image::{Grid, rows};
use crate::improve::Align;
use crate::watch::Watch;

use super::error::{RunError, Warning};
use super::inputs::Inputs;
use super::options::MeshOptions;
use super::prepare::image_of;

/// The least square of the deviation by which b is smoothed to find valleys, in samples; together with a sample that b
/// has already it is max(1, d/6).
const LEAST_VARIANCE: f64 = 0.8;
/// The least depth of a valley at all, and over that of the deepest tenth.
pub(super) const LEAST_DEPTH: f32 = 0.05;
const DEPTH_SHARE: f32 = 0.3;

/// The depth that a group of bottoms reaches somewhere, over that of the deepest tenth. On a section of faults the
/// groups of clutter reach 0.4, those of faults 0.48 and more.
const GROUP_DEPTH_SHARE: f64 = 0.45;
/// The least length of a piece of a feature in the plane, over d, in points a sample apart; in space its least area,
/// over d².
const LEAST_PIECE: [f64; 2] = [1.5, 6.0];

/// The least share of points on clean features with which atoms are put on features unasked, in the plane and in space.
/// Discs, balls and faults that are planes have 0.75 and more; a photograph of faults has 0.44, a torso 0.64 and a brain 0.56: of the features of these fewer are met by
/// rows of atoms of their own than by facets that turn onto them.
const LEAST_CLEAN: [f64; 2] = [0.7, 0.6];

/// The share of points beside no clean feature up to which features are clean all the same: short lines are mostly tips,
/// and valleys fan out about these; sheets whose samples are far apart along one axis are rough. Single lines, the
/// planes and faults of synthetic images have 0.002 and less; a brain 0.019, a torso 0.04, a photograph of faults 0.09.
const MOST_UNEXPLAINED: f64 = 0.006;

/// Features nearer to each other than this in the mean, over d, have no room for rows of atoms on each.
const CROWDED: f64 = 2.0 / 3.0;

/// The share below which features that were looked for in a block of a volume alone are taken to be ragged everywhere.
const RAGGED: f64 = 0.52;

/// The greatest extent of such a block along each axis, in samples; smaller volumes have none.
const BLOCK: [usize; 3] = [80, 80, 24];

/// What is known of the image before its features are looked for.
pub(super) struct Known<'a, const D: usize> {
    /// b(x).
    pub potential: &'a ScalarField<D>,
    /// d(x).
    pub distance: &'a NominalDistance<D>,
    /// The crests that b was made of, in lattice coordinates, if it was made of crests.
    pub crests: Option<Vec<FeaturePoint<D>>>,
}

/// Features that facets are to follow.
#[derive(Default)]
pub(super) struct Found<const D: usize> {
    /// Atoms are put on these.
    pub pieces: Option<Pieces<D>>,
    /// Whether features are too ragged for rows of atoms; facets are turned onto them all the same.
    pub are_ragged: bool,
    /// What is to be said of that.
    pub note: Option<Warning>,
}

impl<const D: usize> Found<D> {
    /// Features so far apart in the mean, in samples.
    fn crowded(apart: f64) -> Self {
        let why = format!(
            "these are {apart:.1} samples apart in the mean, nearer than two thirds of an edge; shorter edges, or \
             --align conform, put atoms there"
        );
        Self { pieces: None, are_ragged: true, note: Some(Warning::TurnedOnly { why }) }
    }

    /// Features of which this share is clean.
    fn ragged(clean: f64) -> Self {
        let why = format!(
            "these are ragged, {:.0} % of them clean {} (--align conform puts atoms there all the same)",
            100.0 * clean,
            if D == 2 { "lines" } else { "sheets" }
        );
        Self { pieces: None, are_ragged: true, note: Some(Warning::TurnedOnly { why }) }
    }
}

/// The features, in lattice coordinates.
pub(super) fn find_features<const D: usize>(
    inputs: &Inputs<'_, D>,
    options: &MeshOptions<D>,
    known: Known<'_, D>,
    watch: &mut dyn Watch,
) -> Result<Found<D>, RunError> {
    let Known { potential, distance, crests } = known;
    let grid = potential.grid();
    let is_asked = options.improve.align == Align::Auto;
    let points = match crests {
        Some(crests) => crests,
        None => {
            let block = if is_asked {
                of_block(inputs, options, potential, distance, watch)?
            } else {
                None
            };
            if let Some(found) = block.filter(|found| are_ragged(*found, RAGGED)) {
                return Ok(Found::ragged(found.clean));
            }
            feature_points(inputs, options, potential, distance, watch)?
        }
    };
    if is_asked && points.is_empty() {
        return Ok(Found { are_ragged: true, ..Found::default() });
    }
    if is_asked {
        // a point a sample: so many samples of the image for each are how far lines or sheets are apart
        let apart = grid.sample_count() as f64 / points.len() as f64;
        if apart < CROWDED * grid.in_samples(distance.mean()) {
            return Ok(Found::crowded(apart));
        }
        let found = Pieces::cleanness(&points, grid);
        if are_ragged(found, LEAST_CLEAN[D - 2]) {
            return Ok(Found::ragged(found.clean));
        }
    }
    let pieces = Pieces::new(points, grid, least_piece(grid, distance));
    Ok(Found { pieces: (!pieces.is_empty()).then_some(pieces), ..Found::default() })
}

/// How clean the features of a block of a volume are: if they are ragged, those of the rest need not be looked for. Small
/// volumes are looked at whole, and so are those of kinds that are not found from near samples alone.
fn of_block<const D: usize>(
    inputs: &Inputs<'_, D>,
    options: &MeshOptions<D>,
    potential: &ScalarField<D>,
    distance: &NominalDistance<D>,
    watch: &mut dyn Watch,
) -> Result<Option<Cleanness>, RunError> {
    let grid = potential.grid();
    let kind = options.features.features;
    let is_local = matches!(kind, Features::Dark | Features::Bright | Features::Edges);
    let is_local = inputs.is_potential || is_local && options.mixture.is_none();
    if D < 3 || grid.sample_count() < 8 * BLOCK.iter().product::<usize>() || !is_local {
        return Ok(None);
    }
    let (start, end) = deepest_block(potential);
    let image = inputs.image.crop(start, end).expect("the block lies within the image");
    let block = Grid { shape: image.frame().shape(), ..*grid };
    let of_block = rows(grid.shape, start, end).flat_map(|row| &potential.samples()[row]);
    let samples = of_block.copied().collect();
    let potential = ScalarField::potential(block, samples, options.interpolation)?;
    let inputs = Inputs { image: &image, ..*inputs };
    let points = feature_points(&inputs, options, &potential, distance, watch)?;
    Ok(Some(Pieces::cleanness(&points, &block)))
}

/// Whether too few points lie on clean features, and too many beside none.
fn are_ragged(found: Cleanness, least_clean: f64) -> bool {
    found.clean < least_clean && found.unexplained > MOST_UNEXPLAINED
}

/// The first sample of a block where b is farthest from 0, and the one after its last: its planes are chosen first, then
/// its rows among these, then its columns.
fn deepest_block<const D: usize>(potential: &ScalarField<D>) -> ([usize; D], [usize; D]) {
    let shape = potential.grid().shape;
    let (mut start, mut end) = ([0; D], shape);
    for k in (0..D).rev() {
        let depth = |at: usize| -> f64 {
            let (mut start, mut end) = (start, end);
            (start[k], end[k]) = (at, at + 1);
            let rows = rows(shape, start, end).map(|row| &potential.samples()[row]);
            rows.map(|row| row.iter().map(|b| f64::from(b.abs())).sum::<f64>()).sum()
        };
        let depths: Vec<f64> = (0..shape[k]).into_par_iter().map(depth).collect();
        let extent = BLOCK[k].min(shape[k]);
        let sums = depths.windows(extent).map(|block| block.iter().sum::<f64>());
        let deepest = sums.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        start[k] = deepest.map_or(0, |(first, _)| first);
        end[k] = start[k] + extent;
    }
    (start, end)
}

/// How each kind of features is looked for; none where b is given.
pub(super) fn kinds<const D: usize>(
    inputs: &Inputs<'_, D>,
    options: &MeshOptions<D>,
) -> Vec<FeatureOptions> {
    match &options.mixture {
        _ if inputs.is_potential => Vec::new(),
        Some(mixture) => (mixture.shares().iter())
            .map(|share| FeatureOptions { features: share.features, ..options.features })
            .collect(),
        None => vec![options.features],
    }
}

/// Points on the features, in lattice coordinates.
fn feature_points<const D: usize>(
    inputs: &Inputs<'_, D>,
    options: &MeshOptions<D>,
    potential: &ScalarField<D>,
    distance: &NominalDistance<D>,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, RunError> {
    let mut points = Vec::new();
    let mut is_valley = inputs.is_potential;
    for kind in kinds(inputs, options) {
        let kind = FeatureOptions { units: options.units, ..kind };
        match enhance::feature_points(image_of(inputs, kind.features), &kind, watch)? {
            Some(found) => points.extend(found),
            None => is_valley |= kind.features != Features::None,
        }
    }
    if is_valley {
        points.extend(deep_valleys(potential, distance, options.features.repel, watch)?);
    }
    Ok(points)
}

/// The crests of all deep valleys of b, or of −b where features repel, as pieces; clean or not.
pub(super) fn crests<const D: usize>(
    potential: &ScalarField<D>,
    distance: &NominalDistance<D>,
    repels: bool,
    watch: &mut dyn Watch,
) -> Result<Pieces<D>, RunError> {
    let points = deep_valleys(potential, distance, repels, watch)?;
    Ok(Pieces::new(points, potential.grid(), least_piece(potential.grid(), distance)))
}

/// The fewest points of a piece of a feature.
fn least_piece<const D: usize>(grid: &Grid<D>, distance: &NominalDistance<D>) -> usize {
    let size = grid.in_samples(distance.least());
    (LEAST_PIECE[D - 2] * size.powi(D as i32 - 1)).ceil() as usize
}

/// The bottoms of the deep valleys of b, or of −b where features repel, in lattice coordinates.
fn deep_valleys<const D: usize>(
    potential: &ScalarField<D>,
    distance: &NominalDistance<D>,
    repels: bool,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, RunError> {
    let grid = potential.grid();
    let (low, high) = potential.range();
    if (if repels { -high } else { low }) > -LEAST_DEPTH {
        return Ok(Vec::new());
    }
    let turned: Vec<f32>;
    let valleys = match repels {
        true => {
            turned = potential.samples().iter().map(|b| -b).collect();
            &turned[..]
        }
        false => potential.samples(),
    };
    let size = grid.in_samples(distance.least());
    let sigma = ((size / 6.0).powi(2) - 1.0).max(LEAST_VARIANCE).sqrt();
    let found = enhance::valley_points(valleys, grid, sigma, LEAST_DEPTH, watch)?;
    let found = in_large_groups(strongest(found, DEPTH_SHARE), grid.shape, size);
    let high = GROUP_DEPTH_SHARE * f64::from(strongest_tenth(&found));
    let limits = Hysteresis { low: 0.0, high, least_count: 0 };
    Ok(linked(found, grid.shape, limits))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fields::Interpolation;
    use crate::watch::Silent;

    #[test]
    fn a_line_ends_where_half_of_its_depth_is_left() {
        // a valley along y = 30.3 from x = 25.4 to 70.8, blurred by 1.5: its ends are error functions
        let grid = Grid::<2> { shape: [96, 60], step: [1.0; 2] };
        let (ends, blur) = ([25.4, 70.8], 1.5);
        let rise = |x: f64| 1.0 / (1.0 + (-1.702 * x / blur).exp()); // the normal distribution, to 0.01
        let b = |i: usize| {
            let [x, y] = grid.position(i);
            let across = (-0.5 * ((y - 30.3) / blur).powi(2)).exp();
            (-across * rise(x - ends[0]) * rise(ends[1] - x)) as f32
        };
        let values = (0..grid.sample_count()).map(b).collect();
        let potential = ScalarField::potential(grid, values, Interpolation::Linear).unwrap();
        let distance = NominalDistance::constant(&grid, 5.0).unwrap();
        let pieces = crests(&potential, &distance, false, &mut Silent).unwrap();
        assert_eq!(pieces.len(), 1);
        let is_on = |x: f64| {
            let foot = pieces.foot_on(0, &[x, 30.3], 8.0);
            foot.is_some_and(|foot| foot.beyond == 0.0)
        };
        // points are a sample apart, so that an end is known to half of one, and a little
        for (inside, end) in [(1.0, ends[0]), (-1.0, ends[1])] {
            assert!(is_on(end + 0.8 * inside), "{end}");
            assert!(!is_on(end - 1.0 * inside), "{end}");
        }
    }

    #[test]
    fn sheets_go_through_their_crossing_whole() {
        // planes at 45° about the z axis, whose valleys run into each other where they cross
        let grid = Grid::<3> { shape: [56, 52, 40], step: [1.0; 3] };
        let (sine, cosine) = 22.5f64.to_radians().sin_cos();
        let normals = [[sine, cosine], [-sine, cosine]];
        let b = |i: usize| {
            let [x, y, _] = grid.position(i);
            let depth = normals.map(|n| {
                let off = n[0] * (x - 27.3) + n[1] * (y - 25.6);
                (-0.25 * off * off).exp()
            });
            -depth[0].max(depth[1]) as f32
        };
        let values = (0..grid.sample_count()).map(b).collect();
        let potential = ScalarField::potential(grid, values, Interpolation::Linear).unwrap();
        let distance = NominalDistance::constant(&grid, 6.0).unwrap();
        let pieces = crests(&potential, &distance, false, &mut Silent).unwrap();
        assert_eq!(pieces.len(), 2);
        for (piece, i) in (0..2).flat_map(|piece| (-20..=20).map(move |i| (piece, i))) {
            let x = f64::from(i);
            let feet = normals.map(|n| {
                let p = [27.3 + x, 25.6 - x * n[0] / n[1], 20.0];
                let foot = pieces.foot_on(piece, &p, 8.0);
                foot.filter(|foot| foot.beyond == 0.0).map(|foot| foot.signed_distance(&p).abs())
            });
            // on one of the two planes
            assert!(feet.iter().flatten().any(|&off| off < 0.3), "{piece} {x}: {feet:?}");
        }
    }

    #[test]
    fn the_deepest_block_holds_what_is_deepest() {
        let grid = Grid::<3> { shape: [100, 90, 40], step: [1.0; 3] };
        let mut values = vec![0.0; grid.sample_count()];
        let index = |x: usize, y: usize, z: usize| x + 100 * (y + 90 * z);
        values[index(97, 3, 33)] = -1.0;
        values[index(5, 80, 2)] = -0.4;
        let potential = ScalarField::potential(grid, values, Interpolation::Linear).unwrap();
        let (start, end) = deepest_block(&potential);
        let holds = (0..3).all(|k| (start[k]..end[k]).contains(&[97, 3, 33][k]));
        assert!(holds && (0..3).all(|k| end[k] - start[k] == BLOCK[k]), "{start:?} {end:?}");
    }
}
