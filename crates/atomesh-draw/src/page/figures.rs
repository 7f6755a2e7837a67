//! The figures of a report: each with its unit and what it means.

use atomesh::measure::FeatureConformity;
use atomesh::run::MeshReport;

use super::text::{grouped, real};

/// One figure.
pub(super) struct Figure {
    pub name: &'static str,
    pub value: String,
    pub unit: &'static str,
    pub meaning: &'static str,
}

/// A table of figures.
pub(super) struct Table {
    pub title: &'static str,
    pub rows: Vec<Figure>,
}

fn figure(
    name: &'static str,
    value: impl Into<Shown>,
    unit: &'static str,
    meaning: &'static str,
) -> Figure {
    Figure { name, value: value.into().0, unit, meaning }
}

/// A value as it is shown.
struct Shown(String);

impl From<usize> for Shown {
    fn from(count: usize) -> Self {
        Self(grouped(count as u64))
    }
}

impl From<f64> for Shown {
    fn from(x: f64) -> Self {
        Self(real(x))
    }
}

impl From<Option<f64>> for Shown {
    fn from(x: Option<f64>) -> Self {
        Self(x.map_or("–".into(), real))
    }
}

/// All tables that a report fills.
pub(super) fn tables(report: &MeshReport, dimension: usize) -> Vec<Table> {
    let mut tables = vec![shape(report, dimension), alignment(report, dimension)];
    tables.extend(conformity(report, dimension));
    tables.extend(fidelity(report));
    tables.extend(homogeneity(report));
    tables
}

fn shape(report: &MeshReport, dimension: usize) -> Table {
    let (shape, spread) = (&report.shape, &report.spread);
    let flat = dimension == 2;
    let rows = vec![
        figure("points", shape.points, "", "vertices of the mesh"),
        figure("cells", shape.cells, "", if flat { "triangles" } else { "tetrahedra" }),
        figure(
            "inverted, flat",
            shape.inverted + shape.flat,
            "",
            "cells of negative or almost no measure; 0 in a sound mesh",
        ),
        figure(
            "volume error",
            shape.volume_error,
            "1",
            "|sum of cells − box| / box; rounding alone leaves some 1e-15",
        ),
        figure(
            "q mean",
            shape.q_mean,
            "1",
            "mean of the quality D · inradius / circumradius: 1 if all cells are equilateral",
        ),
        figure("q 1 %", shape.q_p1, "1", "one cell in a hundred is worse"),
        figure("q least", shape.q_min, "1", "the worst cell"),
        figure(
            "least angle",
            shape.angle_min,
            "°",
            if flat {
                "the smallest interior angle of all cells"
            } else {
                "the smallest dihedral angle of all cells"
            },
        ),
        figure("least angle 1 %", shape.angle_p1, "°", "one cell in a hundred has a smaller one"),
        figure(
            "greatest angle",
            spread.angle_max,
            "°",
            "the largest angle of all cells; near 180° equations become stiff",
        ),
        figure("edge", shape.edge_mean, "lattice units", "mean length of the edges"),
        figure(
            "edge / d",
            spread.edge_ratio_mean,
            "1",
            "mean length over the length wanted where the edge is",
        ),
        figure("edge / d, spread", spread.edge_ratio_std, "1", "standard deviation of that ratio"),
    ];
    Table { title: "Shape", rows }
}

fn alignment(report: &MeshReport, dimension: usize) -> Table {
    let a = &report.alignment;
    let mut rows = vec![
        figure(
            "features",
            a.features_found,
            "points",
            "points at the bottom of valleys of the potential, about one a sample",
        ),
        figure(
            "recall",
            a.recall,
            "1",
            "share of the features that a facet passes within τ, within 20° of their direction",
        ),
        figure("τ", a.tau, "samples", "how near counts as on a feature: max(1, d/10)"),
        figure("distance, mean", a.dist_mean, "samples", "from features to the nearest facet"),
        figure("distance, 95 %", a.dist_p95, "samples", "one feature point in twenty is farther"),
        figure("distance, mean", a.dist_mean_relative, "d", "the same over the wanted edge length"),
    ];
    if let Some(selected) = &a.selected {
        let unit = if dimension == 2 { "samples" } else { "samples²" };
        rows.extend([
            figure(
                "precision",
                selected.precision,
                "1",
                "share of the selected facets, by length or area, that lies within τ of a feature",
            ),
            figure(
                "selected facets",
                selected.facets_selected,
                "",
                "facets that a threshold on the potential picks as features",
            ),
            figure("selected measure", selected.measure_selected, unit, "their length or area"),
            figure(
                "threshold",
                selected.threshold,
                "1",
                "greatest mean of the potential along a facet that is selected",
            ),
        ]);
    }
    Table { title: "Alignment with features", rows }
}

/// How the facets of features keep to them.
fn conformity(report: &MeshReport, dimension: usize) -> Option<Table> {
    let c = report.conformity.as_ref()?;
    let unit = if dimension == 2 { "world units" } else { "world units²" };
    let rows = vec![
        figure(
            "precision",
            c.precision,
            "1",
            "share of the facets of features, by length or area, whose middle is within a sample of its feature",
        ),
        figure("distance, RMS", c.distance.rms, "samples", "from the facets of features to these"),
        figure("distance, 95 %", c.distance.p95, "samples", "one place in twenty is farther"),
        figure("distance, RMS", c.distance.rms_world, "world units", "the same in the world"),
        figure("facets", c.measure, unit, "length or area of the facets of features"),
        figure("not met", c.not_met, unit, "length or area of features without a facet, estimated"),
        figure("not met, share", c.not_met_share, "1", "the same over that of all features"),
        figure("cells cut", c.cells_cut, "", "cells that a feature passes through"),
    ];
    Some(Table { title: "Features that the mesh keeps to", rows })
}

/// The most features that a page lists.
const MOST_FEATURES: usize = 40;

/// The names of the columns that list features, and a row for each of the first ones.
pub(super) fn feature_rows(
    report: &MeshReport,
    dimension: usize,
) -> (Vec<String>, Vec<Vec<String>>) {
    let measure = if dimension == 2 { "length" } else { "area" };
    let columns = ["feature", "kind", "strength", "facets", measure, "not met", "RMS", "95 %"];
    let row = |(number, f): (usize, &FeatureConformity)| {
        let name = f.name.clone().unwrap_or_else(|| format!("({})", number + 1));
        let share = Shown::from(f.not_met_share).0;
        let [rms, p95] = [f.distance.rms, f.distance.p95].map(|x| Shown::from(x).0);
        let strength = Shown::from(f.strength).0;
        let (facets, measure) = (Shown::from(f.facets).0, Shown::from(f.measure).0);
        vec![name, f.kind.clone(), strength, facets, measure, share, rms, p95]
    };
    let rows = report.features.iter().enumerate().take(MOST_FEATURES).map(row).collect();
    (columns.map(String::from).to_vec(), rows)
}

fn fidelity(report: &MeshReport) -> Option<Table> {
    let f = report.fidelity.as_ref()?;
    let rows = vec![
        figure(
            "constant, RMS",
            f.constant_rms,
            "image",
            "error left when each cell has the mean of the samples it overlaps",
        ),
        figure(
            "constant, share",
            f.constant_relative,
            "1",
            "the same over the standard deviation of the image",
        ),
        figure(
            "linear, RMS",
            f.linear_rms,
            "image",
            "error left by the continuous piecewise linear fit of least squares",
        ),
        figure(
            "linear, share",
            f.linear_relative,
            "1",
            "the same over the standard deviation of the image",
        ),
        figure("deviation", f.deviation, "image", "standard deviation of the image under the mesh"),
        figure("covered", f.covered, "1", "share of the image's box that the mesh covers"),
    ];
    Some(Table { title: "Fidelity", rows })
}

fn homogeneity(report: &MeshReport) -> Option<Table> {
    let h = report.homogeneity.as_ref()?;
    let rows = vec![
        figure(
            "homogeneity",
            h.mean,
            "1",
            "share of a cell that its dominant label fills, averaged over the volume",
        ),
        figure("least", h.min, "1", "the most mixed cell"),
        figure("mixed cells", h.mixed, "", "cells with less than 0.9 of one label"),
    ];
    Some(Table { title: "Homogeneity with labels", rows })
}
