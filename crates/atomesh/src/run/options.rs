//! What a user may choose.

use serde::{Deserialize, Serialize};

use crate::enhance::{FeatureOptions, Mixture};
use crate::fields::GradeBy;
use crate::fields::Interpolation;
use crate::geometry::Point;
use crate::image::Units;
use crate::improve::ImproveOptions;
use crate::optimize::OptimizeOptions;

/// The nominal distance wanted, in lattice units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Size {
    /// [`crate::fields::default_distance`] of the image's box.
    #[default]
    Default,
    /// The same everywhere.
    Constant(f64),
    /// From `min` where features are dense to `max` where there are none (the paper's Fig. 5), or as
    /// [`MeshOptions::grade_by`] says.
    Range {
        /// Where features are densest.
        min: f64,
        /// Where there are none.
        max: f64,
    },
    /// For waves: the image holds velocities v in lattice units a second, and d = v / (frequency · points), so
    /// that a wavelength has so many edges; its slope limited as [`crate::fields::NominalDistance::from_field`]
    /// does.
    Wavelength {
        /// In 1/s.
        frequency: f64,
        /// Edges in a wavelength.
        points: f64,
        /// The least length; it is that where no waves travel (v = 0, such as shear waves in water) too. `None`: as short as
        /// the least v says, and v = 0 is refused.
        #[serde(default)]
        least: Option<f64>,
        /// The greatest length. `None`: as long as the greatest v says.
        #[serde(default)]
        greatest: Option<f64>,
    },
}

/// Edges in a wavelength if nobody says otherwise: what finite elements of low order need for waves that stay in
/// shape over tens of wavelengths.
pub const POINTS_PER_WAVELENGTH: f64 = 5.0;

/// How the box is filled with atoms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LatticeKind {
    /// Hexagonal in 2-D, body-centred cubic in 3-D.
    #[default]
    Default,
    /// Equilateral triangles; 2-D.
    Hexagonal,
    /// Face-centred cubic; 3-D, the paper's.
    Fcc,
    /// Body-centred cubic; 3-D.
    Bcc,
    /// Scattered at random, without a preferred direction (Hale 2002).
    Random,
}

impl LatticeKind {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            LatticeKind::Default => "default",
            LatticeKind::Hexagonal => "hexagonal",
            LatticeKind::Fcc => "fcc",
            LatticeKind::Bcc => "bcc",
            LatticeKind::Random => "random",
        }
    }
}

/// What the cells of the mesh are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MeshKind {
    /// Triangles or tetrahedra between the atoms.
    #[default]
    Delaunay,
    /// Polygons or polyhedra around the atoms: Voronoi's, also called PEBI cells. Best with a potential that
    /// repels ([`FeatureOptions::repel`]): the atoms line up alongside features, and faces fall on them
    /// (Hale 2002).
    Voronoi,
}

/// Everything a user may choose about a mesh. Read from a file, what is left out has its default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshOptions<const D: usize> {
    /// How the image becomes a potential; its `units` are overruled by [`MeshOptions::units`].
    #[serde(default)]
    pub features: FeatureOptions,
    /// Several kinds of features with their weights; goes before the one kind in `features`. Default none.
    #[serde(default)]
    pub mixture: Option<Mixture>,
    /// How b is read between samples. Default [`Interpolation::for_dimension`].
    #[serde(default = "stored::interpolation::<D>")]
    pub interpolation: Interpolation,
    /// What the cells are. Default triangles or tetrahedra.
    #[serde(default)]
    pub kind: MeshKind,
    /// Whether Voronoi cells get pairs of atoms, mirror images of each other in the features that repel
    /// ([`crate::mirror`]), so that faces fall on these. Has no part in triangles and tetrahedra, nor with a mask.
    /// Default false; true for Voronoi cells.
    #[serde(default)]
    pub mirror: bool,
    /// The lattice space. Default physical.
    #[serde(default)]
    pub units: Units,
    /// The nominal distance.
    #[serde(default)]
    pub size: Size,
    /// What makes d small where [`Size::Range`] is given. Default: the density of features.
    #[serde(default)]
    pub grade_by: GradeBy,
    /// β, the weight of the image against regularity, in 0…1; equation (4). Default 0.45: "typically, we
    /// choose β ≈ 1/2" (Hale 2001); a little less costs little alignment and keeps cells well shaped. On the
    /// paper's fault image at d = 8 improved meshes have recall 0.93 and mean quality 0.923 with it, 0.92 and
    /// 0.935 at 0.4, 0.88 and 0.952 at 0.3.
    #[serde(default = "stored::image_weight::<D>")]
    pub image_weight: f64,
    /// The lattice to start from.
    #[serde(default)]
    pub lattice: LatticeKind,
    /// γ, the share of d that an atom of the starting lattice keeps to itself. Default 0.8, the paper's.
    #[serde(default = "stored::spacing_factor::<D>")]
    pub spacing_factor: f64,
    /// Atoms that stay where they are, in world coordinates: wells. Growth starts there.
    #[serde(default, with = "points")]
    pub seed_points: Vec<Point<D>>,
    /// How atoms are moved; its seed is the run's. Default [`OptimizeOptions::for_dimension`].
    #[serde(default = "stored::optimize::<D>")]
    pub optimize: OptimizeOptions,
    /// How the mesh is improved once the atoms are connected. Default [`ImproveOptions::for_dimension`].
    #[serde(default = "stored::improve::<D>")]
    pub improve: ImproveOptions,
    /// Groups of fewer cells of one label than this take that of their neighbours. Default 0: all stay.
    #[serde(default)]
    pub least_island: usize,
    /// Bytes beyond which the work is refused. Default none.
    #[serde(default)]
    pub memory_limit: Option<u64>,
}

impl<const D: usize> MeshOptions<D> {
    /// The defaults for Voronoi cells: features repel, atoms stand in pairs across them, and are moved on the
    /// sharp potential from the start. On the paper's figure 1 (d = 8) faces so follow 0.82 of the features,
    /// without pairs 0.57 (after two smoothed stages 0.48), and where features attract 0.1. On a volume of
    /// faults (`layers-faults`, 128 samples along each axis, d = 6) it is 0.94 with pairs and 0.05 without.
    pub fn voronoi() -> Self {
        let mut options = Self { kind: MeshKind::Voronoi, mirror: true, ..Self::default() };
        options.features.repel = true;
        options.optimize.smoothing_steps = 0;
        options
    }

    /// The defaults for cells of a kind.
    pub fn for_kind(kind: MeshKind) -> Self {
        match kind {
            MeshKind::Delaunay => Self::default(),
            MeshKind::Voronoi => Self::voronoi(),
        }
    }
}

impl<const D: usize> Default for MeshOptions<D> {
    fn default() -> Self {
        Self {
            features: FeatureOptions::default(),
            mixture: None,
            interpolation: Interpolation::for_dimension(D),
            kind: MeshKind::default(),
            mirror: false,
            units: Units::default(),
            size: Size::default(),
            grade_by: GradeBy::default(),
            image_weight: 0.45,
            lattice: LatticeKind::default(),
            spacing_factor: 0.8,
            seed_points: Vec::new(),
            optimize: OptimizeOptions::for_dimension(D),
            improve: ImproveOptions::for_dimension(D),
            least_island: 0,
            memory_limit: None,
        }
    }
}

/// What options that were stored without a value of their own have, where that depends on the dimension or is not
/// their type's default.
mod stored {
    use super::{ImproveOptions, Interpolation, MeshOptions, OptimizeOptions};

    pub fn interpolation<const D: usize>() -> Interpolation {
        MeshOptions::<D>::default().interpolation
    }

    pub fn image_weight<const D: usize>() -> f64 {
        MeshOptions::<D>::default().image_weight
    }

    pub fn spacing_factor<const D: usize>() -> f64 {
        MeshOptions::<D>::default().spacing_factor
    }

    pub fn optimize<const D: usize>() -> OptimizeOptions {
        MeshOptions::<D>::default().optimize
    }

    pub fn improve<const D: usize>() -> ImproveOptions {
        MeshOptions::<D>::default().improve
    }
}

/// Points as lists of D numbers, since serde does not know arrays of generic length.
mod points {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::geometry::Point;

    pub fn serialize<S: Serializer, const D: usize>(
        points: &[Point<D>],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let lists: Vec<&[f64]> = points.iter().map(|p| p.as_slice()).collect();
        lists.serialize(serializer)
    }

    pub fn deserialize<'de, T: Deserializer<'de>, const D: usize>(
        deserializer: T,
    ) -> Result<Vec<Point<D>>, T::Error> {
        let lists = Vec::<Vec<f64>>::deserialize(deserializer)?;
        let point = |list: Vec<f64>| {
            let found = list.len();
            let wrong = |_| T::Error::custom(format!("a point of {found} numbers; expected {D}"));
            list.try_into().map_err(wrong)
        };
        lists.into_iter().map(point).collect()
    }
}
