//! Surface files, written and read: VTP, STL, OBJ, PLY, GOCAD TSurf (`.ts`) and PLine (`.pl`).
//!
//! What is written are groups of facets, such as the features of an image: polylines of a flat mesh, in the
//! plane z = 0 unless they stand elsewhere, or triangles of a volume. Only the points that facets name are written, in the mesh's order
//! and each once, so that groups that meet share them; GOCAD's objects have points of their own. VTP, OBJ and
//! PLY hold both lines and triangles, STL and TSurf triangles alone, PLine lines alone. Coordinates are the
//! mesh's, in double precision, but single in STL.

mod gocad;
mod loaded;
mod obj;
mod ply;
mod read;
mod read_vtp;
mod stl;
mod vtp;

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use atomesh::mesh::{FacetGroup, Mesh};
use atomesh::watch::{Cancelled, Phase, Watch, check};

pub use loaded::LoadedSurface;
pub use read::{SurfaceReadError, read_surface};

use crate::atomic_file::AtomicFile;
use crate::mesh::standing::placed;
use crate::mesh::{MeshWriteError, Standing};

/// The formats of surface files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SurfaceFormat {
    /// VTK's XML poly data: binary, compressed.
    Vtp,
    /// Triangles in single precision, binary.
    Stl,
    /// Wavefront's text.
    Obj,
    /// Stanford's polygons, binary.
    Ply,
    /// GOCAD's triangulated surfaces, text.
    TSurf,
    /// GOCAD's polylines, text.
    PLine,
}

impl SurfaceFormat {
    /// The extensions that [`of`](Self::of) knows, for messages.
    pub const EXTENSIONS: &'static str = ".vtp, .stl, .obj, .ply, .ts (GOCAD), .pl (GOCAD, 2-D)";

    /// The format that a file's name calls for by its extension, in any case.
    ///
    /// # Errors
    /// [`SurfaceWriteError::Format`] if the extension is missing or unknown.
    pub fn of(path: &Path) -> Result<Self, SurfaceWriteError> {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        match extension.to_str() {
            Some("vtp") => Ok(Self::Vtp),
            Some("stl") => Ok(Self::Stl),
            Some("obj") => Ok(Self::Obj),
            Some("ply") => Ok(Self::Ply),
            Some("ts") => Ok(Self::TSurf),
            Some("pl") => Ok(Self::PLine),
            _ => Err(SurfaceWriteError::Format { path: path.into() }),
        }
    }

    /// Checks that the format holds the facets of meshes of a dimension: lines (2) or triangles (3).
    ///
    /// # Errors
    /// [`SurfaceWriteError::Lines`] or [`SurfaceWriteError::Triangles`].
    pub fn check_dimension(self, dimension: usize) -> Result<(), SurfaceWriteError> {
        match (self, dimension) {
            (Self::Stl, 2) => Err(SurfaceWriteError::Lines { format: "STL" }),
            (Self::TSurf, 2) => Err(SurfaceWriteError::Lines { format: "GOCAD TSurf" }),
            (Self::PLine, 3) => Err(SurfaceWriteError::Triangles { format: "GOCAD PLine" }),
            _ => Ok(()),
        }
    }
}

/// Why a surface was not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceWriteError {
    /// The name calls for no known format.
    #[error(
        "{path:?} is not a surface file by its name; expected one of {}",
        SurfaceFormat::EXTENSIONS
    )]
    Format {
        /// The name.
        path: PathBuf,
    },
    /// The format has triangles alone.
    #[error("{format} cannot hold lines; expected .vtp, .obj, .ply or .pl for a flat mesh")]
    Lines {
        /// The format.
        format: &'static str,
    },
    /// The format has lines alone.
    #[error("{format} cannot hold triangles; expected .vtp, .stl, .obj, .ply or .ts for a volume")]
    Triangles {
        /// The format.
        format: &'static str,
    },
    /// There are more points or facets than 32-bit numbers count.
    #[error("{count} points or facets; a surface file holds {} at most", i32::MAX)]
    TooMany {
        /// How many there are.
        count: usize,
    },
    /// A facet names a point that the mesh has not.
    #[error("a facet of {group:?} names point {point}; the mesh has {count}")]
    Point {
        /// The group.
        group: String,
        /// The point.
        point: u32,
        /// How many there are.
        count: usize,
    },
    /// The system did not take the bytes.
    #[error("the surface could not be written: {0}")]
    Io(#[from] io::Error),
    /// The watch ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What is known of a surface beside its facets.
#[derive(Clone, Copy, Debug, Default)]
pub struct SurfaceExtras<'a> {
    /// One for each group, such as the mean of b; VTP alone holds them, as the cell array `potential`.
    pub values: Option<&'a [f32]>,
    /// The world's axes; GOCAD alone holds their units.
    pub axes: Option<&'a WorldAxes>,
}

/// What the world's axes are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WorldAxes {
    /// Their units, such as `m` or `ms`; those missing are not known.
    pub units: Vec<String>,
    /// Whether z grows downwards, as depth and time do.
    pub z_down: bool,
    /// Where a flat world stands in space, if it is known; in all formats points are there.
    pub standing: Option<Standing>,
}

/// Groups of facets with the points that they name.
struct Surface<'a, const D: usize> {
    /// The points in use, in the mesh's order; z is 0 in flat meshes that stand nowhere else.
    points: Vec<[f64; 3]>,
    groups: Vec<Group<'a, D>>,
    axes: Option<&'a WorldAxes>,
}

/// A group with its corners renumbered to the points in use.
struct Group<'a, const D: usize> {
    id: u32,
    name: &'a str,
    facets: Vec<[u32; D]>,
    /// The group's value, such as the mean of b, if values are known.
    value: Option<f32>,
}

impl<'a, const D: usize> Surface<'a, D> {
    fn new(
        mesh: &Mesh<D>,
        groups: &'a [FacetGroup<D>],
        SurfaceExtras { values, axes }: SurfaceExtras<'a>,
    ) -> Result<Self, SurfaceWriteError> {
        let count = mesh.points().len();
        let mut number = BTreeMap::new();
        for group in groups {
            for &point in group.facets.as_flattened() {
                if point as usize >= count {
                    return Err(SurfaceWriteError::Point {
                        group: group.name.clone(),
                        point,
                        count,
                    });
                }
                number.insert(point, 0);
            }
        }
        let facets: usize = groups.iter().map(|group| group.facets.len()).sum();
        let most = facets.saturating_mul(3).max(number.len());
        if i32::try_from(most).is_err() {
            return Err(SurfaceWriteError::TooMany { count: most });
        }
        let mut points = Vec::with_capacity(number.len());
        for (&point, number) in &mut number {
            *number = points.len() as u32;
            let p = &mesh.points()[point as usize];
            points.push(placed(p, axes.and_then(|axes| axes.standing.as_ref())));
        }
        let groups = groups.iter().enumerate().map(|(at, group)| Group {
            id: group.id,
            name: &group.name,
            facets: group.facets.iter().map(|facet| facet.map(|c| number[&c])).collect(),
            value: values.and_then(|values| values.get(at).copied()),
        });
        Ok(Self { groups: groups.collect(), points, axes })
    }

    fn facet_count(&self) -> usize {
        self.groups.iter().map(|group| group.facets.len()).sum()
    }

    /// Each facet with its group.
    fn facets(&self) -> impl Iterator<Item = (&[u32; D], &Group<'a, D>)> {
        self.groups.iter().flat_map(|group| group.facets.iter().map(move |facet| (facet, group)))
    }
}

/// Writes groups of facets of a mesh in the format that the name calls for; the file appears whole or not at
/// all.
///
/// # Errors
/// [`SurfaceWriteError`] if the format is unknown or cannot hold facets of this dimension, a facet names a
/// missing point, the file cannot be written, or the watch ends the work.
pub fn write_surface<const D: usize>(
    path: &Path,
    mesh: &Mesh<D>,
    groups: &[FacetGroup<D>],
    extras: SurfaceExtras<'_>,
    watch: &mut dyn Watch,
) -> Result<(), SurfaceWriteError> {
    let format = SurfaceFormat::of(path)?;
    format.check_dimension(D)?;
    let surface = Surface::new(mesh, groups, extras)?;
    check(watch, Phase::Write, 0.0, None)?;
    let mut file = AtomicFile::create(path)?;
    match format {
        SurfaceFormat::Vtp => vtp::write(&mut file, &surface, watch).map_err(|e| match e {
            MeshWriteError::Io(e) => SurfaceWriteError::Io(e),
            MeshWriteError::Cancelled(e) => SurfaceWriteError::Cancelled(e),
            other => SurfaceWriteError::Io(io::Error::other(other)),
        })?,
        SurfaceFormat::Stl => stl::write(&mut file, &surface)?,
        SurfaceFormat::Obj => obj::write(&mut file, &surface)?,
        SurfaceFormat::Ply => ply::write(&mut file, &surface)?,
        SurfaceFormat::TSurf | SurfaceFormat::PLine => gocad::write(&mut file, &surface)?,
    }
    check(watch, Phase::Write, 1.0, None)?;
    file.flush()?;
    Ok(file.commit()?)
}
