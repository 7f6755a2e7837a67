//! Meshes of other packages' making.

use std::collections::BTreeMap;

use atomesh::mesh::{FacetGroup, Mesh, Regions, Tags};
use atomesh_io::mesh::{LoadedMesh, OwnedField};
use atomesh_job::Dimension;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::body::Body;
use super::simplices::SimplexBody;
use crate::{arrays, errors};

/// A mesh of another's making, as `_interop.mesh_parts` takes it apart.
#[derive(FromPyObject)]
pub struct GivenMesh<'py> {
    pub points: Bound<'py, PyAny>,
    cells: Bound<'py, PyAny>,
    facets: Bound<'py, PyDict>,
    regions: Option<Vec<i32>>,
    region_names: BTreeMap<i32, String>,
    point_data: Bound<'py, PyDict>,
    pub cell_data: Bound<'py, PyDict>,
}

/// The mesh of such parts.
pub fn body<const D: usize>(
    py: Python<'_>,
    parts: &GivenMesh<'_>,
    dimension: Dimension<D>,
) -> PyResult<Box<dyn Body>> {
    let refused = |e: &dyn std::fmt::Display| errors::input(py, e);
    let numbers = |given: &Bound<'_, PyAny>, corners: usize| -> PyResult<Vec<u32>> {
        let rows = arrays::indices(given)?;
        match rows.shape()[..] {
            [_, columns] if columns == corners => Ok(rows.iter().copied().collect()),
            ref other => {
                let message =
                    format!("cells or facets of shape {other:?}; expected (m, {corners})");
                Err(errors::input(py, message))
            }
        }
    };
    let points = arrays::points::<D>(&parts.points)?;
    let mesh = Mesh::new(points, numbers(&parts.cells, D + 1)?).map_err(|e| refused(&e))?;
    let mut groups = Vec::new();
    for (number, (name, facets)) in (1..).zip(&parts.facets) {
        let facets = numbers(&facets, D)?.as_chunks::<D>().0.to_vec();
        groups.push(FacetGroup { id: number, name: name.extract()?, facets });
    }
    let names = parts.region_names.clone().into_iter().collect();
    let regions = parts.regions.clone().map(|of_cells| Regions { of_cells, names });
    let tags = Tags::new(&mesh, groups, regions).map_err(|e| refused(&e))?;
    let mut point_fields = Vec::new();
    for (name, values) in &parts.point_data {
        let values = arrays::numbers(&values)?.into_iter().map(|v| v as f32).collect();
        point_fields.push(OwnedField { name: name.extract()?, values });
    }
    let loaded = LoadedMesh {
        mesh,
        point_fields,
        tags,
        cell_fields: Vec::new(),
        frame: None,
        provenance: None,
        skipped_cells: 0,
        skipped_fields: Vec::new(),
    };
    Ok(Box::new(SimplexBody::new(loaded, None, dimension)))
}
