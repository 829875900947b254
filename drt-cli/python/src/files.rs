//! Image files.

use std::io::Write as _;
use std::path::PathBuf;

use drt_cli::files::image::{NamedLayer, encode_texels, write_layers};
use drt_cli::{Tone, write_atomically};
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::pixels;
use crate::errors::raised;

/// The layers of an EXR file by name, in the order of their job; the image itself is the one without a name.
#[pyfunction]
pub(crate) fn read_exr<'py>(py: Python<'py>, path: PathBuf) -> PyResult<Bound<'py, PyDict>> {
    let file = py.detach(|| drt_cli::read_exr(&path)).map_err(|e| raised(&e))?;
    let [columns, rows] = file.size.map(|n| n as usize);
    let layers = PyDict::new(py);
    for (name, pixels) in file.in_order() {
        let numbers = pixels.as_flattened().to_vec().into_pyarray(py);
        layers.set_item(name, numbers.reshape([rows, columns, 3])?)?;
    }
    Ok(layers)
}

/// Writes an image of so many columns and rows as EXR.
#[pyfunction]
pub(crate) fn write_exr(
    py: Python<'_>,
    path: PathBuf,
    size: [u32; 2],
    image: PyReadonlyArrayDyn<'_, f64>,
) -> PyResult<()> {
    let pixels = pixels(&image)?;
    py.detach(|| {
        let bytes = encode_texels(size, &pixels).unwrap_or_default();
        write_atomically(&path, |out| Ok(out.write_all(&bytes)?))
    })
    .map_err(|e| raised(&e))
}

/// Writes a picture of images by name, side by side.
#[pyfunction]
pub(crate) fn write_png(
    py: Python<'_>,
    path: PathBuf,
    size: [u32; 2],
    layers: Vec<(String, PyReadonlyArrayDyn<'_, f64>)>,
    exposure: Option<f64>,
) -> PyResult<()> {
    let mut shown = Vec::new();
    for (name, image) in &layers {
        let single = pixels(image)?.iter().map(|p| p.to_array().map(|v| v as f32)).collect();
        shown.push((name.as_str(), single));
    }
    let tone = Tone { exposure, ..Tone::default() };
    py.detach(|| {
        let layers: Vec<NamedLayer<'_>> =
            shown.iter().map(|(name, pixels): &(_, Vec<_>)| (*name, pixels.as_slice())).collect();
        write_layers(&path, size, &layers, tone)
    })
    .map_err(|e| raised(&e))
}
