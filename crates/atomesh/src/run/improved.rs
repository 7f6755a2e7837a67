//! The fifth stage: the mesh whose facets follow features.

use std::collections::BTreeSet;

use crate::parallel::prelude::*;

use crate::conform::{FeatureFacet, Unmet, feature_facets, unmet};
use crate::features::{
    FacetField, FacetTest, FacetsOfFeature, Feature, FeatureFacetOptions, find_features,
};
use crate::fields::{Interpolation, NominalDistance, ScalarField};
use crate::geometry::{Point, dot};
use crate::image::{Samples, gaussian};
use crate::improve::ImproveReport;
use crate::measure::cell_shape;
use crate::mesh::Mesh;
use crate::mirror::MirrorReport;
use crate::optimize::OptimizeReport;
use crate::region::{LabelImage, fill_labels, join_islands, outline_facets, thin_layers};
use crate::sample::{SampleOptions, Statistic, sample_in_frame};
use crate::watch::{Phase, Watch, check};

use super::error::{RunError, Warning};
use super::options::MeshKind;
use super::outcome::Outcome;
use super::prepared::{Parts, Prepared};

/// The least share of features not met that is said.
const LEAST_UNMET: f64 = 0.03;

/// The least depth of valleys that facets follow where atoms are not put on features, of 1.
const FOLLOWED_DEPTH: f64 = 0.25;

/// The least share of a facet along valleys that makes it a facet of a feature.
const LEAST_FOLLOWED: f64 = 0.43;

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
    /// [`RunError::Flat`] if a cell has no volume to the precision of numbers; [`RunError::Sample`], also when cancelled.
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
    refuse_flat(&run, &mesh)?;
    let Parts { outline, labels, .. } = run.parts();
    let (potential, distance) = (run.potential(), run.distance());
    let outline_facets = match outline {
        Some(_) => outline_facets(&mesh, &run.bounds()),
        None => Vec::new(),
    };
    let labelled = labels.as_ref().map(|labels| label(&run, &mesh, labels, watch)).transpose()?;
    let (labels, lost) = labelled.unzip();
    let points = mesh.points().par_iter().with_min_len(1 << 10);
    let distance_at_points = points.clone().map(|p| distance.at(p) as f32).collect();
    let (low, high) = potential.range(); // a spline passes beyond it at jumps
    let at = |p| (potential.value(p) as f32).clamp(low, high);
    let potential_at_points = points.map(at).collect();
    let (feature_facets, not_met) = met_features(&run, &mesh);
    let followed = followed_features(&run, &mesh, watch)?;
    let low = improve_report.as_ref().and_then(|report| below_floor(&run, &mesh, report));
    let found = low.into_iter().chain(not_met).chain(lost.into_iter().flatten());
    let warnings = run.warnings().iter().cloned().chain(found).collect();
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
        followed,
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
    let warning = places.first().filter(|_| share >= LEAST_UNMET);
    let warning = warning.map(|place| Warning::NotMet { share, place: in_world(run, place) });
    (facets, warning)
}

/// A place in world coordinates, for people.
fn in_world<const D: usize>(run: &Prepared<D>, place: &Point<D>) -> String {
    let (frame, units) = (&run.parts().frame, run.options().units);
    let place = frame.lattice_to_world(units, place).map(|x| format!("{x:.6}"));
    place.map(|x| x.trim_end_matches('0').trim_end_matches('.').to_string()).join(",")
}

/// A cell is flat if its measure is at most this times the cube (2-D: square) of the longest edge at its first corner:
/// rounding of coordinates leaves as much of a cell without volume.
const FLAT: f64 = 1e-12;

/// Refuses a mesh whose cells are positive by exact arithmetic alone: no solver could use it. Not for Voronoi cells, whose
/// sites keep apart ([`crate::voronoi::sites_apart`]).
fn refuse_flat<const D: usize>(run: &Prepared<D>, mesh: &Mesh<D>) -> Result<(), RunError> {
    if run.options().kind == MeshKind::Voronoi {
        return Ok(());
    }
    let is_flat = |cell: &[u32]| {
        let simplex = mesh.simplex(cell);
        let squared = simplex.edges().iter().map(|edge| dot(edge, edge)).fold(0.0, f64::max);
        simplex.measure() <= FLAT * squared.powf(D as f64 / 2.0)
    };
    let cells = mesh.corners().par_chunks_exact(D + 1).with_min_len(1 << 10);
    let count = cells.clone().filter(|cell| is_flat(cell)).count();
    let Some(first) = cells.find_first(|cell| is_flat(cell)) else { return Ok(()) };
    let place = in_world(run, &middle(mesh, first));
    Err(RunError::Flat { count, all: mesh.cell_count(), place, dimension: D })
}

/// The mean of a cell's corners.
fn middle<const D: usize>(mesh: &Mesh<D>, corners: &[u32]) -> Point<D> {
    std::array::from_fn(|k| {
        let along = corners.iter().map(|&corner| mesh.points()[corner as usize][k]);
        along.sum::<f64>() / corners.len() as f64
    })
}

/// A warning if cells stay below the floor of angles, with the place of the flattest.
fn below_floor<const D: usize>(
    run: &Prepared<D>,
    mesh: &Mesh<D>,
    report: &ImproveReport,
) -> Option<Warning> {
    if report.floor_held {
        return None;
    }
    let cells = mesh.corners().par_chunks_exact(D + 1).with_min_len(1 << 10).enumerate();
    let angle = |cell: &[u32]| cell_shape(&mesh.simplex(cell).edges()).least_angle;
    let angles = cells.map(|(index, cell)| (angle(cell), index));
    let (least, flattest) = angles.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
    let middle = middle(mesh, mesh.cells().nth(flattest)?);
    Some(Warning::BelowFloor {
        count: report.below,
        all: mesh.cell_count(),
        floor: run.options().improve.min_angle,
        least,
        place: in_world(run, &middle),
    })
}

/// The facets along the valleys of b that facets are measured against, where atoms were not put on these: of b smoothed by
/// max(1, d/6) samples, deeper than a quarter.
fn followed_features<const D: usize>(
    run: &Prepared<D>,
    mesh: &Mesh<D>,
    watch: &mut dyn Watch,
) -> Result<Vec<FacetsOfFeature<D>>, RunError> {
    let Parts { grid, are_ragged, .. } = run.parts();
    if !are_ragged {
        return Ok(Vec::new());
    }
    let step = grid.step.iter().sum::<f64>() / D as f64;
    let size = run.distance().mean();
    check(watch, Phase::Measure, 0.0, None)?;
    let smooth = smoothed(run.potential(), run.distance())?;
    check(watch, Phase::Measure, 0.5, None)?;
    let reach = (0.1 * size).max(step);
    let field = FacetField::in_valleys(mesh, &smooth, reach, FOLLOWED_DEPTH, watch)?;
    let options = FeatureFacetOptions {
        below: -LEAST_FOLLOWED,
        test: FacetTest::Max,
        min_facets: 1,
        ..FeatureFacetOptions::default()
    };
    let found = find_features(mesh, &field, &options)?;
    let of = |feature: Feature<D>| FacetsOfFeature { facets: feature.facets, mean: feature.mean };
    Ok(found.features.into_iter().map(of).collect())
}

/// b as smooth as its valleys are looked for.
fn smoothed<const D: usize>(
    potential: &ScalarField<D>,
    distance: &NominalDistance<D>,
) -> Result<ScalarField<D>, RunError> {
    let grid = potential.grid();
    let sigma = (grid.in_samples(distance.least()) / 6.0).max(1.0);
    let mut samples = potential.samples().to_vec();
    gaussian(&mut samples, grid.shape, grid.in_least_steps().step.map(|step| sigma / step));
    samples.par_iter_mut().for_each(|b| *b = b.clamp(-1.0, 1.0)); // rounding
    Ok(ScalarField::potential(*grid, samples, Interpolation::Linear)?)
}

/// The label of each cell, and what was odd about labels.
fn label<const D: usize>(
    run: &Prepared<D>,
    mesh: &Mesh<D>,
    samples: &Samples,
    watch: &mut dyn Watch,
) -> Result<(Vec<i32>, Vec<Warning>), RunError> {
    let statistics = SampleOptions::new(&[Statistic::Majority]);
    let found = sample_in_frame(mesh, &run.lattice_frame(), samples, statistics, watch)?;
    // a cell at the rim of a mask may have no sample inside of it
    let known = |label: &f64| (!label.is_nan()).then_some(*label as i32);
    let found: Vec<Option<i32>> = found.values[0].iter().map(known).collect();
    let covering = fill_labels(mesh, &found);
    let mut labels = covering.clone();
    join_islands(mesh, &mut labels, run.options().least_island);
    check(watch, Phase::Measure, 1.0, None)?;
    let warnings = lost_labels(run, mesh, samples, [&covering, &labels]);
    Ok((labels, warnings))
}

/// Warnings of labels that no cell has, and of layers too thin for the edges asked for; `covering` are the cells' labels
/// before islands joined others, which the user asked for.
fn lost_labels<const D: usize>(
    run: &Prepared<D>,
    mesh: &Mesh<D>,
    samples: &Samples,
    [covering, labels]: [&[i32]; 2],
) -> Vec<Warning> {
    let image = LabelImage { grid: &run.parts().grid, samples };
    let measures = image.measures();
    let present: BTreeSet<i32> = labels.iter().copied().collect();
    let missing: Vec<i32> = measures.keys().copied().filter(|l| !present.contains(l)).collect();
    let mut layers = thin_layers(mesh, covering, image, &measures, run.distance());
    layers.retain(|layer| present.contains(&layer.label));
    let missing = (!missing.is_empty()).then_some(Warning::LabelsLost { labels: missing });
    let thin = (!layers.is_empty()).then_some(Warning::ThinLayers { layers });
    missing.into_iter().chain(thin).collect()
}
