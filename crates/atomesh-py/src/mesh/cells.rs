//! Voronoi cells.

use atomesh::geometry::Bounds;
use atomesh::image::Units;
use atomesh::mesh::{FacetGroup, PolyMesh, Regions, well_name};
use atomesh_draw::Style;
use atomesh_io::image::AnyImage;
use atomesh_io::mesh::OwnedField;
use atomesh_io::mesh::cells::{LoadedCells, NO_CELL};
use atomesh_job::clusters::{ClustersRequest, clusters};
use atomesh_job::features::{FeaturesRequest, features_of_cells};
use atomesh_job::flow::{FlowMesh, FlowOptions};
use atomesh_job::measure::measure_cells;
use atomesh_job::options::{OutputOptions, RunConfig};
use atomesh_job::sample::{Property, SampleRequest};
use atomesh_job::surfaces::{feature_groups, groups_of_cells};
use atomesh_job::{Dimension, JobError, Session};
use serde_json::Value;

use super::Made;
use super::body::{Body, Group};
use super::images::{self, in_dimension, of_file};
use super::meta::meta;
use super::written::written;
use crate::edit::EditorBody;
use crate::flow::{FlowBody, Flowing, solved};
use crate::surface::Surface;

/// Polygons or polyhedra around atoms, read or made.
pub struct CellsBody<const D: usize> {
    loaded: LoadedCells<D>,
    /// VTK's list, and where each cell's entry begins.
    list: Vec<u32>,
    offsets: Vec<u32>,
    facets: Vec<FacetGroup<D>>,
    groups: Vec<Group>,
    made: Option<Made<D>>,
    dimension: Dimension<D>,
}

impl<const D: usize> CellsBody<D> {
    /// Cells as read or made.
    pub fn new(loaded: LoadedCells<D>, made: Option<Made<D>>, dimension: Dimension<D>) -> Self {
        let facets = groups_of_cells(&loaded);
        let flat =
            |group: &FacetGroup<D>| (group.name.clone(), group.facets.as_flattened().to_vec());
        let groups = facets.iter().map(flat).collect();
        let (list, offsets) = vtk_list(&loaded.mesh);
        Self { loaded, list, offsets, facets, groups, made, dimension }
    }
}

/// The cells as VTK lists them, and where each begins.
fn vtk_list<const D: usize>(mesh: &PolyMesh<D>) -> (Vec<u32>, Vec<u32>) {
    let (mut list, mut offsets) = (Vec::new(), vec![0]);
    for cell in 0..mesh.cell_count() {
        let start = list.len();
        list.push(0);
        if D == 2 {
            list.extend(mesh.polygon(cell));
        } else {
            list.push(0);
            let mut faces = 0;
            for (face, _) in mesh.faces_of(cell) {
                let corners = mesh.face(face);
                list.push(corners.len() as u32);
                list.extend(corners);
                faces += 1;
            }
            list[start + 1] = faces;
        }
        list[start] = (list.len() - start - 1) as u32;
        offsets.push(list.len() as u32);
    }
    (list, offsets)
}

impl<const D: usize> Body for CellsBody<D> {
    fn dimension(&self) -> usize {
        D
    }

    fn cells_name(&self) -> &'static str {
        self.dimension.voronoi_cells
    }

    fn is_voronoi(&self) -> bool {
        true
    }

    fn cell_count(&self) -> usize {
        self.loaded.mesh.cell_count()
    }

    fn points(&self) -> &[f64] {
        self.loaded.mesh.points().as_flattened()
    }

    fn cells(&self) -> &[u32] {
        &self.list
    }

    fn offsets(&self) -> Option<&[u32]> {
        Some(&self.offsets)
    }

    fn sites(&self) -> Option<&[f64]> {
        self.loaded.mesh.sites().map(<[_]>::as_flattened)
    }

    fn point_fields(&self) -> &[OwnedField] {
        &[]
    }

    fn cell_fields(&self) -> &[OwnedField<f64>] {
        &self.loaded.fields
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn point_groups(&self) -> Vec<Group> {
        let wells = self.loaded.wells.iter().zip(1..).filter(|(cell, _)| **cell != NO_CELL);
        wells.map(|(&cell, number)| (well_name(number), vec![cell])).collect()
    }

    fn regions(&self) -> Option<&Regions> {
        None
    }

    fn meta(&self) -> Value {
        meta(Some(&self.loaded.frame), Some(&self.loaded.provenance))
    }

    fn quality(&self, _: &mut Session<'_>) -> Result<Value, JobError> {
        let mesh = &self.loaded.mesh;
        let report = match &self.made {
            Some(Made { outcome, .. }) => {
                let bounds = outcome.run().bounds();
                outcome.cells().map(|cells| (self.dimension.tools.cells_shape)(cells, &bounds))
            }
            None => Bounds::of(mesh.points())
                .map(|bounds| (self.dimension.tools.cells_shape)(mesh, &bounds)),
        };
        serde_json::to_value(report).map_err(JobError::content)
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
        let (request, mut against) = images::against(run, image, &self.dimension, session)?;
        if against.image.take().is_some() {
            session.change("fidelity is of triangles and tetrahedra; the report leaves it out");
        }
        let report = measure_cells(&request, &self.loaded, &against, &self.dimension, session)?;
        serde_json::to_value(report).map_err(JobError::content)
    }

    fn features(
        &self,
        request: &FeaturesRequest,
        image: Option<AnyImage>,
        session: &mut Session<'_>,
    ) -> Result<Vec<Surface>, JobError> {
        let Self { loaded, dimension, .. } = self;
        if image.is_some() && request.below.is_none() && !loaded.features.areas.is_empty() {
            let message = "the cells name their features; expected no image, or --below B too";
            return Err(JobError::misuse(message));
        }
        let image = images::placed(&request.frame, image, dimension)?;
        let found = features_of_cells(request, loaded, image, dimension, session)?;
        let (cells, faces) = (&loaded.mesh, &found.faces);
        let groups = feature_groups(cells, faces).into_iter().zip(found.report(cells));
        let surface = |(FacetGroup { name, facets, .. }, info): (FacetGroup<D>, Value)| {
            Surface::new(name, cells.points(), &facets, info)
        };
        Ok(groups.map(surface).collect())
    }

    fn clusters(
        &self,
        request: &ClustersRequest,
        image: Option<AnyImage>,
        session: &mut Session<'_>,
    ) -> Result<Vec<i32>, JobError> {
        let Self { loaded, dimension, .. } = self;
        let image = images::placed(&request.frame, image, dimension)?;
        Ok(clusters(request, loaded, image, dimension, session)?.parts)
    }

    fn surface(&self, name: &str) -> Result<Surface, JobError> {
        let Some(group) = self.facets.iter().find(|group| group.name == name) else {
            let names: Vec<&str> = self.groups.iter().map(|(name, _)| name.as_str()).collect();
            let message =
                format!("no group of facets is named {name:?}; the mesh has {}", names.join(", "));
            return Err(JobError::misuse(message));
        };
        let points = self.loaded.mesh.points();
        Ok(Surface::new(group.name.clone(), points, &group.facets, Value::Null))
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
        let mesh = FlowMesh::of_cells(self.loaded.clone());
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
        let frame = &self.loaded.frame;
        let place = |p: &[f64; D]| frame.world_to_lattice(Units::Samples, p);
        let cells = self.loaded.mesh.moved(frame.is_mirrored(), place);
        let style = Style { max_side, ..Style::default() };
        super::png((self.dimension.drawing.cells)(image, &cells, &style))
    }

    fn editor(
        &self,
        image: Option<AnyImage>,
        session: &mut Session<'_>,
    ) -> Result<Box<dyn EditorBody>, JobError> {
        let made = self.made.as_ref().ok_or_else(super::not_made)?;
        let sites = made.outcome.cells().and_then(PolyMesh::sites).unwrap_or_default();
        let image = images::over(image, &made.image, &self.dimension)?;
        crate::edit::editor(made, image, sites, self.dimension.clone(), session)
    }
}
