//! The formats of image files, by their names and first bytes.

use std::fmt;
use std::path::Path;

use super::dicom;

/// The image formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ImageFormat {
    /// Portable Network Graphics.
    Png,
    /// JPEG.
    Jpeg,
    /// The Netpbm family: PBM, PGM, PPM, PAM.
    Pnm,
    /// Tagged Image File Format, also BigTIFF.
    Tiff,
    /// NumPy's array file.
    Npy,
    /// NIfTI-1 in one file, `.nii`.
    Nifti,
    /// The same compressed by gzip, `.nii.gz`.
    NiftiGz,
    /// DICOM, a folder of slices or `.dcm`.
    Dicom,
    /// MetaImage, `.mha`, or `.mhd` with the samples in other files.
    MetaImage,
    /// Nearly raw raster data, `.nrrd`, or `.nhdr` with the samples in other files.
    Nrrd,
    /// VTK's XML format for images.
    Vti,
    /// SEG-Y, revisions 0 to 2.
    Segy,
    /// Madagascar's regularly sampled format.
    Rsf,
    /// Samples and nothing else.
    Raw,
}

impl ImageFormat {
    /// The endings by which formats are known.
    pub const EXTENSIONS: [&str; 23] = [
        ".png", ".jpg", ".jpeg", ".pnm", ".pgm", ".ppm", ".pbm", ".pam", ".tif", ".tiff", ".npy",
        ".nii", ".nii.gz", ".dcm", ".mha", ".mhd", ".nrrd", ".nhdr", ".vti", ".sgy", ".segy",
        ".rsf", ".raw",
    ];

    /// The format that a file's name promises, in upper or lower case; none if it is not known.
    pub fn from_path(path: &Path) -> Option<Self> {
        Some(match extension(path).as_str() {
            ".png" => Self::Png,
            ".jpg" | ".jpeg" => Self::Jpeg,
            ".pnm" | ".pgm" | ".ppm" | ".pbm" | ".pam" => Self::Pnm,
            ".tif" | ".tiff" => Self::Tiff,
            ".npy" => Self::Npy,
            ".nii" => Self::Nifti,
            ".nii.gz" => Self::NiftiGz,
            ".dcm" => Self::Dicom,
            ".mha" | ".mhd" => Self::MetaImage,
            ".nrrd" | ".nhdr" => Self::Nrrd,
            ".vti" => Self::Vti,
            ".sgy" | ".segy" => Self::Segy,
            ".rsf" => Self::Rsf,
            ".raw" => Self::Raw,
            _ => return None,
        })
    }

    /// The format of what is at a path: DICOM for a folder, and for a file that is called like nothing
    /// known and begins as DICOM does; else that which the name promises.
    pub fn of(path: &Path) -> Option<Self> {
        if path.is_dir() {
            return Some(Self::Dicom);
        }
        Self::from_path(path).or_else(|| dicom::is_dicom(path).then_some(Self::Dicom))
    }

    /// Whether a file of this format may begin with these bytes. NIfTI's magic stands further
    /// behind, so its reader looks for it.
    pub(super) fn may_begin_with(self, head: &[u8]) -> bool {
        match self {
            Self::Png => head.starts_with(b"\x89PNG\r\n\x1a\n"),
            Self::Jpeg => head.starts_with(b"\xff\xd8\xff"),
            Self::Pnm => matches!(head, [b'P', b'1'..=b'7', ..]),
            Self::Tiff => {
                matches!(head, [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..])
            }
            Self::Npy => head.starts_with(b"\x93NUMPY"),
            Self::Nifti => !head.starts_with(b"\x1f\x8b"),
            Self::NiftiGz => head.starts_with(b"\x1f\x8b"),
            Self::Nrrd => head.starts_with(b"NRRD000"),
            // an XML declaration may come first, and a byte order mark before that
            Self::Vti => {
                let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
                head.is_empty() || head.starts_with(b"<")
            }
            // begins with a word of text
            Self::MetaImage => head.iter().all(|b| b.is_ascii_graphic() || b.is_ascii_whitespace()),
            // the magic word comes after 128 bytes of anything
            Self::Dicom | Self::Segy | Self::Rsf | Self::Raw => true,
        }
    }

    /// Whether files of this format say where their samples are in the world.
    pub fn has_frame(self) -> bool {
        self.z_is_height() || matches!(self, Self::Segy | Self::Rsf)
    }

    /// Whether the world's z axis points up, so that pictures show it so. That of seismic data is
    /// depth or time.
    pub fn z_is_height(self) -> bool {
        use ImageFormat::{Dicom, MetaImage, Nifti, NiftiGz, Nrrd, Vti};
        matches!(self, Dicom | MetaImage | Nifti | NiftiGz | Nrrd | Vti)
    }
}

impl fmt::Display for ImageFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Pnm => "PNM",
            Self::Tiff => "TIFF",
            Self::Npy => "NPY",
            Self::Nifti => "NIfTI-1",
            Self::NiftiGz => "gzipped NIfTI-1",
            Self::Dicom => "DICOM",
            Self::MetaImage => "MetaImage",
            Self::Nrrd => "NRRD",
            Self::Vti => "VTI",
            Self::Segy => "SEG-Y",
            Self::Rsf => "RSF",
            Self::Raw => "raw",
        })
    }
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
