//! Figures 2 and 3 of Hale (2002): Voronoi cells whose faces fall on features.

use atomesh::image::Image;
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;
use atomesh_draw::{Style, draw_polygons, draw_polyhedra};
use atomesh_job::Dimension;

use crate::book::{Book, Checked, Failure, mesh};
use crate::plane::fault_image;

/// Along faults, and along faults and horizons of a section.
pub fn along_faults(book: &mut Book) -> Result<(), Failure> {
    let section = SynthOptions { seed: 2, ..SynthOptions::new([256, 200]) };
    let section = synthesize(Scene::Section, &section)?.image;
    polygons(
        book,
        "figure-2a-of-2002",
        "along faults",
        &fault_image(book)?,
        "--mesh voronoi --size 8",
    )?;
    let both = "--mesh voronoi --size 8 --features faults,horizons:0.6";
    polygons(book, "figure-2b-of-2002", "along faults and horizons", &section, both)
}

fn polygons(
    book: &mut Book,
    name: &str,
    where_: &str,
    image: &Image<2>,
    options: &str,
) -> Result<(), Failure> {
    let outcome = mesh(options, image, &Dimension::plane())?;
    let cells = outcome.sample_cells().ok_or("no cells")?;
    let report = outcome.cells_report(&mut Silent)?.ok_or("no report")?;
    let picture = draw_polygons(image, &cells, &Style::default())?;
    let checked = [Checked {
        name: "share of the features that sides follow",
        value: report.alignment.recall.unwrap_or(0.0),
        range: [0.5, 1.0],
    }];
    book.add(name, &format!("Voronoi cells {where_}"), options, &picture, &checked)
}

/// In space, along faults.
pub fn in_space(book: &mut Book) -> Result<(), Failure> {
    let options = SynthOptions { seed: 3, ..SynthOptions::new([64, 64, 48]) };
    let image = synthesize(Scene::LayersFaults, &options)?.image;
    let options = "--mesh voronoi --size 6";
    let outcome = mesh(options, &image, &Dimension::space())?;
    let cells = outcome.sample_cells().ok_or("no cells")?;
    let report = outcome.cells_report(&mut Silent)?.ok_or("no report")?;
    let middle = image.frame().shape().map(|n| n / 2);
    let picture = draw_polyhedra(&image, &cells, middle, &Style::default())?;
    let checked = [Checked {
        name: "share of the faults that faces follow",
        value: report.alignment.recall.unwrap_or(0.0),
        range: [0.7, 1.0],
    }];
    book.add(
        "figure-3-of-2002",
        "Voronoi cells in space, along faults",
        options,
        &picture,
        &checked,
    )
}
