//! Figures 9 and 10: a seismic volume, its mesh along faults and horizons, and two surfaces of it.

use atomesh::image::Image;
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;
use atomesh_draw::{Style, draw_slices};
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
    let report = outcome.report(&mut Silent)?;
    let middle = image.frame().shape().map(|n| n / 2);
    let style = Style { atoms: true, max_side: 1400.0, ..Style::default() };
    let picture = draw_slices(&image, &outcome.sample_mesh(), middle, &style)?;
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
