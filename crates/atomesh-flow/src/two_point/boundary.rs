//! Conditions on the faces on sides of the box.

use atomesh::geometry::{Point, difference, distance_squared};
use atomesh::mesh::{BoundaryConnection, PolyMesh, boundary_connections};

use crate::grid::{FlowGrid, facet_integral};
use crate::problem::{Condition, Value};
use crate::setting::Setting;

/// Distance from a side, as a share of the cell's width, up to which a site lies on the side.
const ON_SIDE: f64 = 1e-11;

/// The condition on a face on a side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Side {
    /// The flow into the box; 0 without a condition.
    Inflow(f64),
    /// The pressure at the foot of the perpendicular from the site, and the flow per unit of pressure difference.
    Pressure { value: f64, transmissibility: f64 },
    /// The pressure of the site itself, which lies on the face.
    Fixed,
}

/// The conditions on all sides.
pub(super) struct Sides {
    /// Of each face on a side, in the mesh's order, from the first face that is not between two cells.
    pub faces: Vec<Side>,
    /// The pressure of each cell whose site lies on a side of given pressure.
    pub fixed: Vec<Option<f64>>,
}

/// Finds the conditions. A cell whose site lies on two sides of given pressure obeys the one named last.
pub(super) fn sides<const D: usize>(
    cells: &PolyMesh<D>,
    grid: &FlowGrid<D>,
    setting: &Setting<'_, D>,
) -> Sides {
    let mut fixed = vec![None; cells.cell_count()];
    let mut named = vec![0; cells.cell_count()];
    let inner = cells.inner_face_count();
    let mut faces = Vec::with_capacity(cells.face_count() - inner);
    for (at, own) in boundary_connections(cells).iter().enumerate() {
        let face = inner + at;
        let cell = own.cell as usize;
        let site = &cells.centers()[cell];
        let width = cells.measures()[cell].powf(1.0 / D as f64);
        faces.push(match setting.condition(face) {
            None => Side::Inflow(0.0),
            Some(Condition::Flux(value)) => Side::Inflow(facet_integral(grid, face, &value)),
            Some(Condition::Pressure(value)) if own.distance <= ON_SIDE * width => {
                let number = setting.boundary(face);
                if number >= named[cell] {
                    named[cell] = number;
                    fixed[cell] = Some(value.at(site));
                }
                Side::Fixed
            }
            Some(Condition::Pressure(value)) => {
                let k = setting.permeability().scalar(cell).expect("tensors were refused");
                let value = value_at_foot(cells, face, own, &value);
                Side::Pressure { value, transmissibility: k * own.area / own.distance }
            }
        });
    }
    Sides { faces, fixed }
}

/// The value at the foot of the perpendicular from the site, extrapolated from the face: the foot may lie beyond it, in
/// other rock. Taken at the centroid and at a place within the face on the way to the foot, so exact for linear
/// values.
fn value_at_foot<const D: usize>(
    cells: &PolyMesh<D>,
    face: usize,
    own: &BoundaryConnection<D>,
    value: &Value<'_, D>,
) -> f64 {
    let site = &cells.centers()[own.cell as usize];
    let foot: Point<D> = std::array::from_fn(|k| site[k] + own.distance * own.normal[k]);
    let way = difference(&foot, &own.centroid);
    let away = distance_squared(&foot, &own.centroid).sqrt();
    let corners = cells.face(face).iter().map(|&corner| &cells.points()[corner as usize]);
    let radius = corners
        .map(|corner| distance_squared(corner, &own.centroid))
        .fold(0.0_f64, f64::max)
        .sqrt();
    // a disk of this radius about its centroid lies in a convex face
    let within = if D == 2 { radius } else { own.area / (6.0 * radius) };
    if away <= within {
        return value.at(&foot);
    }
    let share = within / away;
    let place = std::array::from_fn(|k| own.centroid[k] + share * way[k]);
    let middle = value.at(&own.centroid);
    middle + (value.at(&place) - middle) / share
}
