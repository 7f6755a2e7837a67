//! The values of a field as MSH lists them: one for each element, in the file's order.
//!
//! Gmsh takes values by the numbers of elements and would do with those of cells. meshio takes them by the order
//! of all elements, and refuses a list that does not reach them all. So facets and points have values too: that of the cell
//! behind them, which Gmsh then shows on them, and which leaves the range of a field as it is.

use std::iter::repeat_n;

use super::super::behind::cell_behind;
use super::super::cell_fields::VectorField;
use super::super::data::MeshData;
use super::super::field::{Field, Values};
use super::super::format::MshVersion;
use super::super::standing::{Standing, turned};
use super::entities::Entities;

/// The place of a value that is not known.
const NOWHERE: u32 = u32::MAX;

/// A named number or vector for each point or cell.
pub(super) struct Quantity<'a> {
    pub name: &'a str,
    /// How many numbers a value has: 1 or 3.
    pub components: usize,
    numbers: Numbers<'a>,
}

enum Numbers<'a> {
    Scalars(Values<'a>),
    Vectors { all: &'a [f64], axes: usize, standing: Option<&'a Standing> },
}

impl<'a> Quantity<'a> {
    pub fn numbers(field: &Field<'a>) -> Self {
        let numbers = Numbers::Scalars(field.values());
        Self { name: field.name(), components: 1, numbers }
    }

    /// Vectors have three components, in the plane of flat meshes.
    pub fn vectors<const D: usize>(
        field: &VectorField<'a, D>,
        standing: Option<&'a Standing>,
    ) -> Self {
        let numbers = Numbers::Vectors { all: field.vectors().as_flattened(), axes: D, standing };
        Self { name: field.name(), components: 3, numbers }
    }

    /// Component `k` of the value at a place; NaN if it is not known.
    pub fn value(&self, place: u32, k: usize) -> f64 {
        match self.numbers {
            _ if place == NOWHERE => f64::NAN,
            Numbers::Scalars(values) => values.get(place as usize),
            Numbers::Vectors { all, axes, standing } => {
                match all[place as usize * axes..][..axes] {
                    [x, y] => turned(&[x, y], standing)[k],
                    ref whole => whole[k],
                }
            }
        }
    }
}

/// The cell whose value each element of the file has.
pub(super) fn element_cells<const D: usize>(
    data: &MeshData<D>,
    entities: &Entities<D>,
    version: MshVersion,
) -> Vec<u32> {
    let mesh = data.mesh();
    let mut of_elements: Vec<u32> = match version {
        MshVersion::V41 => entities.order().to_vec(),
        MshVersion::V22 => (0..mesh.cell_count() as u32).collect(),
    };
    if entities.facets.is_empty() && entities.points.is_empty() {
        return of_elements;
    }
    let cells = mesh.cells_of_points();
    for entity in &entities.facets {
        let behind = entity.facets.iter().map(|facet| {
            let found = cell_behind(mesh, facet, mesh.cells_beside(facet, &cells));
            found.map_or(NOWHERE, |behind| behind.cell as u32)
        });
        let behind: Vec<u32> = behind.collect();
        let times = match version {
            MshVersion::V41 => 1,
            MshVersion::V22 => entity.physicals.len(), // a facet of several groups is an element of each
        };
        of_elements.extend(repeat_n(behind, times).flatten());
    }
    // a point has the value of the first of its cells
    let first = |point: u32| cells.of(point).first().copied().unwrap_or(NOWHERE);
    of_elements.extend(entities.points.iter().map(|entity| first(entity.point)));
    of_elements
}
