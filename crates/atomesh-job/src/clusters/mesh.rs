//! What can be clustered: triangles and tetrahedra, and Voronoi cells.

use std::path::Path;

use atomesh::cluster::SharedFacet;
use atomesh::features::{FacetField, FeatureFaces};
use atomesh::geometry::{Bounds, Point};
use atomesh::image::{Frame, Image};
use atomesh::mesh::{Regions, Tags, is_feature_name};
use atomesh::run::Outcome;
use atomesh_io::mesh::cells::LoadedCells;
use atomesh_io::mesh::{LoadedMesh, MeshFormat, Provenance};

use super::ClustersRequest;
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::features;
use crate::files::check_voronoi;
use crate::in_samples::InSamples;
use crate::sample::{Property, SampledMesh};
use crate::session::Session;

/// The values of cells that say which part they are of, where a file has no room for regions.
const PART: &str = "part";

/// A mesh as read, whose cells are parted and go into another file.
pub trait ClusteredMesh<const D: usize> {
    /// The number of cells.
    fn cell_count(&self) -> usize;

    /// The frame of the image that the mesh follows, if it is known.
    fn frame(&self) -> Option<&Frame<D>>;

    /// What the file says of its making, if it does.
    fn provenance(&self) -> Option<&Provenance>;

    /// The facets between cells, with b along them as far as it is known.
    ///
    /// # Errors
    /// [`JobError`] if the image is of no use, or the watch ends the work.
    fn facets(
        &self,
        request: &ClustersRequest,
        image: Option<Image<D>>,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<Vec<SharedFacet>, JobError>;

    /// The area or volume of each of `count` parts, and its box.
    fn extents(&self, parts: &[i32], count: usize) -> (Vec<f64>, Vec<Bounds<D>>);

    /// Refuses a file to write whose format does not hold such a mesh.
    ///
    /// # Errors
    /// [`JobError`] says which one does.
    fn check_output(&self, path: &Path) -> Result<(), JobError>;

    /// Writes the mesh with its parts to the first path; the second is how the file will be called.
    ///
    /// # Errors
    /// [`JobError`] if the file cannot be written.
    fn write(
        &self,
        paths: [&Path; 2],
        parts: &[i32],
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<(), JobError>;

    /// The cells among an image's samples, to be drawn.
    fn in_samples(&self, frame: Option<&Frame<D>>) -> InSamples<D>;
}

impl<const D: usize> ClusteredMesh<D> for LoadedMesh<D> {
    fn cell_count(&self) -> usize {
        self.mesh.cell_count()
    }

    fn frame(&self) -> Option<&Frame<D>> {
        self.frame.as_ref()
    }

    fn provenance(&self) -> Option<&Provenance> {
        self.provenance.as_ref()
    }

    fn facets(
        &self,
        request: &ClustersRequest,
        image: Option<Image<D>>,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<Vec<SharedFacet>, JobError> {
        let field = match (image, self.point_field("potential")) {
            (Some(image), _) => {
                Some(features::along(&request.reading(), self, image, dimension, session)?)
            }
            (None, Some(values)) => {
                let field = FacetField::from_points(&self.mesh, values);
                Some(field.map_err(|e| JobError::from(e).about(&request.mesh))?)
            }
            (None, None) => None,
        };
        Ok(facets_of_mesh(request, self, field.as_ref(), dimension))
    }

    fn extents(&self, parts: &[i32], count: usize) -> (Vec<f64>, Vec<Bounds<D>>) {
        let mut extents = Extents::new(count);
        for ((cell, simplex), &part) in self.mesh.cells().zip(self.mesh.simplices()).zip(parts) {
            let corners = cell.iter().map(|&corner| self.mesh.points()[corner as usize]);
            extents.add(part, simplex.measure().abs(), corners);
        }
        (extents.measures, extents.boxes)
    }

    fn check_output(&self, _: &Path) -> Result<(), JobError> {
        Ok(())
    }

    fn write(
        &self,
        [path, named]: [&Path; 2],
        parts: &[i32],
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let format = MeshFormat::of(path).map_err(JobError::misuse)?;
        let (groups, points) = (self.tags.facet_groups(), self.tags.point_groups());
        let regions = Regions { of_cells: parts.to_vec(), names: Vec::new() };
        let tags = Tags::new(&self.mesh, groups.to_vec(), Some(regions))
            .and_then(|tags| tags.with_point_groups(&self.mesh, points.to_vec()))
            .map_err(JobError::content)?;
        let as_values: Vec<f32> = parts.iter().map(|&part| part as f32).collect();
        let (mut data, lost) = features::tagged(self, &tags, |name| name == PART);
        if !format.holds_tags() {
            data = data.with_cell_field(PART, &as_values).map_err(JobError::content)?;
        }
        features::note_lost(self, lost, named, session);
        let written = (dimension.files.mesh)(path, format, &data, session);
        written.map_err(|e| JobError::from(e).about(path))
    }

    fn in_samples(&self, frame: Option<&Frame<D>>) -> InSamples<D> {
        InSamples::of_mesh(&self.mesh, frame)
    }
}

/// The facets between cells of triangles or tetrahedra, with b along them where it is known; those that the mesh names as
/// features have the request's multiplier.
fn facets_of_mesh<const D: usize>(
    request: &ClustersRequest,
    loaded: &LoadedMesh<D>,
    field: Option<&FacetField<D>>,
    dimension: &Dimension<D>,
) -> Vec<SharedFacet> {
    let groups = loaded.tags.facet_groups().iter();
    let groups: Vec<_> = groups
        .filter(|group| is_feature_name(&group.name))
        .map(|group| (group, request.multiplier))
        .collect();
    (dimension.tools.shared_facets)(&loaded.mesh, field, &groups)
}

/// The facets between the triangles or tetrahedra that a run has made, `loaded` as files have them, with the run's own b along
/// them, which is known between points too; those that it names as features have the request's multiplier.
///
/// # Errors
/// [`JobError`] if the watch ends the work.
pub fn facets_of_outcome<const D: usize>(
    request: &ClustersRequest,
    (outcome, loaded): (&Outcome<D>, &LoadedMesh<D>),
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Vec<SharedFacet>, JobError> {
    let field = (dimension.tools.field_along)(outcome.mesh(), outcome.potential(), session)?;
    Ok(facets_of_mesh(request, loaded, Some(&field), dimension))
}

impl<const D: usize> ClusteredMesh<D> for LoadedCells<D> {
    fn cell_count(&self) -> usize {
        self.mesh.cell_count()
    }

    fn frame(&self) -> Option<&Frame<D>> {
        Some(&self.frame)
    }

    fn provenance(&self) -> Option<&Provenance> {
        Some(&self.provenance)
    }

    fn facets(
        &self,
        request: &ClustersRequest,
        image: Option<Image<D>>,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<Vec<SharedFacet>, JobError> {
        let multiplier = request.multiplier;
        let shared_faces = dimension.tools.shared_faces;
        let Some(image) = image else {
            return Ok(shared_faces(&self.mesh, &self.features, multiplier));
        };
        let made_by = Some(&self.provenance);
        let reading = request.reading();
        let (frame, units, potential) =
            features::potential(&reading, made_by, image, dimension, session)?;
        let cells = (dimension.tools.lattice_cells)(&self.mesh, &frame, units);
        // for the strengths alone: what lies on features the file says
        let read = (dimension.tools.feature_faces)(&cells, &potential, 1.0, 0.0);
        let features = FeatureFaces { strengths: read.strengths, ..self.features.clone() };
        Ok(shared_faces(&self.mesh, &features, multiplier))
    }

    fn extents(&self, parts: &[i32], count: usize) -> (Vec<f64>, Vec<Bounds<D>>) {
        let mut extents = Extents::new(count);
        let points = self.mesh.points();
        for (cell, (&part, &measure)) in parts.iter().zip(self.mesh.measures()).enumerate() {
            let corners = self.mesh.faces_of(cell).flat_map(|(face, _)| self.mesh.face(face));
            extents.add(part, measure, corners.map(|&corner| points[corner as usize]));
        }
        (extents.measures, extents.boxes)
    }

    fn check_output(&self, path: &Path) -> Result<(), JobError> {
        check_voronoi(path)
    }

    fn write(
        &self,
        [path, _]: [&Path; 2],
        parts: &[i32],
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let old = self.fields.iter().filter(|field| field.name != PART);
        let old = old.map(|field| Property::new(field.name.clone(), field.values.clone()));
        let parts = parts.iter().map(|&part| f64::from(part)).collect();
        let all: Vec<Property> = old.chain([Property::new(PART.into(), parts)]).collect();
        SampledMesh::write(self, path, &all, dimension, session)
    }

    fn in_samples(&self, frame: Option<&Frame<D>>) -> InSamples<D> {
        InSamples::of_cells(&self.mesh, frame.or(Some(&self.frame)))
    }
}

/// Measures and boxes of parts.
struct Extents<const D: usize> {
    measures: Vec<f64>,
    boxes: Vec<Bounds<D>>,
}

impl<const D: usize> Extents<D> {
    fn new(count: usize) -> Self {
        let none = Bounds { min: [f64::INFINITY; D], max: [f64::NEG_INFINITY; D] };
        Self { measures: vec![0.0; count], boxes: vec![none; count] }
    }

    /// Adds a cell to a part.
    fn add(&mut self, part: i32, measure: f64, corners: impl Iterator<Item = Point<D>>) {
        let index = part as usize - 1;
        self.measures[index] += measure;
        let own = &mut self.boxes[index];
        for corner in corners {
            for k in 0..D {
                (own.min[k], own.max[k]) = (own.min[k].min(corner[k]), own.max[k].max(corner[k]));
            }
        }
    }
}
