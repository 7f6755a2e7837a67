//! The files that are written with a mesh.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use atomesh_io::mesh::SectionKind;

use super::section::section;
use crate::error::JobError;
use crate::values::{MaterialSpec, Text};
#[cfg(feature = "clap")]
use crate::values::{named, number_in};

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
    /// The density of features.
    Density,
}

/// How a picture of a volume shows it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum View {
    /// Three slices through the middle, and where they are in space.
    #[default]
    Slices,
    /// Slices and surfaces in space.
    #[serde(rename = "3d")]
    Space,
    /// Cells in space, an eighth of them cut away.
    CutAway,
}

impl View {
    /// Refuses views in space of what is flat.
    ///
    /// # Errors
    /// [`JobError`] says what `--view` is for.
    pub(crate) fn check_dimension(self, dimension: usize) -> Result<(), JobError> {
        match (self, dimension) {
            (Self::Slices, _) | (_, 3) => Ok(()),
            _ => {
                let message = "--view is for pictures of volumes, and this image is flat";
                Err(JobError::misuse(message).advise("leave --view out"))
            }
        }
    }
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
        /// Write a .msh or .msh2 file as text, which Netgen and GetFEM need. Default: binary
        #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true,
            default_missing_value = "true")]
        pub msh_text: bool,
        /// Order of the cells: 2 writes triangles of 6 and tetrahedra of 10 points, curved on a mask's
        /// outline. Default: 1
        #[arg(long, value_name = "ORDER", value_parser = clap::value_parser!(u8).range(1..=2))]
        pub order: u8,
        /// Abaqus: write what the cells are, in sections of one material for each region, called as the region: solid (3-D),
        /// plane-stress or plane-strain of thickness 1, or axisymmetric about the y axis (2-D). Default: plane stress in
        /// 2-D, and no sections
        #[arg(long, value_name = "KIND",
            value_parser = named::<SectionKind>(SectionKind::NAMES))]
        pub section: SectionKind,
        /// Abaqus: write the elastic material of a region beside its section: Young's modulus E and Poisson's ratio
        /// NU. May be given many times
        #[arg(long, value_name = "REGION=E,NU", allow_hyphen_values = true)]
        pub material: Vec<Text<MaterialSpec>>,
        /// Tag facets along which the mean of b is at most this (-1 to 1, such as -0.2) as features, beside the
        /// sides of the box; `features` offers more choice. Not in .vtk and .npz
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
        /// Picture of the mesh over the image, .png or .svg; in 3-D, of the three slices through the
        /// middle
        #[arg(long, value_name = "PICTURE")]
        pub picture: PathBuf,
        /// What the picture shows behind the mesh: the image, the potential, the nominal distance, or the density of
        /// features, smoothed over the greatest nominal distance. Needs --picture or --movie. Default: image
        #[arg(long, value_name = "WHAT",
            value_parser = named::<Backdrop>(&["image", "potential", "distance", "density"]))]
        pub picture_of: Backdrop,
        /// What the picture of a volume shows: three slices; 3d, in space, slices and the surfaces of features, labels or
        /// the mask; or cut-away, in space, the cells, an eighth of them cut away. Needs --picture. Default: slices
        #[arg(long, value_name = "VIEW", value_parser = named::<View>(&["slices", "3d", "cut-away"]))]
        pub view: View,
        /// Movie of the run, an animated .png: atoms on their way to the features over what --picture-of names, at most 100
        /// steps, and at last the mesh; sides of up to 640 pixels. In 3-D, the atoms within half an edge length of the three
        /// slices through the middle, up to 900 pixels
        #[arg(long, value_name = "PICTURE")]
        pub movie: PathBuf,
        /// Figures of the mesh (shape, alignment, fidelity) and of the run, as JSON; as a page if the name ends
        /// in .html
        #[arg(long, value_name = "JSON")]
        pub report: PathBuf,
        /// The same figures with a picture and histograms, as one self-contained HTML page
        #[arg(long, value_name = "HTML")]
        pub html: PathBuf,
        /// Potential that the atoms felt: .npy (axes z, y, x), .nii, .nii.gz, .nrrd, .vti, .tif
        /// or .raw, float32. .nii, .nrrd and .vti keep the frame
        #[arg(long, value_name = "FILE")]
        pub write_potential: PathBuf,
    }
}

impl OutputOptions {
    pub(crate) fn files_mut(&mut self) -> [Option<&mut PathBuf>; 7] {
        let Self { output, connections, picture, movie, report, html, write_potential, .. } = self;
        [output, connections, picture, movie, report, html, write_potential].map(Option::as_mut)
    }
}
