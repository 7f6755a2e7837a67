//! Figures 9 and 10: a seismic volume, its mesh along faults and horizons, and two surfaces of it.

use std::collections::HashMap;

use atomesh::geometry::{Point, Sets, cross, difference};
use atomesh::image::Image;
use atomesh::mesh::{FacetGroup, Mesh, is_feature_name};
use atomesh::run::Outcome;
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;
use atomesh_draw::{FlowCells, Sheet, SpacePicture, Style, draw_slices, draw_space};
use atomesh_job::Dimension;

use crate::book::{Book, Checked, Failure, mesh};

/// Faults and horizons share a potential.
const OPTIONS: &str = "--features faults,horizons:0.6 --size 6";

/// A volume of amplitudes.
pub fn amplitudes() -> Result<Image<3>, Failure> {
    let options = SynthOptions { seed: 3, ..SynthOptions::new([80, 80, 64]) };
    Ok(synthesize(Scene::Layers, &options)?.image)
}

/// Both figures.
pub fn volume(book: &mut Book) -> Result<(), Failure> {
    let image = amplitudes()?;
    let outcome = mesh(OPTIONS, &image, &Dimension::space())?;
    slices(book, &image, &outcome)?;
    surfaces(book, &image, &outcome)
}

fn slices(book: &mut Book, image: &Image<3>, outcome: &Outcome<3>) -> Result<(), Failure> {
    let report = outcome.report(&mut Silent)?;
    let middle = image.frame().shape().map(|n| n / 2);
    let style = Style { atoms: true, max_side: 1400.0, ..Style::default() };
    let picture = draw_slices(image, &outcome.sample_mesh(), middle, &style)?;
    let checked = [
        Checked { name: "mean quality", value: report.shape.q_mean, range: [0.7, 1.0] },
        Checked {
            name: "share of the features that faces follow",
            value: report.alignment.recall.unwrap_or(0.0),
            range: [0.5, 1.0],
        },
    ];
    let caption = "Slices through a mesh of tetrahedra that is aligned with faults and horizons";
    book.add("figure-9", caption, OPTIONS, &picture, &checked)
}

/// The largest surface that is steep and the largest that is not, of those that the mesh follows; one without folds, as
/// horizons near each other are found as one.
fn surfaces(book: &mut Book, image: &Image<3>, outcome: &Outcome<3>) -> Result<(), Failure> {
    let mesh = outcome.sample_mesh();
    let tags = outcome.tags()?;
    let groups = tags.facet_groups().iter().filter(|group| is_feature_name(&group.name));
    let areas: Vec<(&FacetGroup<3>, Point<3>)> =
        groups.map(|group| (group, areas_by_axis(&mesh, group))).collect();
    // of the box, as it is seen along each axis
    let [x, y, z] = image.frame().shape().map(|n| n as f64);
    let sides = [y * z, z * x, x * y];
    let largest = |name: &str, is_steep: bool| {
        let of_kind = areas.iter().filter(|(_, seen)| {
            let [x, y, z] = *seen;
            (x.hypot(y) > z) == is_steep && (0..3).all(|k| seen[k] <= sides[k])
        });
        let area = |[x, y, z]: &Point<3>| x.hypot(*y).hypot(*z);
        let found = of_kind.max_by(|a, b| area(&a.1).total_cmp(&area(&b.1)));
        let facets = found.map(|(group, _)| group.facets.clone());
        facets.map(|facets| Sheet { name: name.into(), facets }).ok_or(format!("no {name}"))
    };
    let sheets = [largest("horizon", false)?, largest("fault", true)?];
    let contents = SpacePicture {
        cells: FlowCells::Simplices(&mesh),
        image: Some(image),
        sheets: &sheets,
        parts: &[],
        cells_cut_away: false,
    };
    let picture = draw_space(&contents, &Style::default())?;
    let [horizon, fault] = sheets.each_ref().map(|sheet| pieces(sheet) as f64);
    let checked = [
        Checked { name: "pieces of the horizon", value: horizon, range: [1.0, 1.0] },
        Checked { name: "pieces of the fault", value: fault, range: [1.0, 1.0] },
    ];
    let caption = "Two surfaces of that mesh, a horizon and a fault, before slices of the image";
    book.add("figure-10", caption, OPTIONS, &picture, &checked)
}

/// The area of a group of facets as it is seen along each axis.
fn areas_by_axis(mesh: &Mesh<3>, group: &FacetGroup<3>) -> Point<3> {
    let mut sum = [0.0; 3];
    for facet in &group.facets {
        let [a, b, c] = facet.map(|corner| mesh.points()[corner as usize]);
        let normal = cross(&difference(&b, &a), &difference(&c, &a));
        (0..3).for_each(|k| sum[k] += 0.5 * normal[k].abs());
    }
    sum
}

/// The number of pieces that a surface falls into, joined along edges.
fn pieces(sheet: &Sheet<3>) -> usize {
    let mut of_edges: HashMap<[u32; 2], u32> = HashMap::new();
    let mut sets = Sets::new(sheet.facets.len());
    for (at, facet) in (0..).zip(&sheet.facets) {
        for k in 0..3 {
            let mut edge = [facet[k], facet[(k + 1) % 3]];
            edge.sort_unstable();
            sets.join(at, *of_edges.entry(edge).or_insert(at));
        }
    }
    sets.numbers().into_iter().max().map_or(0, |last| last as usize + 1)
}
