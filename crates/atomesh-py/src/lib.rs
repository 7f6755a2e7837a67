//! atomesh for Python: NumPy arrays in and out of the jobs that every shell shares.
//!
//! Nothing of the pipeline is here. [`options`] turns keywords into the options of a run, [`arrays`] NumPy arrays into
//! samples and meshes into arrays, [`errors`] refusals into exceptions. [`work`] does a job on threads of its own while
//! the caller's thread listens for Ctrl-C and calls back. [`image`], [`mesh`], [`flow`], [`surface`], [`stages`] and
//! [`edit`] are the classes, [`source`] what meshes and lattices are made from; a class holds either dimension behind a trait, or an enum where there are two lines to do.
//!
//! What needs other Python packages (`meshio`, `pyvista` ...) is written in Python beside this module, and imported when
//! it is asked for.

mod arrays;
mod command;
mod edit;
mod errors;
mod flow;
mod image;
mod json;
mod mesh;
mod options;
mod source;
mod stages;
mod surface;
mod work;

use pyo3::prelude::*;

/// What the package's Python files import.
#[pymodule]
mod _atomesh {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::command::run_command;
    #[pymodule_export]
    use super::edit::Editor;
    #[pymodule_export]
    use super::flow::{Flow, Streamline};
    #[pymodule_export]
    use super::image::{Image, enhance, read, size_field};
    #[pymodule_export]
    use super::mesh::{Mesh, mesh, read_mesh};
    #[pymodule_export]
    use super::options::option_names;
    #[pymodule_export]
    use super::stages::steps::{Step, Steps};
    #[pymodule_export]
    use super::stages::{Connected, Lattice, lattice};
    #[pymodule_export]
    use super::surface::Surface;
    #[pymodule_export]
    use super::work::Event;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
