//! Voronoi (PEBI) meshes: from sites in a box to the cells of points nearest to each, clipped to the box.
//!
//! Assumes sites inside the box or on its boundary, no two nearer than [`LEAST_GAP`] of the mean distance. Sites on the
//! boundary stay sites: the box cuts their cells, so that they lie on one side of them, half a cell at a side, a quarter
//! at an edge. A flow simulation then has an unknown on the boundary itself.
//!
//! Degenerate sites are the normal case. On a perfect crystal many cells of Delaunay's mesh share one circumsphere, and
//! rounding moves their circumcentres apart or, for flat cells, anywhere. So nothing is cut cell by cell. Each step
//! decides once for all cells that share what it decides on, and the complex is closed whatever the rounding:
//!
//! 1. `dual`: Delaunay's mesh of the sites and of a few *ghosts* far outside, which make every cell bounded and touch
//!    nothing inside the box. One loop of circumcentres for each face (3-D), around an edge, or each cell (2-D), around a
//!    site. Neighbouring cells with one centre are one vertex. If the far corner of a cell lies on the sphere of a
//!    neighbour of better shape, to the tolerance by which that moves a bisecting plane, the cell takes the neighbour's
//!    centre: the worse its own centre is conditioned, the less it matters where on its axis it is.
//! 2. `clip`: the loops are cut by one side of the box after another. An edge is cut in one place, shared by all its
//!    loops. In 3-D, what a cell's faces leave open on the side is the face that closes it.
//! 3. `weld`: the ends of edges shorter than the tolerance are merged, for all faces at once; faces of fewer than three
//!    corners vanish; points and faces are numbered.
//!
//! The tolerance is 10⁻¹¹ of the mean distance of sites (or 64 roundings of a coordinate, if that is more), so faces are
//! planar to some 10⁻¹⁰ of it. Two other routes were worse: cutting each cell by half-spaces makes every cell right by
//! itself, but neighbours may disagree; mirrored sites do not serve sites on the box itself. Cost: that of connecting the
//! sites, and about as much again. The result is the same at any thread count.

mod clip;
mod dual;
#[cfg(test)]
mod tests;
mod weld;

use crate::geometry::{Bounds, Point, distance_squared};
use crate::mesh::{ConnectError, Delaunay, Mesh, PolyFault, PolyMesh, mean_distance};
use crate::watch::{Cancelled, Phase, Watch, check};

/// The tolerance as a share of the mean distance of sites.
const TOLERANCE: f64 = 1e-11;

/// The least distance of two sites, as a share of the mean distance (V/n)^(1/D): rounding turns the bisecting plane of
/// nearer ones.
pub const LEAST_GAP: f64 = 1e-6;

/// Why there are no cells.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VoronoiError {
    /// No sites at all.
    #[error("there are no sites; expected one or more")]
    NoSites,
    /// The box has no inside.
    #[error("the box extends {extent} along axis {axis}; expected a finite length above 0")]
    Bounds {
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
        /// The extent found.
        extent: f64,
    },
    /// A site lies outside the box.
    #[error("site {site} at {place:?} lies outside the box")]
    Outside {
        /// The site's index.
        site: usize,
        /// Its coordinates.
        place: Vec<f64>,
    },
    /// Two sites are too near each other for their cells to be told apart.
    #[error("sites {} and {} are {distance:e} apart; expected {least:e} or more", .sites[0], .sites[1])]
    Close {
        /// The sites, the lower first.
        sites: [usize; 2],
        /// Their distance.
        distance: f64,
        /// The least distance allowed.
        least: f64,
    },
    /// The sites could not be connected.
    #[error(transparent)]
    Connect(ConnectError),
    /// The cells do not make a mesh.
    #[error(transparent)]
    Fault(#[from] PolyFault),
    /// The caller ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<ConnectError> for VoronoiError {
    fn from(error: ConnectError) -> Self {
        match error {
            ConnectError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Connect(other),
        }
    }
}

/// The Voronoi cells of `sites` within `bounds`: cell i holds the points of the box that are nearest to site i.
///
/// ```
/// use atomesh::geometry::Bounds;
/// use atomesh::mesh::Delaunay;
/// use atomesh::voronoi::voronoi;
/// use atomesh::watch::Silent;
///
/// let bounds = Bounds { min: [0.0, 0.0], max: [4.0, 2.0] };
/// let cells = voronoi(&Delaunay::<2>::new(), &[[1.0, 1.0], [3.0, 1.0]], bounds, &mut Silent)?;
/// assert_eq!(cells.measures(), [4.0, 4.0]);
/// assert_eq!(cells.face_count(), 7);
/// # Ok::<(), atomesh::voronoi::VoronoiError>(())
/// ```
///
/// Reports [`Phase::Connect`] to `watch`.
///
/// # Errors
/// [`VoronoiError`] if a site is outside the box, two are too near each other, they cannot be connected, or
/// `watch` ends the work.
pub fn voronoi<const D: usize>(
    delaunay: &Delaunay<D>,
    sites: &[Point<D>],
    bounds: Bounds<D>,
    watch: &mut dyn Watch,
) -> Result<PolyMesh<D>, VoronoiError> {
    check_sites(sites, &bounds)?;
    let spacing = mean_distance(&bounds, sites.len());
    let largest = (0..D).fold(0.0_f64, |m, k| m.max(bounds.min[k].abs()).max(bounds.max[k].abs()));
    let tolerance = (TOLERANCE * spacing).max(64.0 * f64::EPSILON * largest);
    let domain = dual::Domain { bounds, tolerance, least_gap: LEAST_GAP * spacing };
    let dual = dual::dual(delaunay, sites, &domain, watch)?;
    check(watch, Phase::Connect, 1.0, None)?;
    let cut = clip::clip(dual, &domain);
    check(watch, Phase::Connect, 1.0, None)?;
    Ok(weld::weld(cut, sites, &domain)?)
}

/// The points of a Delaunay mesh that may be sites in a box: of two nearer to each other than [`LEAST_GAP`] allows, such
/// as atoms drawn to one place by the image alone, only the first. Nearest points share an edge of the mesh, so only
/// edges are checked. Cost: O(cells).
pub fn sites_apart<const D: usize>(mesh: &Mesh<D>, bounds: &Bounds<D>) -> Vec<Point<D>> {
    let points = mesh.points();
    // twice the gap: without some sites, the mean distance of the others is a little more
    let least = 2.0 * LEAST_GAP * mean_distance(bounds, points.len());
    let mut is_site = vec![true; points.len()];
    for cell in mesh.cells() {
        for (k, &a) in cell.iter().enumerate() {
            for &b in &cell[..k] {
                if distance_squared(&points[a as usize], &points[b as usize]) < least * least {
                    is_site[a.max(b) as usize] = false;
                }
            }
        }
    }
    points.iter().zip(is_site).filter(|(_, is_site)| *is_site).map(|(p, _)| *p).collect()
}

fn check_sites<const D: usize>(sites: &[Point<D>], bounds: &Bounds<D>) -> Result<(), VoronoiError> {
    if sites.is_empty() {
        return Err(VoronoiError::NoSites);
    }
    for (axis, &extent) in bounds.extent().iter().enumerate() {
        if !(extent.is_finite() && extent > 0.0) {
            return Err(VoronoiError::Bounds { axis, extent });
        }
    }
    match sites.iter().position(|p| !bounds.contains(p)) {
        Some(site) => Err(VoronoiError::Outside { site, place: sites[site].to_vec() }),
        None => Ok(()),
    }
}
