//! Writing a mesh and what is written with it.

use std::fmt::Display;
use std::path::Path;

use atomesh::features::FeatureFacetOptions;
use atomesh::image::{Image, Samples};
use atomesh::mesh::{Mesh, PolyMesh, Regions, Tags};
use atomesh::run::Outcome;
use atomesh::watch::Phase;
use atomesh_draw::{FlowCells, Picture, SpacePicture, Style};
use atomesh_io::mesh::cells::{CellData, NO_CELL};
use atomesh_io::mesh::{MeshData, MeshFormat, Provenance, Sections, World};

use super::format::OutputFormat;
use super::movie::Recording;
use super::outputs::Outputs;
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::files::write_bytes;
use crate::images::is_z_up;
use crate::in_space::{draw_in_space, sheets};
use crate::options::{Backdrop, RunConfig, View};
use crate::sample::{Property, cell_fields};
use crate::session::Session;
use crate::surfaces::feature_groups;

/// Facets that were tagged as features.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tagged {
    /// How many features.
    pub features: usize,
    /// How many facets they have together.
    pub facets: usize,
}

/// Triangles or tetrahedra of the world, their groups of facets and regions, and what of these was tagged.
struct TaggedMesh<const D: usize> {
    mesh: Mesh<D>,
    tags: Tags<D>,
    tagged: Option<Tagged>,
}

/// A mesh to be written.
pub(super) struct Writing<'a, const D: usize> {
    pub run: &'a RunConfig,
    pub outputs: &'a Outputs,
    pub outcome: &'a Outcome<D>,
    /// What is known of the world beside the frame.
    pub world: &'a World,
    /// Properties of the cells.
    pub properties: &'a [Property],
    /// The regions of the cells, in place of those that labels of the image give.
    pub regions: Option<&'a Regions>,
    /// The atoms of the run, for a movie.
    pub recording: Option<&'a Recording<D>>,
    pub dimension: &'a Dimension<D>,
}

impl<const D: usize> Writing<'_, D> {
    /// Writes picture, potential and mesh; says what was tagged.
    ///
    /// # Errors
    /// [`JobError`] if a file cannot be written, or the watch ends the work.
    pub fn write(
        &self,
        image: Option<&Image<D>>,
        session: &mut Session<'_>,
    ) -> Result<Option<Tagged>, JobError> {
        let mut mesh = None;
        if let (true, Some(image)) = (self.outputs.is_drawn(), image) {
            session.begin(Phase::Draw);
            if self.outputs.shows_tags() && self.outcome.cells().is_none() {
                mesh = Some(self.tagged_mesh(session)?);
            }
            let backdrop = self.backdrop()?;
            let tags = mesh.as_ref().map(|mesh| &mesh.tags);
            self.draw(backdrop.as_ref().unwrap_or(image), tags, session)?;
        }
        session.begin(Phase::Write);
        if let Some(path) = &self.outputs.potential {
            self.write_potential(path, session)?;
        }
        let provenance = self.run.provenance::<D>().in_world(self.world);
        match self.outputs.format {
            OutputFormat::Simplices(format) => {
                let mesh = mesh.map_or_else(|| self.tagged_mesh(session), Ok)?;
                self.write_simplices(format, mesh, &provenance, session)
            }
            _ => self.write_voronoi(&provenance, session).map(|()| None),
        }
    }

    /// Draws the picture and the movie over that image; `tags` are those of triangles or tetrahedra, if they are to be seen.
    fn draw(
        &self,
        image: &Image<D>,
        tags: Option<&Tags<D>>,
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let style = self.style();
        if let Some(file) = &self.outputs.picture {
            let picture = match (self.outputs.view, self.outcome.sample_cells()) {
                (View::Slices, Some(cells)) => {
                    (self.dimension.drawing.cells)(image, &cells, &style)
                        .map_err(JobError::content)?
                }
                (View::Slices, None) => {
                    (self.dimension.drawing.mesh)(image, &self.outcome.sample_mesh(), &style)
                        .map_err(JobError::content)?
                }
                (view, cells) => self.in_space(view, (cells.as_ref(), tags), image, session)?,
            };
            file.write(&picture)?;
        }
        if let (Some(path), Some(recording)) = (&self.outputs.movie, self.recording) {
            let movie = recording.encoded(self.outcome, image, &style, self.dimension, session)?;
            write_bytes(path, &movie)?;
        }
        Ok(())
    }

    /// The mesh in space: of Voronoi cells the features, of others all tagged facets but the box's sides.
    fn in_space(
        &self,
        view: View,
        (cells, tags): (Option<&PolyMesh<D>>, Option<&Tags<D>>),
        image: &Image<D>,
        session: &mut Session<'_>,
    ) -> Result<Picture, JobError> {
        let cells_cut_away = view == View::CutAway;
        let groups = match (cells, tags) {
            // surfaces would hide where cells are cut
            _ if cells_cut_away => Vec::new(),
            (Some(cells), _) => {
                feature_groups(cells, &self.outcome.cell_features().unwrap_or_default())
            }
            (None, tags) => tags.map_or_else(Vec::new, |tags| tags.facet_groups().to_vec()),
        };
        let sheets = sheets(groups);
        if sheets.is_empty() && !cells_cut_away {
            let text = "no facets are tagged: the picture shows slices alone";
            session.warn(self.run.input.shown(), text);
        }
        let regions = tags.and_then(Tags::regions);
        let mesh;
        let contents = SpacePicture {
            cells: match cells {
                Some(cells) => FlowCells::Polytopes(cells),
                None => {
                    mesh = self.outcome.sample_mesh();
                    FlowCells::Simplices(&mesh)
                }
            },
            image: Some(image),
            sheets: &sheets,
            parts: regions.map_or(&[], |regions| &regions.of_cells),
            cells_cut_away,
        };
        draw_in_space(&contents, &self.style(), self.dimension)
    }

    /// How the mesh is drawn.
    pub fn style(&self) -> Style {
        let z_up = is_z_up(self.run.input.shown(), self.outcome.frame());
        Style { units: self.outcome.units(), z_up, ..Style::default() }
    }

    /// What is drawn behind the mesh; `None`: the image.
    fn backdrop(&self) -> Result<Option<Image<D>>, JobError> {
        let values = match self.outputs.backdrop {
            Backdrop::Image => return Ok(None),
            Backdrop::Potential => self.outcome.potential().samples().to_vec(),
            Backdrop::Distance => self.outcome.distance_at_samples(),
            Backdrop::Density => self.outcome.feature_density(),
        };
        let image = Image::new(*self.outcome.frame(), Samples::F32(values.into()));
        image.map(Some).map_err(JobError::content)
    }

    fn write_potential(&self, path: &Path, session: &mut Session<'_>) -> Result<(), JobError> {
        let samples = Samples::F32(self.outcome.potential().samples().to_vec().into());
        let image = Image::new(*self.outcome.frame(), samples).map_err(JobError::content)?;
        Ok((self.dimension.files.image)(path, &image, session)?)
    }

    fn write_simplices(
        &self,
        format: MeshFormat,
        TaggedMesh { mesh, tags, tagged }: TaggedMesh<D>,
        provenance: &Provenance,
        session: &mut Session<'_>,
    ) -> Result<Option<Tagged>, JobError> {
        let outcome = self.outcome;
        let quadratic = self.outputs.is_quadratic.then(|| outcome.quadratic());
        let at_nodes = |values: &[f32]| match &quadratic {
            Some(quadratic) => quadratic.extend(values),
            None => values.to_vec(),
        };
        let distance = at_nodes(outcome.distance_at_points());
        let values = at_nodes(outcome.potential_at_points());
        // formats that hold tags have them as regions
        let labels = outcome.labels().filter(|_| !self.outputs.format.holds_tags());
        let as_values = |l: &[i32]| l.iter().map(|&l| l as f32).collect::<Vec<f32>>();
        let labels = labels.map(as_values);
        let regions = self.regions.filter(|_| !self.outputs.format.holds_tags());
        let regions = regions.map(|regions| as_values(&regions.of_cells));
        if let Some(sections) = &self.outputs.sections {
            check_sections::<D>(sections, tags.regions(), session)?;
        }
        let mut data = MeshData::new(&mesh)
            .with_frame(outcome.frame())
            .with_provenance(provenance)
            .with_tags(&tags);
        if let Some(quadratic) = &quadratic {
            data = data.with_quadratic(quadratic);
        }
        if let Some(sections) = &self.outputs.sections {
            data = data.with_sections(sections);
        }
        data = data.with_point_field("distance", &distance).map_err(JobError::content)?;
        data = data.with_point_field("potential", &values).map_err(JobError::content)?;
        if let Some(labels) = &labels {
            data = data.with_cell_field("label", labels).map_err(JobError::content)?;
        }
        if let Some(regions) = &regions {
            data = data.with_cell_field("region", regions).map_err(JobError::content)?;
        }
        for field in self.properties {
            data = data.with_cell_field(&field.name, field.values()).map_err(JobError::content)?;
        }
        let written = (self.dimension.files.mesh)(&self.outputs.mesh, format, &data, session);
        written.map_err(|e| JobError::from(e).about(&self.outputs.mesh))?;
        Ok(tagged)
    }

    fn not_valid(&self, fault: impl Display) -> JobError {
        JobError::content(format!("the mesh would not be valid: {fault}"))
            .advise("this is a fault of atomesh's own; another --size or --seed may avoid it")
            .about_any(self.run.input.shown())
    }

    /// The mesh with its tags.
    fn tagged_mesh(&self, session: &mut Session<'_>) -> Result<TaggedMesh<D>, JobError> {
        let mesh = self.outcome.world_mesh();
        // no mesh leaves that is none, whatever went wrong before
        mesh.validate().map_err(|fault| self.not_valid(fault))?;
        let (mut tags, tagged) = self.tags(&mesh, session)?;
        if let Some(regions) = self.regions {
            tags = replaced(&tags, &mesh, regions)?;
        }
        Ok(TaggedMesh { mesh, tags, tagged })
    }

    /// The sides of the box, outline and labels, and the features if they are asked for.
    fn tags(
        &self,
        world: &Mesh<D>,
        session: &mut Session<'_>,
    ) -> Result<(Tags<D>, Option<Tagged>), JobError> {
        let sides = self.outcome.tags().map_err(JobError::content)?;
        let Some(below) = self.outputs.tag_features else { return Ok((sides, None)) };
        let options = FeatureFacetOptions { below, ..FeatureFacetOptions::default() };
        let found = self.outcome.features(world, &options, session).map_err(|e| {
            if e.is_cancelled() { JobError::cancelled() } else { JobError::misuse(e) }
        })?;
        let mut features = found.tags(world).map_err(JobError::content)?;
        if let Some(least) = self.outputs.regions {
            features = with_regions(features, world, found.regions(world, least))?;
        }
        let facets = found.features.iter().map(|feature| feature.facets.len()).sum();
        let tagged = Tagged { features: found.features.len(), facets };
        let tags = sides.merge(features).map_err(JobError::content)?;
        Ok((tags, Some(tagged)))
    }

    /// Writes Voronoi cells and their connections.
    fn write_voronoi(
        &self,
        provenance: &Provenance,
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let (outputs, path) = (self.outputs, &self.outputs.mesh);
        let (Some(cells), Some(mesh)) = (self.outcome.cells(), self.outcome.world_cells()) else {
            return Err(JobError::content("the run made no Voronoi cells"));
        };
        let bounds = self.outcome.potential().grid().bounds();
        cells.validate(&bounds).map_err(|fault| self.not_valid(fault))?;
        let is_foam = outputs.format == OutputFormat::VoronoiFoam;
        let features = self.outcome.cell_features().unwrap_or_default();
        let frame = self.outcome.frame();
        let wells = cells_of_wells(self.outcome);
        let data = CellData { mesh: &mesh, features: &features, frame, provenance, wells: &wells };
        let files = &self.dimension.files;
        let written = match self.properties {
            [] if is_foam => (files.foam_cells)(path, &data, session),
            [] => (files.cells)(path, &data, session),
            _ if is_foam => {
                let message = "polyMesh holds no values of cells; expected .vtu";
                return Err(JobError::misuse(message).about(path));
            }
            fields => {
                let fields = cell_fields(cells.cell_count(), fields).map_err(JobError::content)?;
                (files.cells_with)(path, &data, &fields, session)
            }
        };
        written.map_err(|e| JobError::from(e).about(path))?;
        if let Some(tables) = &outputs.connections {
            let written = (files.connections)(tables, &data, session);
            written.map_err(|e| JobError::from(e).about(&tables.head))?;
        }
        Ok(())
    }
}

/// The Voronoi cell of each seed point.
pub(crate) fn cells_of_wells<const D: usize>(outcome: &Outcome<D>) -> Vec<u32> {
    outcome.wells().into_iter().map(|cell| cell.unwrap_or(NO_CELL)).collect()
}

/// Refuses sections of another dimension, and says which materials fill no region.
///
/// # Errors
/// [`JobError`] names the section.
fn check_sections<const D: usize>(
    sections: &Sections,
    regions: Option<&Regions>,
    session: &mut Session<'_>,
) -> Result<(), JobError> {
    if !sections.kind.is_of_dimension(D) {
        let message = match D {
            2 => {
                "--section solid of triangles; expected plane-stress, plane-strain or axisymmetric"
            }
            _ => "--section of triangles for tetrahedra; expected solid",
        };
        return Err(JobError::misuse(message));
    }
    let ids = regions.map(Regions::ids).unwrap_or_default();
    let unused =
        sections.materials.iter().filter(|of| regions.is_some() && !ids.contains(&of.region));
    for material in unused {
        session.change(format_args!("--material of region {}, which no cell has", material.region));
    }
    Ok(())
}

/// The tags with other regions.
///
/// # Errors
/// [`JobError`] if a region has the name of a group, or there is not one for each cell.
fn replaced<const D: usize>(
    tags: &Tags<D>,
    mesh: &Mesh<D>,
    regions: &Regions,
) -> Result<Tags<D>, JobError> {
    let (groups, points) = (tags.facet_groups().to_vec(), tags.point_groups().to_vec());
    Tags::new(mesh, groups, Some(regions.clone()))
        .and_then(|tags| tags.with_point_groups(mesh, points))
        .map_err(JobError::content)
}

/// The tags with regions beside them.
///
/// # Errors
/// [`JobError`] if they have regions.
fn with_regions<const D: usize>(
    tags: Tags<D>,
    mesh: &Mesh<D>,
    regions: Regions,
) -> Result<Tags<D>, JobError> {
    let regions = Tags::new(mesh, Vec::new(), Some(regions)).map_err(JobError::content)?;
    tags.merge(regions).map_err(JobError::content)
}
