//! The lattice of atoms.

use atomesh::fields::GradeBy;
use atomesh::image::Units;
use atomesh::run::{LatticeKind, MeshKind, POINTS_PER_WAVELENGTH, Size};

use super::section::section;
use crate::error::JobError;
use crate::values::{Numbers, SizeValue};
#[cfg(feature = "clap")]
use crate::values::{named, number_in};

section! {
    /// The lattice of atoms.
    pub struct LatticeOptions {
        /// Cells: triangles or tetrahedra between the atoms (delaunay), or Voronoi (PEBI) polygons or
        /// polyhedra around them, clipped to the image's box (voronoi). Default: delaunay
        #[arg(long, value_name = "KIND",
            value_parser = named::<MeshKind>(&["delaunay", "voronoi"]))]
        pub mesh: MeshKind,
        /// Place atoms in pairs, mirror images of each other across features that repel, so that faces of Voronoi
        /// cells fall on the features. Default: false; true with --mesh voronoi
        #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true,
            default_missing_value = "true")]
        pub mirror: bool,
        /// Edge length wanted, in lattice units: one, as in 8, or from features to elsewhere, as in
        /// 6..18. Default: from the size of the image
        #[arg(long, value_name = "D | MIN..MAX", allow_hyphen_values = true)]
        pub size: SizeValue,
        /// Where --size MIN..MAX is least: where features are dense (density), where they are narrow or bent
        /// (curvature), or near them (distance). Default: density
        #[arg(long, value_name = "WHAT",
            value_parser = named::<GradeBy>(&["density", "curvature", "distance"]))]
        pub grade_by: GradeBy,
        /// Greatest frequency f of waves in 1/s, where IMAGE holds their velocity v: edges are v / f /
        /// --points-per-wavelength long, within --size MIN..MAX if that is given too. Where v is 0 (shear waves in
        /// water), MIN is taken
        #[arg(long, value_name = "HZ", conflicts_with = "size_field",
            value_parser = number_in(f64::MIN_POSITIVE, f64::MAX, "a frequency above 0"))]
        pub frequency: f64,
        /// Edges in a wavelength, above 0; with --frequency. Default: 5
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
        /// Lattice to start from: hexagonal (2-D); bcc, fcc (3-D); random (both). Default: hexagonal in 2-D,
        /// bcc in 3-D
        #[arg(long, value_name = "KIND",
            value_parser = named::<LatticeKind>(&["hexagonal", "bcc", "fcc", "random"]))]
        pub lattice: LatticeKind,
        /// Share γ of the edge length that an atom of the starting lattice keeps free of others, 0.1 to 1. Where the
        /// length varies, a small share makes edges shorter than it: less than a third of it is refused. Default: 0.8
        #[arg(long, value_name = "GAMMA",
            value_parser = number_in(0.1, 1.0, "a number from 0.1 to 1"))]
        pub spacing_factor: f64,
        /// Atom that stays where it is, such as a well, in world coordinates; growth starts there.
        /// May be given many times
        #[arg(long, value_name = "X,Y[,Z]", allow_hyphen_values = true)]
        pub seed_point: Vec<Numbers>,
    }
}

impl LatticeOptions {
    /// The one length that --size asks for.
    pub fn wanted_length(&self) -> Option<f64> {
        match self.size?.0 {
            Size::Constant(length) => Some(length),
            _ => None,
        }
    }

    /// What --size or --frequency ask for.
    pub(super) fn wanted_size(&self) -> Result<Size, JobError> {
        let points = self.points_per_wavelength;
        match (self.frequency, points, self.size) {
            (None, None, size) => Ok(size.map_or(Size::Default, |s| s.0)),
            (None, Some(_), _) => {
                Err(JobError::misuse("--points-per-wavelength without --frequency; expected both"))
            }
            (Some(_), ..) if self.units == Some(Units::Samples) => {
                Err(JobError::misuse("--frequency with --units samples; expected physical units"))
            }
            (Some(frequency), points, size) => {
                let (least, greatest) = match size.map(|size| size.0) {
                    None => (None, None),
                    Some(Size::Range { min, max }) => (Some(min), Some(max)),
                    Some(_) => {
                        let message = "--frequency with one --size; expected MIN..MAX, the least and \
                                       the greatest edge length";
                        return Err(JobError::misuse(message));
                    }
                };
                let points = points.unwrap_or(POINTS_PER_WAVELENGTH);
                Ok(Size::Wavelength { frequency, points, least, greatest })
            }
        }
    }
}
