//! Surfaces: groups of facets with the points that they need.

use std::path::PathBuf;
use std::sync::Arc;

use atomesh::mesh::{FacetGroup, Mesh};
use atomesh_job::{Dimension, JobError, Session};
use pyo3::prelude::*;
use serde_json::Value;

use crate::arrays;
use crate::json;
use crate::work::work;

/// Points and facets.
struct Parts {
    dimension: usize,
    points: Vec<f64>,
    corners: Vec<u32>,
    /// The number in the mesh of each point.
    of_mesh: Vec<u32>,
}

/// A surface of triangles in space, or a curve of line segments in the plane: a part of a mesh's facets.
///
/// Examples
/// --------
/// >>> import numpy as np, atomesh as am
/// >>> side = am.mesh(np.zeros((40, 60)), size=8).surface("ymax")
/// >>> bool((side.points[:, 1] == 39).all())
/// True
#[pyclass(frozen, module = "atomesh")]
pub struct Surface {
    /// The name of the group, feature or region.
    #[pyo3(get)]
    name: String,
    parts: Arc<Parts>,
    info: Value,
}

impl Surface {
    /// Facets of a mesh with the points that they need.
    pub fn new<const D: usize>(
        name: String,
        points: &[[f64; D]],
        facets: &[[u32; D]],
        info: Value,
    ) -> Self {
        let mut used: Vec<u32> = facets.as_flattened().to_vec();
        used.sort_unstable();
        used.dedup();
        let number = |point: &u32| used.binary_search(point).expect("the point is used") as u32;
        let parts = Parts {
            dimension: D,
            points: used.iter().flat_map(|&point| points[point as usize]).collect(),
            corners: facets.as_flattened().iter().map(number).collect(),
            of_mesh: used,
        };
        Self { name, parts: Arc::new(parts), info }
    }
}

#[pymethods]
impl Surface {
    /// The points, shape (n, D), float64, world coordinates x first; read-only.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (count, axes) = (self.parts.of_mesh.len(), self.parts.dimension);
        Ok(arrays::view(py, &self.parts, |parts| &parts.points, &[count, axes])?.into_any())
    }

    /// The facets as numbers of `points`, shape (k, D), uint32; read-only.
    #[getter]
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let axes = self.parts.dimension;
        let shape = [self.parts.corners.len() / axes, axes];
        Ok(arrays::view(py, &self.parts, |parts| &parts.corners, &shape)?.into_any())
    }

    /// The number in the mesh of each point, shape (n,), uint32.
    #[getter]
    fn point_ids<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let shape = [self.parts.of_mesh.len()];
        Ok(arrays::view(py, &self.parts, |parts| &parts.of_mesh, &shape)?.into_any())
    }

    /// What is known of a feature: "measure" (length or area), "mean" of b, "min" and "max" coordinates, "orientable",
    /// "closed"; None of other groups.
    #[getter]
    fn info<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::to_python(py, &self.info)
    }

    /// Writes the surface: .vtp .obj .ply; in space also .stl and .ts (GOCAD), in the plane .pl (GOCAD).
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     The file.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let (parts, name) = (Arc::clone(&self.parts), self.name.clone());
        let job = move |session: &mut Session<'_>| match parts.dimension {
            2 => written(&parts, name, &path, &Dimension::plane(), session),
            _ => written(&parts, name, &path, &Dimension::space(), session),
        };
        work(py, &Default::default(), job).map(drop)
    }

    /// The surface for `pyvista`.
    ///
    /// Returns
    /// -------
    /// pyvista.PolyData
    fn to_pyvista<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("atomesh._interop")?.call_method1("surface_to_pyvista", (slf,))
    }

    fn __repr__(&self) -> String {
        let Parts { dimension, corners, .. } = &*self.parts;
        let what = if *dimension == 2 { "segments" } else { "triangles" };
        format!("Surface({:?}: {} {what})", self.name, corners.len() / dimension)
    }
}

/// Writes a surface by its dimension's writers.
fn written<const D: usize>(
    parts: &Parts,
    name: String,
    path: &std::path::Path,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<(), JobError> {
    let points = parts.points.as_chunks::<D>().0.to_vec();
    let facets = parts.corners.as_chunks::<D>().0.to_vec();
    let mesh = Mesh::new(points, Vec::new()).map_err(JobError::content)?;
    let groups = [FacetGroup { id: 1, name, facets }];
    atomesh_job::surfaces::write_groups(path, (&mesh, &groups, None), dimension, session)
}
