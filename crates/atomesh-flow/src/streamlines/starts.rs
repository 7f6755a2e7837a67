//! Where lines start: around wells that bring something in, and on the boundary where something flows in.

use std::f64::consts::TAU;

use atomesh::geometry::{Point, Simplex, difference, dot};

use super::TraceOptions;
use super::follow::WellCells;
use super::pieces::{CENTROID, Field};
use super::simplex::Corners;
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
    /// The well's place, the cell between it and the facet, and the time through that cell.
    pub well: Option<(Point<D>, u32, f64)>,
}

/// A part of a facet through which something flows in.
struct Patch<const D: usize> {
    facet: u32,
    into: Option<u32>,
    corners: [u32; D],
    points: [Point<D>; D],
    flux: f64,
    from: Option<usize>,
    well: Option<(Point<D>, u32, f64)>,
}

/// The starts, each for the same flow: patches follow each other around wells and boundary, and a start stands in the
/// middle of its share of them.
pub fn starts<const D: usize>(
    field: &Field<'_, D>,
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

/// The parts of a facet with their shares of it.
fn parts<const D: usize>(field: &Field<'_, D>, facet: u32) -> Vec<([u32; D], [Point<D>; D], f64)> {
    let places = |points: &[Point<D>], corners: [u32; D]| corners.map(|c| points[c as usize]);
    if let Some(mesh) = field.grid.mesh() {
        let corners = *field.grid.facet_corners(facet as usize).expect("facets of a mesh");
        return vec![(corners, places(mesh.points(), corners), 1.0)];
    }
    let mesh = field.grid.cells().expect("cells of a grid are Voronoi cells or simplices");
    let own = &field.grid.facets()[facet as usize];
    let first = field.grid.centroids()[own.cell as usize];
    let part = |corners: [u32; D]| {
        let others = places(mesh.points(), corners);
        (corners, others, Simplex { first, others }.measure().abs())
    };
    let mut parts: Vec<_> = mesh.face_parts(facet as usize).map(part).collect();
    let whole: f64 = parts.iter().map(|part| part.2).sum();
    parts.iter_mut().for_each(|part| part.2 = if whole > 0.0 { part.2 / whole } else { 0.0 });
    parts
}

fn around_well<const D: usize>(
    field: &Field<'_, D>,
    cells: &[u32],
    well: usize,
    place: Point<D>,
    options: &TraceOptions<'_>,
) -> Vec<Patch<D>> {
    let mut patches = Vec::new();
    if field.solution.wells[well].rate <= 0.0 {
        return patches;
    }
    let around = WellCells::new(field, cells, &options.porosity);
    for &cell in cells {
        for &facet in field.grid.facets_of(cell as usize) {
            let into = field.beyond(cell as usize, facet as usize);
            let flux = field.out_of(cell as usize, facet as usize);
            let inner = into.is_some_and(|other| cells.binary_search(&other).is_ok());
            if inner || flux <= 0.0 {
                continue;
            }
            let lead = Some((place, cell, around.pores / around.outward));
            patches.extend(parts(field, facet).into_iter().map(|(corners, points, share)| {
                let (flux, from) = (flux * share, Some(well));
                Patch { facet, into, corners, points, flux, from, well: lead }
            }));
        }
    }
    patches
}

fn on_boundary<const D: usize>(field: &Field<'_, D>) -> Vec<Patch<D>> {
    let mut patches = Vec::new();
    for (number, facet) in field.grid.facets().iter().enumerate() {
        let flux = -field.fluxes[number];
        if facet.neighbour.is_some() || flux <= 0.0 {
            continue;
        }
        let (facet, into) = (number as u32, Some(facet.cell));
        patches.extend(parts(field, facet).into_iter().map(|(corners, points, share)| {
            let flux = flux * share;
            Patch { facet, into, corners, points, flux, from: None, well: None }
        }));
    }
    patches
}

/// The middle of the cells' centroids.
fn middle<const D: usize>(field: &Field<'_, D>) -> Point<D> {
    let centroids = field.grid.centroids();
    std::array::from_fn(|axis| {
        centroids.iter().map(|c| c[axis]).sum::<f64>() / centroids.len().max(1) as f64
    })
}

/// In the plane counter-clockwise about a centre, also within a patch, from the widest gap on; in space as they are.
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
    /// The start at a share of the patch; across it, in space, places follow the golden ratio, which fills evenly.
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
        let (facet, into, from, well) = (self.facet, self.into, self.from, self.well);
        Start { place, numbers, weights, facet, into, from, well }
    }
}
