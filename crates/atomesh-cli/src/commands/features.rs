//! `atomesh features`: the facets of a mesh that follow an image, as surfaces and as tags.

use std::fmt::Write;

use atomesh_job::JobError;
use atomesh_job::features::{FeaturesRequest, FeaturesSummary, features_file};

use super::standard_output::StandardOutput;
use crate::progress::Progress;

/// Find the facets of a mesh that follow features of an image: faults, horizons, outlines
///
/// Facets along which the potential b is low are chosen, freed of small pieces, and parted where more than
/// two of them meet into polylines (2-D) or surfaces (3-D), each turned one way: feature-1 is the largest.
/// They are written as surfaces, and as tagged facets of the mesh, beside the sides of the box.
///
/// b comes from an image, by the options of features below, or from a potential; it is read between samples
/// along each facet. Without either it is the mesh's own field `potential`, which is known at points alone and
/// therefore poorer: a facet between two features seems to lie on one.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Examples:
  atomesh mesh faults.png -o faults.vtu --size 8 --write-potential b.npy
  atomesh features faults.vtu --potential b.npy --below -0.2 -o faults.vtp
  atomesh features brain.vtu t1.nii.gz --features edges -o outlines.stl --mesh-output brain.msh"
)]
pub struct FeaturesArgs {
    #[command(flatten)]
    request: FeaturesRequest,
    #[command(flatten)]
    standard_output: StandardOutput,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if a file cannot be used or options make no sense.
pub fn run(mut args: FeaturesArgs, progress: &mut Progress) -> Result<String, JobError> {
    args.standard_output.format_any(&mut args.request.output)?;
    let request = &args.request;
    let words = |found: &FeaturesSummary, _| summary(request, found);
    progress.job(|session| features_file(request, session), words)?;
    Ok(String::new())
}

fn summary(request: &FeaturesRequest, found: &FeaturesSummary) -> String {
    let mut text = String::new();
    if found.from_points {
        text += "b is the mesh's own, at its points; an image or --potential tells more\n";
    }
    let FeaturesSummary { features, facets, selection, .. } = found;
    let _ = write!(
        text,
        "{}: {features} features of {facets} facets; {} chosen, {} added, {} dropped",
        request.mesh.display(),
        selection.chosen,
        selection.added,
        selection.dropped
    );
    text
}
