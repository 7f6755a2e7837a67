//! What is opened and done: an image, options, paint, edited atoms, barriers, wells and regions, and the mesh made of them.
//!
//! A [`Model`] is a function of its image and of the gestures applied: the same gestures give the same bytes. What takes
//! time is made when it is asked for ([`Model::refresh`]), from the stage that the gestures since have touched, and shared
//! between clones, so that a clone costs little: undo keeps some.

mod any;
mod atoms;
mod flow;
mod opened;
mod paint;
mod parts;
mod regions;
mod stages;
mod wanted;

use std::path::Path;
use std::sync::Arc;

use atomesh::edit::Changes;
use atomesh::geometry::Point;
use atomesh::image::{Grid, Image, Units};
use atomesh::mesh::Regions;
use atomesh::run::Outcome;
use atomesh::watch::Watch;
use atomesh_job::mesh::{MadeMesh, MeshImages};
use atomesh_job::options::RunConfig;
use atomesh_job::sample::Property;
use atomesh_job::{Dimension, JobError, Session};

pub use any::AnyModel;
pub(crate) use any::each;
pub use atoms::Edited;
pub use flow::{Barrier, Flow, Well};
pub use opened::{AnyOpened, Opened, open, sha256};
pub use paint::Paint;
pub use parts::{MOST_PARTS, PartEdit};
use regions::Stroke;
pub use regions::{MOST_REGIONS, OnMesh, Painted};
pub use stages::Playback;

use crate::gesture::{Gesture, PaintedField};
use atomesh::mesh::Delaunay;
use stages::Stages;

/// What differs between the plane and space here, as values.
#[derive(Clone)]
pub struct Axes<const D: usize> {
    /// How jobs are done.
    pub dimension: Dimension<D>,
    /// How atoms are connected.
    pub delaunay: Delaunay<D>,
}

impl Axes<2> {
    /// In the plane.
    pub fn plane() -> Self {
        Self { dimension: Dimension::plane(), delaunay: Delaunay::<2>::new() }
    }
}

impl Axes<3> {
    /// In space.
    pub fn space() -> Self {
        Self { dimension: Dimension::space(), delaunay: Delaunay::<3>::new() }
    }
}

/// An image, what was done, and what was made of it.
#[derive(Clone)]
pub struct Model<const D: usize> {
    axes: Axes<D>,
    opened: Arc<Opened<D>>,
    run: RunConfig,
    size_paint: Option<Arc<Paint>>,
    weight_paint: Option<Arc<Paint>>,
    stages: Stages<D>,
    edited: Option<Arc<Edited<D>>>,
    barriers: Vec<Barrier<D>>,
    wells: Vec<Well<D>>,
    regions: Painted<D>,
}

impl<const D: usize> Model<D> {
    /// An image that was opened, with the options to begin with.
    ///
    /// # Errors
    /// [`JobError`] if options make no sense, or the image cannot be placed.
    pub fn new(
        axes: Axes<D>,
        opened: Opened<D>,
        run: RunConfig,
        watch: &mut dyn Watch,
    ) -> Result<Self, JobError> {
        run.check()?;
        let mut model = Self {
            axes,
            opened: Arc::new(opened),
            run,
            size_paint: None,
            weight_paint: None,
            stages: Stages::default(),
            edited: None,
            barriers: Vec::new(),
            wells: Vec::new(),
            regions: Painted::default(),
        };
        model.images(watch)?;
        Ok(model)
    }

    /// Does what a hand does. What was made stays as far as it is not touched.
    ///
    /// # Errors
    /// [`JobError`] if it cannot be done, or the watch ended the work; then nothing has changed.
    pub fn apply(&mut self, gesture: &Gesture, watch: &mut dyn Watch) -> Result<(), JobError> {
        match gesture {
            Gesture::Set { option, value } => self.set(option, value, watch),
            Gesture::Paint { field, value, radius, path } => {
                let path = self.lattice_path(path)?;
                self.paint(*field, *value, *radius, &path)
            }
            Gesture::Wipe { field } => {
                *self.paint_of(*field) = None;
                self.touch_paint(*field);
                Ok(())
            }
            Gesture::Add { at } => {
                let at = self.lattice_place(at)?;
                self.edit(watch, |edited, _| edited.add(at))
            }
            Gesture::Move { atom, path, reach } => {
                let path = self.lattice_path(path)?;
                self.edit(watch, |edited, pull| {
                    path.iter().try_for_each(|to| edited.step(*atom, to, *reach, pull).map(drop))
                })
            }
            Gesture::Remove { atom } => self.edit(watch, |edited, _| edited.remove(*atom)),
            Gesture::Pin { atom, pinned } => {
                self.edit(watch, |edited, _| edited.pin(*atom, *pinned))
            }
            Gesture::Facet { at, whole, multiplier } => {
                if !(0.0..=1.0).contains(multiplier) {
                    let message = format!("a multiplier of {multiplier}; expected 0 to 1");
                    return Err(JobError::misuse(message));
                }
                let at = self.lattice_place(at)?;
                self.barriers.push(Barrier { at, whole: *whole, multiplier: *multiplier });
                self.stages.forget_flow();
                Ok(())
            }
            Gesture::Well { kind, at } => {
                let at = self.lattice_place(at)?;
                self.wells.push(Well { kind: *kind, at });
                self.stages.forget_flow();
                Ok(())
            }
            Gesture::MoveWell { well, to } => {
                let at = self.lattice_place(to)?;
                self.well(*well)?.at = at;
                self.stages.forget_flow();
                Ok(())
            }
            Gesture::RemoveWell { well } => {
                self.well(*well)?;
                self.wells.remove(*well);
                self.stages.forget_flow();
                Ok(())
            }
            Gesture::Region { region, radius, path, parts, over } => {
                let path = self.lattice_path(path)?;
                let stroke = Stroke { path: &path, radius: *radius, level: *parts, over: *over };
                self.paint_region(*region, stroke, watch)
            }
            Gesture::NameRegion { region, name } => self.name_region(*region, name),
            Gesture::MergeParts { path, parts } => {
                let edit = PartEdit::Merge(self.lattice_path(path)?);
                self.edit_parts(edit, *parts, watch)
            }
            Gesture::SplitPart { first, second, parts } => {
                let sides = [self.lattice_path(first)?, self.lattice_path(second)?];
                self.edit_parts(PartEdit::Split(sides), *parts, watch)
            }
        }
    }

    /// The options.
    pub fn run(&self) -> &RunConfig {
        &self.run
    }

    /// What is opened.
    pub fn opened(&self) -> &Opened<D> {
        &self.opened
    }

    /// Where the image is in memory, which tells it from others as long as it is open.
    pub fn opened_at(&self) -> usize {
        Arc::as_ptr(&self.opened).addr()
    }

    /// The image, in place.
    pub fn image(&self) -> Option<&Image<D>> {
        self.stages.images().map(|images| &images.image)
    }

    /// The samples' grid in lattice units.
    pub fn grid(&self) -> Grid<D> {
        let units: Units = self.run.lattice.units.unwrap_or_default();
        self.image().unwrap_or(&self.opened.shown.image).frame().grid(units)
    }

    /// The paint on a field.
    pub fn painted(&self, field: PaintedField) -> Option<&Paint> {
        match field {
            PaintedField::Size => self.size_paint.as_deref(),
            PaintedField::Weight => self.weight_paint.as_deref(),
        }
    }

    /// Whether there is paint on a field.
    pub fn is_painted(&self) -> bool {
        self.size_paint.is_some() || self.weight_paint.is_some()
    }

    /// The atoms as edited by hand, or as settled, ready to be edited.
    pub fn edited(&self) -> Option<&Edited<D>> {
        self.edited.as_deref()
    }

    /// The wells.
    pub fn wells(&self) -> &[Well<D>] {
        &self.wells
    }

    /// What was made.
    pub fn stages(&self) -> &Stages<D> {
        &self.stages
    }

    /// Whether atoms were edited since they settled.
    pub fn is_edited(&self) -> bool {
        self.edited.as_ref().is_some_and(|edited| edited.is_edited())
    }

    /// The atoms ready to be edited.
    ///
    /// # Errors
    /// [`JobError`], also if the watch ends the work.
    pub fn editor(&mut self, watch: &mut dyn Watch) -> Result<&mut Edited<D>, JobError> {
        if self.edited.is_none() {
            let settled = self.settled(watch)?;
            let edited = Edited::new(settled.lattice().clone(), self.axes.delaunay, watch)?;
            self.edited = Some(Arc::new(edited));
        }
        Ok(Arc::make_mut(self.edited.as_mut().expect("it was made above")))
    }

    /// Moves an atom a step of its way, with those in reach; what a [`Gesture::Move`] does for each place of its path.
    ///
    /// # Errors
    /// [`JobError`] if the atom may not be there; nothing has changed then.
    pub fn drag(
        &mut self,
        atom: u32,
        to: &[f64],
        reach: f64,
        watch: &mut dyn Watch,
    ) -> Result<Vec<Changes<D>>, JobError> {
        let to = self.lattice_place(to)?;
        let mut changes = Vec::new();
        self.edit(watch, |edited, pull| {
            changes = edited.step(atom, &to, reach, pull)?;
            Ok(())
        })?;
        Ok(changes)
    }

    /// Writes the mesh, by the job's own writers.
    ///
    /// # Errors
    /// [`JobError`] if there is no mesh, or it cannot be written.
    pub fn write(&mut self, path: &Path, watch: &mut dyn Watch) -> Result<(), JobError> {
        let outcome = self.refresh(watch)?;
        let mut run = self.job_run();
        run.output.output = Some(path.into());
        let images = self.images(watch)?;
        let regions = self.exported_regions(watch)?;
        let as_values = |regions: &Regions| {
            Property::new("region".into(), regions.of_cells.iter().map(|r| f64::from(*r)).collect())
        };
        // Voronoi's cells have values only
        let is_voronoi = outcome.cells().is_some();
        let values: Vec<Property> = regions.iter().filter(|_| is_voronoi).map(as_values).collect();
        let made = MadeMesh {
            run: &run,
            outcome: &outcome,
            image: Some(&images.image),
            world: &images.world,
            properties: &values,
            regions: regions.as_ref().filter(|_| !is_voronoi),
        };
        made.write(&self.axes.dimension, &mut Session::new(watch)).map(drop)
    }

    /// Makes the fields b, β and d.
    ///
    /// # Errors
    /// [`JobError`], also if the watch ends the work.
    pub fn prepare(&mut self, watch: &mut dyn Watch) -> Result<(), JobError> {
        self.prepared(watch).map(drop)
    }

    /// The mesh of all that was done, made as far as it is not there.
    ///
    /// # Errors
    /// [`JobError`], also if the watch ends the work.
    pub fn refresh(&mut self, watch: &mut dyn Watch) -> Result<Arc<Outcome<D>>, JobError> {
        if let Some(outcome) = self.stages.outcome() {
            return Ok(outcome);
        }
        let prepared = self.prepared(watch)?;
        let outcome = match self.edited.as_ref().filter(|edited| edited.is_edited()) {
            Some(edited) => {
                let settled = prepared.with_settled(edited.lattice());
                let settled = settled.map_err(|e| self.refusal(e))?;
                self.finish(settled, watch)?
            }
            None => {
                let settled = self.settled(watch)?;
                self.finish((*settled).clone(), watch)?
            }
        };
        Ok(self.stages.keep_outcome(outcome))
    }

    fn edit(
        &mut self,
        watch: &mut dyn Watch,
        edit: impl FnOnce(&mut Edited<D>, atoms::Pull<'_, D>) -> Result<(), JobError>,
    ) -> Result<(), JobError> {
        let prepared = self.prepared(watch)?;
        let fields = prepared.fields();
        let options = prepared.options().optimize.clone();
        let pull = atoms::Pull { fields, options: &options };
        edit(self.editor(watch)?, pull)?;
        self.stages.forget_outcome();
        Ok(())
    }

    fn well(&mut self, well: usize) -> Result<&mut Well<D>, JobError> {
        let count = self.wells.len();
        let found = self.wells.get_mut(well);
        found.ok_or_else(|| JobError::misuse(format!("there is no well {well}; there are {count}")))
    }

    /// A place in samples, moved to the lattice and into the box.
    fn lattice_place(&self, place: &[f64]) -> Result<Point<D>, JobError> {
        let found = place.len();
        let place: Point<D> = place
            .try_into()
            .map_err(|_| JobError::misuse(format!("a place of {found} numbers; expected {D}")))?;
        let grid = self.grid();
        Ok(std::array::from_fn(|k| {
            let last = (grid.shape[k] - 1) as f64;
            place[k].clamp(0.0, last) * grid.step[k]
        }))
    }

    fn lattice_path(&self, path: &[Vec<f64>]) -> Result<Vec<Point<D>>, JobError> {
        path.iter().map(|p| self.lattice_place(p)).collect()
    }

    fn images(&mut self, watch: &mut dyn Watch) -> Result<Arc<MeshImages<D>>, JobError> {
        self.stages.images_or(|| {
            let shown = self.opened.shown.clone();
            let mut session = Session::new(watch);
            MeshImages::read_fields(&self.run, shown, &self.axes.dimension, &mut session)
        })
    }
}
