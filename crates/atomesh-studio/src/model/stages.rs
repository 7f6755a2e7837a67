//! What is made of the image, stage by stage, and how much of it a change leaves.
//!
//! A change touches a stage; those before it stay. Where only b or β changed, the box is filled as before, and the run goes
//! on from the same atoms. What comes out is what a run from the image gives, to the bit.

use std::sync::Arc;

use atomesh::geometry::Point;
use atomesh::image::{Image, Samples};
use atomesh::lattice::Lattice;
use atomesh::region::CellFinder;
use atomesh::run::{MeshKind, Outcome, Prepared, RunError, Settled, Size};
use atomesh::watch::{AtomsView, Phase, Watch};
use atomesh_job::mesh::{GivenField, GivenFields, MeshImages, prepare, refusal};
use atomesh_job::options::RunConfig;
use atomesh_job::{JobError, Session};

use super::Model;
use super::flow::Flow;
use super::parts::Clustered;
use super::regions::OnMesh;
use crate::gesture::PaintedField;

/// Bytes of the largest record of iterations.
const MOST_RECORDED: usize = 1 << 25;

/// The first stage that a change touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Touched {
    /// The images beside the first.
    Images,
    /// Filling the box, since d(x) is another.
    Fill,
    /// Moving the atoms, since b(x) or β(x) are others.
    Settle,
    /// What comes after the atoms have settled.
    Improve,
}

/// The stages made so far. A stage that is there stands for all before it.
#[derive(Clone, Debug)]
pub struct Stages<const D: usize> {
    images: Option<Arc<MeshImages<D>>>,
    /// d(x) without paint, at the samples.
    automatic: Option<Arc<Vec<f32>>>,
    prepared: Option<Prepared<D>>,
    filled: Option<Arc<Lattice<D>>>,
    settled: Option<Arc<Settled<D>>>,
    playback: Option<Arc<Playback>>,
    outcome: Option<Arc<Outcome<D>>>,
    flow: Option<Arc<Flow<D>>>,
    finder: Option<Arc<CellFinder<D>>>,
    clustered: Option<Arc<Clustered>>,
    regions: Option<Arc<OnMesh>>,
}

impl<const D: usize> Default for Stages<D> {
    fn default() -> Self {
        Self {
            images: None,
            automatic: None,
            prepared: None,
            filled: None,
            settled: None,
            playback: None,
            outcome: None,
            flow: None,
            finder: None,
            clustered: None,
            regions: None,
        }
    }
}

impl<const D: usize> Stages<D> {
    /// The images, if they were placed.
    pub fn images(&self) -> Option<&MeshImages<D>> {
        self.images.as_deref()
    }

    /// The same, to be kept.
    pub fn images_shared(&self) -> Option<Arc<MeshImages<D>>> {
        self.images.clone()
    }

    /// The fields, if they were made.
    pub fn prepared(&self) -> Option<&Prepared<D>> {
        self.prepared.as_ref()
    }

    /// The mesh, if it was made.
    pub fn outcome(&self) -> Option<Arc<Outcome<D>>> {
        self.outcome.clone()
    }

    /// The iterations of the atoms' way, if they have settled.
    pub fn playback(&self) -> Option<Arc<Playback>> {
        self.playback.clone()
    }

    /// What flows, if it was computed.
    pub fn flow(&self) -> Option<Arc<Flow<D>>> {
        self.flow.clone()
    }

    /// What finds the mesh's cells, if anything did.
    pub fn finder(&self) -> Option<Arc<CellFinder<D>>> {
        self.finder.clone()
    }

    /// The cells in parts, if they were made.
    pub fn clustered(&self) -> Option<Arc<Clustered>> {
        self.clustered.clone()
    }

    /// The regions on the mesh, if there are any and they were made.
    pub fn regions(&self) -> Option<Arc<OnMesh>> {
        self.regions.clone()
    }

    /// The atoms where they have settled; none before.
    pub fn settled_atoms(&self) -> &[Point<D>] {
        self.settled.as_ref().map_or(&[], |settled| settled.lattice().atoms())
    }

    /// How much was made that takes time: atoms, the mesh, its parts.
    pub fn made_count(&self) -> usize {
        let made = [self.settled.is_some(), self.outcome.is_some(), self.clustered.is_some()];
        made.into_iter().filter(|is_made| *is_made).count()
    }

    pub(super) fn images_or(
        &mut self,
        make: impl FnOnce() -> Result<MeshImages<D>, JobError>,
    ) -> Result<Arc<MeshImages<D>>, JobError> {
        if self.images.is_none() {
            self.images = Some(Arc::new(make()?));
        }
        Ok(self.images.clone().expect("they were made above"))
    }

    pub(super) fn keep_outcome(&mut self, outcome: Outcome<D>) -> Arc<Outcome<D>> {
        let outcome = Arc::new(outcome);
        self.outcome = Some(outcome.clone());
        outcome
    }

    pub(super) fn keep_flow(&mut self, flow: Flow<D>) -> Arc<Flow<D>> {
        let flow = Arc::new(flow);
        self.flow = Some(flow.clone());
        flow
    }

    pub(super) fn keep_finder(&mut self, finder: CellFinder<D>) -> Arc<CellFinder<D>> {
        self.finder.insert(Arc::new(finder)).clone()
    }

    pub(super) fn keep_clustered(&mut self, clustered: Clustered) -> Arc<Clustered> {
        self.clustered.insert(Arc::new(clustered)).clone()
    }

    pub(super) fn keep_regions(&mut self, regions: OnMesh) -> Arc<OnMesh> {
        self.regions.insert(Arc::new(regions)).clone()
    }

    pub(super) fn forget_flow(&mut self) {
        self.flow = None;
    }

    pub(super) fn forget_regions(&mut self) {
        self.regions = None;
    }

    pub(super) fn forget_outcome(&mut self) {
        self.outcome = None;
        self.flow = None;
        self.finder = None;
        self.clustered = None;
        self.regions = None;
    }

    /// Forgets what a change touches.
    pub(super) fn forget(&mut self, touched: Touched) {
        self.forget_outcome();
        self.prepared = None;
        if touched <= Touched::Images {
            self.images = None;
            self.automatic = None;
        }
        if touched <= Touched::Fill {
            self.filled = None;
        }
        if touched <= Touched::Settle {
            self.settled = None;
            self.playback = None;
        }
    }

    pub(super) fn forget_automatic(&mut self) {
        self.automatic = None;
    }
}

/// The first stage that differs between two runs on the same image.
pub(super) fn touched<const D: usize>(from: &RunConfig, to: &RunConfig) -> Touched {
    let mut same = from.clone();
    if (&from.input, &from.frame, &from.regions) != (&to.input, &to.frame, &to.regions) {
        return Touched::Images;
    }
    same.improve.min_angle = to.improve.min_angle;
    if same == *to {
        return Touched::Improve;
    }
    let mut beside = from.lattice.clone();
    beside.beta = to.lattice.beta;
    let size = to.mesh_options::<D>().map(|options| options.size);
    let grades = !matches!(size, Ok(Size::Default | Size::Constant(_)));
    let is_b_other =
        from.features != to.features || from.optimize.interpolation != to.optimize.interpolation;
    if beside != to.lattice || from.optimize.seed != to.optimize.seed || (grades && is_b_other) {
        return Touched::Fill;
    }
    Touched::Settle
}

impl<const D: usize> Model<D> {
    /// b, β and d.
    pub(super) fn prepared(&mut self, watch: &mut dyn Watch) -> Result<Prepared<D>, JobError> {
        if let Some(prepared) = &self.stages.prepared {
            return Ok(prepared.clone());
        }
        let mut images = (*self.images(watch)?).clone();
        let given = self.painted_fields(watch)?;
        let run = self.job_run();
        let mut session = Session::new(watch);
        images.take_given(&run, given, &mut session)?;
        let (prepared, _) = prepare(&run, images, &self.axes.dimension, &mut session)?;
        self.stages.prepared = Some(prepared.clone());
        Ok(prepared)
    }

    /// The atoms where they end.
    pub(super) fn settled(&mut self, watch: &mut dyn Watch) -> Result<Arc<Settled<D>>, JobError> {
        let prepared = self.prepared(watch)?;
        let is_of_these = |settled: &&Arc<Settled<D>>| {
            std::ptr::eq(settled.run().potential(), prepared.potential())
        };
        if let Some(settled) = self.stages.settled.as_ref().filter(is_of_these) {
            return Ok(settled.clone());
        }
        if let Some(settled) = &self.stages.settled {
            // settled in equal fields, before what comes after was changed
            let again = prepared.with_settled(settled.lattice().clone());
            let again = Arc::new(again.map_err(|e| self.refusal(e))?);
            self.stages.settled = Some(again.clone());
            return Ok(again);
        }
        let filled = match &self.stages.filled {
            Some(lattice) => prepared.with_atoms((**lattice).clone()),
            None => prepared.fill(watch),
        };
        let filled = filled.map_err(|e| self.refusal(e))?;
        self.stages.filled = Some(Arc::new(filled.lattice().clone()));
        let mut recorder = Recorder { watch, playback: Playback::of::<D>(), skipped: 0 };
        let settled = filled.settle(&mut recorder);
        let playback = recorder.playback;
        let settled = Arc::new(settled.map_err(|e| self.refusal(e))?);
        self.stages.settled = Some(settled.clone());
        self.stages.playback = Some(Arc::new(playback));
        Ok(settled)
    }

    /// The mesh of settled atoms.
    pub(super) fn finish(
        &self,
        settled: Settled<D>,
        watch: &mut dyn Watch,
    ) -> Result<Outcome<D>, JobError> {
        let kind = settled.run().options().kind;
        let made = match kind {
            MeshKind::Delaunay => settled
                .connect(watch)
                .and_then(|connected| connected.improve(watch))
                .and_then(|improved| improved.finish(watch)),
            MeshKind::Voronoi => settled.divide(watch).and_then(|divided| divided.finish(watch)),
        };
        made.map_err(|e| self.refusal(e))
    }

    pub(super) fn refusal(&self, error: RunError) -> JobError {
        refusal(&self.run, error)
    }

    /// d(x) without paint, at the samples.
    pub(super) fn automatic_size(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<Arc<Vec<f32>>, JobError> {
        if let Some(automatic) = &self.stages.automatic {
            return Ok(automatic.clone());
        }
        let images = (*self.images(watch)?).clone();
        let mut session = Session::new(watch);
        let (prepared, _) = prepare(&self.run, images, &self.axes.dimension, &mut session)?;
        let automatic = Arc::new(prepared.distance_at_samples());
        self.stages.automatic = Some(automatic.clone());
        Ok(automatic)
    }

    /// The painted fields, as the options `--size-field` and `--beta-field` take them.
    ///
    /// # Errors
    /// [`JobError`] if the automatic ones cannot be made.
    pub fn painted_fields(&mut self, watch: &mut dyn Watch) -> Result<GivenFields<D>, JobError> {
        let mut given = GivenFields::default();
        if self.size_paint.is_some() {
            let automatic = self.automatic_size(watch)?;
            let values = self.size_paint.as_ref().map(|paint| paint.over_size(&automatic));
            given.size_field = values.map(|values| self.field(values, watch)).transpose()?;
        }
        if self.weight_paint.is_some() {
            let constant = self.run.mesh_options::<D>()?.image_weight as f32;
            let values = self.weight_paint.as_ref().map(|paint| paint.over_weight(constant));
            given.weight_field = values.map(|values| self.field(values, watch)).transpose()?;
        }
        Ok(given)
    }

    fn field(
        &mut self,
        values: Vec<f32>,
        watch: &mut dyn Watch,
    ) -> Result<GivenField<D>, JobError> {
        let images = self.images(watch)?;
        let image = Image::new(*images.image.frame(), Samples::F32(values.into()));
        Ok(GivenField {
            image: image.map_err(JobError::content)?,
            units: images.world.units.clone(),
        })
    }

    pub(super) fn touch(&mut self, touched: Touched) {
        self.stages.forget(touched);
        self.edited = match touched {
            // atoms stay where they are when only what comes after them changes
            Touched::Improve => self.edited.take(),
            _ => {
                self.regions.lose_atoms();
                None
            }
        };
    }

    pub(super) fn touch_paint(&mut self, field: PaintedField) {
        self.touch(match field {
            PaintedField::Size => Touched::Fill,
            PaintedField::Weight => Touched::Settle,
        });
    }

    pub(super) fn forget_automatic_size(&mut self) {
        self.stages.forget_automatic();
    }
}

/// The atoms after each iteration, or after every so many.
#[derive(Clone, Debug, PartialEq)]
pub struct Playback {
    /// Coordinates of an atom.
    pub dimension: usize,
    /// How many iterations there are from one frame to the next.
    pub stride: usize,
    /// The coordinates of all atoms, frame by frame, in lattice units.
    pub frames: Vec<Vec<f32>>,
    /// The energy of each frame: the pairs' part and the image's.
    pub energies: Vec<[f64; 2]>,
}

impl Playback {
    fn of<const D: usize>() -> Self {
        Self { dimension: D, stride: 1, frames: Vec::new(), energies: Vec::new() }
    }

    /// Leaves out every second frame.
    fn thin(&mut self) {
        let mut number = 0;
        let mut is_kept = || {
            number += 1;
            number % 2 == 1
        };
        self.frames.retain(|_| is_kept());
        let mut number = 0;
        self.energies.retain(|_| {
            number += 1;
            number % 2 == 1
        });
        self.stride *= 2;
    }
}

/// Records the atoms while they settle.
struct Recorder<'a> {
    watch: &'a mut dyn Watch,
    playback: Playback,
    /// Iterations since the last frame.
    skipped: usize,
}

impl Watch for Recorder<'_> {
    fn step(&mut self, phase: Phase, done: f64, energy: Option<f64>) -> std::ops::ControlFlow<()> {
        self.watch.step(phase, done, energy)
    }

    fn atoms(&mut self, _: Phase, atoms: AtomsView<'_>) {
        let playback = &mut self.playback;
        // a mesh of another count of atoms, as of mirrored pairs, is another record
        if playback.frames.first().is_some_and(|first| first.len() != atoms.coordinates.len()) {
            playback.frames.clear();
            playback.energies.clear();
        }
        if !playback.frames.is_empty() && self.skipped + 1 < playback.stride {
            self.skipped += 1;
            return;
        }
        self.skipped = 0;
        playback.frames.push(atoms.coordinates.iter().map(|x| *x as f32).collect());
        playback.energies.push([atoms.energy_atomic, atoms.energy_image]);
        let bytes: usize = playback.frames.iter().map(|frame| 4 * frame.len()).sum();
        if bytes > MOST_RECORDED && playback.frames.len() > 2 {
            playback.thin();
        }
    }
}
