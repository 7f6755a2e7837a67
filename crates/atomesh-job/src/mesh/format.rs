//! The format that a mesh is written in.

use std::path::Path;

use atomesh_io::mesh::MeshFormat;
use atomesh_io::mesh::msh::{MshEncoding, MshVersion};

use crate::error::JobError;
use crate::files::unknown_extension;

/// What the mesh is written as.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum OutputFormat {
    /// Triangles or tetrahedra.
    Simplices(MeshFormat),
    /// Voronoi cells as VTU.
    VoronoiVtu,
    /// Voronoi cells as OpenFOAM's folder.
    VoronoiFoam,
}

/// What is wanted of Gmsh's format.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MshWish<'a> {
    /// The version, where not that of the file's name.
    pub version: Option<&'a str>,
    /// Whether numbers are text.
    pub is_text: bool,
}

impl OutputFormat {
    /// The format that a path calls for.
    pub fn of(mesh: &Path, is_voronoi: bool, msh: MshWish<'_>) -> Result<Self, JobError> {
        let format = MeshFormat::of(mesh);
        if is_voronoi {
            return match format {
                Ok(MeshFormat::OpenFoam) => Ok(Self::VoronoiFoam),
                Ok(MeshFormat::Vtu) => Ok(Self::VoronoiVtu),
                _ => {
                    let message =
                        "Voronoi cells are written as .vtu, or into a folder named polyMesh";
                    Err(JobError::misuse(message).about(mesh))
                }
            };
        }
        let format = format.map_err(|_| unknown_extension(mesh, &MeshFormat::endings()))?;
        let MshWish { version, is_text } = msh;
        match format {
            MeshFormat::Msh(own, encoding) => {
                let version = version.map_or(Ok(own), msh_version)?;
                let encoding = if is_text { MshEncoding::Text } else { encoding };
                Ok(Self::Simplices(MeshFormat::Msh(version, encoding)))
            }
            _ if version.is_some() => Err(JobError::misuse("--msh is for .msh files").about(mesh)),
            _ if is_text => {
                Err(JobError::misuse("--msh-text is for .msh and .msh2 files").about(mesh))
            }
            _ => Ok(Self::Simplices(format)),
        }
    }

    /// Whether it holds groups of facets that follow features.
    pub fn holds_tags(self) -> bool {
        matches!(self, Self::Simplices(format) if format.holds_tags())
    }

    /// Whether it holds cells of second order.
    pub fn holds_quadratic(self) -> bool {
        matches!(self, Self::Simplices(format) if format.holds_quadratic())
    }
}

fn msh_version(text: &str) -> Result<MshVersion, JobError> {
    match text {
        "4.1" => Ok(MshVersion::V41),
        "2.2" => Ok(MshVersion::V22),
        _ => Err(JobError::misuse(format!("msh version {text:?}; expected 4.1 or 2.2"))),
    }
}
