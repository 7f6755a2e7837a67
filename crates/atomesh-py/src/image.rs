//! Images: samples and the frame that places them.

use std::path::PathBuf;
use std::sync::Arc;

use atomesh::image::{Frame, FrameError, Samples, Units};
use atomesh_io::image::{AnyImage, Meaning};
use atomesh_io::mesh::World;
use atomesh_job::mesh::{MeshImages, prepare};
use atomesh_job::options::RunConfig;
use atomesh_job::{Dimension, JobError, Session};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple, PyType};

use crate::arrays;
use crate::errors;
use crate::options::{Field, Wishes};
use crate::work::work;

/// An image: samples on a regular grid, and the frame that says where they are.
///
/// Parameters
/// ----------
/// array : array_like, shape (ny, nx) or (nz, ny, nx)
///     The samples, x last. Arrays that are C-contiguous and of type uint8, int8, uint16, int16, uint32, int32, float32
///     or float64 are taken without a copy: do not change them while work goes on. Others are converted: bool to uint8,
///     float16 to float32, wider ones to float64.
///     NaN, and what is masked of a masked array, marks samples without data; with NaN, `fill=` of `mesh` must say what
///     stands for them where a value is needed.
/// spacing : sequence of float, optional
///     World units from one sample to the next along x, y (and z). Default 1.
/// origin : sequence of float, optional
///     World coordinates (x, y[, z]) of the first sample. Default 0.
/// direction : array_like, shape (D, D), optional
///     Column c is the world direction of axis c (x first). Default: the world's axes.
/// units : sequence of str, optional
///     The units of the world's axes, such as ``["mm", "mm", "mm"]``; kept in meshes.
///
/// Examples
/// --------
/// >>> import numpy as np, atomesh as am
/// >>> img = am.Image(np.zeros((30, 40, 50), np.uint8), spacing=(1, 1, 2.5))
/// >>> img.shape, img.spacing
/// ((50, 40, 30), (1.0, 1.0, 2.5))
#[pyclass(frozen, module = "atomesh")]
pub struct Image {
    any: Arc<AnyImage>,
    world: World,
    notes: Vec<String>,
}

impl Image {
    /// An image as read or made.
    pub fn new(any: AnyImage, world: World, notes: Vec<String>) -> Self {
        Self { any: Arc::new(any), world, notes }
    }

    /// The image of either dimension.
    pub fn any(&self) -> &AnyImage {
        &self.any
    }

    /// What is known of the world beside the frame.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// An image itself, the image in a file, or that of another package's object.
    ///
    /// # Errors
    /// `TypeError` if it is none of these; those of reading.
    pub fn like<'py>(given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, Self>> {
        if let Ok(image) = given.cast::<Self>() {
            return Ok(image.clone());
        }
        let py = given.py();
        if is_path(given) {
            return Bound::new(py, read(py, given.extract()?, None)?);
        }
        let image = py.import("atomesh._interop")?.call_method1("image_of", (given,))?;
        Ok(image.cast_into::<Self>()?)
    }

    /// What is asked of the frame, whichever dimension it has.
    fn framed<T>(&self, ask: impl Fn(&dyn AnyFrame) -> T) -> T {
        match &*self.any {
            AnyImage::Flat(image) => ask(image.frame()),
            AnyImage::Volume(image) => ask(image.frame()),
        }
    }
}

/// A frame of either dimension, as lists.
trait AnyFrame {
    fn shape(&self) -> Vec<usize>;
    fn spacing(&self) -> Vec<f64>;
    fn origin(&self) -> Vec<f64>;
    fn direction(&self) -> Vec<Vec<f64>>;
}

impl<const D: usize> AnyFrame for Frame<D> {
    fn shape(&self) -> Vec<usize> {
        Frame::shape(self).to_vec()
    }

    fn spacing(&self) -> Vec<f64> {
        Frame::spacing(self).to_vec()
    }

    fn origin(&self) -> Vec<f64> {
        Frame::origin(self).to_vec()
    }

    fn direction(&self) -> Vec<Vec<f64>> {
        Frame::direction(self).iter().map(|row| row.to_vec()).collect()
    }
}

#[pymethods]
impl Image {
    #[new]
    #[pyo3(signature = (array, spacing = None, origin = None, direction = None, *, units = None))]
    fn from_array(
        array: &Bound<'_, PyAny>,
        spacing: Option<&Bound<'_, PyAny>>,
        origin: Option<&Bound<'_, PyAny>>,
        direction: Option<&Bound<'_, PyAny>>,
        units: Option<Vec<String>>,
    ) -> PyResult<Self> {
        let py = array.py();
        let absent = masked(array)?;
        let array = arrays::plain(array)?;
        let samples = arrays::samples(&array)?;
        let shape: Vec<usize> = numpy::PyUntypedArrayMethods::shape(&array).to_vec();
        let list = |given: Option<&Bound<'_, PyAny>>| given.map(arrays::numbers).transpose();
        let place =
            Place { spacing: list(spacing)?, origin: list(origin)?, direction: list(direction)? };
        let any = match shape[..] {
            [y, x] => AnyImage::Flat(place.image(py, [x, y], samples, absent)?),
            [z, y, x] => AnyImage::Volume(place.image(py, [x, y, z], samples, absent)?),
            _ => unreachable!("a plain array has two or three axes"),
        };
        let units = units.unwrap_or_default();
        if !units.is_empty() && units.len() != shape.len() {
            let message = format!("{} units; expected {}, x first", units.len(), shape.len());
            return Err(errors::input(py, message));
        }
        Ok(Self::new(any, World { units, standing: None }, Vec::new()))
    }

    /// The image of another package's object: SimpleITK.Image, itk.Image, a nibabel image, pyvista.ImageData, an
    /// xarray.DataArray, or whatever NumPy takes for an array. Frame and order of axes come from the object. The world is
    /// that of `read`: RAS (x to the right, y to the front, z up), as nibabel's; volumes of SimpleITK and ITK, which are in
    /// LPS, are turned to it by half about z.
    ///
    /// Parameters
    /// ----------
    /// obj : object
    ///     One of these.
    ///
    /// Raises
    /// ------
    /// TypeError
    ///     If it is none of these.
    /// InputError
    ///     If its samples do not lie on a regular grid.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, atomesh as am
    /// >>> am.Image.of(np.eye(20, dtype=np.float32))
    /// Image(shape=(20, 20), dtype=float32, spacing=(1.0, 1.0), origin=(0.0, 0.0))
    #[classmethod]
    #[pyo3(name = "of")]
    fn of_object<'py>(
        _: &Bound<'py, PyType>,
        obj: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, Self>> {
        Self::like(obj)
    }

    /// The samples, axes (y, x) or (z, y, x), read-only and without a copy.
    #[getter]
    fn array<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let shape = self.framed(|frame| frame.shape());
        arrays::of_samples(py, &self.any, |any| samples_of(any), &shape)
    }

    /// How many samples there are along x, y (and z).
    #[getter]
    fn shape<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.framed(|frame| frame.shape()))
    }

    /// World units from one sample to the next along x, y (and z).
    #[getter]
    fn spacing<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.framed(|frame| frame.spacing()))
    }

    /// World coordinates of the first sample.
    #[getter]
    fn origin<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.framed(|frame| frame.origin()))
    }

    /// World directions of the axes as a matrix (D, D): column c is that of axis c.
    #[getter]
    fn direction<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows = self.framed(|frame| frame.direction());
        py.import("numpy")?.call_method1("array", (rows,))
    }

    /// The units of the world's axes; empty if they are not known.
    #[getter]
    #[pyo3(name = "units")]
    fn units_list(&self) -> Vec<String> {
        self.world.units.clone()
    }

    /// What the reader took for granted, changed or left out.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    #[pyo3(signature = (dtype = None, copy = None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<&Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let array = self.array(py)?;
        let keywords = PyDict::new(py);
        keywords.set_item("dtype", dtype)?;
        let function = if copy == Some(true) { "array" } else { "asarray" };
        py.import("numpy")?.call_method(function, (array,), Some(&keywords))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!(
            "Image(shape={}, dtype={}, spacing={}, origin={})",
            self.shape(py)?.repr()?,
            samples_of(&self.any).type_name(),
            self.spacing(py)?.repr()?,
            self.origin(py)?.repr()?,
        ))
    }
}

/// The samples of an image of either dimension.
fn samples_of(any: &AnyImage) -> &Samples {
    match any {
        AnyImage::Flat(image) => image.samples(),
        AnyImage::Volume(image) => image.samples(),
    }
}

/// Which samples of a masked array have no data, if any have none.
fn masked(array: &Bound<'_, PyAny>) -> PyResult<Option<Vec<bool>>> {
    let masked = array.py().import("numpy.ma")?;
    if !masked.call_method1("is_masked", (array,))?.extract::<bool>()? {
        return Ok(None);
    }
    let mask = masked.call_method1("getmaskarray", (array,))?.call_method0("ravel")?;
    mask.call_method0("tolist")?.extract().map(Some)
}

/// Where samples are, as far as callers say it.
struct Place {
    spacing: Option<Vec<f64>>,
    origin: Option<Vec<f64>>,
    direction: Option<Vec<f64>>,
}

impl Place {
    fn image<const D: usize>(
        self,
        py: Python<'_>,
        shape: [usize; D],
        samples: Samples,
        absent: Option<Vec<bool>>,
    ) -> PyResult<atomesh::image::Image<D>> {
        let count = |name: &str, numbers: Vec<f64>| {
            <[f64; D]>::try_from(numbers).map_err(|numbers| {
                let message =
                    format!("{name} has {} numbers; expected {D}, x first", numbers.len());
                errors::input(py, message)
            })
        };
        let refused = |e: FrameError| errors::input(py, e);
        let mut frame = Frame::new(shape).map_err(refused)?;
        if let Some(spacing) = self.spacing {
            frame = frame.with_spacing(count("spacing", spacing)?).map_err(refused)?;
        }
        if let Some(origin) = self.origin {
            frame = frame.with_origin(count("origin", origin)?).map_err(refused)?;
        }
        if let Some(direction) = self.direction {
            if direction.len() != D * D {
                let message =
                    format!("direction has {} numbers; expected {D} × {D}", direction.len());
                return Err(errors::input(py, message));
            }
            let rows = direction.as_chunks::<D>().0.to_vec();
            let rows = <[[f64; D]; D]>::try_from(rows).expect("there are D rows");
            frame = frame.with_direction(rows).map_err(refused)?;
        }
        let image = atomesh::image::Image::new(frame, samples).map_err(refused)?;
        match absent {
            Some(absent) => image.with_absent(absent).map_err(refused),
            None => Ok(image),
        }
    }
}

/// Whether a value names a file.
pub fn is_path(value: &Bound<'_, PyAny>) -> bool {
    value.is_instance_of::<PyString>() || value.hasattr("__fspath__").unwrap_or(false)
}

/// Reads an image: TIFF, PNG, JPEG, PNM, NumPy, NIfTI, FreeSurfer, NRRD, MetaImage, VTI, VTK, SEG-Y, Seismic Unix, RSF,
/// DICOM, folders of slices, and raw samples.
///
/// Parameters
/// ----------
/// path : path-like
///     The file, or the folder of a DICOM series or of TIFF or PNG slices.
/// **options
///     How it is read and placed, as the command's options: `spacing`, `origin`, `direction`, `channel`, `time`,
///     `volume`, `array`, `series`, `segment`, `labels_by_color`, `vertical`, `sample_format` ...; for raw samples `shape`
///     (x first), `dtype`, `byte_order`,
///     `offset`. See `atomesh.FrameOptions`. Also `meaning`: "brightness" (default), "labels" or "mask": what the values
///     are, which decides what is read of colours and rounded; and `progress`.
///
/// Returns
/// -------
/// Image
///     Its `notes` say what was taken for granted; what was changed or guessed is said as a warning too.
///
/// Raises
/// ------
/// FileError
///     If the file cannot be read.
/// InputError
///     If it is not what its name says, or an option is out of range.
/// MemoryForecastError
///     If it would not fit into memory.
///
/// Examples
/// --------
/// >>> import numpy as np, atomesh as am
/// >>> np.save("ramp.npy", np.arange(600.0, dtype=np.float32).reshape(20, 30))
/// >>> am.read("ramp.npy", spacing=(0.5, 0.5)).spacing
/// (0.5, 0.5)
#[pyfunction]
#[pyo3(signature = (path, **options))]
pub fn read(py: Python<'_>, path: PathBuf, options: Option<&Bound<'_, PyDict>>) -> PyResult<Image> {
    let options = options.map(|given| given.copy()).transpose()?;
    let meaning = match &options {
        Some(given) => meaning(given)?,
        None => Meaning::Brightness,
    };
    let Wishes { run, how, .. } = Wishes::take("read", options.as_ref(), &["frame"])?;
    let ((image, world), notes) = work(py, &how, move |session| {
        let options = run.frame.read_options_for(meaning)?;
        let loaded = atomesh_job::images::read(&path, &options, session)?;
        let (world, image) = (loaded.world(), loaded.image);
        let image = match image {
            AnyImage::Flat(image) => AnyImage::Flat(run.frame.place_as_is(image)?),
            AnyImage::Volume(image) => AnyImage::Volume(run.frame.place_as_is(image)?),
        };
        Ok((image, world))
    })?;
    Ok(Image::new(image, world, notes))
}

/// Takes out of keywords what the samples mean.
fn meaning(options: &Bound<'_, PyDict>) -> PyResult<Meaning> {
    let Some(given) = options.get_item("meaning")? else { return Ok(Meaning::Brightness) };
    options.del_item("meaning")?;
    match given.extract::<String>()?.as_str() {
        "brightness" => Ok(Meaning::Brightness),
        "labels" => Ok(Meaning::Labels),
        "mask" => Ok(Meaning::Mask),
        other => {
            let message =
                format!("meaning={other:?}; expected \"brightness\", \"labels\" or \"mask\"");
            Err(errors::input(given.py(), message))
        }
    }
}

/// The image potential b(x) that attracts atoms: −1 in features, 0 elsewhere.
///
/// Parameters
/// ----------
/// image : Image, array or path-like
///     The image.
/// features : str, sequence of str, or dict
///     The kind of features: "dark", "bright", "edges", "ridges", "horizons", "faults", "labels"; several with weights as
///     "faults,horizons:0.5", or {"faults": 1, "horizons": 0.5}. Default: "dark".
/// **options
///     As the command's: `smooth`, `denoise`, `polarity`, `scale`, `low`, `high`, `least_length` ... (see
///     `atomesh.FeatureOptions`), `units`, and those of the frame.
///
/// Returns
/// -------
/// Image
///     b(x), float32, in the image's frame: change it as an array, and hand it back as `potential=`.
///
/// Examples
/// --------
/// >>> import numpy as np, atomesh as am
/// >>> img = np.full((30, 40), 200, np.uint8); img[15, :] = 10
/// >>> b = am.enhance(img, "dark")
/// >>> float(b.array.min()) < -0.3
/// True
#[pyfunction]
#[pyo3(signature = (image, features = None, **options))]
pub fn enhance(
    py: Python<'_>,
    image: &Bound<'_, PyAny>,
    features: Option<&Bound<'_, PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Image> {
    let all = options.map_or_else(|| Ok(PyDict::new(py)), |given| given.copy())?;
    if let Some(features) = features {
        all.set_item("features", features)?;
    }
    let units = all.get_item("units")?.filter(|given| !given.is_none());
    let units: Units = match units {
        Some(given) => {
            all.del_item("units")?;
            let text: String = given.extract()?;
            serde_json::from_value(text.into())
                .map_err(|e| errors::input(py, format!("units: {e}")))?
        }
        None => Units::default(),
    };
    let Wishes { run, how, .. } = Wishes::take("enhance", Some(&all), &["features", "frame"])?;
    let image = Image::like(image)?;
    let (given, of) = (Arc::clone(&image.get().any), image.get().world.clone());
    let (made, notes) = work(py, &how, move |session| match &*given {
        AnyImage::Flat(image) => {
            enhanced(&run, image.clone(), units, &Dimension::plane(), session).map(AnyImage::Flat)
        }
        AnyImage::Volume(image) => {
            enhanced(&run, image.clone(), units, &Dimension::space(), session).map(AnyImage::Volume)
        }
    })?;
    Ok(Image::new(made, of, notes))
}

fn enhanced<const D: usize>(
    run: &RunConfig,
    image: atomesh::image::Image<D>,
    units: Units,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<atomesh::image::Image<D>, JobError> {
    let image = run.frame.place(image)?;
    let made = atomesh_job::enhance::enhance(&image, &run.features, units, dimension, session)?;
    Ok(made.image)
}

/// The nominal distance d(x) between atoms, in lattice units, at the image's samples.
///
/// Parameters
/// ----------
/// image : Image, array or path-like
///     The image.
/// size : float, (float, float), or image
///     Edge length wanted: one, or from the least to the greatest, or d(x) itself, whose slope is limited.
/// **options
///     As of `mesh`: `grade_by`, `features`, `frequency`, `mask` ...
///
/// Returns
/// -------
/// Image
///     d(x), float32: change it as an array, and hand it back as `size=`.
///
/// Examples
/// --------
/// >>> import numpy as np, atomesh as am
/// >>> img = np.full((60, 80), 200, np.uint8); img[30, :] = 10
/// >>> d = am.size_field(img, (4, 12)).array
/// >>> bool(4 <= d.min() < d.max() <= 12)
/// True
#[pyfunction]
#[pyo3(signature = (image, size = None, **options))]
pub fn size_field(
    py: Python<'_>,
    image: &Bound<'_, PyAny>,
    size: Option<&Bound<'_, PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Image> {
    let all = options.map_or_else(|| Ok(PyDict::new(py)), |given| given.copy())?;
    if let Some(size) = size {
        all.set_item("size", size)?;
    }
    let Wishes { run, fields, how } = Wishes::take("size_field", Some(&all), crate::options::MESH)?;
    let image = Image::like(image)?;
    let (given, of) = (Arc::clone(&image.get().any), image.get().world.clone());
    let (made, notes) = work(py, &how, move |session| match &*given {
        AnyImage::Flat(image) => {
            distances(&run, image.clone(), fields, &Dimension::plane(), session).map(AnyImage::Flat)
        }
        AnyImage::Volume(image) => {
            distances(&run, image.clone(), fields, &Dimension::space(), session)
                .map(AnyImage::Volume)
        }
    })?;
    Ok(Image::new(made, of, notes))
}

fn distances<const D: usize>(
    run: &RunConfig,
    image: atomesh::image::Image<D>,
    fields: Vec<Field>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<atomesh::image::Image<D>, JobError> {
    let given = Wishes::given(fields, dimension)?;
    let images = MeshImages::with_fields(run, image, given, dimension, session)?;
    let (prepared, image) = prepare(run, images, dimension, session)?;
    let values = Samples::F32(prepared.distance_at_samples().into());
    image.with_samples(values).map_err(JobError::content)
}
