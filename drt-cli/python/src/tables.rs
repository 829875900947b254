//! Dictionaries as TOML, in which the readers of jobs know their keys.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use toml::{Table, Value};

use crate::errors::raised;

/// The text of a document with these keys.
pub(crate) fn text(keys: &Bound<'_, PyDict>) -> PyResult<String> {
    toml::to_string_pretty(&table(keys)?).map_err(|e| raised(&e))
}

fn table(keys: &Bound<'_, PyDict>) -> PyResult<Table> {
    let pair = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let key: String = key.extract()?;
        let value = self::value(&value, &key)?;
        Ok((key, value))
    };
    keys.iter().map(pair).collect()
}

/// A value; `key` is what messages call it.
fn value(of: &Bound<'_, PyAny>, key: &str) -> PyResult<Value> {
    let list = |items: Vec<Bound<'_, PyAny>>| {
        let items: PyResult<Vec<Value>> = items.iter().map(|item| value(item, key)).collect();
        items.map(Value::Array)
    };
    // Before whole numbers, of which Python takes them for some.
    if of.is_instance_of::<PyBool>() {
        Ok(Value::Boolean(of.extract()?))
    } else if of.is_instance_of::<PyInt>() {
        Ok(Value::Integer(of.extract()?))
    } else if of.is_instance_of::<PyFloat>() {
        Ok(Value::Float(of.extract()?))
    } else if of.is_instance_of::<PyString>() {
        Ok(Value::String(of.extract()?))
    } else if let Ok(keys) = of.cast::<PyDict>() {
        table(keys).map(Value::Table)
    } else if let Ok(items) = of.cast::<PyList>() {
        list(items.iter().collect())
    } else if let Ok(items) = of.cast::<PyTuple>() {
        list(items.iter().collect())
    } else if of.hasattr("tolist")? {
        // Arrays and numbers of NumPy.
        value(&of.call_method0("tolist")?, key)
    } else if of.hasattr("__fspath__")? {
        value(&of.call_method0("__fspath__")?, key)
    } else {
        let found = of.get_type().name()?;
        Err(PyTypeError::new_err(format!(
            "`{key}` is a {found}; expected what TOML has: a number, a string, a list or a dict"
        )))
    }
}
