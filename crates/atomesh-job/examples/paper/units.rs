//! Units of rock as clusters of cells (Hale & Emanuel 2003): parts of a section that end at faults and horizons.

use atomesh::cluster::{CellGraph, ClusterOptions, ClusterTree, WeightOptions, shared_facets};
use atomesh::features::FacetField;
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;
use atomesh_draw::{FlowCells, PartsPicture, Style, draw_parts};
use atomesh_job::Dimension;

use crate::book::{Book, Checked, Failure, mesh};

const OPTIONS: &str = "--features faults,horizons:0.6 --size 7";

/// How many units there are to be.
const UNITS: usize = 12;

/// A section in units.
pub fn section(book: &mut Book) -> Result<(), Failure> {
    let options = SynthOptions { seed: 2, ..SynthOptions::new([256, 200]) };
    let image = synthesize(Scene::Section, &options)?.image;
    let outcome = mesh(OPTIONS, &image, &Dimension::plane())?;
    let cells = outcome.mesh();
    let field = FacetField::along(cells, outcome.potential(), &mut Silent)?;
    let facets = shared_facets(cells, Some(&field), &[]);
    let contrast = WeightOptions::default().contrast;
    let graph = CellGraph::of_facets(cells.cell_count(), &facets, contrast)?;
    let wanted = ClusterOptions { most_parts: UNITS, ..ClusterOptions::default() };
    let parts = ClusterTree::grow(&graph, &wanted, &mut Silent)?.parts(UNITS);

    // borders run along features: b there is far lower than along other facets
    let mean = |is_border: bool| {
        let own = facets.iter().filter(|facet| {
            let [a, b] = facet.cells.map(|cell| parts[cell as usize]);
            (a != b) == is_border
        });
        let [b, length] = own.fold([0.0; 2], |[b, length], facet| {
            [b + facet.measure * facet.mean, length + facet.measure]
        });
        b / length
    };
    let (border, inside) = (mean(true), mean(false));
    let shown = outcome.sample_mesh();
    let cells = FlowCells::Simplices(&shown);
    let picture = PartsPicture { cells, image: Some(&image), parts: &parts };
    let picture = draw_parts(&picture, &Style::default())?;
    let checked = [
        Checked { name: "mean of b along borders of units", value: border, range: [-1.0, -0.3] },
        Checked { name: "mean of b along other edges", value: inside, range: [-0.25, 0.0] },
    ];
    let options = format!("{OPTIONS} --parts {UNITS}");
    book.add("units-of-2003", "Clusters of cells as units of rock", &options, &picture, &checked)
}
