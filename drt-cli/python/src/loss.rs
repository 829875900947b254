//! The losses that the command knows.

use drt_estimators::loss;
use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;

use crate::arrays::{Array, image, numbers, pixels};
use crate::errors::{Error, raised};

/// A distance from a target image, and its derivative with respect to every pixel.
#[pyclass(frozen, module = "drt._core")]
pub(crate) struct Loss {
    loss: loss::Loss,
    reference: loss::Reference,
}

#[pymethods]
impl Loss {
    #[new]
    fn new(
        target: PyReadonlyArrayDyn<'_, f64>,
        size: [u32; 2],
        kind: &str,
        mask: Option<PyReadonlyArrayDyn<'_, f64>>,
        levels: u32,
        weight: f64,
    ) -> PyResult<Self> {
        let loss = match kind {
            "l2" => loss::Loss::L2,
            "l1" => loss::Loss::L1,
            "rmse" => loss::Loss::Rmse,
            "pyramid-l2" => loss::Loss::PyramidL2 { levels, weight },
            _ => {
                let message = format!(
                    "`kind` is \"{kind}\"; expected \"l2\", \"l1\", \"rmse\" or \"pyramid-l2\""
                );
                return Err(Error::new_err(message));
            }
        };
        loss.check().map_err(|e| raised(&e))?;
        let reference = loss::Reference::new(size, pixels(&target)?).map_err(|e| raised(&e))?;
        let reference = match mask {
            Some(mask) => reference.with_mask(numbers(&mask)?.to_vec()).map_err(|e| raised(&e))?,
            None => reference,
        };
        Ok(Self { loss, reference })
    }

    /// The loss of an image of the target's size, and its derivative with respect to every pixel.
    fn __call__<'py>(
        &self,
        py: Python<'py>,
        of: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<(f64, Array<'py>)> {
        let pixels = pixels(&of)?;
        let value = self.loss.value(&pixels, &self.reference);
        let adjoint = self.loss.adjoint(&pixels, &self.reference);
        let adjoint: Vec<f64> = adjoint.iter().flat_map(|a| a.to_array()).collect();
        Ok((value, image(py, self.reference.size(), adjoint)?))
    }
}
