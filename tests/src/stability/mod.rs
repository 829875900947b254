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
#[path = "../../../drt-estimators/tests/common/pairing.rs"]
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

/// Conditions under which everything agrees.
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

/// Conditions under which derivatives are known to be wrong: edges of different shapes that
/// coincide count once for each shape, visibility past an edge that lies on another surface is
/// undecided, and edges of a huge shape leave no samples to those of a small one.
///
/// # Errors
/// When the library rejects a scene.
pub fn unsolved() -> Result<Vec<Condition>> {
    let all = [bodies::unsolved()?, lights::unsolved()?].concat();
    Ok(all.into_iter().map(|c| c.samples(1 << 13)).collect())
}
