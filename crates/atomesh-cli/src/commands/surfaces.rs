//! `atomesh surfaces`: groups of facets and closed surfaces of regions, out of a mesh file.

use atomesh_job::JobError;
use atomesh_job::files::shown;
use atomesh_job::surfaces::{SurfacesRequest, SurfacesSummary, surfaces_file};

use super::standard_output::StandardOutput;
use crate::progress::Progress;

/// Write tagged facets of a mesh, or the closed surface of a region, as surfaces
///
/// Groups of facets are what `info` lists: the sides of the box, a mask's outline (mask), interfaces between labels,
/// features. They are written as the mesh has them: interface-1-2 looks from label 1 to label 2. The surface of a
/// region is all that bounds its cells, the box's sides and the mask's outline too: it is closed, and looks
/// outward. In 2-D surfaces are polylines, and looking is to the right of each segment.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  atomesh mesh --labels tissue.nii.gz --size 4 -o brain.vtu
  atomesh surfaces brain.vtu -o all.vtp
  atomesh surfaces brain.vtu --region 2 -o grey.stl
  atomesh surfaces brain.vtu --group interface-1-2 --group mask -o pial.obj")]
pub struct SurfacesArgs {
    #[command(flatten)]
    request: SurfacesRequest,
    #[command(flatten)]
    standard_output: StandardOutput,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if a file cannot be used, or the mesh has no such group or region.
pub fn run(mut args: SurfacesArgs, progress: &mut Progress) -> Result<String, JobError> {
    args.standard_output.format(&mut args.request.output)?;
    let request = &args.request;
    let words = |found: &SurfacesSummary, _| summary(request, found);
    progress.job(|session| surfaces_file(request, session), words)?;
    Ok(String::new())
}

fn summary(request: &SurfacesRequest, found: &SurfacesSummary) -> String {
    let SurfacesSummary { groups, facets } = found;
    let group = if *groups == 1 { "group" } else { "groups" };
    format!("{}: {groups} {group} of {facets} facets", shown(&request.output))
}
