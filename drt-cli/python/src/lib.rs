//! The compiled part of the Python package `drt`, which its modules in Python are written over.

mod arrays;
mod errors;
mod files;
mod loss;
mod scene;
mod steps;
mod tables;
mod watch;

use std::ffi::OsString;

use pyo3::prelude::*;

use loss::Loss;
use scene::Scene;
use steps::Steps;

/// Runs the command line `args`, the first of which is the program's name, and returns its exit code.
#[pyfunction]
fn main(py: Python<'_>, args: Vec<OsString>) -> u8 {
    py.detach(|| drt_cli::commands::main(args))
}

/// The seed of a gradient whose adjoint comes from an image with this seed.
#[pyfunction]
fn independent_seed(seed: u64) -> u64 {
    drt_cli::independent_seed(seed)
}

#[pymodule(gil_used = true)]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("Error", module.py().get_type::<errors::Error>())?;
    module.add_class::<Scene>()?;
    module.add_class::<Loss>()?;
    module.add_class::<Steps>()?;
    module.add_function(wrap_pyfunction!(files::read_exr, module)?)?;
    module.add_function(wrap_pyfunction!(files::write_exr, module)?)?;
    module.add_function(wrap_pyfunction!(files::write_png, module)?)?;
    module.add_function(wrap_pyfunction!(main, module)?)?;
    module.add_function(wrap_pyfunction!(independent_seed, module)?)
}
