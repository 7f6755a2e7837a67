//! What is seen of parts and regions: in the plane, on slices of a volume, and regions' surfaces in space.

use std::collections::{BTreeMap, HashMap};

use atomesh::geometry::Point;
use atomesh::image::Grid;
use atomesh::region::closed_surface;
use atomesh::run::Outcome;

use crate::protocol::share;

/// Stands for no cell beyond the hull.
const NONE: u32 = u32::MAX;

/// Added to the number of a region, among those of features.
pub const REGION: u16 = 1 << 15;

/// The regions and the parts of the cells.
#[derive(Debug)]
pub struct Divisions<'a> {
    /// The region of each cell, 0 for none; empty if there are none.
    pub regions: &'a [i32],
    /// The part of each cell; empty if they are not shown.
    pub parts: &'a [i32],
}

impl Divisions<'_> {
    fn region(&self, cell: u32) -> i32 {
        self.regions.get(cell as usize).copied().unwrap_or(0)
    }

    fn part(&self, cell: u32) -> i32 {
        self.parts.get(cell as usize).copied().unwrap_or(0)
    }
}

/// What lies between two cells, where it is seen: a segment between two places.
struct Segment {
    places: [u32; 2],
    /// The cells on its sides; [`NONE`] beyond the hull.
    cells: [u32; 2],
}

/// The regions as areas and the borders of parts and regions, in the plane, or where a plane cuts the cells. Eight u32:
/// how many places, triangles, edges between parts, edges between regions, and groups of triangles, and three times 0; then
/// the places as two u16 each, the triangles and edges as places' numbers, and of each group the region and how many
/// triangles it has; all little-endian. `cut` is an axis and a level along it.
pub fn areas<const D: usize>(
    outcome: &Outcome<D>,
    divisions: &Divisions<'_>,
    cut: Option<(usize, f64)>,
    (grid, axes): (&Grid<D>, [usize; 2]),
) -> Vec<u8> {
    let (places, segments) = segments(outcome, cut);
    let mut apexes: HashMap<u32, u32> = HashMap::new();
    let mut triangles: BTreeMap<i32, Vec<[u32; 3]>> = BTreeMap::new();
    let (mut parts, mut regions) = (Vec::new(), Vec::new());
    for Segment { places: [a, b], cells } in &segments {
        for &cell in cells.iter().filter(|cell| **cell != NONE) {
            let region = divisions.region(cell);
            // a section is convex: triangles from one of its corners fill it
            let apex = *apexes.entry(cell).or_insert(*a);
            if region > 0 && apex != *a && apex != *b {
                triangles.entry(region).or_default().push([apex, *a, *b]);
            }
        }
        let [one, other] = *cells;
        if one == NONE || other == NONE {
            continue;
        }
        if divisions.part(one) != divisions.part(other) {
            parts.push([*a, *b]);
        }
        if divisions.region(one) != divisions.region(other) {
            regions.push([*a, *b]);
        }
    }
    let count = triangles.values().map(Vec::len).sum();
    let head = [places.len(), count, parts.len(), regions.len(), triangles.len(), 0, 0, 0];
    let mut bytes: Vec<u8> = head.iter().flat_map(|n| (*n as u32).to_le_bytes()).collect();
    for p in &places {
        bytes.extend(axes.iter().flat_map(|&k| share(p[k], grid, k).to_le_bytes()));
    }
    let corners = triangles.values().flatten().flatten();
    let ends = parts.iter().chain(&regions).flatten();
    let groups = triangles.iter().flat_map(|(region, own)| [*region as u32, own.len() as u32]);
    let numbers = corners.chain(ends).copied().chain(groups);
    bytes.extend(numbers.flat_map(u32::to_le_bytes));
    bytes
}

/// What is seen of the facets of all cells, and the places that these have.
fn segments<const D: usize>(
    outcome: &Outcome<D>,
    cut: Option<(usize, f64)>,
) -> (Vec<Point<D>>, Vec<Segment>) {
    let points = outcome.cells().map_or(outcome.mesh().points(), |cells| cells.points());
    let mut section = Section { points, cut, places: Vec::new(), numbers: HashMap::new() };
    let mut segments = Vec::new();
    let mut see = |corners: &[u32], cells: [u32; 2]| {
        if let Some(places) = section.of(corners) {
            segments.push(Segment { places, cells });
        }
    };
    match outcome.cells() {
        Some(cells) => {
            for face in 0..cells.face_count() {
                let beyond = cells.neighbours().get(face).copied().unwrap_or(NONE);
                see(cells.face(face), [cells.owners()[face], beyond]);
            }
        }
        None => {
            for facet in outcome.mesh().facets() {
                see(&facet.corners, [facet.cell, facet.neighbour.unwrap_or(NONE)]);
            }
        }
    }
    match cut {
        Some(_) => (section.places, segments),
        None => (points.to_vec(), segments),
    }
}

/// Where a plane cuts edges.
struct Section<'a, const D: usize> {
    points: &'a [Point<D>],
    cut: Option<(usize, f64)>,
    places: Vec<Point<D>>,
    numbers: HashMap<[u32; 2], u32>,
}

impl<const D: usize> Section<'_, D> {
    /// The ends of what is seen of a convex facet, a loop of corners; in the plane it is seen whole.
    fn of(&mut self, corners: &[u32]) -> Option<[u32; 2]> {
        let Some((axis, level)) = self.cut else { return Some([corners[0], *corners.get(1)?]) };
        let points = self.points;
        let is_below = |corner: u32| points[corner as usize][axis] < level;
        let next = corners.iter().cycle().skip(1);
        let mut ends =
            corners.iter().zip(next).filter_map(|(&a, &b)| match (is_below(a), is_below(b)) {
                (true, false) => Some([a, b]),
                (false, true) => Some([b, a]),
                _ => None,
            });
        let (first, second) = (ends.next()?, ends.next()?);
        Some([self.place(first, axis, level), self.place(second, axis, level)])
    }

    fn place(&mut self, [below, above]: [u32; 2], axis: usize, level: f64) -> u32 {
        let Self { points, places, numbers, .. } = self;
        *numbers.entry([below, above]).or_insert_with(|| {
            let (a, b) = (&points[below as usize], &points[above as usize]);
            let t = (level - a[axis]) / (b[axis] - a[axis]);
            places.push(std::array::from_fn(|k| a[k] + t * (b[k] - a[k])));
            places.len() as u32 - 1
        })
    }
}

/// The triangles of the regions' surfaces, each with [`REGION`] and the region's number.
pub fn surfaces(outcome: &Outcome<3>, regions: &[i32]) -> Vec<(u16, [Point<3>; 3])> {
    let mut ids = regions.to_vec();
    ids.sort_unstable();
    ids.dedup();
    ids.retain(|region| *region > 0);
    let number = |region: i32| REGION | region as u16;
    let mut found = Vec::new();
    let Some(cells) = outcome.cells() else {
        let points = outcome.mesh().points();
        for region in ids {
            let surface = closed_surface(outcome.mesh(), regions, region);
            let triangles = surface.iter().map(|facet| facet.map(|c| points[c as usize]));
            found.extend(triangles.map(|triangle| (number(region), triangle)));
        }
        return found;
    };
    for face in 0..cells.face_count() {
        let own = regions[cells.owners()[face] as usize];
        let beyond = cells.neighbours().get(face).map_or(0, |cell| regions[*cell as usize]);
        for region in [own, beyond].into_iter().filter(|r| *r > 0 && own != beyond) {
            found.extend(cells.face_simplices(face).map(|triangle| (number(region), triangle)));
        }
    }
    found
}
