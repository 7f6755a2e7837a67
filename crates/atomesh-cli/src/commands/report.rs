//! `atomesh report`: how good any mesh is, for an image potential.

use atomesh_job::JobError;
use atomesh_job::measure::{MeasureRequest, measure_file};

use crate::progress::Progress;

/// Measure the shape of a mesh and how it follows the features of a potential
///
/// Shape: q = D · inradius / circumradius per cell (1 if equilateral), the least angle (dihedral in
/// 3-D), edge lengths, and how far the volume is from the image's box.
///
/// Alignment: features are the valleys of the potential, smoothed by max(1, d/6) samples, deeper than
/// 0.25, in groups of at least 4d (2-D) or 6d² (3-D) samples. Recall is the share of them that a facet
/// passes within max(1 sample, d/10) and 20°. Precision is the share, by length or area, of the facets with a
/// mean potential of -0.2 or less that lies as near to features. Distances are in samples.
///
/// Fidelity, with --image: RMS error of the image rebuilt from the mesh, with the mean of each cell and with the
/// continuous piecewise linear fit of least squares. Homogeneity, with --labels: share of a cell that its
/// dominant label fills, averaged over the volume.
///
/// Of Voronoi cells: counts, volumes, faces and their right angles to the lines between sites; recall of the features of -|b|;
/// homogeneity. They have neither angles, quality, precision nor fidelity.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  atomesh mesh t1.nii.gz -o brain.vtu --features edges --size 6 --write-potential b.nii.gz
  atomesh report brain.vtu --potential b.nii.gz --json brain.json
  atomesh report brain.vtu --potential b.nii.gz --image t1.nii.gz --html brain.html
  atomesh report other.msh --potential b.npy --size 6 --origin -98,-134,-72")]
pub struct ReportArgs {
    #[command(flatten)]
    request: MeasureRequest,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if a file cannot be used or options make no sense.
pub fn run(args: ReportArgs, progress: &mut Progress) -> Result<String, JobError> {
    let mut request = args.request;
    if request.json.is_none() && request.html.is_none() {
        request.json = Some("-".into());
    }
    progress.job(|session| measure_file(&request, session), |_, _| String::new())?;
    Ok(String::new())
}
