//! The derivative of a recorded path and of each of its factors, against dual numbers.

mod antithetic;
mod both_ends;
mod changes;
pub(crate) mod choice;
mod factors;
mod guided;
mod moving;
mod probes;
mod records;
mod replay;
#[path = "../../../tests/all/common/mod.rs"]
pub(crate) mod scenes;
mod setup;
mod velocity;
mod voxels;

use drt_math::Real;

/// How surfaces with interpolated normals fade at their horizons: linearly over the last 0.005 of a
/// cosine.
fn fade<T: Real>(cosine: T) -> T {
    let c = cosine.abs() / 0.005;
    if c.re() < 1.0 { c } else { T::one() }
}
