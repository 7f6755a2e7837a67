//! What every mesh can do, whichever its dimension and cells.

use atomesh::mesh::Regions;
use atomesh_io::image::AnyImage;
use atomesh_io::mesh::OwnedField;
use atomesh_job::clusters::ClustersRequest;
use atomesh_job::features::FeaturesRequest;
use atomesh_job::flow::FlowOptions;
use atomesh_job::options::{OutputOptions, RunConfig};
use atomesh_job::sample::{Property, SampleRequest};
use atomesh_job::{JobError, Session};
use serde_json::Value;

use crate::edit::EditorBody;
use crate::flow::FlowBody;
use crate::surface::Surface;

/// A name and the corners of facets, D a facet.
pub type Group = (String, Vec<u32>);

/// A mesh in world coordinates.
pub trait Body: Send + Sync {
    /// 2 or 3.
    fn dimension(&self) -> usize;

    /// What the cells are called, more than one of them.
    fn cells_name(&self) -> &'static str;

    /// Whether the cells are Voronoi's.
    fn is_voronoi(&self) -> bool;

    /// How many cells.
    fn cell_count(&self) -> usize;

    /// The points' coordinates, one point after another.
    fn points(&self) -> &[f64];

    /// The points of simplices, or VTK's list of polygons or polyhedra.
    fn cells(&self) -> &[u32];

    /// Where the entry of each Voronoi cell begins in that list.
    fn offsets(&self) -> Option<&[u32]>;

    /// The sites of Voronoi cells.
    fn sites(&self) -> Option<&[f64]>;

    /// Values at the points.
    fn point_fields(&self) -> &[OwnedField];

    /// Values in the cells.
    fn cell_fields(&self) -> &[OwnedField<f64>];

    /// Groups of facets.
    fn groups(&self) -> &[Group];

    /// Groups of points, or of Voronoi cells, by their numbers.
    fn point_groups(&self) -> Vec<Group>;

    /// Regions of cells.
    fn regions(&self) -> Option<&Regions>;

    /// Where the mesh comes from.
    fn meta(&self) -> Value;

    /// The shape of the cells.
    ///
    /// # Errors
    /// [`JobError`] if it cannot be measured, or the watch ends the work.
    fn quality(&self, session: &mut Session<'_>) -> Result<Value, JobError>;

    /// Shape, alignment and fidelity.
    ///
    /// # Errors
    /// As [`Body::quality`].
    fn report(
        &self,
        run: &RunConfig,
        image: Option<AnyImage>,
        session: &mut Session<'_>,
    ) -> Result<Value, JobError>;

    /// The facets that follow features.
    ///
    /// # Errors
    /// [`JobError`] if options make no sense or the image is of no use.
    fn features(
        &self,
        request: &FeaturesRequest,
        image: Option<AnyImage>,
        session: &mut Session<'_>,
    ) -> Result<Vec<Surface>, JobError>;

    /// The part of each cell.
    ///
    /// # Errors
    /// As [`Body::features`].
    fn clusters(
        &self,
        request: &ClustersRequest,
        image: Option<AnyImage>,
        session: &mut Session<'_>,
    ) -> Result<Vec<i32>, JobError>;

    /// A group of facets or the surface of a region.
    ///
    /// # Errors
    /// [`JobError`] if there is neither.
    fn surface(&self, name: &str) -> Result<Surface, JobError>;

    /// A value for each cell from an image.
    ///
    /// # Errors
    /// [`JobError`] if a sample is of no use.
    fn sample(
        &self,
        request: &SampleRequest,
        name: &str,
        image: AnyImage,
        session: &mut Session<'_>,
    ) -> Result<Vec<f64>, JobError>;

    /// What flows.
    ///
    /// # Errors
    /// [`JobError`] if the problem has no answer.
    fn flow(
        &self,
        options: &FlowOptions,
        fields: Vec<Property>,
        session: &mut Session<'_>,
    ) -> Result<Box<dyn FlowBody>, JobError>;

    /// Writes the mesh, and what the options name besides.
    ///
    /// # Errors
    /// [`JobError`] if a file cannot be written.
    fn write(
        &self,
        output: OutputOptions,
        properties: &[Property],
        session: &mut Session<'_>,
    ) -> Result<(), JobError>;

    /// A PNG of the mesh over an image.
    ///
    /// # Errors
    /// [`JobError`] if there is no image, or none of this dimension.
    fn picture(&self, image: Option<AnyImage>, max_side: f64) -> Result<Vec<u8>, JobError>;

    /// An editor of the atoms, over another image in the same place if one is given.
    ///
    /// # Errors
    /// [`JobError`] if the mesh was not made from an image in this process, or is part of one, or the image is elsewhere.
    fn editor(
        &self,
        image: Option<AnyImage>,
        session: &mut Session<'_>,
    ) -> Result<Box<dyn EditorBody>, JobError>;
}
