//! The first stage: everything that atoms need to know of the image.

use std::fmt;
use std::sync::Arc;

use crate::conform::are_on_pieces;
use crate::crests::Pieces;
use crate::energy;
use crate::fields::{Fields, FieldsView, Interpolation, NominalDistance, ScalarField};
use crate::geometry::{Bounds, Point, compact_order};
use crate::image::{Frame, Grid, Samples};
use crate::improve::Align;
use crate::lattice::{
    GrowOptions, Lattice, Place, ScatterOptions, fill_holes, grow_within, scatter, settle,
};
use crate::mesh::Mesh;
use crate::optimize::{EngineKind, OptimizeReport};
use crate::region::{Outline, outline_facets};
use crate::watch::Watch;

use super::connected::Connected;
use super::error::{RunError, Warning};
use super::estimate::{self, Beside, Estimate, Work};
use super::filled::Filled;
use super::method::Method;
use super::options::{LatticeKind, MeshKind, MeshOptions};
use super::outcome::Outcome;
use super::settled::Settled;

/// Everything that atoms need to know of the image: b(x), β(x), d(x), the mask's outline, labels and options.
///
/// All later stages share it; a clone costs nothing.
#[derive(Clone)]
pub struct Prepared<const D: usize>(Arc<Parts<D>>);

/// What [`Prepared`] holds.
pub(super) struct Parts<const D: usize> {
    pub method: Method<D>,
    pub options: MeshOptions<D>,
    pub frame: Frame<D>,
    pub grid: Grid<D>,
    pub fields: Fields<D>,
    /// Where the mesh ends, if it does not fill the box.
    pub outline: Option<Outline<D>>,
    /// The label of each sample; NaN outside of the mask.
    pub labels: Option<Samples>,
    /// Whether the image is b itself.
    pub is_potential: bool,
    pub warnings: Vec<Warning>,
    /// The features that facets are made to keep to.
    pub pieces: Option<Pieces<D>>,
    /// Whether features were found too ragged to be kept to, so that facets are turned onto them only.
    pub are_ragged: bool,
    /// The features that faces of Voronoi cells are made to fall on.
    pub faced: Option<Pieces<D>>,
}

impl<const D: usize> fmt::Debug for Prepared<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Parts { options, frame, .. } = &*self.0;
        f.debug_struct("Prepared").field("frame", frame).field("options", options).finish()
    }
}

impl<const D: usize> Prepared<D> {
    pub(super) fn new(parts: Parts<D>) -> Self {
        Self(Arc::new(parts))
    }

    pub(super) fn parts(&self) -> &Parts<D> {
        &self.0
    }

    /// What was chosen.
    pub fn options(&self) -> &MeshOptions<D> {
        &self.0.options
    }

    /// The image's frame.
    pub fn frame(&self) -> &Frame<D> {
        &self.0.frame
    }

    /// The image's box, in lattice units.
    pub fn bounds(&self) -> Bounds<D> {
        self.0.grid.bounds()
    }

    /// The fields that atoms move in.
    pub fn fields(&self) -> FieldsView<'_, D> {
        self.0.fields.view()
    }

    /// b(x).
    pub fn potential(&self) -> &ScalarField<D> {
        self.0.fields.potential()
    }

    /// d(x).
    pub fn distance(&self) -> &NominalDistance<D> {
        self.0.fields.distance()
    }

    /// d at the image's samples, x fastest, in lattice units.
    pub fn distance_at_samples(&self) -> Vec<f32> {
        (self.0.method.stages().distance_at_samples)(self)
    }

    /// Where the mesh ends, if a mask says so.
    pub fn outline(&self) -> Option<&Outline<D>> {
        self.0.outline.as_ref()
    }

    /// The features that facets are made to keep to, if any are.
    pub fn pieces(&self) -> Option<&Pieces<D>> {
        self.0.pieces.as_ref()
    }

    /// The features that faces of Voronoi cells are made to fall on, if these are clean lines or sheets.
    pub fn faced(&self) -> Option<&Pieces<D>> {
        self.0.faced.as_ref()
    }

    /// What kind of features was asked for: its name, those of a mixture, or `potential`.
    pub(super) fn kind_of_features(&self) -> String {
        let Parts { options, is_potential, .. } = &*self.0;
        match &options.mixture {
            _ if *is_potential => "potential".into(),
            Some(mixture) => {
                let names = mixture.shares().iter().map(|share| share.features.name());
                names.collect::<Vec<_>>().join("+")
            }
            None => options.features.features.name().into(),
        }
    }

    /// What was odd so far.
    pub fn warnings(&self) -> &[Warning] {
        &self.0.warnings
    }

    /// What the rest of the work will take.
    pub fn estimate(&self) -> Estimate {
        let Parts { method, options, grid, .. } = &*self.0;
        let filling = method.filling(options.lattice);
        let share = self.outline().map_or(1.0, Outline::mean_share);
        let crowding = match options.lattice {
            LatticeKind::Random => 1.0,
            _ => estimate::crowding(self.distance(), options.spacing_factor),
        };
        let atoms = share * crowding * estimate::atoms(grid, self.distance(), filling);
        let is_sampled = options.optimize.engine == EngineKind::Sampled;
        let spline = options.interpolation == Interpolation::Spline;
        let conforming = self.0.pieces.is_some();
        let smooth = options.optimize.smoothing_steps > 0 && !conforming;
        // looking for crests takes two volumes and a copy of the potential
        let mirrored = self.pairs_atoms() && self.potential().range().1 > 0.0;
        let copies = [
            is_sampled,
            spline,
            smooth,
            smooth && spline,
            mirrored,
            mirrored,
            mirrored,
            // b without what atoms stand on
            conforming,
            conforming && spline,
        ];
        let pieces = [self.pieces(), self.faced()];
        let beside = Beside {
            samples: grid.sample_count(),
            copies: 1 + copies.into_iter().filter(|&c| c).count(),
            feature_points: pieces.into_iter().flatten().map(Pieces::point_count).sum(),
            crowding,
            valleys: if self.looks_for_valleys() {
                estimate::valley_bytes(self.potential())
            } else {
                0.0
            },
            tables: if is_sampled { energy::table_bytes(grid, self.distance()) } else { 0.0 },
        };
        let work = match options.kind {
            MeshKind::Voronoi => Work::Divided,
            MeshKind::Delaunay if conforming => Work::Conforming,
            MeshKind::Delaunay if self.stays_still() => Work::AsGrown,
            MeshKind::Delaunay => Work::Moved,
        };
        Estimate::new::<D>(work, atoms, beside)
    }

    /// Fills the box with atoms.
    ///
    /// # Errors
    /// [`RunError::Memory`] if more is needed than [`MeshOptions::memory_limit`] allows; [`RunError::Lattice`];
    /// [`RunError::Cancelled`].
    pub fn fill(&self, watch: &mut dyn Watch) -> Result<Filled<D>, RunError> {
        (self.0.method.stages().fill)(self, watch)
    }

    /// Goes on from atoms of one's own, not yet settled.
    ///
    /// # Errors
    /// [`RunError::OtherBox`] if they fill another box than the image's.
    pub fn with_atoms(&self, lattice: Lattice<D>) -> Result<Filled<D>, RunError> {
        self.check_box(lattice.bounds())?;
        Ok(Filled::new(self.clone(), lattice))
    }

    /// Goes on from atoms that are where they shall be, such as an editor's.
    ///
    /// # Errors
    /// [`RunError::OtherBox`] if they fill another box than the image's.
    pub fn with_settled(&self, lattice: Lattice<D>) -> Result<Settled<D>, RunError> {
        self.check_box(lattice.bounds())?;
        let report = OptimizeReport::new(self.0.options.optimize.engine);
        Ok(Settled { run: self.clone(), lattice, report, mirror_report: None })
    }

    /// Goes on from a mesh in lattice coordinates, such as a file's moved back by
    /// [`lattice_mesh`](super::lattice_mesh). Points on sides of the box stay on them; those on the rest of the
    /// mesh's boundary stay where they are.
    ///
    /// # Errors
    /// [`RunError::OtherBox`] if a point is outside the image's box.
    pub fn with_mesh(&self, mesh: Mesh<D>) -> Result<Connected<D>, RunError> {
        let bounds = self.bounds();
        let is_inside =
            |found: &Bounds<D>| bounds.contains(&found.min) && bounds.contains(&found.max);
        if let Some(found) = Bounds::of(mesh.points()).filter(|found| !is_inside(found)) {
            return Err(self.other_box(&found));
        }
        let mut freedom: Vec<u8> = mesh.points().iter().map(|p| bounds.freedom(p)).collect();
        for &point in outline_facets(&mesh, &bounds).as_flattened() {
            freedom[point as usize] = 0;
        }
        if let Some(pieces) = self.pieces() {
            let are_on = are_on_pieces(mesh.points(), pieces, &bounds);
            let held = freedom.iter_mut().zip(are_on).filter(|(_, is_on)| *is_on);
            held.for_each(|(freedom, _)| *freedom = 0);
        }
        let report = OptimizeReport::new(self.0.options.optimize.engine);
        Ok(Connected { run: self.clone(), mesh, freedom, report, mirror_report: None })
    }

    /// Runs all stages: for Delaunay's cells filled, settled, connected, improved; for Voronoi's filled, settled
    /// and divided into cells.
    ///
    /// # Errors
    /// [`RunError`] if memory does not suffice, the energy is not finite, or the work was cancelled.
    pub fn run(self, watch: &mut dyn Watch) -> Result<Outcome<D>, RunError> {
        let filled = self.fill(watch)?;
        match self.0.options.kind {
            MeshKind::Delaunay => {
                filled.settle(watch)?.connect(watch)?.improve(watch)?.finish(watch)
            }
            MeshKind::Voronoi => filled.settle(watch)?.divide(watch)?.finish(watch),
        }
    }

    fn check_box(&self, found: &Bounds<D>) -> Result<(), RunError> {
        if *found == self.bounds() { Ok(()) } else { Err(self.other_box(found)) }
    }

    fn other_box(&self, found: &Bounds<D>) -> RunError {
        let text = |b: &Bounds<D>| format!("{:?} to {:?}", b.min, b.max);
        RunError::OtherBox { expected: text(&self.bounds()), found: text(found) }
    }

    /// Where samples lie in lattice space.
    pub(super) fn lattice_frame(&self) -> Frame<D> {
        let grid = &self.0.grid;
        let frame = Frame::new(grid.shape).and_then(|frame| frame.with_spacing(grid.step));
        frame.expect("a grid's shape and step were a frame's")
    }

    /// Whether pairs of atoms are made where features repel.
    pub(super) fn pairs_atoms(&self) -> bool {
        let Parts { options, outline, .. } = &*self.0;
        options.kind == MeshKind::Voronoi && options.mirror && outline.is_none()
    }

    /// Whether the improver looks for valleys of b: in the plane.
    fn looks_for_valleys(&self) -> bool {
        let MeshOptions { kind, improve, .. } = &self.0.options;
        let is_improved = *kind == MeshKind::Delaunay && improve.align != Align::Off;
        D == 2 && is_improved && !self.stays_still()
    }

    /// Whether nothing pulls atoms.
    fn stays_still(&self) -> bool {
        let FieldsView { potential, weight, .. } = self.fields();
        weight.as_constant() == Some(0.0) || potential.range() == (0.0, 0.0)
    }

    /// Whether atoms stay as they were grown: nothing pulls them, and they are evened out already.
    pub(super) fn stays_as_grown(&self) -> bool {
        let Parts { method, options, outline, .. } = &*self.0;
        let distance = self.distance();
        let is_crystal = options.lattice != LatticeKind::Random && outline.is_none();
        let is_even = is_crystal && method.evening().is_some() && !distance.is_constant();
        is_even && self.stays_still()
    }
}

/// [`Prepared::fill`].
pub(super) fn fill<const D: usize>(
    run: &Prepared<D>,
    watch: &mut dyn Watch,
) -> Result<Filled<D>, RunError> {
    let Parts { method, options, outline, .. } = run.parts();
    let distance = run.distance();
    let estimate = run.estimate();
    if let Some(available) = options.memory_limit
        && estimate.memory > available
    {
        let least = distance.least();
        return Err(RunError::Memory { needed: estimate.memory, available, least });
    }
    let bounds = run.bounds();
    let seed_points = seed_points(run);
    let lattice = match method.crystal(options.lattice)? {
        Some(crystal) => {
            let spacing_factor = options.spacing_factor;
            let grow = GrowOptions { spacing_factor, seed_points };
            let place = Place { bounds, distance, outline: outline.as_ref() };
            even_out(run, grow_within(crystal, place, &grow, watch)?, watch)?
        }
        None => {
            let options = ScatterOptions { seed: options.optimize.seed, seed_points };
            scatter(method.scatterer(), bounds, distance, &options, watch)?
        }
    };
    let order = compact_order(lattice.atoms());
    Ok(Filled::new(run.clone(), lattice.reordered(&order)))
}

/// The points that are to stay where they are, in lattice coordinates.
pub(super) fn seed_points<const D: usize>(run: &Prepared<D>) -> Vec<Point<D>> {
    let frame = &run.parts().frame;
    run.options().seed_points.iter().map(|p| in_lattice(run, frame, p)).collect()
}

/// A seed point from world to lattice. One that was meant to be on a side may come back a rounding from it, within or
/// without: a cell between the two would be flat.
fn in_lattice<const D: usize>(run: &Prepared<D>, frame: &Frame<D>, p: &Point<D>) -> Point<D> {
    /// Nearer to a side than this, over d, a point is on it.
    const NEAR: f64 = 1e-6;
    let units = run.options().units;
    let (spacing, step) = (frame.spacing(), frame.grid(units).step);
    let largest = p.iter().chain(&frame.origin()).fold(0.0, |most: f64, x| most.max(x.abs()));
    let scale = (0..D).map(|k| step[k] / spacing[k]).fold(0.0, f64::max);
    let place = frame.world_to_lattice(units, p);
    let rounding = 8.0 * f64::EPSILON * largest * scale;
    run.bounds().snap(&place, rounding.max(NEAR * run.distance().at(&run.bounds().clamp(&place))))
}

/// Fills and settles a crystal that has grown where d varies.
fn even_out<const D: usize>(
    run: &Prepared<D>,
    lattice: Lattice<D>,
    watch: &mut dyn Watch,
) -> Result<Lattice<D>, RunError> {
    let Parts { method, outline, .. } = run.parts();
    let distance = run.distance();
    let is_even = distance.is_constant() || outline.is_some();
    let (Some(evening), false) = (method.evening(), is_even) else {
        return Ok(lattice);
    };
    let scatterer = method.scatterer();
    let lattice = fill_holes(scatterer, lattice.along_curve(), distance, evening.rounds, watch)?;
    let mut lattice = lattice.along_curve();
    for _ in 0..evening.meshes {
        lattice = settle(scatterer, lattice, distance, evening.sweeps, watch)?;
    }
    Ok(lattice)
}
