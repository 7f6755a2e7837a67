//! From images and options to b(x), d(x) and β(x).

use crate::crests::Pieces;
use crate::enhance::{self, Enhanced, FeatureOptions, Features};
use crate::fields::{
    Fields, GRADIENT_LIMIT, Grading, ImageWeight, NominalDistance, ScalarField, default_distance,
};
use crate::image::{Frame, Grid, Image, Samples, Units};
use crate::improve::Align;
use crate::region::{Outline, label_samples, samples_inside};
use crate::watch::{Phase, Watch, check};

use super::error::{RunError, Warning};
use super::estimate::{crowding, feature_bytes};
use super::find::{Found, Known, find_features, kinds};
use super::inputs::Inputs;
use super::method::Method;
use super::options::{LatticeKind, MeshKind, MeshOptions, Size};
use super::prepared::{Parts, Prepared};

/// So many atoms in the place of one are said.
const MOST_CROWDED: f64 = 1.2;

/// Edges shorter than this, over d, because of a small spacing factor are refused: forces reach as many times as many
/// atoms as d asks for as there are, so that minutes pass on images of a thousand samples, and the mesh is not what was
/// asked for.
const SHORTEST_EDGES: f64 = 1.0 / 3.0;

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
    check_frame(&frame)?;
    method.crystal(options.lattice)?; // refuse early what does not fit the dimension
    check_memory(&inputs, &options)?;
    let mut warnings = Vec::new();
    let labels = labels(&inputs)?;
    let within = within_mask(&inputs)?;
    let inputs = Inputs { image: within.as_ref().unwrap_or(inputs.image), ..inputs };
    let Enhanced { values: mut samples, crests, .. } =
        enhanced(&inputs, &options, &mut warnings, watch)?;
    check(watch, Phase::Distance, 0.0, None)?;
    let distance = nominal_distance(&inputs, &grid, &options, &samples, &mut warnings)?;
    let outline = outline(&inputs, grid, &distance, watch)?;
    if let Some(outline) = &outline {
        outline.combine(&mut samples);
    }
    let weight = weight(&inputs, grid, options.image_weight)?;
    let is_masked = outline.is_some();
    warnings.extend(coarse(&grid, &distance));
    warnings.extend(crowded(&options, &distance)?);
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
            // where there are none, none are turned onto
            Some(_) if warnings.contains(&Warning::Constant) => {}
            Some(why) if has_features(&inputs, &options) && options.kind == MeshKind::Delaunay => {
                warnings.push(Warning::TurnedOnly { why: why.into() });
            }
            Some(_) => {}
            None => {
                let known = Known { potential: &potential, distance: &distance, crests };
                found = find_features(&inputs, &options, known, watch)?;
                warnings.extend(found.note.take());
            }
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
        are_ragged: found.are_ragged,
        faced,
    }))
}

/// The labels of the samples; NaN for those outside of the mask, which count in no cell.
fn labels<const D: usize>(inputs: &Inputs<'_, D>) -> Result<Option<Samples>, RunError> {
    let Some(image) = inputs.labels else { return Ok(None) };
    same_shape("label image", inputs.image.frame(), image)?;
    let labels = label_samples(image.samples())?;
    let Some(mask) = inputs.mask else { return Ok(Some(Samples::I32(labels.into()))) };
    same_shape("mask", inputs.image.frame(), mask)?;
    let inside = samples_inside(mask.samples())?;
    let masked = labels.iter().zip(inside);
    let masked = masked.map(|(&label, inside)| if inside { f64::from(label) } else { f64::NAN });
    Ok(Some(Samples::F64(masked.collect())))
}

/// The image without data outside of the mask, if it holds less than all.
fn within_mask<const D: usize>(inputs: &Inputs<'_, D>) -> Result<Option<Image<D>>, RunError> {
    let Some(mask) = inputs.mask.filter(|_| !inputs.is_potential) else { return Ok(None) };
    same_shape("mask", inputs.image.frame(), mask)?;
    let mut absent = samples_inside(mask.samples())?;
    absent.iter_mut().for_each(|flag| *flag = !*flag);
    if !absent.contains(&true) {
        return Ok(None);
    }
    if let Some(before) = inputs.image.absent() {
        absent.iter_mut().zip(before).for_each(|(flag, before)| *flag |= before);
    }
    let image = inputs.image.clone().with_absent(absent);
    Ok(Some(image.expect("the mask has the image's shape")))
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
        let known = Known { potential, distance, crests: None };
        return Ok(find_features(inputs, options, known, watch)?.pieces);
    }
    let features = FeatureOptions { repel: false, ..options.features };
    let attracting = MeshOptions { kind: MeshKind::Delaunay, features, ..options.clone() };
    // what is odd about it has been said
    let Enhanced { values, crests, .. } = enhanced(inputs, &attracting, &mut Vec::new(), watch)?;
    let narrow = ScalarField::potential(*potential.grid(), values, options.interpolation)?;
    let known = Known { potential: &narrow, distance, crests };
    Ok(find_features(inputs, &attracting, known, watch)?.pieces)
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

/// A warning where the spacing factor makes edges shorter than d.
///
/// # Errors
/// [`RunError::Crowded`] where they would be much shorter.
fn crowded<const D: usize>(
    options: &MeshOptions<D>,
    distance: &NominalDistance<D>,
) -> Result<Option<Warning>, RunError> {
    let (factor, crowding) = (options.spacing_factor, crowding(distance, options.spacing_factor));
    if options.lattice == LatticeKind::Random || crowding <= MOST_CROWDED {
        return Ok(None);
    }
    let share = crowding.powf(-1.0 / D as f64); // in proportion to the factor
    if share < SHORTEST_EDGES {
        let least = factor * SHORTEST_EDGES / share;
        return Err(RunError::Crowded { factor, share, least });
    }
    Ok(Some(Warning::Crowded { factor, share }))
}

/// Refuses images whose features need more memory to be found than there is.
fn check_memory<const D: usize>(
    inputs: &Inputs<'_, D>,
    options: &MeshOptions<D>,
) -> Result<(), RunError> {
    let Some(available) = options.memory_limit else { return Ok(()) };
    let kinds = kinds(inputs, options);
    let most = kinds.iter().map(|kind| feature_bytes(kind, kinds.len() > 1)).fold(0.0, f64::max);
    // b beside what makes it
    let needed = ((4.0 + most) * inputs.image.samples().len() as f64) as u64;
    if needed > available {
        return Err(RunError::FeatureMemory { needed, available });
    }
    Ok(())
}

/// Refuses samples so far from 0 that points between them would fall together.
fn check_frame<const D: usize>(frame: &Frame<D>) -> Result<(), RunError> {
    /// How far apart numbers may be, over the least spacing.
    const COARSEST: f64 = 1e-6;
    let spacing = frame.spacing().into_iter().fold(f64::INFINITY, f64::min);
    let last = frame.shape().map(|n| (n - 1) as f64);
    let ends = [frame.origin(), frame.lattice_to_world(Units::Samples, &last)];
    for (axis, value) in ends.iter().flat_map(|end| end.iter().copied().enumerate()) {
        if value.abs() * f64::EPSILON > COARSEST * spacing {
            return Err(RunError::Frame { axis, value, spacing });
        }
    }
    Ok(())
}

/// Whether features are asked for at all.
fn has_features<const D: usize>(inputs: &Inputs<'_, D>, options: &MeshOptions<D>) -> bool {
    let is_none = options.features.features == Features::None && options.mixture.is_none();
    inputs.is_potential || !is_none
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

/// b at the samples: enhanced, or as given.
fn enhanced<const D: usize>(
    inputs: &Inputs<'_, D>,
    options: &MeshOptions<D>,
    warnings: &mut Vec<Warning>,
    watch: &mut dyn Watch,
) -> Result<Enhanced<D>, RunError> {
    if inputs.is_potential {
        let mut values = enhance::given_potential(inputs.image.samples().clone())?;
        let absent = inputs.image.absent().unwrap_or_default();
        values.iter_mut().zip(absent).filter(|(_, a)| **a).for_each(|(b, _)| *b = 0.0);
        return Ok(Enhanced { values, constant: false, crests: None });
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
    Ok(enhanced)
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
pub(super) fn image_of<'a, const D: usize>(inputs: &Inputs<'a, D>, kind: Features) -> &'a Image<D> {
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
    warnings: &mut Vec<Warning>,
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
        Size::Wavelength { frequency, points, least, greatest } => {
            let continued = inputs.image.continued();
            let velocities = continued.as_ref().unwrap_or(inputs.image).samples().to_f32();
            let still = check_velocities(&velocities, least)?;
            warnings.extend(still);
            let rate = (frequency * points) as f32;
            let (least, greatest) = (least.unwrap_or(0.0), greatest.unwrap_or(f64::MAX));
            let length = |v: f32| (v / rate).max(least as f32).min(greatest as f32);
            let lengths: Vec<f32> = velocities.into_iter().map(length).collect();
            NominalDistance::from_field(grid, &lengths, GRADIENT_LIMIT)?
        }
    })
}

/// Says how many velocities carry no waves, where there is a least length to take there.
///
/// # Errors
/// [`RunError::NoVelocity`] where there is none.
fn check_velocities(velocities: &[f32], least: Option<f64>) -> Result<Option<Warning>, RunError> {
    let is_still = |v: &f32| v.is_nan() || *v <= 0.0;
    let Some(index) = velocities.iter().position(is_still) else { return Ok(None) };
    let (count, all) =
        (velocities.iter().copied().filter(|v| is_still(v)).count(), velocities.len());
    match least {
        Some(least) => Ok(Some(Warning::NoVelocity { count, all, least })),
        None => {
            let value = velocities[index].into();
            Err(RunError::NoVelocity { count, all, index, value })
        }
    }
}

fn same_shape<const D: usize>(
    name: &'static str,
    frame: &Frame<D>,
    field: &Image<D>,
) -> Result<(), RunError> {
    let (expected, found) = (frame.shape().to_vec(), field.frame().shape().to_vec());
    if expected == found { Ok(()) } else { Err(RunError::Shape { name, expected, found }) }
}
