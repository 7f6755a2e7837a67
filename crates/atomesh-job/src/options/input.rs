//! The files that a mesh is made from.

use std::path::{Path, PathBuf};

use super::section::section;

/// The help of the image, with the formats that io's table has.
#[cfg(feature = "clap")]
fn image_help() -> String {
    format!(
        "Image to mesh: {}, a folder of slices (DICOM, TIFF, PNG), or raw samples with --shape and --dtype. Two axes \
         make triangles, three make tetrahedra",
        atomesh_io::image::ImageFormat::usual_endings()
    )
}

section! {
    /// The files that a mesh is made from.
    pub struct InputOptions {
        /// Image to mesh, in any format that is read. Two axes make triangles, three make tetrahedra
        #[arg(value_name = "IMAGE", help_heading = "Arguments", help = image_help())]
        pub image: PathBuf,
        /// Image potential b(x) to use as it is, values from -1 (attracts) to 1 (repels), instead of
        /// the features of IMAGE. With both, IMAGE gives the frame and the picture
        #[arg(long, value_name = "FILE")]
        pub potential: PathBuf,
        /// Nominal distance d(x) in lattice units, an image over IMAGE; replaces --size
        #[arg(long, value_name = "FILE", conflicts_with = "size")]
        pub size_field: PathBuf,
        /// Weight β(x), 0 to 1, an image over IMAGE; replaces --beta
        #[arg(long, value_name = "FILE", conflicts_with = "beta")]
        pub beta_field: PathBuf,
        /// Mask, an image over IMAGE: mesh only where it is not 0 (where it is at least 0.5, if
        /// its values are shares from 0 to 1), up to its smooth outline. Features end there. Or the word live: mesh
        /// only where IMAGE has data (traces that are neither missing nor dead, samples that are not NaN)
        #[arg(long, value_name = "FILE|live")]
        pub mask: PathBuf,
        /// Labels, an image of integers over IMAGE: each cell gets the label that covers most
        /// of it, and facets between two labels are tagged, as interface-2-5. Without IMAGE, or with
        /// --features labels, atoms are attracted to the boundaries between labels
        #[arg(long, value_name = "FILE")]
        pub labels: PathBuf,
    }
}

/// Whether a mask is the word for where the image has data; a file of that name is `./live`.
fn is_live(mask: &Path) -> bool {
    mask.as_os_str() == "live"
}

impl InputOptions {
    pub(crate) fn files_mut(&mut self) -> [Option<&mut PathBuf>; 6] {
        let Self { image, potential, size_field, beta_field, mask, labels } = self;
        let mask = mask.as_mut().filter(|mask| !is_live(mask));
        let [image, potential, size_field, beta_field, labels] =
            [image, potential, size_field, beta_field, labels].map(Option::as_mut);
        [image, potential, size_field, beta_field, mask, labels]
    }

    /// The file of the mask, if it is one.
    pub fn mask_file(&self) -> Option<&Path> {
        self.mask.as_deref().filter(|mask| !is_live(mask))
    }

    /// Whether the mesh is to end where the image's data do.
    pub fn masks_absent(&self) -> bool {
        self.mask.as_deref().is_some_and(is_live)
    }

    /// All files that are read.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        let all = [&self.image, &self.potential, &self.size_field, &self.beta_field, &self.labels];
        all.into_iter().flatten().map(PathBuf::as_path).chain(self.mask_file())
    }

    /// The file of the image that gives the frame: the potential or the labels where there is no other.
    pub fn shown(&self) -> Option<&Path> {
        let paths = [&self.image, &self.potential, &self.labels];
        paths.into_iter().flatten().next().map(PathBuf::as_path)
    }
}
