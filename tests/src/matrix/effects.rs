//! Effects, by what they do to one target.

use drt_math::{Rgb, Vec3};
use drt_motion::{Effect, GeometryChange, ValueChange};

use crate::motion::{changes, moves};

/// Moves by a vector per unit of the parameter.
pub(crate) fn translate(target: &str, by: Vec3) -> Effect {
    moves(target, GeometryChange::Translate(by))
}

/// Turns about an axis through a point.
pub(crate) fn turn(target: &str, axis: Vec3, pivot: Vec3) -> Effect {
    moves(target, GeometryChange::Rotate { axis, pivot })
}

/// Grows along the coordinate axes from a point.
pub(crate) fn grow(target: &str, factor: Vec3, pivot: Vec3) -> Effect {
    moves(target, GeometryChange::Scale { factor, pivot })
}

/// Adds to a number or colour.
pub(crate) fn add(target: &str, property: &str, amount: impl Into<Rgb>) -> Effect {
    changes(target, property, ValueChange::Add(amount.into()))
}

/// Adds to a number.
pub(crate) fn raise(target: &str, property: &str, amount: f64) -> Effect {
    add(target, property, [amount; 3])
}
