//! The fifth stage: the mesh whose facets follow features.

use rayon::prelude::*;

use crate::conform::{FeatureFacet, Unmet, feature_facets, unmet};
use crate::image::Samples;
use crate::improve::ImproveReport;
use crate::mesh::Mesh;
use crate::mirror::MirrorReport;
use crate::optimize::OptimizeReport;
use crate::region::{join_islands, outline_facets};
use crate::sample::{SampleOptions, Statistic, sample_in_frame};
use crate::watch::Watch;

use super::error::{RunError, Warning};
use super::outcome::Outcome;
use super::prepared::{Parts, Prepared};

/// The least share of features not met that is said.
const LEAST_UNMET: f64 = 0.03;

/// The mesh as it stays: facets on features, no cell flat.
#[derive(Clone, Debug)]
pub struct Improved<const D: usize> {
    pub(super) run: Prepared<D>,
    pub(super) mesh: Mesh<D>,
    pub(super) report: OptimizeReport,
    pub(super) mirror_report: Option<MirrorReport>,
    pub(super) improve_report: Option<ImproveReport>,
}

impl<const D: usize> Improved<D> {
    /// What the run was prepared from.
    pub fn run(&self) -> &Prepared<D> {
        &self.run
    }

    /// The mesh in lattice coordinates.
    pub fn mesh(&self) -> &Mesh<D> {
        &self.mesh
    }

    /// What was improved; `None` if nothing was asked for.
    pub fn improve_report(&self) -> Option<&ImproveReport> {
        self.improve_report.as_ref()
    }

    /// Labels the cells and reads the fields at the points.
    ///
    /// # Errors
    /// [`RunError::Sample`], also when cancelled.
    pub fn finish(self, watch: &mut dyn Watch) -> Result<Outcome<D>, RunError> {
        (self.run.parts().method.stages().finish)(self, watch)
    }
}

/// [`Improved::finish`].
pub(super) fn finish<const D: usize>(
    improved: Improved<D>,
    watch: &mut dyn Watch,
) -> Result<Outcome<D>, RunError> {
    let Improved { run, mesh, report, mirror_report, improve_report } = improved;
    let Parts { outline, labels, .. } = run.parts();
    let (potential, distance) = (run.potential(), run.distance());
    let outline_facets = match outline {
        Some(_) => outline_facets(&mesh, &run.bounds()),
        None => Vec::new(),
    };
    let labels = labels.as_ref();
    let labels = labels.map(|labels| label(&run, &mesh, labels, watch)).transpose()?;
    let points = mesh.points().par_iter().with_min_len(1 << 10);
    let distance_at_points = points.clone().map(|p| distance.at(p) as f32).collect();
    let (low, high) = potential.range(); // a spline passes beyond it at jumps
    let at = |p| (potential.value(p) as f32).clamp(low, high);
    let potential_at_points = points.map(at).collect();
    let (feature_facets, not_met) = met_features(&run, &mesh);
    let warnings = run.warnings().iter().cloned().chain(not_met).collect();
    Ok(Outcome {
        run,
        mesh,
        cells: None,
        distance_at_points,
        potential_at_points,
        optimize_report: report,
        improve_report,
        mirror_report,
        outline_facets,
        feature_facets,
        warnings,
        labels,
    })
}

/// The facets of the features that the mesh was made to keep to, and a warning if much of these is not met.
fn met_features<const D: usize>(
    run: &Prepared<D>,
    mesh: &Mesh<D>,
) -> (Vec<FeatureFacet<D>>, Option<Warning>) {
    let Some(pieces) = run.pieces() else { return (Vec::new(), None) };
    let facets = feature_facets(mesh, pieces, run.distance());
    let Unmet { share, places, .. } = unmet(mesh, &facets, pieces, run.distance());
    let warning = places.first().filter(|_| share >= LEAST_UNMET).map(|place| {
        let (frame, units) = (&run.parts().frame, run.options().units);
        let place = frame.lattice_to_world(units, place).map(|x| format!("{x:.6}"));
        let place = place.map(|x| x.trim_end_matches('0').trim_end_matches('.').to_string());
        Warning::NotMet { share, place: place.join(",") }
    });
    (facets, warning)
}

/// The label of each cell.
fn label<const D: usize>(
    run: &Prepared<D>,
    mesh: &Mesh<D>,
    samples: &[i32],
    watch: &mut dyn Watch,
) -> Result<Vec<i32>, RunError> {
    let frame = run.lattice_frame();
    let samples = Samples::I32(samples.to_vec());
    let statistics = SampleOptions::new(&[Statistic::Majority]);
    let found = sample_in_frame(mesh, &frame, &samples, statistics, watch)?;
    let mut labels: Vec<i32> = found.values[0].iter().map(|&label| label as i32).collect();
    join_islands(mesh, &mut labels, run.options().least_island);
    Ok(labels)
}
