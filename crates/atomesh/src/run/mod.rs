//! From an image to a mesh: the one entry point of every shell.
//!
//! [`prepare`] makes the potential b(x), the nominal distance d(x) and the weight β(x);
//! [`Prepared::estimate`] says what the rest will take; [`Prepared::run`] grows the lattice, moves the
//! atoms and connects them. All within lattice space; [`Outcome::world_mesh`] places the mesh in the
//! world.
//!
//! ```
//! use atomesh::image::{Frame, Image, Samples};
//! use atomesh::run::{Inputs, MeshOptions, Method, Size, prepare};
//! use atomesh::watch::Silent;
//!
//! let mut grey = vec![200u8; 64 * 48];
//! grey[24 * 64..25 * 64].fill(10); // a dark row
//! let image = Image::new(Frame::new([64, 48])?, Samples::U8(grey))?;
//! let options = MeshOptions { size: Size::Constant(6.0), ..Default::default() };
//! let outcome = prepare(&Method::flat(), Inputs::image(&image), options, &mut Silent)?.run(&mut Silent)?;
//! assert!(outcome.mesh().validate().is_ok());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod estimate;
mod method;
#[cfg(test)]
mod mirror_tests;
mod options;
mod outcome;
#[cfg(test)]
mod tests;

pub use error::{RunError, Warning};
pub use estimate::Estimate;
pub use method::Method;
pub use options::{LatticeKind, MeshKind, MeshOptions, POINTS_PER_WAVELENGTH, Size};
pub use outcome::{MeshReport, Outcome, VoronoiReport, sides};

use crate::enhance::{self, FeatureOptions, Features};
use crate::fields::Fields;
use crate::fields::{GRADIENT_LIMIT, Grading, NominalDistance, default_distance};
use crate::fields::{ImageWeight, Interpolation, ScalarField};
use crate::geometry::{Point, compact_order};
use crate::image::{Frame, Grid, Image, Samples, Units};
use crate::improve::{Align, ImproveReport};
use crate::lattice::{
    GrowOptions, Lattice, Outlined, Place, ScatterOptions, fill_holes, grow_within, scatter, settle,
};
use crate::mesh::{Mesh, PolyMesh, merge_duplicates};
use crate::mirror::{MirrorReport, Mirrored, crests, mirror};
use crate::optimize::{EngineKind, OptimizeReport, optimize};
use crate::region::{
    Outline, RegionError, Trimmed, fit_facets, join_islands, label_samples, outline_facets,
    smooth_outline, trim_to_outline,
};
use crate::sample::{SampleOptions, Statistic, sample_in_frame};
use crate::voronoi::{sites_apart, voronoi};
use crate::watch::{Phase, Watch, check};
use rayon::prelude::*;

/// What a mesh is made from. Images other than the first must have its shape; its frame counts.
#[derive(Clone, Copy)]
pub struct Inputs<'a, const D: usize> {
    /// The image, or, if `is_potential`, b(x) itself, values in −1…1.
    pub image: &'a Image<D>,
    /// Whether the image is taken as b(x) as it is.
    pub is_potential: bool,
    /// d(x), in lattice units; goes before [`MeshOptions::size`].
    pub size_field: Option<&'a Image<D>>,
    /// β(x), 0…1; goes before [`MeshOptions::image_weight`].
    pub weight_field: Option<&'a Image<D>>,
    /// Where to mesh: nonzero is inside, or, of shares within 0…1, at least one half.
    pub mask: Option<&'a Image<D>>,
    /// A label for each sample: cells get that of most of them.
    pub labels: Option<&'a Image<D>>,
}

impl<'a, const D: usize> Inputs<'a, D> {
    /// An image alone.
    pub fn image(image: &'a Image<D>) -> Self {
        Self {
            image,
            is_potential: false,
            size_field: None,
            weight_field: None,
            mask: None,
            labels: None,
        }
    }
}

/// Everything that atoms need to know of the image.
pub struct Prepared<'m, const D: usize> {
    method: &'m Method<D>,
    options: MeshOptions<D>,
    frame: Frame<D>,
    grid: Grid<D>,
    potential: ScalarField<D>,
    weight: ImageWeight<D>,
    distance: NominalDistance<D>,
    /// Where the mesh ends, if it does not fill the box.
    outline: Option<Outline<D>>,
    labels: Option<Vec<i32>>,
    warnings: Vec<Warning>,
}

/// Makes b(x), d(x) and β(x).
///
/// # Errors
/// [`RunError`] if an option is out of range, a field has another shape or bad values, the samples
/// are not finite, or the work was cancelled.
pub fn prepare<'m, const D: usize>(
    method: &'m Method<D>,
    inputs: Inputs<'_, D>,
    options: MeshOptions<D>,
    watch: &mut dyn Watch,
) -> Result<Prepared<'m, D>, RunError> {
    let frame = *inputs.image.frame();
    let grid = frame.grid(options.units);
    options.optimize.validate()?;
    options.improve.validate(D)?;
    if let Some(axis) = (0..D).find(|&k| grid.shape[k] < 2) {
        return Err(RunError::Thin { axis });
    }
    method.crystal(options.lattice)?; // refuse early what does not fit the dimension
    let mut warnings = Vec::new();
    let labels = match inputs.labels {
        Some(labels) => {
            same_shape("label image", &frame, labels)?;
            Some(label_samples(labels.samples())?)
        }
        None => None,
    };
    let mut samples = potential_samples(&inputs, &options, &mut warnings, watch)?;
    check(watch, Phase::Distance, 0.0, None)?;
    let distance = nominal_distance(&inputs, &grid, &options, &samples)?;
    let outline = match inputs.mask {
        Some(mask) => {
            same_shape("mask", &frame, mask)?;
            Outline::new(mask, grid, &distance, watch)?
        }
        None => None,
    };
    if let Some(outline) = &outline {
        outline.combine(&mut samples);
    }
    let weight = match inputs.weight_field {
        Some(field) => {
            same_shape("weight field", &frame, field)?;
            ImageWeight::field(grid, field.samples().to_f32())?
        }
        None => ImageWeight::constant(options.image_weight)?,
    };
    let extent = grid.bounds().extent();
    if let Some(axis) = (0..D).find(|&k| distance.least() > extent[k]) {
        let (distance, extent) = (distance.least(), extent[axis]);
        warnings.push(Warning::Coarse { axis, distance, extent });
    }
    check(watch, Phase::Distance, 1.0, None)?;
    let potential = ScalarField::new(grid, samples, options.interpolation)?;
    Ok(Prepared {
        method,
        options,
        frame,
        grid,
        potential,
        weight,
        distance,
        outline,
        labels,
        warnings,
    })
}

/// b at the samples: enhanced, or as given.
fn potential_samples<const D: usize>(
    inputs: &Inputs<'_, D>,
    options: &MeshOptions<D>,
    warnings: &mut Vec<Warning>,
    watch: &mut dyn Watch,
) -> Result<Vec<f32>, RunError> {
    if inputs.is_potential {
        return Ok(enhance::given_potential(inputs.image.samples().clone())?);
    }
    let smooth = options.features.smooth.or_else(|| width_for_faces(inputs, options));
    let features = FeatureOptions { units: options.units, smooth, ..options.features };
    let image_of = |kind| match (inputs.labels, kind) {
        (Some(labels), Features::Labels) => labels,
        _ => inputs.image,
    };
    let enhanced = match &options.mixture {
        Some(mixture) => enhance::enhance_mixture(mixture, &features, image_of, watch)?,
        None => enhance::enhance(image_of(features.features), &features, watch)?,
    };
    if enhanced.constant {
        warnings.push(Warning::Constant);
    }
    Ok(enhanced.values)
}

/// How wide a potential that repels is made for Voronoi cells, where no width is asked for: a quarter of the
/// least d, so that the rows of atoms on both sides feel it (Hale 2002).
fn width_for_faces<const D: usize>(
    inputs: &Inputs<'_, D>,
    options: &MeshOptions<D>,
) -> Option<f64> {
    let is_line = matches!(options.features.features, Features::Dark | Features::Bright);
    if options.kind != MeshKind::Voronoi || !options.features.repel || !is_line {
        return None;
    }
    let grid = inputs.image.frame().grid(options.units);
    let distance = match options.size {
        _ if inputs.size_field.is_some() => return None,
        Size::Default => default_distance(&grid),
        Size::Constant(d) | Size::Range { min: d, .. } => d,
        Size::Wavelength { .. } => return None,
    };
    Some((0.25 * distance).max(grid.least_step()))
}

fn nominal_distance<const D: usize>(
    inputs: &Inputs<'_, D>,
    grid: &Grid<D>,
    options: &MeshOptions<D>,
    samples: &[f32],
) -> Result<NominalDistance<D>, RunError> {
    if let Some(field) = inputs.size_field {
        same_shape("size field", inputs.image.frame(), field)?;
        let values = field.samples().to_f32();
        return Ok(NominalDistance::from_field(grid, &values, GRADIENT_LIMIT)?);
    }
    Ok(match options.size {
        Size::Default => NominalDistance::constant(grid, default_distance(grid))?,
        Size::Constant(d) => NominalDistance::constant(grid, d)?,
        Size::Range { min, max } => {
            let grading = Grading { by: options.grade_by, ..Grading::new(min, max) };
            NominalDistance::from_potential(grid, samples, &grading)?
        }
        Size::Wavelength { frequency, points } => {
            let rate = (frequency * points) as f32;
            let mut lengths = inputs.image.samples().to_f32();
            lengths.iter_mut().for_each(|v| *v /= rate);
            NominalDistance::from_field(grid, &lengths, GRADIENT_LIMIT)?
        }
    })
}

fn same_shape<const D: usize>(
    name: &'static str,
    frame: &Frame<D>,
    field: &Image<D>,
) -> Result<(), RunError> {
    let (expected, found) = (frame.shape().to_vec(), field.frame().shape().to_vec());
    if expected == found { Ok(()) } else { Err(RunError::Shape { name, expected, found }) }
}

impl<const D: usize> Prepared<'_, D> {
    /// The image's frame.
    pub fn frame(&self) -> &Frame<D> {
        &self.frame
    }

    /// b(x).
    pub fn potential(&self) -> &ScalarField<D> {
        &self.potential
    }

    /// d(x).
    pub fn distance(&self) -> &NominalDistance<D> {
        &self.distance
    }

    /// What was odd so far.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// What the rest of the work will take.
    pub fn estimate(&self) -> Estimate {
        let filling = self.method.filling(self.options.lattice);
        let share = self.outline.as_ref().map_or(1.0, Outline::mean_share);
        let atoms = share * estimate::atoms(&self.grid, &self.distance, filling);
        let field = self.options.optimize.engine == EngineKind::Sampled;
        let spline = self.options.interpolation == Interpolation::Spline;
        let smooth = self.options.optimize.smoothing_steps > 0;
        // looking for crests takes two volumes and a copy of the potential
        let mirrored = self.is_mirrored() && self.potential.range().1 > 0.0;
        let copies = [field, spline, smooth, smooth && spline, mirrored, mirrored, mirrored];
        let copies = copies.into_iter().filter(|&c| c).count();
        Estimate::new::<D>(self.grid.sample_count(), atoms, 1 + copies)
    }

    /// Fills the box with atoms.
    ///
    /// # Errors
    /// [`RunError::Lattice`].
    pub fn grow(&self, watch: &mut dyn Watch) -> Result<Lattice<D>, RunError> {
        let bounds = self.grid.bounds();
        let units = self.options.units;
        let seeds: Vec<Point<D>> = (self.options.seed_points.iter())
            .map(|p| self.frame.world_to_lattice(units, p))
            // a point meant to be on the boundary may come back a rounding outside
            .map(|p| snap_to(&p, &bounds))
            .collect();
        let lattice = match self.method.crystal(self.options.lattice)? {
            Some(crystal) => {
                let options =
                    GrowOptions { spacing_factor: self.options.spacing_factor, seed_points: seeds };
                let place =
                    Place { bounds, distance: &self.distance, outline: self.outline.as_ref() };
                let lattice = grow_within(crystal, place, &options, watch)?;
                self.even_out(lattice, watch)?
            }
            None => {
                let options =
                    ScatterOptions { seed: self.options.optimize.seed, seed_points: seeds };
                scatter(self.method.scatterer(), bounds, &self.distance, &options, watch)?
            }
        };
        let order = compact_order(lattice.atoms());
        Ok(lattice.reordered(&order))
    }

    /// Fills and settles a crystal that has grown where d varies.
    fn even_out(&self, lattice: Lattice<D>, watch: &mut dyn Watch) -> Result<Lattice<D>, RunError> {
        let is_even = self.distance.is_constant() || self.outline.is_some();
        let (Some(evening), false) = (self.method.evening(), is_even) else {
            return Ok(lattice);
        };
        let (scatterer, distance) = (self.method.scatterer(), &self.distance);
        let lattice =
            fill_holes(scatterer, lattice.along_curve(), distance, evening.rounds, watch)?;
        let mut lattice = lattice.along_curve();
        for _ in 0..evening.meshes {
            lattice = settle(scatterer, lattice, distance, evening.sweeps, watch)?;
        }
        Ok(lattice)
    }

    /// Whether atoms stay as they were grown: nothing pulls them, and they are evened out already.
    fn stays_as_grown(&self) -> bool {
        let is_crystal = self.options.lattice != LatticeKind::Random && self.outline.is_none();
        let is_even = is_crystal && self.method.evening().is_some() && !self.distance.is_constant();
        is_even && (self.weight.as_constant() == Some(0.0) || self.potential.range() == (0.0, 0.0))
    }

    /// Turns facets onto features and mends badly shaped cells, as the options ask and the method can.
    fn improve(
        &self,
        mesh: Mesh<D>,
        freedom: &[u8],
        watch: &mut dyn Watch,
    ) -> Result<(Mesh<D>, Option<ImproveReport>), RunError> {
        let (Some(improver), false) =
            (self.method.improver(), self.options.improve.align == Align::Off || self.is_voronoi())
        else {
            return Ok((mesh, None));
        };
        let options = &self.options.improve;
        let (mesh, report) = improver.improve(mesh, freedom, self.fields(), options, watch)?;
        Ok((mesh, Some(report)))
    }

    fn is_voronoi(&self) -> bool {
        self.options.kind == MeshKind::Voronoi
    }

    /// The cells around the atoms, if they are asked for.
    fn cells(
        &self,
        mesh: &Mesh<D>,
        watch: &mut dyn Watch,
    ) -> Result<Option<PolyMesh<D>>, RunError> {
        if !self.is_voronoi() {
            return Ok(None);
        }
        let delaunay = self.method.delaunay();
        let bounds = self.grid.bounds();
        Ok(Some(voronoi(delaunay, &sites_apart(mesh, &bounds), bounds, watch)?))
    }

    /// Connects the atoms; with the axes along which the box lets each point move.
    fn connect(
        &self,
        lattice: Lattice<D>,
        watch: &mut dyn Watch,
    ) -> Result<(Mesh<D>, Vec<u8>), RunError> {
        // where the image alone counts, atoms may fall into the same corner
        let (points, merged) = merge_duplicates(lattice.atoms());
        let freedom = lattice.freedom_of(&merged, points.len());
        drop(lattice);
        Ok((self.method.delaunay().connect(&points, watch)?, freedom))
    }

    /// Connects the atoms of a masked lattice and drops what is outside; points on the outline may not move
    /// any more.
    fn connect_within(
        &self,
        lattice: Lattice<D>,
        outline: &Outline<D>,
        watch: &mut dyn Watch,
    ) -> Result<Trimmed<D>, RunError> {
        let outlined = Outlined::new(lattice, outline, &self.distance);
        if outlined.lattice().len() <= D {
            return Err(RegionError::SmallMask { distance: self.distance.least() }.into());
        }
        let (outlined, mesh) =
            outlined.connect(self.method.delaunay(), outline, &self.distance, watch)?;
        let freedom = outlined.lattice().freedom();
        let trimmed = trim_to_outline(mesh, outlined.on_outline(), &freedom, outline, watch)?;
        drop(outlined);
        let mut trimmed = fit_facets(smooth_outline(trimmed, outline, watch)?, outline)?;
        for &point in trimmed.facets.as_flattened() {
            trimmed.freedom[point as usize] = 0;
        }
        Ok(trimmed)
    }

    /// The label of each cell.
    fn label(
        &self,
        mesh: &Mesh<D>,
        samples: &[i32],
        watch: &mut dyn Watch,
    ) -> Result<Vec<i32>, RunError> {
        let frame = Frame::new(self.grid.shape).and_then(|f| f.with_spacing(self.grid.step));
        let frame = frame.expect("a grid has samples and steps above 0");
        let samples = Samples::I32(samples.to_vec());
        let options = SampleOptions::new(&[Statistic::Majority]);
        let found = sample_in_frame(mesh, &frame, &samples, options, watch)?;
        let mut labels: Vec<i32> = found.values[0].iter().map(|&label| label as i32).collect();
        join_islands(mesh, &mut labels, self.options.least_island);
        Ok(labels)
    }

    /// The fields that atoms move in.
    fn fields(&self) -> Fields<'_, D> {
        Fields { potential: &self.potential, weight: &self.weight, distance: &self.distance }
    }

    /// Whether pairs of atoms are made where features repel.
    fn is_mirrored(&self) -> bool {
        self.is_voronoi() && self.options.mirror && self.outline.is_none()
    }

    /// The atoms where they end, how they were moved, and what became of features that repel.
    fn settled(
        &self,
        lattice: Lattice<D>,
        watch: &mut dyn Watch,
    ) -> Result<(Lattice<D>, OptimizeReport, Option<MirrorReport>), RunError> {
        let options = &self.options.optimize;
        let crests = if self.is_mirrored() { crests(self.fields(), watch)? } else { Vec::new() };
        if !crests.is_empty() {
            let how = (self.method.scatterer(), options);
            let Mirrored { lattice, report, optimize_report } =
                mirror(lattice, &crests, self.fields(), how, watch)?;
            return Ok((lattice, optimize_report, Some(report)));
        }
        if self.stays_as_grown() {
            return Ok((lattice, OptimizeReport::new(options.engine), None));
        }
        let (lattice, report) = optimize(lattice, self.fields(), options, watch)?.into_parts();
        Ok((lattice, report, None))
    }

    /// Grows the lattice, moves the atoms, connects them, and improves the mesh.
    ///
    /// # Errors
    /// [`RunError`] if memory does not suffice, the energy is not finite, or the work was cancelled.
    pub fn run(self, watch: &mut dyn Watch) -> Result<Outcome<D>, RunError> {
        let estimate = self.estimate();
        if let Some(available) = self.options.memory_limit
            && estimate.memory > available
        {
            let least = self.distance.least();
            return Err(RunError::Memory { needed: estimate.memory, available, least });
        }
        let (lattice, report, mirror_report) = self.settled(self.grow(watch)?, watch)?;
        let (mesh, freedom) = match &self.outline {
            Some(outline) => {
                let trimmed = self.connect_within(lattice, outline, watch)?;
                (trimmed.mesh, trimmed.freedom)
            }
            None => self.connect(lattice, watch)?,
        };
        let cells = self.cells(&mesh, watch)?;
        let (mesh, improve_report) = self.improve(mesh, &freedom, watch)?;
        let outline_facets = match &self.outline {
            Some(_) => outline_facets(&mesh, &self.grid.bounds()),
            None => Vec::new(),
        };
        let labels = self.labels.as_ref();
        let labels = labels.map(|labels| self.label(&mesh, labels, watch)).transpose()?;
        let points = mesh.points().par_iter().with_min_len(1 << 10);
        let distance = points.clone().map(|p| self.distance.at(p) as f32).collect();
        let (low, high) = self.potential.range(); // a spline passes beyond it at jumps
        let at = |p| (self.potential.value(p) as f32).clamp(low, high);
        let potential = points.map(at).collect();
        Ok(Outcome {
            mesh,
            cells,
            distance_at_points: distance,
            potential_at_points: potential,
            potential: self.potential,
            distance: self.distance,
            frame: self.frame,
            units: self.options.units,
            optimize_report: report,
            improve_report,
            mirror_report,
            outline: self.outline,
            outline_facets,
            labels,
            warnings: self.warnings,
        })
    }
}

/// The nearest point of the box, if it is within a rounding of it; else the point itself.
fn snap_to<const D: usize>(p: &Point<D>, bounds: &crate::geometry::Bounds<D>) -> Point<D> {
    let inside = bounds.clamp(p);
    let extent = bounds.extent();
    let near = (0..D).all(|k| (inside[k] - p[k]).abs() <= 1e-9 * extent[k]);
    if near { inside } else { *p }
}

/// The mesh with its points moved to the world: cells turn over where the frame mirrors.
fn place<const D: usize>(mesh: &Mesh<D>, frame: &Frame<D>, units: Units) -> Mesh<D> {
    moved(mesh, frame.is_mirrored(), |p| frame.lattice_to_world(units, p))
}

/// A mesh in world coordinates, moved back to the lattice coordinates of an image's frame; the
/// inverse of [`Outcome::world_mesh`].
pub fn lattice_mesh<const D: usize>(mesh: &Mesh<D>, frame: &Frame<D>, units: Units) -> Mesh<D> {
    moved(mesh, frame.is_mirrored(), |p| frame.world_to_lattice(units, p))
}

/// The mesh with its points moved, its cells turned over if the move mirrors.
fn moved<const D: usize>(
    mesh: &Mesh<D>,
    mirrored: bool,
    to: impl Fn(&Point<D>) -> Point<D> + Send + Sync,
) -> Mesh<D> {
    let points = mesh.points().par_iter().with_min_len(1 << 10).map(to).collect();
    let mut corners = mesh.corners().to_vec();
    if mirrored {
        corners.chunks_exact_mut(D + 1).for_each(|cell| cell.swap(D - 1, D));
    }
    Mesh::new(points, corners).expect("finite frames keep points finite")
}
