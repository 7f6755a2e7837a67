//! Triangles and tetrahedra.

use atomesh::image::Units;
use atomesh::mesh::{FacetGroup, Regions};
use atomesh_draw::Style;
use atomesh_io::image::AnyImage;
use atomesh_io::mesh::{LoadedMesh, OwnedField};
use atomesh_job::clusters::{ClustersRequest, clusters, clusters_of_facets, facets_of_outcome};
use atomesh_job::features::FeaturesRequest;
use atomesh_job::flow::{FlowMesh, FlowOptions};
use atomesh_job::measure::measure;
use atomesh_job::options::{OutputOptions, RunConfig};
use atomesh_job::sample::{Property, SampleRequest};
use atomesh_job::surfaces::{SurfacesRequest, surfaces};
use atomesh_job::{Dimension, JobError, Session, mesh_file};
use serde_json::Value;

use super::Made;
use super::body::{Body, Group};
use super::images::{self, in_dimension, of_file};
use super::meta::meta;
use super::written::written;
use crate::edit::EditorBody;
use crate::flow::{FlowBody, Flowing, solved};
use crate::surface::Surface;

/// Triangles or tetrahedra, read or made.
pub struct SimplexBody<const D: usize> {
    loaded: LoadedMesh<D>,
    groups: Vec<Group>,
    made: Option<Made<D>>,
    dimension: Dimension<D>,
}

impl<const D: usize> SimplexBody<D> {
    /// A mesh as read or made.
    pub fn new(loaded: LoadedMesh<D>, made: Option<Made<D>>, dimension: Dimension<D>) -> Self {
        let flat =
            |group: &FacetGroup<D>| (group.name.clone(), group.facets.as_flattened().to_vec());
        let groups = loaded.tags.facet_groups().iter().map(flat).collect();
        Self { loaded, groups, made, dimension }
    }
}

impl<const D: usize> Body for SimplexBody<D> {
    fn dimension(&self) -> usize {
        D
    }

    fn cells_name(&self) -> &'static str {
        self.dimension.cells
    }

    fn is_voronoi(&self) -> bool {
        false
    }

    fn cell_count(&self) -> usize {
        self.loaded.mesh.cell_count()
    }

    fn points(&self) -> &[f64] {
        self.loaded.mesh.points().as_flattened()
    }

    fn cells(&self) -> &[u32] {
        self.loaded.mesh.corners()
    }

    fn offsets(&self) -> Option<&[u32]> {
        None
    }

    fn sites(&self) -> Option<&[f64]> {
        None
    }

    fn point_fields(&self) -> &[OwnedField] {
        &self.loaded.point_fields
    }

    fn cell_fields(&self) -> &[OwnedField<f64>] {
        &self.loaded.cell_fields
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn point_groups(&self) -> Vec<Group> {
        let groups = self.loaded.tags.point_groups().iter();
        groups.map(|group| (group.name.clone(), group.points.clone())).collect()
    }

    fn regions(&self) -> Option<&Regions> {
        self.loaded.tags.regions()
    }

    fn meta(&self) -> Value {
        meta(self.loaded.frame.as_ref(), self.loaded.provenance.as_ref())
    }

    fn quality(&self, session: &mut Session<'_>) -> Result<Value, JobError> {
        let shape = self.dimension.tools.shape;
        let found = match &self.made {
            Some(Made { outcome, .. }) => {
                shape(outcome.mesh(), outcome.bounds().as_ref(), session)?
            }
            None => shape(&mesh_file::oriented(self.loaded.mesh.clone()), None, session)?,
        };
        serde_json::to_value(found).map_err(JobError::content)
    }

    fn report(
        &self,
        run: &RunConfig,
        image: Option<AnyImage>,
        session: &mut Session<'_>,
    ) -> Result<Value, JobError> {
        let Some(image) = image else {
            let made = self.made.as_ref().ok_or_else(|| of_file("report"))?;
            return made.as_job(&made.run, &[]).report(&self.dimension, session);
        };
        let (request, against) = images::against(run, image, &self.dimension, session)?;
        let report = measure(&request, &self.loaded, &against, &self.dimension, session)?;
        serde_json::to_value(report).map_err(JobError::content)
    }

    fn features(
        &self,
        request: &FeaturesRequest,
        image: Option<AnyImage>,
        session: &mut Session<'_>,
    ) -> Result<Vec<Surface>, JobError> {
        let image = images::placed(&request.frame, image, &self.dimension)?;
        let found = match (&self.made, request.below, &image) {
            // the run's own b, which is known between points too
            (Some(made), Some(_), None) => {
                let (outcome, tools) = (&made.outcome, self.dimension.tools);
                let field = (tools.field_along)(outcome.mesh(), outcome.potential(), session)?;
                (tools.find_features)(&self.loaded.mesh, &field, &request.facet_options())?
            }
            _ => {
                let dimension = &self.dimension;
                atomesh_job::features::features(request, &self.loaded, image, dimension, session)?
            }
        };
        let mesh = &self.loaded.mesh;
        let reports = found.report(mesh);
        let features = found.features.iter().zip(reports);
        let made = features.map(|(feature, report)| {
            let report = serde_json::to_value(&report).unwrap_or_default();
            let name = report["name"].as_str().unwrap_or_default().to_owned();
            Surface::new(name, mesh.points(), &feature.facets, report)
        });
        Ok(made.collect())
    }

    fn clusters(
        &self,
        request: &ClustersRequest,
        image: Option<AnyImage>,
        session: &mut Session<'_>,
    ) -> Result<Vec<i32>, JobError> {
        let Self { loaded, made, dimension, .. } = self;
        let image = images::placed(&request.frame, image, dimension)?;
        let (Some(made), None) = (made, &image) else {
            return Ok(clusters(request, loaded, image, dimension, session)?.parts);
        };
        let facets = facets_of_outcome(request, (&made.outcome, loaded), dimension, session)?;
        let cell_count = loaded.mesh.cell_count();
        Ok(clusters_of_facets(request, cell_count, &facets, true, session)?.parts)
    }

    fn surface(&self, name: &str) -> Result<Surface, JobError> {
        let is_group = self.groups.iter().any(|(group, _)| group == name);
        let (group, region) = match is_group || self.regions().is_none() {
            true => (vec![name.to_owned()], Vec::new()),
            false => (Vec::new(), vec![name.to_owned()]),
        };
        let request = SurfacesRequest { group, region, ..Default::default() };
        let names = || self.groups.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>();
        let mut found =
            surfaces(&request, &self.loaded).map_err(|e| match request.region.is_empty() {
                true => e,
                false => JobError::misuse(format!("{e}, and groups {}", names().join(", "))),
            })?;
        let FacetGroup { name, facets, .. } = found.swap_remove(0);
        Ok(Surface::new(name, self.loaded.mesh.points(), &facets, Value::Null))
    }

    fn sample(
        &self,
        request: &SampleRequest,
        name: &str,
        image: AnyImage,
        session: &mut Session<'_>,
    ) -> Result<Vec<f64>, JobError> {
        images::sampled(request, name, &self.loaded, image, &self.dimension, session)
    }

    fn flow(
        &self,
        options: &FlowOptions,
        fields: Vec<Property>,
        session: &mut Session<'_>,
    ) -> Result<Box<dyn FlowBody>, JobError> {
        let mesh = FlowMesh::of_mesh(self.loaded.clone(), self.dimension.tools)?;
        let flowing = Flowing { mesh, made: self.made.as_ref(), fields };
        solved(flowing, options, self.dimension.clone(), session)
    }

    fn write(
        &self,
        output: OutputOptions,
        properties: &[Property],
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let Self { made, loaded, dimension, .. } = self;
        written(made.as_ref(), loaded, output, properties, dimension, session)
    }

    fn picture(&self, image: Option<AnyImage>, max_side: f64) -> Result<Vec<u8>, JobError> {
        let given = image.map(|image| in_dimension(image, &self.dimension)).transpose()?;
        let image = images::backdrop(given.as_ref(), self.made.as_ref())?;
        let frame = self.loaded.frame.as_ref().unwrap_or(image.frame());
        let mesh = (self.dimension.tools.lattice_mesh)(&self.loaded.mesh, frame, Units::Samples);
        let style = Style { max_side, ..Style::default() };
        super::png((self.dimension.drawing.mesh)(image, &mesh, &style))
    }

    fn editor(
        &self,
        image: Option<AnyImage>,
        session: &mut Session<'_>,
    ) -> Result<Box<dyn EditorBody>, JobError> {
        let made = self.made.as_ref().ok_or_else(super::not_made)?;
        let image = images::over(image, &made.image, &self.dimension)?;
        crate::edit::editor(
            made,
            image,
            made.outcome.mesh().points(),
            self.dimension.clone(),
            session,
        )
    }
}
