//! What is asked of lists of numbers before they are computed with.

use super::OptimizeError;

pub(super) fn same_length(
    what: &'static str,
    expected: usize,
    list: &[f64],
) -> Result<(), OptimizeError> {
    if list.len() == expected {
        return Ok(());
    }
    Err(OptimizeError::Length { what, expected, found: list.len() })
}

pub(super) fn all_finite(what: &'static str, list: &[f64]) -> Result<(), OptimizeError> {
    match list.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(variable) => Err(OptimizeError::NotFinite { variable, what }),
    }
}
