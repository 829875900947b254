//! Numbers in attributes.

use drt_math::{Vec3, vec3};

use super::element::Element;
use crate::CliError;

/// The `value` of a property that has nothing else.
pub(super) fn plain_value(e: &Element) -> Result<&str, CliError> {
    e.only_attributes(&["name", "value", "id"])?;
    if let Some(child) = e.children.first() {
        return Err(child.error(format!("not supported inside {e}")));
    }
    e.required("value")
}

/// The numbers in the `value` of a property that has nothing else.
pub(super) fn plain_numbers(e: &Element) -> Result<Vec<f64>, CliError> {
    numbers(e, plain_value(e)?)
}

/// Numbers separated by blanks or commas.
pub(super) fn numbers(e: &Element, text: &str) -> Result<Vec<f64>, CliError> {
    text.split(|c: char| c.is_whitespace() || c == ',')
        .filter(|word| !word.is_empty())
        .map(|word| number(e, "value", word))
        .collect()
}

/// One finite number.
pub(super) fn number(e: &Element, key: &str, word: &str) -> Result<f64, CliError> {
    match word.trim().parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err(e.error(format!("`{key}` holds `{word}`; expected a finite number"))),
    }
}

/// Three numbers in an attribute.
pub(super) fn triple(e: &Element, key: &str) -> Result<Vec3, CliError> {
    match *numbers(e, e.required(key)?)? {
        [x, y, z] => Ok(vec3(x, y, z)),
        _ => Err(e.error(format!("`{key}` must hold three numbers"))),
    }
}
