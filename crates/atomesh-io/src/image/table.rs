//! The table of image formats. A new one is a file with its [`Codec`], and a line here.

use std::path::Path;

use super::codec::Codec;
use super::format::ImageFormat;
use super::{
    dicom, jpeg, metaimage, mgh, nifti, npy, npz, nrrd, png, pnm, raw, rsf, segy, slices, tiff,
    vti, vtk,
};

/// Makes of each line a public constant and a row of the table.
macro_rules! formats {
    ($($(#[$doc:meta])* $name:ident = $codec:path;)*) => {
        impl ImageFormat {
            $($(#[$doc])* pub const $name: Self = $codec.format;)*
        }

        /// All formats, in the order in which messages name them.
        pub(super) static CODECS: &[Codec] = &[$($codec),*];
    };
}

formats! {
    /// Portable Network Graphics.
    PNG = png::CODEC;
    /// JPEG.
    JPEG = jpeg::CODEC;
    /// The Netpbm family: PBM, PGM, PPM, PAM.
    PNM = pnm::CODEC;
    /// Tagged Image File Format, also BigTIFF.
    TIFF = tiff::CODEC;
    /// NumPy's array file.
    NPY = npy::CODEC;
    /// NumPy's archive of arrays.
    NPZ = npz::CODEC;
    /// NIfTI in one file, `.nii`, or in two, `.hdr` and `.img`.
    NIFTI = nifti::CODEC;
    /// The same compressed by gzip, `.nii.gz`.
    NIFTI_GZ = nifti::GZIPPED;
    /// FreeSurfer's volumes, `.mgh`.
    MGH = mgh::CODEC;
    /// The same compressed by gzip, `.mgz`.
    MGZ = mgh::GZIPPED;
    /// A folder of slices, each a picture.
    SLICES = slices::CODEC;
    /// DICOM, a folder of slices or `.dcm`.
    DICOM = dicom::CODEC;
    /// Nearly raw raster data, `.nrrd`, or `.nhdr` with the samples in other files.
    NRRD = nrrd::CODEC;
    /// MetaImage, `.mha`, or `.mhd` with the samples in other files.
    META_IMAGE = metaimage::CODEC;
    /// VTK's XML format for images.
    VTI = vti::CODEC;
    /// VTK's legacy format for images.
    VTK = vtk::CODEC;
    /// SEG-Y, revisions 0 to 2.
    SEGY = segy::CODEC;
    /// Seismic Unix.
    SU = segy::su::CODEC;
    /// Madagascar's regularly sampled format.
    RSF = rsf::CODEC;
    /// Samples and nothing else.
    RAW = raw::CODEC;
}

impl ImageFormat {
    /// The format that a file's name promises, in upper or lower case; none if it is not known.
    pub fn from_path(path: &Path) -> Option<Self> {
        let ending = extension(path);
        let found = CODECS.iter().find(|codec| codec.all_endings().any(|own| own == ending));
        found.map(|codec| codec.format)
    }

    /// The format of what is at a path: for a folder slices, if it holds pictures and nothing of DICOM, else DICOM; for
    /// a file of an unknown ending DICOM if it begins so; else the format that the name promises.
    pub fn of(path: &Path) -> Option<Self> {
        let in_folder =
            || CODECS.iter().filter_map(|codec| Some((codec.format, codec.folder.as_ref()?)));
        let by_content = || in_folder().find(|(_, folder)| (folder.is_part)(path));
        if path.is_dir() {
            return Some(by_content().map_or(Self::DICOM, |(format, _)| format));
        }
        Self::from_path(path).or_else(|| by_content().map(|(format, _)| format))
    }

    /// Its row; each format's constant is made of one.
    pub(super) fn codec(self) -> &'static Codec {
        let found = CODECS.iter().find(|codec| codec.format == self);
        found.unwrap_or(&CODECS[0])
    }

    /// Whether files of this format can say where their samples are in the world, or how far apart.
    pub fn has_frame(self) -> bool {
        self.codec().has_frame
    }

    /// Whether all files of this format say it.
    pub fn always_has_frame(self) -> bool {
        self.has_frame() && !self.codec().frame_is_optional
    }

    /// Whether the world's z axis points up, so that pictures show it so. That of seismic data is
    /// depth or time.
    pub fn z_is_height(self) -> bool {
        self.codec().z_is_height
    }

    /// Whether images are written in this format.
    pub fn is_written(self) -> bool {
        self.codec().write.is_some()
    }

    /// Whether images of floats are written in this format.
    pub fn writes_floats(self) -> bool {
        self.is_written() && self.codec().writes_floats
    }

    /// The endings of names by which formats are known, in lower case with their dots.
    pub fn endings() -> impl Iterator<Item = &'static str> {
        CODECS.iter().flat_map(Codec::all_endings)
    }

    /// The endings by which files are written.
    pub fn written_endings() -> impl Iterator<Item = &'static str> {
        let written = CODECS.iter().filter(|codec| codec.write.is_some());
        written.flat_map(|codec| codec.endings).copied()
    }

    /// The usual ending of each format that a file's name alone tells, for help texts: `.png .jpg …`.
    /// Folders and raw samples have to be named in words.
    pub fn usual_endings() -> String {
        let told =
            CODECS.iter().filter(|codec| codec.folder.is_none() && codec.format != Self::RAW);
        joined(told, " ")
    }

    /// The usual ending of each format that is written, parted by `gap`; with `floats`, of those that take
    /// floats alone.
    pub fn usual_written_endings(gap: &str, floats: bool) -> String {
        let written = CODECS.iter().filter(|codec| codec.write.is_some());
        joined(written.filter(|codec| codec.writes_floats || !floats), gap)
    }

    /// The format whose files begin with a magic word that these bytes begin with.
    pub(super) fn beginning_with(head: &[u8]) -> Option<Self> {
        CODECS.iter().find(|codec| codec.is_told_by(head)).map(|codec| codec.format)
    }
}

fn joined<'a>(codecs: impl Iterator<Item = &'a Codec>, gap: &str) -> String {
    codecs.filter_map(|codec| codec.endings.first().copied()).collect::<Vec<_>>().join(gap)
}

/// The ending of a file's name in lower case with its dot, `.nii.gz` as one; empty if there is none.
pub(super) fn extension(path: &Path) -> String {
    let of = |p: &Path| match p.extension() {
        Some(e) => format!(".{}", e.to_string_lossy().to_lowercase()),
        None => String::new(),
    };
    match of(path).as_str() {
        ".gz" => path.file_stem().map(|s| of(Path::new(s))).unwrap_or_default() + ".gz",
        other => other.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_endings_are_those_of_one_format_each() {
        let mut endings: Vec<&str> = ImageFormat::endings().collect();
        let count = endings.len();
        endings.sort_unstable();
        endings.dedup();
        assert_eq!(endings.len(), count);
        for codec in CODECS {
            assert_eq!(codec.format.codec().endings, codec.endings, "{}", codec.format);
            for ending in codec.all_endings() {
                assert_eq!(extension(Path::new(&format!("a.b{ending}"))), ending);
                let shouted = format!("A{}", ending.to_uppercase());
                assert_eq!(ImageFormat::from_path(Path::new(&shouted)), Some(codec.format));
            }
        }
        assert_eq!(ImageFormat::from_path(Path::new("a.xyz")), None);
        assert_eq!(ImageFormat::from_path(Path::new("png")), None);
    }

    #[test]
    fn help_names_the_usual_endings() {
        let read = ".png .jpg .pgm .tif .npy .npz .nii .nii.gz .mgh .mgz .nrrd .mha .vti .vtk .segy .su .rsf";
        assert_eq!(ImageFormat::usual_endings(), read);
        let written = ".png, .tif, .npy, .nii, .nii.gz, .nrrd, .vti, .raw";
        assert_eq!(ImageFormat::usual_written_endings(", ", false), written);
        assert_eq!(ImageFormat::usual_written_endings(", ", true), written[6..]);
    }
}
