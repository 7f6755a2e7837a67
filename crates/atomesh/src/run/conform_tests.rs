//! Features first, from images to facets.

use std::collections::HashMap;

use super::*;
use crate::conform::{FeatureFacet, feature_facets};
use crate::enhance::{FeatureOptions, Features};
use crate::features::FeatureFacetOptions;
use crate::geometry::Point;
use crate::image::{Frame, Image, Samples};
use crate::improve::{Align, ImproveOptions};
use crate::watch::Silent;
use rand::{RngExt, SeedableRng};

/// What `grey` says at each sample.
fn image<const D: usize>(shape: [usize; D], grey: impl Fn(Point<D>) -> f64) -> Image<D> {
    let frame = Frame::new(shape).unwrap();
    let samples = (0..frame.sample_count()).map(|index| {
        let sample = crate::image::coordinates(index, shape);
        grey(sample.map(|i| i as f64)) as f32
    });
    Image::new(frame, Samples::F32(samples.collect())).unwrap()
}

/// A ball, bright on dark, its edge as smooth as a Gaussian of one sample makes it, nearly.
fn ball<const D: usize>(shape: [usize; D], centre: Point<D>, radius: f64) -> Image<D> {
    image(shape, |p| {
        let squares = (0..D).map(|k| (p[k] - centre[k]).powi(2));
        0.5 - 0.5 * ((squares.sum::<f64>().sqrt() - radius) / 1.2).tanh()
    })
}

fn conforming<const D: usize>(size: f64, features: Features) -> MeshOptions<D> {
    MeshOptions {
        size: Size::Constant(size),
        features: FeatureOptions { features, ..Default::default() },
        improve: ImproveOptions { align: Align::Conform, ..ImproveOptions::for_dimension(D) },
        ..Default::default()
    }
}

fn run<const D: usize>(
    method: &Method<D>,
    image: &Image<D>,
    options: MeshOptions<D>,
) -> Outcome<D> {
    let prepared = prepare(method, Inputs::image(image), options, &mut Silent).unwrap();
    prepared.run(&mut Silent).unwrap()
}

fn facets_of<const D: usize>(outcome: &Outcome<D>) -> Vec<FeatureFacet<D>> {
    let pieces = outcome.run().pieces().expect("the image has features");
    feature_facets(outcome.mesh(), pieces, outcome.distance())
}

/// How many facets of features there are at each point (2-D) or edge (3-D), by its corners.
fn sharing<const D: usize>(facets: &[FeatureFacet<D>]) -> HashMap<Vec<u32>, usize> {
    let mut shared = HashMap::new();
    for facet in facets {
        for skip in 0..D {
            let key = (0..D).filter(|&k| k != skip).map(|k| facet.corners[k]).collect::<Vec<_>>();
            *shared.entry(key).or_insert(0) += 1;
        }
    }
    shared
}

#[test]
fn the_edge_of_a_disc_is_one_closed_line_at_sub_sample_accuracy() {
    let (centre, radius) = ([31.3, 29.8], 19.6);
    let image = ball([64, 60], centre, radius);
    for size in [8.0, 4.0, 2.5] {
        let outcome = run(&Method::plane(), &image, conforming(size, Features::Edges));
        assert_eq!(outcome.mesh().validate(), Ok(()));
        let facets = facets_of(&outcome);
        assert!(sharing(&facets).values().all(|&count| count == 2), "d = {size}");
        assert!(facets.iter().all(|facet| facet.piece == 0));
        let points = outcome.mesh().points();
        let mut length = 0.0;
        for facet in &facets {
            let [a, b] = facet.corners.map(|c| points[c as usize]);
            length += (a[0] - b[0]).hypot(a[1] - b[1]);
            for p in [a, b] {
                // without the shift that blur gives: tanh is nearly a blurred step
                let off = (p[0] - centre[0]).hypot(p[1] - centre[1]) - radius;
                assert!(off.abs() < 0.08, "{off} at d = {size}");
            }
        }
        // the polygon of as many corners that the circle holds
        let count = facets.len() as f64;
        let inscribed = 2.0 * count * radius * (std::f64::consts::PI / count).sin();
        assert!((length / inscribed - 1.0).abs() < 0.005, "{length} {inscribed} at d = {size}");
        assert!(outcome.improve_report().unwrap().floor_held);
    }
}

#[test]
fn facets_turn_one_way_around_a_disc() {
    let image = ball([50, 50], [24.6, 25.2], 15.0);
    let outcome = run(&Method::plane(), &image, conforming(5.0, Features::Edges));
    let facets = facets_of(&outcome);
    let outward = facets.iter().filter(|facet| {
        let [a, b] = facet.corners.map(|c| outcome.mesh().points()[c as usize]);
        let normal = outcome.mesh().facet_normal(&facet.corners);
        let middle = [0.5 * (a[0] + b[0]) - 24.6, 0.5 * (a[1] + b[1]) - 25.2];
        (normal[0] * middle[0] + normal[1] * middle[1] > 0.0) == facet.agrees
    });
    let count = outward.count();
    assert!(count == 0 || count == facets.len(), "{count} of {}", facets.len());
}

#[test]
fn the_edge_of_a_ball_is_one_closed_surface() {
    let (centre, radius) = ([17.2, 16.7, 17.4], 11.3);
    let image = ball([35, 34, 36], centre, radius);
    let outcome = run(&Method::space(), &image, conforming(4.0, Features::Edges));
    assert_eq!(outcome.mesh().validate(), Ok(()));
    let facets = facets_of(&outcome);
    let shared = sharing(&facets);
    assert!(shared.values().all(|&count| count == 2));
    let mut points: Vec<u32> = facets.iter().flat_map(|facet| facet.corners).collect();
    points.sort_unstable();
    points.dedup();
    // Euler: a sphere has corners − edges + faces = 2
    assert_eq!(points.len() + facets.len(), shared.len() + 2);
    for &point in &points {
        let p = outcome.mesh().points()[point as usize];
        let squares = (0..3).map(|k| (p[k] - centre[k]).powi(2));
        let off = squares.sum::<f64>().sqrt() - radius;
        assert!(off.abs() < 0.15, "{off}");
    }
    assert!(outcome.improve_report().unwrap().floor_held);
}

/// Two dark lines that cross in the middle.
fn cross() -> Image<2> {
    image([80, 72], |p| {
        let lines = [[0.28, 0.96], [0.96, -0.28]];
        let valley = lines.map(|n| {
            let s: f64 = n[0] * (p[0] - 40.2) + n[1] * (p[1] - 36.4);
            (-0.5 * s * s).exp()
        });
        1.0 - valley[0].max(valley[1])
    })
}

#[test]
fn features_that_cross_stay_two_and_share_their_crossing() {
    let outcome = run(&Method::plane(), &cross(), conforming(7.0, Features::Dark));
    let facets = facets_of(&outcome);
    assert_eq!(outcome.run().pieces().unwrap().len(), 2);
    let mut at_points: HashMap<u32, Vec<u32>> = HashMap::new();
    for facet in &facets {
        facet.corners.iter().for_each(|&c| at_points.entry(c).or_default().push(facet.piece));
    }
    let bounds = outcome.bounds().unwrap();
    for (point, pieces) in at_points {
        let p = outcome.mesh().points()[point as usize];
        let on_side = bounds.freedom(&p).count_ones() < 2;
        match pieces.len() {
            1 => assert!(on_side, "a line ends at {p:?}"),
            2 => assert!(!on_side && pieces[0] == pieces[1]),
            4 => assert!((p[0] - 40.2).hypot(p[1] - 36.4) < 0.3, "lines cross at {p:?}"),
            count => panic!("{count} facets at {p:?}"),
        }
    }
    let set = outcome.features(&outcome.world_mesh(), &FeatureFacetOptions::default(), &mut Silent);
    let set = set.unwrap();
    assert_eq!((set.features.len(), set.intersections.len()), (2, 1));
    let names: Vec<String> =
        outcome.tags().unwrap().facet_groups().iter().map(|group| group.name.clone()).collect();
    assert!(names.contains(&"feature-1".to_string()) && names.contains(&"feature-2".to_string()));
}

#[test]
fn a_conforming_mesh_is_the_same_at_any_number_of_threads() {
    let flat = ball([50, 50], [24.6, 25.2], 15.0);
    let solid = ball([24, 25, 26], [12.0, 12.3, 12.6], 7.5);
    let meshes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let flat = run(&Method::plane(), &flat, conforming(5.0, Features::Edges));
            let solid = run(&Method::space(), &solid, conforming(4.0, Features::Edges));
            (flat.mesh().clone(), solid.mesh().clone())
        })
    };
    let one = meshes(1);
    assert_eq!(one, meshes(2));
    assert_eq!(one, meshes(5));
}

#[test]
fn fixed_points_stay_where_they_are_beside_features() {
    let image = ball([50, 50], [24.6, 25.2], 15.0);
    let seeds = vec![[20.25, 24.5], [40.0, 26.0], [3.5, 7.75]];
    let options = MeshOptions { seed_points: seeds.clone(), ..conforming(5.0, Features::Edges) };
    let outcome = run(&Method::plane(), &image, options);
    for seed in seeds {
        assert!(outcome.mesh().points().contains(&seed), "{seed:?}");
    }
}

#[test]
fn an_image_without_features_makes_the_mesh_that_it_makes_without_conforming() {
    let image = image([30, 24], |_| 7.0);
    let conforming = run(&Method::plane(), &image, conforming(5.0, Features::Edges));
    assert!(conforming.run().pieces().is_none());
    let full = MeshOptions {
        improve: ImproveOptions::for_dimension(2),
        ..conforming.run().options().clone()
    };
    assert_eq!(*conforming.mesh(), *run(&Method::plane(), &image, full).mesh());
}

#[test]
fn what_cannot_conform_is_said() {
    let image = ball([30, 28], [14.6, 14.2], 8.0);
    let warnings = |image: &Image<2>, options: MeshOptions<2>| {
        let prepared = prepare(&Method::plane(), Inputs::image(image), options, &mut Silent);
        prepared.unwrap().warnings().to_vec()
    };
    let conforming = |size: f64| conforming(size, Features::Edges);
    let repelling = FeatureOptions { features: Features::Edges, repel: true, ..Default::default() };
    let coarse = image.frame().with_spacing([1.0, 3.0]).unwrap();
    let coarse = Image::new(coarse, image.samples().clone()).unwrap();
    for (image, options) in [
        (&image, MeshOptions { features: repelling, ..conforming(5.0) }),
        (&image, MeshOptions { kind: MeshKind::Voronoi, ..conforming(5.0) }),
        (&coarse, conforming(1.5)),
    ] {
        assert!(matches!(warnings(image, options)[..], [Warning::NotConforming { .. }]));
    }
    assert_eq!(warnings(&image, conforming(5.0)), []);
    // where nobody asked, it is a note
    let auto = |options: MeshOptions<2>| MeshOptions {
        improve: ImproveOptions { align: Align::Auto, ..options.improve },
        ..options
    };
    let [note] = &warnings(&coarse, auto(conforming(1.5)))[..] else { panic!() };
    assert!(note.is_note() && matches!(note, Warning::TurnedOnly { .. }), "{note}");
    assert_eq!(warnings(&image, auto(conforming(5.0))), []);
}

#[test]
fn a_short_line_is_followed_though_most_of_its_points_are_at_its_tips() {
    let short = image([90, 80], |p| {
        let along = |x: f64| 1.0 / (1.0 + (-1.7 * x / 1.2).exp());
        let across = (-0.5 * ((p[1] - 40.3) / 1.2).powi(2)).exp();
        -across * along(p[0] - 34.6) * along(57.2 - p[0])
    });
    let options = MeshOptions {
        improve: ImproveOptions { align: Align::Auto, ..ImproveOptions::for_dimension(2) },
        ..conforming(4.0, Features::Dark)
    };
    let prepared = prepare(&Method::plane(), Inputs::image(&short), options, &mut Silent).unwrap();
    assert_eq!(prepared.pieces().map(crate::crests::Pieces::len), Some(1));
    assert_eq!(prepared.warnings(), []);
}

/// Lines of random slants and places, so near to each other that no rows of atoms fit between.
fn thicket() -> Image<2> {
    let lines: Vec<(Point<2>, f64)> = (0..40)
        .map(|i| {
            let (sine, cosine) = (f64::from(i * i) * 0.7).sin_cos();
            ([sine, cosine], f64::from(i * 37 % 97) - 30.0)
        })
        .collect();
    image([96, 96], |p| {
        let depth = |(normal, at): &(Point<2>, f64)| {
            (-0.5 * ((p[0] * normal[0] + p[1] * normal[1] - at) / 1.2).powi(2)).exp()
        };
        -lines.iter().map(depth).fold(0.0, f64::max)
    })
}

#[test]
fn facets_along_ragged_features_are_tagged_though_no_atoms_were_put_on_these() {
    let options = MeshOptions {
        improve: ImproveOptions { align: Align::Auto, ..ImproveOptions::for_dimension(2) },
        ..conforming(8.0, Features::Dark)
    };
    let outcome = run(&Method::plane(), &thicket(), options.clone());
    assert!(outcome.run().pieces().is_none());
    assert!(matches!(outcome.warnings(), [Warning::TurnedOnly { why }] if why.contains("ragged")));
    let found = outcome.features(outcome.mesh(), &Default::default(), &mut Silent).unwrap();
    let facets: Vec<[u32; 2]> =
        found.features.iter().flat_map(|feature| feature.facets.clone()).collect();
    assert!(facets.len() > 30, "{}", facets.len());
    let near = |p: &Point<2>| outcome.potential().value(p) < -0.3;
    let middle = |facet: &[u32; 2]| -> Point<2> {
        let [a, b] = facet.map(|corner| outcome.mesh().points()[corner as usize]);
        std::array::from_fn(|k| 0.5 * (a[k] + b[k]))
    };
    // b is -0.6 at 1.2 samples from the middle of a line
    let on = facets.iter().filter(|facet| near(&middle(facet))).count();
    assert!(on as f64 >= 0.9 * facets.len() as f64, "{on} of {}", facets.len());
    let tagged = outcome.tags().unwrap();
    let names = tagged.facet_groups().iter().filter(|group| group.name.starts_with("feature-"));
    assert_eq!(names.map(|group| group.facets.len()).sum::<usize>(), facets.len());
    // the same mesh as without tags
    let improve = ImproveOptions { align: Align::Full, ..options.improve };
    let plain = run(&Method::plane(), &thicket(), MeshOptions { improve, ..options });
    assert_eq!(plain.mesh(), outcome.mesh());
    assert!(plain.tags().unwrap().facet_groups().iter().all(|g| !g.name.starts_with("feature-")));
}

#[test]
fn boundaries_of_little_contrast_beside_noise_get_atoms_too() {
    // grey rises by 160 at x = 40.3, and left of it by 32 at y = 30.6; noise of deviation 8
    let mut random = rand_pcg::Pcg64::seed_from_u64(3);
    let noise: Vec<f64> = (0..80 * 64)
        .map(|_| (0..12).map(|_| random.random::<f64>() - 0.5).sum::<f64>() * 8.0)
        .collect();
    let rise = |x: f64| 1.0 / (1.0 + (-2.0 * x).exp());
    let image = image([80, 64], |p| {
        let weak = 32.0 * rise(p[1] - 30.6) * rise(40.3 - p[0]);
        160.0 * rise(p[0] - 40.3) + weak + noise[p[1] as usize * 80 + p[0] as usize]
    });
    let options = MeshOptions {
        improve: ImproveOptions { align: Align::Auto, ..ImproveOptions::for_dimension(2) },
        ..conforming(5.0, Features::Edges)
    };
    let prepared = prepare(&Method::plane(), Inputs::image(&image), options, &mut Silent).unwrap();
    let pieces = prepared.pieces().unwrap();
    let is_met = |p: [f64; 2]| {
        pieces
            .foot(&p, 3.0)
            .is_some_and(|foot| foot.beyond == 0.0 && foot.signed_distance(&p).abs() < 1.0)
    };
    for i in 4..32 {
        assert!(is_met([f64::from(i), 30.6]), "{i}");
        assert!(is_met([40.3, f64::from(2 * i)]), "{i}");
    }
}

#[test]
fn features_too_near_each_other_for_rows_are_not_given_any() {
    let stripes = image([60, 50], |p| (std::f64::consts::TAU * p[0] / 3.2).cos());
    let options = MeshOptions {
        improve: ImproveOptions { align: Align::Auto, ..ImproveOptions::for_dimension(2) },
        ..conforming(8.0, Features::Dark)
    };
    let prepared =
        prepare(&Method::plane(), Inputs::image(&stripes), options, &mut Silent).unwrap();
    assert!(prepared.pieces().is_none());
    assert!(matches!(prepared.warnings(), [Warning::TurnedOnly { why }] if why.contains("apart")));
}

#[test]
fn what_is_not_met_is_said() {
    // a band whose sides are nearer to each other than atoms of two features may be: 0.45 d
    let band = |width: f64| {
        image([60, 50], |p| {
            let side = |at: f64| ((p[1] - at) / 1.2).tanh();
            0.5 * (side(24.6 - 0.5 * width) - side(24.6 + 0.5 * width))
        })
    };
    let narrow = run(&Method::plane(), &band(5.0), conforming(14.0, Features::Edges));
    let said = narrow.warnings().iter().find_map(|warning| match warning {
        Warning::NotMet { share, .. } => Some(*share),
        _ => None,
    });
    // one side of two, the stretches near the sides of the box left out
    assert!(said.is_some_and(|share| (0.3..0.7).contains(&share)), "{:?}", narrow.warnings());
    let wide = run(&Method::plane(), &band(20.0), conforming(6.0, Features::Edges));
    assert_eq!(wide.warnings(), []);
}

#[test]
fn flat_layers_of_labels_meet_the_sides_of_the_box() {
    // edges in a side cross a flat layer within roundings of the side, where Delaunay's predicates take no points
    for thickness in [1.0, 4.0] {
        let labels = image([24; 3], |p| match p[2] - 11.8 {
            above if above.abs() < 0.5 * thickness => 1.0,
            above => 1.0 + above.signum(),
        });
        let inputs = Inputs { labels: Some(&labels), ..Inputs::image(&labels) };
        let options = conforming(3.0, Features::Labels);
        let prepared = prepare(&Method::space(), inputs, options, &mut Silent).unwrap();
        let outcome = prepared.run(&mut Silent).unwrap();
        assert_eq!(outcome.mesh().validate(), Ok(()));
    }
}

#[test]
fn a_report_lists_features_as_tags_name_them_and_says_how_facets_keep_to_them() {
    let outcome = run(&Method::plane(), &cross(), conforming(7.0, Features::Dark));
    let report = outcome.report(&mut Silent).unwrap();
    let all = report.conformity.unwrap();
    let tags = outcome.tags().unwrap();
    assert_eq!(report.features.len(), 2);
    for feature in &report.features {
        let group = tags.facet_group(feature.name.as_deref().unwrap()).unwrap();
        assert_eq!((feature.facets, feature.kind.as_str()), (group.facets.len(), "dark"));
        let lengths = group.facets.iter().map(|facet| {
            let normal = outcome.world_mesh().facet_normal(facet);
            normal[0].hypot(normal[1])
        });
        assert!((feature.measure - lengths.sum::<f64>()).abs() < 1e-9);
        // straight lines, known to within some hundredths of a sample
        assert!(feature.distance.rms.unwrap() < 0.1 && feature.not_met_share < 0.03, "{feature:?}");
    }
    assert_eq!(all.precision, Some(1.0));
    assert!(all.distance.p95 <= Some(0.3) && all.cells_cut == 0, "{all:?}");
    assert!(all.measure > 140.0, "two lines across a box of 79 by 71");
}

#[test]
fn a_report_counts_the_cells_that_features_cut_and_the_places_not_met() {
    // a band whose sides are 5 apart: nearer than two thirds of d, so that one has facets and the other cuts cells
    let image = image([60, 50], |p| {
        let side = |at: f64| ((p[1] - at) / 1.2).tanh();
        0.5 * (side(22.1) - side(27.1))
    });
    let outcome = run(&Method::plane(), &image, conforming(14.0, Features::Edges));
    let report = outcome.report(&mut Silent).unwrap();
    let all = report.conformity.unwrap();
    assert_eq!(report.features.len(), 2);
    // each side is half of all, 59 long; places are known to 10 %
    assert!((0.3..0.7).contains(&all.not_met_share), "{all:?}");
    let not_met: f64 = report.features.iter().map(|feature| feature.not_met).sum();
    assert!((all.not_met - not_met).abs() < 1e-9 && (30.0..80.0).contains(&not_met), "{not_met}");
    assert!(all.cells_cut > 0 && !all.not_met_places.is_empty());
    for place in &all.not_met_places {
        let y = place.place[1];
        assert!((y - 22.1).abs().min((y - 27.1).abs()) < 0.5, "{place:?}");
        // 5 apart, two thirds of the d that would do
        let needed = place.distance_needed.unwrap();
        assert!((needed - 7.5).abs() < 0.6, "{place:?}");
    }
}

#[test]
fn a_mesh_that_does_not_conform_has_no_report_on_that() {
    let image = image([30, 24], |_| 7.0);
    let report =
        run(&Method::plane(), &image, conforming(5.0, Features::Edges)).report(&mut Silent);
    let report = report.unwrap();
    assert!(report.features.is_empty() && report.conformity.is_none());
}

#[test]
fn a_ball_of_labels_keeps_its_volume_and_its_interface_is_turned_one_way() {
    let (centre, radius) = ([14.3, 13.8, 14.1], 8.6);
    let grey = ball([29, 28, 29], centre, radius);
    let labels = grey.samples().to_f32().iter().map(|&grey| u8::from(grey > 0.5)).collect();
    let labels = Image::new(*grey.frame(), Samples::U8(labels)).unwrap();
    let inputs = Inputs { labels: Some(&labels), ..Inputs::image(&labels) };
    let options = conforming(3.0, Features::Labels);
    let options = MeshOptions {
        improve: ImproveOptions::for_dimension(3), // clean enough to conform unasked
        ..options
    };
    let prepared = prepare(&Method::space(), inputs, options, &mut Silent).unwrap();
    let outcome = prepared.run(&mut Silent).unwrap();
    let mesh = outcome.mesh();
    let of_cells = outcome.labels().unwrap();
    let inside = mesh.simplices().zip(of_cells).filter(|(_, label)| **label == 1);
    let volume: f64 = inside.map(|(simplex, _)| simplex.measure()).sum();
    let exact = 4.0 / 3.0 * std::f64::consts::PI * f64::powi(radius, 3);
    // a sphere of triangles of edges d has 0.38 (d/R)² = 4.6 % less
    let inscribed = 1.0 - 0.38 * f64::powi(3.0 / radius, 2);
    assert!((volume / exact / inscribed - 1.0).abs() < 0.015, "{}", volume / exact);
    let tags = outcome.tags().unwrap();
    let interface = tags.facet_group("interface-0-1").unwrap();
    // by Gauss's theorem: a closed surface, its normals from label 0 outside to label 1 inside
    let parts = interface.facets.iter().map(|facet| {
        let inward = crate::geometry::difference(&centre, &mesh.points()[facet[0] as usize]);
        crate::geometry::dot(&mesh.facet_normal(facet), &inward) / 3.0
    });
    assert!((parts.sum::<f64>() / volume - 1.0).abs() < 1e-9);
}
