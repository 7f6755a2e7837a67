//! Meshes: triangles, tetrahedra and Voronoi cells, as arrays, and what is done with them.

mod body;
mod cells;
mod given;
pub mod images;
mod meta;
mod simplices;
mod written;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use atomesh::image::Image as CoreImage;
use atomesh::run::Outcome;
use atomesh_draw::{DrawError, Picture, PictureFormat};
use atomesh_io::image::AnyImage;
use atomesh_io::mesh::World;
use atomesh_job::clusters::ClustersRequest;
use atomesh_job::features::FeaturesRequest;
use atomesh_job::mesh::{MadeMesh, MeshImages, prepare};
use atomesh_job::options::{OutputOptions, RunConfig};
use atomesh_job::sample::Property;
use atomesh_job::{Dimension, JobError, Session};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyMapping, PyType};

use crate::arrays;
use crate::edit::Editor;
use crate::errors;
use crate::flow::{self, Flow};
use crate::image::Image;
use crate::json;
use crate::options::{MESH, Wishes};
use crate::source::{Opened, Shown, Source};
use crate::surface::Surface;
use crate::work::work;
pub use body::Body;
use cells::CellsBody;
use given::GivenMesh;
use simplices::SimplexBody;

/// A mesh that a run has made, with what it was made from.
pub struct Made<const D: usize> {
    pub run: RunConfig,
    pub outcome: Outcome<D>,
    pub image: CoreImage<D>,
    pub world: World,
}

impl<const D: usize> Made<D> {
    /// The mesh as jobs take it.
    pub fn as_job<'a>(&'a self, run: &'a RunConfig, properties: &'a [Property]) -> MadeMesh<'a, D> {
        let Self { outcome, image, world, .. } = self;
        MadeMesh { run, outcome, image: Some(image), world, properties, regions: None }
    }

    /// The mesh of either kind, for Python.
    ///
    /// # Errors
    /// [`JobError`] if there are too many groups of facets to number.
    pub fn into_body(self, dimension: Dimension<D>) -> Result<Box<dyn Body>, JobError> {
        let job = self.as_job(&self.run, &[]);
        if let Some(loaded) = job.loaded_cells() {
            return Ok(Box::new(CellsBody::new(loaded, Some(self), dimension)));
        }
        let loaded = job.loaded()?;
        Ok(Box::new(SimplexBody::new(loaded, Some(self), dimension)))
    }
}

/// A body that arrays may be views of.
pub struct Shared(pub Box<dyn Body>);

/// A mesh: points, cells, groups of facets, regions, and values.
///
/// `mesh` makes it from an image, `read_mesh` reads it from a file. All coordinates are the image's world coordinates,
/// x first.
///
/// Examples
/// --------
/// >>> import numpy as np, atomesh as am
/// >>> img = np.full((60, 80), 200, np.uint8); img[30, :] = 10
/// >>> mesh = am.mesh(img, size=8)
/// >>> mesh.points.shape[1], mesh.cells.shape[1]
/// (2, 3)
/// >>> sorted(mesh.facets)
/// ['feature-1', 'xmax', 'xmin', 'ymax', 'ymin']
#[pyclass(frozen, module = "atomesh")]
pub struct Mesh {
    shared: Arc<Shared>,
    cell_data: Py<PyDict>,
    notes: Vec<String>,
}

impl Mesh {
    /// A mesh of that body, its values shown as arrays.
    pub fn new(py: Python<'_>, body: Box<dyn Body>, notes: Vec<String>) -> PyResult<Self> {
        let shared = Arc::new(Shared(body));
        let cell_data = PyDict::new(py);
        for (number, field) in shared.0.cell_fields().iter().enumerate() {
            let shape = [field.values.len()];
            let array = arrays::view(py, &shared, |s| &s.0.cell_fields()[number].values, &shape)?;
            cell_data.set_item(&field.name, array)?;
        }
        Ok(Self { shared, cell_data: cell_data.unbind(), notes })
    }

    fn body(&self) -> &dyn Body {
        &*self.shared.0
    }

    /// The values of the cells as they are written.
    fn properties(&self, py: Python<'_>) -> PyResult<Vec<Property>> {
        let count = self.body().cell_count();
        let data = self.cell_data.bind(py);
        data.iter()
            .map(|(name, values)| {
                let name: String = name.extract()?;
                let values = arrays::numbers(&values)?;
                if values.len() == count {
                    return Ok(Property::new(name, values));
                }
                let message = format!(
                    "cell_data[{name:?}] has {} values; expected {count}, one a cell",
                    values.len()
                );
                Err(errors::input(py, message))
            })
            .collect()
    }

    /// An image for a job beside the mesh.
    pub fn image_for(image: Option<&Bound<'_, PyAny>>) -> PyResult<Option<AnyImage>> {
        let image = image.filter(|given| !given.is_none()).map(Image::like).transpose()?;
        Ok(image.map(|image| image.get().any().clone()))
    }
}

#[pymethods]
impl Mesh {
    /// A mesh of one's own or another package's triangles or tetrahedra: pyvista.UnstructuredGrid, meshio.Mesh, a mesh of
    /// scikit-fem, or (points, cells). Groups of facets, regions and values are kept. Cells that are oriented the other way
    /// are turned, with a note.
    ///
    /// Parameters
    /// ----------
    /// obj : object
    ///     One of these. Points have 2 or 3 coordinates; triangles whose points have three must lie in a plane of constant z.
    ///
    /// Returns
    /// -------
    /// Mesh
    ///
    /// Examples
    /// --------
    /// >>> import atomesh as am
    /// >>> am.Mesh.of(([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)])).quality()["cells"]
    /// 2
    #[classmethod]
    #[pyo3(name = "of")]
    fn of_object(_: &Bound<'_, PyType>, obj: &Bound<'_, PyAny>) -> PyResult<Self> {
        let py = obj.py();
        let parts = py.import("atomesh._interop")?.call_method1("mesh_parts", (obj,))?;
        let parts: GivenMesh<'_> = parts.extract()?;
        let axes: usize = parts.points.getattr("shape")?.get_item(1)?.extract()?;
        let body = match axes {
            2 => given::body(py, &parts, Dimension::plane())?,
            _ => given::body(py, &parts, Dimension::space())?,
        };
        let mesh = Self::new(py, body, Vec::new())?;
        mesh.cell_data.bind(py).update(parts.cell_data.as_mapping())?;
        Ok(mesh)
    }

    /// The points, shape (n, D), float64, world coordinates x first; read-only and without a copy. Of Voronoi cells: their
    /// corners.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let shape = [self.body().points().len() / self.dim(), self.dim()];
        Ok(arrays::view(py, &self.shared, |s| s.0.points(), &shape)?.into_any())
    }

    /// The cells, uint32. Of triangles and tetrahedra: the numbers of their points, shape (m, D + 1), positively oriented;
    /// read-only and without a copy. Of Voronoi cells: VTK's list, which `pyvista.UnstructuredGrid` takes: in the plane
    /// for each cell how many points and these, in space the length of its entry, how many faces, and for each face
    /// how many points and these; `offsets` says where each begins.
    #[getter]
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let list = self.body().cells();
        let shape = match self.body().is_voronoi() {
            true => vec![list.len()],
            false => vec![list.len() / (self.dim() + 1), self.dim() + 1],
        };
        Ok(arrays::view(py, &self.shared, |s| s.0.cells(), &shape)?.into_any())
    }

    /// Where the entry of each Voronoi cell begins in `cells`, shape (m + 1,), uint32; None for triangles and tetrahedra.
    #[getter]
    fn offsets<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(offsets) = self.body().offsets() else { return Ok(None) };
        let shape = [offsets.len()];
        let array = arrays::view(py, &self.shared, |s| s.0.offsets().unwrap_or_default(), &shape)?;
        Ok(Some(array.into_any()))
    }

    /// The sites of Voronoi cells, which are the atoms, shape (m, D); None for triangles and tetrahedra, whose points the
    /// atoms are.
    #[getter]
    fn sites<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(sites) = self.body().sites() else { return Ok(None) };
        let shape = [sites.len() / self.dim(), self.dim()];
        let array = arrays::view(py, &self.shared, |s| s.0.sites().unwrap_or_default(), &shape)?;
        Ok(Some(array.into_any()))
    }

    /// 2 or 3.
    #[getter]
    fn dim(&self) -> usize {
        self.body().dimension()
    }

    /// "delaunay" or "voronoi".
    #[getter]
    fn kind(&self) -> &'static str {
        if self.body().is_voronoi() { "voronoi" } else { "delaunay" }
    }

    /// How many cells there are.
    #[getter]
    fn cell_count(&self) -> usize {
        self.body().cell_count()
    }

    /// Values at the points by name, float32, read-only: of meshes of images "distance", d(x) in lattice units, and
    /// "potential", b(x). Values of one's own go into `cell_data`, or beside the mesh.
    #[getter]
    fn point_data<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyMapping>> {
        let data = PyDict::new(py);
        for (number, field) in self.body().point_fields().iter().enumerate() {
            let shape = [field.values.len()];
            let array =
                arrays::view(py, &self.shared, |s| &s.0.point_fields()[number].values, &shape)?;
            data.set_item(&field.name, array)?;
        }
        let proxy = py.import("types")?.getattr("MappingProxyType")?.call1((data,))?;
        Ok(proxy.cast_into()?)
    }

    /// Values in the cells by name: a dictionary that may be added to. What is in it is written with the mesh, and may be
    /// the permeability of `flow`.
    #[getter]
    fn cell_data<'py>(&self, py: Python<'py>) -> Bound<'py, PyDict> {
        self.cell_data.bind(py).clone()
    }

    /// The groups of facets by name, each an array (k, D) of numbers of points, uint32: the sides of the box ("xmin" ...
    /// "zmax"), features ("feature-1"), interfaces of labels ("interface-1-2", turned from 1 to 2), a mask's outline
    /// ("mask"). Of Voronoi cells, faces are cut into triangles from their first points.
    #[getter]
    fn facets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (number, (name, corners)) in self.body().groups().iter().enumerate() {
            let shape = [corners.len() / self.dim(), self.dim()];
            let array = arrays::view(py, &self.shared, |s| &s.0.groups()[number].1, &shape)?;
            all.set_item(name, array)?;
        }
        Ok(all)
    }

    /// The groups of points by name, each an array of their numbers, uint32: atoms that `fixed` keeps in place ("well-1",
    /// "well-2" ... in the order given). Of Voronoi cells, the numbers are those of the cells around them.
    #[getter]
    fn point_groups<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (name, points) in self.body().point_groups() {
            all.set_item(name, numpy::PyArray1::from_vec(py, points))?;
        }
        Ok(all)
    }

    /// The region of each cell, shape (m,), int32: the label that covers most of it; None if there are no regions.
    #[getter]
    fn regions<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(regions) = self.body().regions() else { return Ok(None) };
        let shape = [regions.of_cells.len()];
        let array = arrays::view(
            py,
            &self.shared,
            |s| s.0.regions().map_or(&[][..], |regions| &regions.of_cells),
            &shape,
        )?;
        Ok(Some(array.into_any()))
    }

    /// The names of the regions by number.
    #[getter]
    fn region_names(&self) -> BTreeMap<i32, String> {
        let Some(regions) = self.body().regions() else { return Default::default() };
        regions.ids().into_iter().map(|id| (id, regions.name(id))).collect()
    }

    /// Where the mesh comes from: "version", "options", "seed" and "units" of the run, and the image's "frame" ("shape",
    /// "spacing", "origin", "direction"), as far as they are known.
    #[getter]
    fn meta<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::to_python(py, &self.body().meta())
    }

    /// What was changed, guessed or not met on the way, and warnings.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// The shape of the cells in figures.
    ///
    /// Returns
    /// -------
    /// dict
    ///     As "shape" of the command's report: counts, measure, histograms of quality and angles; of Voronoi cells their
    ///     volumes and faces.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, atomesh as am
    /// >>> am.mesh(np.zeros((40, 60)), size=8).quality()["inverted"]
    /// 0
    fn quality<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let shared = Arc::clone(&self.shared);
        let (value, _) = work(py, &Default::default(), move |session| shared.0.quality(session))?;
        json::to_python(py, &value)
    }

    /// Shape, alignment with features, and fidelity to an image, in figures.
    ///
    /// Parameters
    /// ----------
    /// image : Image, array or path-like, optional
    ///     For a mesh that was read: the image whose features it should follow. A mesh that `mesh` made is measured against
    ///     its own image.
    /// **options
    ///     For a mesh that was read: `features`, `smooth` ... as of `enhance`, and `size`, the edge length wanted.
    ///
    /// Returns
    /// -------
    /// dict
    ///     As the command's report.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, atomesh as am
    /// >>> img = np.full((60, 80), 200, np.uint8); img[30, :] = 10
    /// >>> am.mesh(img, size=8).report()["shape"]["inverted"]
    /// 0
    #[pyo3(signature = (image = None, **options))]
    fn report<'py>(
        &self,
        py: Python<'py>,
        image: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let wishes = Wishes::take("report", options, &["features", "lattice", "frame"])?;
        let image = Self::image_for(image)?;
        let shared = Arc::clone(&self.shared);
        let Wishes { run, fields, how } = wishes;
        if !(fields.is_empty() && run.input.is_empty()) {
            let message =
                "report() measures against the features of its image; expected no other images";
            return Err(errors::input(py, message));
        }
        let (value, _) = work(py, &how, move |session| shared.0.report(&run, image, session))?;
        json::to_python(py, &value)
    }

    /// The facets that follow features of the image, as surfaces (in the plane: curves).
    ///
    /// Parameters
    /// ----------
    /// image : Image, array or path-like, optional
    ///     The image whose features they follow. Default: the mesh's own features, else its values "potential".
    /// below : float, optional
    ///     Choose all facets along which the mean of b is at most this, -1 to 1, in place of the mesh's own features.
    /// min_facets : int, optional
    ///     Pieces of fewer facets are dropped. Default 3; of the mesh's own features none is dropped.
    /// min_measure : float
    ///     Pieces of less length or area, in world units, are dropped. Default 0.
    /// close_gaps : bool
    ///     Whether gaps of one facet are closed. Default False.
    /// **options
    ///     With `image`: `features`, `smooth` ... as of `enhance`.
    ///
    /// Returns
    /// -------
    /// list of Surface
    ///     The largest first.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, atomesh as am
    /// >>> img = np.full((60, 80), 200, np.uint8); img[30, :] = 10
    /// >>> [s.name for s in am.mesh(img, size=8).features()]
    /// ['feature-1']
    #[pyo3(signature = (image = None, *, below = None, min_facets = None, min_measure = 0.0, close_gaps = false, **options))]
    #[allow(clippy::too_many_arguments)] // keywords
    fn features<'py>(
        &self,
        py: Python<'py>,
        image: Option<&Bound<'py, PyAny>>,
        below: Option<f64>,
        min_facets: Option<usize>,
        min_measure: f64,
        close_gaps: bool,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Vec<Surface>> {
        let Wishes { run, how, .. } = Wishes::take("features", options, &["features", "frame"])?;
        let image = Self::image_for(image)?;
        let shared = Arc::clone(&self.shared);
        let request = FeaturesRequest {
            below,
            min_facets,
            min_measure,
            close_gaps,
            features: run.features,
            frame: run.frame,
            ..Default::default()
        };
        let (found, _) =
            work(py, &how, move |session| shared.0.features(&request, image, session))?;
        Ok(found)
    }

    /// Parts of the cells that hang together and end at features: units between faults, organs, grains.
    ///
    /// Parts of a call with more of them lie within those of a call with fewer.
    ///
    /// Parameters
    /// ----------
    /// image : Image, array or path-like, optional
    ///     The image whose features part the cells. Default: of a mesh that `mesh` made its own b(x), of one that was read its
    ///     values "potential".
    /// parts : int
    ///     How many parts; fewer if none is left that can be cut into two. Default 20.
    /// least_cells : int
    ///     The least cells of a part. Default 8.
    /// contrast : float
    ///     The mean of |b| along a facet by which its weight falls to 1/e. Default 0.2.
    /// multiplier : float
    ///     The multiplier of the weights of the mesh's own features, 0 (walls) to 1. Default 0.
    /// **options
    ///     With `image`: `features`, `smooth` ... as of `enhance`.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray
    ///     The part of each cell, shape (m,), int32, from 1 on.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, atomesh as am
    /// >>> img = np.full((60, 80), 200, np.uint8); img[30, :] = 10
    /// >>> mesh = am.mesh(img, size=8)
    /// >>> part = mesh.clusters(parts=2)
    /// >>> sorted(set(part.tolist())), len(part) == mesh.cell_count
    /// ([1, 2], True)
    #[pyo3(signature = (image = None, *, parts = 20, least_cells = 8, contrast = 0.2, multiplier = 0.0, **options))]
    #[allow(clippy::too_many_arguments)] // keywords
    fn clusters<'py>(
        &self,
        py: Python<'py>,
        image: Option<&Bound<'py, PyAny>>,
        parts: usize,
        least_cells: usize,
        contrast: f64,
        multiplier: f64,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, numpy::PyArray1<i32>>> {
        let Wishes { run, how, .. } = Wishes::take("clusters", options, &["features", "frame"])?;
        let image = Self::image_for(image)?;
        let shared = Arc::clone(&self.shared);
        let request = ClustersRequest {
            parts,
            least_cells,
            contrast,
            multiplier,
            features: run.features,
            frame: run.frame,
            ..Default::default()
        };
        let (found, _) =
            work(py, &how, move |session| shared.0.clusters(&request, image, session))?;
        Ok(numpy::PyArray1::from_vec(py, found))
    }

    /// A group of facets, or the closed surface of a region, as a surface of its own (in the plane: a curve).
    ///
    /// Parameters
    /// ----------
    /// name : str or int
    ///     The name of a group of `facets`, or a region's number or name.
    ///
    /// Raises
    /// ------
    /// KeyError
    ///     If there is neither; the message names what there is.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, atomesh as am
    /// >>> am.mesh(np.zeros((40, 60)), size=8).surface("xmin").cells.shape[1]
    /// 2
    fn surface(&self, py: Python<'_>, name: &Bound<'_, PyAny>) -> PyResult<Surface> {
        let name = match name.extract::<i64>() {
            Ok(number) => number.to_string(),
            Err(_) => name.extract::<String>()?,
        };
        let shared = Arc::clone(&self.shared);
        let found = py.detach(move || shared.0.surface(&name));
        found.map_err(|e| PyKeyError::new_err(errors::in_keywords(&e.to_string())))
    }

    /// Values of the cells from an image: the mean, or another statistic, of the samples in each, weighted by how much of
    /// each sample lies in the cell.
    ///
    /// Parameters
    /// ----------
    /// image : Image, array or path-like
    ///     The image. Its own frame counts; an array or an image of unit steps at 0 lies where the mesh's image did.
    /// statistic : str
    ///     "mean", "harmonic", "geometric", "std", "min", "max", "majority", "homogeneity" or "total".
    /// name : str, optional
    ///     Where the values go in `cell_data`; default: they are only returned.
    /// outside : float
    ///     Value of cells without samples. Default NaN.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (m,), float64
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, atomesh as am
    /// >>> img = np.tile(np.arange(60.0), (40, 1))
    /// >>> mesh = am.mesh(img, size=8)
    /// >>> k = mesh.sample(img, "mean", name="k")
    /// >>> bool(abs(k - mesh.points[mesh.cells, 0].mean(axis=1)).max() < 0.5)
    /// True
    #[pyo3(signature = (image, statistic = "mean", *, name = None, outside = None))]
    fn sample<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'py, PyAny>,
        statistic: &str,
        name: Option<String>,
        outside: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let image = Image::like(image)?.get().any().clone();
        let statistic =
            statistic.parse().map_err(|e| errors::input(py, format!("statistic: {e}")))?;
        let request = atomesh_job::sample::SampleRequest {
            statistic: vec![statistic],
            outside,
            ..Default::default()
        };
        let shared = Arc::clone(&self.shared);
        let label = name.clone().unwrap_or_else(|| "image".into());
        let (found, _) = work(py, &Default::default(), move |session| {
            shared.0.sample(&request, &label, image, session)
        })?;
        let array = numpy::PyArray1::from_vec(py, found).into_any();
        if let Some(name) = name {
            self.cell_data.bind(py).set_item(name, &array)?;
        }
        Ok(array)
    }

    /// Steady flow through the mesh: -div(k grad p) = q, with wells, sides and barriers.
    ///
    /// Parameters
    /// ----------
    /// sources, sinks : sequence
    ///     Wells: places (x, y[, z]), or dictionaries {"at": place, "rate": Q} or {"at": place, "pressure": P, "radius": R}.
    ///     Sinks without rate share what the sources bring. Wells should be atoms: give them to `mesh` as `fixed=`.
    /// sides : dict
    ///     Pressures by group of facets on the boundary, {"xmin": 1.0}, or ("flux", F) for a flux into the domain per unit
    ///     of area.
    /// k : float, sequence of float, str or array, optional
    ///     Permeability: a number, one for each axis, the upper triangle of a tensor, the name of values in `cell_data`, or
    ///     a value for each cell. Default 1.
    /// barriers : dict, optional
    ///     Shares of the flow that groups of facets let through, {"feature-1": 0.1}.
    /// multiplier : float
    ///     The share for all other features, 0 (sealed, the default) to 1 (open).
    /// **options
    ///     `order` (1 to 3, default 2), `porosity`, `solver` ("auto", "direct", "iterative"), `solver_tolerance`; `progress`,
    ///     `threads`.
    ///
    /// Returns
    /// -------
    /// Flow
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, atomesh as am
    /// >>> mesh = am.mesh(np.zeros((41, 61)), size=8)
    /// >>> flow = mesh.flow(sides={"xmin": 1.0, "xmax": 0.0})
    /// >>> round(flow.balance["boundary_in"], 6)   # k (p1 - p0) / 60 through 40
    /// 0.666667
    #[pyo3(signature = (sources = None, sinks = None, sides = None, k = None, *, barriers = None, multiplier = 0.0, **options))]
    #[allow(clippy::too_many_arguments)] // keywords
    fn flow(
        &self,
        py: Python<'_>,
        sources: Option<&Bound<'_, PyAny>>,
        sinks: Option<&Bound<'_, PyAny>>,
        sides: Option<&Bound<'_, PyAny>>,
        k: Option<&Bound<'_, PyAny>>,
        barriers: Option<&Bound<'_, PyAny>>,
        multiplier: f64,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Flow> {
        let keywords = flow::Keywords { sources, sinks, sides, k, barriers, multiplier, options };
        let (flow, own, how) = keywords.take(py, self.body().cell_count())?;
        let mut fields = self.properties(py)?;
        fields.extend(own);
        let shared = Arc::clone(&self.shared);
        let (body, notes) = work(py, &how, move |session| shared.0.flow(&flow, fields, session))?;
        Ok(Flow::new(body, notes))
    }

    /// Writes the mesh, with its values, groups of facets and regions.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     .vtu .vtk .msh (Gmsh 4.1) .msh2 (Gmsh 2.2) .npz .inp (Abaqus), or a folder named polyMesh (OpenFOAM); Voronoi
    ///     cells: .vtu or polyMesh.
    /// **options
    ///     As the command's: `order` (2: cells of second order), `msh`, `msh_text`, `tag_features`, `regions`,
    ///     `connections`, `picture`, `picture_of`, `view`, `report`, `html`, `write_potential`. See `atomesh.OutputOptions`.
    ///
    /// Raises
    /// ------
    /// FileError
    ///     If the file cannot be written; then none is left.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, atomesh as am
    /// >>> am.mesh(np.zeros((40, 60)), size=8).write("box.vtu")
    /// >>> am.read_mesh("box.vtu").dim
    /// 2
    #[pyo3(signature = (path, **options))]
    fn write(
        &self,
        py: Python<'_>,
        path: PathBuf,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        let Wishes { run, how, .. } = Wishes::take("write", options, &["output"])?;
        let output = OutputOptions { output: Some(path), ..run.output };
        let properties = self.properties(py)?;
        let shared = Arc::clone(&self.shared);
        work(py, &how, move |session| shared.0.write(output, &properties, session)).map(drop)
    }

    /// A picture of the mesh over its image: in space, of the three slices through the middle.
    ///
    /// Parameters
    /// ----------
    /// image : Image, array or path-like, optional
    ///     What is behind the mesh. Default: its own image; a mesh that was read needs one.
    /// max_side : float
    ///     The longest side in pixels. Default 1600.
    ///
    /// Returns
    /// -------
    /// bytes
    ///     A PNG.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, atomesh as am
    /// >>> am.mesh(np.zeros((40, 60)), size=8).picture()[:4]
    /// b'\x89PNG'
    #[pyo3(signature = (image = None, *, max_side = 1600.0))]
    fn picture<'py>(
        &self,
        py: Python<'py>,
        image: Option<&Bound<'py, PyAny>>,
        max_side: f64,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let image = Self::image_for(image)?;
        let shared = Arc::clone(&self.shared);
        let (bytes, _) = work(py, &Default::default(), move |_| shared.0.picture(image, max_side))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Shows the mesh: in the plane over its image by matplotlib, in space by pyvista. Either is imported when it is asked
    /// for.
    ///
    /// Returns
    /// -------
    /// object
    ///     matplotlib's axes, or what pyvista's `plot` returns.
    fn plot<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        interop(slf, "plot")
    }

    /// The mesh for `meshio`, with values, regions and groups of facets, inner ones too, as cell sets.
    ///
    /// Returns
    /// -------
    /// meshio.Mesh
    fn to_meshio<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        interop(slf, "to_meshio")
    }

    /// The mesh for `pyvista`, with values, `region` among those of cells. Field data has the names of regions, as
    /// "region 1", and the groups of facets, inner ones too, as "facets xmin": arrays (k, D) of numbers of points.
    ///
    /// Returns
    /// -------
    /// pyvista.UnstructuredGrid
    fn to_pyvista<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        interop(slf, "to_pyvista")
    }

    /// The mesh for `scikit-fem`, with its groups of facets as boundaries and its regions as subdomains. Inner groups are
    /// oriented boundaries, whose normals point out of the region named first.
    ///
    /// Returns
    /// -------
    /// skfem.MeshTri or skfem.MeshTet
    fn to_skfem<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        interop(slf, "to_skfem")
    }

    /// Edits the atoms of the mesh one by one, near features of its image.
    ///
    /// A mesh that was read cannot be edited: it does not know its image and options.
    ///
    /// Parameters
    /// ----------
    /// image : Image or array, optional
    ///     What the edited mesh is shown over and compared with, in the same place as the mesh's own image. Default: that.
    ///
    /// Returns
    /// -------
    /// Editor
    #[pyo3(signature = (image = None))]
    fn edit(&self, py: Python<'_>, image: Option<&Bound<'_, PyAny>>) -> PyResult<Editor> {
        let image = Self::image_for(image)?;
        let shared = Arc::clone(&self.shared);
        let job = move |session: &mut Session<'_>| shared.0.editor(image, session);
        let (editor, _) = work(py, &Default::default(), job)?;
        Ok(Editor::new(editor))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("atomesh._notebook")?.call_method1("html", (slf,))
    }

    fn __repr__(&self) -> String {
        let body = self.body();
        let points = body.points().len() / self.dim();
        format!("Mesh({}: {points} points, {} cells)", body.cells_name(), body.cell_count())
    }
}

/// Calls a function of the package's that needs others' packages.
fn interop<'py>(mesh: &Bound<'py, Mesh>, function: &str) -> PyResult<Bound<'py, PyAny>> {
    mesh.py().import("atomesh._interop")?.call_method1(function, (mesh,))
}

/// Meshes an image.
///
/// Atoms about `size` apart fill the image's box, settle where a weighted sum of a pair potential and of the image is low,
/// and are connected: triangles of an image of two axes, tetrahedra of three, or Voronoi cells. What the image shows
/// (`features`) is kept to by edges, facets or faces.
///
/// Parameters
/// ----------
/// image : Image, array, path-like, or another package's image
///     What `Image.of` takes. Arrays have the axes (y, x) or (z, y, x). None with `potential=`.
/// size : float, (float, float), or image
///     Edge length wanted, in world units: one, from features to elsewhere, or d(x). Default: from the size of the image.
/// features : str, sequence or dict
///     What edges keep to: "dark" (default), "bright", "edges", "ridges", "horizons", "faults", "labels", "none"; or
///     several with weights.
/// beta : float or image
///     Weight of the image against regularity, 0 to 1. Default 0.45.
/// kind : str
///     "delaunay" (default) or "voronoi"; the command's --mesh.
/// mask : image or path-like
///     Mesh only where it is not 0, up to its smooth outline; "live": where the image has data.
/// labels : image or path-like
///     A label for each sample: cells get that of most of them, and interfaces are tagged.
/// fixed : array_like, shape (n, D)
///     World coordinates of atoms that stay; the command's --seed-point.
/// min_angle : float
///     The least angle that is worked for, in degrees.
/// seed : int
///     Of random numbers. Default 0.
/// threads : int
///     The result is the same with any number. Default: one a core.
/// progress : bool or callable
///     True shows a line; a callable is called with an `Event` at each step, and ends the work by returning False.
/// strict : bool
///     Whether warnings, and notes that something was changed or guessed, are refusals. Default False.
/// **options
///     All others of the command's, with underscores: see `atomesh.MeshOptions`.
///
/// Returns
/// -------
/// Mesh
///
/// Raises
/// ------
/// TypeError
///     If there is no such option; the nearest is named.
/// InputError
///     If an option is out of range, or the image is of no use.
/// MemoryForecastError
///     If the mesh would not fit into memory.
/// Cancelled
///     If `progress` says so.
///
/// Examples
/// --------
/// >>> import numpy as np, atomesh as am
/// >>> img = np.full((60, 80), 200, np.uint8); img[30, :] = 10
/// >>> am.mesh(img, size=8, features="dark").cell_count > 100
/// True
#[pyfunction]
#[pyo3(signature = (image, **options))]
pub fn mesh(
    py: Python<'_>,
    image: &Bound<'_, PyAny>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Mesh> {
    let mut wishes = Wishes::take("mesh", options, MESH)?;
    let source = Source::take(image, &mut wishes)?;
    let Wishes { mut run, fields, how } = wishes;
    let (body, notes) = work(py, &how, move |session| {
        run.check()?;
        let Opened { image, world, is_potential } = source.open(&mut run, session)?;
        match image {
            AnyImage::Flat(image) => {
                let dimension = Dimension::plane();
                let shown = Shown { image, world, is_potential, fields };
                let images = shown.placed(&mut run, &dimension, session)?;
                made(run, images, dimension, session)
            }
            AnyImage::Volume(image) => {
                let dimension = Dimension::space();
                let shown = Shown { image, world, is_potential, fields };
                let images = shown.placed(&mut run, &dimension, session)?;
                made(run, images, dimension, session)
            }
        }
    })?;
    Mesh::new(py, body, notes)
}

fn made<const D: usize>(
    run: RunConfig,
    images: MeshImages<D>,
    dimension: Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Box<dyn Body>, JobError> {
    let world = images.world.clone();
    let (prepared, image) = prepare(&run, images, &dimension, session)?;
    let outcome = atomesh_job::mesh::meshed(&run, prepared, session)?;
    Made { run, outcome, image, world }.into_body(dimension)
}

/// Reads a mesh: .vtu .vtk .msh .msh2 .npz .inp, Voronoi cells that atomesh wrote (.vtu, or the .json of a list of
/// connections).
///
/// Parameters
/// ----------
/// path : path-like
///     The file.
///
/// Returns
/// -------
/// Mesh
///
/// Raises
/// ------
/// FileError
///     If it cannot be read.
/// InputError
///     If it is not what its name says.
#[pyfunction]
pub fn read_mesh(py: Python<'_>, path: PathBuf) -> PyResult<Mesh> {
    use atomesh_job::mesh_file::{MeshFile, read};
    let (body, notes) = work(py, &Default::default(), move |session| {
        Ok(match read(&path, session)? {
            MeshFile::Flat(mesh) => {
                Box::new(SimplexBody::new(mesh, None, Dimension::plane())) as Box<dyn Body>
            }
            MeshFile::Volume(mesh) => Box::new(SimplexBody::new(mesh, None, Dimension::space())),
            MeshFile::Polygons(cells) => Box::new(CellsBody::new(cells, None, Dimension::plane())),
            MeshFile::Polyhedra(cells) => Box::new(CellsBody::new(cells, None, Dimension::space())),
        })
    })?;
    Mesh::new(py, body, notes)
}

/// The refusal to edit a mesh that was read.
fn not_made() -> JobError {
    JobError::misuse("a mesh that was read cannot be edited; expected one that mesh() made")
}

/// A picture as a PNG.
fn png(picture: Result<Picture, DrawError>) -> Result<Vec<u8>, JobError> {
    let png = picture.and_then(|picture| picture.encode(PictureFormat::Png));
    png.map_err(JobError::content)
}
