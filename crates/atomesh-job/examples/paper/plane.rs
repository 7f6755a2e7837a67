//! Figures 1, 2 and 5 to 8: the fault image, its graded mesh, lattice and potential, and flow past the faults.

use atomesh::energy::{Engine, PairsEngine, SampledEngine};
use atomesh::fields::FieldsView;
use atomesh::image::{Frame, Image, Samples};
use atomesh::lattice::Lattice;
use atomesh::run::{Inputs, prepare};
use atomesh::synth::Scene;
use atomesh::watch::Silent;
use atomesh_draw::{Picture, Style, draw_triangles};
use atomesh_job::flow::{FlowOptions, FlowPictureOptions};
use atomesh_job::mesh::MeshImages;
use atomesh_job::{Dimension, Session};

use crate::book::{Book, Checked, Failure, dots, mesh, plain, run};

/// The paper's image of faults.
const IMAGE: &str = "hale2001-fig1-faults.png";

/// Figures 5 to 7: nominal distances of 6 to 18, β = 0.3.
const GRADED: &str = "--size 6..18 --beta 0.3";
/// The same in the paper's own way: what atoms feel is p(x) alone, and none is put on a feature beforehand.
const PAPERS: &str = "--size 6..18 --beta 0.3 --align off";

pub fn fault_image(book: &Book) -> Result<Image<2>, Failure> {
    book.flat(IMAGE, Scene::Faults, [256, 256])
}

/// Figures 1 and 2.
pub fn faults(book: &mut Book) -> Result<(), Failure> {
    let image = fault_image(book)?;
    let [width, height] = image.frame().shape();
    let checked =
        [Checked { name: "samples", value: (width * height) as f64, range: [256.0 * 256.0; 2] }];
    book.add("figure-1", "An image of faults", "", &plain(&image)?, &checked)?;

    let outcome = mesh(GRADED, &image, &Dimension::plane())?;
    let report = outcome.report(&mut Silent)?;
    let picture = draw_triangles(&image, &outcome.sample_mesh(), &Style::default())?;
    let checked = [
        Checked { name: "mean quality", value: report.shape.q_mean, range: [0.9, 1.0] },
        Checked {
            name: "share of the features that edges follow",
            value: report.alignment.recall.unwrap_or(0.0),
            range: [0.75, 1.0],
        },
    ];
    let caption = "A mesh of variable density that is aligned with the faults";
    book.add("figure-2", caption, GRADED, &picture, &checked)
}

/// Figures 5 to 7: d(x) with its lattice, and p(x) before and after the atoms have moved.
pub fn lattice(book: &mut Book) -> Result<(), Failure> {
    let image = fault_image(book)?;
    let options = run(PAPERS)?.mesh_options::<2>()?;
    let dimension = Dimension::plane();
    let prepared = prepare(&dimension.method, Inputs::image(&image), options, &mut Silent)?;
    let filled = prepared.fill(&mut Silent)?;
    let start = filled.lattice().clone();

    let distances = prepared.distance_at_samples();
    let mean = distances.iter().map(|&d| f64::from(d)).sum::<f64>() / distances.len() as f64;
    let field = field(&image, distances)?;
    // what the paper says of its image holds for that one alone
    let range = if book.has(IMAGE) { [9.2, 10.2] } else { [6.0, 18.0] };
    let checked = [Checked { name: "mean distance", value: mean, range }];
    let caption =
        "The nominal distance d(x), 6 to 18 samples, and the lattice that Algorithm 2 makes";
    book.add(
        "figure-5",
        caption,
        "--size 6..18",
        &dots(&field, start.atoms().to_vec())?,
        &checked,
    )?;

    let settled = filled.settle(&mut Silent)?;
    let fields = prepared.fields();
    let count = start.len() as f64;
    let (before, picture) = total_potential(&image, fields, &start)?;
    let checked =
        [Checked { name: "energy per atom", value: before / count, range: [-10.0, 10.0] }];
    book.add(
        "figure-6",
        "The total potential field p(x) of the initial lattice",
        PAPERS,
        &picture,
        &checked,
    )?;

    let (after, picture) = total_potential(&image, fields, settled.lattice())?;
    let report = settled.optimize_report();
    let reported = report.energy_atomic + report.energy_image;
    let atoms = settled.lattice().len() as f64;
    let off = (after / atoms - reported / atoms).abs();
    let checked = [
        Checked { name: "energy per atom", value: after / atoms, range: [-10.0, before / count] },
        Checked { name: "how far it is from the run's report", value: off, range: [0.0, 1e-6] },
    ];
    book.add(
        "figure-7",
        "The same when the atoms have moved into valleys",
        PAPERS,
        &picture,
        &checked,
    )
}

/// The energy of a lattice and its field p(x), atoms on it.
fn total_potential(
    image: &Image<2>,
    fields: FieldsView<'_, 2>,
    lattice: &Lattice<2>,
) -> Result<(f64, Picture), Failure> {
    let atoms = lattice.atoms();
    let mut slopes = vec![[0.0; 2]; atoms.len()];
    let mut pairs = PairsEngine::new(fields);
    pairs.prepare(atoms, 0.0);
    let energy = pairs.evaluate(atoms, &mut slopes);
    // the paper's engine, whose field its figures show
    let mut engine = SampledEngine::new(fields);
    engine.prepare(atoms, 0.0);
    engine.evaluate(atoms, &mut slopes);
    Ok((energy.total(), dots(&field(image, engine.field().to_vec())?, atoms.to_vec())?))
}

/// Values at the samples of an image.
fn field(image: &Image<2>, values: Vec<f32>) -> Result<Image<2>, Failure> {
    Ok(Image::new(Frame::new(image.frame().shape())?, Samples::F32(values.into()))?)
}

/// Figure 8: flow past faults, from the upper left to the lower right.
pub fn flow(book: &mut Book) -> Result<(), Failure> {
    let image = fault_image(book)?;
    let dimension = Dimension::plane();
    // the paper's faults have ends; those of the program's image part it, and let a thousandth through
    let multiplier = if book.has(IMAGE) { 0.0 } else { 1e-3 };
    let wells = FlowOptions {
        multiplier,
        source: vec!["16,16".parse()?],
        sink: vec!["239,239".parse()?],
        ..FlowOptions::default()
    };
    let (mut watch, constant) = (Silent, "--size 8");
    let mut session = Session::new(&mut watch);
    let images = MeshImages::new(image);
    let answer =
        atomesh_job::flow::flow(&run(constant)?, &wells, images, &dimension, &mut session)?;
    let shown = FlowPictureOptions { max_side: 1200.0, ..FlowPictureOptions::default() };
    let picture = answer.picture(&shown, &dimension)?;
    let error = answer.balance(&dimension.flow).relative_error();
    let checked =
        [Checked { name: "error of the mass balance", value: error, range: [0.0, 1e-10] }];
    let caption = "Flow from the upper left to the lower right past faults that seal, or nearly so";
    let options = format!("--size 8 --source 16,16 --sink 239,239 --multiplier {multiplier}");
    book.add("figure-8", caption, &options, &picture, &checked)
}
