//! Numerical stability: scenes with something extreme, and the well-conditioned scenes that must
//! look and change alike.
//!
//! A [`Condition`] is such a pair; [`examine`] renders both with independent random numbers and
//! compares the images and every derivative image, and pairs reverse-mode gradients of the extreme
//! scene with the same parameters.

mod bodies;
mod condition;
mod lights;
mod matter;
#[allow(unreachable_pub, reason = "shared with the tests of drt-estimators")]
#[path = "../../../drt-estimators/tests/all/common/pairing.rs"]
mod pairing;
mod similar;

use crate::Result;

pub use condition::{Case, Condition, Row, Table, examine};

/// How many of the conditions to list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// One of each kind, few samples.
    Short,
    /// All of them, many samples.
    Full,
}

/// The conditions.
///
/// # Errors
/// When the library rejects a scene.
pub fn conditions(extent: Extent) -> Result<Vec<Condition>> {
    let mut all = similar::conditions(extent)?;
    all.extend(bodies::conditions()?);
    all.extend(lights::conditions()?);
    all.extend(matter::conditions()?);
    if extent == Extent::Full {
        for c in &mut all {
            c.samples *= 16;
        }
    }
    Ok(all)
}
