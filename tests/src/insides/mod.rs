//! The inside does not matter: one change of a scene, with media that follow it in every way that is
//! right, has one derivative image (theory sheet §4.1).
//!
//! A [`Case`] is a scene with one parameter and [`Way`]s to move the insides, most of them right and
//! some wrong. [`Finding`] is what the images show.

pub mod cases;
mod examine;
pub mod sheets;
mod stirred;

pub use cases::Case;
pub use examine::{Finding, Table, Verdict, examine, references, stored};
pub use stirred::Stirred;

use drt_estimators::InteriorMotion;
use drt_motion::Parameter;

/// How the insides of all media move.
#[derive(Clone, Debug)]
pub struct Way {
    /// The name in tables.
    pub name: &'static str,
    /// By the medium's index; the plan chooses for others.
    pub insides: Vec<(usize, InteriorMotion)>,
    /// What is computed with it.
    pub parameter: Parameter,
}
