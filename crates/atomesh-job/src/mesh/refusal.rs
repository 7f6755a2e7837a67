//! What the core refuses, in terms of the options and files that are to blame.

use std::path::Path;

use atomesh::enhance::EnhanceError;
use atomesh::fields::{DistanceError, FieldError};
use atomesh::improve::ImproveError;
use atomesh::lattice::LatticeError;
use atomesh::optimize::OptimizeError;
use atomesh::region::RegionError;
use atomesh::run::RunError;

use crate::error::{JobError, is_option};
use crate::options::RunConfig;

/// The error of a run, about the file or option that is to blame.
pub fn refusal(run: &RunConfig, error: RunError) -> JobError {
    let (input, shown) = (&run.input, run.input.shown());
    match &error {
        e if e.is_cancelled() => JobError::cancelled(),
        RunError::Memory { .. } | RunError::FeatureMemory { .. } => {
            JobError::memory(error).about_any(shown)
        }
        RunError::LatticeDimension { .. } | RunError::Crowded { .. } => {
            JobError::misuse(error).about_any(shown)
        }
        RunError::Lattice(LatticeError::SeedOutside { index, .. }) => {
            outside(run, *index).about_any(shown)
        }
        RunError::Lattice(LatticeError::SeedsNear { first, second, .. }) => {
            let [first, second] = [*first, *second].map(|index| seed_point(run, index));
            JobError::misuse(format!("--seed-point {first} and {second} are nearly one place"))
                .advise("give it once, or two that are farther apart")
                .about_any(shown)
        }
        RunError::NoVelocity { .. } => JobError::content(error)
            .about_any(shown)
            .advise("--size MIN..MAX beside --frequency gives a least length"),
        RunError::Frame { .. } => JobError::content(error)
            .about_any(shown)
            .advise("--origin puts the samples nearer to 0, where numbers are dense"),
        RunError::Enhance(EnhanceError::OutOfRange { .. })
        | RunError::Potential(FieldError::Potential { .. }) => {
            JobError::content(error).about_any(input.potential.as_deref().or(shown))
        }
        RunError::Potential(FieldError::Weight { index: Some(_), .. }) => {
            JobError::content(error).about_any(input.beta_field.as_deref())
        }
        RunError::Region(RegionError::Label { .. }) => {
            JobError::content(error).about_any(input.labels.as_deref())
        }
        RunError::Region(_) => JobError::content(error).about_any(input.mask_file().or(shown)),
        RunError::Distance(reason) => distance(run, reason),
        RunError::Shape { name, .. } => {
            let file = field(run, name);
            JobError::content(error).about_any(file)
        }
        RunError::Enhance(e) if is_option(e) => JobError::misuse(error),
        RunError::Potential(FieldError::Weight { .. })
        | RunError::Lattice(LatticeError::SpacingFactor { .. })
        | RunError::Optimize(OptimizeError::Option { .. })
        | RunError::Improve(ImproveError::MinAngle { .. }) => JobError::misuse(error),
        _ => JobError::content(error).about_any(shown),
    }
}

/// A seed point as it was given.
fn seed_point(run: &RunConfig, index: usize) -> String {
    let point = run.lattice.seed_point.iter().flatten().nth(index);
    point.map_or_else(String::new, ToString::to_string)
}

/// A seed point that is not in the image.
fn outside(run: &RunConfig, index: usize) -> JobError {
    let point = seed_point(run, index);
    JobError::misuse(format!("--seed-point {point} lies outside the image"))
        .advise("places are in world coordinates; atomesh info IMAGE shows the box")
}

/// A nominal distance that is out of range.
fn distance(run: &RunConfig, error: &DistanceError) -> JobError {
    let shown = run.input.shown();
    match error {
        _ if run.input.size_field.is_some() => {
            JobError::content(error).about_any(run.input.size_field.as_deref())
        }
        DistanceError::BelowStep { .. } if run.lattice.frequency.is_some() => {
            JobError::misuse(error)
                .about_any(shown)
                .advise("choose a lower --frequency or fewer --points-per-wavelength")
        }
        DistanceError::BelowStep { .. } => JobError::misuse(error)
            .about_any(shown)
            .advise("choose a greater --size, or resample the image"),
        _ => JobError::misuse(error),
    }
}

/// The file of a field by the core's name for it.
fn field<'a>(run: &'a RunConfig, name: &str) -> Option<&'a Path> {
    let input = &run.input;
    let file = match name {
        "size field" => &input.size_field,
        "mask" => return input.mask_file(),
        "label image" => &input.labels,
        _ => &input.beta_field,
    };
    file.as_deref()
}
