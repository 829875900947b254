use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use drt_math::{Rgb, fm};

use crate::error::Cause;
use crate::geometry::finite;
use crate::{Applied, MotionError};

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
}

/// How a value changes with theta. Scalars are colours with equal channels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum ValueChange {
    /// value + theta a.
    Add(Rgb),
    /// value (1 + theta m).
    Multiply(f64),
    /// value exp(theta m).
    MultiplyLog(f64),
}

impl ValueChange {
    /// The changed value at theta.
    #[must_use]
    pub fn at(&self, value: Rgb, theta: f64) -> Rgb {
        self.map(theta).value(value)
    }

    /// The derivative with respect to theta, from the value *after* the change.
    ///
    /// Not finite for a [`Multiply`](Self::Multiply) that has just wiped out its value,
    /// 1 + theta m = 0; [`change_value`], which starts from the value before, has no such exception.
    #[must_use]
    pub fn rate(&self, value_after: Rgb, theta: f64) -> Rgb {
        match *self {
            Self::Add(a) => a,
            Self::Multiply(m) => value_after * (m / (1.0 + theta * m)),
            Self::MultiplyLog(m) => value_after * m,
        }
    }

    /// The change at theta as a map of the value before.
    #[must_use]
    pub fn map(&self, theta: f64) -> ValueMap {
        match *self {
            Self::Add(a) => ValueMap { factor: 1.0, offset: a * theta },
            Self::Multiply(m) => ValueMap { factor: 1.0 + theta * m, offset: Rgb::ZERO },
            Self::MultiplyLog(m) => ValueMap { factor: fm::exp(theta * m), offset: Rgb::ZERO },
        }
    }

    /// The derivative of [`map`](Self::map) with respect to theta.
    #[must_use]
    pub fn map_rate(&self, theta: f64) -> ValueMap {
        match *self {
            Self::Add(a) => ValueMap { factor: 0.0, offset: a },
            Self::Multiply(m) => ValueMap { factor: m, offset: Rgb::ZERO },
            Self::MultiplyLog(m) => ValueMap { factor: m * fm::exp(theta * m), offset: Rgb::ZERO },
        }
    }

    /// The kind of change, as job files spell it.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Add(_) => "add",
            Self::Multiply(_) | Self::MultiplyLog(_) => "multiply",
        }
    }
}

/// The map value -> factor value + offset; as a rate, the derivative of such a map.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ValueMap {
    /// Multiplies the value.
    pub factor: f64,
    /// Added after.
    pub offset: Rgb,
}

impl ValueMap {
    /// The map that changes nothing.
    pub const IDENTITY: Self = Self { factor: 1.0, offset: Rgb::ZERO };
    /// The map to zero: as a rate, no change.
    pub const ZERO: Self = Self { factor: 0.0, offset: Rgb::ZERO };

    /// Image of a value.
    #[inline]
    #[must_use]
    pub fn value(&self, v: Rgb) -> Rgb {
        v * self.factor + self.offset
    }

    /// This map after another: `self ∘ first`.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        Self { factor: self.factor * first.factor, offset: self.value(first.offset) }
    }

    /// Sum of two rates.
    #[must_use]
    pub fn plus(&self, o: &Self) -> Self {
        Self { factor: self.factor + o.factor, offset: self.offset + o.offset }
    }

    fn is_finite(&self) -> bool {
        self.factor.is_finite() && self.offset.is_finite()
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
