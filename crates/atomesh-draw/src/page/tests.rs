//! The page of a small mesh: what it holds, and that it needs nothing else.

use atomesh::image::{Frame, Grid, Image, Samples};
use atomesh::measure::{Histogram, WantedSize};
use atomesh::mesh::Mesh;
use atomesh::run::MeshReport;
use atomesh::watch::Silent;

use super::chart::Chart;
use super::*;
use crate::{Style, draw_triangles};

fn square() -> Mesh<2> {
    let points = vec![[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]];
    Mesh::new(points, vec![0, 1, 2, 0, 2, 3]).unwrap()
}

fn page_text() -> String {
    let grid = Grid { shape: [9, 9], step: [1.0; 2] };
    let size = WantedSize::from(8.0);
    let report = MeshReport::new(&square(), &grid, &[0.0; 81], size, &mut Silent).unwrap();
    let image = Image::new(Frame::new([9, 9]).unwrap(), Samples::U8((0..81).collect())).unwrap();
    let picture = draw_triangles(&image, &square(), &Style::default()).unwrap();
    let page = ReportPage {
        title: "a<b & \"c\".vtu".into(),
        subtitle: "two cells".into(),
        dimension: 2,
        report: &report,
        pictures: vec![("the <mesh>".into(), picture)],
        tables: vec![
            ("Options".into(), vec![("size".into(), "8 < 9".into())]),
            ("Empty".into(), vec![]),
        ],
        warnings: vec!["odd & rare".into()],
    };
    page.html().unwrap()
}

/// Every element that is opened is closed, in order.
fn check_elements(html: &str) {
    let void = ["meta", "img", "!DOCTYPE", "rect/", "path/"];
    let mut open: Vec<&str> = Vec::new();
    let body = html.split_once("</style>").unwrap();
    for part in [body.0.split_once("<style>").unwrap().0, body.1] {
        for tag in part.split('<').skip(1) {
            let inner = tag.split_once('>').expect("every tag ends").0;
            let name = inner.split([' ', '\n']).next().unwrap();
            if let Some(name) = name.strip_prefix('/') {
                if name != "style" {
                    assert_eq!(open.pop(), Some(name));
                }
            } else if !inner.ends_with('/') && !void.contains(&name) {
                open.push(name);
            }
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn the_page_is_whole_and_needs_nothing_else() {
    let html = page_text();
    check_elements(&html);
    // namespaces of SVG are names; they stand in the embedded pictures, which are base64
    for outside in ["http:", "https:", "src=\"/", "url(", "@import", "<script", "<link"] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(html.contains("<title>a&lt;b &amp; &quot;c&quot;.vtu</title>"));
    assert!(html.contains("odd &amp; rare") && html.contains("8 &lt; 9"));
    assert!(!html.contains("Empty") && html.contains("data:image/svg+xml;base64,"));
    assert!(html.contains("prefers-color-scheme: dark") && html.contains("@media print"));
    // four histograms; no features, so no recall among the key figures
    assert_eq!(html.matches("<svg").count(), 4);
    assert!(!html.contains("recall of features") && html.contains("least angle"));
    assert_eq!(html, page_text());
}

#[test]
fn bars_stand_for_counts_and_only_what_holds_anything_is_shown() {
    let histogram = Histogram { width: 0.1, counts: vec![0, 0, 0, 1, 4, 0, 2, 0, 0, 0] };
    let chart =
        Chart { title: "t", of: "cells", unit: "", histogram: &histogram, mark: None }.svg();
    assert_eq!(chart.matches("class=\"bar\"").count(), 3);
    // bars 2 to 7 share 354 pixels
    assert!(chart.contains("x=\"67.50\" y=\"125.50\" width=\"58.00\" height=\"30.50\""), "{chart}");
    assert!(chart.contains("0.4 to 0.5: 4 (57.14 %)"));
    let none = Histogram { width: 1.0, counts: vec![0; 5] };
    assert_eq!(Chart { title: "t", of: "x", unit: "", histogram: &none, mark: None }.svg(), "");
}
