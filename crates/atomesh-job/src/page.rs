//! The HTML report of a run or of any mesh.

use std::path::Path;

use atomesh::image::Image;
use atomesh::mesh::Mesh;
use atomesh::run::MeshReport;
use atomesh_draw::{ReportPage, Style};
use serde_json::Value;

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::files::write_bytes;

/// What a page shows beside the figures.
pub(crate) struct PageParts<'a> {
    /// The mesh's file.
    pub mesh: &'a Path,
    /// A sentence about it.
    pub subtitle: String,
    /// The picture's caption.
    pub caption: String,
    /// Tables of options and of the run.
    pub tables: Vec<(String, Vec<(String, String)>)>,
    /// The notes, in words.
    pub notes: Vec<String>,
}

/// A mesh in sample coordinates over an image, as a page shows it.
pub(crate) struct Shown<'a, const D: usize> {
    /// The image.
    pub image: &'a Image<D>,
    /// The mesh.
    pub mesh: &'a Mesh<D>,
    /// How it is drawn.
    pub style: &'a Style,
}

/// Writes the page of a mesh.
///
/// # Errors
/// [`JobError`] if the picture cannot be drawn or the file not be written.
pub(crate) fn write_page<const D: usize>(
    path: &Path,
    parts: PageParts<'_>,
    report: &MeshReport,
    shown: &Shown<'_, D>,
    dimension: &Dimension<D>,
) -> Result<(), JobError> {
    let picture = (dimension.drawing.mesh)(shown.image, shown.mesh, shown.style);
    let name = parts.mesh.file_name().unwrap_or(parts.mesh.as_os_str());
    let page = ReportPage {
        title: name.to_string_lossy().into_owned(),
        subtitle: parts.subtitle,
        dimension: D,
        report,
        pictures: vec![(parts.caption, picture.map_err(JobError::content)?)],
        tables: parts.tables,
        warnings: parts.notes,
    };
    let html = page.html().map_err(JobError::content)?;
    write_bytes(path, html.as_bytes())
}

/// What the picture of a mesh over its image shows.
pub(crate) fn caption<const D: usize>(image: &Path) -> String {
    let name = image.file_name().unwrap_or(image.as_os_str()).to_string_lossy();
    match D {
        2 => format!("The mesh over {name}"),
        _ => format!("The mesh over {name}, on the three slices through its middle"),
    }
}

/// Tables of options as rows: the name as on the command line, the value as in a configuration.
pub(crate) fn option_rows(options: &Value) -> Vec<(String, String)> {
    let mut rows = Vec::new();
    for table in options.as_object().into_iter().flat_map(|tables| tables.values()) {
        for (name, value) in table.as_object().into_iter().flatten() {
            let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            rows.push((format!("--{name}"), text));
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_shown_as_they_are_given() {
        let options = serde_json::json!({"lattice": {"beta": 0.5, "size": "6..18"}, "input": {}});
        let rows = [("--beta", "0.5"), ("--size", "6..18")].map(|(a, b)| (a.into(), b.into()));
        assert_eq!(option_rows(&options), rows);
        assert_eq!(option_rows(&Value::Null), []);
    }
}
