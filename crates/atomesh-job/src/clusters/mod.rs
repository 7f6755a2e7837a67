//! The cells of a mesh in parts that end at features.

mod mesh;
mod picture;
mod write;

use std::path::{Path, PathBuf};

use atomesh::cluster::{
    CellGraph, ClusterError, ClusterOptions, ClusterTree, SharedFacet, WeightOptions,
};
use atomesh::image::{Image, Units};
use atomesh_io::mesh::MeshFormat;
use serde_json::{Value, json};

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::features::FeaturesRequest;
use crate::files::{self, PictureFile};
use crate::images::{Beside, ImageRole};
use crate::mesh_file::{self, MeshFile};
use crate::options::{FrameOptions, PotentialOptions, View};
use crate::session::Session;
#[cfg(feature = "clap")]
use crate::values::{count_in, named, number_in};
pub use mesh::{ClusteredMesh, facets_of_outcome};

/// A mesh, the image whose features part its cells, and where it goes.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct ClustersRequest {
    /// Mesh, in world coordinates: .vtu .vtk .msh .msh2 .npz .inp; or Voronoi cells that atomesh wrote: .vtu, or .json (a
    /// list of connections)
    #[cfg_attr(feature = "clap", arg(value_name = "MESH"))]
    pub mesh: PathBuf,
    /// Image whose features part the cells. Its frame is that of the options below, else of the mesh if atomesh wrote it,
    /// else of this file
    #[cfg_attr(feature = "clap", arg(value_name = "IMAGE", conflicts_with = "potential"))]
    pub image: Option<PathBuf>,
    /// Potential b(x), an image with values from -1 (features) to 1
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE"))]
    pub potential: Option<PathBuf>,
    /// Mesh to write, the parts its regions, in place of those that it has: .vtu .msh .msh2 .inp, or a folder named
    /// polyMesh; of other formats (.vtk .npz), and of Voronoi cells (.vtu), the parts are the cells' values `part`
    #[cfg_attr(feature = "clap", arg(short, long, value_name = "MESH"))]
    pub output: Option<PathBuf>,
    /// Parts, 1 or more; fewer if none is left that can be cut into two
    #[cfg_attr(feature = "clap", arg(long, value_name = "COUNT", default_value_t = Self::default().parts,
        value_parser = count_in(1, "a whole number of 1 or more")))]
    pub parts: usize,
    /// Least cells of a part, 1 or more
    #[cfg_attr(feature = "clap", arg(long, value_name = "COUNT", default_value_t = Self::default().least_cells,
        value_parser = count_in(1, "a whole number of 1 or more")))]
    pub least_cells: usize,
    /// Mean of |b| along a facet by which its weight falls to 1/e, above 0; less parts the cells at fainter features
    #[cfg_attr(feature = "clap", arg(long, value_name = "B", default_value_t = Self::default().contrast,
        value_parser = number_in(f64::MIN_POSITIVE, f64::MAX, "a number above 0")))]
    pub contrast: f64,
    /// Multiplier of the weights of facets that the mesh names as those of features, 0 (walls) to 1 (like others)
    #[cfg_attr(feature = "clap", arg(long, value_name = "M", default_value_t = Self::default().multiplier,
        value_parser = number_in(0.0, 1.0, "a number from 0 to 1")))]
    pub multiplier: f64,
    /// Picture of the parts, over the image if one is given: .png .svg
    #[cfg_attr(feature = "clap", arg(long, value_name = "PICTURE"))]
    pub picture: Option<PathBuf>,
    /// What the picture of a volume shows: three slices; 3d, in space, the borders of the parts; or cut-away, in space, the
    /// cells, an eighth of them cut away. Needs --picture. Default: slices
    #[cfg_attr(feature = "clap", arg(long, value_name = "VIEW", requires = "picture",
        value_parser = named::<View>(&["slices", "3d", "cut-away"])))]
    pub view: Option<View>,
    /// File for the parts in numbers (cells, area or volume, box, the cuts between them), as JSON
    #[cfg_attr(feature = "clap", arg(long, value_name = "JSON"))]
    pub json: Option<PathBuf>,
    /// Lattice units in which the potential is made. Default: those in which the mesh was made, else physical
    #[cfg_attr(feature = "clap", arg(long, value_name = "UNITS",
        value_parser = named::<Units>(&["physical", "samples"])))]
    pub units: Option<Units>,
    /// Features.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Features"))]
    pub features: PotentialOptions,
    /// Frame.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Frame"))]
    pub frame: FrameOptions,
}

impl Default for ClustersRequest {
    fn default() -> Self {
        let ClusterOptions { most_parts, least_cells } = ClusterOptions::default();
        let WeightOptions { contrast, multiplier } = WeightOptions::default();
        Self {
            mesh: PathBuf::new(),
            image: None,
            potential: None,
            output: None,
            parts: most_parts,
            least_cells,
            contrast,
            multiplier,
            picture: None,
            view: None,
            json: None,
            units: None,
            features: PotentialOptions::default(),
            frame: FrameOptions::default(),
        }
    }
}

impl ClustersRequest {
    /// The image or potential along which b is read.
    fn source(&self) -> Option<&Path> {
        self.image.as_deref().or(self.potential.as_deref())
    }

    /// How b is read along facets.
    fn reading(&self) -> FeaturesRequest {
        FeaturesRequest {
            mesh: self.mesh.clone(),
            image: self.image.clone(),
            potential: self.potential.clone(),
            units: self.units,
            features: self.features.clone(),
            frame: self.frame.clone(),
            ..FeaturesRequest::default()
        }
    }
}

/// The cells of a mesh in parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Clusters {
    /// The part of each cell, from 1 on.
    pub parts: Vec<i32>,
    /// How they were cut.
    pub tree: ClusterTree,
}

/// What became of [`clusters_file`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClustersSummary {
    /// How many parts.
    pub parts: usize,
    /// The cells of the smallest and of the largest part.
    pub cells: [usize; 2],
}

impl ClustersSummary {
    fn of(parts: &[i32]) -> Self {
        let counts = counts(parts);
        let least = counts.iter().min().copied().unwrap_or(0);
        Self { parts: counts.len(), cells: [least, counts.iter().max().copied().unwrap_or(0)] }
    }
}

/// The number of cells of each part; parts are numbered from 1 without a gap.
fn counts(parts: &[i32]) -> Vec<usize> {
    let count = parts.iter().max().map_or(0, |greatest| *greatest as usize);
    let mut counts = vec![0; count];
    parts.iter().for_each(|part| counts[*part as usize - 1] += 1);
    counts
}

/// Parts the cells of a mesh at features of an image; without one, of the mesh's own field `potential`, and always at the
/// features that the mesh names.
///
/// `image` is placed; it is b(x) itself if the request names a potential.
///
/// # Errors
/// [`JobError`] if options make no sense, the image is of no use, or the watch ends the work.
pub fn clusters<const D: usize>(
    request: &ClustersRequest,
    loaded: &impl ClusteredMesh<D>,
    image: Option<Image<D>>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Clusters, JobError> {
    let has_image = image.is_some();
    let facets = loaded.facets(request, image, dimension, session)?;
    clusters_of_facets(request, loaded.cell_count(), &facets, has_image, session)
}

/// The same of cells whose facets are known; `has_image`: b along them is.
///
/// # Errors
/// As [`clusters()`].
pub fn clusters_of_facets(
    request: &ClustersRequest,
    cell_count: usize,
    facets: &[SharedFacet],
    has_image: bool,
    session: &mut Session<'_>,
) -> Result<Clusters, JobError> {
    if !has_image && is_plain(facets) {
        let text =
            "the mesh has no potential and names no features; its shape alone parts the cells";
        session.warn(Some(&request.mesh), text);
    }
    let graph = CellGraph::of_facets(cell_count, facets, request.contrast)?;
    let options = ClusterOptions { most_parts: request.parts, least_cells: request.least_cells };
    let tree = ClusterTree::grow(&graph, &options, session)?;
    let found = tree.part_count();
    if found < request.parts.min(cell_count) {
        let least = request.least_cells;
        session.change(format_args!(
            "{found} parts in place of {}: none of them falls into two of {least} cells or more",
            request.parts
        ));
    }
    Ok(Clusters { parts: tree.parts(request.parts), tree })
}

/// Whether nothing but their size tells facets apart.
fn is_plain(facets: &[SharedFacet]) -> bool {
    facets.iter().all(|facet| facet.mean == 0.0 && facet.multiplier == 1.0)
}

impl Clusters {
    /// The parts in numbers, and the cuts in their order.
    pub fn report<const D: usize>(&self, loaded: &impl ClusteredMesh<D>) -> Value {
        let counts = counts(&self.parts);
        let (measures, boxes) = loaded.extents(&self.parts, counts.len());
        let part = |index: usize| {
            json!({
                "id": index + 1,
                "cells": counts[index],
                "measure": measures[index],
                "min": boxes[index].min.to_vec(),
                "max": boxes[index].max.to_vec(),
            })
        };
        let split = |(index, split)| json!({ "parts": index + 2, "split": split });
        json!({
            "parts": (0..counts.len()).map(part).collect::<Vec<_>>(),
            "splits": self.tree.splits().enumerate().map(split).collect::<Vec<_>>(),
        })
    }
}

/// Parts the cells of a mesh file, and writes what the request names.
///
/// # Errors
/// As [`clusters()`], and if a file cannot be read or written.
pub fn clusters_file(
    request: &ClustersRequest,
    session: &mut Session<'_>,
) -> Result<ClustersSummary, JobError> {
    let picture = check_files(request, session)?;
    let file = mesh_file::read(&request.mesh, session)?;
    if request.output.is_some() {
        file.note_skipped(&request.mesh, session);
    }
    match file {
        MeshFile::Flat(mesh) => run(request, picture, &mesh, &Dimension::plane(), session),
        MeshFile::Volume(mesh) => run(request, picture, &mesh, &Dimension::space(), session),
        MeshFile::Polygons(cells) => run(request, picture, &cells, &Dimension::plane(), session),
        MeshFile::Polyhedra(cells) => run(request, picture, &cells, &Dimension::space(), session),
    }
}

/// Refuses files that cannot be written; gives the picture's.
fn check_files(
    request: &ClustersRequest,
    session: &mut Session<'_>,
) -> Result<Option<PictureFile>, JobError> {
    let outputs = [&request.output, &request.picture, &request.json];
    if outputs.iter().all(|path| path.is_none()) {
        let message = "nothing to write; expected -o MESH, --picture PICTURE or --json JSON";
        return Err(JobError::misuse(message));
    }
    if let Some(path) = &request.output {
        let known = MeshFormat::of(path);
        known.map_err(|_| files::unknown_extension(path, &MeshFormat::endings()))?;
    }
    let picture = PictureFile::of(request.picture.as_ref())?;
    let inputs = [Some(request.mesh.as_path()), request.source()].into_iter().flatten();
    let outputs = outputs.into_iter().flatten().map(|path| path.as_path());
    files::check_apart(inputs, outputs, session)?;
    Ok(picture)
}

fn run<const D: usize>(
    request: &ClustersRequest,
    picture: Option<PictureFile>,
    loaded: &impl ClusteredMesh<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<ClustersSummary, JobError> {
    request.view.unwrap_or_default().check_dimension(D)?;
    if let Some(path) = &request.output {
        loaded.check_output(path)?;
    }
    let beside = Beside {
        frame: loaded.frame(),
        provenance: loaded.provenance(),
        options: &request.frame,
        role: ImageRole::Followed,
    };
    let image = match request.source() {
        Some(path) => Some(beside.read(path, dimension, session)?),
        None => None,
    };
    let shown = if picture.is_some() { image.clone() } else { None };
    let found = clusters(request, loaded, image, dimension, session)?;
    let writing = write::Writing { request, picture, loaded, image: shown, found: &found };
    session.write_together(|group, session| writing.write(group, dimension, session))?;
    Ok(ClustersSummary::of(&found.parts))
}

impl From<ClusterError> for JobError {
    fn from(error: ClusterError) -> Self {
        match error {
            ClusterError::Cancelled(_) => Self::cancelled(),
            ClusterError::Cell { .. } | ClusterError::Loop { .. } | ClusterError::Weight { .. } => {
                Self::content(error)
            }
            _ => Self::misuse(error),
        }
    }
}
