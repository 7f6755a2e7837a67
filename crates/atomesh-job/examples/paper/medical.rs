//! Figures 11 and 12: a slice through a torso, and its mesh.

use atomesh::watch::Silent;
use atomesh_draw::{Style, draw_triangles};
use atomesh_io::image::AnyImage;
use atomesh_job::Dimension;

use crate::book::{Book, Checked, Failure, mesh, plain};
use crate::phantom::torso as phantom;

/// Prewitt's differences find edges, as in the paper.
const OPTIONS: &str = "--features edges --edge-operator prewitt --size 5";

/// The image, and the mesh over it.
pub fn torso(book: &mut Book) -> Result<(), Failure> {
    let image = match book.read("hale2001-fig11-torso.png")? {
        Some(AnyImage::Flat(image)) => image,
        _ => phantom()?,
    };
    let [width, height] = image.frame().shape();
    let checked = [Checked { name: "samples", value: (width * height) as f64, range: [1e4, 1e7] }];
    book.add("figure-11", "A slice through a torso", "", &plain(&image)?, &checked)?;

    let outcome = mesh(OPTIONS, &image, &Dimension::plane())?;
    let report = outcome.report(&mut Silent)?;
    let style = Style { edge_pixels: 12.0, ..Style::default() };
    let picture = draw_triangles(&image, &outcome.sample_mesh(), &style)?;
    let checked = [
        Checked { name: "mean quality", value: report.shape.q_mean, range: [0.88, 1.0] },
        Checked {
            name: "share of the edges that are followed",
            value: report.alignment.recall.unwrap_or(0.0),
            range: [0.75, 1.0],
        },
    ];
    book.add("figure-12", "A mesh of that image", OPTIONS, &picture, &checked)
}
