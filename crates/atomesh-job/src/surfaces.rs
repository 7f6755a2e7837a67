//! Groups of facets of a mesh file, and the closed surfaces of its regions, as surface files.

use std::path::{Path, PathBuf};

use atomesh::features::FeatureFaces;
use atomesh::mesh::{FacetGroup, Mesh, PolyMesh, Regions, Tags, feature_name, side_name};
use atomesh::region::closed_surface;
use atomesh_io::mesh::cells::LoadedCells;
use atomesh_io::mesh::{LoadedMesh, Provenance};
use atomesh_io::surface::{SurfaceExtras, WorldAxes};
use serde::Deserialize;

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::files::{self, surface_format};
use crate::mesh_file::{self, MeshFile};
use crate::session::Session;
#[cfg(feature = "clap")]
use crate::values::named;

/// The most names that a refusal lists.
const MOST_NAMED: usize = 8;

/// A mesh file, which of its groups and regions are written, and where.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct SurfacesRequest {
    /// Mesh with tags: .vtu .msh .msh2 .inp; or Voronoi cells that atomesh wrote: .vtu, or .json (a list of
    /// connections)
    #[cfg_attr(feature = "clap", arg(value_name = "MESH"))]
    pub mesh: PathBuf,
    /// Surfaces to write: .vtp .obj .ply; in 3-D also .stl and .ts (GOCAD), in 2-D .pl (GOCAD)
    #[cfg_attr(feature = "clap", arg(short, long, value_name = "SURFACE"))]
    pub output: PathBuf,
    /// Group of facets to write: a side of the box (xmin ...), mask, interface-1-2, feature-1 ... May be given many
    /// times. Default: all groups, if no --region is given
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME"))]
    pub group: Vec<String>,
    /// Region of cells whose closed surface to write, by its number (label) or name; normals point out of it. May
    /// be given many times
    #[cfg_attr(feature = "clap", arg(long, value_name = "LABEL", allow_hyphen_values = true))]
    pub region: Vec<String>,
    /// Where z grows, for GOCAD: down (depth) or up (elevation). Default: down of seismic data whose third axis is time
    /// or depth, else up
    #[cfg_attr(feature = "clap", arg(long, value_name = "WHERE",
        value_parser = named::<ZPositive>(&["depth", "elevation"])))]
    pub z_positive: Option<ZPositive>,
}

/// Where z grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ZPositive {
    /// Downwards.
    Depth,
    /// Upwards.
    Elevation,
}

/// The axes of the world of a mesh, as far as they are known: z grows as is asked for, or else downwards where it is
/// time, or was read as that or depth.
pub(crate) fn world_axes(wish: Option<ZPositive>, made_by: Option<&Provenance>) -> WorldAxes {
    let units = made_by.map(|made| made.units.clone()).unwrap_or_default();
    let is_time = units.get(2).is_some_and(|unit| ["ms", "s"].contains(&unit.as_str()));
    let is_vertical = || {
        let options = &made_by?.options;
        options.get("frame")?.get("vertical")?.as_str().map(drop)
    };
    let z_down = match wish {
        Some(wish) => wish == ZPositive::Depth,
        None => is_time || is_vertical().is_some(),
    };
    let standing = made_by.and_then(|made| made.standing);
    WorldAxes { units, z_down, standing }
}

/// What became of [`surfaces_file`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfacesSummary {
    /// How many groups and regions.
    pub groups: usize,
    /// How many facets they have together.
    pub facets: usize,
}

/// The groups of facets that a request names, in its order: groups turned as the mesh has them, then the closed surfaces
/// of regions, normals outward, under the regions' names. Without names all groups that have facets.
///
/// # Errors
/// [`JobError`] if the mesh has no such group or region, or nothing to write.
pub fn surfaces<const D: usize>(
    request: &SurfacesRequest,
    loaded: &LoadedMesh<D>,
) -> Result<Vec<FacetGroup<D>>, JobError> {
    let tags = &loaded.tags;
    if request.group.is_empty() && request.region.is_empty() {
        let groups = tags.facet_groups().iter().filter(|group| !group.facets.is_empty());
        let groups: Vec<_> = groups.cloned().collect();
        return if groups.is_empty() { Err(nothing(tags)) } else { Ok(groups) };
    }
    let mut found = Vec::new();
    for name in without_repeats(&request.group) {
        found.push(group(tags.facet_groups(), name)?);
    }
    found.extend(region_surfaces(request, loaded)?);
    Ok(found)
}

/// The values in their order, each once.
fn without_repeats<T: PartialEq>(values: &[T]) -> impl Iterator<Item = &T> {
    let is_new = |at: &usize| !values[..*at].contains(&values[*at]);
    (0..values.len()).filter(is_new).map(|at| &values[at])
}

/// The refusal to write all groups where there are none.
fn nothing<const D: usize>(tags: &Tags<D>) -> JobError {
    let refusal = JobError::content("the mesh has no tagged facets");
    match tags.regions() {
        Some(_) => refusal.advise("--region writes the closed surface of one of its regions"),
        None => refusal.advise("`atomesh mesh` tags facets in .vtu, .msh, .msh2 and .inp files"),
    }
}

fn group<const D: usize>(groups: &[FacetGroup<D>], name: &str) -> Result<FacetGroup<D>, JobError> {
    let Some(group) = groups.iter().find(|group| group.name == name) else {
        let known = groups.iter().map(|group| group.name.clone());
        let message = format!("no group of facets is named {name:?}; {}", known_names(known));
        return Err(JobError::misuse(message));
    };
    if group.facets.is_empty() {
        return Err(JobError::content(format!("the group {name:?} has no facets")));
    }
    Ok(group.clone())
}

/// The closed surfaces of the regions that a request names, numbered on from the mesh's groups.
fn region_surfaces<const D: usize>(
    request: &SurfacesRequest,
    loaded: &LoadedMesh<D>,
) -> Result<Vec<FacetGroup<D>>, JobError> {
    if request.region.is_empty() {
        return Ok(Vec::new());
    }
    let Some(regions) = loaded.tags.regions() else {
        let message = "the mesh has no regions of cells";
        let advice = "`atomesh mesh --labels` and `--regions` make them";
        return Err(JobError::misuse(message).advise(advice));
    };
    let ids = request.region.iter().map(|text| region_id(regions, text));
    let ids: Vec<i32> = ids.collect::<Result<_, _>>()?;
    let mesh = mesh_file::oriented(loaded.mesh.clone());
    let greatest = loaded.tags.facet_groups().iter().map(|group| group.id).max().unwrap_or(0);
    let surface = |(region, number): (&i32, u32)| FacetGroup {
        id: greatest.saturating_add(number),
        name: regions.name(*region),
        facets: closed_surface(&mesh, &regions.of_cells, *region),
    };
    Ok(without_repeats(&ids).zip(1..).map(surface).collect())
}

/// The number of a region that is given by its number or name.
fn region_id(regions: &Regions, text: &str) -> Result<i32, JobError> {
    let ids = regions.ids();
    let found = ids.iter().find(|id| id.to_string() == text || regions.name(**id) == text);
    found.copied().ok_or_else(|| {
        let known = ids.iter().map(i32::to_string);
        JobError::misuse(format!("no cell is of region {text:?}; {}", known_names(known)))
    })
}

/// What there is instead: the first names, and how many more.
fn known_names(names: impl ExactSizeIterator<Item = String>) -> String {
    let more = names.len().saturating_sub(MOST_NAMED);
    let first = names.take(MOST_NAMED).collect::<Vec<_>>().join(", ");
    match (first.is_empty(), more) {
        (true, _) => "the mesh has none".into(),
        (_, 0) => format!("the mesh has {first}"),
        _ => format!("the mesh has {first} and {more} more"),
    }
}

/// Reads a mesh and writes groups of its facets.
///
/// # Errors
/// As [`surfaces()`], and if a file cannot be read or written.
pub fn surfaces_file(
    request: &SurfacesRequest,
    session: &mut Session<'_>,
) -> Result<SurfacesSummary, JobError> {
    surface_format(&request.output)?;
    files::check_apart([request.mesh.as_path()], [request.output.as_path()], session)?;
    let about = |e: JobError| e.about(&request.mesh);
    match mesh_file::read(&request.mesh, session)? {
        MeshFile::Flat(loaded) => {
            let groups = surfaces(request, &loaded).map_err(about)?;
            let axes = world_axes(request.z_positive, loaded.provenance.as_ref());
            write(request, (&loaded.mesh, &groups, &axes), &Dimension::plane(), session)
        }
        MeshFile::Volume(loaded) => {
            let groups = surfaces(request, &loaded).map_err(about)?;
            let axes = world_axes(request.z_positive, loaded.provenance.as_ref());
            write(request, (&loaded.mesh, &groups, &axes), &Dimension::space(), session)
        }
        MeshFile::Polygons(loaded) => {
            let groups = surfaces_of_cells(request, &loaded).map_err(about)?;
            let points = points_of(&loaded.mesh).map_err(about)?;
            let axes = world_axes(request.z_positive, Some(&loaded.provenance));
            write(request, (&points, &groups, &axes), &Dimension::plane(), session)
        }
        MeshFile::Polyhedra(loaded) => {
            let groups = surfaces_of_cells(request, &loaded).map_err(about)?;
            let points = points_of(&loaded.mesh).map_err(about)?;
            let axes = world_axes(request.z_positive, Some(&loaded.provenance));
            write(request, (&points, &groups, &axes), &Dimension::space(), session)
        }
    }
}

/// The sides and features of Voronoi cells that a request names, or all that have faces; polygons are cut into
/// triangles from their first points.
///
/// # Errors
/// [`JobError`] if there is no such group, or the request names regions.
pub fn surfaces_of_cells<const D: usize>(
    request: &SurfacesRequest,
    loaded: &LoadedCells<D>,
) -> Result<Vec<FacetGroup<D>>, JobError> {
    if !request.region.is_empty() {
        return Err(JobError::misuse(
            "Voronoi cells have no regions; expected --group, or neither",
        ));
    }
    let all = groups_of_cells(loaded);
    if request.group.is_empty() {
        return Ok(all);
    }
    without_repeats(&request.group).map(|name| group(&all, name)).collect()
}

/// The sides of Voronoi cells, numbered from 1, and after them the features; those that have faces.
pub fn groups_of_cells<const D: usize>(loaded: &LoadedCells<D>) -> Vec<FacetGroup<D>> {
    let LoadedCells { mesh, features, .. } = loaded;
    let side = |side: usize| FacetGroup {
        id: side as u32 + 1,
        name: side_name(side).to_owned(),
        facets: mesh.side(side).flat_map(|face| mesh.face_parts(face)).collect(),
    };
    let mut groups: Vec<FacetGroup<D>> = (0..2 * D).map(side).collect();
    let after_sides = |group: FacetGroup<D>| FacetGroup { id: 2 * D as u32 + group.id, ..group };
    groups.extend(feature_groups(mesh, features).into_iter().map(after_sides));
    groups.retain(|group| !group.facets.is_empty());
    groups
}

/// The features of Voronoi cells, numbered from 1; polygons are cut into triangles from their first points.
pub fn feature_groups<const D: usize>(
    cells: &PolyMesh<D>,
    features: &FeatureFaces,
) -> Vec<FacetGroup<D>> {
    let mut groups: Vec<FacetGroup<D>> = (1..=features.areas.len() as u32)
        .map(|id| FacetGroup { id, name: feature_name(id), facets: Vec::new() })
        .collect();
    for (face, &number) in features.of_faces.iter().enumerate().filter(|(_, of)| **of > 0) {
        groups[number as usize - 1].facets.extend(cells.face_parts(face));
    }
    groups
}

/// The points of cells, as surface files take them.
pub(crate) fn points_of<const D: usize>(cells: &PolyMesh<D>) -> Result<Mesh<D>, JobError> {
    Mesh::new(cells.points().to_vec(), Vec::new()).map_err(JobError::content)
}

fn write<const D: usize>(
    request: &SurfacesRequest,
    (mesh, groups, axes): (&Mesh<D>, &[FacetGroup<D>], &WorldAxes),
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<SurfacesSummary, JobError> {
    write_groups(&request.output, (mesh, groups, Some(axes)), dimension, session)?;
    let facets = groups.iter().map(|group| group.facets.len()).sum();
    Ok(SurfacesSummary { groups: groups.len(), facets })
}

/// Writes groups of facets of a mesh as a file of surfaces, in a world of these axes.
///
/// # Errors
/// [`JobError`] if the file's format is unknown or for another dimension, or it cannot be written.
pub fn write_groups<const D: usize>(
    output: &Path,
    (mesh, groups, axes): (&Mesh<D>, &[FacetGroup<D>], Option<&WorldAxes>),
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<(), JobError> {
    let format = surface_format(output)?;
    format.check_dimension(D).map_err(|e| JobError::misuse(e).about(output))?;
    let write = dimension.files.surface;
    session.write_together(|group, session| {
        let path = files::stage(output, group)?;
        let extras = SurfaceExtras { values: None, axes };
        let written = write(&path, mesh, groups, extras, session);
        written.map_err(|e| JobError::from(e).about(output))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use atomesh::mesh::Mesh;

    /// A square of two triangles, its left side and its diagonal tagged, its cells of regions −1 and 3.
    fn square(with_regions: bool) -> LoadedMesh<2> {
        let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        // the second cell is turned the other way, as a foreign file may have it
        let mesh = Mesh::new(points, vec![0, 1, 2, 0, 3, 2]).unwrap();
        let group = |id, name: &str, facets| FacetGroup { id, name: name.into(), facets };
        let groups = vec![
            group(3, "xmin", vec![[3, 0]]),
            group(5, "interface-1-3", vec![[2, 0]]),
            group(9, "mask", vec![]),
        ];
        let names = vec![(3, "salt".into())];
        let regions = with_regions.then_some(Regions { of_cells: vec![-1, 3], names });
        let tags = Tags::new(&mesh, groups, regions).unwrap();
        LoadedMesh {
            mesh,
            point_fields: Vec::new(),
            cell_fields: Vec::new(),
            frame: None,
            provenance: None,
            tags,
            skipped_cells: 0,
            skipped_fields: Vec::new(),
        }
    }

    fn request(groups: &[&str], regions: &[&str]) -> SurfacesRequest {
        let owned = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        SurfacesRequest { group: owned(groups), region: owned(regions), ..Default::default() }
    }

    fn names(groups: &[&str], regions: &[&str]) -> Result<Vec<(u32, String)>, String> {
        let found = surfaces(&request(groups, regions), &square(true));
        let named = |groups: Vec<FacetGroup<2>>| groups.into_iter().map(|g| (g.id, g.name));
        found.map(|groups| named(groups).collect()).map_err(|e| e.to_string())
    }

    fn named(pairs: &[(u32, &str)]) -> Result<Vec<(u32, String)>, String> {
        Ok(pairs.iter().map(|(id, name)| (*id, (*name).to_owned())).collect())
    }

    #[test]
    fn groups_and_regions_come_as_they_are_asked_for_each_once() {
        assert_eq!(names(&[], &[]), named(&[(3, "xmin"), (5, "interface-1-3")]));
        assert_eq!(names(&["xmin", "xmin"], &[]), named(&[(3, "xmin")]));
        let both = names(&["interface-1-3"], &["salt", "-1", "3"]);
        assert_eq!(both, named(&[(5, "interface-1-3"), (10, "salt"), (11, "region--1")]));
    }

    #[test]
    fn facets_keep_the_files_turn_and_surfaces_of_regions_look_outward() {
        let found = surfaces(&request(&["interface-1-3"], &["-1", "salt"]), &square(true)).unwrap();
        let facets: Vec<_> = found.into_iter().map(|group| group.facets).collect();
        assert_eq!(facets[0], [[2, 0]]);
        assert_eq!(facets[1], [[0, 1], [2, 0], [1, 2]]);
        // counter-clockwise around the other cell, although the file has it clockwise
        assert_eq!(facets[2], [[0, 2], [3, 0], [2, 3]]);
    }

    #[test]
    fn what_is_not_there_is_refused_with_what_is() {
        let message = names(&["ymax"], &[]).unwrap_err();
        let expected =
            "no group of facets is named \"ymax\"; the mesh has xmin, interface-1-3, mask";
        assert_eq!(message, expected);
        assert_eq!(names(&["mask"], &[]).unwrap_err(), "the group \"mask\" has no facets");
        let message = names(&[], &["7"]).unwrap_err();
        assert_eq!(message, "no cell is of region \"7\"; the mesh has -1, 3");
        let bare = surfaces(&request(&[], &["7"]), &square(false)).unwrap_err();
        assert_eq!(bare.to_string(), "the mesh has no regions of cells");
        let many = known_names((0..20).map(|i| i.to_string()).collect::<Vec<_>>().into_iter());
        assert_eq!(many, "the mesh has 0, 1, 2, 3, 4, 5, 6, 7 and 12 more");
    }
}
