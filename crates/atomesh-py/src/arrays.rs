//! NumPy arrays as samples, and what meshes hold as arrays.

use std::any::Any;
use std::sync::Arc;

use atomesh::image::{Samples, Values};
use numpy::ndarray::{ArrayD, ArrayView};
use numpy::{
    Element, IxDyn, PyArray, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;

/// Keeps alive what an array shows.
#[pyclass(frozen, module = "atomesh._atomesh")]
struct Keeper {
    _kept: Arc<dyn Any + Send + Sync>,
}

/// A read-only array that shows a part of `owner` without a copy.
pub fn view<'py, O, T>(
    py: Python<'py>,
    owner: &Arc<O>,
    part: impl FnOnce(&O) -> &[T],
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>>
where
    O: Any + Send + Sync,
    T: Element,
{
    let data = part(owner);
    let view = ArrayView::from_shape(IxDyn(shape), data);
    let view = view.map_err(|e| errors::input(py, e))?;
    let keeper = Bound::new(py, Keeper { _kept: Arc::clone(owner) as _ })?;
    // SAFETY: `data` is borrowed from what the Arc holds, which neither moves nor changes while the Arc lives, and the
    // keeper, the array's base, holds the Arc as long as the array lives.
    let array = unsafe { PyArray::borrow_from_array(&view, keeper.into_any()) };
    read_only(array.as_any())?;
    Ok(array)
}

/// Forbids writing to an array.
pub fn read_only(array: &Bound<'_, PyAny>) -> PyResult<()> {
    let flags = PyDict::new(array.py());
    flags.set_item("write", false)?;
    array.call_method("setflags", (), Some(&flags)).map(drop)
}

/// An array whose elements lie one after another, in the machine's byte order, of a type that samples have, with two or
/// three axes. What is so already is not copied.
///
/// # Errors
/// `TypeError` if the array holds no real numbers; `InputError` if it has another number of axes or no elements.
pub fn plain<'py>(given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyUntypedArray>> {
    let py = given.py();
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("asarray", (given,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let size: usize = array.getattr("dtype")?.getattr("itemsize")?.extract()?;
    let name = match (kind.as_str(), size) {
        ("b" | "u", 1) => "uint8",
        ("u", 2) => "uint16",
        ("u", 4) => "uint32",
        ("i", 1) => "int8",
        ("i", 2) => "int16",
        ("i", 4) => "int32",
        ("f", 2 | 4) => "float32",
        ("f" | "i" | "u", _) => "float64",
        _ => {
            let dtype = array.getattr("dtype")?;
            let message = format!("an array of {dtype}; expected integers or real numbers");
            return Err(PyTypeError::new_err(message));
        }
    };
    let array =
        numpy.call_method1("ascontiguousarray", (array, name))?.cast_into::<PyUntypedArray>()?;
    let shape = array.shape();
    if !(2..=3).contains(&shape.len()) {
        let message = format!(
            "an array of shape {shape:?}; expected two axes (y, x) or three (z, y, x); colours and channels are not axes"
        );
        return Err(errors::input(py, message));
    }
    if shape.contains(&0) {
        return Err(errors::input(py, format!("an array of shape {shape:?}; expected samples")));
    }
    Ok(array)
}

/// The memory of an array.
struct Memory<T: Element> {
    /// Keeps the memory.
    _array: Py<PyArrayDyn<T>>,
    first: *const T,
    count: usize,
}

// SAFETY: the memory is only read, and numbers may be read by any thread. That nobody writes to the array while work goes
// on is the caller's part, which the documentation of `Image` asks for, as of all packages that work on arrays without
// the interpreter's lock; one who writes anyway gets samples of either time.
unsafe impl<T: Element + Sync> Send for Memory<T> {}
// SAFETY: as above.
unsafe impl<T: Element + Sync> Sync for Memory<T> {}

impl<T: Element> AsRef<[T]> for Memory<T> {
    fn as_ref(&self) -> &[T] {
        // SAFETY: `first` and `count` are those of a contiguous array, which the reference to it keeps; NumPy does not
        // move an array's memory, and refuses to resize an array that others refer to.
        unsafe { std::slice::from_raw_parts(self.first, self.count) }
    }
}

/// The samples of a [`plain`] array, without a copy.
pub fn samples(array: &Bound<'_, PyUntypedArray>) -> PyResult<Samples> {
    fn values<T: Element + Sync + 'static>(
        array: &Bound<'_, PyUntypedArray>,
    ) -> PyResult<Values<T>> {
        let array = array.cast::<PyArrayDyn<T>>()?;
        let (first, count) = {
            let readonly = array.readonly();
            let slice = readonly.as_slice()?;
            (slice.as_ptr(), slice.len())
        };
        let memory = Memory { _array: array.clone().unbind(), first, count };
        Ok(Values::elsewhere(Arc::new(memory)))
    }
    let name: String = array.dtype().getattr("name")?.extract()?;
    Ok(match name.as_str() {
        "uint8" => Samples::U8(values(array)?),
        "int8" => Samples::I8(values(array)?),
        "uint16" => Samples::U16(values(array)?),
        "int16" => Samples::I16(values(array)?),
        "uint32" => Samples::U32(values(array)?),
        "int32" => Samples::I32(values(array)?),
        "float32" => Samples::F32(values(array)?),
        _ => Samples::F64(values(array)?),
    })
}

/// A read-only array that shows samples, slowest axis first. `shape` is x first.
pub fn of_samples<'py, O: Any + Send + Sync>(
    py: Python<'py>,
    owner: &Arc<O>,
    part: impl Fn(&O) -> &Samples,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let shape: Vec<usize> = shape.iter().rev().copied().collect();
    macro_rules! shown {
        ($($kind:ident),*) => {
            match part(owner) {
                $(Samples::$kind(_) => view(py, owner, |owner| match part(owner) {
                    Samples::$kind(values) => &values[..],
                    _ => unreachable!("the samples are of one type"),
                }, &shape)?.into_any(),)*
                _ => return Err(PyTypeError::new_err("samples of an unknown type")),
            }
        };
    }
    Ok(shown!(U8, I8, U16, I16, U32, I32, F32, F64))
}

/// An array of so many columns that takes over values, row by row.
pub fn rows<T: Element>(
    py: Python<'_>,
    values: Vec<T>,
    columns: usize,
) -> PyResult<Bound<'_, PyAny>> {
    let array = PyArray::from_vec(py, values).into_any();
    array.call_method1("reshape", ((-1, columns as isize),))
}

/// Numbers, one after another, from whatever NumPy takes for an array.
pub fn numbers(given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let numpy = given.py().import("numpy")?;
    let array = numpy.call_method1("ascontiguousarray", (given, "float64"))?;
    let array = array.cast_into::<PyArrayDyn<f64>>()?;
    Ok(array.readonly().as_slice()?.to_vec())
}

/// Points of `D` coordinates from an array of shape (n, D).
///
/// # Errors
/// `InputError` if it has another shape.
pub fn points<const D: usize>(given: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; D]>> {
    let py = given.py();
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("ascontiguousarray", (given, "float64"))?;
    let array = array.cast_into::<PyArrayDyn<f64>>()?;
    let shape = array.shape();
    if shape.len() != 2 || shape[1] != D {
        let message = format!("points of shape {shape:?}; expected (n, {D})");
        return Err(errors::input(py, message));
    }
    Ok(array.readonly().as_slice()?.as_chunks().0.to_vec())
}

/// Rows of whole numbers from whatever NumPy takes for an array.
///
/// # Errors
/// `InputError` if they are negative or too large for numbers of points.
pub fn indices(given: &Bound<'_, PyAny>) -> PyResult<ArrayD<u32>> {
    let py = given.py();
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("ascontiguousarray", (given, "int64"))?;
    let array = array.cast_into::<PyArrayDyn<i64>>()?;
    let array = array.readonly();
    if let Some(odd) = array.as_slice()?.iter().find(|&&i| u32::try_from(i).is_err()) {
        return Err(errors::input(py, format!("a point's number is {odd}; expected 0 or more")));
    }
    Ok(array.as_array().mapv(|i| i as u32))
}
