//! A report as one self-contained page of HTML, without scripts, fonts or other files.
//!
//! Pictures are embedded, histograms are inline SVG in the page's colours, light or dark as the reader's system is, black
//! on white in print. The same input gives the same bytes.

mod chart;
mod figures;
mod text;

#[cfg(test)]
mod tests;

use std::fmt::Write;

use atomesh::run::MeshReport;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::{DrawError, Picture, PictureFormat};
use chart::Chart;
use figures::Table;
use text::{escape, grouped, real};

/// The number of lines and dots up to which a picture is smaller as SVG.
const FEW_SHAPES: usize = 20_000;

/// The contents of a page.
#[derive(Clone, Debug)]
pub struct ReportPage<'a> {
    /// What the page is about, such as the mesh's file name.
    pub title: String,
    /// A sentence under it.
    pub subtitle: String,
    /// 2 or 3.
    pub dimension: usize,
    /// The figures.
    pub report: &'a MeshReport,
    /// Pictures with their captions.
    pub pictures: Vec<(String, Picture)>,
    /// Tables of names and values: options, times.
    pub tables: Vec<(String, Vec<(String, String)>)>,
    /// Warnings.
    pub warnings: Vec<String>,
}

impl ReportPage<'_> {
    /// The text of the page.
    ///
    /// # Errors
    /// [`DrawError`] if a picture cannot be encoded.
    pub fn html(&self) -> Result<String, DrawError> {
        let title = escape(&self.title);
        let mut out = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>\n{}</style>\n</head>\n<body>\n<h1>{title}</h1>\n\
             <p class=\"soft\">{}</p>\n",
            include_str!("page.css"),
            escape(&self.subtitle)
        );
        for warning in &self.warnings {
            let _ = writeln!(out, "<p class=\"warning\">{}</p>", escape(warning));
        }
        self.key_figures(&mut out);
        for (caption, picture) in &self.pictures {
            embed(&mut out, caption, picture)?;
        }
        out.push_str("<h2>Distributions</h2>\n<div class=\"charts\">\n");
        self.charts(&mut out);
        out.push_str("</div>\n");
        for table in figures::tables(self.report, self.dimension) {
            figure_table(&mut out, &table);
        }
        self.feature_table(&mut out);
        for (title, rows) in self.tables.iter().filter(|(_, rows)| !rows.is_empty()) {
            let _ = writeln!(out, "<h2>{}</h2>\n<table>", escape(title));
            for (name, value) in rows {
                let (name, value) = (escape(name), escape(value));
                let _ = writeln!(out, "<tr><td>{name}</td><td><code>{value}</code></td></tr>");
            }
            out.push_str("</table>\n");
        }
        out.push_str("</body>\n</html>\n");
        Ok(out)
    }

    /// The figures that a reader looks for first.
    fn key_figures(&self, out: &mut String) {
        let (shape, alignment) = (&self.report.shape, &self.report.alignment);
        let cells = if self.dimension == 2 { "triangles" } else { "tetrahedra" };
        let angle = if self.dimension == 2 { "least angle" } else { "least dihedral angle" };
        let mut figures = vec![
            (grouped(shape.cells as u64), cells),
            (real(shape.q_mean), "mean quality"),
            (format!("{}°", real(shape.angle_min)), angle),
        ];
        let selected = alignment.selected.as_ref();
        let conformity = self.report.conformity.as_ref();
        let fidelity = self.report.fidelity.as_ref();
        for (value, name) in [
            (alignment.recall, "recall of features"),
            (selected.and_then(|s| s.precision), "precision"),
            (conformity.map(|c| c.not_met_share), "of features not met"),
            (fidelity.and_then(|f| f.linear_relative), "linear error / deviation"),
            (self.report.homogeneity.as_ref().map(|h| h.mean), "homogeneity"),
        ] {
            figures.extend(value.map(|value| (real(value), name)));
        }
        out.push_str("<div class=\"key\">\n");
        for (value, name) in figures {
            let _ = writeln!(out, "<div><b>{value}</b><span>{name}</span></div>");
        }
        out.push_str("</div>\n");
    }

    /// The first features that the mesh keeps to, largest first.
    fn feature_table(&self, out: &mut String) {
        let (columns, rows) = figures::feature_rows(self.report, self.dimension);
        if rows.is_empty() {
            return;
        }
        let count = self.report.features.len();
        let first =
            if rows.len() < count { format!(", the first {}", rows.len()) } else { String::new() };
        let _ = writeln!(out, "<h2>Features: {count}{first}</h2>\n<table>\n<tr>");
        for name in columns {
            let _ = writeln!(out, "<th>{}</th>", escape(&name));
        }
        out.push_str("</tr>\n");
        for row in rows {
            out.push_str("<tr>");
            for cell in row {
                let _ = write!(out, "<td>{}</td>", escape(&cell));
            }
            out.push_str("</tr>\n");
        }
        out.push_str("</table>\n");
    }

    fn charts(&self, out: &mut String) {
        let (shape, spread) = (&self.report.shape, &self.report.spread);
        let flat = self.dimension == 2;
        let all = if flat { "Interior angles" } else { "Dihedral angles" };
        let ideal = if flat { (60.0, "60°, equilateral") } else { (70.53, "70.5°, regular") };
        let charts = [
            ("Quality of cells", "cells", "", &shape.q_histogram, None),
            ("Least angle of cells", "cells", "°", &shape.angle_histogram, None),
            (all, "angles", "°", &spread.angles_histogram, Some(ideal)),
            ("Edge length / d", "edges", "", &spread.edge_histogram, Some((1.0, "as wanted"))),
        ];
        for (title, of, unit, histogram, mark) in charts {
            out.push_str(&Chart { title, of, unit, histogram, mark }.svg());
        }
        if let Some(h) = &self.report.homogeneity {
            let (title, histogram) = ("Share of the dominant label", &h.histogram);
            let chart = Chart { title, of: "cells", unit: "", histogram, mark: None };
            out.push_str(&chart.svg());
        }
    }
}

/// A table of figures.
fn figure_table(out: &mut String, table: &Table) {
    let _ = writeln!(
        out,
        "<h2>{}</h2>\n<table>\n<tr><th>figure</th><th>value</th><th>unit</th><th>what it means</th></tr>",
        escape(table.title)
    );
    for row in &table.rows {
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td class=\"number\">{}</td><td class=\"unit\">{}</td>\
             <td class=\"meaning\">{}</td></tr>",
            escape(row.name),
            escape(&row.value),
            escape(row.unit),
            escape(row.meaning)
        );
    }
    out.push_str("</table>\n");
}

/// A picture inside the page, as SVG, which stays sharp, or as PNG if that is smaller.
fn embed(out: &mut String, caption: &str, picture: &Picture) -> Result<(), DrawError> {
    let (format, kind) = if picture.shape_count() <= FEW_SHAPES {
        (PictureFormat::Svg, "svg+xml")
    } else {
        (PictureFormat::Png, "png")
    };
    let data = STANDARD.encode(picture.encode(format)?);
    let (width, height, caption) = (picture.width(), picture.height(), escape(caption));
    let _ = writeln!(
        out,
        "<figure><img width=\"{width}\" height=\"{height}\" alt=\"{caption}\" \
         src=\"data:image/{kind};base64,{data}\"><figcaption>{caption}</figcaption></figure>"
    );
    Ok(())
}
