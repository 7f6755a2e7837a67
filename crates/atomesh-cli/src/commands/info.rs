//! `atomesh info`: what an image or mesh file holds.

use std::fmt::{Display, Write};
use std::path::PathBuf;

use atomesh::geometry::Bounds;
use atomesh::image::{Frame, Units};
use atomesh::measure::{ShapeReport, shape};
use atomesh::mesh::{PointGroup, PolyReport, feature_name, side_name, well_name};
use atomesh::watch::Watch;
use atomesh_io::image::{AnyImage, LoadedImage};
use atomesh_io::mesh::cells::{LoadedCells, NO_CELL};
use atomesh_io::mesh::{LoadedMesh, MeshFormat, OwnedField, Provenance};
use atomesh_job::mesh_file::{self, MeshFile};
use atomesh_job::options::FrameOptions;
use atomesh_job::{Dimension, JobError, images};

/// Show what an image or mesh file holds
///
/// Images: shape, sample type, frame, range, NaN count; of seismic data also units, and what was taken
/// for granted about traces. Meshes: counts, box, quality, fields, tagged facets, and the options that made them.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  atomesh info brain.nii.gz
  atomesh info folder-of-dicom-slices
  atomesh info line.segy --vertical depth
  atomesh info mesh.vtu
  atomesh info cube.raw --shape 300,200,100 --dtype float32")]
pub struct InfoArgs {
    /// Image or mesh
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten, next_help_heading = "Frame")]
    frame: FrameOptions,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if the file cannot be read.
pub fn run(args: &InfoArgs, watch: &mut dyn Watch) -> Result<String, JobError> {
    let options = args.frame.read_options()?;
    let is_mesh = MeshFormat::is_mesh(&args.file) || mesh_file::is_list(&args.file);
    if options.raw.is_none() && is_mesh {
        return match &mesh_file::read(&args.file, watch)? {
            MeshFile::Flat(loaded) => mesh_text(loaded, &Dimension::plane(), watch),
            MeshFile::Volume(loaded) => mesh_text(loaded, &Dimension::space(), watch),
            MeshFile::Polygons(cells) => Ok(cells_text(cells, &Dimension::plane())),
            MeshFile::Polyhedra(cells) => Ok(cells_text(cells, &Dimension::space())),
        }
        .map_err(|f| f.about(&args.file));
    }
    let LoadedImage { image, units, notes, .. } = images::load(&args.file, &options, watch)?;
    let mut text = String::new();
    let range = image.range();
    line(&mut text, "type", image.type_name());
    line(&mut text, "range", format_args!("{} to {}", range.min, range.max));
    line(&mut text, "NaN", range.nan_count);
    if range.infinite_count > 0 {
        line(&mut text, "infinite", range.infinite_count);
    }
    let frame = match &image {
        AnyImage::Flat(image) => frame_text(&args.frame.apply(*image.frame())?),
        AnyImage::Volume(image) => frame_text(&args.frame.apply(*image.frame())?),
    };
    let named = units.iter().map(|unit| if unit.is_empty() { "unknown" } else { unit });
    if !units.is_empty() {
        line(&mut text, "units", named.collect::<Vec<_>>().join(","));
    }
    for note in &notes {
        line(&mut text, if note.is_warning() { "warning" } else { "note" }, images::words(note));
    }
    Ok(frame + &text)
}

/// A line of a name and a value.
fn line(text: &mut String, name: &str, value: impl Display) {
    // writing to a string cannot fail
    let _ = writeln!(text, "{name:<10} {value}");
}

/// The first of some names, and how many more there are.
fn listed(names: impl Iterator<Item = String>, count: usize) -> String {
    const MOST: usize = 12;
    let mut text = names.take(MOST).collect::<Vec<_>>().join(", ");
    if count > MOST {
        let _ = write!(text, " and {} more", count - MOST);
    }
    text
}

/// Numbers as options take them.
fn list<T: Display>(numbers: &[T]) -> String {
    numbers.iter().map(T::to_string).collect::<Vec<_>>().join(",")
}

fn box_text<const D: usize>(min: [f64; D], max: [f64; D]) -> String {
    let range = |k: usize| format!("{}..{}", min[k], max[k]);
    (0..D).map(range).collect::<Vec<_>>().join(",")
}

fn frame_text<const D: usize>(frame: &Frame<D>) -> String {
    let mut text = String::new();
    line(&mut text, "shape", list(&frame.shape()));
    line(&mut text, "spacing", list(&frame.spacing()));
    line(&mut text, "origin", list(&frame.origin()));
    line(&mut text, "direction", list(&frame.direction().concat()));
    let last = frame.shape().map(|n| (n - 1) as f64);
    let corners = (0..1 << D).map(|corner| -> [f64; D] {
        let at = |k: usize| if corner >> k & 1 == 0 { 0.0 } else { last[k] };
        frame.lattice_to_world(Units::Samples, &std::array::from_fn(at))
    });
    let (mut min, mut max) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for p in corners {
        for k in 0..D {
            (min[k], max[k]) = (min[k].min(p[k]), max[k].max(p[k]));
        }
    }
    line(&mut text, "box", box_text(min, max));
    text
}

fn left_out_text(text: &mut String, fields: &[String]) {
    if !fields.is_empty() {
        line(text, "left out", format_args!("fields {}", fields.join(", ")));
    }
}

fn mesh_text<const D: usize>(
    loaded: &LoadedMesh<D>,
    dimension: &Dimension<D>,
    watch: &mut dyn Watch,
) -> Result<String, JobError> {
    let mesh = &loaded.mesh;
    let mut text = String::new();
    line(&mut text, "points", mesh.points().len());
    line(&mut text, dimension.cells, mesh.cell_count());
    if loaded.skipped_cells > 0 {
        line(&mut text, "left out", format_args!("{} other cells", loaded.skipped_cells));
    }
    left_out_text(&mut text, &loaded.skipped_fields);
    if let Some(Bounds { min, max }) = Bounds::of(mesh.points()) {
        line(&mut text, "box", box_text(min, max));
    }
    quality_text(&mut text, &shape(mesh, None, watch)?);
    loaded.point_fields.iter().for_each(|field| field_text(&mut text, "field", field));
    loaded.cell_fields.iter().for_each(|field| field_text(&mut text, "cell field", field));
    let groups = loaded.tags.facet_groups();
    if !groups.is_empty() {
        let named = groups.iter().map(|group| format!("{} {}", group.name, group.facets.len()));
        line(&mut text, "facets", listed(named, groups.len()));
    }
    let groups = loaded.tags.point_groups();
    if !groups.is_empty() {
        let place = |group: &PointGroup| match group.points[..] {
            [point] => format!("{} at {}", group.name, list(&mesh.points()[point as usize])),
            _ => format!("{} {}", group.name, group.points.len()),
        };
        line(&mut text, "points of", listed(groups.iter().map(place), groups.len()));
    }
    if let Some(regions) = loaded.tags.regions() {
        let ids = regions.ids();
        line(&mut text, "regions", listed(ids.iter().map(|&id| regions.name(id)), ids.len()));
    }
    origin_text(&mut text, loaded.frame.as_ref(), loaded.provenance.as_ref());
    Ok(text)
}

fn cells_text<const D: usize>(cells: &LoadedCells<D>, dimension: &Dimension<D>) -> String {
    let LoadedCells { mesh, features, fields, skipped_fields, frame, provenance, wells } = cells;
    let mut text = String::new();
    line(&mut text, "points", mesh.points().len());
    line(&mut text, dimension.voronoi_cells, mesh.cell_count());
    left_out_text(&mut text, skipped_fields);
    if let Some(bounds) = Bounds::of(mesh.points()) {
        line(&mut text, "box", box_text(bounds.min, bounds.max));
        cells_quality_text(&mut text, &(dimension.tools.cells_shape)(mesh, &bounds));
    }
    fields.iter().for_each(|field| field_text(&mut text, "cell field", field));
    let side = |side| (side_name(side).to_string(), mesh.side(side).len());
    let mut groups: Vec<(String, usize)> = (0..2 * D).map(side).collect();
    for number in 1..=features.areas.len() as u32 {
        let count = features.of_faces.iter().filter(|of| **of == number).count();
        groups.push((feature_name(number), count));
    }
    let named = groups.iter().map(|(name, count)| format!("{name} {count}"));
    line(&mut text, "facets", listed(named, groups.len()));
    if !wells.is_empty() {
        let known = wells.iter().zip(1..).filter(|(cell, _)| **cell != NO_CELL);
        let place = |(&cell, number): (&u32, u32)| {
            format!("{} at {}", well_name(number), list(&mesh.centers()[cell as usize]))
        };
        line(&mut text, "cells of", listed(known.map(place), wells.len()));
    }
    origin_text(&mut text, Some(frame), Some(provenance));
    text
}

fn cells_quality_text(text: &mut String, report: &PolyReport) {
    let (mean, most) = (report.faces_per_cell_mean, report.faces_per_cell_max);
    line(text, "faces", format_args!("{}; mean {mean:.2} a cell, most {most}", report.faces));
    let (least, ratio) = (report.measure_min, report.measure_ratio);
    line(text, "sizes", format_args!("least {least:.4}, greatest over least {ratio:.2}"));
    line(text, "cosine", format_args!("least {:.6}, of faces' normals", report.orthogonality_min));
}

/// Where a mesh lies and comes from.
fn origin_text<const D: usize>(
    text: &mut String,
    frame: Option<&Frame<D>>,
    provenance: Option<&Provenance>,
) {
    if let Some(frame) = frame {
        line(text, "image", format_args!("{} samples", list(&frame.shape())));
    }
    if let Some(provenance) = provenance {
        if !provenance.units.is_empty() {
            line(text, "units", provenance.units.join(","));
        }
        line(text, "made by", format_args!("atomesh {}", provenance.version));
        line(text, "seed", provenance.seed);
        line(text, "options", &provenance.options);
    }
}

fn quality_text(text: &mut String, report: &ShapeReport) {
    let (mean, first, least) = (report.q_mean, report.q_p1, report.q_min);
    let quality = format!("mean {mean:.4}, first percentile {first:.4}, least {least:.4}");
    line(text, "quality", quality);
    let (least, first) = (report.angle_min, report.angle_p1);
    line(text, "angle", format_args!("least {least:.2}°, first percentile {first:.2}°"));
    line(text, "edge", format_args!("mean {:.4}", report.edge_mean));
    if report.inverted + report.flat > 0 {
        let odd = format!("{} inverted, {} flat", report.inverted, report.flat);
        line(text, "odd cells", odd);
    }
}

/// The name of a field and the range of its finite values.
fn field_text<T>(text: &mut String, kind: &str, field: &OwnedField<T>)
where
    T: Copy + PartialOrd + Display + Into<f64>,
{
    let finite = field.values.iter().copied().filter(|&value| value.into().is_finite());
    let range = finite.fold(None, |range: Option<(T, T)>, value| {
        let (least, greatest) = range.unwrap_or((value, value));
        let least = if value < least { value } else { least };
        Some((least, if value > greatest { value } else { greatest }))
    });
    match range {
        Some((least, greatest)) => {
            line(text, kind, format_args!("{}, {least} to {greatest}", field.name));
        }
        None => line(text, kind, format_args!("{}, no finite value", field.name)),
    }
}
