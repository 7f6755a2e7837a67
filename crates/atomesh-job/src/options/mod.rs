//! Everything that decides a run, from the command line, a configuration or another shell.
//!
//! One struct for each part, each option in one place: its name, help, type and range. What is not given is
//! `None`; defaults come from the core ([`RunConfig::mesh_options`]) and are spelt out where a run is kept
//! ([`RunConfig::with_defaults`]).

mod features;
mod frame;
mod input;
mod lattice;
mod optimize;
mod output;
mod section;

pub use features::PotentialOptions;
pub use frame::{FrameOptions, RawOrder, axes};
pub use input::InputOptions;
pub use lattice::LatticeOptions;
pub use optimize::{ImprovementOptions, OptimizerOptions, RegionOptions};
pub use output::{Backdrop, OutputOptions, View};

use std::path::Path;

use atomesh::enhance::{EdgeOperator, Features};
use atomesh::run::{MeshKind, MeshOptions, POINTS_PER_WAVELENGTH};
use atomesh_io::mesh::Provenance;
use serde::{Deserialize, Serialize};

use crate::error::JobError;
use crate::values::Text;

/// Everything that decides a run: tables of options with the command line's names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct RunConfig {
    /// Files read.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Input"))]
    #[serde(skip_serializing_if = "InputOptions::is_empty")]
    pub input: InputOptions,
    /// Files written.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Output"))]
    #[serde(skip_serializing_if = "OutputOptions::is_empty")]
    pub output: OutputOptions,
    /// Lattice.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Lattice"))]
    #[serde(skip_serializing_if = "LatticeOptions::is_empty")]
    pub lattice: LatticeOptions,
    /// Potential.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Features"))]
    #[serde(skip_serializing_if = "PotentialOptions::is_empty")]
    pub features: PotentialOptions,
    /// Regions.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Regions"))]
    #[serde(skip_serializing_if = "RegionOptions::is_empty")]
    pub regions: RegionOptions,
    /// Frame.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Frame"))]
    #[serde(skip_serializing_if = "FrameOptions::is_empty")]
    pub frame: FrameOptions,
    /// Optimizer.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Optimisation"))]
    #[serde(skip_serializing_if = "OptimizerOptions::is_empty")]
    pub optimize: OptimizerOptions,
    /// Improvement.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Improvement"))]
    #[serde(skip_serializing_if = "ImprovementOptions::is_empty")]
    pub improve: ImprovementOptions,
}

impl RunConfig {
    /// Whether the cells are Voronoi's.
    pub fn is_voronoi(&self) -> bool {
        self.lattice.mesh == Some(MeshKind::Voronoi)
    }

    /// The sections of a configuration, each with its options' names as the structs have them.
    pub const SECTIONS: &[(&str, &[&str])] = &[
        ("input", InputOptions::NAMES),
        ("output", OutputOptions::NAMES),
        ("lattice", LatticeOptions::NAMES),
        ("features", PotentialOptions::NAMES),
        ("regions", RegionOptions::NAMES),
        ("frame", FrameOptions::NAMES),
        ("optimize", OptimizerOptions::NAMES),
        ("improve", ImprovementOptions::NAMES),
    ];

    /// Reads a configuration.
    ///
    /// # Errors
    /// [`JobError`] with the line if a key is unknown or a value is of the wrong kind.
    pub fn parse(text: &str) -> Result<Self, JobError> {
        toml::from_str(text).map_err(|e| {
            let line = e.span().map_or(1, |s| text[..s.start].matches('\n').count() + 1);
            JobError::misuse(format!("line {line}: {}", e.message().replace('\n', "; ")))
        })
    }

    /// Takes from a configuration's file what was not given.
    ///
    /// # Errors
    /// [`JobError`] names the file, if it cannot be read or parsed.
    pub fn or_file(self, path: &Path) -> Result<Self, JobError> {
        let text =
            std::fs::read_to_string(path).map_err(|e| JobError::unreadable(&e).about(path))?;
        Ok(self.or(Self::parse(&text).map_err(|f| f.about(path))?))
    }

    /// The text of a configuration that gives the same run.
    pub fn to_toml(&self) -> Result<String, JobError> {
        toml::to_string(self).map_err(JobError::content)
    }

    /// Takes from `other` what was not given.
    pub fn or(self, other: Self) -> Self {
        // a size given as one thing replaces the other
        let mut below = other;
        if self.lattice.size.is_some() {
            (below.input.size_field, below.lattice.frequency) = (None, None);
        }
        if self.input.size_field.is_some() {
            (below.lattice.size, below.lattice.frequency) = (None, None);
        }
        if self.lattice.frequency.is_some() {
            (below.lattice.size, below.input.size_field) = (None, None);
        }
        if self.lattice.beta.is_some() {
            below.input.beta_field = None;
        }
        if self.input.beta_field.is_some() {
            below.lattice.beta = None;
        }
        Self {
            input: self.input.or(below.input),
            output: self.output.or(below.output),
            lattice: self.lattice.or(below.lattice),
            features: self.features.or(below.features),
            regions: self.regions.or(below.regions),
            frame: self.frame.or(below.frame),
            optimize: self.optimize.or(below.optimize),
            improve: self.improve.or(below.improve),
        }
    }

    /// The same with every default that does not depend on the image spelt out, so that the run
    /// stays the same when defaults change.
    pub fn with_defaults<const D: usize>(self) -> Self {
        let mesh = MeshOptions::<D>::for_kind(self.lattice.mesh.unwrap_or_default());
        let features = mesh.features;
        let mut defaults = Self {
            lattice: LatticeOptions {
                mesh: Some(mesh.kind),
                mirror: Some(mesh.mirror),
                grade_by: Some(mesh.grade_by),
                beta: Some(mesh.image_weight),
                units: Some(mesh.units),
                spacing_factor: Some(mesh.spacing_factor),
                points_per_wavelength: self.lattice.frequency.map(|_| POINTS_PER_WAVELENGTH),
                ..Default::default()
            },
            features: PotentialOptions {
                features: Some(Text(features.features.into())),
                edge_operator: Some(features.edge_operator),
                edge_scale: Some(features.edge_scale),
                repel: Some(features.repel),
                smooth: features.smooth,
                ..Default::default()
            },
            regions: RegionOptions {
                least_island: Some(mesh.least_island as u64),
                ..Default::default()
            },
            optimize: OptimizerOptions::spelt(&mesh.optimize, mesh.interpolation),
            improve: ImprovementOptions {
                align: Some(mesh.improve.align),
                min_angle: Some(mesh.improve.min_angle),
            },
            ..Default::default()
        };
        if self.features.edge_operator == Some(EdgeOperator::Crest) {
            defaults.features.edge_scale = None; // it depends on the image
        }
        if self.input.potential.is_some() {
            // the options of features have no part in the run
            defaults.features = PotentialOptions::default();
        }
        let features = self.followed();
        Self { features, ..self }.or(defaults)
    }

    /// The options that the core takes.
    ///
    /// # Errors
    /// [`JobError`] if a seed point has another number of coordinates, or a value from a configuration
    /// is out of its range.
    pub fn mesh_options<const D: usize>(&self) -> Result<MeshOptions<D>, JobError> {
        let features = self.followed();
        let (lattice, moves) = (&self.lattice, &self.optimize);
        let default = MeshOptions::<D>::for_kind(lattice.mesh.unwrap_or_default());
        let seeds = lattice.seed_point.iter().flatten();
        let optimize = moves.optimize_options(default.optimize);
        optimize.validate().map_err(JobError::misuse)?;
        let improve = self.improve.improve_options(default.improve);
        // below the bound of the greater dimension, as long as the image is not known
        improve.validate(3).map_err(JobError::misuse)?;
        let least_island = self.regions.least_island.map(|least| least as usize);
        Ok(MeshOptions {
            features: features.feature_options(default.features),
            mixture: features.mixture(),
            interpolation: moves.interpolation.unwrap_or(default.interpolation),
            kind: default.kind,
            mirror: lattice.mirror.unwrap_or(default.mirror),
            units: lattice.units.unwrap_or(default.units),
            size: lattice.wanted_size()?,
            grade_by: lattice.grade_by.unwrap_or(default.grade_by),
            image_weight: lattice.beta.unwrap_or(default.image_weight),
            lattice: lattice.lattice.unwrap_or(default.lattice),
            spacing_factor: lattice.spacing_factor.unwrap_or(default.spacing_factor),
            seed_points: seeds.map(|p| axes("--seed-point", &p.0)).collect::<Result<_, _>>()?,
            optimize,
            improve,
            least_island: least_island.unwrap_or(default.least_island),
            memory_limit: None,
        })
    }

    /// Checks what does not need the image.
    ///
    /// # Errors
    /// [`JobError`] names the first option that is out of its range.
    pub fn check(&self) -> Result<(), JobError> {
        let seeds = self.lattice.seed_point.iter().flatten();
        if let Some(odd) = seeds.map(|p| p.0.len()).find(|n| !(2..=3).contains(n)) {
            let message = format!("--seed-point has {odd} numbers; expected 2 or 3");
            return Err(JobError::misuse(message));
        }
        let without_seeds = LatticeOptions { seed_point: None, ..self.lattice.clone() };
        Self { lattice: without_seeds, ..self.clone() }.mesh_options::<2>().map(drop)
    }

    /// The same with names of files that are no text spelt as nearly as text can, for reports.
    pub(crate) fn in_words(mut self) -> Self {
        let Self { input, output, frame, .. } = &mut self;
        let files = input.files_mut().into_iter().chain(output.files_mut());
        for path in files.chain([frame.data_root.as_mut()]).flatten() {
            if path.to_str().is_none() {
                *path = path.to_string_lossy().into_owned().into();
            }
        }
        self
    }

    /// What decides the mesh beside the files, for its metadata: no paths.
    pub fn provenance<const D: usize>(&self) -> Provenance {
        let mut run = self.clone().with_defaults::<D>();
        run.input = InputOptions::default();
        run.output = OutputOptions::default();
        run.frame.data_root = None;
        let seed = run.optimize.seed.unwrap_or(0);
        let options = serde_json::to_value(run).unwrap_or_default();
        Provenance {
            version: env!("CARGO_PKG_VERSION").into(),
            options,
            seed,
            units: Vec::new(),
            standing: None,
        }
    }

    /// Labels alone are the image, and the boundaries between them its features.
    pub(crate) fn take_labels_alone(&mut self) {
        let input = &self.input;
        if input.image.is_none() && input.potential.is_none() && input.labels.is_some() {
            self.follow_labels();
        }
    }

    /// Makes the boundaries between labels the features, unless others are asked for.
    pub fn follow_labels(&mut self) {
        self.features.features.get_or_insert(Text(Features::Labels.into()));
    }

    /// The options of features: those of an image that is parted into phases follow the boundaries between these.
    fn followed(&self) -> PotentialOptions {
        let phases = self.regions.threshold.as_ref().map(|_| Text(Features::Labels.into()));
        PotentialOptions {
            features: self.features.features.clone().or(phases),
            ..self.features.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use atomesh::image::Units;
    use atomesh::run::Size;

    #[test]
    fn a_run_survives_its_file_and_the_command_line_goes_before_it() {
        let text = "[lattice]\nsize = \"6..18\"\nbeta = 0.25\n[input]\nbeta-field = \"b.npy\"\n";
        let file = RunConfig::parse(text).unwrap();
        let full = file.clone().with_defaults::<3>();
        assert_eq!(RunConfig::parse(&full.to_toml().unwrap()), Ok(full));

        let mut line = RunConfig::default();
        line.lattice.beta = Some(0.75);
        line.input.size_field = Some("d.npy".into());
        let both = line.or(file);
        assert_eq!((both.lattice.beta, both.lattice.size), (Some(0.75), None));
        assert_eq!(both.input.beta_field, None);
        assert_eq!(both.input.size_field, Some("d.npy".into()));
    }

    #[test]
    fn a_frequency_takes_the_place_of_a_size() {
        let file = RunConfig::parse("[lattice]\nsize = 8.0\n").unwrap();
        let mut line = RunConfig::default();
        line.lattice.frequency = Some(2.0);
        let both = line.clone().or(file);
        let size = both.mesh_options::<2>().unwrap().size;
        let points = POINTS_PER_WAVELENGTH;
        assert_eq!(size, Size::Wavelength { frequency: 2.0, points, least: None, greatest: None });
        assert_eq!(both.with_defaults::<2>().lattice.points_per_wavelength, Some(points));

        line.lattice.size = Some("20..90".parse().unwrap());
        let bounds =
            Size::Wavelength { frequency: 2.0, points, least: Some(20.0), greatest: Some(90.0) };
        assert_eq!(line.mesh_options::<2>().unwrap().size, bounds);
        line.lattice.size = Some("20".parse().unwrap());
        assert!(line.check().is_err());
        line.lattice.size = None;

        line.lattice.units = Some(Units::Samples);
        assert!(line.check().is_err());
        let points = RunConfig::parse("[lattice]\npoints-per-wavelength = 4.0\n").unwrap();
        assert!(points.check().is_err());
    }
}
