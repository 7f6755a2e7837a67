//! Figures 3 and 4: the pair functions, and what one atom adds to a sampled field.

use atomesh::energy::{Engine, SampledEngine, pair};
use atomesh::fields::{Fields, ImageWeight, Interpolation, NominalDistance, ScalarField};
use atomesh::geometry::Bounds;
use atomesh::image::{Frame, Grid, Image, Samples};
use atomesh::mesh::Delaunay;
use atomesh::voronoi::voronoi;
use atomesh::watch::Silent;
use atomesh_draw::{Curve, Style, draw_curves, draw_polygons};

use crate::book::{Book, Checked, Failure};

/// Samples along a side of figure 4.
const SIDE: usize = 31;

/// Figure 3: force and potential of the normalized distance.
pub fn pair_functions(book: &mut Book) -> Result<(), Failure> {
    let curve = |function| Curve { function, range: [0.0, 2.0] };
    let picture = draw_curves(&[curve(&pair::force), curve(&pair::energy)]);
    // f = −φ′, by central differences, whose error is of the order of step² but for the bend at 3/2, which is left out
    let step = 1e-4;
    let slope = |u: f64| (pair::energy(u + step) - pair::energy(u - step)) / (2.0 * step);
    let off =
        (0..200).map(|i| 0.01 * f64::from(i) + 0.005).map(|u| (pair::force(u) + slope(u)).abs());
    let checked = [
        Checked { name: "f(1)", value: pair::force(1.0), range: [-1e-15, 1e-15] },
        Checked {
            name: "φ(0) · 256/153",
            value: pair::energy(0.0) * 256.0 / 153.0,
            range: [1.0 - 1e-12, 1.0 + 1e-12],
        },
        Checked {
            name: "greatest |f + φ′|", value: off.fold(0.0, f64::max), range: [0.0, 1e-6]
        },
    ];
    let caption = "Force f(u), left, and potential φ(u), right, of two atoms at a distance of u nominal distances";
    book.add("figure-3", caption, "", &picture, &checked)
}

/// Figure 4: the contributions of one atom to a sampled field, for nominal distances of 4 and 8.
pub fn one_atom(book: &mut Book) -> Result<(), Failure> {
    for (name, distance) in [("figure-4a", 4.0), ("figure-4b", 8.0)] {
        let grid = Grid { shape: [SIDE; 2], step: [1.0; 2] };
        let flat = ScalarField::potential(grid, vec![0.0; SIDE * SIDE], Interpolation::Linear)?;
        let nominal = NominalDistance::constant(&grid, distance)?;
        let fields = Fields::new(flat, ImageWeight::constant(0.0)?, nominal)?;
        let mut engine = SampledEngine::new(fields.view());
        let middle = (SIDE / 2) as f64;
        let atom = [[middle; 2]];
        engine.prepare(&atom, 0.0);
        engine.evaluate(&atom, &mut [[0.0; 2]]);

        // the valley is far shallower than the peak is high: what is higher is white
        let field = engine.field();
        let depth = field.iter().copied().fold(0.0, f32::min).abs();
        let shown = field.iter().map(|v| v.clamp(-depth, depth)).collect::<Vec<f32>>();
        let image = Image::new(Frame::new([SIDE; 2])?, Samples::F32(shown.into()))?;
        let sites: Vec<[f64; 2]> =
            (0..SIDE * SIDE).map(|i| [(i % SIDE) as f64, (i / SIDE) as f64]).collect();
        let last = SIDE as f64 - 0.5;
        let bounds = Bounds { min: [-0.5; 2], max: [last; 2] };
        let squares = voronoi(&Delaunay::<2>::new(), &sites, bounds, &mut Silent)?;
        let style =
            Style { brightness: 1.0, edge_color: [0; 3], edge_pixels: 16.0, ..Style::default() };
        let picture = draw_polygons(&image, &squares, &style)?;

        let at = |x: usize| f64::from(field[SIDE * (SIDE / 2) + x]);
        let ring = at(SIDE / 2 + distance as usize);
        let expected = pair::energy(1.0);
        let checked = [Checked {
            name: "field at distance d over φ(1)",
            value: ring / expected,
            range: [1.0 - 1e-6, 1.0 + 1e-6],
        }];
        let caption =
            format!("What one atom adds to a sampled potential field where d = {distance}");
        book.add(name, &caption, "", &picture, &checked)?;
    }
    Ok(())
}
