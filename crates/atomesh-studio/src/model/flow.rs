//! Facets that hinder flow, wells, and what flows between them.
//!
//! Barriers and wells are kept by their places, so that they outlive a mesh. The facets of all features are barriers that
//! let nothing through; a gesture gives the nearest facet, or the feature that it is a part of, another multiplier.

use std::collections::BTreeMap;

use atomesh::features::FeatureFacetOptions;
use atomesh::geometry::{Point, distance_squared};
use atomesh::mesh::{FacetGroup, Mesh, Tags};
use atomesh::run::Outcome;
use atomesh::watch::Watch;
use atomesh_job::flow::{FlowMesh, FlowOptions, flow_on};
use atomesh_job::mesh::MadeMesh;
use atomesh_job::values::WellSpec;
use atomesh_job::{JobError, Session};

use super::Model;
use super::paint::distance_to_segment;
use crate::gesture::WellKind;

/// Streamlines that are shown.
const STREAMLINES: usize = 60;

/// What a gesture says of the facet nearest to a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Barrier<const D: usize> {
    /// The place, in lattice units.
    pub at: Point<D>,
    /// Whether the whole feature is meant.
    pub whole: bool,
    /// The share of flow that passes.
    pub multiplier: f64,
}

/// A place where fluid comes in or goes out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Well<const D: usize> {
    /// Which of the two.
    pub kind: WellKind,
    /// The place, in lattice units.
    pub at: Point<D>,
}

/// A facet that hinders flow, or was opened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownFacet<const D: usize> {
    /// Its corners in lattice units.
    pub corners: [Point<D>; D],
    /// The number of its feature, from 1; 0 for a facet of none.
    pub feature: u32,
    /// The share of flow that passes.
    pub multiplier: f64,
}

/// What flows.
#[derive(Clone, Debug, Default)]
pub struct Flow<const D: usize> {
    /// Barriers, and facets of features that were opened.
    pub facets: Vec<ShownFacet<D>>,
    /// Streamlines in lattice units; none without wells.
    pub lines: Vec<Vec<Point<D>>>,
    /// What flows through each well, in the order of the wells; into the domain is positive.
    pub rates: Vec<f64>,
    /// The imbalance over all that flows.
    pub imbalance: Option<f64>,
    /// Why nothing flows, or what is odd.
    pub notes: Vec<String>,
}

/// The facets that hinder flow, by ascending corners: the number of the feature and the multiplier of each.
type Barriers<const D: usize> = BTreeMap<[u32; D], (u32, f64)>;

impl<const D: usize> Model<D> {
    /// Barriers as they lie on the mesh, and what flows if there are wells.
    ///
    /// # Errors
    /// [`JobError`] if there is no mesh, or the watch ends the work; that nothing flows is a note.
    pub fn flow(&mut self, watch: &mut dyn Watch) -> Result<std::sync::Arc<Flow<D>>, JobError> {
        if let Some(flow) = self.stages.flow() {
            return Ok(flow);
        }
        let outcome = self.refresh(watch)?;
        let flow = match outcome.cells() {
            Some(_) => self.answer(&outcome, None, watch)?,
            None => {
                let barriers = self.barriers_on(&outcome, watch)?;
                self.answer(&outcome, Some(&barriers), watch)?
            }
        };
        Ok(self.stages.keep_flow(flow))
    }

    fn barriers_on(
        &self,
        outcome: &Outcome<D>,
        watch: &mut dyn Watch,
    ) -> Result<Barriers<D>, JobError> {
        let world = outcome.world_mesh();
        let options = FeatureFacetOptions::default();
        let found = outcome.features(&world, &options, watch).map_err(|e| self.refusal(e))?;
        let mut barriers = Barriers::new();
        for (feature, number) in found.features.iter().zip(1..) {
            for facet in &feature.facets {
                barriers.insert(ascending(*facet), (number, 0.0));
            }
        }
        let mesh = outcome.mesh();
        let all: Vec<[u32; D]> = match self.barriers.iter().any(|barrier| !barrier.whole) {
            true => mesh.facets().into_iter().map(|facet| ascending(facet.corners)).collect(),
            false => Vec::new(),
        };
        for barrier in &self.barriers {
            if barrier.whole {
                let nearest = nearest(mesh, barriers.keys(), &barrier.at);
                let Some((feature, _)) = nearest.and_then(|facet| barriers.get(&facet).copied())
                else {
                    continue;
                };
                let of_feature = barriers.values_mut().filter(|(number, _)| *number == feature);
                of_feature.for_each(|(_, multiplier)| *multiplier = barrier.multiplier);
            } else if let Some(facet) = nearest(mesh, all.iter(), &barrier.at) {
                barriers.entry(facet).or_insert((0, 1.0)).1 = barrier.multiplier;
            }
        }
        Ok(barriers)
    }

    fn answer(
        &mut self,
        outcome: &Outcome<D>,
        barriers: Option<&Barriers<D>>,
        watch: &mut dyn Watch,
    ) -> Result<Flow<D>, JobError> {
        let points = outcome.mesh().points();
        let shown =
            barriers.into_iter().flatten().map(|(facet, (feature, multiplier))| ShownFacet {
                corners: facet.map(|corner| points[corner as usize]),
                feature: *feature,
                multiplier: *multiplier,
            });
        let mut flow = Flow { facets: shown.collect(), ..Flow::default() };
        let has = |kind| self.wells.iter().any(|well| well.kind == kind);
        if !(has(WellKind::Source) && has(WellKind::Sink)) {
            if !self.wells.is_empty() {
                flow.notes.push("flow needs a source and a sink".into());
            }
            return Ok(flow);
        }
        match self.solve(outcome, barriers, &mut flow, watch) {
            Err(e) if e.kind() == atomesh_job::ErrorKind::Cancelled => Err(e),
            Err(e) => {
                flow.notes.push(e.to_string());
                Ok(flow)
            }
            Ok(()) => Ok(flow),
        }
    }

    fn solve(
        &mut self,
        outcome: &Outcome<D>,
        barriers: Option<&Barriers<D>>,
        flow: &mut Flow<D>,
        watch: &mut dyn Watch,
    ) -> Result<(), JobError> {
        let images = self.images(watch)?;
        let made = MadeMesh {
            run: &self.run,
            outcome,
            image: None,
            world: &images.world,
            properties: &[],
            regions: None,
        };
        let tools = self.axes.dimension.tools;
        let mut options = FlowOptions::default();
        let mesh = match barriers {
            None => made.loaded_cells().map(FlowMesh::of_cells),
            Some(barriers) => {
                let mut loaded = made.loaded()?;
                let groups = groups(barriers);
                for (name, multiplier, _) in &groups {
                    let spec = format!("{name}={multiplier}").parse();
                    options.barrier.push(spec.map_err(|e: String| JobError::misuse(e))?);
                }
                loaded.tags = sides_alone(&loaded.mesh, &loaded.tags, groups)?;
                Some(FlowMesh::of_mesh(loaded, tools)?)
            }
        };
        let mesh = mesh.ok_or_else(|| JobError::content("there are no cells"))?;
        let (units, frame) = (outcome.units(), *outcome.frame());
        for well in &self.wells {
            let place = frame.lattice_to_world(units, &well.at).map(|x| x.to_string()).join(",");
            let spec: WellSpec = place.parse().map_err(|e: String| JobError::misuse(e))?;
            match well.kind {
                WellKind::Source => options.source.push(spec),
                WellKind::Sink => options.sink.push(spec),
            }
        }
        let mut session = Session::new(watch);
        let dimension = &self.axes.dimension;
        let answer = flow_on(mesh, &options, &Default::default(), dimension, &mut session)?;
        let lines = answer.streamlines(STREAMLINES, &dimension.flow, &mut session)?;
        let place = |p: &Point<D>| frame.world_to_lattice(units, p);
        flow.lines = lines.iter().map(|line| line.points.iter().map(place).collect()).collect();
        flow.rates = in_order(&self.wells, answer.solution.wells.iter().map(|well| well.rate));
        flow.imbalance = Some(answer.balance(&dimension.flow).relative_error());
        flow.notes.extend(session.notes().iter().map(ToString::to_string));
        Ok(())
    }
}

/// Rates of sources, then of sinks, in the order of the wells.
fn in_order<const D: usize>(wells: &[Well<D>], rates: impl Iterator<Item = f64>) -> Vec<f64> {
    let of_kind = |kind| (0..wells.len()).filter(move |&w| wells[w].kind == kind);
    let order = of_kind(WellKind::Source).chain(of_kind(WellKind::Sink));
    let mut placed = vec![0.0; wells.len()];
    order.zip(rates).for_each(|(well, rate)| placed[well] = rate);
    placed
}

fn ascending<const D: usize>(mut facet: [u32; D]) -> [u32; D] {
    facet.sort_unstable();
    facet
}

/// The facet nearest to a place; in space by its centre. Of two as near the lesser.
fn nearest<'a, const D: usize>(
    mesh: &Mesh<D>,
    facets: impl Iterator<Item = &'a [u32; D]>,
    at: &Point<D>,
) -> Option<[u32; D]> {
    let points = mesh.points();
    let distance = |facet: &[u32; D]| {
        let corners = facet.map(|corner| points[corner as usize]);
        if D == 2 {
            return distance_to_segment(at, &corners[0], &corners[1]);
        }
        let centre =
            std::array::from_fn(|k| corners.iter().map(|corner| corner[k]).sum::<f64>() / D as f64);
        distance_squared(at, &centre).sqrt()
    };
    let measured = facets.map(|facet| (distance(facet), *facet));
    measured.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, facet)| facet)
}

/// Barriers by their multipliers, with names; those that let all through are none.
fn groups<const D: usize>(barriers: &Barriers<D>) -> Vec<(String, f64, Vec<[u32; D]>)> {
    let mut groups: Vec<(String, f64, Vec<[u32; D]>)> = Vec::new();
    for (facet, (_, multiplier)) in barriers.iter().filter(|(_, (_, m))| *m < 1.0) {
        match groups.iter_mut().find(|(_, m, _)| m == multiplier) {
            Some((.., facets)) => facets.push(*facet),
            None => {
                let name = format!("barrier-{}", groups.len() + 1);
                groups.push((name, *multiplier, vec![*facet]));
            }
        }
    }
    groups
}

/// The sides of the box, with the barriers beside them.
fn sides_alone<const D: usize>(
    mesh: &Mesh<D>,
    tags: &Tags<D>,
    barriers: Vec<(String, f64, Vec<[u32; D]>)>,
) -> Result<Tags<D>, JobError> {
    let is_side = |name: &str| name.ends_with("min") || name.ends_with("max");
    let sides = tags.facet_groups().iter().filter(|group| is_side(&group.name)).cloned();
    let mut groups: Vec<FacetGroup<D>> = sides.collect();
    let next = groups.iter().map(|group| group.id).max().unwrap_or(0) + 1;
    let barriers = barriers.into_iter().zip(next..);
    groups.extend(barriers.map(|((name, _, facets), id)| FacetGroup { id, name, facets }));
    Tags::new(mesh, groups, None).map_err(JobError::content)
}
