//! From images and options to b(x), d(x) and β(x).

use crate::crests::{
    FeaturePoint, Hysteresis, Pieces, in_large_groups, linked, strongest, strongest_tenth,
};
use crate::enhance::{self, FeatureOptions, Features};
use crate::fields::{
    Fields, GRADIENT_LIMIT, Grading, ImageWeight, NominalDistance, ScalarField, default_distance,
};
use crate::image::{Frame, Grid, Image, Samples};
use crate::improve::Align;
use crate::region::{Outline, label_samples, samples_inside};
use crate::watch::{Phase, Watch, check};

use super::error::{RunError, Warning};
use super::inputs::Inputs;
use super::method::Method;
use super::options::{MeshKind, MeshOptions, Size};
use super::prepared::{Parts, Prepared};

/// The least square of the deviation by which b is smoothed to find valleys, in samples; together with a sample that b
/// has already it is max(1, d/6).
const LEAST_VARIANCE: f64 = 0.8;
/// The least depth of a valley at all, and over that of the deepest tenth.
const LEAST_DEPTH: f32 = 0.05;
const DEPTH_SHARE: f32 = 0.3;

/// The least depth of valleys that facets follow where atoms are not put on features, of 1.
const FOLLOWED_DEPTH: f32 = 0.25;

/// The depth that a group of bottoms reaches somewhere, over that of the deepest tenth. On a section of faults the
/// groups of clutter reach 0.4, those of faults 0.48 and more.
const GROUP_DEPTH_SHARE: f64 = 0.45;
/// The least length of a piece of a feature in the plane, over d, in points a sample apart; in space its least area,
/// over d².
const LEAST_PIECE: [f64; 2] = [1.5, 6.0];

/// The least share of points on clean features with which atoms are put on features unasked. Discs, balls and faults
/// that are planes have 0.75 and more, a photograph of faults 0.39, brains and torsos 0.56 and 0.64: of the features of
/// these fewer are met by rows of atoms of their own than by facets that turn onto them.
const LEAST_CLEAN: f64 = 0.7;

/// Makes b(x), d(x) and β(x).
pub(super) fn prepare<const D: usize>(
    method: &Method<D>,
    inputs: Inputs<'_, D>,
    mut options: MeshOptions<D>,
    watch: &mut dyn Watch,
) -> Result<Prepared<D>, RunError> {
    let frame = *inputs.image.frame();
    let grid = frame.grid(options.units);
    options.optimize.validate()?;
    options.improve.validate(D)?;
    if let Some(axis) = (0..D).find(|&k| grid.shape[k] < 2) {
        return Err(RunError::Thin { axis });
    }
    method.crystal(options.lattice)?; // refuse early what does not fit the dimension
    let mut warnings = Vec::new();
    let labels = labels(&inputs)?;
    let mut samples = potential_samples(&inputs, &options, &mut warnings, watch)?;
    check(watch, Phase::Distance, 0.0, None)?;
    let distance = nominal_distance(&inputs, &grid, &options, &samples)?;
    let outline = outline(&inputs, grid, &distance, watch)?;
    if let Some(outline) = &outline {
        outline.combine(&mut samples);
    }
    let weight = weight(&inputs, grid, options.image_weight)?;
    let is_masked = outline.is_some();
    warnings.extend(coarse(&grid, &distance));
    check(watch, Phase::Distance, 1.0, None)?;
    let potential = ScalarField::potential(grid, samples, options.interpolation)?;
    let (mut found, mut faced) = (Found::default(), None);
    let asked = options.improve.align;
    if matches!(asked, Align::Auto | Align::Conform) {
        if are_faced(&options, is_masked) {
            faced = find_faced(&inputs, &options, &potential, &distance, watch)?;
        }
        match why_not(&options, &grid, &distance, is_masked) {
            Some(why) if asked == Align::Conform => warnings.push(Warning::NotConforming { why }),
            Some(_) => {}
            None => found = find_features(&inputs, &options, &potential, &distance, watch)?,
        }
        options.improve.align = if found.pieces.is_some() { Align::Conform } else { Align::Full };
    }
    let fields = Fields::new(potential, weight, distance)?;
    let method = method.clone();
    Ok(Prepared::new(Parts {
        method,
        options,
        frame,
        grid,
        fields,
        outline,
        labels,
        is_potential: inputs.is_potential,
        warnings,
        pieces: found.pieces,
        crests: found.crests,
        faced,
    }))
}

/// The labels of the samples; NaN for those outside of the mask, which count in no cell.
fn labels<const D: usize>(inputs: &Inputs<'_, D>) -> Result<Option<Samples>, RunError> {
    let Some(image) = inputs.labels else { return Ok(None) };
    same_shape("label image", inputs.image.frame(), image)?;
    let labels = label_samples(image.samples())?;
    let Some(mask) = inputs.mask else { return Ok(Some(Samples::I32(labels))) };
    same_shape("mask", inputs.image.frame(), mask)?;
    let inside = samples_inside(mask.samples())?;
    let masked = labels.iter().zip(inside);
    let masked = masked.map(|(&label, inside)| if inside { f64::from(label) } else { f64::NAN });
    Ok(Some(Samples::F64(masked.collect())))
}

/// Whether faces of Voronoi cells are made to fall on features.
fn are_faced<const D: usize>(options: &MeshOptions<D>, is_masked: bool) -> bool {
    options.kind == MeshKind::Voronoi && options.mirror && options.features.repel && !is_masked
}

/// The pieces of features that faces are to fall on, if there are any. They are looked for in b as triangles would have it:
/// widened for cells, features run into each other where they cross.
fn find_faced<const D: usize>(
    inputs: &Inputs<'_, D>,
    options: &MeshOptions<D>,
    potential: &ScalarField<D>,
    distance: &NominalDistance<D>,
    watch: &mut dyn Watch,
) -> Result<Option<Pieces<D>>, RunError> {
    if inputs.is_potential {
        return Ok(find_features(inputs, options, potential, distance, watch)?.pieces);
    }
    let features = FeatureOptions { repel: false, ..options.features };
    let attracting = MeshOptions { kind: MeshKind::Delaunay, features, ..options.clone() };
    // what is odd about it has been said
    let samples = potential_samples(inputs, &attracting, &mut Vec::new(), watch)?;
    let narrow = ScalarField::potential(*potential.grid(), samples, options.interpolation)?;
    Ok(find_features(inputs, &attracting, &narrow, distance, watch)?.pieces)
}

/// Where the mesh ends, if there is a mask and it does not hold the whole box.
fn outline<const D: usize>(
    inputs: &Inputs<'_, D>,
    grid: Grid<D>,
    distance: &NominalDistance<D>,
    watch: &mut dyn Watch,
) -> Result<Option<Outline<D>>, RunError> {
    let Some(mask) = inputs.mask else { return Ok(None) };
    same_shape("mask", inputs.image.frame(), mask)?;
    Ok(Outline::new(mask, grid, distance, watch)?)
}

/// β(x).
fn weight<const D: usize>(
    inputs: &Inputs<'_, D>,
    grid: Grid<D>,
    constant: f64,
) -> Result<ImageWeight<D>, RunError> {
    let Some(field) = inputs.weight_field else { return Ok(ImageWeight::constant(constant)?) };
    same_shape("weight field", inputs.image.frame(), field)?;
    Ok(ImageWeight::field(grid, field.samples().to_f32())?)
}

/// A warning where d exceeds the box.
fn coarse<const D: usize>(grid: &Grid<D>, distance: &NominalDistance<D>) -> Option<Warning> {
    let (distance, extent) = (distance.least(), grid.bounds().extent());
    let axis = (0..D).find(|&k| distance > extent[k])?;
    Some(Warning::Coarse { axis, distance, extent: extent[axis] })
}

/// Why atoms cannot conform to features, if they cannot.
fn why_not<const D: usize>(
    options: &MeshOptions<D>,
    grid: &Grid<D>,
    distance: &NominalDistance<D>,
    is_masked: bool,
) -> Option<&'static str> {
    let mean_step = grid.step.iter().sum::<f64>() / D as f64;
    if options.kind != MeshKind::Delaunay {
        return Some("they are put beside them, for Voronoi cells");
    }
    if options.features.repel {
        return Some("these repel");
    }
    if is_masked {
        return Some("within a mask they cannot yet");
    }
    (distance.least() < mean_step).then_some("edges are shorter than the mean step of samples")
}

/// Features that facets are to follow.
#[derive(Default)]
struct Found<const D: usize> {
    /// Atoms are put on these.
    pieces: Option<Pieces<D>>,
    /// Facets are turned onto these, which are too ragged for rows of atoms.
    crests: Vec<FeaturePoint<D>>,
}

/// The features, in lattice coordinates.
fn find_features<const D: usize>(
    inputs: &Inputs<'_, D>,
    options: &MeshOptions<D>,
    potential: &ScalarField<D>,
    distance: &NominalDistance<D>,
    watch: &mut dyn Watch,
) -> Result<Found<D>, RunError> {
    let grid = potential.grid();
    let kinds: Vec<FeatureOptions> = match &options.mixture {
        _ if inputs.is_potential => Vec::new(),
        Some(mixture) => (mixture.shares().iter())
            .map(|share| FeatureOptions { features: share.features, ..options.features })
            .collect(),
        None => vec![options.features],
    };
    let mut points = Vec::new();
    let mut is_valley = inputs.is_potential;
    for kind in kinds {
        let kind = FeatureOptions { units: options.units, ..kind };
        match enhance::feature_points(image_of(inputs, kind.features), &kind, watch)? {
            Some(found) => points.extend(found),
            None => is_valley |= kind.features != Features::None,
        }
    }
    if is_valley {
        points.extend(deep_valleys(potential, distance, options.features.repel, watch)?);
    }
    if options.improve.align == Align::Auto && Pieces::clean_share(&points, grid) < LEAST_CLEAN {
        let crests = wide_valleys(potential, distance, watch)?;
        return Ok(Found { crests, pieces: None });
    }
    let pieces = Pieces::new(points, grid, least_piece(grid, distance));
    Ok(Found { pieces: (!pieces.is_empty()).then_some(pieces), crests: Vec::new() })
}

/// The valleys of b that facets are measured against: of b smoothed by max(1, d/6) samples, deeper than a quarter, and in
/// large groups; in lattice coordinates.
fn wide_valleys<const D: usize>(
    potential: &ScalarField<D>,
    distance: &NominalDistance<D>,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, RunError> {
    let grid = potential.grid();
    let size = grid.in_samples(distance.least());
    let sigma = (size / 6.0).max(1.0);
    let found = enhance::valley_points(potential.samples(), grid, sigma, FOLLOWED_DEPTH, watch)?;
    Ok(in_large_groups(found, grid.shape, size))
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

/// b at the samples: enhanced, or as given.
fn potential_samples<const D: usize>(
    inputs: &Inputs<'_, D>,
    options: &MeshOptions<D>,
    warnings: &mut Vec<Warning>,
    watch: &mut dyn Watch,
) -> Result<Vec<f32>, RunError> {
    if inputs.is_potential {
        return Ok(enhance::given_potential(inputs.image.samples().clone())?);
    }
    let smooth = options.features.smooth.or_else(|| width_for_faces(inputs, options));
    let features = FeatureOptions { units: options.units, smooth, ..options.features };
    let image_of = |kind| image_of(inputs, kind);
    let enhanced = match &options.mixture {
        Some(mixture) => enhance::enhance_mixture(mixture, &features, image_of, watch)?,
        None => enhance::enhance(image_of(features.features), &features, watch)?,
    };
    if enhanced.constant {
        warnings.push(Warning::Constant);
    }
    Ok(enhanced.values)
}

/// How wide a potential that repels is made for Voronoi cells, where no width is asked for: a quarter of the
/// least d, so that the rows of atoms on both sides feel it (Hale 2002).
fn width_for_faces<const D: usize>(
    inputs: &Inputs<'_, D>,
    options: &MeshOptions<D>,
) -> Option<f64> {
    let is_line = matches!(options.features.features, Features::Dark | Features::Bright);
    if options.kind != MeshKind::Voronoi || !options.features.repel || !is_line {
        return None;
    }
    let grid = inputs.image.frame().grid(options.units);
    let distance = match options.size {
        _ if inputs.size_field.is_some() => return None,
        Size::Default => default_distance(&grid),
        Size::Constant(d) | Size::Range { min: d, .. } => d,
        Size::Wavelength { .. } => return None,
    };
    Some((0.25 * distance).max(grid.least_step()))
}

/// The image that features of a kind are looked for in.
fn image_of<'a, const D: usize>(inputs: &Inputs<'a, D>, kind: Features) -> &'a Image<D> {
    match (inputs.labels, kind) {
        (Some(labels), Features::Labels) => labels,
        _ => inputs.image,
    }
}

fn nominal_distance<const D: usize>(
    inputs: &Inputs<'_, D>,
    grid: &Grid<D>,
    options: &MeshOptions<D>,
    samples: &[f32],
) -> Result<NominalDistance<D>, RunError> {
    if let Some(field) = inputs.size_field {
        same_shape("size field", inputs.image.frame(), field)?;
        let values = field.samples().to_f32();
        return Ok(NominalDistance::from_field(grid, &values, GRADIENT_LIMIT)?);
    }
    Ok(match options.size {
        Size::Default => NominalDistance::constant(grid, default_distance(grid))?,
        Size::Constant(d) => NominalDistance::constant(grid, d)?,
        Size::Range { min, max } => {
            let grading = Grading { by: options.grade_by, ..Grading::new(min, max) };
            NominalDistance::from_potential(grid, samples, &grading)?
        }
        Size::Wavelength { frequency, points } => {
            let rate = (frequency * points) as f32;
            let mut lengths = inputs.image.samples().to_f32();
            lengths.iter_mut().for_each(|v| *v /= rate);
            NominalDistance::from_field(grid, &lengths, GRADIENT_LIMIT)?
        }
    })
}

fn same_shape<const D: usize>(
    name: &'static str,
    frame: &Frame<D>,
    field: &Image<D>,
) -> Result<(), RunError> {
    let (expected, found) = (frame.shape().to_vec(), field.frame().shape().to_vec());
    if expected == found { Ok(()) } else { Err(RunError::Shape { name, expected, found }) }
}
