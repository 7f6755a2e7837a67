//! Where lines start: around wells with inflow, and on the boundary where there is inflow.

use std::f64::consts::TAU;

use atomesh::geometry::{Point, Simplex, difference, dot};

use super::options::TraceOptions;
use super::pieces::{CENTROID, FluxField};
use super::simplex::Corners;
use super::wells::WellExchange;
use crate::setting::Setting;

/// The start of a line, on a facet.
pub struct Start<const D: usize> {
    pub place: Point<D>,
    /// The place by barycentric coordinates of numbered corners.
    pub numbers: [u32; 4],
    pub weights: Corners,
    /// The facet, and the cell that the line enters.
    pub facet: u32,
    pub into: Option<u32>,
    /// The well's number.
    pub from: Option<usize>,
    /// From the well to the facet, if the line comes from one.
    pub lead: Option<Lead<D>>,
}

/// The straight way from a well to the boundary of its cells.
#[derive(Clone, Copy)]
pub struct Lead<const D: usize> {
    /// The well's place.
    pub place: Point<D>,
    /// The cell between the well and the boundary.
    pub cell: u32,
    /// The time through that cell.
    pub time: f64,
}

/// A part of a facet with inflow.
struct Patch<const D: usize> {
    facet: u32,
    into: Option<u32>,
    corners: [u32; D],
    points: [Point<D>; D],
    flux: f64,
    from: Option<usize>,
    lead: Option<Lead<D>>,
}

/// A simplex of a facet, with its share of it.
struct FacetPart<const D: usize> {
    corners: [u32; D],
    points: [Point<D>; D],
    share: f64,
}

/// The starts, each for the same flow. Patches are put in a row, around each well and then around the boundary; the row
/// is divided into equal flows, and a start stands in the middle of each.
pub fn starts<const D: usize>(
    field: &FluxField<'_, D>,
    setting: &Setting<'_, D>,
    options: &TraceOptions<'_>,
) -> Vec<Start<D>> {
    let mut patches = Vec::new();
    for placed in setting.wells() {
        let place = setting.problem().wells[placed.well].place;
        let mut own = around_well(field, &placed.cells, placed.well, place, options);
        order_around(&mut own, &place);
        patches.extend(own);
    }
    let mut own = on_boundary(field);
    order_around(&mut own, &middle(field));
    patches.extend(own);
    let total: f64 = patches.iter().map(|patch| patch.flux).sum();
    let mut starts = Vec::with_capacity(options.count);
    let mut before = 0.0;
    let mut patches = patches.iter().peekable();
    for number in 0..options.count {
        let target = (number as f64 + 0.5) / options.count as f64 * total;
        while let Some(patch) = patches.peek() {
            if before + patch.flux > target {
                starts.push(patch.start((target - before) / patch.flux, number));
                break;
            }
            before += patch.flux;
            patches.next();
        }
    }
    starts
}

/// The simplices of a facet.
fn parts<const D: usize>(field: &FluxField<'_, D>, facet: u32) -> Vec<FacetPart<D>> {
    let places = |points: &[Point<D>], corners: [u32; D]| corners.map(|c| points[c as usize]);
    if let Some(mesh) = field.grid.mesh() {
        let corners = *field.grid.facet_corners(facet as usize).expect("facets of a mesh");
        return vec![FacetPart { corners, points: places(mesh.points(), corners), share: 1.0 }];
    }
    let mesh = field.grid.cells().expect("cells of a grid are Voronoi cells or simplices");
    let own = &field.grid.facets()[facet as usize];
    let first = field.grid.centroids()[own.cell as usize];
    let part = |corners: [u32; D]| {
        let points = places(mesh.points(), corners);
        let share = Simplex { first, others: points }.measure().abs();
        FacetPart { corners, points, share }
    };
    let mut parts: Vec<_> = mesh.face_parts(facet as usize).map(part).collect();
    let whole: f64 = parts.iter().map(|part| part.share).sum();
    let share = |measure: f64| if whole > 0.0 { measure / whole } else { 0.0 };
    parts.iter_mut().for_each(|part| part.share = share(part.share));
    parts
}

fn around_well<const D: usize>(
    field: &FluxField<'_, D>,
    cells: &[u32],
    well: usize,
    place: Point<D>,
    options: &TraceOptions<'_>,
) -> Vec<Patch<D>> {
    let mut patches = Vec::new();
    if field.solution.wells[well].rate <= 0.0 {
        return patches;
    }
    let around = WellExchange::new(field, cells, &options.porosity);
    for &cell in cells {
        for &facet in field.grid.facets_of(cell as usize) {
            let into = field.beyond(cell as usize, facet as usize);
            let flux = field.out_of(cell as usize, facet as usize);
            let inner = into.is_some_and(|other| cells.binary_search(&other).is_ok());
            if inner || flux <= 0.0 {
                continue;
            }
            let lead = Some(Lead { place, cell, time: around.pores / around.outward });
            patches.extend(parts(field, facet).into_iter().map(|part| {
                let FacetPart { corners, points, share } = part;
                Patch { facet, into, corners, points, flux: flux * share, from: Some(well), lead }
            }));
        }
    }
    patches
}

fn on_boundary<const D: usize>(field: &FluxField<'_, D>) -> Vec<Patch<D>> {
    let mut patches = Vec::new();
    for (number, facet) in field.grid.facets().iter().enumerate() {
        let flux = -field.fluxes[number];
        if facet.neighbour.is_some() || flux <= 0.0 {
            continue;
        }
        let (facet, into) = (number as u32, Some(facet.cell));
        patches.extend(parts(field, facet).into_iter().map(|part| {
            let FacetPart { corners, points, share } = part;
            Patch { facet, into, corners, points, flux: flux * share, from: None, lead: None }
        }));
    }
    patches
}

/// The middle of the cells' centroids.
fn middle<const D: usize>(field: &FluxField<'_, D>) -> Point<D> {
    let centroids = field.grid.centroids();
    std::array::from_fn(|axis| {
        centroids.iter().map(|c| c[axis]).sum::<f64>() / centroids.len().max(1) as f64
    })
}

/// In the plane, orders patches and their corners counter-clockwise about a centre, from the widest gap on; in space the
/// order stays.
fn order_around<const D: usize>(patches: &mut [Patch<D>], centre: &Point<D>) {
    if D != 2 {
        return;
    }
    let angle = |patch: &Patch<D>| {
        let way: Point<D> = std::array::from_fn(|axis| {
            patch.points.iter().map(|p| p[axis]).sum::<f64>() / D as f64 - centre[axis]
        });
        way[1].atan2(way[0])
    };
    patches.sort_by(|a, b| angle(a).total_cmp(&angle(b)).then(a.facet.cmp(&b.facet)));
    let gap = |at: usize| {
        let before = if at == 0 {
            angle(&patches[patches.len() - 1]) - TAU
        } else {
            angle(&patches[at - 1])
        };
        angle(&patches[at]) - before
    };
    let widest = (0..patches.len()).max_by(|&a, &b| gap(a).total_cmp(&gap(b)).then(b.cmp(&a)));
    patches.rotate_left(widest.unwrap_or(0));
    for patch in patches {
        let [a, b] = [0, D - 1].map(|end| difference(&patch.points[end], centre));
        if a[0] * b[1] - a[1] * b[0] < 0.0 {
            patch.points.reverse();
            patch.corners.reverse();
        }
    }
}

impl<const D: usize> Patch<D> {
    /// The start at a share of the patch. In space the places across it follow the golden ratio, which fills evenly.
    fn start(&self, share: f64, number: usize) -> Start<D> {
        let share = share.clamp(0.0, 1.0);
        let mut own = [0.0; D];
        if D == 2 {
            (own[0], own[1]) = (1.0 - share, share);
        } else {
            let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
            let (far, along) = (share.sqrt(), (golden * (number as f64 + 0.5)).fract());
            (own[0], own[1], own[2]) = (1.0 - far, far * (1.0 - along), far * along);
        }
        let (mut numbers, mut weights) = ([CENTROID; 4], [0.0; 4]);
        numbers[1..=D].copy_from_slice(&self.corners);
        weights[1..=D].copy_from_slice(&own);
        let place = std::array::from_fn(|axis| {
            let axis_of: Point<D> = self.points.map(|point| point[axis]);
            dot(&axis_of, &own)
        });
        let Self { facet, into, from, lead, .. } = *self;
        Start { place, numbers, weights, facet, into, from, lead }
    }
}
