use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use drt_math::{Rgb, ValueChange, ValueMap};

use super::Applied;
use crate::error::{Cause, MotionError, finite};

/// How a number or colour of a material, medium, light or camera changes with theta.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PropertyChange {
    /// Name of the property, such as `sigma_t`.
    pub property: String,
    /// What happens to its value.
    pub op: ValueChange,
    /// The one voxel that changes, x fastest; `None` for the whole property.
    pub voxels: Option<[usize; 3]>,
    /// What changes of the texture that stands for the property; `None` for the property as a whole.
    pub texels: Option<Texels>,
}

impl PropertyChange {
    /// A change of a whole property.
    #[must_use]
    pub fn new(property: impl Into<String>, op: ValueChange) -> Self {
        Self { property: property.into(), op, voxels: None, texels: None }
    }
}

/// Texels of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Texels {
    /// All of them, each by the same change.
    All,
    /// The one in a column and row.
    One([usize; 2]),
}

impl Texels {
    /// The one, where it is one.
    #[must_use]
    pub fn one(self) -> Option<[usize; 2]> {
        match self {
            Self::All => None,
            Self::One(texel) => Some(texel),
        }
    }
}

/// All changes of one value together.
#[derive(Clone, Debug, PartialEq)]
pub struct ChangedValue {
    /// From the value in the scene file to the value at the parameters' values.
    pub map: ValueMap,
    /// Per parameter, the derivative of that map: a function of the value in the scene *file*.
    pub rates: Vec<ValueMap>,
}

/// Composes the changes of one value of a property, in the order given, for `parameters`
/// parameters in all. Changes confined to another voxel than `voxel` are passed over.
///
/// # Errors
/// When a number is not finite, or a parameter's index is not below `parameters`.
pub fn change_value(
    changes: &[Applied<'_, PropertyChange>],
    voxel: Option<[usize; 3]>,
    parameters: usize,
) -> Result<ChangedValue, MotionError> {
    let mut map = ValueMap::IDENTITY;
    let mut rates = vec![ValueMap::ZERO; parameters];
    let here =
        |c: &&Applied<'_, PropertyChange>| c.change.voxels.is_none() || c.change.voxels == voxel;
    for &Applied { parameter, theta, change } in changes.iter().filter(here) {
        let fail = |cause| MotionError { parameter, change: change.op.kind(), cause };
        finite(theta.is_finite(), "the parameter's value").map_err(fail)?;
        let step = change.op.map(theta);
        let rate = change.op.map_rate(theta).after(&map);
        finite(step.is_finite() && rate.is_finite(), "the changed value").map_err(fail)?;
        for r in &mut rates {
            // Only the factor passes derivatives on: the offset depends on this parameter alone.
            *r = ValueMap { factor: step.factor, offset: Rgb::ZERO }.after(r);
        }
        let own = rates.get_mut(parameter);
        let own = own.ok_or_else(|| fail(Cause::ParameterIndex { count: parameters }))?;
        *own = own.plus(&rate);
        map = step.after(&map);
    }
    Ok(ChangedValue { map, rates })
}
