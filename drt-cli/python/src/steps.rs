//! Steps of an optimisation.

use drt_cli::FieldSteps;
use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Array, array, numbers};
use crate::errors::raised;
use crate::scene::Scene;
use crate::tables;

/// Steps one unknown, or the values of a group, against gradients by Adam.
#[pyclass(module = "drt._core")]
pub(crate) struct Steps {
    steps: FieldSteps,
    shape: Vec<usize>,
}

#[pymethods]
impl Steps {
    /// Begins with the present values of an unknown. The keys are those of a `[[parameter_group]]` that say how it is stepped.
    #[new]
    fn new(
        py: Python<'_>,
        scene: &Scene,
        name: &str,
        rate: f64,
        keys: &Bound<'_, PyDict>,
    ) -> PyResult<Self> {
        let text = tables::text(keys)?;
        let turn = scene.turn(py)?;
        let unknown = crate::scene::find(&turn.prepared, name)?;
        let steps = turn.prepared.steps(unknown, rate, &text).map_err(|e| raised(&e))?;
        Ok(Self { steps, shape: turn.prepared.shape(unknown).unwrap_or_default() })
    }

    /// Takes one step, and returns the values reached.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        gradient: PyReadonlyArrayDyn<'py, f64>,
        iteration: u32,
    ) -> PyResult<Array<'py>> {
        let gradient = numbers(&gradient)?;
        self.steps.step(gradient, iteration, 1.0).map_err(|e| raised(&e))?;
        array(py, self.shape.clone(), self.steps.values().to_vec())
    }

    /// Takes back all but a part of the last step, and returns the values that are left.
    fn shorten<'py>(&mut self, py: Python<'py>, part: f64) -> PyResult<Array<'py>> {
        self.steps.shorten(part);
        array(py, self.shape.clone(), self.steps.values().to_vec())
    }
}
