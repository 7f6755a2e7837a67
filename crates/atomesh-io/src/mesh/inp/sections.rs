//! What the elements of an Abaqus input file are, and of which material.

use serde::{Deserialize, Serialize};

/// What the elements of an Abaqus input file are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SectionKind {
    /// Tetrahedra.
    Solid,
    /// Triangles without stress across their plane, of thickness 1.
    PlaneStress,
    /// Triangles without strain across their plane, of thickness 1.
    PlaneStrain,
    /// Triangles of a body of revolution about the y axis, x being the radius.
    Axisymmetric,
}

impl SectionKind {
    /// The names by which serde knows them.
    pub const NAMES: &'static [&'static str] =
        &["solid", "plane-stress", "plane-strain", "axisymmetric"];

    /// Whether it is one of cells of so many dimensions.
    pub fn is_of_dimension(self, dimension: usize) -> bool {
        (dimension == 3) == (self == Self::Solid)
    }

    /// Abaqus' name for cells of so many points.
    pub(super) fn element_type(self, node_count: usize) -> &'static str {
        match (self, node_count) {
            (_, 4) => "C3D4",
            (_, 10) => "C3D10",
            (Self::PlaneStrain, 3) => "CPE3",
            (Self::PlaneStrain, _) => "CPE6",
            (Self::Axisymmetric, 3) => "CAX3",
            (Self::Axisymmetric, _) => "CAX6",
            (_, 3) => "CPS3",
            _ => "CPS6",
        }
    }
}

/// An elastic material, the same in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastic {
    /// The region that it fills.
    pub region: i32,
    /// Young's modulus.
    pub youngs_modulus: f64,
    /// Poisson's ratio.
    pub poissons_ratio: f64,
}

/// The sections of a mesh: one for each region, of a material called as the region.
#[derive(Clone, Debug, PartialEq)]
pub struct Sections {
    /// What the elements are.
    pub kind: SectionKind,
    /// The materials whose constants are known.
    pub materials: Vec<Elastic>,
}
