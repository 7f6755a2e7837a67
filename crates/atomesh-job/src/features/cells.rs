//! Features among the faces of Voronoi cells.
//!
//! Those that the file names, unless a threshold is given: they were found when the cells were made. Else faces along which
//! |b| is large in the mean, since features repel the sites of cells as often as they attract them.

use std::path::Path;

use atomesh::features::{FacetTest, FeatureFaces, FeatureFacetOptions, Selection};
use atomesh::geometry::{Bounds, Point};
use atomesh::image::Image;
use atomesh::mesh::{PolyMesh, feature_name};
use atomesh_io::mesh::CellFields;
use atomesh_io::mesh::cells::{CellData, LoadedCells};
use atomesh_io::output_group::OutputGroup;
use atomesh_io::surface::SurfaceExtras;
use serde_json::{Value, json};

use super::write::FeatureFiles;
use super::{FeaturesRequest, FeaturesSummary, potential};
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::files::{self, check_voronoi, write_bytes};
use crate::images::{Beside, ImageRole};
use crate::session::{Note, NoteKind, Session};
use crate::surfaces::{feature_groups, points_of, world_axes};

/// Finds features of cells, and writes them.
///
/// # Errors
/// As [`super::features_file`], and if an option is of triangles and tetrahedra alone.
pub(super) fn run<const D: usize>(
    request: &FeaturesRequest,
    files: &FeatureFiles<'_>,
    loaded: &LoadedCells<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<FeaturesSummary, JobError> {
    files.check_dimension(D)?;
    check_options(request)?;
    let image = match (names_features(request, loaded), request.source()) {
        (false, Some(path)) => {
            let (frame, provenance) = (Some(&loaded.frame), Some(&loaded.provenance));
            let (options, role) = (&request.frame, ImageRole::Followed);
            let beside = Beside { frame, provenance, options, role };
            Some(beside.read(path, dimension, session)?)
        }
        (true, Some(path)) => {
            let text = "is not read: the cells name their features; --below B chooses faces anew";
            session.note(Note {
                kind: NoteKind::Change,
                file: Some(path.to_owned()),
                text: text.into(),
            });
            None
        }
        (_, None) => None,
    };
    let found = features_of_cells(request, loaded, image, dimension, session)?;
    let writing = Writing { files, loaded, found: &found, dimension };
    session.write_together(|group, session| writing.write(group, session))?;
    let FeaturesOfCells { faces, selection } = found;
    let facets = count(&faces);
    Ok(FeaturesSummary { features: faces.areas.len(), facets, selection, from_points: false })
}

/// Features among the faces of Voronoi cells.
#[derive(Clone, Debug, PartialEq)]
pub struct FeaturesOfCells {
    /// The faces of each.
    pub faces: FeatureFaces,
    /// How many were chosen and dropped.
    pub selection: Selection,
}

impl FeaturesOfCells {
    /// The faces of a feature.
    fn faces_of(&self, number: u32) -> impl Iterator<Item = usize> + '_ {
        let all = self.faces.of_faces.iter().enumerate();
        all.filter(move |(_, of)| **of == number).map(|(face, _)| face)
    }

    /// The mean of |b| over a feature, as −|b|; `None` where the file that names the feature does not say it.
    fn mean<const D: usize>(&self, number: u32, cells: &PolyMesh<D>) -> Option<f64> {
        let (mut sum, mut total) = (0.0, 0.0);
        for face in self.faces_of(number) {
            let area = length(&cells.area_vector(face));
            sum -= area * f64::from(*self.faces.strengths.get(face)?);
            total += area;
        }
        (total > 0.0).then(|| sum / total)
    }

    /// Each feature in numbers, in the coordinates of `cells`: "id", "name", "facets", "measure", "mean" of b, "min" and
    /// "max".
    pub fn report<const D: usize>(&self, cells: &PolyMesh<D>) -> Vec<Value> {
        let one = |number: u32| {
            let corners = self.faces_of(number).flat_map(|face| cells.face(face));
            let points: Vec<Point<D>> = corners.map(|&c| cells.points()[c as usize]).collect();
            let bounds = Bounds::of(&points);
            let areas = self.faces_of(number).map(|face| length(&cells.area_vector(face)));
            json!({
                "id": number,
                "name": feature_name(number),
                "facets": self.faces_of(number).count(),
                "measure": areas.sum::<f64>(),
                "mean": self.mean(number, cells),
                "min": bounds.map_or(vec![], |b| b.min.to_vec()),
                "max": bounds.map_or(vec![], |b| b.max.to_vec()),
            })
        };
        (1..=self.faces.areas.len() as u32).map(one).collect()
    }
}

/// Refuses what Voronoi cells do not have.
fn check_options(request: &FeaturesRequest) -> Result<(), JobError> {
    let refused = [
        (request.regions, "--regions"),
        (request.close_gaps, "--close-gaps"),
        (request.test != FacetTest::default(), "--test max"),
    ];
    if let Some((_, option)) = refused.iter().find(|(is_given, _)| *is_given) {
        let message = format!("{option} is for triangles and tetrahedra, not Voronoi cells");
        return Err(JobError::misuse(message).about(&request.mesh));
    }
    if let Some(below) = request.below.filter(|below| *below >= 0.0) {
        let message = format!("--below {below}; expected a number below 0 for Voronoi cells");
        return Err(JobError::misuse(message).about(&request.mesh));
    }
    request.mesh_output.as_deref().map_or(Ok(()), check_voronoi)
}

/// Whether the features that the cells name are taken.
fn names_features<const D: usize>(request: &FeaturesRequest, loaded: &LoadedCells<D>) -> bool {
    request.below.is_none() && !loaded.features.areas.is_empty()
}

/// How many faces are on features.
fn count(found: &FeatureFaces) -> usize {
    found.of_faces.iter().filter(|of| **of > 0).count()
}

/// Finds the faces of cells on features: those that the cells name, or by a threshold those along an image.
///
/// `image` is placed; it is b(x) itself if the request names a potential.
///
/// # Errors
/// [`JobError`] if an option is of triangles and tetrahedra alone, the image is of no use, or there is none and the cells
/// name no features.
pub fn features_of_cells<const D: usize>(
    request: &FeaturesRequest,
    loaded: &LoadedCells<D>,
    image: Option<Image<D>>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<FeaturesOfCells, JobError> {
    check_options(request)?;
    let (found, least) = if names_features(request, loaded) {
        (loaded.features.clone(), 1)
    } else {
        let Some(image) = image else {
            let message = "the cells name no features; expected IMAGE or --potential FILE";
            return Err(JobError::misuse(message).about(&request.mesh));
        };
        let made_by = Some(&loaded.provenance);
        let (frame, units, potential) = potential(request, made_by, image, dimension, session)?;
        let cells = (dimension.tools.lattice_cells)(&loaded.mesh, &frame, units);
        let FeatureFacetOptions { below, min_facets, .. } = request.facet_options();
        ((dimension.tools.feature_faces)(&cells, &potential, -below, 0.0), min_facets)
    };
    let chosen = count(&found);
    let faces = large_enough(request, least, &loaded.mesh, found);
    let selection = Selection { chosen, dropped: chosen - count(&faces), ..Selection::default() };
    Ok(FeaturesOfCells { faces, selection })
}

/// The features that have enough faces, and enough length or area in the world, the largest first.
fn large_enough<const D: usize>(
    request: &FeaturesRequest,
    usual: usize,
    world: &PolyMesh<D>,
    mut found: FeatureFaces,
) -> FeatureFaces {
    let mut all = vec![(0, 0.0, 0); found.areas.len()];
    for (face, &of) in found.of_faces.iter().enumerate().filter(|(_, of)| **of > 0) {
        let (count, area, number) = &mut all[of as usize - 1];
        *count += 1;
        *area += length(&world.area_vector(face));
        *number = of;
    }
    let least = request.min_facets.unwrap_or(usual);
    all.retain(|&(count, area, _)| count >= least && area >= request.min_measure);
    all.sort_by(|a, b| b.1.total_cmp(&a.1)); // stable
    let mut number = vec![0; found.areas.len() + 1];
    all.iter().zip(1..).for_each(|(&(_, _, old), new)| number[old as usize] = new);
    found.of_faces.iter_mut().for_each(|of| *of = number[*of as usize]);
    found.areas = all.into_iter().map(|(_, area, _)| area).collect();
    found
}

fn length<const D: usize>(vector: &Point<D>) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Features of cells, to be written.
struct Writing<'a, const D: usize> {
    files: &'a FeatureFiles<'a>,
    loaded: &'a LoadedCells<D>,
    found: &'a FeaturesOfCells,
    dimension: &'a Dimension<D>,
}

impl<const D: usize> Writing<'_, D> {
    fn write(&self, group: &mut OutputGroup, session: &mut Session<'_>) -> Result<(), JobError> {
        let (cells, request) = (&self.loaded.mesh, self.files.request);
        if let Some((path, _)) = self.files.surface {
            let path = &files::stage(path, group)?;
            let groups = feature_groups(cells, &self.found.faces);
            let means: Option<Vec<f32>> = (1..=groups.len() as u32)
                .map(|n| self.found.mean(n, cells).map(|mean| mean as f32))
                .collect();
            let points = points_of(cells)?;
            let axes = world_axes(request.z_positive, Some(&self.loaded.provenance));
            let extras = SurfaceExtras { values: means.as_deref(), axes: Some(&axes) };
            let write = self.dimension.files.surface;
            let written = write(path, &points, &groups, extras, session);
            written.map_err(|e| JobError::from(e).about(path))?;
        }
        if let Some(path) = &files::stage_any(&request.mesh_output, group)? {
            self.write_cells(path, session)?;
        }
        if let Some(path) = &files::stage_any(&request.json, group)? {
            let report = json!({
                "selection": self.found.selection,
                "features": self.found.report(cells),
                "notes": session.notes_json(),
            });
            write_bytes(path, format!("{report:#}\n").as_bytes())?;
        }
        Ok(())
    }

    fn write_cells(&self, path: &Path, session: &mut Session<'_>) -> Result<(), JobError> {
        let LoadedCells { mesh, fields, .. } = self.loaded;
        let data = CellData { features: &self.found.faces, ..self.loaded.data() };
        let mut all = CellFields::new(mesh.cell_count());
        for field in fields {
            all = all.with_numbers(&field.name, &field.values).map_err(JobError::content)?;
        }
        let written = (self.dimension.files.cells_with)(path, &data, &all, session);
        written.map_err(|e| JobError::from(e).about(path))
    }
}
