//! Images and values as NumPy arrays.

use drt_estimators::{Estimate, Layer};
use drt_math::Rgb;
use numpy::{IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;

use crate::errors::raised;

/// An array of doubles.
pub(crate) type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// An image, or its standard errors, as rows × columns × 3.
pub(crate) type Pair<'py> = (Array<'py>, Array<'py>);

/// Numbers as an array of a shape that has as many.
pub(crate) fn array<'py>(
    py: Python<'py>,
    shape: Vec<usize>,
    numbers: Vec<f64>,
) -> PyResult<Array<'py>> {
    numbers.into_pyarray(py).reshape(shape)
}

/// An image and its standard errors.
pub(crate) fn layer<'py>(py: Python<'py>, layer: &Layer) -> PyResult<Pair<'py>> {
    let all = |part: fn(&Estimate) -> Rgb| -> Vec<f64> {
        layer.pixels.iter().flat_map(|pixel| part(pixel).to_array()).collect()
    };
    let pack = |numbers: Vec<f64>| image(py, layer.size, numbers);
    Ok((pack(all(|pixel| pixel.mean))?, pack(all(|pixel| pixel.stderr))?))
}

/// Numbers, pixel by pixel and channel by channel, as an image of so many columns and rows.
pub(crate) fn image<'py>(
    py: Python<'py>,
    [columns, rows]: [u32; 2],
    numbers: Vec<f64>,
) -> PyResult<Array<'py>> {
    array(py, vec![rows as usize, columns as usize, 3], numbers)
}

/// The numbers of an array, which has to be contiguous.
pub(crate) fn numbers<'a>(array: &'a PyReadonlyArrayDyn<'_, f64>) -> PyResult<&'a [f64]> {
    array.as_slice().map_err(|e| raised(&e))
}

/// The pixels of an image.
pub(crate) fn pixels(image: &PyReadonlyArrayDyn<'_, f64>) -> PyResult<Vec<Rgb>> {
    Ok(numbers(image)?.as_chunks().0.iter().map(|rgb: &[f64; 3]| Rgb::from(*rgb)).collect())
}
