//! Everything that decides a run of `atomesh mesh`, from the command line or a configuration.

use std::path::{Path, PathBuf};

use atomesh::enhance::{
    CrestOptions, EdgeOperator, FaultOptions, FeatureOptions, HorizonOptions, Mixture, Polarity,
};
use atomesh::fields::GradeBy;
use atomesh::fields::Interpolation;
use atomesh::image::Units;
use atomesh::improve::{Align, ImproveOptions};
use atomesh::optimize::{EngineKind, OptimizeOptions};
use atomesh::run::{LatticeKind, MeshKind, MeshOptions, POINTS_PER_WAVELENGTH, Size};
use serde::{Deserialize, Serialize};

use crate::failure::Failure;
use crate::frame_options::{FrameOptions, axes};
use crate::section::section;
use crate::values::{Numbers, SizeValue, Text, named, number_in};

/// Stages on smoothed potentials that anyone could want.
const MOST_STEPS: u64 = 10;

section! {
    /// The files that a mesh is made from.
    pub struct InputOptions {
        /// Image to mesh: .png .jpg .pgm .tif .npy .nii .nii.gz .nrrd .mha .vti .segy .rsf, a folder of
        /// DICOM slices, or raw samples with --shape and --dtype. Two axes make triangles, three make
        /// tetrahedra
        #[arg(value_name = "IMAGE", help_heading = "Arguments")]
        pub image: PathBuf,
        /// Image potential b(x) to use as it is, values in -1 (attracts) to 1 (repels), instead of
        /// the features of IMAGE. With both, IMAGE gives the frame and the picture
        #[arg(long, value_name = "FILE")]
        pub potential: PathBuf,
        /// Nominal distance d(x) in lattice units, an image of the same shape; goes before --size
        #[arg(long, value_name = "FILE", conflicts_with = "size")]
        pub size_field: PathBuf,
        /// Weight β(x), 0 to 1, an image of the same shape; goes before --beta
        #[arg(long, value_name = "FILE", conflicts_with = "beta")]
        pub beta_field: PathBuf,
        /// Mask: mesh only where this image of the same shape is not 0 (or, where its values are
        /// shares within 0 to 1, at least 0.5), up to its smooth outline
        #[arg(long, value_name = "FILE")]
        pub mask: PathBuf,
        /// Labels: an image of the same shape whose samples are integers. Each cell gets the one that
        /// covers most of it, and facets between two are tagged interface-2-5. Without IMAGE, or
        /// with --features labels, atoms are drawn to where labels meet
        #[arg(long, value_name = "FILE")]
        pub labels: PathBuf,
    }
}

section! {
    /// How the image becomes a potential.
    pub struct PotentialOptions {
        /// What attracts atoms. Of images that show it: dark or bright places, edges, places where labels meet
        /// (labels), or none. Of raw images: ridges (the middles of lines and sheets), and of seismic amplitudes
        /// faults and horizons. Several may share a potential, each with its weight, as in faults,horizons:0.5.
        /// Default: dark
        #[arg(long, visible_alias = "as", value_name = "KIND[:WEIGHT],...")]
        pub features: Text<Mixture>,
        /// How edges are found: by derivatives of a Gaussian; by the paper's Prewitt differences; or thinned to
        /// where a Gaussian's are steepest (crest) and widened to valleys of one depth. Default: gaussian
        #[arg(long, value_name = "OPERATOR",
            value_parser = named::<EdgeOperator>(&["gaussian", "prewitt", "crest"]))]
        pub edge_operator: EdgeOperator,
        /// Standard deviation of the Gaussian that finds edges, or where labels meet, in least steps, 0.3
        /// or more. Default: 1.5; of crests as wide as the noise asks for
        #[arg(long, value_name = "SIGMA",
            value_parser = number_in(0.3, 1000.0, "a number of samples from 0.3 to 1000"))]
        pub edge_scale: f64,
        /// Take noise off the image before features are looked for, and keep its edges (non-local means). SHARE is how
        /// much patches of the image may differ, over the noise, and still be averaged; 0.4 if left out. Default: off
        #[arg(long, value_name = "SHARE", num_args = 0..=1, require_equals = true,
            default_missing_value = "0.4",
            value_parser = number_in(0.01, 10.0, "a number from 0.01 to 10"))]
        pub denoise: f64,
        /// Which ridges and horizons: bright ones (peaks), dark ones (troughs), or both. Default: bright
        #[arg(long, value_name = "WHICH",
            value_parser = named::<Polarity>(&["bright", "dark", "both"]))]
        pub polarity: Polarity,
        /// Standard deviation, in least steps, of the Gaussian whose derivatives find ridges and horizons, 0.3 or more.
        /// Default: 1.5 for ridges, 1 for horizons
        #[arg(long, value_name = "SIGMA",
            value_parser = number_in(0.3, 1000.0, "a number of samples from 0.3 to 1000"))]
        pub scale: f64,
        /// Standard deviation, in least steps, of the Gaussian over which the directions of ridges and horizons are
        /// averaged; of ridges also 0, the direction at each sample. Default: 12 for ridges, 8 for horizons
        #[arg(long, value_name = "SIGMA",
            value_parser = number_in(0.0, 1000.0, "a number of samples from 0 to 1000"))]
        pub normal_scale: f64,
        /// Least strength of ridges, horizons, faults and crests of edges, 0 to 1, where they hang together with
        /// stronger parts. Default: 0.3, 0.15, 0.1, 0.2
        #[arg(long, value_name = "SHARE", value_parser = number_in(0.0, 1.0, "a number from 0 to 1"))]
        pub low: f64,
        /// Strength that each of them reaches somewhere, 0 to 1. Default: 0.5; of horizons 0.4
        #[arg(long, value_name = "SHARE", value_parser = number_in(0.0, 1.0, "a number from 0 to 1"))]
        pub high: f64,
        /// Least length of each of them in samples; in a volume its square is the least area. Default: 10 for ridges
        /// and edges, 20 for horizons and faults
        #[arg(long, value_name = "LENGTH",
            value_parser = number_in(0.0, 1e6, "a number of samples from 0 to 1e6"))]
        pub least_length: f64,
        /// Mean distance along layers, in samples, of what is compared on the two sides of a fault: more withstands
        /// more noise, and blurs faults close together. Default: 4
        #[arg(long, value_name = "LENGTH",
            value_parser = number_in(1.0, 1000.0, "a number of samples from 1 to 1000"))]
        pub layer_reach: f64,
        /// Standard deviation of the mean along a fault's dip, in samples: more withstands more noise, and blurs faults
        /// that bend. Default: 12
        #[arg(long, value_name = "SIGMA",
            value_parser = number_in(0.5, 1000.0, "a number of samples from 0.5 to 1000"))]
        pub dip_reach: f64,
        /// Least dip of faults from the horizontal in degrees, 20 to 85, where samples are as far apart along all axes.
        /// Default: 45
        #[arg(long, value_name = "DEGREES",
            value_parser = number_in(20.0, 85.0, "an angle from 20 to 85"))]
        pub least_dip: f64,
        /// Push atoms off features, so that they line up alongside. Default: false; true with
        /// --mesh voronoi, whose faces then fall on the features
        #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true,
            default_missing_value = "true")]
        pub repel: bool,
        /// Standard deviation in lattice units of a Gaussian over the potential; the width of the valleys of ridges,
        /// faults, horizons and crests. Default: the least step, for dark and bright features a quarter of the edge
        /// length where they repel with --mesh voronoi; none for edges
        #[arg(long, value_name = "SIGMA",
            value_parser = number_in(0.0, f64::MAX, "a length of 0 or more"))]
        pub smooth: f64,
    }
}

impl PotentialOptions {
    /// What the core takes of them: what is not given, from `basis`.
    pub fn feature_options(&self, basis: FeatureOptions) -> FeatureOptions {
        let single = self.features.as_ref().and_then(|mixture| mixture.0.single());
        let crests = CrestOptions {
            polarity: self.polarity,
            scale: self.scale,
            normal_scale: self.normal_scale,
            low: self.low,
            high: self.high,
            least_length: self.least_length,
        };
        FeatureOptions {
            features: single.unwrap_or(basis.features),
            edge_operator: self.edge_operator.unwrap_or(basis.edge_operator),
            edge_scale: self.edge_scale.unwrap_or(basis.edge_scale),
            smooth: self.smooth.or(basis.smooth),
            denoise: self.denoise.or(basis.denoise),
            repel: self.repel.unwrap_or(basis.repel),
            ridges: crests.or(basis.ridges),
            horizons: HorizonOptions { crests: crests.or(basis.horizons.crests), ..basis.horizons },
            faults: FaultOptions {
                layer_reach: self.layer_reach.unwrap_or(basis.faults.layer_reach),
                dip_reach: self.dip_reach.unwrap_or(basis.faults.dip_reach),
                least_dip: self.least_dip.unwrap_or(basis.faults.least_dip),
                crests: crests.or(basis.faults.crests),
                ..basis.faults
            },
            edges: CrestOptions { scale: self.edge_scale, ..crests }.or(basis.edges),
            ..basis
        }
    }

    /// The kinds of features, if they are more than one of weight 1.
    pub fn mixture(&self) -> Option<Mixture> {
        let Text(mixture) = self.features.as_ref()?;
        mixture.single().is_none().then(|| mixture.clone())
    }
}

section! {
    /// The lattice of atoms.
    pub struct LatticeOptions {
        /// Cells: triangles or tetrahedra between the atoms, or Voronoi's (PEBI) polygons or
        /// polyhedra around them, cut by the image's box. Default: delaunay
        #[arg(long, value_name = "KIND",
            value_parser = named::<MeshKind>(&["delaunay", "voronoi"]))]
        pub mesh: MeshKind,
        /// Put atoms in pairs, mirror images of each other in the features that repel, so that the faces of Voronoi
        /// cells fall on these. Default: false; true with --mesh voronoi
        #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true,
            default_missing_value = "true")]
        pub mirror: bool,
        /// Edge length wanted, in lattice units: one, as in 8, or from features to elsewhere, as in
        /// 6..18. Default: from the size of the image
        #[arg(long, value_name = "D | MIN..MAX", allow_hyphen_values = true)]
        pub size: SizeValue,
        /// Where --size MIN..MAX is least: where features are dense, where they are narrow or bent (curvature), or
        /// near them (distance). Default: density
        #[arg(long, value_name = "WHAT",
            value_parser = named::<GradeBy>(&["density", "curvature", "distance"]))]
        pub grade_by: GradeBy,
        /// Greatest frequency of waves in 1/s, if IMAGE holds their velocities: edges as long as a
        /// wavelength, v / f, over --points-per-wavelength, instead of --size
        #[arg(long, value_name = "HZ", conflicts_with_all = ["size", "size_field"],
            value_parser = number_in(f64::MIN_POSITIVE, f64::MAX, "a frequency above 0"))]
        pub frequency: f64,
        /// Edges in a wavelength, with --frequency. Default: 5
        #[arg(long, value_name = "COUNT",
            value_parser = number_in(f64::MIN_POSITIVE, f64::MAX, "a number above 0"))]
        pub points_per_wavelength: f64,
        /// Weight β of the image against regularity, 0 to 1. Default: 0.45
        #[arg(long, value_name = "BETA", allow_hyphen_values = true,
            value_parser = number_in(0.0, 1.0, "a number from 0 to 1"))]
        pub beta: f64,
        /// Lattice units: the frame's own (millimetres, metres ...), or samples, as in the paper.
        /// Default: physical
        #[arg(long, value_name = "UNITS", value_parser = named::<Units>(&["physical", "samples"]))]
        pub units: Units,
        /// Lattice to start from: hexagonal (2-D); bcc, fcc (3-D); random (both). Default: hexagonal
        /// or bcc
        #[arg(long, value_name = "KIND",
            value_parser = named::<LatticeKind>(&["hexagonal", "bcc", "fcc", "random"]))]
        pub lattice: LatticeKind,
        /// Share γ of the edge length that an atom of the starting lattice keeps free, 0.1 to 1.
        /// Default: 0.8
        #[arg(long, value_name = "GAMMA",
            value_parser = number_in(0.1, 1.0, "a number from 0.1 to 1"))]
        pub spacing_factor: f64,
        /// Atom that stays where it is, such as a well, in world coordinates; growth starts there.
        /// May be given many times
        #[arg(long, value_name = "X,Y[,Z]", allow_hyphen_values = true)]
        pub seed_point: Vec<Numbers>,
    }
}

section! {
    /// How atoms are moved.
    pub struct OptimizerOptions {
        /// What computes the energy: neighbour pairs, or the paper's sums over samples. Default:
        /// pairs
        #[arg(long, value_name = "ENGINE",
            value_parser = named::<EngineKind>(&["pairs", "sampled"]))]
        pub engine: EngineKind,
        /// How the potential is read between samples. Default: spline in 2-D, linear in 3-D
        #[arg(long, value_name = "KIND",
            value_parser = named::<Interpolation>(&["nearest", "linear", "spline"]))]
        pub interpolation: Interpolation,
        /// Stages on a smoothed potential before the sharp one. Default: 2 in 2-D,
        /// 0 in 3-D and with --mesh voronoi
        #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(0..=MOST_STEPS))]
        pub smoothing_steps: u64,
        /// Relative decrease ε of the energy at which the work ends. Default: 0.001
        #[arg(long, value_name = "EPSILON",
            value_parser = number_in(0.0, 0.999, "a number from 0 to 0.999"))]
        pub tolerance: f64,
        /// Iterations that lower the energy, at most, after each perturbation. Default: 200
        #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
        pub inner_limit: u64,
        /// Perturbations, at most. Default: 2 in 2-D, 1 in 3-D
        #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(0..=1_000_000))]
        pub outer_limit: u64,
        /// How far a perturbation moves an atom, over its edge length, below 0.5. Default: 0.1
        #[arg(long, value_name = "SHARE",
            value_parser = number_in(0.0, 0.499, "a number from 0 to 0.499"))]
        pub perturbation: f64,
        /// Seed of all random numbers. Default: 0
        #[arg(long, value_name = "SEED",
            value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
        pub seed: u64,
    }
}

section! {
    /// How cells are labelled.
    pub struct RegionOptions {
        /// Cells of one label that hang together, if fewer than this, take the label of their
        /// neighbours. Default: 0
        #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(0..=1_000_000_000))]
        pub least_island: u64,
    }
}

section! {
    /// How the mesh is improved once the atoms are connected.
    pub struct ImprovementOptions {
        /// Turn the edges (2-D) or faces (3-D) of the mesh onto features: not, by swaps alone, or by
        /// swaps and moves of points. Default: full
        #[arg(long, value_name = "HOW",
            value_parser = named::<Align>(&["off", "swaps", "full"]))]
        pub align: Align,
        /// Least angle in degrees that swaps and moves keep or restore: interior angles below 60 in
        /// 2-D, dihedral angles below 70.5 in 3-D. Default: 20 in 2-D, 15 in 3-D
        #[arg(long, value_name = "DEGREES",
            value_parser = number_in(0.0, 70.0, "an angle from 0 to 70"))]
        pub min_angle: f64,
    }
}

/// What a picture shows behind the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Backdrop {
    /// The image that was meshed.
    #[default]
    Image,
    /// b(x), as the atoms felt it.
    Potential,
    /// d(x).
    Distance,
    /// How many features there are around.
    Density,
}

section! {
    /// The files that are written.
    pub struct OutputOptions {
        /// Mesh to write: .vtu .vtk .msh (Gmsh 4.1) .msh2 (Gmsh 2.2) .npz .inp (Abaqus), or a folder named
        /// polyMesh (OpenFOAM); Voronoi cells: .vtu or polyMesh. Coordinates are the image's world coordinates
        #[arg(short, long, value_name = "MESH")]
        pub output: PathBuf,
        /// Version of Gmsh's format in a .msh file. Default: 4.1
        #[arg(long, value_name = "VERSION", value_parser = ["4.1", "2.2"])]
        pub msh: String,
        /// Order of the cells: 2 writes triangles of 6 and tetrahedra of 10 points, on a mask's outline
        /// curved. Default: 1
        #[arg(long, value_name = "ORDER", value_parser = clap::value_parser!(u8).range(1..=2))]
        pub order: u8,
        /// Tag facets along which the mean of b is at most this, such as -0.2, as features, beside the sides of
        /// the box; `features` does it with more choice. Not in .vtk and .npz
        #[arg(long, value_name = "B", allow_hyphen_values = true,
            value_parser = number_in(-1.0, 1.0, "a number from -1 to 1"))]
        pub tag_features: f64,
        /// Write the parts into which the tagged features cut the mesh as regions of cells, 1, 2 ...; parts smaller
        /// than --least-island go to their neighbours
        #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true,
            default_missing_value = "true")]
        pub regions: bool,
        /// List of the connections of Voronoi cells, for flow simulators: a head as JSON, and beside
        /// it NAME-cells.csv, NAME-connections.csv and NAME-boundary.csv
        #[arg(long, value_name = "NAME.json")]
        pub connections: PathBuf,
        /// Picture of the mesh over the image, .png or .svg; in 3-D of the three slices through the
        /// middle
        #[arg(long, value_name = "PICTURE")]
        pub picture: PathBuf,
        /// What the picture shows behind the mesh: the image, the potential, the nominal distance, or the density of
        /// features, smoothed by the greatest distance. Needs --picture. Default: image
        #[arg(long, value_name = "WHAT",
            value_parser = named::<Backdrop>(&["image", "potential", "distance", "density"]))]
        pub picture_of: Backdrop,
        /// Figures of the mesh (shape, alignment, fidelity) and of the run, as JSON; as a page if it ends
        /// in .html
        #[arg(long, value_name = "JSON")]
        pub report: PathBuf,
        /// The same figures with a picture and histograms, as one HTML page that needs no other file
        #[arg(long, value_name = "HTML")]
        pub html: PathBuf,
        /// Potential that the atoms felt: .npy (axes z, y, x), .nii, .nii.gz, .nrrd, .vti, .tif
        /// or .raw, float32. .nii, .nrrd and .vti keep the frame
        #[arg(long, value_name = "FILE")]
        pub write_potential: PathBuf,
    }
}

impl InputOptions {
    /// All files that are read.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        let all = [
            &self.image,
            &self.potential,
            &self.size_field,
            &self.beta_field,
            &self.mask,
            &self.labels,
        ];
        all.into_iter().flatten().map(PathBuf::as_path)
    }
}

impl LatticeOptions {
    /// What --size or --frequency ask for.
    fn wanted_size(&self) -> Result<Size, Failure> {
        let points = self.points_per_wavelength;
        match (self.frequency, points, self.size) {
            (None, None, size) => Ok(size.map_or(Size::Default, |s| s.0)),
            (None, Some(_), _) => {
                Err(Failure::misuse("--points-per-wavelength without --frequency; expected both"))
            }
            (Some(_), ..) if self.units == Some(Units::Samples) => {
                Err(Failure::misuse("--frequency with --units samples; expected physical units"))
            }
            (Some(frequency), points, _) => {
                Ok(Size::Wavelength { frequency, points: points.unwrap_or(POINTS_PER_WAVELENGTH) })
            }
        }
    }
}

/// Everything that decides a run: tables of options with the command line's names.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct RunConfig {
    /// Files read.
    #[command(flatten, next_help_heading = "Input")]
    #[serde(skip_serializing_if = "InputOptions::is_empty")]
    pub input: InputOptions,
    /// Files written.
    #[command(flatten, next_help_heading = "Output")]
    #[serde(skip_serializing_if = "OutputOptions::is_empty")]
    pub output: OutputOptions,
    /// Lattice.
    #[command(flatten, next_help_heading = "Lattice")]
    #[serde(skip_serializing_if = "LatticeOptions::is_empty")]
    pub lattice: LatticeOptions,
    /// Potential.
    #[command(flatten, next_help_heading = "Features")]
    #[serde(skip_serializing_if = "PotentialOptions::is_empty")]
    pub features: PotentialOptions,
    /// Regions.
    #[command(flatten, next_help_heading = "Regions")]
    #[serde(skip_serializing_if = "RegionOptions::is_empty")]
    pub regions: RegionOptions,
    /// Frame.
    #[command(flatten, next_help_heading = "Frame")]
    #[serde(skip_serializing_if = "FrameOptions::is_empty")]
    pub frame: FrameOptions,
    /// Optimizer.
    #[command(flatten, next_help_heading = "Optimisation")]
    #[serde(skip_serializing_if = "OptimizerOptions::is_empty")]
    pub optimize: OptimizerOptions,
    /// Improvement.
    #[command(flatten, next_help_heading = "Improvement")]
    #[serde(skip_serializing_if = "ImprovementOptions::is_empty")]
    pub improve: ImprovementOptions,
}

impl RunConfig {
    /// Whether the cells are Voronoi's.
    pub fn is_voronoi(&self) -> bool {
        self.lattice.mesh == Some(MeshKind::Voronoi)
    }

    /// Reads a configuration.
    ///
    /// # Errors
    /// [`Failure`] with the line if a key is unknown or a value is of the wrong kind.
    pub fn parse(text: &str) -> Result<Self, Failure> {
        toml::from_str(text).map_err(|e| {
            let line = e.span().map_or(1, |s| text[..s.start].matches('\n').count() + 1);
            Failure::misuse(format!("line {line}: {}", e.message().replace('\n', "; ")))
        })
    }

    /// Takes from a configuration's file what was not given.
    ///
    /// # Errors
    /// [`Failure`] names the file, if it cannot be read or parsed.
    pub fn or_file(self, path: &Path) -> Result<Self, Failure> {
        let text = std::fs::read_to_string(path)
            .map_err(|e| Failure::content(format!("cannot be read: {e}")).about(path))?;
        Ok(self.or(Self::parse(&text).map_err(|f| f.about(path))?))
    }

    /// The text of a configuration that gives the same run.
    pub fn to_toml(&self) -> Result<String, Failure> {
        toml::to_string(self).map_err(Failure::content)
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
        let moves = mesh.optimize.clone();
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
            regions: RegionOptions { least_island: Some(mesh.least_island as u64) },
            optimize: OptimizerOptions {
                engine: Some(moves.engine),
                interpolation: Some(mesh.interpolation),
                smoothing_steps: Some(moves.smoothing_steps as u64),
                tolerance: Some(moves.tolerance),
                inner_limit: Some(moves.inner_limit as u64),
                outer_limit: Some(moves.outer_limit as u64),
                perturbation: Some(moves.perturbation),
                seed: Some(moves.seed),
            },
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
        self.or(defaults)
    }

    /// The options that the core takes.
    ///
    /// # Errors
    /// [`Failure`] if a seed point has another number of coordinates, or a value from a configuration
    /// is out of its range.
    pub fn mesh_options<const D: usize>(&self) -> Result<MeshOptions<D>, Failure> {
        let (lattice, features, moves) = (&self.lattice, &self.features, &self.optimize);
        let default = MeshOptions::<D>::for_kind(lattice.mesh.unwrap_or_default());
        let seeds = lattice.seed_point.iter().flatten();
        let count = |n: Option<u64>, default: usize| n.map_or(default, |n| n as usize);
        let optimize = OptimizeOptions {
            engine: moves.engine.unwrap_or(default.optimize.engine),
            tolerance: moves.tolerance.unwrap_or(default.optimize.tolerance),
            inner_limit: count(moves.inner_limit, default.optimize.inner_limit),
            outer_limit: count(moves.outer_limit, default.optimize.outer_limit),
            perturbation: moves.perturbation.unwrap_or(default.optimize.perturbation),
            smoothing_steps: count(moves.smoothing_steps, default.optimize.smoothing_steps),
            seed: moves.seed.unwrap_or(default.optimize.seed),
            ..default.optimize
        };
        optimize.validate().map_err(Failure::misuse)?;
        let improve = ImproveOptions {
            align: self.improve.align.unwrap_or(default.improve.align),
            min_angle: self.improve.min_angle.unwrap_or(default.improve.min_angle),
        };
        // below the bound of the greater dimension, as long as the image is not known
        improve.validate(3).map_err(Failure::misuse)?;
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
            least_island: count(self.regions.least_island, default.least_island),
            memory_limit: None,
        })
    }

    /// Checks what does not need the image.
    ///
    /// # Errors
    /// [`Failure`] names the first option that is out of its range.
    pub fn check(&self) -> Result<(), Failure> {
        let seeds = self.lattice.seed_point.iter().flatten();
        if let Some(odd) = seeds.map(|p| p.0.len()).find(|n| !(2..=3).contains(n)) {
            let message = format!("--seed-point has {odd} numbers; expected 2 or 3");
            return Err(Failure::misuse(message));
        }
        let without_seeds = LatticeOptions { seed_point: None, ..self.lattice.clone() };
        Self { lattice: without_seeds, ..self.clone() }.mesh_options::<2>().map(drop)
    }

    /// What decides the mesh beside the files, for its metadata: no paths.
    pub fn provenance<const D: usize>(&self) -> serde_json::Value {
        let mut run = self.clone().with_defaults::<D>();
        run.input = InputOptions::default();
        run.output = OutputOptions::default();
        serde_json::to_value(run).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Args;

    /// The defaults of a dimension by option.
    fn defaults<const D: usize>() -> Vec<(String, String)> {
        let run = RunConfig::default().with_defaults::<D>();
        let tables = serde_json::to_value(run).unwrap();
        let options = tables.as_object().unwrap().values().flat_map(|t| t.as_object().unwrap());
        options
            .map(|(name, value)| {
                (name.clone(), value.as_str().map_or_else(|| value.to_string(), str::to_owned))
            })
            .collect()
    }

    #[test]
    fn help_states_the_defaults_that_are_used() {
        let command = RunConfig::augment_args(clap::Command::new("mesh"));
        for (name, value) in [defaults::<2>(), defaults::<3>()].concat() {
            let option = command.get_arguments().find(|a| a.get_long() == Some(&name));
            let help = option.unwrap().get_help().unwrap().to_string();
            let (_, stated) = help.split_once("Default: ").unwrap_or_else(|| panic!("{name}"));
            let words: Vec<&str> = stated.split([' ', ',', ';']).collect();
            let stated: Vec<f64> = stated.split([' ', ',', ';']).flat_map(str::parse).collect();
            let same = match value.parse::<f64>() {
                Ok(value) => stated.contains(&value),
                Err(_) => words.contains(&value.as_str()),
            };
            assert!(same, "--{name} is {value}; help says: {help}");
        }
    }

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
        assert_eq!(size, Size::Wavelength { frequency: 2.0, points });
        assert_eq!(both.with_defaults::<2>().lattice.points_per_wavelength, Some(points));

        line.lattice.units = Some(Units::Samples);
        assert!(line.check().is_err());
        let points = RunConfig::parse("[lattice]\npoints-per-wavelength = 4.0\n").unwrap();
        assert!(points.check().is_err());
    }
}
