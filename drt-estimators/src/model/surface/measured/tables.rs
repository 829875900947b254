//! The arrays of a measured material, as files hold them, and what they must be.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

/// Numbers by so many indices, the last one of which is the next in memory.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tensor {
    /// How many values each index has.
    pub shape: Vec<usize>,
    /// As many values as the product of these.
    pub values: Vec<f32>,
}

/// The arrays of a [`Measured`](super::Measured) material, under the names that they have in the files of the RGL database
/// (Dupuy & Jakob 2018).
///
/// Azimuths are counted from the direction in which the texture coordinate u grows. In the unit square of normals x is √(2θ/π) and y is
/// (φ + π)/2π, with the angles of a normal, φ less `phi_i` in isotropic files; that of `sigma` has those of the viewer's direction.
/// Columns of a grid are along x, rows along y; the first and the last are on the border of the square.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MeasuredTables {
    /// Azimuths of the viewer, in radians, increasing; one or two in isotropic files. Where they span half a turn or a quarter, the
    /// material is the same in the others, turned or mirrored.
    pub phi_i: Vec<f32>,
    /// Angles of the viewer with the normal, in radians, increasing.
    pub theta_i: Vec<f32>,
    /// Density of normals, rows × columns.
    pub ndf: Tensor,
    /// Projected area of the microfacets, rows × columns.
    pub sigma: Tensor,
    /// Density of visible normals, of any scale: `phi_i` × `theta_i` × rows × columns.
    pub vndf: Tensor,
    /// How much light comes from each place of the square that `vndf` is drawn by: `phi_i` × `theta_i` × n × n.
    pub luminance: Tensor,
    /// Values there, linear sRGB: `phi_i` × `theta_i` × 3 × n × n.
    pub rgb: Tensor,
    /// True where these values lack the factor of `ndf` over 4 `sigma`.
    pub jacobian: bool,
}

/// What is wrong with an array of a measured material.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{field}` {reason}")]
#[non_exhaustive]
pub struct MeasuredError {
    /// The array.
    pub field: &'static str,
    /// What is wrong with it.
    pub reason: String,
}

impl MeasuredError {
    pub(super) fn new(field: &'static str, reason: impl fmt::Display) -> Self {
        Self { field, reason: alloc::format!("{reason}") }
    }
}

impl MeasuredTables {
    /// Checks shapes and numbers.
    pub(super) fn check(&self) -> Result<(), MeasuredError> {
        increasing("phi_i", &self.phi_i)?;
        increasing("theta_i", &self.theta_i)?;
        let [phis, thetas] = [self.phi_i.len(), self.theta_i.len()];
        shape("ndf", &self.ndf, &[None; 2])?;
        shape("sigma", &self.sigma, &[None; 2])?;
        shape("vndf", &self.vndf, &[Some(phis), Some(thetas), None, None])?;
        shape("luminance", &self.luminance, &[Some(phis), Some(thetas), None, None])?;
        let side = self.luminance.shape[2];
        shape("luminance", &self.luminance, &[Some(phis), Some(thetas), None, Some(side)])?;
        let sides = [Some(phis), Some(thetas), Some(3), Some(side), Some(side)];
        shape("rgb", &self.rgb, &sides)?;
        let cells = self.luminance.values.chunks_exact(side * side);
        for (luminance, rgb) in cells.zip(self.rgb.values.chunks_exact(3 * side * side)) {
            let dark = |i: &usize| luminance[*i % (side * side)] == 0.0 && rgb[*i] > 0.0;
            if let Some(i) = (0..rgb.len()).find(dark) {
                let (row, column) = (i / side % side, i % side);
                let reason =
                    alloc::format!("is 0 in row {row}, column {column}, where `rgb` is {}", rgb[i]);
                return Err(MeasuredError::new("luminance", reason));
            }
        }
        Ok(())
    }
}

fn increasing(field: &'static str, values: &[f32]) -> Result<(), MeasuredError> {
    if values.is_empty() {
        return Err(MeasuredError::new(field, "is empty"));
    }
    finite(field, values)?;
    match values.windows(2).find(|pair| pair[0] >= pair[1]) {
        None => Ok(()),
        Some(pair) => {
            let reason = alloc::format!("has {} after {}; it must increase", pair[1], pair[0]);
            Err(MeasuredError::new(field, reason))
        }
    }
}

fn finite(field: &'static str, values: &[f32]) -> Result<(), MeasuredError> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(i) => Err(MeasuredError::new(
            field,
            alloc::format!("is {} at index {i}; expected finite numbers", values[i]),
        )),
    }
}

/// Checks for a shape, of which `None` are rows or columns of any number from two on, and for numbers of 0 or more.
fn shape(field: &'static str, t: &Tensor, wanted: &[Option<usize>]) -> Result<(), MeasuredError> {
    let fits = |(have, want): (&usize, &Option<usize>)| want.map_or(*have >= 2, |n| *have == n);
    let size = t.shape.iter().try_fold(1_usize, |size, n| size.checked_mul(*n));
    if t.shape.len() != wanted.len()
        || !t.shape.iter().zip(wanted).all(fits)
        || size != Some(t.values.len())
        || t.shape.iter().rev().take(2).any(|n| *n < 2)
    {
        let mut names = ["rows", "columns"].into_iter();
        let mut expected = String::new();
        for want in wanted {
            let space = if expected.is_empty() { "" } else { " × " };
            let name = match want {
                Some(n) => alloc::format!("{n}"),
                None => names.next().unwrap_or("columns").into(),
            };
            expected = expected + space + &name;
        }
        let found = alloc::format!("{:?} with {} values", t.shape, t.values.len());
        let reason = alloc::format!("has the shape {found}; expected {expected}, two at least");
        return Err(MeasuredError::new(field, reason));
    }
    finite(field, &t.values)?;
    match t.values.iter().position(|v| *v < 0.0) {
        None => Ok(()),
        Some(i) => Err(MeasuredError::new(
            field,
            alloc::format!("is {} at index {i}; expected 0 or more", t.values[i]),
        )),
    }
}
